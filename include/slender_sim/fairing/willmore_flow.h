#pragma once

#include <string>
#include <vector>

#include "slender_sim/energy/willmore_energy.h"
#include "slender_sim/geometry/mesh_topology.h"
#include "slender_sim/linalg/sparse_cholesky.h"

namespace slender {

/// What one step of a flow did.
struct FairingReport
{
  bool ok = true;
  bool stationary = false;   ///< no step is left that the energy would notice; the mesh is untouched
  std::string message;       ///< empty when ok; otherwise the reason and what to change
  int iterations = 0;
  int cuts = 0;                               ///< how often an iteration's step was halved
  double energy_before = 0.0, energy = 0.0;   ///< 1/2 int H^2 of the part that moves and the ring around it [-]
  double decrement = 0.0;                     ///< energy that the first iteration promised to first order [-]
  double largest_move = 0.0;                  ///< of a vertex [m]
};

/// Willmore flow x' = -M^-1 dE/dx of 1/2 int H^2 (thesis 2.5.3) by the implicit Euler method. Its equation is solved by
/// Newton-like iterations with the true nonlinear gradient and a constant matrix, M/h + K of the isometric bending
/// model on the mesh given at first, factorised once. One iteration is the semi-implicit step: enough on the way to a
/// stationary surface. Steps that smooth a rough mesh should be iterated: the roughness pushes the surface outwards,
/// and one iteration does so for all of h though the roughness is gone much sooner.
///
/// The boundary of what moves is smooth up to first order (G1): a boundary of the mesh and the vertices next to it keep
/// their places, and the curvature of held vertices beside moving ones counts.
class WillmoreFlow
{
public:
  /// `time_step` h [m^4]; one step halves bumps of wavelength 2 pi h^(1/4), longer ones less. infinity: Newton-like
  /// steps to the stationary surface, if anything is held. `iterations`: at most that many in a step. `selected`:
  /// vertices that may move; empty: all. Throws std::invalid_argument for a time step that is not positive, sizes that
  /// do not fit, faces without area, nothing that may move.
  WillmoreFlow(const TriangleMesh& mesh, const MeshTopology& topology, double time_step, int iterations = 1,
               const std::vector<char>& selected = {});

  /// Advances the vertices (3 x n, of the mesh given at first). The energy does not rise: a step that would raise it,
  /// fold a face over or leave finite numbers is halved; where that does not help it is refused, with the vertices
  /// untouched. Warm steps take no memory.
  FairingReport step(Eigen::Matrix3Xd& vertices);

  /// 1/2 int H^2 of the part that moves and the ring around it [-]; infinite where a face has no area.
  double energy(const Eigen::Matrix3Xd& vertices);

  /// Vertices that move.
  const std::vector<int>& moving() const { return moving_; }

private:
  struct Part;
  explicit WillmoreFlow(Part part);
  void load(const Eigen::Matrix3Xd& vertices);

  /// Of a direction.
  struct Reach
  {
    double decrement = 0.0;          ///< of the merit, as far as it is linear
    double move = 0.0, size = 0.0;   ///< its largest coordinate, and that of the points [m]
  };
  std::string findDirection(Reach& reach);
  bool search(double decrement, double& merit, double& energy, int& cuts);

  Eigen::Index mesh_vertices_;
  int iterations_;
  std::vector<int> moving_;     ///< in the mesh
  std::vector<int> vertices_;   ///< of the part with a say, in the mesh
  std::vector<char> held_;      ///< of those
  WillmoreEnergy willmore_;
  SparseCholesky cholesky_;
  std::vector<double> mass_rate_;   ///< M/h, per vertex of the part
  PointVector x_, start_, gradient_, direction_, trial_;
};

}   // namespace slender
