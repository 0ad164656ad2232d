#pragma once

#include "slender_sim/energy/rod_kernel.h"

namespace slender {

/// The nodes from..to-1 of a chain. The kernel has just evaluated the trial there: frames, strains, gradient and panels
/// of these nodes are complete but for the chain's terms.
struct ChainRange
{
  const RodArrays& arrays;
  const double* turned;   ///< per edge: turn of the base since the chain was loaded [rad], see ChainSystem::keepTurns()
  RodPanel* panels;       ///< of node first_panel and on; nullptr: no second derivatives are wanted
  int first_panel = 0, from = 0, to = 0;

  RodPanel& panel(int node) const { return panels[node - first_panel]; }
};

/// One energy of a chain of nodes and edges (ChainSystem), beside those that the kernel computes together: stretching,
/// bending, twisting, inertia of positions, and loads. Calls are virtual per evaluation, never per element.
class ChainTerm
{
public:
  /// An element's oldest node is no more than this number of nodes before its newest one.
  static constexpr int kReach = 2;

  virtual ~ChainTerm() = default;
  /// Adds the elements whose newest node lies in the range: their energy to `sum` (with min_chi, if they measure
  /// angles), their gradient to arrays.gradient, four per node, and their second derivatives to the panels, unless
  /// these are not wanted. A chain is evaluated in ranges that follow each other, a closed one in a single range.
  virtual void add(const ChainRange& range, RodEvaluation& sum) = 0;
  /// Largest force [N] of the term, for the scale of forces.
  virtual double largestForce(const RodArrays& /*arrays*/) const { return 0.0; }

  /// The trial becomes the base. Terms that measure from a base of their own override this and the next two functions.
  virtual void accept() {}
  /// Keeps a copy of the base, and returns to it.
  virtual void saveBase() {}
  virtual void restoreBase() {}
};

}   // namespace slender
