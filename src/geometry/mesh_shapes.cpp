#include "slender_sim/geometry/mesh_shapes.h"

#include <algorithm>
#include <cmath>
#include <random>
#include <stdexcept>
#include <string>
#include <vector>

#include <Eigen/Geometry>
#include <Eigen/LU>

#include "edge_flips.h"
#include "slender_sim/geometry/mesh_subdivision.h"

namespace slender {

namespace {

constexpr double kRowHeight = 0.86602540378443864676;   // of an equilateral triangle of side 1

using Faces = std::vector<Eigen::Vector3i>;

TriangleMesh rightAngled(double width, double height, int columns, int rows, bool alternating)
{
  std::vector<Eigen::Vector3d> vertices;
  Faces faces;
  for (int j = 0; j <= rows; ++j)
    for (int i = 0; i <= columns; ++i)
      vertices.emplace_back(width * i / columns, height * j / rows, 0.0);
  for (int j = 0; j < rows; ++j)
    for (int i = 0; i < columns; ++i)
    {
      const int a = j * (columns + 1) + i, b = a + 1, c = b + columns + 1, d = c - 1;
      if (alternating && (i + j) % 2 == 1)
      {
        faces.emplace_back(a, b, d);
        faces.emplace_back(b, c, d);
      }
      else
      {
        faces.emplace_back(a, b, c);
        faces.emplace_back(a, c, d);
      }
    }
  return triangleMesh(vertices, faces);
}

TriangleMesh equilateral(double width, double height, int columns, int rows)
{
  std::vector<Eigen::Vector3d> vertices;
  Faces faces;
  std::vector<int> starts;   // of rows
  for (int j = 0; j <= rows; ++j)
  {
    starts.push_back(static_cast<int>(vertices.size()));
    const int count = columns + 1 + j % 2;
    for (int i = 0; i < count; ++i)
      vertices.emplace_back(width / columns * (j % 2 == 0 ? i : std::clamp(i - 0.5, 0.0, static_cast<double>(columns))),
                            height * j / rows, 0.0);
  }
  for (int j = 0; j < rows; ++j)
    for (int i = 0; i <= columns; ++i)
    {
      // the shifted row has one vertex more; upwards and downwards triangles follow each other along it
      const int even = (j % 2 == 0 ? starts[j] : starts[j + 1]) + i, odd = (j % 2 == 0 ? starts[j + 1] : starts[j]) + i;
      const auto add = [&](int a, int b, int c) {
        j % 2 == 0 ? faces.emplace_back(a, b, c) : faces.emplace_back(a, c, b);
      };
      add(even, odd + 1, odd);
      if (i < columns)
        add(even, even + 1, odd + 1);
    }
  return triangleMesh(vertices, faces);
}

/// Whether the flip of edge a-b brings a plane mesh nearer to Delaunay: d lies inside the circle through a, b, c.
bool insideCircle(const Eigen::Matrix3Xd& vertices, int a, int b, int c, int d)
{
  const auto p = [&](int v) { return vertices.col(v).head<2>(); };
  Eigen::Matrix3d m;
  const int corners[3] = {a, b, c};
  for (int k = 0; k < 3; ++k)
  {
    const Eigen::Vector2d r = p(corners[k]) - p(d);
    m.row(k) << r[0], r[1], r.squaredNorm();
  }
  return m.determinant() > 1e-9 * std::pow((p(a) - p(b)).norm(), 4);
}

TriangleMesh irregular(double width, double height, int columns, int rows, unsigned seed)
{
  TriangleMesh mesh = equilateral(width, height, columns, rows);
  std::mt19937 engine(seed);
  // no std:: distribution: these differ between libraries
  const auto random = [&] { return 2.0 * (engine() * 0x1p-32) - 1.0; };
  const double reach_x = 0.3 * width / columns, reach_y = 0.3 * height / rows;
  for (Eigen::Index i = 0; i < mesh.vertices.cols(); ++i)
  {
    const double dx = reach_x * random(), dy = reach_y * random();
    double &x = mesh.vertices(0, i), &y = mesh.vertices(1, i);
    const bool side = x <= 0 || x >= width, end = y <= 0 || y >= height;   // these stay on their side of the rectangle
    x += side ? 0.0 : std::clamp(dx, -0.3 * x, 0.3 * (width - x));
    y += end ? 0.0 : dy;
  }
  Faces faces;
  for (Eigen::Index f = 0; f < mesh.triangles.cols(); ++f)
    faces.emplace_back(mesh.triangles.col(f));
  flipEdges(faces, [&](int a, int b, int c, int d) { return insideCircle(mesh.vertices, a, b, c, d); });
  for (std::size_t f = 0; f < faces.size(); ++f)
    mesh.triangles.col(static_cast<Eigen::Index>(f)) = faces[f];
  return mesh;
}

}   // namespace

const char* toString(GridPattern pattern)
{
  static const char* const words[] = {"one_diagonal", "alternating", "equilateral", "irregular"};
  return words[static_cast<int>(pattern)];
}

TriangleMesh gridMesh(double width, double height, int columns, int rows, GridPattern pattern, unsigned seed)
{
  const bool right = pattern == GridPattern::one_diagonal || pattern == GridPattern::alternating;
  if (!(width > 0) || !(height > 0) || !std::isfinite(width) || !std::isfinite(height))
    throw std::invalid_argument("grid: width and height must be positive and finite [m]");
  if (columns < 1 || rows < 0)
    throw std::invalid_argument("grid: columns must be at least 1 and rows at least 0, got " + std::to_string(columns) +
                                " and " + std::to_string(rows));
  if (rows == 0)
    rows = std::max(1, static_cast<int>(std::lround(height / (width / columns * (right ? 1.0 : kRowHeight)))));
  if (pattern == GridPattern::irregular && (columns < 2 || rows < 2))
    throw std::invalid_argument("grid: an irregular one needs at least 2 columns and 2 rows");
  switch (pattern)
  {
    case GridPattern::equilateral: return equilateral(width, height, columns, rows);
    case GridPattern::irregular: return irregular(width, height, columns, rows, seed);
    default: return rightAngled(width, height, columns, rows, pattern == GridPattern::alternating);
  }
}

TriangleMesh discMesh(double radius, int rings)
{
  if (!(radius > 0) || !std::isfinite(radius) || rings < 1)
    throw std::invalid_argument("disc: radius must be positive [m] and rings at least 1");
  std::vector<Eigen::Vector3d> vertices{Eigen::Vector3d::Zero()};
  Faces faces;
  const auto vertex = [](int ring, int k) { return ring == 0 ? 0 : 3 * ring * (ring - 1) + 1 + k % (6 * ring); };
  for (int ring = 1; ring <= rings; ++ring)
  {
    for (int k = 0; k < 6 * ring; ++k)
    {
      const double angle = 2.0 * M_PI * k / (6 * ring), r = radius * ring / rings;
      vertices.emplace_back(r * std::cos(angle), r * std::sin(angle), 0.0);
    }
    for (int sixth = 0; sixth < 6; ++sixth)
      for (int k = 0; k < ring; ++k)
      {
        const int outer = sixth * ring + k, inner = sixth * (ring - 1) + k;
        faces.emplace_back(vertex(ring - 1, inner), vertex(ring, outer), vertex(ring, outer + 1));
        if (k + 1 < ring)
          faces.emplace_back(vertex(ring - 1, inner), vertex(ring, outer + 1), vertex(ring - 1, inner + 1));
      }
  }
  return triangleMesh(vertices, faces);
}

TriangleMesh icosphere(double radius, int levels)
{
  if (!(radius > 0) || !std::isfinite(radius) || levels < 0 || levels > 10)
    throw std::invalid_argument("icosphere: radius must be positive [m] and levels from 0 to 10");
  const double g = 0.5 * (1.0 + std::sqrt(5.0));
  std::vector<Eigen::Vector3d> vertices{{-1, g, 0},  {1, g, 0},  {-1, -g, 0}, {1, -g, 0}, {0, -1, g},  {0, 1, g},
                                        {0, -1, -g}, {0, 1, -g}, {g, 0, -1},  {g, 0, 1},  {-g, 0, -1}, {-g, 0, 1}};
  Faces faces{{0, 11, 5},  {0, 5, 1},  {0, 1, 7},  {0, 7, 10}, {0, 10, 11}, {1, 5, 9}, {5, 11, 4},
              {11, 10, 2}, {10, 7, 6}, {7, 1, 8},  {3, 9, 4},  {3, 4, 2},   {3, 2, 6}, {3, 6, 8},
              {3, 8, 9},   {4, 9, 5},  {2, 4, 11}, {6, 2, 10}, {8, 6, 7},   {9, 8, 1}};
  TriangleMesh mesh = triangleMesh(vertices, faces);
  const auto blowUp = [&] { mesh.vertices = radius * mesh.vertices.colwise().normalized(); };
  blowUp();
  for (int level = 0; level < levels; ++level)
  {
    mesh = subdivide(mesh, 1).mesh;
    blowUp();
  }
  return mesh;
}

}   // namespace slender
