#pragma once

namespace slender {

/// What one rod touches.
struct RodTouch
{
  bool self = true, others = true, solids = true;
  double friction = 0.3;   ///< Coulomb [-]
};

}   // namespace slender
