#include "slender_sim/geometry/tube_mesh.h"

#include <algorithm>
#include <cmath>

#include <Eigen/Geometry>

namespace slender {

using Eigen::Vector3d;

namespace {

/// Edges before and after a node; at the ends of an open line twice the same.
std::pair<Eigen::Index, Eigen::Index> edgesAt(const FramedLine& line, Eigen::Index node)
{
  const Eigen::Index edges = line.d1.cols();
  if (line.closed)
    return {(node + edges - 1) % edges, node % edges};
  return {std::max<Eigen::Index>(node - 1, 0), std::min(node, edges - 1)};
}

Vector3d directorAt(const FramedLine& line, Eigen::Index node)
{
  const auto [before, after] = edgesAt(line, node);
  const Vector3d sum = line.d1.col(before) + line.d1.col(after);   // opposite only beyond half a turn per edge
  return sum.norm() > 1e-6 ? Vector3d(sum.normalized()) : Vector3d(line.d1.col(after));
}

Eigen::Vector2d semiAxesAt(const FramedLine& line, Eigen::Index node)
{
  const auto [before, after] = edgesAt(line, node);
  return 0.5 * (line.semi_axes.col(before) + line.semi_axes.col(after));
}

double angleOf(int corner, int sides) { return 2.0 * M_PI * (corner - 0.5) / sides; }

}   // namespace

std::vector<TubeSection> tubeSections(const FramedLine& line, int most)
{
  const int nodes = static_cast<int>(line.x.cols()), edges = static_cast<int>(line.d1.cols());
  const int stride = std::max(1, (edges + most - 1) / most);
  const int pieces = std::clamp(most / (2 * edges), 1, 4);   // per edge
  const auto x = [&](int i) -> Vector3d {
    return line.x.col(line.closed ? (i + nodes) % nodes : std::clamp(i, 0, nodes - 1));
  };
  const auto tangent = [&](int i) -> Vector3d {
    const bool end = !line.closed && (i == 0 || i == nodes - 1);
    return (end ? 1.0 : 0.5) * (x(i + stride) - x(i - stride));
  };
  std::vector<TubeSection> out;
  for (int j = 0; j < edges; j += stride)
  {
    const int next = std::min(j + stride, edges);
    const Vector3d x0 = x(j), x1 = x(next), m0 = tangent(j), m1 = tangent(next % (line.closed ? nodes : nodes + 1));
    const Vector3d d0 = directorAt(line, j), d1 = directorAt(line, next);
    const Eigen::Vector2d a0 = semiAxesAt(line, j), a1 = semiAxesAt(line, next);
    const int last = next == edges ? pieces : pieces - 1;
    const double v0 = line.values.empty() ? 0.0 : line.values[j],
                 v1 = line.values.empty() ? 0.0 : line.values[next % nodes];
    for (int k = 0; k <= last; ++k)
    {
      const double f = static_cast<double>(k) / pieces, g = 1.0 - f;
      const Vector3d t = (6 * f * g * (x1 - x0) + g * (1 - 3 * f) * m0 + f * (3 * f - 2) * m1).normalized();
      const Eigen::Vector2d axes = g * a0 + f * a1;
      Vector3d d = g * d0 + f * d1;
      d = (d - d.dot(t) * t).normalized();
      out.push_back({(1 + 2 * f) * g * g * x0 + f * g * g * m0 + f * f * (3 - 2 * f) * x1 - f * f * g * m1, axes[0] * d,
                     axes[1] * t.cross(d), g * v0 + f * v1});
    }
  }
  return out;
}

Vector3d tubeNormal(const TubeSection& s, int corner, int sides)
{
  const double angle = angleOf(corner, sides);
  return (std::cos(angle) * s.w.squaredNorm() * s.u + std::sin(angle) * s.u.squaredNorm() * s.w).normalized();
}

TriangleMesh tubeMesh(const std::vector<TubeSection>& sections, int sides, bool closed)
{
  const int rings = static_cast<int>(sections.size()) - (closed ? 1 : 0), spans = closed ? rings : rings - 1;
  TriangleMesh mesh;
  mesh.vertices.resize(3, rings * sides + (closed ? 0 : 2));
  mesh.triangles.resize(3, 2 * spans * sides + (closed ? 0 : 2 * sides));
  for (int i = 0; i < rings; ++i)
    for (int side = 0; side < sides; ++side)
    {
      const double angle = angleOf(side, sides);
      mesh.vertices.col(i * sides + side) =
          sections[i].x + std::cos(angle) * sections[i].u + std::sin(angle) * sections[i].w;
    }
  Eigen::Index f = 0;
  const auto vertex = [&](int ring, int side) { return ring % rings * sides + side % sides; };
  for (int i = 0; i < spans; ++i)
    for (int side = 0; side < sides; ++side)
    {
      const int a = vertex(i, side), b = vertex(i + 1, side), c = vertex(i + 1, side + 1), d = vertex(i, side + 1);
      mesh.triangles.col(f++) << a, c, b;
      mesh.triangles.col(f++) << a, d, c;
    }
  if (closed)
    return mesh;
  for (const bool front : {false, true})
  {
    const int middle = rings * sides + (front ? 1 : 0), ring = front ? rings - 1 : 0;
    mesh.vertices.col(middle) = sections[ring].x;
    for (int side = 0; side < sides; ++side)
    {
      const int a = vertex(ring, side), b = vertex(ring, side + 1);
      mesh.triangles.col(f++) << middle, front ? a : b, front ? b : a;
    }
  }
  return mesh;
}

}   // namespace slender
