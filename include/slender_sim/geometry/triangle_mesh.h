#pragma once

#include <vector>

#include <Eigen/Core>

namespace slender {

struct TriangleMesh
{
  Eigen::Matrix3Xd vertices;    ///< 3 x n [m]
  Eigen::Matrix3Xi triangles;   ///< 3 x m, counter-clockwise seen from outside
};

TriangleMesh triangleMesh(const std::vector<Eigen::Vector3d>& vertices, const std::vector<Eigen::Vector3i>& triangles);

/// Area of each face [m^2].
Eigen::VectorXd faceAreas(const TriangleMesh& mesh);

/// A third of the faces around each vertex [m^2] (barycentric cells).
Eigen::VectorXd vertexAreas(const TriangleMesh& mesh);

/// Voronoi cells [m^2], in obtuse triangles replaced by halves and quarters [Meyer et al. 2003, mixed area].
Eigen::VectorXd voronoiAreas(const TriangleMesh& mesh);

}   // namespace slender
