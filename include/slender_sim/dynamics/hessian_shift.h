#pragma once

namespace slender {

/// Multiples of positive diagonals added to a Hessian that is not definite: on massless unknowns (edge angles) and on
/// positions.
///
/// Angles come first. The averaged material curvature (3.14) makes the angle block of a sharply kinked joint (turn
/// above about 80 degrees) indefinite while positions are well determined by their inertia; shifting only the angles
/// keeps Newton's fast convergence there.
struct HessianShift
{
  double position = 0.0, angle = 0.0;

  bool none() const { return position == 0.0 && angle == 0.0; }
  void raise()
  {
    position = angle < 5.0 ? 0.0 : position > 0.0 ? 10.0 * position : 0.1;
    angle = angle < 0.5 ? 1.0 : 10.0;
  }
  /// What to try after a successful iteration.
  void relax()
  {
    position = position > 1e-2 ? 0.1 * position : 0.0;
    angle = position > 0.0 ? angle : angle > 0.1 ? 0.3 * angle : 0.0;
  }
};

}   // namespace slender
