#include <gtest/gtest.h>

#include "slender_sim/contact/ccd.h"
#include "slender_sim/geometry/mesh_shapes.h"
#include "contact/pair_gap.h"
#include "test/support/contact.h"

namespace slender::test {
namespace {

using Vector = Eigen::Vector3d;

constexpr double kMotionGap = 0.004, kMotionThickness = 0.006;

struct Scene
{
  ContactSurface surface;
  Eigen::Matrix3Xd x;
  std::vector<Pose> solids;

  ContactPotential potential() const
  {
    ContactOptions options;
    options.gap = kMotionGap;
    return ContactPotential(surface, options);
  }
  void addCloth(const TriangleMesh& mesh, const Vector& middle, const Eigen::Quaterniond& turn)
  {
    const Vector centre = mesh.vertices.rowwise().mean();
    Eigen::Matrix3Xd corners = mesh.vertices;
    for (Eigen::Index i = 0; i < corners.cols(); ++i)
      corners.col(i) = middle + turn * Vector(corners.col(i) - centre);
    addSheet(surface, x, corners, mesh.triangles, kMotionThickness, 0.3).rest =
        std::make_shared<Eigen::Matrix3Xd>(mesh.vertices);
  }
  void addRod(const Vector& from, const Vector& to, int edges)
  {
    Eigen::Matrix3Xd nodes(3, edges + 1);
    for (int i = 0; i <= edges; ++i)
      nodes.col(i) = from + (to - from) * (static_cast<double>(i) / edges);
    addCurve(surface, x, nodes, 0.004, 0.3);
  }
  void addSolid(const Shape& shape, const Pose& pose)
  {
    surface.solids.push_back({shape, 0.3, {}});
    solids.push_back(pose);
  }
};

std::shared_ptr<const TriangleMesh> meshSolid() { return std::make_shared<TriangleMesh>(icosphere(0.04, 1)); }

/// Two cloths, two rods, and two solids that are apart.
Scene heap(Random& random)
{
  const TriangleMesh mesh = gridMesh(0.15, 0.15, 3, 3, GridPattern::alternating);
  const std::vector<Shape> shapes{Sphere{0.01}, Capsule{0.003, 0.1}, Box{{0.05, 0.03, 0.04}}, Cylinder{0.02, 0.05},
                                  meshSolid()};
  for (;;)
  {
    Scene s;
    for (int k = 0; k < 2; ++k)
    {
      s.addCloth(mesh, random.vector(0.15), random.rotation());
      const Vector at = random.vector(0.15), along = 0.1 * random.direction();
      s.addRod(at - along, at + along, 3);
      s.addSolid(shapes[static_cast<std::size_t>(random.uniform(0.0, 4.999))],
                 {random.vector(0.15), random.rotation()});
    }
    if (s.potential().clearance(s.x, s.solids) > 0.1 * kMotionGap)
      return s;
  }
}

/// A motion of everything along straight lines, solids turning.
struct Moves
{
  Eigen::Matrix3Xd v;
  std::vector<Vector> shift, turn;

