#pragma once

#include <memory>

#include "slender_sim/rod/rod_stepper.h"

namespace slender {

/// Follows the equilibria of one rod as a load factor grows, by arc-length continuation [Riks, Int. J. Solids Struct.
/// 15, 1979; Crisfield, Computers & Structures 13, 1981]. The factor is an unknown like the positions, so that the path
/// goes on where the factor turns back (folds). A path that branches is followed along the branch whose tangent is
/// nearest to the one before; a perturbation rounds the branch point off.
class RodPath
{
public:
  /// `start` is an equilibrium at factor 0. Loads at a factor: those of `constant` plus factor times `scaled` (gravity,
  /// wind, forces and torques of both; the wind acts through the drag). Grasps stay where they are. `last_factor` (not
  /// zero) sets the scale and the sign of the factor.
  RodPath(std::shared_ptr<const RodModel> model, const RodState& start, const RodInputs& constant,
          const RodInputs& scaled, double last_factor);
  ~RodPath();

  /// Goes on by one step of the path, `share` of its scale long: a factor of share * last_factor, where nothing moves.
  /// Halved where it does not converge.
  StepReport advance(double share);
  /// Goes straight to a factor near the present one, as a step of Newton's method at a fixed load.
  StepReport settleAt(double factor);
  double factor() const;
  const RodState& state() const;

private:
  class Impl;
  std::unique_ptr<Impl> impl_;
};

}   // namespace slender
