#include "world_objects.h"

#include <algorithm>
#include <stdexcept>

#include "slender_sim/world/world.h"

namespace slender {

namespace {

bool isSound(const GraspTarget& t)
{
  return t.X_WG.position.allFinite() && std::abs(t.X_WG.orientation.norm() - 1.0) < 1e-3 &&
         (!t.velocity || (t.velocity->linear.allFinite() && t.velocity->angular.allFinite()));
}

}   // namespace

IslandFinder::Reach reachOf(const std::optional<ContactProperties>& contact)
{
  return {contact.has_value(), contact && contact->others, contact && contact->solids, false, BoundingBox::empty()};
}

bool refuseInput(const std::string& what, StepReport& report)
{
  report = StepReport().refuse(StepFailure::input_not_finite, what + " is not finite or not valid; correct this input");
  return false;
}

// ---- what there is

WorldObjects::WorldObjects(const WorldModel& model, bool leaders, WorldState& state) : world(model)
{
  if (!leaders)
  {
    addBodies();
    for (int r = 0; r < static_cast<int>(world.rods.size()); ++r)
      addRod(r, world.time);
  }
  addCloths(leaders);
  if (!leaders)
  {
    addThreads();
    addWelds(state);
  }
  if (!touch())
    return;
  state.contact.rods.resize(world.rods.size());
  state.contact.threads.resize(world.threads.size());
  state.contact.bodies.resize(world.bodies.size());
  state.contact.cloths.resize(world.cloths.size());
  addSolids(!leaders);
}

WorldObjects::WorldObjects(const WorldObjects& other, const TimeConfig& time) : world(other.world), welds(other.welds)
{
  addBodies();
  for (const RodObject& rod : other.rods)
    if (rod.meets)
      addRod(rod.index, time);
  for (const Weld& weld : welds)
    follow(weld);
  if (touch())
    addSolids(true);
}

// ---- solids

/// Objects with a surface are numbered in their order.
ContactSolid WorldSolid::asTouched(const std::vector<WorldObject*>& by) const
{
  ContactSolid touched{obstacle};
  touched.body = body != nullptr;
  if (kind == Kind::obstacle)
    touched.number = index;
  if (kind == Kind::floor)
    touched.only = index;
  int number = 0;
  for (const WorldObject* object : by)
    if (object->hasSurface())
    {
      if (std::find(ignores.begin(), ignores.end(), object) != ignores.end())
        touched.ignores.push_back(number);
      ++number;
    }
  return touched;
}

std::string WorldSolid::name() const
{
  return kind == Kind::floor ? "its floor" : (kind == Kind::body ? "body '" : "obstacle '") + obstacle.name + "'";
}

// ---- all of them

void WorldObjects::addBodies()
{
  for (int b = 0; b < static_cast<int>(world.bodies.size()); ++b)
    if (world.bodies[b].body.simulated)
    {
      checkBody(world.bodies[b].body);
      add(bodies.emplace_back(world, b));
    }
}

void WorldObjects::addRod(int number, const TimeConfig& time)
{
  built(FailurePlace::Kind::rod, number, [&] { add(rods.emplace_back(world, number, time)); });
}

void WorldObjects::addCloths(bool leaders)
{
  std::vector<int> by_impulses;
  for (int c = 0; c < static_cast<int>(world.cloths.size()); ++c)
  {
    if (world.leads(c) != leaders)
      continue;
    if (byImpulses(world.cloths[c]))
      by_impulses.push_back(c);
    else
      built(FailurePlace::Kind::cloth, c, [&] { add(cloths.emplace_back(world, c)); });
  }
  if (!by_impulses.empty())
    add(impulses.emplace(world, std::move(by_impulses)));
}

void WorldObjects::addThreads()
{
  for (int k = 0; k < static_cast<int>(world.threads.size()); ++k)
    built(FailurePlace::Kind::thread, k, [&] { add(threads.emplace_back(world, k)); });
}

void WorldObjects::add(WorldObject& object)
{
  object.place = static_cast<int>(all.size());
  all.push_back(&object);
}

/// Whether any of them may touch something.
bool WorldObjects::touch() const
{
  return std::any_of(all.begin(), all.end(), [](const WorldObject* object) { return object->hasSurface(); });
}

void WorldObjects::addWelds(WorldState& state)
{
  for (const WorldModel::RodWeld& weld : world.welds)
  {
    RodState& rod = state.rods[weld.rod];
    GraspState grasp = makeGrasp(*world.rods[weld.rod].model, rod, weld.first_node, weld.last_node, true);
    grasp.body = world.bodies[weld.body].body.simulated ? weld.body : -1;
    const Pose X_BG = weld.X_BG.value_or(state.bodies[weld.body].X_WB.inverse() * grasp.X_WG);
    welds.push_back({weld.rod, static_cast<int>(rod.grasps.size()), weld.body, X_BG});
    follow(welds.back());
    rod.grasps.push_back(grasp);
  }
}

void WorldObjects::follow(const Weld& weld)
{
  const BodyObject* body = findObject(bodies, weld.body);
  if (!body)
    return;
  const RodObject& rod = *findObject(rods, weld.rod);
  rod.part->addWeld({weld.grasp, body->part.get(), weld.X_BG});
  joined.emplace_back(rod.place, body->place);
}

void WorldObjects::addSolids(bool with_bodies)
{
  for (std::size_t k = 0; k < world.obstacles.size(); ++k)
    solids.push_back({WorldSolid::Kind::obstacle, static_cast<int>(k), world.obstacles[k]});
  for (int b = 0; with_bodies && b < static_cast<int>(world.bodies.size()); ++b)
  {
    const WorldModel::Body& body = world.bodies[b];
    if (!body.shape)
      continue;
    const BodyObject* carrier = findObject(bodies, b);
    solids.push_back({WorldSolid::Kind::body, b, body.solid(), carrier ? carrier->part.get() : nullptr, body.X_BS});
    if (carrier)
      solids.back().ignores.push_back(carrier);
    for (const Weld& weld : welds)
      if (weld.body == b)
        solids.back().ignores.push_back(findObject(rods, weld.rod));
  }
  for (const ThreadObject& thread : threads)
    if (const ThreadFloor& floor = thread.model.model->floor; floor.slips())
      solids.push_back({WorldSolid::Kind::floor, thread.index, {Plane{}, floor.friction}});
}

// ---- inputs

/// What is wrong with the inputs that all parts share; empty: nothing is.
std::string WorldObjects::badInput(const WorldState& state, const WorldInputs& inputs) const
{
  if (inputs.rods.size() != state.rods.size() || state.rods.size() != world.rods.size())
    return "number of rods";
  if (inputs.threads.size() != state.threads.size() || state.threads.size() != world.threads.size())
    return "number of threads";
  if (inputs.cloths.size() != state.cloths.size() || state.cloths.size() != world.cloths.size())
    return "number of cloths";
  if (inputs.bodies.size() != state.bodies.size() || state.bodies.size() != world.bodies.size())
    return "number of bodies";
  if (inputs.obstacles.size() != state.obstacles.size() || state.obstacles.size() != world.obstacles.size() ||
      state.obstacle_velocities.size() != state.obstacles.size())
    return "number of obstacles";
  for (std::size_t b = 0; b < inputs.bodies.size(); ++b)
    if (!world.bodies[b].body.simulated && !isSound(inputs.bodies[b]))
      return "pose of body " + world.bodies[b].body.name;
  for (std::size_t k = 0; k < inputs.obstacles.size(); ++k)
    if (!isSound(inputs.obstacles[k]))
      return "pose of obstacle " + world.obstacles[k].name;
  for (std::size_t k = 0; k < inputs.threads.size(); ++k)
    if (!inputs.threads[k].belt_velocity.allFinite())
      return "belt velocity of thread " + world.threads[k].model->name;
  return inputs.gravity.allFinite() ? "" : "gravity";
}

/// Grasps that driven bodies carry get their targets from these.
void WorldObjects::carryGrasps(const WorldInputs& inputs)
{
  for (const Weld& weld : welds)
  {
    std::vector<GraspTarget>& grasps = findObject(rods, weld.rod)->inputs.grasps;
    if (!world.bodies[weld.body].body.simulated && weld.grasp < static_cast<int>(grasps.size()))
    {
      const GraspTarget& body = inputs.bodies[weld.body];
      GraspTarget& grasp = grasps[weld.grasp];
      grasp.X_WG = body.X_WG * weld.X_BG;
      grasp.velocity = body.velocity;
      if (grasp.velocity)
        grasp.velocity->linear += grasp.velocity->angular.cross(body.X_WG.orientation * weld.X_BG.position);
    }
  }
}

bool WorldObjects::takeInputs(const WorldState& state, const WorldInputs& inputs, StepReport& report)
{
  if (const std::string bad = badInput(state, inputs); !bad.empty())
    return refuseInput(bad, report);
  for (RodObject& rod : rods)
    rod.inputs = inputs.rods[rod.index];
  carryGrasps(inputs);
  std::string what;
  for (const RodObject& rod : rods)
    if (!rod.stepper->inputsFinite(state.rods[rod.index], rod.inputs, what))
      return refuseInput("rod '" + rod.stepper->model->name + "': " + what, report);
  return true;
}

void moveGiven(const WorldModel& world, const WorldInputs& inputs, double duration, WorldState& state)
{
  const auto move = [duration](const GraspTarget& target, Pose& pose, Twist& velocity) {
    const Twist start = velocity;
    pose = poseBetween(pose, start, target, duration, 1.0, &velocity);
  };
  for (std::size_t b = 0; b < state.bodies.size(); ++b)
    if (!world.bodies[b].body.simulated)
      move(inputs.bodies[b], state.bodies[b].X_WB, state.bodies[b].velocity);
  for (std::size_t k = 0; k < state.obstacles.size(); ++k)
    move(inputs.obstacles[k], state.obstacles[k], state.obstacle_velocities[k]);
}

}   // namespace slender
