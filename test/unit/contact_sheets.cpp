#include <functional>

#include <Eigen/Eigenvalues>
#include <gtest/gtest.h>

#include "slender_sim/geometry/mesh_shapes.h"
#include "test/support/contact.h"

namespace slender::test {
namespace {

using Vector = Eigen::Vector3d;

constexpr double kSheetThickness = 0.03, kThinRadius = 0.02;

struct SheetCase : ContactCase
{
  void addTriangle(const Vector& a, const Vector& b, const Vector& c, double friction = 0.0)
  {
    Eigen::Matrix3Xd corners(3, 3);
    corners << a, b, c;
    addSheet(surface, x, corners, Eigen::Vector3i(0, 1, 2), kSheetThickness, friction);
  }
  /// Moves the last `count` points along a direction until the least distance is as given.
  bool bring(int count, const Vector& direction, double clearance = kContactGap / 3)
  {
    ContactPotential p = potential();
    const Eigen::Matrix3Xd start = x;
    return bringTo(clearance, 3.0, [&](double s) {
      x.rightCols(count) = start.rightCols(count).colwise() + s * direction;
      const double room = p.clearance(x, solids);
      return s < 1e-9 ? -1.0 : room;   // pieces that have passed each other are apart, too
    });
  }
};

// differences of forces over 1e-7 m; rows of less than a thousandth of a pair's stiffness are left out
constexpr double kSecondDifferences = 2e-3;

/// A triangle, and one above it: in any position, parallel to it, a corner above the inside, above an edge, above a
/// corner; parallel edges; a needle.
SheetCase twoTriangles(Random& random, int kind)
{
  SheetCase c;
  const Eigen::Quaterniond turn = random.rotation();
  const Vector a = turn * Vector(-0.2, -0.1, 0), b = turn * Vector(0.25, -0.1, 0), d = turn * Vector(0, 0.2, 0);
  Vector u = 0.3 * random.direction(), v = 0.3 * random.direction(), w = 0.3 * random.direction(), shift(0, 0, 0);
  const Vector up = turn * Vector::UnitZ();
  if (kind == 1)
  {
    for (Vector* p : {&u, &v, &w})
      *p -= up.dot(*p) * up;
    shift = turn * Vector(0.1 * random.uniform(), 0.1 * random.uniform(), 0);
  }
  if (kind >= 2 && kind <= 4)
  {
    u = Vector::Zero();
    v = turn * Vector(0.1, 0.2 * random.uniform(), 0.2);
    w = turn * Vector(-0.1, 0.2 * random.uniform(), 0.3);
    shift = kind == 2 ? Vector(0.3 * a + 0.3 * b + 0.4 * d) : kind == 3 ? Vector(0.5 * (a + b)) : a;
  }
  if (kind == 5)
  {
    v = u + 0.8 * (b - a);
    shift = -0.5 * (u + v);
  }
  if (kind == 6)
    w = u + 0.3 * (v - u) + 1e-4 * random.direction();
  c.addTriangle(a, b, d);
  c.addTriangle(u + shift, v + shift, w + shift);
  c.bring(3, kind == 0 || kind >= 5 ? random.direction() : up);
  return c;
}

TEST(ContactSheets, ForceOfTrianglesIsTheGradient)
{
  Random random(1);
  int checked = 0;
  for (int kind = 0; kind < 7; ++kind)
    for (int k = 0; k < 30; ++k)
    {
      SheetCase c = twoTriangles(random, kind);
      ContactPotential p = c.potential();
      const double energy = p.evaluate(c.x, {}, false);
      ASSERT_TRUE(std::isfinite(energy)) << kind;
      if (!(energy > 0.0))
        continue;
      ++checked;
      EXPECT_LT(gradientError(p, c.x, {}), kDifferences) << "kind " << kind << " case " << k;
    }
  EXPECT_GT(checked, 150);
}

/// Where the place of contact is not just on a border between an inside, an edge and a corner, where it jumps.
TEST(ContactSheets, StiffnessOfTrianglesIsTheDerivativeOfTheForce)
{
  Random random(2);
  for (int kind : {0, 1, 2, 5, 6})
    for (int k = 0; k < 30; ++k)
    {
      SheetCase c = twoTriangles(random, kind);
      ContactPotential p = c.potential();
      if (!(p.evaluate(c.x, {}, false) > 0.0))
        continue;
      EXPECT_LT(hessianError(p, c.x, {}, random), kSecondDifferences) << "kind " << kind << " case " << k;
      p.evaluate(c.x, {}, true);
      const Eigen::MatrixXd definite = hessian(p, c.x.cols(), false);
      EXPECT_GE(definite.selfadjointView<Eigen::Lower>().eigenvalues().minCoeff(), -1e-12 * definite.norm());
    }
}

/// A rod of three segments that lies on a triangle, hits it with its end, or is met by its corner.
SheetCase rodAndTriangle(Random& random, int kind)
{
  SheetCase c;
  c.addTriangle({-0.4, -0.3, 0}, {0.5, -0.3, 0}, {0, 0.4, 0});
  const Vector along = kind == 0   ? Vector(random.uniform(), random.uniform(), 0)
                       : kind == 1 ? Vector(0.5 * random.uniform(), 0.5 * random.uniform(), 1)
                                   : random.direction();
  Eigen::Matrix3Xd nodes(3, 4);
  for (int i = 0; i < 4; ++i)
    nodes.col(i) = (0.2 * i - (kind == 1 ? 0.0 : 0.3)) * along.normalized() + 0.1 * Vector(random.uniform(), 0, 0);
  if (kind == 2)
    nodes.colwise() += Vector(0.45, -0.25, 0);   // near a corner
  addCurve(c.surface, c.x, nodes, kThinRadius);
  c.bring(4, kind == 2 ? Vector(random.direction()) : Vector(Vector::UnitZ()));
  return c;
}

TEST(ContactSheets, ForceOfRodsOnTrianglesIsTheGradient)
{
  Random random(3);
  int checked = 0;
  for (int kind = 0; kind < 3; ++kind)
    for (int k = 0; k < 40; ++k)
    {
      SheetCase c = rodAndTriangle(random, kind);
      ContactPotential p = c.potential();
      const double energy = p.evaluate(c.x, {}, false);
      ASSERT_TRUE(std::isfinite(energy)) << kind;
      if (!(energy > 0.0))
        continue;
      ++checked;
      EXPECT_LT(gradientError(p, c.x, {}), kDifferences) << "kind " << kind << " case " << k;
      EXPECT_LT(hessianError(p, c.x, {}, random), kSecondDifferences) << "kind " << kind << " case " << k;
    }
  EXPECT_GT(checked, 100);
}

std::vector<Shape> shapes()
{
  const auto mesh = std::make_shared<TriangleMesh>();
  mesh->vertices.resize(3, 4);
  mesh->vertices << -0.3, 0.3, 0.0, 0.0, -0.2, -0.2, 0.4, 0.0, 0.0, 0.0, 0.0, 0.3;
  mesh->triangles.resize(3, 4);
  mesh->triangles << 0, 0, 1, 2, 2, 1, 2, 0, 1, 3, 3, 3;
  return {Plane{}, Sphere{0.2}, Sphere{0.01}, Box{{0.4, 0.3, 0.2}}, Cylinder{0.1, 0.5}, Capsule{0.01, 0.3}, mesh};
}

/// A triangle of which some corners move as prescribed, and a solid around its free part that is turned, or not.
SheetCase triangleOnSolid(Random& random, const Shape& shape, unsigned char driven, bool turned)
{
  SheetCase c;
  c.addTriangle(0.3 * random.direction(), 0.3 * random.direction(), 0.3 * random.direction());
  if (!turned)
    c.x.row(2).setZero();
  c.surface.triangles[0].driven = driven;
  Vector middle = Vector::Zero();
  double free = 0.0;
  for (int k = 0; k < 3; ++k)
    if (!(driven >> k & 1))
    {
      middle += c.x.col(k);
      ++free;
    }
  c.x.colwise() -= middle / free;
  c.surface.solids.push_back({shape, -1.0, {}});
  c.solids.push_back({Vector::Zero(), turned ? random.rotation() : Eigen::Quaterniond::Identity()});
  return c;
}

TEST(ContactSheets, ForceOfSolidsIsTheGradient)
{
  Random random(4);
  for (const Shape& shape : shapes())
    for (unsigned char driven : {0, 1, 5})
    {
      int checked = 0;
      for (int k = 0; k < 80 && checked < 12; ++k)
      {
        SheetCase c = triangleOnSolid(random, shape, driven, k % 2);
        const Vector n = k % 2 ? random.direction() : Vector(Vector::UnitZ());
        if (!c.bring(3, n))
          continue;   // a plane that n does not leave
        ContactPotential p = c.potential();
        p.letPass(c.x, c.solids, c.x, c.solids);   // the solid may be around held corners
        if (!(p.evaluate(c.x, c.solids, false) > 0.0))
          continue;   // at a corner, where only half the gap counts
        EXPECT_LT(gradientError(p, c.x, c.solids), kDifferences)
            << "shape " << shape.index() << " driven " << int(driven) << " case " << k;
        ++checked;
      }
      EXPECT_GT(checked, 5) << "shape " << shape.index() << " driven " << int(driven);
    }
}

/// Of solids their own curvature is left out, so that the second derivative is exact at flat sides only.
TEST(ContactSheets, StiffnessOnFlatSidesIsTheDerivativeOfTheForce)
{
  Random random(5);
  for (const Shape& shape : std::vector<Shape>{Plane{}, Box{{2.0, 2.0, 0.1}}})
    for (int k = 0; k < 20; ++k)
    {
      SheetCase c = triangleOnSolid(random, shape, 0, false);
      c.x.row(2) = 1e-3 * random.numbers(3).transpose();
      ASSERT_TRUE(c.bring(3, Vector::UnitZ()));
      ContactPotential p = c.potential();
      ASSERT_GT(p.evaluate(c.x, c.solids, false), 0.0);
      EXPECT_LT(hessianError(p, c.x, c.solids, random), kSecondDifferences) << shape.index() << " case " << k;
    }
}

// ---- continuity

/// Largest change of all points' forces between neighbouring samples of a motion, over the largest force.
double largestJumpOfSheets(int samples, const std::function<SheetCase(double)>& motion)
{
  ContactPotential potential = motion(0.0).potential();
  double jump = 0.0, largest = 0.0;
  Eigen::Matrix3Xd before;
  for (int k = 0; k <= samples; ++k)
  {
    const SheetCase c = motion(static_cast<double>(k) / samples);
    EXPECT_TRUE(std::isfinite(potential.evaluate(c.x, c.solids, false)));
    const Eigen::Matrix3Xd g = gradient(potential, c.x.cols());
    if (k > 0)
      jump = std::max(jump, (g - before).cwiseAbs().maxCoeff());
    largest = std::max(largest, g.cwiseAbs().maxCoeff());
    before = g;
  }
  EXPECT_GT(largest, 0.0);
  return jump / largest;
}

/// A continuous force's jumps shrink with the samples' distance.
void expectContinuousSheets(const std::function<SheetCase(double)>& motion)
{
  const double coarse = largestJumpOfSheets(1000, motion), fine = largestJumpOfSheets(10000, motion);
  EXPECT_LT(fine, 0.15 * coarse);
  EXPECT_LT(fine, 0.02);
}

/// Two cells of cloth around a diagonal.
SheetCase cells()
{
  SheetCase c;
  Eigen::Matrix3Xd corners(3, 4);
  corners << -0.3, 0.3, 0.3, -0.3, -0.3, -0.3, 0.3, 0.3, 0, 0, 0, 0;
  Eigen::Matrix3Xi triangles(3, 2);
  triangles << 0, 0, 1, 2, 2, 3;
  addSheet(c.surface, c.x, corners, triangles, kSheetThickness);
  return c;
}

TEST(ContactSheets, ForcesDoNotJumpAsACornerSlides)
{
  for (double angle : {0.0, 0.4, 0.785398, 1.2})   // over the inside, the diagonal, outer edges, a corner
    expectContinuousSheets([angle](double s) {
      SheetCase c = cells();
      const Vector tip =
          (s - 0.5) * Vector(std::cos(angle), std::sin(angle), 0) + Vector(0, 0, kSheetThickness + 0.3 * kContactGap);
      c.addTriangle(tip, tip + Vector(0.2, 0.1, 0.3), tip + Vector(-0.2, 0.15, 0.4));
      return c;
    });
}

TEST(ContactSheets, ForcesDoNotJumpAsPiecesBecomeParallel)
{
  // a triangle that turns through parallel above cloth, a box, and a mesh
  for (int partner = 0; partner < 4; ++partner)
    expectContinuousSheets([partner](double s) {
      SheetCase c;
      double height = 0.5 * kSheetThickness + 0.4 * kContactGap;
      if (partner == 0)
      {
        c = cells();
        height += 0.5 * kSheetThickness;
      }
      const double tilt = 0.04 * (s - 0.47);
      const Vector e(std::cos(tilt), 0, std::sin(tilt)), f(0, 1, 0.3 * tilt);
      c.addTriangle(-0.1 * e - 0.1 * f + height * Vector::UnitZ(), 0.15 * e - 0.05 * f + height * Vector::UnitZ(),
                    0.12 * f + height * Vector::UnitZ());
      if (partner == 0)
        return c;
      c.surface.solids.push_back({partner == 1   ? Shape(Plane{})
                                  : partner == 2 ? Shape(Box{{1, 1, 0.1}})
                                                 : shapes()[6],
                                  -1.0,
                                  {}});
      c.solids.push_back({Vector(0, 0, partner == 2 ? -0.05 : 0.0), Eigen::Quaterniond::Identity()});
      if (partner == 3)   // with its base up
        c.solids[0].orientation = Eigen::AngleAxisd(M_PI, Vector::UnitX());
      return c;
    });
}

// ---- momentum

TEST(ContactSheets, ForcesAndTorquesSumToZero)
{
  Random random(6);
  int terms = 0;
  for (int k = 0; k < 60; ++k)
  {
    SheetCase c = twoTriangles(random, k % 7);
    if (k % 2)
    {
      c = rodAndTriangle(random, k / 2 % 3);
      c.surface.solids.push_back({shapes()[k % 7], -1.0, {}});
      c.solids.push_back({Vector(0, 0, -0.02), Eigen::Quaterniond::Identity()});
    }
    ContactPotential p = c.potential();
    if (!std::isfinite(p.evaluate(c.x, c.solids, false)))
      continue;
    for (const ContactTerm& term : p.terms())
    {
      Vector force = Vector::Zero(), torque = Vector::Zero();
      for (int i = 0; i < 4; ++i)
        if (term.point[i] >= 0)
        {
          force += term.weight[i] * term.force;
          torque += c.x.col(term.point[i]).cross(term.weight[i] * term.force);
        }
      if (term.solid >= 0)
      {
        force -= term.force;
        torque -= term.position.cross(term.force);
      }
      const double size = term.force.norm();
      EXPECT_NEAR(force.norm(), 0.0, 1e-14 * size);
      EXPECT_NEAR(torque.norm(), 0.0, 1e-13 * size);
      ++terms;
    }
  }
  EXPECT_GT(terms, 100);
}

// ---- what is a pair

TEST(ContactSheets, NeighboursAndPiecesNearAtRestDoNotRepel)
{
  const TriangleMesh mesh = gridMesh(0.2, 0.2, 8, 8, GridPattern::one_diagonal);   // edges shorter than the thickness
  SheetCase c;
  ContactObject& sheet = addSheet(c.surface, c.x, mesh.vertices, mesh.triangles, kSheetThickness);
  ContactPotential all = c.potential();
  EXPECT_FALSE(std::isfinite(all.evaluate(c.x, {}, false)));
  sheet.rest = std::make_shared<Eigen::Matrix3Xd>(mesh.vertices);
  ContactPotential p = c.potential();
  EXPECT_EQ(p.evaluate(c.x, {}, false), 0.0);
  EXPECT_GT(p.clearance(c.x, {}), 0.0);
  // pushed together to less than half they do
  EXPECT_GT(p.evaluate(0.45 * c.x, {}, false), 0.0);
  c.surface.objects[0].self = false;
  ContactPotential none = c.potential();
  EXPECT_EQ(none.evaluate(0.1 * c.x, {}, false), 0.0);
}

TEST(ContactSheets, WhatIsDrivenPassesThroughWhatIsDriven)
{
  SheetCase c;
  c.addTriangle({0, 0, 0}, {1, 0, 0}, {0, 1, 0});
  c.addTriangle({0.2, 0.2, -0.3}, {0.3, 0.2, 0.5}, {0.2, 0.3, 0.5});
  EXPECT_LT(c.potential().clearance(c.x, {}), 0.0);   // no corner or edge is near, but it passes through
  for (ContactTriangle& t : c.surface.triangles)
    t.driven = 7;
  EXPECT_EQ(c.potential().clearance(c.x, {}), kContactGap);
  c.surface.solids.push_back({Plane{}, -1.0, {}});
  c.solids.push_back({Vector(0, 0, 0.1), Eigen::Quaterniond::Identity()});
  EXPECT_EQ(c.potential().clearance(c.x, c.solids), kContactGap);
  EXPECT_EQ(c.potential().evaluate(c.x, c.solids, false), 0.0);
  c.surface.solids[0] = {Box{{1, 1, 1}}, -1.0, {}};
  c.surface.solids[0].body = true;
  EXPECT_FALSE(std::isfinite(c.potential().evaluate(c.x, c.solids, false)));
}

TEST(ContactSheets, BadTrianglesAreRefused)
{
  SheetCase good;
  good.addTriangle({0, 0, 0}, {1, 0, 0}, {0, 1, 0});
  EXPECT_NO_THROW(good.potential());
  const auto refused = [&](const std::function<void(ContactSurface&)>& change) {
    SheetCase bad = good;
    change(bad.surface);
    EXPECT_THROW(bad.potential(), std::invalid_argument);
  };
  refused([](ContactSurface& s) { s.triangles[0].corner[1] = 3; });
  refused([](ContactSurface& s) { s.triangles[0].corner[1] = -1; });
  refused([](ContactSurface& s) { s.triangles[0].corner[2] = 0; });
  refused([](ContactSurface& s) { s.triangles[0].object = 1; });
  refused([](ContactSurface& s) { s.triangles[0].half_thickness = 0.0; });
  refused([](ContactSurface& s) { s.triangles[0].half_thickness = std::nan(""); });
  refused([](ContactSurface& s) { s.objects[0].rest = std::make_shared<Eigen::Matrix3Xd>(3, 2); });
}

// ---- friction

TEST(ContactSheets, FrictionSticksAndSlips)
{
  constexpr double kStep = 0.01, kFriction = 0.4;
  for (bool on_cloth : {false, true})
  {
    SheetCase c;
    if (on_cloth)
    {
      c = cells();
      c.surface.objects[0].friction = 0.1;
    }
    else
    {
      c.surface.solids.push_back({Plane{}, 0.1, {}});
      c.solids.resize(1);
    }
    const Vector tip(0.1, -0.05, (on_cloth ? 1.0 : 0.5) * kSheetThickness + 0.3 * kContactGap);
    c.addTriangle(tip, tip + Vector(0.2, 0.1, 0.3), tip + Vector(-0.2, 0.15, 0.4), 1.6);   // geometric mean 0.4
    ContactPotential p = c.potential();
    p.begin(c.x, c.solids, kStep);
    p.evaluate(c.x, c.solids, false);
    ASSERT_EQ(p.terms().size(), 2u);
    EXPECT_EQ(p.terms()[1].force.norm(), 0.0);   // at rest
    const double normal = p.terms()[0].force.norm(), full = 1e-4 * kStep;
    const Vector side(0.6, 0.8, 0);
    for (double slip : {0.1 * full, 20 * full})
    {
      Eigen::Matrix3Xd there = c.x;
      there.rightCols(3).colwise() += slip * side;
      p.evaluate(there, c.solids, true);
      const Vector force = p.terms().back().force;
      // slips are 1e-7 m of coordinates of 0.1 m
      EXPECT_NEAR(force.dot(side), slip < full ? -kFriction * normal * 0.19 : -kFriction * normal, 1e-8 * normal);
      if (on_cloth)
      {
        EXPECT_NEAR(gradient(p, c.x.cols()).rowwise().sum().norm(), 0.0, 1e-12 * normal);
      }
    }
    EXPECT_LT(p.lagFriction(), 1e-3);
  }
}

/// Friction acts on surfaces: what two pieces exert on each other has no moment, though their middle surfaces are
/// apart. Contacts whose levers are limited are left out.
TEST(ContactSheets, FrictionHasNoMoment)
{
  constexpr double kStep = 0.01, kMove = 1e-9;            // [s], [m] far less than the range in which friction sticks
  constexpr double kLargest = 0.299, kLeastSine = 0.21;   // Beyond these, levers are limited.
  constexpr double kClosest = 1e-6 * kSheetThickness;     // [m] The forces are those after the points have moved.
  Random random(8);
  int pairs = 0, on_solids = 0;
  for (int k = 0; k < 120; ++k)
  {
    SheetCase c = k % 2 ? triangleOnSolid(random, shapes()[1 + k / 2 % 6], 0, true) : twoTriangles(random, k / 2 % 7);
    if (k % 2 && !c.bring(3, random.direction()))
      continue;
    for (ContactObject& object : c.surface.objects)
      object.friction = 0.5;
    ContactPotential p = c.potential();
    if (!std::isfinite(p.evaluate(c.x, c.solids, false)))
      continue;
    const std::size_t normals = p.terms().size();
    p.begin(c.x, c.solids, kStep);
    Eigen::Matrix3Xd there = c.x;
    for (Eigen::Index i = 0; i < there.cols(); ++i)
      there.col(i) += kMove * random.direction();
    p.evaluate(there, c.solids, false);
    for (std::size_t n = normals; n < p.terms().size(); ++n)
    {
      const ContactTerm& term = p.terms()[n];
      const auto edge = [&](int from, int to) -> Vector {
        const Vector e = c.x.col(term.point[to]) - c.x.col(term.point[from]);
        return (e - term.normal.dot(e) * term.normal).normalized();
      };
      const bool pair = term.solid < 0, edges = pair && term.weight[1] >= 0.0;
      const int first = pair && !edges;   // of a triangle's corners
      const Vector across = edges ? edge(2, 3) : edge(first, first + 2);
      double lever = 0.0;
      for (const Vector& each : term.lever)
        lever = std::max(lever, each.norm());
      if (lever > kLargest || edge(first, first + 1).cross(across).norm() < kLeastSine)
        continue;
      Vector force = Vector::Zero(), moment = Vector::Zero();
      for (int i = 0; i < 4; ++i)
        if (term.point[i] >= 0)
        {
          force += term.share(i, term.force);
          moment += c.x.col(term.point[i]).cross(term.share(i, term.force));
        }
      if (term.solid >= 0)
      {
        force -= term.force;
        moment -= term.position.cross(term.force);
      }
      const double size = term.force.norm();
      EXPECT_NEAR(force.norm(), 0.0, 1e-13 * size);
      EXPECT_NEAR(moment.norm(), 0.0, kClosest * size) << "case " << k;
      ++(term.solid < 0 ? pairs : on_solids);
    }
  }
  EXPECT_GT(pairs, 30);
  EXPECT_GT(on_solids, 50);
}

}   // namespace
}   // namespace slender::test
