#pragma once

#include "cloth_part.h"
#include "cloth_work.h"
#include "island/island.h"
#include "island/statics.h"

namespace slender {

/// The equilibria of a cloth on its own, with a working copy of its model without damping and air.
class ClothStatics
{
public:
  ClothStatics(const ClothModel& model, const NewtonConfig& newton);

  /// Searches for an equilibrium and writes it into `state`, or only judges `state`. Inputs and state must have been
  /// checked. Returns why no equilibrium was found.
  StepFailure find(ClothState& state, const ClothInputs& inputs, bool search, bool leave_saddles, StepReport& report);
  const Eigen::Matrix3Xd& pinForces() const { return work_.pin_forces; }   ///< of the last find() [N]
  const Eigen::VectorXd& mode() const { return statics_.mode(); }          ///< likewise

private:
  ClothWork work_;
  ClothPart part_;
  Equations equations_;
  Statics statics_;
};

/// A cloth on its own, an island of one part; and statics.
class ClothStepper::Impl : public ClothWork
{
public:
  Impl(std::shared_ptr<const ClothModel> m, const ClothOptions& o);

  /// A step is load(), advance(), end(). load() returns false if it cannot begin; the report then says why.
  bool load(const ClothState& state, const ClothInputs& inputs, double duration, StepReport& report);
  StepReport advance();
  StepReport statics(ClothState& state, const ClothInputs& inputs, bool search, bool leave_saddles);
  bool respond(const Eigen::Matrix3Xd& forces, double duration, Eigen::Matrix3Xd& displacement,
               Eigen::Matrix3Xd& pin_forces_change, Eigen::Matrix3Xd& average_forces_change);
  /// Effective mass of a vertex [kg] at the end of a step of h seconds: impulse over change of velocity. It contains
  /// the mass, damping by mass, and the drag of air along the normal of flat cloth.
  double inertia(int vertex, double h) const;

  ClothPart& part() { return part_; }

  Eigen::Matrix3Xd lowest_mode;
  bool undivided = false;   ///< the present step is one of stepUndivided() that differs from those of the options

private:
  Island& island();
  void systemChanged() override { statics_.reset(); }

  std::unique_ptr<ClothStatics> statics_;   ///< from the first equilibrium on
  ClothPart part_;
  /// Of the options, and of stepUndivided() if it steps otherwise; null until they are needed.
  std::unique_ptr<Island> island_, undivided_;
};

}   // namespace slender
