// Warm contact takes no memory from the heap.
#include <gtest/gtest.h>

#include "slender_sim/geometry/mesh_shapes.h"
#include "test/support/allocations.h"
#include "test/support/contact.h"
#include "test/support/rods.h"

#ifdef SLENDER_COUNTS_ALLOCATIONS
namespace slender::test {
namespace {

TEST(ContactAllocations, WarmContactMakesNone)
{
  ContactSurface surface;
  Matrix3Xd x;
  addCurve(surface, x, straightNodes(20, 0.3), 0.01, 0.3);
  addCurve(surface, x, straightNodes(20, 0.3).colwise() + Vector3d(0.01, 0, 0.022), 0.01, 0.3);
  surface.solids.push_back({Plane{}, -1.0, {}});
  surface.solids.push_back({Capsule{0.01, 0.3}, -1.0, {}});
  std::vector<Pose> solids(2);
  solids[0].position.z() = -0.012;
  solids[1].position.y() = 0.022;
  ContactOptions options;
  options.gap = 4e-3;
  ContactPotential potential(surface, options);
  potential.setStiffness(1.0);
  std::size_t terms = 0;
  const Matrix3Xd there = x.colwise() + Vector3d(5e-2, 1e-4, 0), back = x;
  const auto step = [&] {   // far enough for new candidates
    potential.begin(x, solids, 1e-3);
    potential.stepLimit(x, there, solids, solids);
    potential.evaluate(there, solids, true);
    potential.lagFriction();
    potential.evaluate(there, solids, true);
    terms = potential.terms().size();
    potential.adaptStiffness(1e-3);
    potential.clearance(back, solids);
  };
  for (int k = 0; k < 3; ++k)
    step();
  const long before = allocations;
  for (int k = 0; k < 3; ++k)
    step();
  EXPECT_EQ(allocations - before, 0);
  EXPECT_GT(terms, 50u);
}

TEST(ContactAllocations, WarmContactOfSheetsMakesNone)
{
  ContactSurface surface;
  Matrix3Xd x;
  const TriangleMesh mesh = gridMesh(0.2, 0.2, 8, 8, GridPattern::alternating);
  for (int k = 0; k < 2; ++k)
    addSheet(surface, x, mesh.vertices.colwise() + Vector3d(0.011 * k, 0.007 * k, 0.0028 * k), mesh.triangles, 2e-3,
             0.3)
        .rest = std::make_shared<Matrix3Xd>(mesh.vertices);
  addCurve(surface, x, straightNodes(20, 0.3).colwise() + Vector3d(0.0, 0.05, 0.0082), 4e-3, 0.3);
  surface.solids.push_back({Sphere{0.05}, -1.0, {}});
  surface.solids.push_back({Plane{}, -1.0, {}});
  std::vector<Pose> solids(2);
  solids[0].position = {0.1, 0.1, -0.0515};
  solids[1].position.z() = -0.0015;
  ContactOptions options;
  options.gap = 1e-3;
  ContactPotential potential(surface, options);
  potential.setStiffness(1.0);
  std::size_t terms = 0;
  const Matrix3Xd there = x.colwise() + Vector3d(1e-3, 2e-3, 1e-4);
  const auto step = [&] {   // far enough for new candidates; also with pieces as of threads, which change
    potential.setPieces(surface);
    potential.thinToFit(x, solids);
    potential.begin(x, solids, 1e-3);
    potential.stepLimit(x, there, solids, solids);
    potential.evaluate(there, solids, true);
    potential.lagFriction();
    potential.evaluate(there, solids, true);
    terms = potential.terms().size();
    potential.adaptStiffness(1e-3);
  };
  for (int k = 0; k < 3; ++k)
    step();
  const long before = allocations;
  for (int k = 0; k < 3; ++k)
    step();
  EXPECT_EQ(allocations - before, 0);
  EXPECT_GT(terms, 500u);
}

}   // namespace
}   // namespace slender::test
#endif
