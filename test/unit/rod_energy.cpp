// Values and balances of a rod's energy.
#include <gtest/gtest.h>

#include "slender_sim/geometry/framed_curve.h"
#include "test/support/trial.h"

namespace slender::test {
namespace {

class RodEnergy : public ::testing::TestWithParam<bool>
{
protected:
  bool closed() const { return GetParam(); }
  RodModel model(const Matrix3Xd& rest, bool straight, Random& random) const
  {
    const int n = static_cast<int>(rest.cols());
    return buildRod("r", rest, closed(), oddSections(closed() ? n : n - 1, random), Vector3d::Zero(), straight);
  }
  static Matrix3Xd displaced(Matrix3Xd x, double size, Random& random)
  {
    for (int i = 0; i < x.cols(); ++i)
      x.col(i) += random.vector(size);
    return x;
  }
};

TEST_P(RodEnergy, EqualsTheFormulaOnTheFramedCurve)
{
  Random random(51);
  for (int n : {5, 8, 13, 40})
  {
    const Matrix3Xd rest = wigglyNodes(n, closed(), random), x = displaced(rest, 0.2, random);
    const RodModel m = model(rest, false, random);
    const double turns = 6 * M_PI;   // whole turns, as a loop must have
    const RodState state = makeRodState(m, x, Vector3d::Zero(), turns);
    RodSystem system(m);
    system.load(state);
    const RodEvaluation e = system.evaluate(false);
    // thesis 4.2.1-4.2.3, from the curve's own strains
    FramedCurve curve(x, closed());
    const int joints = closed() ? n : n - 2;
    for (int j = 0; j < curve.edges(); ++j)
      curve.theta[j] = turns * j / joints;
    double stretch = 0, bend = 0, twist = 0;
    for (int j = 0; j < m.edges(); ++j)
    {
      const double strain = (x.col((j + 1) % n) - x.col(j)).norm() / m.rest_length[j] - 1.0;
      stretch += 0.5 * m.stretch_modulus[j] * strain * strain * m.rest_length[j];
    }
    for (int i = 0; i < n; ++i)
      if (curve.hasJoint(i))
      {
        const double l = 0.5 * (m.rest_length[(i + m.edges() - 1) % m.edges()] + m.rest_length[i]);
        const Eigen::Vector2d k = curve.materialCurvature(i) - m.rest_curvature.col(i);
        const double twisted = curve.twist(i) + (closed() && i == 0 ? turns : 0.0) - m.rest_twist[i];
        bend += 0.5 *
                (m.bend_modulus(0, i) * k[0] * k[0] + 2 * m.bend_modulus(1, i) * k[0] * k[1] +
                 m.bend_modulus(2, i) * k[1] * k[1]) /
                l;
        twist += 0.5 * m.twist_modulus[i] * twisted * twisted / l;
      }
    EXPECT_GT(stretch, 1e-2);
    EXPECT_GT(bend, 1e-2);
    EXPECT_NEAR(e.stretch, stretch, 1e-13 * stretch * n);   // sums of n terms
    EXPECT_NEAR(e.bend_twist, bend + twist, 1e-12 * (bend + twist));
    const RodStepper stepper(std::make_shared<RodModel>(m), TimeConfig{});
    const RodEnergies parts = stepper.energies(state, Vector3d(0, 0, -9.81));
    EXPECT_NEAR(parts.stretch, stretch, 1e-13 * stretch * n);
    EXPECT_NEAR(parts.bend, bend, 1e-12 * (bend + twist));
    EXPECT_NEAR(parts.twist, twist, 1e-12 * (bend + twist));
    EXPECT_NEAR(parts.gravity, 9.81 * x.row(2).dot(m.mass), 1e-12 * (1 + std::abs(parts.gravity)));
  }
}

TEST_P(RodEnergy, ZeroAtRest)
{
  Random random(52);
  for (bool straight : {false, true})
  {
    if (straight && closed())
      continue;   // a naturally straight loop is never at rest
    const int n = 14;
    const Matrix3Xd rest = straight ? straightNodes(n, 1.0) : wigglyNodes(n, closed(), random);
    const RodModel m = model(rest, straight, random);
    RodState state = makeRodState(m, rest, Vector3d::Zero());
    RodSystem system(m);
    system.load(state);
    const RodEvaluation e = system.evaluate(false);
    // strains are rounded at 1e-15, energies are their squares
    EXPECT_LT(e.energy(), 1e-27);
    EXPECT_LT(gradientOf(system).lpNorm<Eigen::Infinity>(), 1e-13 / m.rest_length.minCoeff());
    // and not zero anywhere else
    state.x.col(n / 2) += Vector3d(0.01, 0.02, 0.03);
    system.load(state);
    EXPECT_GT(system.evaluate(false).energy(), 1e-6);
  }
}

TEST_P(RodEnergy, UnchangedByRigidMotion)
{
  Random random(53);
  const int n = 11;
  const Matrix3Xd rest = wigglyNodes(n, closed(), random), x = displaced(rest, 0.2, random);
  const RodModel m = model(rest, false, random);
  const RodState state = makeRodState(m, x, Vector3d::Zero(), 2 * M_PI);
  RodSystem system(m);
  system.load(state);
  const RodEvaluation before = system.evaluate(true);
  const Eigen::VectorXd gradient = gradientOf(system);
  const Eigen::Quaterniond q = random.rotation();
  RodState moved = state;
  for (int i = 0; i < n; ++i)
    moved.x.col(i) = q * Vector3d(state.x.col(i)) + Vector3d(3, -2, 5);
  for (int j = 0; j < m.edges(); ++j)
    moved.d1.col(j) = q * Vector3d(state.d1.col(j));
  system.load(moved);
  const RodEvaluation after = system.evaluate(true);
  EXPECT_NEAR(after.stretch, before.stretch, 1e-13 * before.stretch * n);
  EXPECT_NEAR(after.bend_twist, before.bend_twist, 1e-13 * before.bend_twist * n);
  Eigen::VectorXd turned = gradient;
  for (int i = 0; i < n; ++i)
    turned.segment<3>(4 * i) = q * Vector3d(gradient.segment<3>(4 * i));
  EXPECT_LT((gradientOf(system) - turned).norm(), 1e-12 * gradient.norm());
}

TEST_P(RodEnergy, RigidMotionOfTheTrialIsFollowedByTheFrames)
{
  // The same rotation reached from the unrotated base: frames come by transport in time and need a turn about each
  // tangent to follow rigidly. The total is the rigidly rotated energy only if relaxing finds that turn: compare the
  // minima over the frames.
  Random random(54);
  const int n = 9;
  const Matrix3Xd rest = wigglyNodes(n, closed(), random), x = displaced(rest, 0.1, random);
  const RodModel m = model(rest, false, random);
  RodState state = makeRodState(m, x, Vector3d::Zero());
  RodSystem system(m);
  system.load(state);
  system.relaxFrames();
  system.store(state);
  const double before = system.evaluate(false).energy();
  const Eigen::Quaterniond q(Eigen::AngleAxisd(0.6, random.direction()));
  system.load(state);
  for (int i = 0; i < n; ++i)
    system.setPosition(i, q * Vector3d(state.x.col(i)));
  system.relaxFrames();
  EXPECT_NEAR(system.evaluate(false).energy(), before, 1e-9 * before);   // relaxed to 1e-10 rad
  RodState after = state;
  system.store(after);
  for (int j = 0; j < m.edges(); ++j)
    EXPECT_LT((after.d1.col(j) - q * Vector3d(state.d1.col(j))).norm(), 1e-8);
}

TEST_P(RodEnergy, ForcesAndMomentsOfAFreeRodVanish)
{
  Random random(55);
  for (int n : {6, 21})
  {
    const Matrix3Xd rest = wigglyNodes(n, closed(), random), x = displaced(rest, 0.2, random);
    const RodModel m = model(rest, false, random);
    RodSystem system(m);
    system.load(makeRodState(m, x, Vector3d::Zero(), 2 * M_PI));
    system.evaluate(false);
    const Eigen::VectorXd g = gradientOf(system);
    Vector3d force = Vector3d::Zero(), moment = Vector3d::Zero();
    double size = 0;
    for (int i = 0; i < n; ++i)
    {
      const Vector3d f = g.segment<3>(4 * i);
      force += f;
      moment += x.col(i).cross(f);
      if (i < m.edges())
        moment += g[4 * i + 3] * (x.col((i + 1) % n) - x.col(i)).normalized();   // torque of the edge angle
      size += f.norm();
    }
    ASSERT_GT(size, 1.0);
    EXPECT_LT(force.norm(), 1e-14 * size);
    EXPECT_LT(moment.norm(), 1e-13 * size * n / 6.0);   // levers up to n
  }
}

INSTANTIATE_TEST_SUITE_P(OpenAndClosed, RodEnergy, ::testing::Bool());

TEST(StretchEnergy, UniformStretchIsExact)
{
  // E = 1/2 k_s strain^2 L, tension k_s strain (thesis 4.2.1)
  Rod rod = straightRod(12, 2.0, modulusSection(1.0, 1.0, 500.0, 1.0));
  rod.state.x *= 1.1;
  RodSystem system(*rod.model);
  system.load(rod.state);
  const RodEvaluation e = system.evaluate(false);
  EXPECT_NEAR(e.stretch, 0.5 * 500.0 * 0.01 * 2.0, 1e-12);
  EXPECT_NEAR(e.max_strain, 0.1, 1e-14);
  EXPECT_NEAR(system.nodeGradient(11).x(), 50.0, 1e-11);
  EXPECT_NEAR(system.nodeGradient(0).x(), -50.0, 1e-11);
  EXPECT_NEAR(system.nodeGradient(5).norm(), 0.0, 1e-11);
}

}   // namespace
}   // namespace slender::test
