#pragma once

#include <string>

#include "slender_sim/contact/shape.h"

namespace slender {

/// A solid that objects touch and that they do not move: an obstacle, or the shape of a body. Its pose is not part of
/// it.
struct Obstacle
{
  Shape shape = Plane{};
  /// Coefficient of Coulomb friction [-]. Negative: that of whatever touches it; otherwise the geometric mean of both
  /// counts.
  double friction = -1.0;
  std::string name{};   ///< for messages; may be empty
};

}   // namespace slender
