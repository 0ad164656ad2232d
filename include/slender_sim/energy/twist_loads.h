#pragma once

#include <vector>

#include <Eigen/Core>

#include "slender_sim/energy/chain_term.h"

namespace slender {

/// Torques M_j about the tangents of the edges of a chain:
///
///   E = -sum_j M_j theta_j        [J]
///   theta_j is the turn of edge j since the chain was loaded [rad], so that its turns must be kept.
class TwistLoads final : public ChainTerm
{
public:
  /// One per edge [N m], or empty: there are none.
  void set(const Eigen::VectorXd& torques) { torque_.assign(torques.data(), torques.data() + torques.size()); }
  bool empty() const { return torque_.empty(); }
  /// Work on the way from where the chain was loaded to the trial [J].
  double work(const RodArrays& arrays, const double* turned) const;

  void add(const ChainRange& range, RodEvaluation& sum) override;
  double largestForce(const RodArrays& arrays) const override;

private:
  std::vector<double> torque_;
};

}   // namespace slender
