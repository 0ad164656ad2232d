#pragma once

#include <limits>

#include "slender_sim/contact/barrier.h"
#include "slender_sim/contact/contact_surface.h"

namespace slender {

/// The barrier about one object, which follows the forces on this object. What touches other objects of the island does
/// not change it.
///
/// A barrier that becomes stiffer while gaps are inside it makes energy. Instead, a stiffer layer is added that begins
/// at the smallest gap that there is. Forces remain the same function of gaps while the object is pressed, except under
/// loads that stay, see unloadInnerLayers(). Inner layers without a gap inside are removed.
class BarrierStiffness
{
public:
  const BarrierLaw& law() const { return law_; }
  /// The range holds until the next call. A law that was not chosen yet gets the least stiffness.
  void set(const BarrierLaw& law, const BarrierRange& range);

  // ---- the contacts of an evaluation
  void restart();
  /// A pair of the object within the gap: the normal force [N], the largest stiffness of the layers that act [N], and
  /// the ratio of its gap to the one at which the pair repels.
  void take(double force, double stiffness, double share);

  /// The last evaluation was where a step begins. Returns true if the law was not chosen before, and now begins at the
  /// smallest gap. Then the evaluation has to be repeated.
  bool beginStep();
  void beginSolution() { share_before_ = share_; }   ///< likewise
  /// See ContactPotential::adaptStiffness() and stiffen().
  void adapt(const Barrier& barrier, double h);
  bool stiffen(const Barrier& barrier, bool converged);

private:
  BarrierLayer& innermost() { return law_.layers[static_cast<std::size_t>(law_.count() - 1)]; }
  bool isTooSmall() const;
  bool shrinks() const;
  void raise(double share, double stiffness);
  void unloadInnerLayers(const Barrier& barrier, double h);
  void bound();

  BarrierLaw law_, law_before_;   ///< law_before_: before the barrier was made stiffer
  BarrierRange range_;
  double largest_force_ = 0.0;                                      ///< of the last evaluation [N]
  double share_ = std::numeric_limits<double>::infinity();          ///< smallest gap over that which repels
  double stiffness_there_ = 0.0;                                    ///< the largest one that acts at this smallest gap
  double share_begin_ = std::numeric_limits<double>::infinity();    ///< share_ at beginStep()
  double share_before_ = std::numeric_limits<double>::infinity();   ///< share_ at beginSolution()
  bool is_new_ = true;                                              ///< The law was not chosen before this step.
  bool stiffened_ = false;                                          ///< The barrier was made stiffer in this step.
  bool narrow_ = false;   ///< In this step a stiffer barrier has opened no gap.
};

}   // namespace slender
