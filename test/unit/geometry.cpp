// Rotations, parallel transport and framed curves (thesis chapter 3).
#include <limits>

#include <gtest/gtest.h>

#include "slender_sim/geometry/framed_curve.h"
#include "slender_sim/geometry/rotation.h"
#include "test/support/rods.h"

namespace slender::test {
namespace {

TEST(ParallelTransport, IsTheSmallestRotation)
{
  Random random(21);
  for (int k = 0; k < 200; ++k)
  {
    const Vector3d a = random.direction(), b = random.direction(), v = random.vector();
    if (1.0 + a.dot(b) < 1e-2)
      continue;
    const double tolerance = 1e-13 / (1.0 + a.dot(b));   // (3.9) divides by 1 + a.b
    EXPECT_LT((parallelTransport(a, a, b) - b).norm(), tolerance);
    EXPECT_LT((parallelTransport(a.cross(b), a, b) - a.cross(b)).norm(), tolerance);
    EXPECT_NEAR(parallelTransport(v, a, b).norm(), v.norm(), tolerance);
    EXPECT_LT((parallelTransport(parallelTransport(v, a, b), b, a) - v).norm(), tolerance);
    EXPECT_LT((parallelTransport(v, a, b) - Eigen::Quaterniond::FromTwoVectors(a, b) * v).norm(), 10 * tolerance);
    EXPECT_EQ(parallelTransport(v, a, a), Vector3d(a.dot(a) * v));
  }
}

TEST(RotationBetween, TakesOneDirectionToTheOther)
{
  Random random(24);
  for (int k = 0; k < 200; ++k)
  {
    const Vector3d a = random.direction(), b = random.direction();
    const Eigen::Quaterniond q = rotationBetween(3.0 * a, 0.2 * b);
    EXPECT_LT((q * a - b).norm(), 1e-14);   // some roundings
    // the smallest rotation has no twist; acos loses half of the digits near its ends
    EXPECT_NEAR(rotationVector(q).norm(), std::acos(a.dot(b)), 1e-7);
  }
  for (double off : {0.0, 1e-13, 1e-11, 1e-8, 1e-4})   // near opposite directions
  {
    const Vector3d a = random.direction(), b = rotateAbout(-a, anyNormal(a), off);
    EXPECT_LT((rotationBetween(a, b) * a - b).norm(), 1e-14)
        << off;   // some roundings; the half turn stands for 1e-15 and less
  }
  EXPECT_EQ(rotationBetween(Vector3d::UnitZ(), Vector3d::UnitZ()).coeffs(), Eigen::Quaterniond::Identity().coeffs());
}

TEST(ParallelTransport, StaysARotationNearOpposite)
{
  Random random(22);
  for (double off : {1e-1, 1e-2, 1e-3})
  {
    const Vector3d a = random.direction(), b = rotateAbout(-a, anyNormal(a), off);
    for (const Vector3d& v : {random.direction(), a, anyNormal(a)})
      // 1 + a.b = off^2 / 2 carries an error of one rounding, and so the result 1e-16 / off^2
      EXPECT_NEAR(parallelTransport(v, a, b).norm(), 1.0, 1e-15 / (off * off));
    EXPECT_LT((parallelTransport(a, a, b) - b).norm(), 1e-15 / (off * off));
  }
}

TEST(RotationVector, RoundTrips)
{
  Random random(23);
  for (double angle : {0.0, 1e-14, 1e-9, 1e-8, 1e-5, 0.3, 2.0, 3.0, M_PI - 1e-6, M_PI - 1e-9})
    for (int k = 0; k < 20; ++k)
    {
      const Vector3d w = angle * random.direction();
      EXPECT_LT((rotationVector(fromRotationVector(w)) - w).norm(), 1e-15 + 1e-15 * angle) << angle;
      Eigen::Quaterniond q = fromRotationVector(w);
      q.coeffs() *= -1.0;   // the same rotation
      EXPECT_LT((rotationVector(q) - w).norm(), 1e-15 + 1e-15 * angle) << angle;
      const Vector3d v = random.vector();
      const Vector3d axis = angle > 0 ? Vector3d(w.normalized()) : Vector3d::UnitX();
      EXPECT_LT((fromRotationVector(w) * v - rotateAbout(v, axis, angle)).norm(), 4e-15);
    }
}

TEST(Rotation, SignedAngleAndUnwrap)
{
  Random random(24);
  for (int k = 0; k < 50; ++k)
  {
    const Vector3d t = random.direction(), u = anyNormal(t);
    EXPECT_NEAR(u.norm(), 1.0, 1e-15);
    EXPECT_NEAR(u.dot(t), 0.0, 1e-15);
    const double angle = random.uniform(-3.1, 3.1);
    EXPECT_NEAR(signedAngle(u, rotateAbout(u, t, angle), t), angle, 1e-14);
    const double far = angle + 2 * M_PI * 1000 * random.uniform();
    EXPECT_LE(std::abs(unwrapNear(angle, far) - far), M_PI * (1 + 1e-12));
    EXPECT_NEAR(std::remainder(unwrapNear(angle, far) - angle, 2 * M_PI), 0.0, 1e-11);
  }
}

TEST(FramedCurve, FramesAreAdaptedAndTwistFree)
{
  Random random(25);
  for (bool closed : {false, true})
  {
    const FramedCurve curve(wigglyNodes(15, closed, random), closed, random.direction());
    for (int j = 0; j < curve.edges(); ++j)
    {
      EXPECT_NEAR(curve.d1(j).norm(), 1.0, 1e-14);
      EXPECT_NEAR(curve.d1(j).dot(curve.tangents().col(j)), 0.0, 1e-14);
      EXPECT_LT((curve.d2(j) - curve.tangents().col(j).cross(curve.d1(j))).norm(), 1e-15);
    }
    for (int i = closed ? 1 : 0; i < curve.nodes(); ++i)   // the loop's holonomy stays at node 0
      EXPECT_EQ(curve.twist(i), 0.0);
  }
}

TEST(FramedCurve, TwistIsTheAngleFromTheTransportedFrame)
{
  Random random(26);
  FramedCurve curve(wigglyNodes(9, false, random), false);
  for (int j = 0; j < curve.edges(); ++j)
    curve.theta[j] = random.uniform(-1.0, 1.0);
  for (int i = 1; i + 1 < curve.nodes(); ++i)
  {
    // sin m by (3.11)
    const Vector3d p = parallelTransport(curve.d2(i - 1), curve.tangents().col(i - 1), curve.tangents().col(i));
    EXPECT_NEAR(std::sin(curve.twist(i)), curve.d1(i).dot(p), 1e-13);
  }
}

TEST(FramedCurve, CurvatureOfAKnownTurn)
{
  // a right angle in the plane of d1: |kappa b| = 2 tan(pi/4) = 2, along d1 alone (3.13, 3.14)
  Matrix3Xd x(3, 3);
  x.col(0) = Vector3d(0, 0, 0);
  x.col(1) = Vector3d(1, 0, 0);
  x.col(2) = Vector3d(1, 1, 0);
  const FramedCurve curve(x, false, Vector3d::UnitY());
  EXPECT_NEAR(curve.materialCurvature(1)[0], 2.0, 1e-15);
  EXPECT_NEAR(curve.materialCurvature(1)[1], 0.0, 1e-15);
  EXPECT_LT((curve.curvatureBinormal(1) - Vector3d(0, 0, 2)).norm(), 1e-15);
  EXPECT_EQ(curve.materialCurvature(0).norm(), 0.0);
  EXPECT_EQ(curve.twist(2), 0.0);
}

TEST(FramedCurve, ALoopKeepsItsHolonomyAtNodeZero)
{
  // A frame carried along a closed path of tangents comes back turned by the area that the path encloses on the unit
  // sphere (thesis 3.5). The tangents x, y, z of this loop enclose an eighth of the sphere, pi / 2. With its last
  // tangent, the opposite of their mean, z and x enclose a third of the rest, 7 pi / 6. Together: 5 pi / 3, a turn
  // less pi / 3. By pi / 3 the first frame is thus ahead of the carried frame.
  Matrix3Xd x(3, 4);
  x.col(0) = Vector3d(0, 0, 0);
  x.col(1) = Vector3d(1, 0, 0);
  x.col(2) = Vector3d(1, 1, 0);
  x.col(3) = Vector3d(1, 1, 1);
  FramedCurve curve(x, true);
  EXPECT_NEAR(curve.twist(0), M_PI / 3, 1e-14);
  curve.theta << 0.1, 0.0, 0.0, 0.4;
  EXPECT_NEAR(curve.twist(0), M_PI / 3 - 0.3, 1e-14);
}

TEST(FramedCurve, RefusesBadInput)
{
  const Matrix3Xd good = straightNodes(5, 1.0);
  EXPECT_NO_THROW(FramedCurve(good, false));
  EXPECT_THROW(FramedCurve(straightNodes(2, 1.0).leftCols(1), false), std::invalid_argument);
  EXPECT_THROW(FramedCurve(straightNodes(2, 1.0), true), std::invalid_argument);
  EXPECT_THROW(FramedCurve(good, true), std::invalid_argument);   // the closing edge runs straight back
  Matrix3Xd repeated = good;
  repeated.col(2) = repeated.col(1);
  EXPECT_THROW(FramedCurve(repeated, false), std::invalid_argument);
  Matrix3Xd folded = good;
  folded.col(3) = folded.col(1);
  EXPECT_THROW(FramedCurve(folded, false), std::invalid_argument);
  Matrix3Xd nan = good;
  nan(1, 2) = std::nan("");
  EXPECT_THROW(FramedCurve(nan, false), std::invalid_argument);
  nan(1, 2) = std::numeric_limits<double>::infinity();
  EXPECT_THROW(FramedCurve(nan, false), std::invalid_argument);
  EXPECT_THROW(FramedCurve(good, false, Vector3d::UnitX()), std::invalid_argument);   // parallel to the first edge
  EXPECT_THROW(FramedCurve(good, false, Vector3d(0, std::nan(""), 1)), std::invalid_argument);
}

}   // namespace
}   // namespace slender::test
