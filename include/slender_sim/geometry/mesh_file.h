#pragma once

#include <string>

#include "slender_sim/geometry/triangle_mesh.h"

namespace slender {

/// Reads the vertices and faces of a Wavefront OBJ file [m]. Vertices keep the file's order, used or not; a polygon becomes the fan of
/// triangles about its first vertex; texture coordinates, normals, groups, materials, lines and points are passed over. Throws
/// std::runtime_error "FILE:LINE: reason": not readable, not a number or not finite, a face with fewer than three vertices, with
/// one twice, or with one that the file does not have (later vertices may be named only by absolute indices), no faces at all.
TriangleMesh readObj(const std::string& path);

}  // namespace slender
