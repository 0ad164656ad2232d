#include "rod_groups.h"

#include <algorithm>
#include <stdexcept>

#include "slender_sim/rod/averaged_rod.h"

namespace slender {

namespace {

class TrackedRod : public StepGroup
{
public:
  TrackedRod(const WorldModel& world, int rod)
    : world_(world),
      rod_(rod),
      constraints_(world.rods[rod].tracked.sets->front().constraints),
      stepper_(world.rods[rod].model, {constraints_, &constraints_->matrix()}, world.time)
  {
  }

  StepReport step(WorldState& state, const WorldInputs& inputs) override
  {
    constraints_->averages(inputs.rod_guides[rod_], targets_);
    return stepper_.step(state.rods[rod_], inputs.rods[rod_], targets_, world_.time.step);
  }
  StepReport solveEquilibrium(WorldState&, const WorldInputs&) override
  {
    throw std::invalid_argument("a rod that tracks a guide has no statics");
  }
  void finish(WorldState& state, const WorldInputs& inputs, StepReport& report) override
  {
    state.rod_guides[rod_].points = inputs.rod_guides[rod_];
    state.rod_guides[rod_].forces = stepper_.averageForces();
    report.tracking_error = std::max(
        report.tracking_error, constraints_->error(targets_, state.rods[rod_].x) / world_.rods[rod_].tracked.size);
  }
  const std::vector<Wrench>& wrenches(int) const override { return stepper_.wrenches(); }
  RodEnergies rodEnergies(int, const RodState& state, const Eigen::Vector3d& gravity) const override
  {
    return stepper_.energies(state, gravity);
  }

private:
  const WorldModel& world_;
  int rod_;
  std::shared_ptr<const WeakConstraints> constraints_;
  AveragedRod stepper_;
  Eigen::Matrix3Xd targets_;   ///< of its averages at the end of the step [m]
};

}   // namespace

std::unique_ptr<StepGroup> makeTrackedRod(const WorldModel& world, int rod)
{
  return std::make_unique<TrackedRod>(world, rod);
}

}   // namespace slender
