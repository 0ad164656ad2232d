// Several parts and their contact as one system: how far they go before something is in the way, and what then moves
// along.
#include <algorithm>
#include <cmath>

#include "island/equations.h"
#include "island/equations_loops.h"

namespace slender {

bool Equations::moves(const IslandSolid& s)
{
  const auto isMotion = [](const std::optional<Twist>& v) {
    return v && (v->linear.squaredNorm() > 0.0 || v->angular.squaredNorm() > 0.0);
  };
  return !s.body && (s.start.position != s.target.X_WG.position ||
                     s.start.orientation.coeffs() != s.target.X_WG.orientation.coeffs() || isMotion(s.target.velocity));
}

/// Puts what is prescribed, in the trial, where it is at the fraction `to`, or less far. What driven solids and held
/// points touch, and cloth that is held, moves along by one step of Newton's method. Without this prediction, contact
/// would block the way after a part of the gap. Returns the fraction: if edges would turn too far, everything goes the
/// share of the way at which they do not.
double Equations::advance(double from, double to)
{
  if (solidsMove() || std::any_of(parts_.begin(), parts_.end(), [&](Part* part) { return part->heldMoves(from, to); }))
  {
    unsettle();
    placeSolids(to, poses_end_);
    for (Part* part : parts_)
      part->placeHeld(to);
    gather(points_end_, poses_);
    for (Part* part : parts_)
    {
      part->moveAlong(0.0);
      part->aimHeld(&points_end_);
    }
    pushing_ = true;
    const RodEvaluation trial = evaluate(true);
    pushing_ = false;
    for (Part* part : parts_)
      part->aimHeld(nullptr);
    if (std::isfinite(trial.energy()) && trial.inertia.positiveDefinite())
    {
      solve();
      double alpha = 1.0;
      for (const Part* part : parts_)
        if (!part->settled)
          alpha = std::min(alpha, part->stepLimit());
      contact_->stopFollowing();   // The direction does not contain what is prescribed.
      forParts([&](Part& part) { part.moveAlong(alpha); });
      to = alpha < 1.0 ? from + alpha * (to - from) : to;
    }
  }
  place(to);
  return to;
}

/// Goes from the base towards the trial, as far as nothing touches and no curve is folded. The trial that was reached
/// is the start of the solution. What meets nothing goes all of its way. If something is in the way of what is
/// prescribed, everything goes the same share of its way. Then `reached` is less than `to`, and a solution has to let
/// the obstacle give way before the next call.
Approach Equations::approach(double from, double to, double& reached)
{
  constexpr int kMostRetreats = 20;   // each by half
  const bool held_moves =
      std::any_of(parts_.begin(), parts_.end(), [&](const Part* part) { return part->heldMoves(from, to); });
  const bool moving = held_moves || (from < to && solidsMove());
  // Averages of parts are met wherever contact stops the parts.
  const bool averages = std::any_of(parts_.begin(), parts_.end(), [](Part* part) { return part->averages(); });
  shares_.begin(static_cast<int>(parts_.size()), moving);
  if (moving && (from == to || averages))
    shares_.uniteAll();
  limitShares();
  if (shares_.of(MotionShares::kPrescribed) < 1.0)   // Rods keep their shapes beside what holds them.
    shares_.uniteAll();
  double alpha = shares_.least(), held = shares_.of(MotionShares::kPrescribed);
  bool only_folded = false;
  for (int attempt = 0; attempt < kMostRetreats; ++attempt, alpha *= 0.5, held *= 0.5)
  {
    reached = moving && held < 1.0 ? from + held * (to - from) : to;
    if (alpha < 1.0)
    {
      unsettle();
      for (Part* part : parts_)
        if (const double share = attempt == 0 ? shares_.of(part->number) : 0.5; share < 1.0)
          part->retreat(share);
      place(reached);
      for (Part* part : parts_)
        if (held_moves && from == to)
          part->retreatHeld(alpha);
    }
    const RodEvaluation trial = evaluate(false);
    if (std::isfinite(trial.energy()) && trial.min_chi > kFoldedChi)
    {
      accept();
      return moving && held < 1.0 ? Approach::partly : Approach::arrived;
    }
    only_folded = trial.min_chi <= kFoldedChi && std::isfinite(trial.potential);
  }
  // If contact is not what is wrong, minimize() says what is.
  return only_folded ? Approach::arrived : Approach::squeezed;
}

/// Parts that touch, or that joints connect, go the same share, because the direction of each was computed together
/// with those of the others.
void Equations::uniteCoupled()
{
  const Part* joined = nullptr;
  for (const Part* part : parts_)
    if (part->joined())
    {
      shares_.unite(part->number, (joined ? joined : part)->number);
      joined = part;
    }
  forTerms([&](const ContactTerm& term) {
    for (int p = 1; p < 4; ++p)
      if (term.point[p] >= 0)
        shares_.unite(partOf(term.point[0]).number, partOf(term.point[p]).number);
    if (const RigidPart* body = bodyOf(term.solid))
      shares_.unite(partOf(term.point[0]).number, body->number);
  });
}

/// Sets how far parts may go from the base to the trial.
void Equations::limitShares()
{
  uniteCoupled();
  gather(points_end_, poses_end_);
  contact_->limitShares({points_base_, points_end_, poses_base_, poses_end_}, shares_);
}

double Equations::roomToTrial()
{
  gather(points_end_, poses_end_);
  return contact_->stepLimit(points_base_, points_end_, poses_base_, poses_end_);
}

}   // namespace slender
