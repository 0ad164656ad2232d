// What colours show: strain, curvature, twist.
#include <algorithm>
#include <array>
#include <cmath>

#include <Eigen/Geometry>

#include "marker_tools.h"

namespace slender {
namespace {

using Eigen::Vector3d;

/// Per node of a curve: turn 2 tan(angle/2) between its edges over the mean of their lengths [1/m].
template <class Position>
std::vector<double> curvatures(int nodes, bool closed, const Position& x)
{
  std::vector<double> out(static_cast<std::size_t>(nodes), 0.0);
  for (int i = closed ? 0 : 1; i < (closed ? nodes : nodes - 1); ++i)
  {
    const Vector3d e = x(i) - x((i + nodes - 1) % nodes), f = x((i + 1) % nodes) - x(i);
    const double along = e.norm() * f.norm() + e.dot(f), lengths = 0.5 * (e.norm() + f.norm());
    if (along > 0.0 && lengths > 0.0)
      out[static_cast<std::size_t>(i)] = 2.0 * e.cross(f).norm() / along / lengths;
  }
  return out;
}

double largest(double range, const std::vector<double>& values)
{
  for (const double value : values)
    range = std::max(range, std::abs(value));
  return range;
}

/// Per vertex, of its triangles' principal stretch that is farthest from 1, less 1, weighted by area.
std::vector<double> membraneStrains(const TriangleMesh& rest, const Eigen::Matrix3Xd& x)
{
  const std::size_t n = static_cast<std::size_t>(x.cols());
  std::vector<double> sum(n, 0.0), weight(n, 0.0);
  for (Eigen::Index f = 0; f < rest.triangles.cols(); ++f)
  {
    const Eigen::Vector3i t = rest.triangles.col(f);
    const Vector3d U = rest.vertices.col(t[1]) - rest.vertices.col(t[0]),
                   V = rest.vertices.col(t[2]) - rest.vertices.col(t[0]);
    const Vector3d axis = U.normalized(), across = (V - V.dot(axis) * axis).normalized();
    Eigen::Matrix2d D;
    D << U.norm(), V.dot(axis), 0.0, V.dot(across);
    Eigen::Matrix<double, 3, 2> d;
    d << x.col(t[1]) - x.col(t[0]), x.col(t[2]) - x.col(t[0]);
    const Eigen::Matrix<double, 3, 2> F = d * D.inverse();
    const Eigen::Matrix2d C = F.transpose() * F;
    const double mean = 0.5 * C.trace(), radius = std::hypot(0.5 * (C(0, 0) - C(1, 1)), C(0, 1));
    const double high = std::sqrt(mean + radius) - 1.0, low = std::sqrt(std::max(0.0, mean - radius)) - 1.0;
    const double area = 0.5 * D.determinant();
    for (int corner = 0; corner < 3; ++corner)
    {
      sum[t[corner]] += area * (high > -low ? high : low);
      weight[t[corner]] += area;
    }
  }
  for (std::size_t i = 0; i < n; ++i)
    sum[i] = weight[i] > 0.0 ? sum[i] / weight[i] : 0.0;
  return sum;
}

/// Mean curvature per vertex [1/m], by the cotangents' Laplacian over a third of the area around; zero on the border.
std::vector<double> meanCurvatures(const MeshTopology& topology, const Eigen::Matrix3Xi& triangles,
                                   const Eigen::Matrix3Xd& x)
{
  const Eigen::Index n = x.cols();
  Eigen::Matrix3Xd laplacian = Eigen::Matrix3Xd::Zero(3, n), normal = Eigen::Matrix3Xd::Zero(3, n);
  Eigen::VectorXd area = Eigen::VectorXd::Zero(n);
  for (Eigen::Index f = 0; f < triangles.cols(); ++f)
    for (int corner = 0; corner < 3; ++corner)
    {
      const int a = triangles(corner, f), b = triangles((corner + 1) % 3, f), c = triangles((corner + 2) % 3, f);
      const Vector3d u = x.col(b) - x.col(a), v = x.col(c) - x.col(a), cross = u.cross(v);
      const double twice = cross.norm();
      if (!(twice > 0.0))
        continue;
      const Vector3d pull = 0.5 * u.dot(v) / twice * (x.col(c) - x.col(b));   // the angle at a weighs the edge b c
      laplacian.col(b) += pull;
      laplacian.col(c) -= pull;
      area[a] += twice / 6.0;
      normal.col(a) += cross;
    }
  std::vector<double> out(static_cast<std::size_t>(n), 0.0);
  for (Eigen::Index i = 0; i < n; ++i)
    if (area[i] > 0.0 && !topology.on_boundary[static_cast<std::size_t>(i)])
      out[i] = (normal.col(i).dot(laplacian.col(i)) > 0.0 ? 0.5 : -0.5) * laplacian.col(i).norm() / area[i];
  return out;
}

}   // namespace

std::vector<double> shownValues(const RodModel& model, const RodState& state, MarkerColor what)
{
  const int nodes = model.nodes(), edges = model.edges();
  if (what == MarkerColor::curvature)
    return curvatures(nodes, model.closed, [&state](int i) -> Vector3d { return state.x.col(i); });
  std::vector<double> out;
  if (what == MarkerColor::none)
    return out;
  for (int i = 0; i < nodes; ++i)
  {
    const int before = model.closed ? (i + edges - 1) % edges : std::max(i - 1, 0), after = std::min(i, edges - 1);
    const double rest = 0.5 * (model.rest_length[before] + model.rest_length[after]);
    if (what == MarkerColor::twist)
    {
      out.push_back(state.twistAt(i) / rest);
      continue;
    }
    const auto length = [&](int j) { return (state.x.col((j + 1) % nodes) - state.x.col(j)).norm(); };
    out.push_back(0.5 * (length(before) + length(after)) / rest - 1.0);
  }
  return out;
}

std::vector<double> shownValues(const ThreadState& state, MarkerColor what)
{
  if (what == MarkerColor::curvature)
    return curvatures(state.nodes(), false, [&state](int i) { return state.x[i]; });
  std::vector<double> out;
  if (what != MarkerColor::twist)   // a fluid has no strain
    return out;
  for (int i = 0; i < state.nodes(); ++i)
    out.push_back(state.twist[i] * 2.0 /
                  (state.edge(std::max(i - 1, 0)).norm() + state.edge(std::min(i, state.edges() - 1)).norm()));
  return out;
}

std::vector<double> shownValues(const ClothModel& model, const Eigen::Matrix3Xd& x, MarkerColor what)
{
  if (what == MarkerColor::strain)
    return membraneStrains(model.rest, x);
  if (what == MarkerColor::curvature)
    return meanCurvatures(model.topology, model.rest.triangles, x);
  return {};
}

double shownRange(const Simulation& simulation, const MarkerOptions& options)
{
  if (options.range > 0.0 || options.color == MarkerColor::none)
    return options.range;
  double range = 0.0;
  const SceneState& state = simulation.state();
  for (std::size_t r = 0; r < state.rods.size(); ++r)
    range = largest(range, shownValues(simulation.rodModel(static_cast<int>(r)), state.rods[r], options.color));
  for (const ThreadGroupState& group : state.threads)
    for (const ThreadState& thread : group.threads)
      range = largest(range, shownValues(thread, options.color));
  for (std::size_t k = 0; k < state.cloths.size(); ++k)
    range = largest(range, shownValues(simulation.clothModel(static_cast<int>(k)), state.cloths[k].x, options.color));
  return std::max(range, 1e-9);
}

std_msgs::ColorRGBA valueColor(double share)
{
  // blue, light grey, red: negative, nothing, positive
  static const std::array<Eigen::Array3d, 3> ends = {Eigen::Array3d(0.13, 0.36, 0.75), Eigen::Array3d(0.86, 0.86, 0.84),
                                                     Eigen::Array3d(0.80, 0.14, 0.12)};
  const double s = std::clamp(share, -1.0, 1.0), strength = std::pow(std::abs(s), 0.8);
  const Eigen::Array3d c = (1.0 - strength) * ends[1] + strength * ends[s < 0.0 ? 0 : 2];
  return color(c[0], c[1], c[2]);
}

}   // namespace slender
