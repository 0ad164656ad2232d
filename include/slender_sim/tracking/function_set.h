#pragma once

#include <memory>
#include <optional>
#include <string>

#include "slender_sim/tracking/weak_constraints.h"

namespace slender {

/// Test functions that act together.
struct FunctionSet
{
  std::string name;   ///< empty: of the only set, which needs none
  TestFunctions functions;
  std::shared_ptr<const WeakConstraints> constraints;
  Eigen::VectorXd bounds;       ///< of the force of each [N], infinite without; empty: of none, in all sets
  std::optional<double> from;   ///< simulated time at which they take over [s] > 0; none: when asked to
  double blend = 0.0;           ///< time within which the averages then become the guide's [s]
};

}   // namespace slender
