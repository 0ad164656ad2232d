// Contact of rods and sheets: cost of the potential, broad phases against each other, and how smooth FCL's distances
// are.

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <random>

#include <benchmark/benchmark.h>
#include <fcl/fcl.h>

#include "contact/contact_potential.h"
#include "slender_sim/contact/broad_phase.h"
#include "slender_sim/contact/solids.h"
#include "slender_sim/geometry/mesh_shapes.h"

namespace {

using namespace slender;

/// A trefoil knot of thickness such that it just does not touch itself.
ContactSurface trefoil(int edges, double radius, Eigen::Matrix3Xd& x)
{
  ContactSurface surface;
  surface.points = edges;
  x.resize(3, edges);
  for (int i = 0; i < edges; ++i)
  {
    const double t = 2 * M_PI * i / edges;
    x.col(i) = Eigen::Vector3d(std::sin(t) + 2 * std::sin(2 * t), std::cos(t) - 2 * std::cos(2 * t), -std::sin(3 * t));
  }
  double start = 0.0;
  for (int i = 0; i < edges; ++i)
  {
    const double length = (x.col((i + 1) % edges) - x.col(i)).norm();
    surface.segments.push_back({i, (i + 1) % edges, radius, 0, start, length});
    start += length;
  }
  ContactObject curve;
  curve.curve_length = start;
  curve.closed = true;
  curve.friction = 0.3;
  surface.objects.push_back(curve);
  return surface;
}

void knotEvaluate(benchmark::State& state)
{
  Eigen::Matrix3Xd x;
  const ContactSurface surface = trefoil(static_cast<int>(state.range(0)), 0.56, x);
  ContactOptions options;
  options.gap = 0.12;
  ContactPotential potential(surface, options);
  potential.begin(x, {}, 0.01);
  for (auto _ : state)
    benchmark::DoNotOptimize(potential.evaluate(x, {}, true));
  state.counters["terms"] = static_cast<double>(potential.terms().size());
  state.counters["clearance"] = potential.clearance(x, {});
}
BENCHMARK(knotEvaluate)->Arg(60)->Arg(240)->Unit(benchmark::kMicrosecond);

void knotStepLimit(benchmark::State& state)
{
  Eigen::Matrix3Xd x;
  const ContactSurface surface = trefoil(static_cast<int>(state.range(0)), 0.56, x);
  ContactOptions options;
  options.gap = 0.12;
  ContactPotential potential(surface, options);
  potential.evaluate(x, {}, true);
  const Eigen::Matrix3Xd end = 0.99 * x;
  for (auto _ : state)
    benchmark::DoNotOptimize(potential.stepLimit(x, end, {}, {}));
}
BENCHMARK(knotStepLimit)->Arg(60)->Arg(240)->Unit(benchmark::kMicrosecond);

/// Strands of 20 segments of 5 mm on a ball of 0.1 m, in random directions: a head of hair.
std::vector<BoundingBox> hair(int segments)
{
  std::mt19937 random(1);
  std::uniform_real_distribution<double> u(-1, 1);
  std::vector<BoundingBox> boxes;
  while (static_cast<int>(boxes.size()) < segments)
  {
    Eigen::Vector3d n(u(random), u(random), u(random));
    n.normalize();
    Eigen::Vector3d p = 0.1 * n;
    for (int i = 0; i < 20; ++i)
    {
      const Eigen::Vector3d q =
          p + 0.005 * (n + 0.5 * Eigen::Vector3d(u(random), u(random), u(random)) - 0.05 * i * Eigen::Vector3d::UnitZ())
                          .normalized();
      boxes.push_back({p.cwiseMin(q).array() - 5e-4, p.cwiseMax(q).array() + 5e-4});
      p = q;
    }
  }
  return boxes;
}

void gridPairs(benchmark::State& state)
{
  const auto boxes = hair(static_cast<int>(state.range(0)));
  const std::vector<int> sets(boxes.size(), GridPairs::kNone);
  GridPairs grid;
  std::size_t pairs = 0;
  for (auto _ : state)
    pairs = grid.find(boxes, sets).size();
  state.counters["pairs"] = static_cast<double>(pairs);
}

void sweepPairs(benchmark::State& state)
{
  const auto boxes = hair(static_cast<int>(state.range(0)));
  std::vector<int> order(boxes.size());
  std::size_t pairs = 0;
  for (auto _ : state)
  {
    for (std::size_t i = 0; i < order.size(); ++i)
      order[i] = static_cast<int>(i);
    std::sort(order.begin(), order.end(), [&](int i, int j) { return boxes[i].low.x() < boxes[j].low.x(); });
    pairs = 0;
    for (std::size_t p = 0; p < order.size(); ++p)
      for (std::size_t q = p + 1; q < order.size() && boxes[order[q]].low.x() <= boxes[order[p]].high.x(); ++q)
        pairs += boxes[order[p]].overlaps(boxes[order[q]]);
    benchmark::DoNotOptimize(pairs);
  }
  state.counters["pairs"] = static_cast<double>(pairs);
}

/// FCL's dynamic AABB tree, updated after a motion of a millimetre and collided with itself; building it is not
/// counted.
void fclTreePairs(benchmark::State& state)
{
  const auto boxes = hair(static_cast<int>(state.range(0)));
  std::vector<std::unique_ptr<fcl::CollisionObjectd>> objects;
  std::vector<fcl::CollisionObjectd*> pointers;
  for (const BoundingBox& b : boxes)
  {
    const Eigen::Vector3d size = b.high - b.low;
    objects.push_back(std::make_unique<fcl::CollisionObjectd>(std::make_shared<fcl::Boxd>(size),
                                                              Eigen::Matrix3d::Identity(), 0.5 * (b.low + b.high)));
    objects.back()->computeAABB();
    pointers.push_back(objects.back().get());
  }
  fcl::DynamicAABBTreeCollisionManagerd manager;
  manager.registerObjects(pointers);
  manager.setup();
  std::size_t pairs = 0;
  double shift = 1e-3;
  for (auto _ : state)
  {
    for (std::size_t i = 0; i < objects.size(); ++i)
    {
      objects[i]->setTranslation(objects[i]->getTranslation() + Eigen::Vector3d(shift, 0, 0));
      objects[i]->computeAABB();
    }
    shift = -shift;
    manager.update();
    pairs = 0;
    manager.collide(&pairs, [](fcl::CollisionObjectd* a, fcl::CollisionObjectd* b, void* data) {
      *static_cast<std::size_t*>(data) += a->getAABB().overlap(b->getAABB());
      return false;
    });
  }
  state.counters["pairs"] = static_cast<double>(pairs);
}
BENCHMARK(gridPairs)->Arg(200)->Arg(2000)->Arg(50000)->Unit(benchmark::kMicrosecond);
BENCHMARK(sweepPairs)->Arg(200)->Arg(2000)->Arg(50000)->Unit(benchmark::kMicrosecond);
BENCHMARK(fclTreePairs)->Arg(200)->Arg(2000)->Arg(50000)->Unit(benchmark::kMicrosecond);

/// FCL's distance of a capsule from a shape, as a rod's segment would need it, against the minimum of the closed
/// formula along the axis.
template <class FclShape>
void fclDistance(benchmark::State& state, const FclShape& shape, const ConvexPiece& piece)
{
  constexpr double kRadius = 0.01, kLength = 0.1;
  std::mt19937 random(1);
  std::uniform_real_distribution<double> u(-1, 1);
  std::vector<fcl::Transform3d> poses;
  std::vector<double> exact;
  while (poses.size() < 1000)
  {
    fcl::Transform3d pose = fcl::Transform3d::Identity();
    pose.translation() = 0.4 * Eigen::Vector3d(u(random), u(random), u(random));
    pose.linear() = Eigen::Quaterniond(u(random), u(random), u(random), u(random)).normalized().toRotationMatrix();
    double a = -0.5 * kLength, b = 0.5 * kLength;
    const auto distance = [&](double t) {
      return pieceDistance(piece, pose * Eigen::Vector3d(0, 0, t)).distance - kRadius;
    };
    for (int k = 0; k < 90; ++k)
    {
      const double p = a + (b - a) / 3, q = b - (b - a) / 3;
      if (distance(p) < distance(q))
        b = q;
      else
        a = p;
    }
    const double least = std::min({distance(a), distance(-0.5 * kLength), distance(0.5 * kLength)});
    if (least < 1e-4)
      continue;
    poses.push_back(pose);
    exact.push_back(least);
  }
  const fcl::CollisionObjectd solid(std::make_shared<FclShape>(shape));
  fcl::CollisionObjectd capsule(std::make_shared<fcl::Capsuled>(kRadius, kLength));
  fcl::DistanceRequestd request(true);
  request.distance_tolerance = 1e-14;
  request.gjk_solver_type = state.range(0) ? fcl::GST_INDEP : fcl::GST_LIBCCD;
  double error = 0.0;
  std::size_t i = 0;
  for (auto _ : state)
  {
    capsule.setTransform(poses[i]);
    fcl::DistanceResultd result;
    fcl::distance(&capsule, &solid, request, result);
    error = std::max(error, std::abs(result.min_distance - exact[i]));
    i = (i + 1) % poses.size();
  }
  state.counters["error_m"] = error;
}
void fclBox(benchmark::State& state) { fclDistance(state, fcl::Boxd(0.4, 0.3, 0.2), Box{{0.4, 0.3, 0.2}}); }
void fclCylinder(benchmark::State& state) { fclDistance(state, fcl::Cylinderd(0.1, 0.5), Cylinder{0.1, 0.5}); }
void fclCapsule(benchmark::State& state) { fclDistance(state, fcl::Capsuled(0.1, 0.3), Capsule{0.1, 0.3}); }
BENCHMARK(fclBox)->Arg(0)->Arg(1);
BENCHMARK(fclCylinder)->Arg(0)->Arg(1);
BENCHMARK(fclCapsule)->Arg(0)->Arg(1);

void softenedCylinder(benchmark::State& state)
{
  Eigen::Matrix3Xd x(3, 2);
  x << -0.05, 0.05, 0.12, 0.121, 0.0, 0.02;
  ContactSurface surface;
  surface.points = 2;
  surface.segments.push_back({0, 1, 0.01, 0, 0.0, 0.1});
  surface.objects.push_back({{true, true, true, 0.0}});
  surface.solids.push_back({Cylinder{0.1, 0.5}, -1.0, {}});
  ContactOptions options;
  options.gap = 0.02;
  ContactPotential potential(surface, options);
  const std::vector<Pose> poses(1);
  for (auto _ : state)
    benchmark::DoNotOptimize(potential.evaluate(x, poses, true));
  state.counters["terms"] = static_cast<double>(potential.terms().size());
}
BENCHMARK(softenedCylinder);

// ---- triangles

/// A square sheet of 1 m with 2 mm of thickness: flat (0), or folded into five layers that touch (1).
ContactSurface sheet(int cells, bool folded, Eigen::Matrix3Xd& x)
{
  constexpr double kThickness = 2e-3;
  const TriangleMesh mesh = gridMesh(1, 1, cells, cells, GridPattern::irregular);
  x = mesh.vertices;
  for (Eigen::Index i = 0; folded && i < x.cols(); ++i)
  {
    const int layer = std::min(4, static_cast<int>(5.0 * x(0, i)));
    const double along = 5.0 * x(0, i) - layer;
    x(0, i) = 0.2 * (layer % 2 == 0 ? along : 1.0 - along);
    x(2, i) = 1.2 * kThickness * layer;
  }
  ContactSurface surface;
  surface.points = static_cast<int>(x.cols());
  for (Eigen::Index i = 0; i < mesh.triangles.cols(); ++i)
  {
    const Eigen::Vector3i t = mesh.triangles.col(i);
    surface.triangles.push_back({{t[0], t[1], t[2]}, 0.5 * kThickness, 0});
  }
  ContactObject object;
  object.rest = std::make_shared<Eigen::Matrix3Xd>(mesh.vertices);
  surface.objects.push_back(object);
  return surface;
}

/// Search, and continuous collision detection, of a sheet that falls by 20 mm.
void sheetStepLimit(benchmark::State& state)
{
  Eigen::Matrix3Xd x;
  const ContactSurface surface = sheet(static_cast<int>(state.range(0)), state.range(1) != 0, x);
  ContactOptions options;
  options.gap = 1e-3;
  ContactPotential potential(surface, options);
  const Eigen::Matrix3Xd end = x.colwise() - Eigen::Vector3d(0, 0, 0.02);
  for (auto _ : state)
    benchmark::DoNotOptimize(potential.stepLimit(x, end, {}, {}));
}
BENCHMARK(sheetStepLimit)->ArgsProduct({{20, 40, 80}, {0, 1}})->Unit(benchmark::kMillisecond);

void sheetEvaluate(benchmark::State& state)
{
  Eigen::Matrix3Xd x;
  const ContactSurface surface = sheet(static_cast<int>(state.range(0)), state.range(1) != 0, x);
  ContactOptions options;
  options.gap = 1e-3;
  ContactPotential potential(surface, options);
  for (auto _ : state)
    benchmark::DoNotOptimize(potential.evaluate(x, {}, true));
  state.counters["terms"] = static_cast<double>(potential.terms().size());
}
BENCHMARK(sheetEvaluate)->ArgsProduct({{20, 40, 80}, {0, 1}})->Unit(benchmark::kMillisecond);

}   // namespace

BENCHMARK_MAIN();
