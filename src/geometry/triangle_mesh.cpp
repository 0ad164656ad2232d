#include "slender_sim/geometry/triangle_mesh.h"

#include <Eigen/Geometry>

namespace slender {

TriangleMesh triangleMesh(const std::vector<Eigen::Vector3d>& vertices, const std::vector<Eigen::Vector3i>& triangles)
{
  TriangleMesh mesh{Eigen::Matrix3Xd(3, vertices.size()), Eigen::Matrix3Xi(3, triangles.size())};
  for (std::size_t i = 0; i < vertices.size(); ++i)
    mesh.vertices.col(static_cast<Eigen::Index>(i)) = vertices[i];
  for (std::size_t f = 0; f < triangles.size(); ++f)
    mesh.triangles.col(static_cast<Eigen::Index>(f)) = triangles[f];
  return mesh;
}

Eigen::VectorXd faceAreas(const TriangleMesh& mesh)
{
  Eigen::VectorXd areas(mesh.triangles.cols());
  for (Eigen::Index f = 0; f < areas.size(); ++f)
  {
    const auto p = [&](int k) { return mesh.vertices.col(mesh.triangles(k, f)); };
    areas[f] = 0.5 * (p(1) - p(0)).cross(p(2) - p(0)).norm();
  }
  return areas;
}

Eigen::VectorXd vertexAreas(const TriangleMesh& mesh)
{
  const Eigen::VectorXd faces = faceAreas(mesh);
  Eigen::VectorXd areas = Eigen::VectorXd::Zero(mesh.vertices.cols());
  for (Eigen::Index f = 0; f < faces.size(); ++f)
    for (int k = 0; k < 3; ++k)
      areas[mesh.triangles(k, f)] += faces[f] / 3.0;
  return areas;
}

Eigen::VectorXd voronoiAreas(const TriangleMesh& mesh)
{
  const Eigen::VectorXd faces = faceAreas(mesh);
  Eigen::VectorXd areas = Eigen::VectorXd::Zero(mesh.vertices.cols());
  for (Eigen::Index f = 0; f < faces.size(); ++f)
  {
    // b[k] = (p_{k+1} - p_k) . (p_{k+2} - p_k): negative where the corner is obtuse
    Eigen::Vector3d b, square;
    for (int k = 0; k < 3; ++k)
    {
      const auto p = [&](int c) { return mesh.vertices.col(mesh.triangles((k + c) % 3, f)); };
      b[k] = (p(1) - p(0)).dot(p(2) - p(0));
      square[k] = (p(2) - p(1)).squaredNorm();   // opposite edge
    }
    for (int k = 0; k < 3; ++k)
    {
      const int i = (k + 1) % 3, j = (k + 2) % 3;
      const double voronoi = (square[j] * b[j] + square[i] * b[i]) / (16.0 * faces[f]);   // cot = b / (2 area)
      const bool obtuse = b.minCoeff() < 0;
      areas[mesh.triangles(k, f)] += !obtuse ? voronoi : b[k] < 0 ? 0.5 * faces[f] : 0.25 * faces[f];
    }
  }
  return areas;
}

}   // namespace slender
