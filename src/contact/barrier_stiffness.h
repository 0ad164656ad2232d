#pragma once

#include <limits>

#include "slender_sim/contact/barrier.h"
#include "slender_sim/contact/contact_surface.h"

namespace slender {

/// The stiffness of the barrier about one object [N], which follows the forces on this object. What touches other
/// objects of the island does not change it.
class BarrierStiffness
{
public:
  double value() const { return value_; }
  /// The range holds until the next call.
  void set(double force, const BarrierRange& range);

  // ---- the contacts of an evaluation
  void restart();
  /// A contact of the object: the normal force [N], the stiffness of its barrier [N], and the gap over the one at which
  /// the pair repels.
  void take(double force, double stiffness, double share);

  void beginStep();                                  ///< The last evaluation was where a step begins.
  void beginSolution() { share_before_ = share_; }   ///< likewise
  /// See ContactPotential::adaptStiffness() and stiffen().
  void adapt(const Barrier& barrier);
  bool stiffen(const Barrier& barrier, bool converged);

private:
  bool shrinks() const;
  void bound();

  double value_ = 0.0;
  BarrierRange range_;
  double largest_force_ = 0.0;                                      ///< of the last evaluation [N]
  double largest_load_ = 0.0;                                       ///< force over the stiffness of its barrier
  double share_ = std::numeric_limits<double>::infinity();          ///< smallest gap over that which repels
  double stiffness_there_ = 0.0;                                    ///< of the barrier of this smallest gap
  double share_begin_ = std::numeric_limits<double>::infinity();    ///< share_ at beginStep()
  double share_before_ = std::numeric_limits<double>::infinity();   ///< share_ at beginSolution()
  double value_before_ = 0.0;                                       ///< stiffness before the barrier was made stiffer
  bool stiffened_ = false;                                          ///< The barrier was made stiffer in this step.
  bool narrow_ = false;   ///< In this step a stiffer barrier has opened no gap.
};

}   // namespace slender
