#include "slender_sim/world/world.h"

#include <algorithm>
#include <numeric>
#include <stdexcept>
#include <utility>

#include "cloth_groups.h"
#include "island_scheduler.h"
#include "tracked_parts.h"

namespace slender {

bool WorldModel::leads(int cloth) const
{
  return std::any_of(cloths.begin(), cloths.end(),
                     [cloth](const Cloth& other) { return other.tracked.leader == cloth; });
}

namespace {

using Kind = FailurePlace::Kind;

bool byImpulses(const WorldModel::Cloth& cloth)
{
  return cloth.contact && cloth.contact->method == ContactMethod::impulses;
}

/// The forces on so many points, zero if they are not known.
Eigen::Matrix3Xd orZero(Eigen::Matrix3Xd forces, int points)
{
  if (forces.cols() == 0)
    forces.setZero(3, points);
  return forces;
}

template <class Objects>
bool anyTouches(const Objects& objects)
{
  return std::any_of(objects.begin(), objects.end(), [](const auto& object) { return object.contact.has_value(); });
}

}   // namespace

class World::Impl
{
public:
  Impl(WorldModel world, WorldState& state)
    : model(std::move(world)),
      rods(model.rods.size()),
      cloths(model.cloths.size())
  {
    checkThreads();
    addLeaders(state);
    addImpulses(false);
    addIslands(state);
    checkCloths(state);
  }

