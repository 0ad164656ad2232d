#pragma once

#include <Eigen/Core>

namespace slender {

struct TriangleMesh
{
  Eigen::Matrix3Xd vertices;     ///< 3 x n [m]
  Eigen::Matrix3Xi triangles;    ///< 3 x m, counter-clockwise seen from outside
};

}  // namespace slender