  Moves(Random& random, const Scene& s, double speed)
  {
    v.resize(3, s.x.cols());
    for (std::size_t object = 0; object < s.surface.objects.size(); ++object)
    {
      const Vector common = speed * random.direction(), spin = random.vector();
      const auto move = [&](int i) {
        v.col(i) = common + spin.cross(Vector(s.x.col(i))) + 0.2 * speed * random.direction();
      };
      for (const ContactSegment& e : s.surface.segments)
        if (e.object == static_cast<int>(object))
          move(e.a), move(e.b);
      for (const ContactTriangle& t : s.surface.triangles)
        if (t.object == static_cast<int>(object))
          for (int i : t.corner)
            move(i);
    }
    for (std::size_t k = 0; k < s.solids.size(); ++k)
    {
      shift.push_back(speed * random.direction());
      turn.push_back(random.vector(1.0));
    }
  }
  Eigen::Matrix3Xd points(const Scene& s, double t) const { return s.x + t * v; }
  std::vector<Pose> poses(const Scene& s, double t) const
  {
    std::vector<Pose> out;
    for (std::size_t k = 0; k < s.solids.size(); ++k)
      out.push_back(RigidMotion(s.solids[k], {s.solids[k].position + shift[k],
                                              fromRotationVector(turn[k]) * s.solids[k].orientation})
                        .at(t));
    return out;
  }
};

/// The pairs that stepLimit() finds serve evaluations, too, while everything stays near the way.
TEST(ContactSheetMotion, NoPairIsMissedNearAWay)
{
  Random random(11);
  int touching = 0;
  for (int k = 0; k < 60; ++k)
  {
    const Scene s = heap(random);
    const Moves moves(random, s, 0.05);
    constexpr double kEnd = 0.1;   // The way is a few gaps long, so that its pairs are kept.
    ContactPotential p = s.potential();
    const double end = kEnd * p.stepLimit(s.x, moves.points(s, kEnd), s.solids, moves.poses(s, kEnd));
    for (int i = 0; i < 4; ++i)
    {
      Eigen::Matrix3Xd near = moves.points(s, random.uniform(0.9, 1.0) * end);
      for (Eigen::Index j = 0; j < near.cols(); ++j)
        near.col(j) += random.vector(0.3 * kMotionGap);
      const std::vector<Pose> poses = moves.poses(s, end);
      ContactPotential fresh = s.potential();
      const double energy = fresh.evaluate(near, poses, false);
      EXPECT_EQ(p.evaluate(near, poses, false), energy) << "case " << k;
      EXPECT_EQ(p.terms().size(), fresh.terms().size());
      touching += std::isfinite(energy) && energy > 0.0;
    }
  }
  EXPECT_GT(touching, 20);
}

/// Whatever the motion: up to the limit two fifths of the distance that there was remain, by the independent check.
TEST(ContactSheetMotion, NothingPassesUpToTheLimit)
{
  Random random(1);
  int stopped = 0;
  for (int k = 0; k < 30; ++k)
  {
    const Scene s = heap(random);
    const Moves moves(random, s, k % 3 == 0 ? 0.03 : k % 3 == 1 ? 0.1 : 0.4);
    ContactPotential p = s.potential();
    const double start = p.clearance(s.x, s.solids);
    const double share = p.stepLimit(s.x, moves.points(s, 1.0), s.solids, moves.poses(s, 1.0));
    ASSERT_GT(share, 0.0);
    double least = start;
    for (int i = 0; i <= 50; ++i)
    {
      const double t = share * i / 50;
      least = std::min(least, p.clearance(moves.points(s, t), moves.poses(s, t)));
    }
    EXPECT_GE(least, 0.4 * start * (1 - 1e-6)) << "case " << k;
    if (share < 1.0)
    {
      ++stopped;
      EXPECT_LT(p.clearance(moves.points(s, share), moves.poses(s, share)), 0.5 * kMotionGap) << "case " << k;
      // and there the barrier acts
      EXPECT_GT(p.evaluate(moves.points(s, share), moves.poses(s, share), false), 0.0) << "case " << k;
    }
  }
  EXPECT_GT(stopped, 10);
}

/// What passes completely within one motion is found: a ball of 1 cm through the middle of a triangle of 10 cm, a
/// needle, a corner of a box, a rope across a hem, at 20 m/s and steps of 10 ms.
TEST(ContactSheetMotion, NothingTunnels)
{
  TriangleMesh mesh = gridMesh(0.2, 0.2, 2, 2, GridPattern::one_diagonal);
  for (const Shape& shape : std::vector<Shape>{Sphere{0.005}, Capsule{1e-3, 0.05}, Box{{0.01, 0.01, 0.01}},
                                               Cylinder{0.005, 0.01}, meshSolid()})
    for (const Vector& at : {Vector(0.03, -0.06, 0), Vector(0.05, 0.05, 0), Vector(0.0, 0.0, 0), Vector(-0.1, 0.02, 0)})
    {
      Scene s;
      s.addCloth(mesh, Vector::Zero(), Eigen::Quaterniond::Identity());
      s.addSolid(shape,
                 {at + Vector(0, 0, 0.1), Eigen::Quaterniond(Eigen::AngleAxisd(0.7, Vector(1, 2, 3).normalized()))});
      std::vector<Pose> end = s.solids;
      end[0].position.z() -= 0.2;
      ContactPotential p = s.potential();
      ASSERT_EQ(p.clearance(s.x, s.solids), kMotionGap);
      const double share = p.stepLimit(s.x, s.x, s.solids, end);
      EXPECT_LT(share, 0.6) << shape.index() << " at " << at.transpose();
      // the same, if the cloth moves
      Eigen::Matrix3Xd up = s.x;
      up.row(2).array() += 0.2;
      EXPECT_NEAR(p.stepLimit(s.x, up, s.solids, s.solids), share, 0.05);
    }
  for (const Vector& at : {Vector(0.03, -0.06, 0), Vector(-0.1, 0.02, 0)})
    for (const Vector& along : {Vector(0.02, 0.01, 0), Vector(0, 0, 0.02), Vector(0.3, 0.1, 0)})
    {
      Scene s;
      s.addCloth(mesh, Vector::Zero(), Eigen::Quaterniond::Identity());
      s.addRod(at - along + Vector(0, 0, 0.1), at + along + Vector(0, 0, 0.1), 1);
      Eigen::Matrix3Xd end = s.x;
      end.rightCols(2).row(2).array() -= 0.2;
      ContactPotential p = s.potential();
      EXPECT_LT(p.stepLimit(s.x, end, {}, {}), 0.6) << at.transpose() << " along " << along.transpose();
    }
}

/// Terms depend on the configuration only, not on what was searched before; and none is missing.
TEST(ContactSheetMotion, TermsDependOnTheConfigurationOnly)
{
  Random random(2);
  std::size_t terms = 0;
  for (int k = 0; k < 20; ++k)
  {
    const Scene s = heap(random);
    const Moves moves(random, s, 0.2);
    ContactPotential p = s.potential();
    for (double t : {0.0, 0.001, 0.01, 0.5})
    {
      const Eigen::Matrix3Xd x = moves.points(s, t);
      const std::vector<Pose> solids = moves.poses(s, t);
      ContactPotential fresh = s.potential();
      ASSERT_EQ(p.evaluate(x, solids, true), fresh.evaluate(x, solids, true));
      ASSERT_EQ(p.terms().size(), fresh.terms().size());
      ASSERT_EQ(p.rows().size(), fresh.rows().size());
      for (std::size_t i = 0; i < p.terms().size(); ++i)
        ASSERT_EQ(p.terms()[i].force, fresh.terms()[i].force);
      // Gaps are softened to no more than 1 / (1 - 0.32)^2 of the distance.
      const double room = fresh.clearance(x, solids);
      if (room > 0.0 && room < 0.45 * kMotionGap)
      {
        EXPECT_GT(fresh.terms().size(), 0u);
      }
      terms += fresh.terms().size();
      p.stepLimit(x, moves.points(s, 0.3), solids, moves.poses(s, 0.3));
    }
  }
  EXPECT_GT(terms, 20u);
}

/// Cloth that falls as a whole has no candidates, but what it falls on is found.
/// The straight way from begin() to the end of a step leads through a cloth, or past it.
TEST(ContactSheetMotion, WhatPassesACloth)
{
  Scene s;
  s.addCloth(gridMesh(0.3, 0.3, 3, 3, GridPattern::alternating), Vector::Zero(), Eigen::Quaterniond::Identity());
  const Eigen::Index corners = s.x.cols();
  s.addRod({0.02, 0.03, 0.05}, {0.06, 0.03, 0.05}, 2);
  s.addSolid(Sphere{0.01}, {{-0.1, 0.12, 0.05}, Eigen::Quaterniond::Identity()});
  ContactPotential potential = s.potential();
  potential.begin(s.x, s.solids, 0.01);
  const auto passes = [&](const Vector& rod, const Vector& ball, const Vector& cloth) {
    Eigen::Matrix3Xd x = s.x;
    x.leftCols(corners).colwise() += cloth;
    x.rightCols(3).colwise() += rod;
    std::vector<Pose> solids = s.solids;
    solids[0].position += ball;
    return potential.passedThrough(x, solids);
  };
  const Vector none = Vector::Zero(), down(0, 0, -0.1), past(0.4, 0, -0.1);
  EXPECT_FALSE(passes(none, none, none));
  EXPECT_TRUE(passes(down, none, none));
  EXPECT_TRUE(passes(none, down, none));
  EXPECT_TRUE(passes(none, none, -down));
  EXPECT_FALSE(passes(past, none, none));
  EXPECT_FALSE(passes(none, -past, none));
  EXPECT_FALSE(passes(down, down, down));   // all of them together
  EXPECT_FALSE(passes(0.4 * down, 0.4 * down, none));
}

/// The straight way of a rod leads through another rod, past its end, or is too short to be examined.
TEST(ContactSheetMotion, WhatPassesACurve)
{
  Scene s;
  s.addRod({0.0, 0.0, 0.0}, {0.1, 0.0, 0.0}, 5);
  s.addRod({0.09, -0.05, 0.01}, {0.09, 0.05, 0.01}, 5);
  ContactPotential potential = s.potential();
  potential.begin(s.x, s.solids, 0.01);
  const auto passes = [&](const Vector& way) {
    Eigen::Matrix3Xd x = s.x;
    x.rightCols(6).colwise() += way;
    return potential.passedThrough(x, s.solids);
  };
  EXPECT_TRUE(passes({0, 0, -0.02}));
  EXPECT_FALSE(passes({0.025, 0, -0.02}));   // past the end
  EXPECT_FALSE(passes({0, 0, 0.02}));
  EXPECT_FALSE(passes({0, 0, -0.0099}));   // too short, and before the other rod
}

/// If the pieces of a surface are rebuilt, contact still lets pass what presses on their held points.
TEST(ContactSheetMotion, WhatPressesOnHeldPointsMeetsNoNewPiece)
{
  Scene s;
  s.addCloth(gridMesh(0.3, 0.3, 3, 3, GridPattern::alternating), Vector::Zero(), Eigen::Quaterniond::Identity());
  const int held = 5;
  s.addSolid(Sphere{0.02}, {s.x.col(held), Eigen::Quaterniond::Identity()});
  ContactPotential potential = s.potential();
  EXPECT_FALSE(std::isfinite(potential.evaluate(s.x, s.solids, false)));
  for (ContactTriangle& t : s.surface.triangles)
    for (int k = 0; k < 3; ++k)
      if (t.corner[k] == held)
        t.driven = static_cast<unsigned char>(t.driven | 1 << k);
  potential.setPieces(s.surface);
  EXPECT_TRUE(potential.thinToFit(s.x, s.solids));
  EXPECT_TRUE(std::isfinite(potential.evaluate(s.x, s.solids, false)));
}

TEST(ContactSheetMotion, FallsOntoATable)
{
  Scene s;
  s.addCloth(gridMesh(0.5, 0.5, 10, 10, GridPattern::alternating), {0, 0, 0.1}, Eigen::Quaterniond::Identity());
  s.addSolid(Plane{}, {});
  Eigen::Matrix3Xd end = s.x;
  end.row(2).array() -= 0.05;
  ContactPotential p = s.potential();
  EXPECT_EQ(p.stepLimit(s.x, end, s.solids, s.solids), 1.0);
  end.row(2).array() -= 0.1;
  const double share = p.stepLimit(s.x, end, s.solids, s.solids);
  const Eigen::Matrix3Xd there = s.x + share * (end - s.x);
  EXPECT_GT(p.evaluate(there, s.solids, true), 0.0);
  EXPECT_EQ(p.terms().size(), 121u);   // each vertex once
  EXPECT_NEAR(there.row(2).minCoeff(), 0.5 * kMotionThickness + 0.41 * kMotionGap, 0.03 * kMotionGap);
}

/// Something else than motion may bring strands of threads too near to other things. They are thinned there, and can
/// begin a step. Everything else keeps its thickness.
TEST(ContactSheetMotion, OverlapsOfStrandsAreThinned)
{
  Scene s;
  s.addCloth(gridMesh(0.1, 0.1, 2, 2, GridPattern::alternating), Vector::Zero(), Eigen::Quaterniond::Identity());
  s.addRod({-0.08, 0.01, 0.003}, {0.08, 0.02, 0.003}, 3);
  s.addSolid(Sphere{0.02}, {{0, 0.015, 0.0265}, Eigen::Quaterniond::Identity()});
  ContactPotential rod = s.potential();
  EXPECT_TRUE(rod.thinToFit(s.x, s.solids));
  EXPECT_FALSE(std::isfinite(rod.evaluate(s.x, s.solids, false)));
  s.surface.objects.back().owner = 0;
  ContactPotential p = s.potential();
  EXPECT_FALSE(std::isfinite(p.evaluate(s.x, s.solids, false)));
  ASSERT_TRUE(p.thinToFit(s.x, s.solids));
  EXPECT_TRUE(std::isfinite(p.evaluate(s.x, s.solids, false)));
  EXPECT_GT(p.evaluate(s.x, s.solids, false), 0.0);
  EXPECT_GT(p.stepLimit(s.x, s.x.colwise() + Vector(0, 0, 1e-4), s.solids, s.solids), 0.0);
  s.solids[0].position.z() = 0.003;
  EXPECT_FALSE(p.thinToFit(s.x, s.solids));
}

}   // namespace
}   // namespace slender::test
