#pragma once

#include "slender_sim/linalg/isa.h"

/// Structure-of-arrays view of a naturally straight, isotropic rod for the hot loops (thesis 4.2, special case).
/// Indices as in RodArrays: edge j follows node j, joint i sits at node i. Every array is readable from -kHalo to nodes
/// + kHalo. Energy:
///   sum_i 1/2 alpha/l |kappa b|^2 + sum_j 1/2 k_s strain^2 |eBar|, and the twist's, whose gradient is torque *
///   d(holonomy)/dx.
namespace slender {

struct IsotropicArrays
{
  static constexpr int kHalo = 16;

  int nodes = 0, edges = 0;
  bool closed = false;
  double* x[3];                             ///< node positions [m]
  double *t[3], *inverse_length, *strain;   ///< per edge
  double* inverse_chi;                      ///< per joint 1 / (1 + t . t')
  double* bend;                             ///< per joint alpha / l [N m], 0: no joint
  double* torque;                           ///< per joint twisting moment [N m]
  double *stretch, *inverse_rest_length;    ///< per edge k_s [N], 1 / |eBar|
  double *before[3], *after[3];             ///< per joint: derivatives by the edges before and after it [N]
  double* u[3];       ///< per edge a director: parallel along each piece of the rod, then turned by `angle`
  double* angle;      ///< per edge [rad]
  double* gradient;   ///< 3 per node, dE/dx
};

struct IsotropicEnergy
{
  double bend = 0, stretch = 0;   ///< [J]
  double min_chi = 2, max_strain = 0;
  double energy() const { return bend + stretch; }
};

struct IsotropicKernels
{
  /// Tangents, lengths, strains and chi at x. Sets min_chi and max_strain.
  void (*tangents)(const IsotropicArrays& rod, IsotropicEnergy& sum);
  /// Gradient and energies from them.
  void (*forces)(const IsotropicArrays& rod, IsotropicEnergy& sum);
  /// Carries u[first[p]] along the pieces of count[p] edges each (at least one, at most four pieces at the same time,
  /// one after another along the rod).
  void (*transport)(const IsotropicArrays& rod, int pieces, const int* first, const int* count);
  /// u := u turned by `angle` about t, cleaned of round-off; edges from .. to-1.
  void (*turn)(const IsotropicArrays& rod, int from, int to);
};

SLENDER_DECLARE_KERNELS(IsotropicKernels, kIsotropicKernels)

/// The table for this machine.
const IsotropicKernels& isotropicKernels();

}   // namespace slender