  /// Calls `advance` on all groups until one fails, or throws. Then the state is as it was before.
  template <class Advance>
  StepReport advance(WorldState& state, bool restorable, const Advance& advance)
  {
    // A group that fails leaves its own objects as they were. The others must not have moved either.
    if (restorable)
      before_ = state;
    StepReport total;
    try
    {
      total = advance();
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

  StepReport step(WorldState& state, const WorldInputs& inputs)
  {
    StepReport total = advance(state, groups_.size() > 1 || functionsDue(model, state), [&] {
      takeOverDue(model, state);
      return stepGroups(state, inputs);
    });
    if (!total.ok)
      return total;
    moveGiven(inputs, state);
    ++state.steps;
    state.time = static_cast<double>(state.steps) * model.time.step;   // no sum of round-off
    for (const auto& group : groups_)
      group->finish(state, inputs, total);
    return total;
  }

  StepReport solveEquilibrium(WorldState& state, const WorldInputs& inputs)
  {
    return advance(state, true, [&] {
      StepReport total;
      for (std::size_t i = 0; i < groups_.size() && total.ok; ++i)
        total.merge(groups_[i]->solveEquilibrium(state, inputs));
      return total;
    });
  }

  void setThreads(int threads)
  {
    if (threads < 1)
      throw std::invalid_argument("threads = " + std::to_string(threads) + "; must be at least 1");
    for (const auto& group : groups_)
      group->setThreads(threads);
  }

  void checkCloths(WorldState& state)
  {
    for (const auto& place : cloths)
      if (place.index == 0)
        place.group->check(state);
  }

  void forgetContacts()
  {
    for (const auto& group : groups_)
      group->forgetContacts();
  }

  RodObject& rod(int number) const { return islands->rod(rods.at(number)); }

  ContactLoads contactLoads() const
  {
    ContactLoads all{{}, std::vector<SolidLoad>(model.obstacles.size()), std::vector<SolidLoad>(model.bodies.size())};
    for (const auto& group : groups_)
      group->addContacts(all);
    return all;
  }

  const WorldModel model;

  /// Where an object is.
  struct Place
  {
    StepGroup* group = nullptr;
    int index = 0;   ///< in the group
  };
  IslandScheduler* islands = nullptr;   ///< that has the rods; null: there is nothing for it to step
  std::vector<int> rods;                ///< per rod: its place there
  std::vector<Place> cloths;

private:
  StepGroup* add(std::unique_ptr<StepGroup> group)
  {
    groups_.push_back(std::move(group));
    return groups_.back().get();
  }

  /// The cloths that collide by impulses, or those that do not, among the cloths that lead others, or among the rest.
  std::vector<int> clothsThat(bool lead, bool use_impulses) const
  {
    std::vector<int> found;
    for (int k = 0; k < static_cast<int>(model.cloths.size()); ++k)
      if (model.leads(k) == lead && byImpulses(model.cloths[k]) == use_impulses)
        found.push_back(k);
    return found;
  }

  /// Cloths that lead others. They are stepped first, and feel only each other.
  void addLeaders(WorldState& state)
  {
    for (std::size_t k = 0; k < model.cloths.size(); ++k)
      if (model.cloths[k].tracked.leader >= 0 && model.leads(static_cast<int>(k)))
        throw WorldError(Kind::cloth, static_cast<int>(k), "a cloth that tracks a guide cannot be one");
    addImpulses(true);
    WorldContent content;
    content.cloths = clothsThat(true, false);
    if (!content.cloths.empty())
      addScheduler(content, state);
  }

  void addImpulses(bool leaders)
  {
    const std::vector<int> touching = clothsThat(leaders, true);
    if (!touching.empty())
      place(cloths, touching, add(built(Kind::none, -1, [&] { return makeTouchingCloths(model, touching); })));
  }

  IslandScheduler* addScheduler(const WorldContent& content, WorldState& state)
  {
    auto group = built(Kind::none, -1, [&] { return std::make_unique<IslandScheduler>(model, content, state); });
    IslandScheduler* const added = group.get();
    place(cloths, content.cloths, add(std::move(group)));
    return added;
  }

  void checkThreads() const
  {
    for (int k = 0; k < static_cast<int>(model.threads.size()); ++k)
      built(Kind::thread, k, [&] {
        model.threads[k].contact ? checkThreadModel(*model.threads[k].model) : checkLoneThread(*model.threads[k].model);
      });
  }

  /// Rods, threads, simulated bodies, and cloths that do not collide by impulses.
  void addIslands(WorldState& state)
  {
    WorldContent content;
    content.cloths = clothsThat(false, false);
    content.threads.resize(model.threads.size());
    std::iota(content.threads.begin(), content.threads.end(), 0);
    std::vector<int> alone;
    for (int r = 0; r < static_cast<int>(model.rods.size()); ++r)
      (meetsOthers(model, r) ? content.rods : alone).push_back(r);
    const std::vector<int> bodies = bodiesThatMeet();
    const bool cloths_touch = std::any_of(content.cloths.begin(), content.cloths.end(),
                                          [this](int k) { return model.cloths[k].contact.has_value(); });
    const bool touching = cloths_touch || anyTouches(model.threads);
    if (touching || !content.rods.empty() ||
        std::any_of(bodies.begin(), bodies.end(), [this](int b) { return model.bodies[b].body.simulated; }))
      content.bodies = bodies;
    content.rods.insert(content.rods.end(), alone.begin(), alone.end());
    for (std::size_t k = 0; k < content.rods.size(); ++k)
      rods[content.rods[k]] = static_cast<int>(k);
    if (!(content.rods.empty() && content.threads.empty() && content.bodies.empty() && content.cloths.empty()))
      islands = addScheduler(content, state);
  }

  /// Simulated ones, and driven ones that rods are welded to or that have a shape.
  std::vector<int> bodiesThatMeet()
  {
    std::vector<int> meeting;
    for (int b = 0; b < static_cast<int>(model.bodies.size()); ++b)
    {
      const WorldModel::Body& body = model.bodies[b];
      const bool welded = std::any_of(model.welds.begin(), model.welds.end(),
                                      [b](const WorldModel::RodWeld& weld) { return weld.body == b; });
      if (body.body.simulated || welded || body.shape)
        meeting.push_back(b);
      if (!body.body.simulated)
        given_bodies_.push_back(b);
    }
    return meeting;
  }

  /// Notes that a group has these objects, in this order.
  static void place(std::vector<Place>& places, const std::vector<int>& objects, StepGroup* group)
  {
    for (std::size_t k = 0; k < objects.size(); ++k)
      places[objects[k]] = {group, static_cast<int>(k)};
  }

  StepReport stepGroups(WorldState& state, const WorldInputs& inputs)
  {
    StepReport total;
    for (std::size_t i = 0; i < groups_.size() && total.ok; ++i)
      total.merge(groups_[i]->step(state, inputs));
    return total;
  }

  /// Bodies and obstacles that are driven, to where they are at the end of the step.
  void moveGiven(const WorldInputs& inputs, WorldState& state) const
  {
    const double duration = model.time.step;
    const auto move = [duration](const GraspTarget& target, Pose& pose, Twist& velocity) {
      const Twist start = velocity;
      pose = poseBetween(pose, start, target, duration, 1.0, &velocity);
    };
    for (const int b : given_bodies_)
      move(inputs.bodies[b], state.bodies[b].X_WB, state.bodies[b].velocity);
    for (std::size_t k = 0; k < state.obstacles.size(); ++k)
      move(inputs.obstacles[k], state.obstacles[k], state.obstacle_velocities[k]);
  }

  /// In the order in which they step: cloths that lead others, cloths that collide by impulses, all others.
  std::vector<std::unique_ptr<StepGroup>> groups_;
  std::vector<int> given_bodies_;   ///< driven bodies
  WorldState before_;               ///< a step that may fail in one of several groups
};

World::World(WorldModel model, WorldState& state)
{
  impl_ = built(Kind::none, -1, [&] { return std::make_unique<Impl>(std::move(model), state); });
}
World::~World() = default;

const WorldModel& World::model() const { return impl_->model; }
StepReport World::step(WorldState& state, const WorldInputs& inputs) { return impl_->step(state, inputs); }
StepReport World::solveEquilibrium(WorldState& state, const WorldInputs& inputs)
{
  return impl_->solveEquilibrium(state, inputs);
}
void World::setThreads(int threads) { impl_->setThreads(threads); }
void World::checkCloths(WorldState& state) { impl_->checkCloths(state); }

const std::vector<Wrench>& World::rodWrenches(int rod) const { return impl_->rod(rod).stepper->wrenches; }

RodEnergies World::rodEnergies(int rod, const RodState& state, const Eigen::Vector3d& gravity) const
{
  return impl_->rod(rod).stepper->energies(state, gravity);
}

RodStepper* World::rodStepper(int rod) { return impl_->rod(rod).alone(); }

const Eigen::Matrix3Xd& World::pinForces(int cloth) const
{
  const auto& place = impl_->cloths.at(cloth);
  return place.group->pinForces(place.index);
}

Eigen::Matrix3Xd World::rodContactForces(int rod) const
{
  return orZero(impl_->islands->rodContactForces(impl_->rods.at(rod)), impl_->model.rods[rod].model->nodes());
}

Eigen::Matrix3Xd World::clothContactForces(int cloth) const
{
  const auto& place = impl_->cloths.at(cloth);
  return orZero(place.group->clothContactForces(place.index), impl_->model.cloths[cloth].model->vertices());
}

ClothEnergies World::clothEnergies(int cloth, const ClothState& state, const Eigen::Vector3d& gravity) const
{
  const auto& place = impl_->cloths.at(cloth);
  return place.group->clothEnergies(place.index, state, gravity);
}

ContactLoads World::contactLoads() const { return impl_->contactLoads(); }
void World::forgetContacts() { impl_->forgetContacts(); }

const FunctionSet& World::functions(int cloth, const WorldState& state) const
{
  return functionsOf(impl_->model.cloths.at(cloth).tracked, state.cloths[cloth]);
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

TrackingError World::clothTrackingError(int cloth, const WorldState& state) const
{
  const TrackedGuide& tracked = impl_->model.cloths.at(cloth).tracked;
  if (!tracked.sets)
    return TrackingError();
  const GuideState& guide = state.cloth_guides[cloth];
  Eigen::Matrix3Xd targets = functions(cloth, state).constraints->averages(guide.points);
  guide.blend.apply(state.time, targets);
  return errorOf(tracked, state.cloths[cloth], guide, state.time, targets);
}

double World::rodTrackingError(int rod, const WorldState& state) const
{
  const TrackedGuide& tracked = impl_->model.rods.at(rod).tracked;
  if (!tracked.sets)
    return 0.0;
  const WeakConstraints& constraints = *tracked.sets->front().constraints;
  return constraints.error(constraints.averages(state.rod_guides[rod].points), state.rods[rod].x);
}

}   // namespace slender
