#pragma once

namespace slender {

/// Multiples of positive diagonals added to a Hessian that is not definite: on massless unknowns (edge angles) and on
/// positions.
///
/// Angles come first, unless positions have needed a shift before. The averaged material curvature (3.14) makes the
/// angle block of a sharply kinked joint (turn above about 80 degrees) indefinite while positions are well determined
/// by their inertia; shifting only the angles keeps Newton's fast convergence there.
struct HessianShift
{
  double position = 0.0, angle = 0.0;
  double last = 0.0;   ///< the last shift of positions with which the Hessian was definite; 0: none yet

  bool none() const { return position == 0.0 && angle == 0.0; }
  /// Begins with the shift that was enough before, because a body that buckles needs one in many iterations in a row.
  void raise()
  {
    constexpr double kFirst = 0.1, kMostAngle = 10.0;
    if (position > 0.0)
      position *= 10.0;
    else if (last > 0.0 || angle >= 0.5 * kMostAngle)
      position = last > 0.0 ? last : kFirst;
    angle = angle < 0.5 && position == 0.0 ? 1.0 : kMostAngle;
  }
  /// What to try after a successful iteration. A shift that is larger than needed makes increments small.
  void relax()
  {
    constexpr double kLeast = 1e-5;
    last = position > 0.0 ? position : last;
    position = position > 2.0 * kLeast ? 0.1 * position : 0.0;
    angle = position > 0.0 ? angle : angle > 0.1 ? 0.3 * angle : 0.0;
  }
};

}   // namespace slender
