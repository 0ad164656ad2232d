#include "slender_sim/geometry/mesh_offsets.h"

#include <cmath>
#include <random>
#include <vector>

#include <Eigen/Geometry>

namespace slender {

Eigen::Matrix3Xd vertexNormals(const TriangleMesh& mesh)
{
  Eigen::Matrix3Xd normals = Eigen::Matrix3Xd::Zero(3, mesh.vertices.cols());
  for (Eigen::Index f = 0; f < mesh.triangles.cols(); ++f)
  {
    const Eigen::Vector3i t = mesh.triangles.col(f);
    const Eigen::Vector3d a = mesh.vertices.col(t[0]), b = mesh.vertices.col(t[1]), c = mesh.vertices.col(t[2]);
    const Eigen::Vector3d normal = (b - a).cross(c - a);
    for (const int v : t)
      normals.col(v) += normal;
  }
  for (Eigen::Index i = 0; i < normals.cols(); ++i)
    normals.col(i).normalize();   // one by one: this leaves zeros alone
  return normals;
}

Eigen::Matrix3Xd cornerNormals(const TriangleMesh& mesh, double crease)
{
  const Eigen::Index corners = mesh.triangles.size();
  Eigen::Matrix3Xd areas(3, mesh.triangles.cols());   // normals of the faces, twice their areas long
  std::vector<Eigen::Index> first(static_cast<std::size_t>(mesh.vertices.cols()) + 1, 0),
      around(static_cast<std::size_t>(corners));
  for (Eigen::Index f = 0; f < mesh.triangles.cols(); ++f)
  {
    const Eigen::Vector3d a = mesh.vertices.col(mesh.triangles(0, f));
    areas.col(f) = (mesh.vertices.col(mesh.triangles(1, f)) - a).cross(mesh.vertices.col(mesh.triangles(2, f)) - a);
    for (int k = 0; k < 3; ++k)
      ++first[static_cast<std::size_t>(mesh.triangles(k, f)) + 1];
  }
  for (std::size_t i = 1; i < first.size(); ++i)
    first[i] += first[i - 1];
  // faces of vertex i: around[first[i] .. first[i + 1])
  std::vector<Eigen::Index> next(first.begin(), first.end() - 1);
  for (Eigen::Index c = 0; c < corners; ++c)
    around[static_cast<std::size_t>(next[static_cast<std::size_t>(mesh.triangles.data()[c])]++)] = c / 3;
  Eigen::Matrix3Xd normals = Eigen::Matrix3Xd::Zero(3, corners);
  for (Eigen::Index c = 0; c < corners; ++c)
  {
    const std::size_t vertex = static_cast<std::size_t>(mesh.triangles.data()[c]);
    const Eigen::Vector3d own = areas.col(c / 3);
    for (Eigen::Index k = first[vertex]; k < first[vertex + 1]; ++k)
    {
      const Eigen::Vector3d other = areas.col(around[static_cast<std::size_t>(k)]);
      if (other.dot(own) >= crease * other.norm() * own.norm())
        normals.col(c) += other;
    }
    normals.col(c).normalize();
  }
  return normals;
}

double meanFaceEdge(const TriangleMesh& mesh)
{
  double sum = 0.0;
  for (Eigen::Index f = 0; f < mesh.triangles.cols(); ++f)
    for (int k = 0; k < 3; ++k)
      sum += (mesh.vertices.col(mesh.triangles(k, f)) - mesh.vertices.col(mesh.triangles((k + 1) % 3, f))).norm();
  return mesh.triangles.cols() > 0 ? sum / (3.0 * static_cast<double>(mesh.triangles.cols())) : 0.0;
}

double extent(const TriangleMesh& mesh, const Eigen::Vector3d& along)
{
  const Eigen::RowVectorXd s = along.normalized().transpose() * mesh.vertices;
  return s.maxCoeff() - s.minCoeff();
}

double meanRadius(const TriangleMesh& mesh, const Eigen::Vector3d& axis)
{
  const Eigen::Vector3d n = axis.normalized(), middle = mesh.vertices.rowwise().mean();
  const Eigen::Matrix3Xd away = mesh.vertices.colwise() - middle;
  return (away - n * (n.transpose() * away)).colwise().norm().mean();
}

Eigen::Matrix3Xd folded(const TriangleMesh& mesh, const Eigen::Vector3d& along, double wavelength, double height)
{
  const Eigen::RowVectorXd s = along.normalized().transpose() * mesh.vertices;
  const Eigen::RowVectorXd offset = height * ((s.array() - s.minCoeff()) * (2 * M_PI / wavelength)).sin();
  return mesh.vertices + vertexNormals(mesh) * offset.asDiagonal();
}

Eigen::Matrix3Xd ridged(const TriangleMesh& mesh, const Eigen::Vector3d& axis, int count, double height)
{
  const Eigen::Vector3d u = axis.unitOrthogonal(), v = axis.normalized().cross(u),
                        middle = mesh.vertices.rowwise().mean();
  Eigen::RowVectorXd offset(mesh.vertices.cols());
  for (Eigen::Index i = 0; i < offset.cols(); ++i)
  {
    const Eigen::Vector3d x = mesh.vertices.col(i) - middle;
    offset[i] = height * std::cos(count * std::atan2(v.dot(x), u.dot(x)));
  }
  return mesh.vertices + vertexNormals(mesh) * offset.asDiagonal();
}

Eigen::Matrix3Xd crinkled(const TriangleMesh& mesh, double height, unsigned seed)
{
  std::mt19937 random(seed);
  Eigen::RowVectorXd offset(mesh.vertices.cols());
  for (Eigen::Index i = 0; i < offset.cols(); ++i)
    offset[i] = height * (2 * (random() * 0x1p-32) - 1);
  return mesh.vertices + vertexNormals(mesh) * offset.asDiagonal();
}

}   // namespace slender
