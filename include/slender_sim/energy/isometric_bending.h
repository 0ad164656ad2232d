#pragma once

#include <vector>

#include "slender_sim/geometry/mesh_topology.h"
#include "slender_sim/linalg/point_matrix.h"

namespace slender {

/// Discretisations of the isometric bending model E = 1/2 int |Laplacian x|^2 (thesis 2.4).
enum class IsometricElement
{
  nonconforming,   ///< per edge, the hinge's stencil (2.4.4)
  conforming       ///< per inner vertex: cotangents, Voronoi cells lumped (2.4.1)
};

/// The row L-tilde of a hinge (thesis 2.4.4). For isometric motions of a flat mesh |sum_k weights[k] x_k| is the length
/// of the edge times the angle between the faces, if that is small.
struct HingeRow
{
  Eigen::Vector4i vertices;
  Eigen::Vector4d weights;   ///< [-]
  double area;               ///< of both faces [m^2]
};

HingeRow hingeRow(const TriangleMesh& mesh, const MeshTopology& topology, Eigen::Index hinge);

/// Faces all of whose vertices are among these: one number per face, 1 or 0.
std::vector<char> facesWithin(const TriangleMesh& mesh, const std::vector<int>& vertices);

/// Area [m^2] of the faces of a hinge that bend. `clamped`: one per face, not 0 for a face that is held as a whole;
/// empty: none. A clamped face does not bend. A hinge between a clamped face and a free one turns by the curvature of
/// the free face alone, so that only that face's area counts. Then the edge between them is a clamped edge. Hinges
/// between two clamped faces do not turn and keep both areas.
double hingeArea(const TriangleMesh& mesh, const MeshTopology& topology, Eigen::Index hinge,
                 const std::vector<char>& clamped);

/// `coefficient` times K = L^T M^-1 L of the thesis on the rest mesh: E = 1/2 x^T K x for each coordinate of the
/// points. Boundary edges (nonconforming) and boundary vertices (conforming) have no row in L, so a free boundary is
/// free. It is positive semidefinite, and constants are in its kernel, and linear functions if the mesh is flat.
/// `clamped` as in hingeArea(), for nonconforming elements.
PointMatrix isometricBending(const TriangleMesh& mesh, const MeshTopology& topology, IsometricElement element,
                             double coefficient, const std::vector<char>& clamped = {});

/// The number by which a plate's bending modulus D must be multiplied to become the coefficient of isometricBending()
/// or hingeStiffness().
///
/// With coefficient 1 the models give energies that depend on the mesh: three times 1/2 int H^2 for a cylinder on
/// equilateral triangles (nonconforming). The calibration makes the energies of cylinders bent along `warp` and across
/// it D area / (2 R^2) in the mean of the two, for cylinders that the vertices lie on. It is 1/3 for nonconforming
/// elements and 1 for conforming ones on equilateral and right-angled lattices with edges along the warp. `warp` is a
/// direction in space, projected onto the mesh; where it is normal to it nothing is counted. Throws
/// std::invalid_argument if nothing is left, or if no such cylinder bends the mesh (two triangles with their edge
/// across the warp's corner).
double bendingCalibration(const TriangleMesh& mesh, const MeshTopology& topology, IsometricElement element,
                          const Eigen::Vector3d& warp);

/// Stiffnesses k of hinges E = sum 1/2 k (theta - rest)^2 that have nonconforming isometric bending as their
/// small-angle limit: coefficient 3 |e|^2 / (A0 + A1) [N m]. `clamped` as in hingeArea().
Eigen::VectorXd hingeStiffness(const TriangleMesh& mesh, const MeshTopology& topology, double coefficient,
                               const std::vector<char>& clamped = {});

}   // namespace slender
