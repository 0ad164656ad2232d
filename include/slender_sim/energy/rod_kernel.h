#pragma once

#include "slender_sim/linalg/banded_ldlt.h"
#include "slender_sim/linalg/isa.h"

namespace slender {

/// How joints measure their curvature: as in the thesis (joint_stencil.h), or compensated for its leading errors
/// (compensated_response.h).
enum class Curvature
{
  tangent,
  compensated
};

/// Structure-of-arrays view of one rod for the hot loops. Every array is indexed by node or by edge (edge j follows
/// node j, joint i sits at node i between edges i-1 and i) and is readable from index -kHalo to nodes + kHalo. In a
/// closed rod the halo repeats the rod; in an open one it continues the end edges and carries no stiffness.
struct RodArrays
{
  static constexpr int kHalo = 16;

  int nodes = 0, edges = 0;
  bool closed = false;

  // configuration to evaluate
  double* x[3];   ///< node positions [m]
  double* turn;   ///< rotation of each edge's frame about its tangent since the base frames [rad]
  // frames to transport from (thesis 3.17), and those they become
  double *base_t[3], *base_d1[3], *base_twist;
  double *t[3], *d1[3], *twist;
  double *inverse_length, *strain, *kappa1, *kappa2;

  // elastic (or viscous) response, already divided by rest lengths where the strain is integrated
  double* stretch;   ///< k_s [N]
  double *inverse_rest_length, *rest_strain;
  double *b11, *b12, *b22, *beta;   ///< B / l, beta / l [N m]
  double* coupling;                 ///< JointCompensation::coupling [-]; only for Curvature::compensated
  double *rest_kappa1, *rest_kappa2, *rest_twist;

  // inertia and loads: 1/2 weight |x - target|^2 - force . x
  double *weight, *target[3], *force[3];

  // results
  double* gradient;                     ///< 4 per node: dE/dx (3), dE/dtheta
  double *theta_diagonal, *theta_off;   ///< angle block of the Hessian, only without panels
};

struct RodEvaluation
{
  double stretch = 0, bend_twist = 0, potential = 0;   ///< [J]; potential: inertia and loads
  double min_chi = 2;      ///< smallest 1 + t.t' over joints and over transports in time; 0 = folded back
  double max_strain = 0;   ///< largest |axial strain|
  Inertia inertia;         ///< of the Hessian, when it was factored
  double energy() const { return stretch + bend_twist + potential; }
};

/// An evaluation under way along the rod: results of the last joints and running sums. A long rod is treated in pieces
/// that stay in the cache between assembling and eliminating them.
struct RodSweep
{
  static constexpr int kQuantities = 46, kOvershoot = 8;
  alignas(64) double joints[kQuantities][16];   ///< see JointBuffer in the kernel
  alignas(64) double sums[5][8];                ///< stretch, bend_twist, potential, min_chi, max_strain by lane
  int next_edge, next_joint, next_node;
};

struct RodKernels
{
  void (*begin)(const RodArrays& rod, RodSweep& sweep);
  /// Frames, twists, strains, energy and gradient of all nodes below `to` (at least); second derivatives of node i into
  /// panels[i - first_panel] unless it is null. Returns the first node not done: at most kOvershoot beyond `to`. A
  /// closed rod is done in one go.
  using Advance = int(const RodArrays& rod, RodSweep& sweep, BandPanel<10, 4>* panels, int first_panel, int to);
  Advance* advance[2];   ///< by Curvature
  RodEvaluation (*end)(const RodSweep& sweep);
};

SLENDER_DECLARE_KERNELS(RodKernels, kRodKernels)

/// The table for this machine.
const RodKernels& rodKernels();

}   // namespace slender
