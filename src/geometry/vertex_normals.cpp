#include "slender_sim/geometry/vertex_normals.h"

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
    for (int k = 0; k < 3; ++k)
      normals.col(t[k]) += normal;
  }
  for (Eigen::Index i = 0; i < normals.cols(); ++i)
  {
    const double length = normals.col(i).norm();
    normals.col(i) = length > 0 ? Eigen::Vector3d(normals.col(i) / length) : Eigen::Vector3d(0, 0, 1);
  }
  return normals;
}

}  // namespace slender
