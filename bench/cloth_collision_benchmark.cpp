// Broad phases for cloth: pairs of overlapping triangles of a folded sheet, by our k-DOP tree, FCL's and the grid.
#include <algorithm>
#include <cmath>

#include <benchmark/benchmark.h>
#include <fcl/fcl.h>

#include "slender_sim/contact/broad_phase.h"
#include "contact/impulses/surface_collider.h"
#include "contact/kdop_tree.h"

namespace {

using namespace slender;

constexpr double kThickness = 1e-3;

/// A sheet of 1 m of 2 n^2 triangles in three layers, and where it is a step later.
struct Sheet
{
  Eigen::Matrix3Xd x, x_end;
  Eigen::Matrix3Xi triangles;
};
Sheet folded(int n)
{
  Sheet s;
  s.x.resize(3, (n + 1) * (n + 1));
  s.triangles.resize(3, 2 * n * n);
  const auto at = [n](int i, int j) { return i * (n + 1) + j; };
  for (int i = 0; i <= n; ++i)
    for (int j = 0; j <= n; ++j)
    {
      const double u = 2.5 * M_PI * i / n, v = static_cast<double>(j) / n;
      s.x.col(at(i, j)) << 0.15 * std::sin(u) + 0.004 * std::sin(20 * v), v, 0.003 * u;
    }
  for (int i = 0; i < n; ++i)
    for (int j = 0; j < n; ++j)
    {
      s.triangles.col(2 * (i * n + j)) << at(i, j), at(i + 1, j), at(i + 1, j + 1);
      s.triangles.col(2 * (i * n + j) + 1) << at(i, j), at(i + 1, j + 1), at(i, j + 1);
    }
  s.x_end = s.x;
  for (int i = 0; i < s.x.cols(); ++i)
    s.x_end.col(i) += 1e-3 * Eigen::Vector3d(std::sin(3.0 * i), 0.5, -1.0);
  return s;
}

void ownKdop(benchmark::State& state)
{
  const Sheet s = folded(static_cast<int>(state.range(0)));
  const int m = static_cast<int>(s.triangles.cols());
  Eigen::Matrix3Xd centers(3, m);
  for (int t = 0; t < m; ++t)
    centers.col(t) = (s.x.col(s.triangles(0, t)) + s.x.col(s.triangles(1, t)) + s.x.col(s.triangles(2, t))) / 3;
  KdopTree tree;
  tree.build(centers, std::vector<int>(m, 0), {1}, 1);
  std::vector<Kdop> points(s.x.cols()), volumes(m);
  std::vector<char> active(m, 1);
  std::vector<KdopTree::Pair> pairs;
  for (auto _ : state)
  {
    for (int i = 0; i < s.x.cols(); ++i)
      points[i] = Kdop::swept(s.x.col(i).data(), s.x_end.col(i).data(), 0.5 * kThickness);
    for (int t = 0; t < m; ++t)
    {
      volumes[t] = points[s.triangles(0, t)];
      volumes[t].include(points[s.triangles(1, t)]);
      volumes[t].include(points[s.triangles(2, t)]);
    }
    tree.refit(volumes, active);
    if (state.range(1))
    {
      pairs.clear();
      tree.selfPairs(pairs);
    }
  }
  state.counters["pairs"] = static_cast<double>(pairs.size());
}
BENCHMARK(ownKdop)->Args({22, 1})->Args({71, 0})->Args({71, 1})->Args({158, 1})->Unit(benchmark::kMicrosecond);

template <class Volume>
void collect(const fcl::BVHModel<Volume>& bvh, int a, int b, std::size_t& pairs)
{
  const auto &p = bvh.getBV(a), &q = bvh.getBV(b);
  if (a == b)
  {
    if (p.isLeaf())
      return;
    collect(bvh, p.leftChild(), p.leftChild(), pairs);
    collect(bvh, p.rightChild(), p.rightChild(), pairs);
    collect(bvh, p.leftChild(), p.rightChild(), pairs);
    return;
  }
  if (!p.bv.overlap(q.bv))
    return;
  if (p.isLeaf() && q.isLeaf())
    ++pairs;
  else if (q.isLeaf() || (!p.isLeaf() && p.bv.size() >= q.bv.size()))
  {
    collect(bvh, p.leftChild(), b, pairs);
    collect(bvh, p.rightChild(), b, pairs);
  }
  else
  {
    collect(bvh, a, q.leftChild(), pairs);
    collect(bvh, a, q.rightChild(), pairs);
  }
}

/// Refitted to the motion; without the thickness, which FCL's volumes of triangles leave no place for: fewer pairs.
template <class Volume>
void fclTree(benchmark::State& state)
{
  const Sheet s = folded(static_cast<int>(state.range(0)));
  fcl::BVHModel<Volume> bvh;
  std::vector<fcl::Vector3<double>> from, to;
  std::vector<fcl::Triangle> triangles;
  for (Eigen::Index i = 0; i < s.x.cols(); ++i)
  {
    from.emplace_back(s.x.col(i));
    to.emplace_back(s.x_end.col(i));
  }
  for (Eigen::Index t = 0; t < s.triangles.cols(); ++t)
    triangles.emplace_back(s.triangles(0, t), s.triangles(1, t), s.triangles(2, t));
  bvh.beginModel(static_cast<int>(triangles.size()), static_cast<int>(from.size()));
  bvh.addSubModel(from, triangles);
  bvh.endModel();
  std::size_t pairs = 0;
  bool forth = true;
  for (auto _ : state)
  {
    bvh.beginUpdateModel();
    bvh.updateSubModel(forth ? to : from);
    bvh.endUpdateModel(true, true);
    forth = !forth;
    if (state.range(1))
    {
      pairs = 0;
      collect(bvh, 0, 0, pairs);
    }
  }
  state.counters["pairs"] = static_cast<double>(pairs);
}
BENCHMARK_TEMPLATE(fclTree, fcl::KDOP<double, 16>)
    ->Args({22, 1})
    ->Args({71, 0})
    ->Args({71, 1})
    ->Args({158, 1})
    ->Unit(benchmark::kMicrosecond);
BENCHMARK_TEMPLATE(fclTree, fcl::KDOP<double, 24>)->Args({71, 1})->Unit(benchmark::kMicrosecond);
BENCHMARK_TEMPLATE(fclTree, fcl::AABB<double>)->Args({71, 1})->Unit(benchmark::kMicrosecond);

void grid(benchmark::State& state)
{
  const Sheet s = folded(static_cast<int>(state.range(0)));
  std::vector<BoundingBox> boxes(s.triangles.cols());
  GridPairs pairs;
  std::size_t found = 0;
  for (auto _ : state)
  {
    for (Eigen::Index t = 0; t < s.triangles.cols(); ++t)
    {
      boxes[t] = {Eigen::Vector3d::Constant(1e300), Eigen::Vector3d::Constant(-1e300)};
      for (int k = 0; k < 3; ++k)
        for (const Eigen::Matrix3Xd* x : {&s.x, &s.x_end})
        {
          boxes[t].low = boxes[t].low.cwiseMin(x->col(s.triangles(k, t)));
          boxes[t].high = boxes[t].high.cwiseMax(x->col(s.triangles(k, t)));
        }
      boxes[t].low.array() -= 0.5 * kThickness;
      boxes[t].high.array() += 0.5 * kThickness;
    }
    found = pairs.find(boxes, std::vector<int>(boxes.size(), GridPairs::kNone)).size();
  }
  state.counters["pairs"] = static_cast<double>(found);
}
BENCHMARK(grid)->Arg(22)->Arg(71)->Arg(158)->Unit(benchmark::kMicrosecond);

/// A whole step: sheets of 1 m of 2 n^2 triangles each at rest on a floor and on each other, or one that hangs free
/// (layers 0), under gravity.
void resolve(benchmark::State& state)
{
  const int n = static_cast<int>(state.range(0)), layers = static_cast<int>(state.range(1)),
            sheets = std::max(1, layers);
  CollisionSurface surface;
  const Sheet flat = folded(n);
  const int points = (n + 1) * (n + 1);
  surface.rest.resize(3, sheets * points);
  for (int s = 0; s < sheets; ++s)
  {
    CollisionSheet sheet;
    sheet.triangles = flat.triangles.array() + s * points;
    surface.sheets.push_back(sheet);
    for (int i = 0; i < points; ++i)
      surface.rest.col(s * points + i) << (i / (n + 1)) / double(n) + 0.003 * s, (i % (n + 1)) / double(n) + 0.002 * s,
          0.0;
  }
  surface.solids.push_back({Plane{}, -1.0, {}});
  const Eigen::VectorXd inverse_mass = Eigen::VectorXd::Constant(surface.rest.cols(), points / 0.2);
  Eigen::Matrix3Xd x = surface.rest;
  for (Eigen::Index i = 0; i < x.cols(); ++i)
    x(2, i) = layers == 0 ? 0.5 + 0.05 * std::sin(9 * x(0, i)) * std::cos(7 * x(1, i))
                          : 0.9 * kThickness * (i / points + 0.5) + 1e-5 * std::sin(i);
  SurfaceCollider collider(surface);
  const double h = 0.005;
  Eigen::Matrix3Xd end, v;
  CollisionReport report;
  for (auto _ : state)
  {
    end = x;
    end.row(2).array() -= 9.81 * h * h;
    v = (end - x) / h;
    report = collider.resolve({x, inverse_mass, {Pose{}}, {Pose{}}, h}, end, v);
  }
  state.SetLabel(report.ok ? "" : report.reason);
  state.counters["repulsions"] = report.repulsions;
  state.counters["impulses"] = report.impulses;
  state.counters["rounds"] = report.rounds;
}
BENCHMARK(resolve)->Args({71, 0})->Args({71, 1})->Args({50, 2})->Args({41, 3})->Args({160, 0})->Unit(
    benchmark::kMicrosecond);

}   // namespace

BENCHMARK_MAIN();
