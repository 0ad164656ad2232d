#include "barrier_stiffness.h"

#include <algorithm>
#include <cmath>

namespace slender {

namespace {

constexpr double kAim = 5.0;           // Range of a layer over the gap at which the layer shall bear the load.
constexpr double kLeastGap = 12.0;     // Range of a layer over the smallest gap that is allowed; below it stiffens.
constexpr double kLeastShare = 1e-5;   // smallest range of a layer, of the gap; thinner ones are lost in rounding

}   // namespace

void BarrierStiffness::set(const BarrierLaw& law, const BarrierRange& range)
{
  range_ = range;
  law_ = law;
  is_new_ = law_.layers[0].stiffness == 0.0;
  bound();
}

/// The stiffness stays finite if loads overflow. The step then fails with a reason that names the part.
void BarrierStiffness::bound()
{
  const double most = std::min(range_.most, std::numeric_limits<double>::max());
  law_.layers[0].stiffness = std::max(law_.layers[0].stiffness, range_.least);
  for (BarrierLayer& layer : law_.layers)
    layer.stiffness = std::min(layer.stiffness, most);
}

void BarrierStiffness::restart()
{
  largest_force_ = 0.0;
  share_ = std::numeric_limits<double>::infinity();
}

void BarrierStiffness::take(double force, double stiffness, double share)
{
  largest_force_ = std::max(largest_force_, force);
  if (share >= share_)
    return;
  share_ = share;
  stiffness_there_ = stiffness;
}

bool BarrierStiffness::beginStep()
{
  share_begin_ = share_;
  stiffened_ = narrow_ = false;
  const bool begins_inside = is_new_ && share_ < 1.0;
  if (begins_inside)
    law_.layers[0].share = std::max(share_, kLeastShare);
  is_new_ = false;
  return begins_inside;
}

/// Removes inner layers without a gap inside. The outermost layer grows up to the nearest surface. A layer slowly gets
/// softer while its load is small, because the same load often comes back some steps later.
void BarrierStiffness::adapt(const Barrier& barrier, double h)
{
  constexpr double kLarge = 0.5;    // An innermost layer may get softer if the smallest gap is above this share of it.
  constexpr double kStill = 0.02;   // The load stands if the smallest gap has changed by less than this share.
  const double aim = largest_force_ / barrier.force(barrier.c / kAim);
  while (law_.count() > 1 && share_ >= innermost().share)
    innermost() = {0.0, 0.0};
  if (isTooSmall() && shrinks())
    raise(share_, aim);
  BarrierLayer& outer = law_.layers[0];
  if (share_ >= outer.share)
    outer.share = std::min(share_, 1.0);
  else if (h > 0.0 && share_ > kLarge * innermost().share)
    innermost().stiffness = std::max(0.8 * innermost().stiffness, std::min(innermost().stiffness, aim));
  if (std::abs(share_ - share_begin_) < kStill * share_begin_)
    unloadInnerLayers(barrier, h);
  bound();
}

/// Under a load that stands, the outermost layer takes over the force of the inner ones, which are harder to solve. The
/// force at the smallest gap does not change, so that nothing moves. This takes tenths of seconds: most collisions are
/// shorter, so that they gain little energy.
void BarrierStiffness::unloadInnerLayers(const Barrier& barrier, double h)
{
  constexpr double kRate = 20.0, kMostGrowth = 0.2;   // [1/s], and in a step
  const auto forceOf = [&](const BarrierLayer& layer) {
    return layer.share > 0.0 ? layer.stiffness * barrier.force(barrier.c * share_ / layer.share) : 0.0;
  };
  double inner = 0.0;
  for (int k = 1; k < law_.count(); ++k)
    inner += forceOf(law_.layers[static_cast<std::size_t>(k)]);
  BarrierLayer& outer = law_.layers[0];
  const double growth = std::min({kRate * h, kMostGrowth, range_.most / outer.stiffness - 1.0}),
               taken = growth * forceOf(outer);
  if (!(inner > 0.0) || !(taken > 0.0))
    return;
  const double kept = std::max(0.0, 1.0 - taken / inner);
  outer.stiffness *= 1.0 + (1.0 - kept) * inner / forceOf(outer);
  for (int k = law_.count(); k-- > 1;)
    if (BarrierLayer& layer = law_.layers[static_cast<std::size_t>(k)]; kept > 0.0)
      layer.stiffness *= kept;
    else
      layer = {0.0, 0.0};
}

bool BarrierStiffness::isTooSmall() const { return share_ * kLeastGap < law_.innermost().share; }

/// Whether a gap has become smaller since the step began, or is tiny, so that a stiffer barrier may open it.
bool BarrierStiffness::shrinks() const
{
  constexpr double kLess = 0.9, kTiny = 0.02;
  return !narrow_ && (share_ < kLess * share_begin_ || share_ < kTiny * law_.innermost().share);
}

/// Makes the barrier stiffer for gaps below this share alone. If no layer can be added and gaps are inside the
/// innermost one, nothing changes.
void BarrierStiffness::raise(double share, double stiffness)
{
  constexpr double kStiffer = 100.0;   // A layer that is twelve times thinner can then still store more energy.
  const int count = law_.count();
  if (share >= innermost().share)
    innermost().stiffness = stiffness;
  else if (share > kLeastShare && count < BarrierLaw::kMost)
    law_.layers[static_cast<std::size_t>(count)] = {share, std::max(stiffness, kStiffer * innermost().stiffness)};
}

bool BarrierStiffness::stiffen(const Barrier& barrier, bool converged)
{
  constexpr double kOpened = 1.1;
  if (!isTooSmall() || narrow_)
    return false;
  if (stiffened_ && share_ < kOpened * share_before_)
  {
    narrow_ = true;
    law_ = law_before_;
    return true;
  }
  if (!stiffened_ && !shrinks())
    return false;
  const double aim = largest_force_ / barrier.force(barrier.c / kAim);
  law_before_ = law_;
  // If the solution did not converge, the largest force may be far too large.
  raise(share_begin_, converged ? aim : std::clamp(aim, 4.0 * stiffness_there_, 100.0 * stiffness_there_));
  bound();
  stiffened_ = !(law_ == law_before_);
  return stiffened_;
}

}   // namespace slender
