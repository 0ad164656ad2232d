#pragma once

#include <vector>

#include "slender_sim/energy/chain_term.h"

namespace slender {

/// Inertia of the edges' turns about their tangents over a step of a chain:
///
///   E = 1/2 sum_j weight_j (theta_j - target_j)^2        [J]
///   theta_j is the turn of edge j since the chain was loaded [rad], so that its turns must be kept.
class SpinInertia final : public ChainTerm
{
public:
  /// Of a chain with this number of edges; all weights become zero.
  void resize(int edges);
  void set(int edge, double weight /* J, >= 0 */, double target)
  {
    weight_[edge] = weight;
    target_[edge] = target;
  }
  double weight(int edge) const { return weight_[edge]; }

  void add(const ChainRange& range, RodEvaluation& sum) override;

private:
  std::vector<double> weight_, target_;
};

}   // namespace slender
