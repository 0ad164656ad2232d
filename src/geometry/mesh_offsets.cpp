#include "slender_sim/geometry/mesh_offsets.h"

#include <cmath>
#include <random>

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
    {
      normals.col(v) += normal;
    }
  }
  for (Eigen::Index i = 0; i < normals.cols(); ++i)
  {
    normals.col(i).normalize();   // one by one: this leaves zeros alone
  }
  return normals;
}

double meanFaceEdge(const TriangleMesh& mesh)
{
  double sum = 0.0;
  for (Eigen::Index f = 0; f < mesh.triangles.cols(); ++f)
  {
    for (int k = 0; k < 3; ++k)
    {
      sum += (mesh.vertices.col(mesh.triangles(k, f)) - mesh.vertices.col(mesh.triangles((k + 1) % 3, f))).norm();
    }
  }
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
  const Eigen::Vector3d u = axis.unitOrthogonal(), v = axis.normalized().cross(u), middle = mesh.vertices.rowwise().mean();
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
  {
    offset[i] = height * (2 * (random() * 0x1p-32) - 1);
  }
  return mesh.vertices + vertexNormals(mesh) * offset.asDiagonal();
}

}  // namespace slender
