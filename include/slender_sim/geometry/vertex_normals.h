#pragma once

#include "slender_sim/geometry/triangle_mesh.h"

namespace slender {

/// Unit normals of the vertices, of the faces around each weighted by their areas; of vertices without a face, z.
Eigen::Matrix3Xd vertexNormals(const TriangleMesh& mesh);

}  // namespace slender
