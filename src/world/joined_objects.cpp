#include "joined_objects.h"

#include <algorithm>

#include "slender_sim/contact/solids.h"

namespace slender {

namespace {

bool isSound(const GraspTarget& t)
{
  return t.X_WG.position.allFinite() && std::abs(t.X_WG.orientation.norm() - 1.0) < 1e-3 &&
         (!t.velocity || (t.velocity->linear.allFinite() && t.velocity->angular.allFinite()));
}

bool refuseInput(const std::string& what, StepReport& report)
{
  report = StepReport();
  report.ok = false;
  report.failure = StepFailure::input_not_finite;
  report.message = what + " is not finite or not valid; correct this input";
  return false;
}

/// Whether a body touches solids, and there are any besides its own.
bool meetsSolids(const WorldModel& world, int body)
{
  const std::optional<Shape>& shape = world.bodies[body].shape;
  if (!shape || !hasBodySurface(*shape) || !(world.contact.gap > 0.0))
    return false;
  bool others = !world.obstacles.empty();
  for (int b = 0; b < static_cast<int>(world.bodies.size()); ++b)
    others = others || (b != body && world.bodies[b].shape);
  return others;
}

IslandContent rodsAndBodies(IslandContent content)
{
  content.threads.clear();
  content.cloths.clear();
  return content;
}

}   // namespace

// ---- what there is

JoinedObjects::JoinedObjects(const WorldModel& model, IslandContent parts, WorldState& state)
  : world(model),
    content(std::move(parts))
{
  state.contact_stiffness.rods.resize(world.rods.size());
  state.contact_stiffness.threads.resize(world.threads.size());
  state.contact_stiffness.bodies.resize(world.bodies.size());
  state.contact_stiffness.cloths.resize(world.cloths.size());
  addParts(world.time);
  addWelds(state);
  addSolids();
}

JoinedObjects::JoinedObjects(const JoinedObjects& other, const TimeConfig& time)
  : world(other.world),
    content(rodsAndBodies(other.content)),
    welds(other.welds)
{
  addParts(time);
  for (const Weld& weld : welds)
    follow(weld);
  addSolids();
}

void JoinedObjects::addParts(const TimeConfig& time)
{
  for (const int b : content.bodies)
    if (const WorldModel::Body& body = world.bodies[b]; body.body.simulated)
    {
      bodies.push_back({b, std::make_unique<BodyPart>(body.body)});
      if (!body.shape)
        continue;
      bodies.back().part->setReach(body.X_BS.position.norm() + boundingRadius(*body.shape));
      if (meetsSolids(world, b))
        bodies.back().part->setSurface(makeBodySurface(*body.shape, body.X_BS),
                                       body.friction < 0.0 ? ContactProperties().friction : body.friction);
    }
  for (const int r : content.rods)
  {
    const WorldModel::Rod& rod = world.rods[r];
    JoinedRod added{r, std::make_unique<RodStepper::Impl>(rod.model, time), nullptr, {}};
    added.part = std::make_unique<RodPart>(*added.stepper, rod.contact.has_value());
    if (rod.contact)
      added.part->setContact(*rod.contact, rod.ignored);
    rods.push_back(std::move(added));
  }
  for (const int k : content.threads)
  {
    threads.emplace_back();
    threads.back().index = k;
  }
  for (const int c : content.cloths)
  {
    const WorldModel::Cloth& cloth = world.cloths[c];
    cloths.push_back({c, std::make_unique<ClothPart>(cloth.model, cloth.options)});
    cloths.back().part->setContact(*cloth.contact, time.step, cloth.ignored);
  }
}

BodyPart* JoinedObjects::simulated(int body) const
{
  for (const JoinedBody& b : bodies)
    if (b.index == body)
      return b.part.get();
  return nullptr;
}

void JoinedObjects::addWelds(WorldState& state)
{
  for (const WorldModel::RodWeld& weld : world.welds)
  {
    const auto at = std::find_if(rods.begin(), rods.end(), [&](const JoinedRod& rod) { return rod.index == weld.rod; });
    if (at == rods.end())
      continue;
    RodState& rod = state.rods[weld.rod];
    GraspState grasp = makeGrasp(*world.rods[weld.rod].model, rod, weld.first_node, weld.last_node, true);
    grasp.body = simulated(weld.body) ? weld.body : -1;
    const Pose X_BG = weld.X_BG.value_or(state.bodies[weld.body].X_WB.inverse() * grasp.X_WG);
    welds.push_back({static_cast<int>(at - rods.begin()), static_cast<int>(rod.grasps.size()), weld.body, X_BG});
    follow(welds.back());
    rod.grasps.push_back(grasp);
  }
}

void JoinedObjects::follow(const Weld& weld)
{
  if (BodyPart* body = simulated(weld.body))
    rods[weld.rod].part->addWeld({weld.grasp, body, weld.X_BG});
}

void JoinedObjects::addSolids()
{
  for (std::size_t k = 0; k < world.obstacles.size(); ++k)
    solids.push_back({JoinedSolid::Kind::obstacle, static_cast<int>(k), world.obstacles[k]});
  for (const int b : content.bodies)
  {
    const WorldModel::Body& body = world.bodies[b];
    if (!body.shape)
      continue;
    solids.push_back({JoinedSolid::Kind::body, b, body.solid(), simulated(b), body.X_BS});
    for (const Weld& weld : welds)
      if (weld.body == b)
        solids.back().welded_rods.push_back(weld.rod);
  }
  for (const JoinedThread& thread : threads)
    if (const ThreadFloor& floor = world.threads[thread.index].model->floor; floor.slips())
      solids.push_back({JoinedSolid::Kind::floor, thread.index, {Plane{}, floor.friction}});
}

// ---- inputs

/// What is wrong with the inputs that all parts share; empty: nothing is.
std::string JoinedObjects::badInput(const WorldState& state, const WorldInputs& inputs) const
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
  for (const int b : content.bodies)
    if (!world.bodies[b].body.simulated && !isSound(inputs.bodies[b]))
      return "pose of body " + world.bodies[b].body.name;
  for (std::size_t k = 0; k < inputs.obstacles.size(); ++k)
    if (!isSound(inputs.obstacles[k]))
      return "pose of obstacle " + world.obstacles[k].name;
  for (const int k : content.threads)
    if (!inputs.threads[k].belt_velocity.allFinite())
      return "belt velocity of thread " + world.threads[k].model->name;
  return inputs.gravity.allFinite() ? "" : "gravity";
}

/// Grasps that driven bodies carry get their targets from these.
void JoinedObjects::carryGrasps(const WorldInputs& inputs)
{
  for (const Weld& weld : welds)
  {
    std::vector<GraspTarget>& grasps = rods[weld.rod].inputs.grasps;
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

bool JoinedObjects::takeInputs(const WorldState& state, const WorldInputs& inputs, StepReport& report)
{
  if (const std::string bad = badInput(state, inputs); !bad.empty())
    return refuseInput(bad, report);
  for (JoinedRod& rod : rods)
    rod.inputs = inputs.rods[rod.index];
  carryGrasps(inputs);
  std::string what;
  for (const JoinedRod& rod : rods)
    if (!rod.stepper->inputsFinite(state.rods[rod.index], rod.inputs, what))
      return refuseInput("rod '" + rod.stepper->model->name + "': " + what, report);
  return true;
}

}   // namespace slender
