#include <gtest/gtest.h>

#include "contact/contact_potential.h"
#include "slender_sim/contact/solids.h"
#include "test/support/random.h"

namespace slender::test {
namespace {

/// Against counting random points inside: 4e5 points know a volume to about 0.2 % and second moments to 0.5 %.
TEST(MassProperties, AgreeWithRandomPoints)
{
  for (const Shape& shape :
       {Shape(Sphere{0.3}), Shape(Box{{0.4, 0.3, 0.6}}), Shape(Cylinder{0.3, 0.5}), Shape(Capsule{0.2, 0.3})})
  {
    Random random(1);
    const MassProperties mass = massProperties(shape);
    const ConvexPiece piece = std::visit(
        [](const auto& s) -> ConvexPiece {
          if constexpr (std::is_constructible_v<ConvexPiece, decltype(s)>)
            return s;
          else
            return Plane{};
        },
        shape);
    constexpr int kPoints = 400000;
    constexpr double kHalf = 0.4;
    int inside = 0;
    Eigen::Matrix3d moments = Eigen::Matrix3d::Zero();
    for (int i = 0; i < kPoints; ++i)
    {
      const Eigen::Vector3d p = random.vector(kHalf);
      if (pieceDistance(piece, p).distance > 0.0)
        continue;
      ++inside;
      moments += p.squaredNorm() * Eigen::Matrix3d::Identity() - p * p.transpose();
    }
    const double box = std::pow(2 * kHalf, 3);
    EXPECT_NEAR(mass.volume, box * inside / kPoints, 0.01 * mass.volume);
    EXPECT_LT((mass.unit_inertia - moments / inside).norm(), 0.01 * mass.unit_inertia.norm()) << shape.index();
  }
}

TEST(MassProperties, OfAMeshAreThoseOfTheBoxItIs)
{
  const Eigen::Vector3d size(0.4, 0.3, 0.6), at(5, -3, 2);
  auto mesh = std::make_shared<TriangleMesh>();
  mesh->vertices.resize(3, 8);
  for (int i = 0; i < 8; ++i)
    mesh->vertices.col(i) = at + 0.5 * Eigen::Vector3d(i & 1 ? size.x() : -size.x(), i & 2 ? size.y() : -size.y(),
                                                       i & 4 ? size.z() : -size.z());
  mesh->triangles.resize(3, 12);
  mesh->triangles << 0, 0, 4, 4, 0, 0, 2, 2, 0, 0, 1, 1,   //
      2, 3, 5, 7, 1, 5, 6, 7, 4, 6, 3, 7,                  //
      3, 1, 7, 6, 5, 4, 7, 3, 6, 2, 7, 5;
  const MassProperties mass = massProperties(Shape(std::shared_ptr<const TriangleMesh>(mesh))),
                       box = massProperties(Box{size});
  EXPECT_NEAR(mass.volume, box.volume, 1e-14);
  EXPECT_LT((mass.center - at).norm(), 1e-13);
  EXPECT_LT((mass.unit_inertia - box.unit_inertia).norm(), 1e-14);
  std::swap(mesh->triangles(0, 3), mesh->triangles(1, 3));
  EXPECT_THROW(massProperties(Shape(std::shared_ptr<const TriangleMesh>(mesh))), std::invalid_argument);
}

TEST(MassProperties, RefuseWhatHasNone)
{
  EXPECT_THROW(massProperties(Plane{}), std::invalid_argument);
  EXPECT_THROW(massProperties(Sphere{-0.1}), std::invalid_argument);
  EXPECT_THROW(massProperties(Box{{0.1, 0.0, 0.1}}), std::invalid_argument);
  EXPECT_THROW(massProperties(Box{{0.1, std::nan(""), 0.1}}), std::invalid_argument);
  EXPECT_THROW(massProperties(Cylinder{0.1, std::numeric_limits<double>::infinity()}), std::invalid_argument);
  EXPECT_THROW(massProperties(std::make_shared<const TriangleMesh>()), std::invalid_argument);
}

TEST(ContactPotential, RefusesBadSurfaces)
{
  ContactSurface surface;
  surface.points = 2;
  surface.segments.push_back({0, 1, 0.01, 0, 0.0, 0.1});
  surface.objects.push_back({{true, true, true, 0.0}});
  ContactOptions options;
  EXPECT_THROW(ContactPotential(surface, options), std::invalid_argument);   // no gap
  options.gap = 0.01;
  EXPECT_NO_THROW(ContactPotential(surface, options));
  ContactPotential potential(surface, options);
  EXPECT_THROW(potential.evaluate(Eigen::Matrix3Xd::Zero(3, 3), {}, false), std::invalid_argument);
  EXPECT_THROW(potential.setStiffness(-1.0), std::invalid_argument);
  surface.segments[0].b = 2;
  EXPECT_THROW(ContactPotential(surface, options), std::invalid_argument);
}

TEST(ContactPotential, AdaptsItsStiffnessToTheLoad)
{
  ContactSurface surface;
  surface.points = 2;
  surface.segments.push_back({0, 1, 0.01, 0, 0.0, 0.1});
  surface.objects.push_back({{true, true, true, 0.0}});
  surface.solids.push_back({Plane{}, -1.0, {}});
  ContactOptions options;
  options.gap = 1e-3;
  options.least_stiffness = 1e-3;
  ContactPotential potential(surface, options);
  const auto at = [](double gap) {
    Eigen::Matrix3Xd x(3, 2);
    x << 0, 0.1, 0, 0, 0.01 + gap, 0.01 + gap;
    return x;
  };
  potential.setStiffness(options.least_stiffness);
  double gap = 0.9 * options.gap;
  const auto forceAt = [&](double g) {
    potential.evaluate(at(g), {Pose{}}, false);
    double force = 0.0;
    for (const ContactTerm& term : potential.terms())
      force = std::max(force, term.force.norm());
    return force;
  };
  // Steps under a constant load, each of which ends where the barrier bears this load.
  for (double load : {1e-6, 0.1, 1e3, 5.0, 1e-2})
  {
    double before = 0.0;
    for (int k = 0; k < 200; ++k)
    {
      potential.begin(at(gap), {Pose{}}, 0.01);
      before = gap;
      do
      {
        potential.beginSolution();
        double low = 1e-12, high = options.gap;
        for (int i = 0; i < 200; ++i)
        {
          gap = 0.5 * (low + high);
          (forceAt(gap) > load ? low : high) = gap;
        }
      }
      while (potential.stiffen(true));
      potential.adaptStiffness(0.01);
    }
    EXPECT_NEAR(gap, before, 1e-9 * options.gap) << load;
    EXPECT_EQ(potential.barrier(0).count(), 1) << load;   // Nothing but the outermost layer bears a load that stands.
    EXPECT_GE(potential.barrier(0).layers[0].stiffness, options.least_stiffness);
    EXPECT_GT(gap, options.gap / 20) << load;
    if (load > options.least_stiffness)
      EXPECT_LT(gap, options.gap / 1.9);
  }
}

/// What two solids squeeze to a fixed distance exerts the same force for ever.
TEST(ContactPotential, DoesNotAddForceWhereGapsAreFixed)
{
  ContactSurface surface;
  surface.points = 2;
  surface.segments.push_back({0, 1, 0.01, 0, 0.0, 0.1});
  surface.objects.push_back({{true, true, true, 0.0}});
  surface.solids.push_back({Plane{}, -1.0, {}});
  ContactOptions options;
  options.gap = 1e-3;
  ContactPotential potential(surface, options);
  potential.setStiffness(1.0);
  Eigen::Matrix3Xd x(3, 2);
  for (const double share : {0.1, 0.01, 1e-3})
  {
    double first = 0.0, last = 0.0;
    for (int k = 0; k < 400; ++k)
    {
      const double gap = options.gap * std::max(share, 0.9 * std::pow(0.8, k));   // closes, and stays
      x << 0, 0.1, 0, 0, 0.01 + gap, 0.01 + gap;
      do
      {
        potential.beginSolution();
        potential.evaluate(x, {Pose{}}, false);
      }
      while (potential.stiffen(true));
      last = potential.terms().front().force.norm();
      if (k == 60)
        first = last;
      potential.adaptStiffness(0.01);
      potential.begin(x, {Pose{}}, 0.01);
    }
    EXPECT_NEAR(last, first, 1e-6 * first) << share;
  }
}

}   // namespace
}   // namespace slender::test
