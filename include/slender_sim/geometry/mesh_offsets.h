#pragma once

#include "slender_sim/geometry/triangle_mesh.h"

/// Shapes of a mesh with its vertices moved along their normals.
namespace slender {

/// Unit normals of the vertices (3 x n), of the faces around them weighted by their areas; zero where there is no face.
Eigen::Matrix3Xd vertexNormals(const TriangleMesh& mesh);

/// Unit normals of the faces' corners (3 x 3 m; column 3 f + k is corner k of face f), for shading. Faces around a
/// vertex whose normals differ by less than acos(`crease`) share a normal, weighted by their areas; other edges stay
/// sharp. Zero where a face has no area.
Eigen::Matrix3Xd cornerNormals(const TriangleMesh& mesh, double crease = 0.75);

/// Mean length of the edges of all faces [m]; 0 without.
double meanFaceEdge(const TriangleMesh& mesh);
/// How far the mesh extends along a direction [m].
double extent(const TriangleMesh& mesh, const Eigen::Vector3d& along);
/// Mean distance of the vertices from an axis through their mean [m].
double meanRadius(const TriangleMesh& mesh, const Eigen::Vector3d& axis);

/// Folded like an accordion: by height sin(2 pi s / wavelength) [m], s along a direction, counted from the lowest
/// vertex.
Eigen::Matrix3Xd folded(const TriangleMesh& mesh, const Eigen::Vector3d& along, double wavelength, double height);
/// Ridges along an axis through the mesh's centre (the mean of its vertices): by height cos(count times the angle about
/// it) [m].
Eigen::Matrix3Xd ridged(const TriangleMesh& mesh, const Eigen::Vector3d& axis, int count, double height);
/// Each vertex by a random number within +-height [m]; the same everywhere for the same seed.
Eigen::Matrix3Xd crinkled(const TriangleMesh& mesh, double height, unsigned seed);

}   // namespace slender
