#include "slender_sim/energy/plate_bending.h"

#include <cmath>
#include <stdexcept>
#include <string>

#include <Eigen/Eigenvalues>
#include <Eigen/Geometry>

#include "slender_sim/energy/isometric_bending.h"

namespace slender {

namespace {

using Eigen::Matrix3d;
using Eigen::Vector3d;

double faceArea(const TriangleMesh& mesh, Eigen::Index f)
{
  const auto p = [&](int k) -> Vector3d { return mesh.vertices.col(mesh.triangles(k, f)); };
  return 0.5 * (p(1) - p(0)).cross(p(2) - p(0)).norm();
}

/// (1 - nu) S : S + nu tr(S)^2 as a form of the three numbers q of S = sum_k q_k n_k n_k^T.
Matrix3d formOfCurvatures(const TriangleMesh& mesh, Eigen::Index f, double nu)
{
  Vector3d along[3];
  for (int k = 0; k < 3; ++k)
    along[k] =
        (mesh.vertices.col(mesh.triangles((k + 1) % 3, f)) - mesh.vertices.col(mesh.triangles(k, f))).normalized();
  Matrix3d form;
  for (int i = 0; i < 3; ++i)
    for (int j = 0; j < 3; ++j)   // the normals enclose the angle that the edges do
      form(i, j) = i == j ? 1.0 : (1.0 - nu) * std::pow(along[i].dot(along[j]), 2) + nu;
  return form;
}

}   // namespace

std::vector<PlateTriangle> plateTriangles(const TriangleMesh& mesh, const MeshTopology& t, double nu, double modulus,
                                          const std::vector<char>& clamped)
{
  if (!(nu > -1.0 && nu < 1.0))
    throw std::invalid_argument("Poisson's ratio of bending must be in (-1, 1), got " + std::to_string(nu));
  std::vector<int> hinge_of(static_cast<std::size_t>(t.edgeCount()), -1);
  for (int h = 0; h < t.hingeCount(); ++h)
    hinge_of[static_cast<std::size_t>(t.hinge_edges[h])] = h;
  std::vector<PlateTriangle> result;
  for (Eigen::Index f = 0; f < mesh.triangles.cols(); ++f)
  {
    if (!clamped.empty() && clamped[static_cast<std::size_t>(f)])
      continue;
    PlateTriangle triangle;
    int inner[3], free[3], free_count = 0;
    Vector3d per_angle;   // q / theta
    for (int k = 0; k < 3; ++k)
    {
      const int edge = t.face_edges(k, f), h = hinge_of[static_cast<std::size_t>(edge)];
      if (h < 0)
      {
        free[free_count++] = k;
        continue;
      }
      const double length = (mesh.vertices.col(t.edges(1, edge)) - mesh.vertices.col(t.edges(0, edge))).norm();
      per_angle[triangle.count] = length / hingeArea(mesh, t, h, clamped);
      triangle.hinges[triangle.count] = h;
      inner[triangle.count++] = k;
    }
    Matrix3d whole = formOfCurvatures(mesh, f, nu);
    // eliminates the curvatures of edges on the boundary, which make the energy least
    for (int b = 0; b < free_count; ++b)
    {
      const int k = free[b];
      const Vector3d column = whole.col(k);
      whole -= column * column.transpose() / column[k];
      whole.row(k).setZero();
      whole.col(k).setZero();
    }
    for (int i = 0; i < triangle.count; ++i)
      for (int j = 0; j < triangle.count; ++j)
        triangle.form(i, j) = modulus * faceArea(mesh, f) * whole(inner[i], inner[j]) * per_angle[i] * per_angle[j];
    if (triangle.count > 0)
      result.push_back(triangle);
  }
  return result;
}

PointMatrix plateBending(const TriangleMesh& mesh, const MeshTopology& t, double poissons_ratio, double modulus,
                         const std::vector<char>& clamped)
{
  std::vector<HingeRow> rows;
  std::vector<double> per_length;
  for (Eigen::Index h = 0; h < t.hinges.cols(); ++h)
  {
    rows.push_back(hingeRow(mesh, t, h));
    per_length.push_back(1.0 / (mesh.vertices.col(t.hinges(1, h)) - mesh.vertices.col(t.hinges(0, h))).norm());
  }
  std::vector<Eigen::Triplet<double>> entries;
  for (const PlateTriangle& triangle : plateTriangles(mesh, t, poissons_ratio, modulus, clamped))
    for (int i = 0; i < triangle.count; ++i)
      for (int j = 0; j < triangle.count; ++j)
      {
        const std::size_t hi = static_cast<std::size_t>(triangle.hinges[i]),
                          hj = static_cast<std::size_t>(triangle.hinges[j]);
        for (int a = 0; a < 4; ++a)
          for (int b = 0; b < 4; ++b)
            entries.emplace_back(
                rows[hi].vertices[a], rows[hj].vertices[b],
                triangle.form(i, j) * per_length[hi] * per_length[hj] * rows[hi].weights[a] * rows[hj].weights[b]);
      }
  return PointMatrix(static_cast<int>(mesh.vertices.cols()), entries);
}

double plateStiffening(const TriangleMesh& mesh, const MeshTopology& t, double nu)
{
  std::vector<int> hinge_of(static_cast<std::size_t>(t.edgeCount()), -1);
  for (int h = 0; h < t.hingeCount(); ++h)
    hinge_of[static_cast<std::size_t>(t.hinge_edges[h])] = h;
  // symmetric tensors as (xx, yy, sqrt(2) xy)
  const auto vectorOf = [](const Eigen::Vector2d& n) {
    return Vector3d(n.x() * n.x(), n.y() * n.y(), std::sqrt(2.0) * n.x() * n.y());
  };
  const Vector3d trace(1, 1, 0);
  const Matrix3d exact = (1.0 - nu) * Matrix3d::Identity() + nu * trace * trace.transpose();
  Matrix3d sum = Matrix3d::Zero();
  double area = 0.0;
  for (Eigen::Index f = 0; f < mesh.triangles.cols(); ++f)
  {
    const auto p = [&](int k) -> Vector3d { return mesh.vertices.col(mesh.triangles(k, f)); };
    const Eigen::Vector3i corners = mesh.triangles.col(f);
    if (t.on_boundary[corners[0]] || t.on_boundary[corners[1]] || t.on_boundary[corners[2]])
      continue;   // grids end in triangles of other shapes
    const Vector3d normal = (p(1) - p(0)).cross(p(2) - p(0)).normalized();
    Vector3d x = Vector3d::UnitX() - normal * normal.x();
    x = x.norm() > 0.1 ? Vector3d(x.normalized()) : normal.cross(Vector3d::UnitZ()).normalized();
    const Vector3d y = normal.cross(x);
    Matrix3d shape = Matrix3d::Zero();   // the triangle's tensor over that of the surface
    for (int k = 0; k < 3; ++k)
    {
      const HingeRow row = hingeRow(mesh, t, hinge_of[static_cast<std::size_t>(t.face_edges(k, f))]);
      Vector3d angle = Vector3d::Zero();   // times the edge, for each component of the tensor
      for (int a = 0; a < 4; ++a)
      {
        const Vector3d away = mesh.vertices.col(row.vertices[a]) - p(0);
        angle -= 0.5 * row.weights[a] * vectorOf(Eigen::Vector2d(away.dot(x), away.dot(y)));
      }
      const Vector3d n = (p((k + 1) % 3) - p(k)).cross(normal).normalized();
      shape += vectorOf(Eigen::Vector2d(n.dot(x), n.dot(y))) * angle.transpose() / row.area;
    }
    sum += faceArea(mesh, f) * shape.transpose() * exact * shape;
    area += faceArea(mesh, f);
  }
  if (!(area > 0.0))
    return 1.0;
  return Eigen::GeneralizedSelfAdjointEigenSolver<Matrix3d>(sum, area * exact).eigenvalues().maxCoeff();
}

}   // namespace slender
