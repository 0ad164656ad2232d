#pragma once

#include <vector>

#include <Eigen/Core>

#include "slender_sim/geometry/mesh_topology.h"
#include "slender_sim/linalg/point_matrix.h"

namespace slender {

/// Bending energy of one triangle of a thin plate as a quadratic form of the angles of its hinges:
///   E = 1/2 sum_ij w_ij theta_i theta_j.
struct PlateTriangle
{
  int count = 0;            ///< hinges of the triangle: its edges that are not on the boundary
  Eigen::Vector3i hinges;   ///< their numbers in MeshTopology
  Eigen::Matrix3d form;     ///< w [N m]: the first `count` rows and columns
};

/// Bending energy of a thin plate with Poisson's ratio nu, E = D/2 int [(1 - nu) S : S + nu tr(S)^2] dA, with one shape
/// operator S per triangle [cf. Grinspun et al. 2006]. With principal curvatures k1 and k2, tr(S) = k1 + k2 and S : S =
/// k1^2 + k2^2.
///
/// The angles theta_e of a triangle's hinges give S = sum_e q_e n_e n_e^T with q_e = |e| theta_e / (A0 + A1), the
/// normals n_e of the edges in the plane of the triangle, and the areas A0 and A1 of the two faces of the hinge. S is
/// exact for all quadratic surfaces on meshes in which every two adjacent faces form a parallelogram: equilateral
/// grids, and right-angled grids with parallel diagonals. An edge on the boundary has no angle. Its q_e is the one that
/// makes the energy least, so that there is no moment across a free boundary.
///
/// `modulus`: D [N m]. `clamped`: one per face, not 0 for a face that is held as a whole, or empty. Clamped faces have
/// no energy, and A0 + A1 is without their area (see hingeArea()). Throws std::invalid_argument for a ratio that is not
/// in (-1, 1).
std::vector<PlateTriangle> plateTriangles(const TriangleMesh& mesh, const MeshTopology& topology, double poissons_ratio,
                                          double modulus, const std::vector<char>& clamped = {});

/// The constant matrix K of this energy for isometric motions of a flat rest shape: E = 1/2 x^T K x for each coordinate
/// of the points. An angle enters as the row of nonconforming isometric bending over the edge's length (see
/// isometricBending()). For nu = -1/3 on equilateral triangles K is that model's, apart from the boundary.
PointMatrix plateBending(const TriangleMesh& mesh, const MeshTopology& topology, double poissons_ratio, double modulus,
                         const std::vector<char>& clamped = {});

/// Largest ratio of the energy that a quadratic surface gets from plateTriangles(), in triangles without a vertex on
/// the boundary, to D/2 int [(1 - nu) S : S + nu tr(S)^2] dA. It is 1 on meshes of parallelograms and more on others,
/// about 1.1 on irregular meshes. For flat meshes; 1 if all triangles have such a vertex.
double plateStiffening(const TriangleMesh& mesh, const MeshTopology& topology, double poissons_ratio);

}   // namespace slender
