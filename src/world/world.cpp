#include "slender_sim/world/world.h"

#include <algorithm>
#include <stdexcept>
#include <utility>

#include "island_scheduler.h"
#include "tracked_parts.h"

namespace slender {

bool WorldModel::leads(int cloth) const
{
  return std::any_of(cloths.begin(), cloths.end(),
                     [cloth](const Cloth& other) { return other.tracked.leader == cloth; });
}

/// The objects, in the order in which they step: if any cloths lead others, these; then all other objects.
class World::Impl
{
public:
  Impl(WorldModel world, WorldState& state) : model(std::move(world))
  {
    bool any_leads = false;
    for (int k = 0; k < static_cast<int>(model.cloths.size()); ++k)
    {
      any_leads = any_leads || model.leads(k);
      if (model.cloths[k].tracked.leader >= 0 && model.leads(k))
        throw WorldError(FailurePlace::Kind::cloth, k, "a cloth that tracks a guide cannot be one");
    }
    if (any_leads)
      schedulers.push_back(std::make_unique<IslandScheduler>(model, true, state));
    schedulers.push_back(std::make_unique<IslandScheduler>(model, false, state));
  }

  /// Calls `advance` on the schedulers until one fails. If one fails or throws, the state is as it was before.
  template <class Advance>
  StepReport advance(WorldState& state, bool restorable, const Advance& advance)
  {
    // A scheduler that fails leaves its own objects as they were. Those of the other one must not have moved either.
    if (restorable)
      before_ = state;
    StepReport total;
    try
    {
      for (std::size_t i = 0; i < schedulers.size() && total.ok; ++i)
        total.merge(advance(*schedulers[i]));
    }
    catch (...)
    {
      if (restorable)
        std::swap(state, before_);
      throw;
    }
    if (!total.ok && restorable)
      std::swap(state, before_);
    return total;
  }

  /// What steps a cloth.
  IslandScheduler& of(int cloth) const { return *(model.leads(cloth) ? schedulers.front() : schedulers.back()); }
  IslandScheduler& ofRods() const { return *schedulers.back(); }

  const WorldModel model;
  std::vector<std::unique_ptr<IslandScheduler>> schedulers;

private:
  WorldState before_;   ///< a step that may fail in the second scheduler
};

World::World(WorldModel model, WorldState& state)
{
  built(FailurePlace::Kind::none, -1, [&] {
    impl_ = std::make_unique<Impl>(std::move(model), state);
    checkCloths(state);
  });
}
World::~World() = default;

const WorldModel& World::model() const { return impl_->model; }

StepReport World::step(WorldState& state, const WorldInputs& inputs)
{
  const bool restorable = impl_->schedulers.size() > 1 || functionsDue(model(), state);
  StepReport total = impl_->advance(state, restorable, [&](IslandScheduler& scheduler) {
    if (&scheduler == impl_->schedulers.front().get())
      takeOverDue(model(), state);
    return scheduler.step(state, inputs);
  });
  if (!total.ok)
    return total;
  moveGiven(model(), inputs, model().time.step, state);
  ++state.steps;
  state.time = static_cast<double>(state.steps) * model().time.step;   // no sum of round-off
  for (const auto& scheduler : impl_->schedulers)
    scheduler->finish(state, inputs, total);
  return total;
}

StepReport World::solveEquilibrium(WorldState& state, const WorldInputs& inputs)
{
  return impl_->advance(state, true,
                        [&](IslandScheduler& scheduler) { return scheduler.solveEquilibrium(state, inputs); });
}

void World::setThreads(int threads)
{
  if (threads < 1)
    throw std::invalid_argument("threads = " + std::to_string(threads) + "; must be at least 1");
  for (const auto& scheduler : impl_->schedulers)
    scheduler->setThreads(threads);
}

void World::checkCloths(WorldState& state)
{
  for (const auto& scheduler : impl_->schedulers)
    scheduler->checkCloths(state);
}

const std::vector<Wrench>& World::rodWrenches(int rod) const { return impl_->ofRods().rod(rod).stepper->wrenches; }

RodEnergies World::rodEnergies(int rod, const RodState& state, const Eigen::Vector3d& gravity) const
{
  return impl_->ofRods().rod(rod).stepper->energies(state, gravity);
}

RodStepper* World::rodStepper(int rod) { return impl_->ofRods().rod(rod).alone(); }

const Eigen::Matrix3Xd& World::pinForces(int cloth) const { return impl_->of(cloth).pinForces(cloth); }

Eigen::Matrix3Xd World::contactForces(const ObjectRef& part) const
{
  return (part.isCloth() ? impl_->of(part.index) : impl_->ofRods()).contactForces(part);
}

ClothEnergies World::clothEnergies(int cloth, const ClothState& state, const Eigen::Vector3d& gravity) const
{
  return impl_->of(cloth).clothEnergies(cloth, state, gravity);
}

ContactLoads World::contactLoads() const
{
  ContactLoads all{{}, std::vector<Wrench>(model().obstacles.size()), std::vector<Wrench>(model().bodies.size())};
  for (const auto& scheduler : impl_->schedulers)
    scheduler->addContacts(all);
  return all;
}

void World::forgetContacts()
{
  for (const auto& scheduler : impl_->schedulers)
    scheduler->forgetContacts();
}

const FunctionSet& World::functions(const ObjectRef& part, const WorldState& state) const
{
  return functionsOf(model(), part, state);
}

void World::setFunctions(int cloth, std::size_t set, double blend, WorldState& state) const
{
  const TrackedGuide& tracked = impl_->model.cloths.at(cloth).tracked;
  ClothState& held = state.cloths[cloth];
  if (!held.pins.empty())   // without any they are as independent as when the model was made
  {
    std::vector<char> pinned(static_cast<std::size_t>(held.x.cols()), 0);
    for (const int vertex : held.pins)
      pinned[static_cast<std::size_t>(vertex)] = 1;
    tracked.sets->at(set).constraints->requireIndependent(pinned);
  }
  takeOver(tracked, set, blend, state.time, held, state.cloth_guides[cloth]);
}

TrackingError World::trackingError(const ObjectRef& part, const WorldState& state) const
{
  if (!model().tracked(part).sets)
    return TrackingError();
  Eigen::Matrix3Xd targets = functions(part, state).constraints->averages(state.guide(part).points);
  state.guide(part).blend.apply(state.time, targets);
  return errorOf(model(), part, state, targets);
}

}   // namespace slender
