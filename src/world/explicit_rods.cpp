#include <algorithm>
#include <stdexcept>

#include "../rod/explicit_system.h"
#include "joined_statics.h"
#include "rod_islands.h"
#include "slender_sim/dynamics/substep_controller.h"
#include "slender_sim/linalg/interruption.h"

namespace slender {

namespace {

IslandContent checkedForExplicitSteps(const WorldModel& world, IslandContent content)
{
  if (std::any_of(content.rods.begin(), content.rods.end(), [&](int r) { return world.rods[r].contact.has_value(); }))
    throw std::invalid_argument(
        "symplectic_euler takes no contact, whose forces are too stiff for explicit steps: take implicit_euler, bdf2 "
        "or tr_bdf2 (time.integrator)");
  for (const int b : content.bodies)
    checkBody(world.bodies[b].body);
  return content;
}

std::vector<RodStepper::Impl*> steppersOf(const JoinedObjects& objects)
{
  std::vector<RodStepper::Impl*> steppers;
  for (const JoinedRod& rod : objects.rods)
    steppers.push_back(rod.stepper.get());
  return steppers;
}

std::vector<ExplicitSystem::SimulatedBody> bodiesOf(const JoinedObjects& objects)
{
  std::vector<ExplicitSystem::SimulatedBody> bodies;
  for (const JoinedBody& body : objects.bodies)
    bodies.push_back({body.index, &objects.world.bodies[body.index].body});
  return bodies;
}

/// Rods and bodies that welds join, in explicit steps.
class ExplicitRods final : public RodIsland, SubstepEquations
{
public:
  ExplicitRods(const WorldModel& world, IslandContent content, WorldState& state)
    : world_(world),
      objects_(world, checkedForExplicitSteps(world, std::move(content)), state),
      system_(steppersOf(objects_), bodiesOf(objects_), objects_.welds)
  {
    for (std::size_t r = 0; r < objects_.rods.size(); ++r)
      system_.setInputs(r, objects_.rods[r].inputs);
  }

  StepReport step(WorldState& state, const WorldInputs& inputs) override
  {
    StepReport report;
    if (!objects_.takeInputs(state, inputs, report))
      return report;
    for (const JoinedRod& rod : objects_.rods)
      rod.stepper->begin(state.rods[rod.index]);
    system_.begin(state.bodies, inputs.gravity);
    const TimeConfig& time = world_.time;
    SubstepController controller({time.step, 0.0, 0.0, time.min_step, order(time.integrator), time.newton.max_cuts});
    controller.run(*this, time.step, report);
    if (!report.ok)
      return report;
    for (const JoinedRod& rod : objects_.rods)
    {
      rod.stepper->work.next_step = controller.nextLength();
      state.rods[rod.index] = rod.stepper->work;
    }
    system_.end(state.bodies);
    return report;
  }

  StepReport solveEquilibrium(WorldState& state, const WorldInputs& inputs) override
  {
    JoinedStatics statics(objects_);
    statics.setThreads(threads_);
    return statics.solve(state, inputs);
  }

  void setThreads(int threads) override { threads_ = threads; }
  const std::vector<Wrench>& wrenches(int rod) const override { return objects_.rods[rod].stepper->wrenches; }
  RodEnergies rodEnergies(int rod, const RodState& state, const Eigen::Vector3d& gravity) const override
  {
    return objects_.rods[rod].stepper->energies(state, gravity);
  }

private:
  StepFailure attempt(const Substep& substep, StepReport& report) override
  {
    failed_ = 0;
    return system_.step(world_.time.step, substep.from, substep.length, report, failed_);
  }
  void accept(const Substep& substep) override
  {
    for (const JoinedRod& rod : objects_.rods)
    {
      rod.stepper->moveGrasps(rod.inputs, world_.time.step, substep.to);
      std::swap(rod.stepper->work, rod.stepper->next);
    }
    system_.commitStep();
  }
  /// Explicit steps have one length, on which their stability depends.
  bool shorterMayHelp(StepFailure) const override { return false; }
  void refuse(const Substep& substep, StepFailure failure, StepReport& report) override
  {
    report.ok = false;
    report.failure = failure;
    if (failure == StepFailure::interrupted)
      report.message = kStepInterrupted;
    else if (objects_.rods.empty())
      report.message = "the bodies' motion was not found: use a shorter step";
    else
      objects_.rods[failed_].stepper->refuseUnsolved(report, failure, substep.length, true);
  }

  const WorldModel& world_;
  JoinedObjects objects_;
  ExplicitSystem system_;
  int threads_ = 0;
  std::size_t failed_ = 0;   ///< rod that the last failure is about
};

}   // namespace

std::unique_ptr<RodIsland> makeExplicitRods(const WorldModel& world, IslandContent content, WorldState& state)
{
  return std::make_unique<ExplicitRods>(world, std::move(content), state);
}

}   // namespace slender
