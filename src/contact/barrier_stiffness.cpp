#include "barrier_stiffness.h"

#include <algorithm>

namespace slender {

namespace {

constexpr double kLeastGap = 12.0;   // the gap over the smallest that barriers are to be resolved in

}   // namespace

void BarrierStiffness::set(double force, const BarrierRange& range)
{
  range_ = range;
  value_ = force;
  bound();
}

/// The stiffness stays finite if loads overflow. The step then fails with a reason that names the part.
void BarrierStiffness::bound()
{
  value_ = std::min(std::max(value_, range_.least), std::min(range_.most, std::numeric_limits<double>::max()));
}

void BarrierStiffness::restart()
{
  largest_force_ = largest_load_ = 0.0;
  share_ = std::numeric_limits<double>::infinity();
}

void BarrierStiffness::take(double force, double stiffness, double share)
{
  largest_force_ = std::max(largest_force_, force);
  largest_load_ = std::max(largest_load_, force / stiffness);
  if (share >= share_)
    return;
  share_ = share;
  stiffness_there_ = stiffness;
}

void BarrierStiffness::beginStep()
{
  share_begin_ = share_;
  stiffened_ = narrow_ = false;
}

void BarrierStiffness::adapt(const Barrier& barrier)
{
  // force over stiffness at a fifth, a twelfth and half of the gap
  const double c = barrier.force(barrier.c / 5), high = barrier.force(barrier.c / kLeastGap), low = 1.0;
  if (largest_load_ > high && shrinks())
    value_ = largest_force_ / c;
  else if (largest_load_ > 0.0 && largest_load_ < low)   // slowly: a load that comes back should find no soft barrier
    value_ = std::max(0.8 * value_, std::min(value_, largest_force_ / c));
  bound();
}

/// Whether a gap has become smaller since the step began, or is tiny, so that a stiffer barrier may open it.
bool BarrierStiffness::shrinks() const
{
  constexpr double kLess = 0.9, kTiny = 0.02;
  return !narrow_ && (share_ < kLess * share_begin_ || share_ < kTiny);
}

bool BarrierStiffness::stiffen(const Barrier& barrier, bool converged)
{
  constexpr double kOpened = 1.1;
  if (share_ > 1.0 / kLeastGap || narrow_)
    return false;
  if (stiffened_ && share_ < kOpened * share_before_)
  {
    narrow_ = true;
    value_ = value_before_;
    return true;
  }
  if (!stiffened_ && !shrinks())
    return false;
  const double before = value_;
  if (converged)
    adapt(barrier);
  else   // Where a gap has collapsed, the forces are far too large to follow them.
    value_ =
        std::clamp(largest_force_ / barrier.force(barrier.c / 5), 4.0 * stiffness_there_, 100.0 * stiffness_there_);
  bound();
  value_before_ = before;
  stiffened_ = true;
  return value_ > before;
}

}   // namespace slender
