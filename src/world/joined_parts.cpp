// Rods, threads and bodies as one island: what it consists of.
#include "joined_parts.h"

#include <algorithm>
#include <stdexcept>

#include "slender_sim/contact/solids.h"

namespace slender {

namespace {

void check(const WorldModel& world, const IslandContent& content)
{
  const auto need = [](bool good, const std::string& what) {
    if (!good)
      throw std::invalid_argument(what);
  };
  for (const int b : content.bodies)
    checkBody(world.bodies[b].body);
  for (const int k : content.threads)
  {
    const ThreadModel& model = *world.threads[k].model;
    const ThreadTouch& touch = *world.threads[k].contact;
    checkThreadModel(model);
    const auto check_value = [&](bool good, const char* what, double value, const char* range) {
      need(good, "thread '" + model.name + "': " + what + " is " + std::to_string(value) + ", allowed: " + range);
    };
    check_value(touch.friction >= 0.0 && std::isfinite(touch.friction), "friction", touch.friction, "zero or more");
    check_value(touch.merging >= 0.0 && touch.merging < 1.0, "merging", touch.merging, "zero to 1 (exclusive)");
  }
  const bool simulates = !content.rods.empty() || std::any_of(content.bodies.begin(), content.bodies.end(),
                                                              [&](int b) { return world.bodies[b].body.simulated; });
  need(content.threads.empty() || !simulates || world.time.integrator == Integrator::implicit_euler,
       "threads that touch rods or bodies are stepped together with them, by implicit Euler: set time.integrator: "
       "implicit_euler");
}

}   // namespace

JoinedParts::JoinedParts(const WorldModel& world, IslandContent content, WorldState& state)
  : world_(world),
    content_(std::move(content))
{
  check(world, content_);
  for (const int b : content_.bodies)
    if (const WorldModel::Body& body = world.bodies[b]; body.body.simulated)
    {
      objects_.bodies.push_back({b, std::make_unique<BodyPart>(body.body)});
      if (body.shape)
        objects_.bodies.back().part->setReach(body.X_BS.position.norm() + boundingRadius(*body.shape));
    }
  addRods(state);
  for (const int k : content_.threads)
  {
    objects_.threads.emplace_back();
    objects_.threads.back().index = k;
  }
  addSolids();
  reach_.resize(static_cast<std::size_t>(objects_.parts()));
  checkClearance(state);
}

BodyPart* JoinedParts::simulated(int body) const
{
  for (const JoinedBody& b : objects_.bodies)
    if (b.index == body)
      return b.part.get();
  return nullptr;
}

void JoinedParts::addRods(WorldState& state)
{
  for (const int r : content_.rods)
  {
    const WorldModel::Rod& rod = world_.rods[r];
    JoinedRod added{r, std::make_unique<RodStepper::Impl>(rod.model, world_.time), nullptr, {}};
    added.part = std::make_unique<RodPart>(*added.stepper, rod.contact.has_value());
    if (rod.contact)
      added.part->setContact(*rod.contact);
    objects_.rods.push_back(std::move(added));
    nodes_ += rod.model->nodes();
  }
  for (const WorldModel::RodWeld& weld : world_.welds)
  {
    const auto at = std::find_if(objects_.rods.begin(), objects_.rods.end(),
                                 [&](const JoinedRod& rod) { return rod.index == weld.rod; });
    if (at == objects_.rods.end())
      continue;
    RodState& rod = state.rods[weld.rod];
    GraspState grasp = makeGrasp(*world_.rods[weld.rod].model, rod, weld.first_node, weld.last_node, true);
    BodyPart* body = simulated(weld.body);
    grasp.body = body ? weld.body : -1;
    const Pose X_BG = state.bodies[weld.body].X_WB.inverse() * grasp.X_WG;
    const int number = static_cast<int>(rod.grasps.size());
    objects_.welds.push_back({static_cast<int>(at - objects_.rods.begin()), number, weld.body, X_BG});
    if (body)
      at->part->addWeld({number, body, X_BG});
    rod.grasps.push_back(grasp);
  }
}

void JoinedParts::addSolids()
{
  for (std::size_t k = 0; k < world_.obstacles.size(); ++k)
  {
    const WorldModel::Obstacle& obstacle = world_.obstacles[k];
    objects_.solids.push_back({JoinedSolid::Kind::obstacle, static_cast<int>(k), obstacle.shape, obstacle.friction});
  }
  for (const int b : content_.bodies)
  {
    const WorldModel::Body& body = world_.bodies[b];
    if (!body.shape)
      continue;
    objects_.solids.push_back({JoinedSolid::Kind::body, b, *body.shape, body.friction, simulated(b), body.X_BS});
    for (const Weld& weld : objects_.welds)
      if (weld.body == b)
        objects_.solids.back().welded_rods.push_back(weld.rod);
  }
  for (const JoinedThread& thread : objects_.threads)
    if (const ThreadFloor& floor = world_.threads[thread.index].model->floor; floor.slips())
      objects_.solids.push_back({JoinedSolid::Kind::floor, thread.index, Plane{}, floor.friction});
}

// ---- what the last step leaves

void JoinedParts::addContacts(std::vector<ContactForce>& out) const
{
  for (const JoinedIsland* island : islands_)
    if (const ContactPotential* contact = island->contact())
      for (const ContactTerm& term : contact->terms())
        out.push_back({term.position, term.force});
}

Eigen::Matrix3Xd JoinedParts::contactForces(int rod) const
{
  const RodPart& part = *objects_.rods[rod].part;
  Eigen::Matrix3Xd forces = Eigen::Matrix3Xd::Zero(3, part.points());
  for (const JoinedIsland* island : islands_)
  {
    if (!island->contact() || !std::binary_search(island->parts().begin(), island->parts().end(), rod))
      continue;
    for (const ContactTerm& term : island->contact()->terms())
      for (int k = 0; k < 4; ++k)
        if (const int point = term.point[k] - part.first_point;
            term.point[k] >= 0 && point >= 0 && point < part.points())
          forces.col(point) += term.weight[k] * term.force;
  }
  return forces;
}

// ---- statics

StepReport JoinedParts::solveEquilibrium(WorldState& state, const WorldInputs& inputs)
{
  if (objects_.rods.empty() && objects_.bodies.empty())
    return {};
  RodGroupModel model;
  for (const JoinedRod& rod : objects_.rods)
  {
    model.rods.push_back(world_.rods[rod.index].model);
    if (const auto& contact = world_.rods[rod.index].contact)
    {
      model.contact.rods.push_back(*contact);
      model.contact.rods.back().rod = static_cast<int>(model.rods.size()) - 1;
    }
  }
  RodGroupInputs group_inputs;
  RodGroupState group_state;
  const auto placeOf = [&](int body) {
    return static_cast<int>(std::find(content_.bodies.begin(), content_.bodies.end(), body) - content_.bodies.begin());
  };
  for (const int b : content_.bodies)
  {
    const WorldModel::Body& body = world_.bodies[b];
    model.bodies.push_back(body.body);
    if (body.shape && !model.contact.rods.empty())
      model.contact.bodies.push_back({placeOf(b), *body.shape, body.X_BS, body.friction});
    group_inputs.bodies.push_back(inputs.bodies[b]);
    group_state.bodies.push_back(state.bodies[b]);
  }
  for (const WorldModel::Obstacle& obstacle : world_.obstacles)
    model.contact.obstacles.push_back({obstacle.shape, obstacle.friction});
  model.contact.options = world_.contact;
  for (const Weld& weld : objects_.welds)
    model.welds.push_back({weld.rod, weld.grasp, placeOf(weld.body), weld.X_BG});
  for (const JoinedRod& rod : objects_.rods)
  {
    group_state.rods.push_back(state.rods[rod.index]);
    group_inputs.rods.push_back(inputs.rods[rod.index]);
  }
  group_state.obstacles = state.obstacles;
  group_state.obstacle_velocities = state.obstacle_velocities;
  for (const JoinedRod& rod : objects_.rods)
    group_state.contact_stiffness = std::max(group_state.contact_stiffness, state.contact_stiffness.rods[rod.index]);
  group_inputs.obstacles = inputs.obstacles;
  group_inputs.gravity = inputs.gravity;
  RodGroup group(std::move(model), world_.time);
  const StepReport report = group.solveEquilibrium(group_state, group_inputs);
  if (!report.ok)
    return report;
  for (std::size_t r = 0; r < objects_.rods.size(); ++r)
  {
    state.rods[objects_.rods[r].index] = group_state.rods[r];
    objects_.rods[r].stepper->wrenches = group.wrenches(static_cast<int>(r));
  }
  for (const int b : content_.bodies)
    state.bodies[b] = group_state.bodies[placeOf(b)];
  state.obstacles = group_state.obstacles;
  state.obstacle_velocities = group_state.obstacle_velocities;
  for (const JoinedRod& rod : objects_.rods)
    state.contact_stiffness.rods[rod.index] = group_state.contact_stiffness;
  for (const JoinedBody& body : objects_.bodies)
    state.contact_stiffness.bodies[body.index] = group_state.contact_stiffness;
  return report;
}

}   // namespace slender
