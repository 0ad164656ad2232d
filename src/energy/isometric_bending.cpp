#include "slender_sim/energy/isometric_bending.h"

#include <cmath>
#include <stdexcept>
#include <vector>

#include <Eigen/Geometry>

namespace slender {

namespace {

using Eigen::Vector3d;

/// Cotangent of the angle between two vectors.
double cotangent(const Vector3d& u, const Vector3d& v) { return u.dot(v) / u.cross(v).norm(); }

}   // namespace

HingeRow hingeRow(const TriangleMesh& mesh, const MeshTopology& t, Eigen::Index h)
{
  HingeRow row;
  row.vertices = t.hinges.col(h);
  const auto p = [&](int k) -> Vector3d { return mesh.vertices.col(row.vertices[k]); };
  const Vector3d e = p(1) - p(0);
  // cotangents of the angles at the tail and the head, in the left and in the right face
  const double tail_left = cotangent(e, p(2) - p(0)), tail_right = cotangent(e, p(3) - p(0));
  const double head_left = cotangent(-e, p(2) - p(1)), head_right = cotangent(-e, p(3) - p(1));
  row.weights << head_left + head_right, tail_left + tail_right, -tail_left - head_left, -tail_right - head_right;
  row.area = 0.5 * (e.cross(p(2) - p(0)).norm() + e.cross(p(3) - p(0)).norm());
  return row;
}

std::vector<char> facesWithin(const TriangleMesh& mesh, const std::vector<int>& vertices)
{
  std::vector<char> chosen(static_cast<std::size_t>(mesh.vertices.cols()), 0), faces;
  for (const int v : vertices)
    chosen.at(static_cast<std::size_t>(v)) = 1;
  for (Eigen::Index f = 0; f < mesh.triangles.cols(); ++f)
  {
    bool all = true;
    for (int k = 0; k < 3; ++k)
      all = all && chosen[static_cast<std::size_t>(mesh.triangles(k, f))] != 0;
    faces.push_back(all);
  }
  return faces;
}

double hingeArea(const TriangleMesh& mesh, const MeshTopology& t, Eigen::Index h, const std::vector<char>& clamped)
{
  const auto faces = t.edge_faces.col(t.hinge_edges[static_cast<std::size_t>(h)]);
  bool held[2] = {false, false};
  double area[2];
  for (int side = 0; side < 2; ++side)
  {
    const auto p = [&](int k) -> Vector3d { return mesh.vertices.col(mesh.triangles(k, faces[side])); };
    area[side] = 0.5 * (p(1) - p(0)).cross(p(2) - p(0)).norm();
    held[side] = !clamped.empty() && clamped[static_cast<std::size_t>(faces[side])];
  }
  return held[0] == held[1] ? area[0] + area[1] : area[held[0] ? 1 : 0];
}

namespace {

/// Rows of the cotangent Laplacian: weights of the neighbours; the vertex itself has minus their sum.
std::vector<std::vector<std::pair<int, double>>> cotangentRows(const TriangleMesh& mesh, const MeshTopology& t)
{
  std::vector<std::vector<std::pair<int, double>>> rows(mesh.vertices.cols());
  for (Eigen::Index e = 0; e < t.edges.cols(); ++e)
  {
    const int a = t.edges(0, e), b = t.edges(1, e);
    double weight = 0.0;
    for (int s = 0; s < 2; ++s)
      if (const int c = t.edge_opposites(s, e); c >= 0)
        weight +=
            0.5 * cotangent(mesh.vertices.col(a) - mesh.vertices.col(c), mesh.vertices.col(b) - mesh.vertices.col(c));
    rows[a].emplace_back(b, weight);
    rows[b].emplace_back(a, weight);
  }
  return rows;
}

/// Two orthogonal directions square to `normal`, the first one along the warp; false where that is normal, too.
bool axesIn(const Vector3d& normal, const Vector3d& warp, Vector3d (&axes)[2])
{
  const Vector3d n = normal.normalized();
  axes[0] = warp - n * n.dot(warp);
  if (!(axes[0].norm() > 1e-3 * warp.norm()))
    return false;
  axes[0].normalize();
  axes[1] = n.cross(axes[0]);
  return true;
}

/// Energy with coefficient 1 of unit curvature, in the mean of both directions, and the area that has it.
struct Sample
{
  double energy = 0.0, area = 0.0;
};

Sample sampleHinges(const TriangleMesh& mesh, const MeshTopology& t, const Vector3d& warp)
{
  Sample sample;
  for (Eigen::Index h = 0; h < t.hinges.cols(); ++h)
  {
    const HingeRow row = hingeRow(mesh, t, h);
    const auto p = [&](int k) -> Vector3d {
      return mesh.vertices.col(row.vertices[k]) - mesh.vertices.col(row.vertices[0]);
    };
    const Vector3d e = p(1), along = e.normalized();
    const Vector3d left = e.cross(p(2)).normalized(), right = p(3).cross(e).normalized();
    Vector3d axes[2];
    if (!axesIn(left + right, warp, axes))
      continue;
    // the flap unfolded into the plane between its faces
    const Vector3d across = (left + right).normalized().cross(along);
    const auto flat = [&](int k) -> Vector3d {
      const Vector3d foot = along * along.dot(p(k));
      return foot + across * ((p(k) - foot).norm() * (k == 2 ? 1.0 : -1.0));
    };
    const Vector3d corners[4] = {Vector3d::Zero(), e, flat(2), flat(3)};
    for (const Vector3d& axis : axes)
    {
      double sum = 0.0;
      for (int k = 0; k < 4; ++k)
        sum += row.weights[k] * 0.5 * std::pow(axis.dot(corners[k]), 2);
      sample.energy += 0.5 * 0.5 * 3.0 / row.area * sum * sum;
    }
    sample.area += row.area / 3.0;
  }
  return sample;
}

Sample sampleVertices(const TriangleMesh& mesh, const MeshTopology& t, const Vector3d& warp)
{
  Eigen::Matrix3Xd normals = Eigen::Matrix3Xd::Zero(3, mesh.vertices.cols());
  for (Eigen::Index f = 0; f < mesh.triangles.cols(); ++f)
  {
    const auto p = [&](int k) -> Vector3d { return mesh.vertices.col(mesh.triangles(k, f)); };
    for (int k = 0; k < 3; ++k)
      normals.col(mesh.triangles(k, f)) += (p(1) - p(0)).cross(p(2) - p(0));
  }
  const auto rows = cotangentRows(mesh, t);
  const Eigen::VectorXd areas = voronoiAreas(mesh);
  Sample sample;
  for (std::size_t i = 0; i < rows.size(); ++i)
  {
    Vector3d axes[2];
    if (t.on_boundary[i] || rows[i].empty() || !axesIn(normals.col(i), warp, axes))
      continue;
    for (const Vector3d& axis : axes)
    {
      double sum = 0.0;
      for (const auto& [j, weight] : rows[i])
        sum += weight * 0.5 * std::pow(axis.dot(mesh.vertices.col(j) - mesh.vertices.col(i)), 2);
      sample.energy += 0.5 * 0.5 / areas[i] * sum * sum;
    }
    sample.area += areas[i];
  }
  return sample;
}

}   // namespace

PointMatrix isometricBending(const TriangleMesh& mesh, const MeshTopology& t, IsometricElement element,
                             double coefficient, const std::vector<char>& clamped)
{
  std::vector<Eigen::Triplet<double>> entries;
  if (element == IsometricElement::nonconforming)
    for (Eigen::Index h = 0; h < t.hinges.cols(); ++h)
    {
      const HingeRow row = hingeRow(mesh, t, h);
      const double factor = coefficient * 3.0 / hingeArea(mesh, t, h, clamped);
      for (int a = 0; a < 4; ++a)
        for (int b = 0; b < 4; ++b)
          entries.emplace_back(row.vertices[a], row.vertices[b], factor * row.weights[a] * row.weights[b]);
    }
  else
  {
    auto rows = cotangentRows(mesh, t);
    const Eigen::VectorXd areas = voronoiAreas(mesh);
    for (std::size_t i = 0; i < rows.size(); ++i)
    {
      if (t.on_boundary[i] || rows[i].empty())
        continue;
      double sum = 0.0;
      for (const auto& entry : rows[i])
        sum += entry.second;
      rows[i].emplace_back(static_cast<int>(i), -sum);
      for (const auto& [a, wa] : rows[i])
        for (const auto& [b, wb] : rows[i])
          entries.emplace_back(a, b, coefficient / areas[i] * wa * wb);
    }
  }
  return PointMatrix(static_cast<int>(mesh.vertices.cols()), entries);
}

double bendingCalibration(const TriangleMesh& mesh, const MeshTopology& t, IsometricElement element,
                          const Vector3d& warp)
{
  const Sample sample =
      element == IsometricElement::nonconforming ? sampleHinges(mesh, t, warp) : sampleVertices(mesh, t, warp);
  if (!(sample.energy > 1e-9 * sample.area))   // per area a mesh of more than a few triangles has about 1
    throw std::invalid_argument(
        "bending: the mesh is too coarse to bend along or across its warp, or the warp is normal to it everywhere; "
        "refine it, or choose bending: {model: none}");
  return 0.5 * sample.area / sample.energy;
}

Eigen::VectorXd hingeStiffness(const TriangleMesh& mesh, const MeshTopology& t, double coefficient,
                               const std::vector<char>& clamped)
{
  Eigen::VectorXd stiffness(t.hinges.cols());
  for (Eigen::Index h = 0; h < t.hinges.cols(); ++h)
  {
    const double length2 = (mesh.vertices.col(t.hinges(1, h)) - mesh.vertices.col(t.hinges(0, h))).squaredNorm();
    stiffness[h] = coefficient * 3.0 * length2 / hingeArea(mesh, t, h, clamped);
  }
  return stiffness;
}

}   // namespace slender
