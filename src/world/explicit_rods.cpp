#include <algorithm>
#include <stdexcept>

#include "rod/explicit_system.h"
#include "world_statics.h"
#include "explicit_rods.h"

namespace slender {

namespace {

WorldContent checkedForExplicitSteps(const WorldModel& world, WorldContent content)
{
  if (std::any_of(content.rods.begin(), content.rods.end(), [&](int r) { return world.rods[r].contact.has_value(); }))
    throw std::invalid_argument(
        "symplectic_euler takes no contact, whose forces are too stiff for explicit steps: take implicit_euler, bdf2 "
        "or tr_bdf2 (time.integrator)");
  for (const int b : content.bodies)
    checkBody(world.bodies[b].body);
  return content;
}

std::vector<RodStepper::Impl*> steppersOf(const WorldObjects& objects)
{
  std::vector<RodStepper::Impl*> steppers;
  for (const RodObject& rod : objects.rods)
    steppers.push_back(rod.stepper);
  return steppers;
}

std::vector<ExplicitSystem::SimulatedBody> bodiesOf(const WorldObjects& objects)
{
  std::vector<ExplicitSystem::SimulatedBody> bodies;
  for (const BodyObject& body : objects.bodies)
    bodies.push_back({body.index, &objects.world.bodies[body.index].body});
  return bodies;
}

/// Rods, and bodies that welds join with them, in explicit steps.
class ExplicitRods final : public StepGroup
{
public:
  ExplicitRods(const WorldModel& world, WorldContent content, WorldState& state)
    : objects_(world, checkedForExplicitSteps(world, std::move(content)), state),
      system_(world.time, steppersOf(objects_), bodiesOf(objects_), objects_.welds)
  {
    for (std::size_t r = 0; r < objects_.rods.size(); ++r)
      system_.setInputs(r, objects_.rods[r].inputs);
  }

  StepReport step(WorldState& state, const WorldInputs& inputs) override
  {
    StepReport report;
    if (!objects_.takeInputs(state, inputs, report))
      return report;
    for (const RodObject& rod : objects_.rods)
      rod.stepper->begin(state.rods[rod.index]);
    system_.begin(state.bodies, inputs.gravity);
    report = system_.step(objects_.world.time.step);
    if (!report.ok)
      return report;
    for (const RodObject& rod : objects_.rods)
      state.rods[rod.index] = rod.stepper->work;
    system_.end(state.bodies);
    return report;
  }
  StepReport solveEquilibrium(WorldState& state, const WorldInputs& inputs) override
  {
    return solveStatics(objects_, threads_, state, inputs);
  }
  void setThreads(int threads) override { threads_ = threads; }
  const std::vector<Wrench>& wrenches(int rod) const override { return objects_.rods[rod].stepper->wrenches; }
  RodEnergies rodEnergies(int rod, const RodState& state, const Eigen::Vector3d& gravity) const override
  {
    return objects_.rods[rod].stepper->energies(state, gravity);
  }
  RodStepper* stepper(int rod) override { return objects_.rods[rod].alone(); }

private:
  WorldObjects objects_;
  ExplicitSystem system_;
  int threads_ = 0;
};

}   // namespace

std::unique_ptr<StepGroup> makeExplicitRods(const WorldModel& world, WorldContent content, WorldState& state)
{
  return std::make_unique<ExplicitRods>(world, std::move(content), state);
}

}   // namespace slender
