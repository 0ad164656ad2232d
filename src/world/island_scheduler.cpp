// The objects that are stepped in islands, and what a step leaves.
#include "island_scheduler.h"

#include <algorithm>
#include <stdexcept>

#include "world_statics.h"

namespace slender {

namespace {

/// Returns the content, which is valid.
WorldContent checked(const WorldModel& world, WorldContent content)
{
  const auto need = [](bool good, const auto& what) {   // a text is made only where it is needed
    if (!good)
      throw std::invalid_argument(what);
  };
  for (const int b : content.bodies)
    if (world.bodies[b].body.simulated)
      checkBody(world.bodies[b].body);
  bool touching_threads = false;
  for (const int k : content.threads)
  {
    const ThreadModel& model = *world.threads[k].model;
    if (!world.threads[k].contact)
    {
      checkLoneThread(model);
      continue;
    }
    touching_threads = true;
    const double friction = world.threads[k].contact->friction, merging = world.threads[k].merging;
    checkThreadModel(model);
    const auto check_value = [&](bool good, const char* what, double value, const char* range) {
      need(good, "thread '" + model.name + "': " + what + " is " + std::to_string(value) + ", allowed: " + range);
    };
    check_value(friction >= 0.0 && std::isfinite(friction), "friction", friction, "zero or more");
    check_value(merging >= 0.0 && merging < 1.0, "merging", merging, "zero to 1 (exclusive)");
  }
  const bool simulates =
      std::any_of(content.rods.begin(), content.rods.end(), [&](int r) { return meetsOthers(world, r); }) ||
      std::any_of(content.bodies.begin(), content.bodies.end(), [&](int b) { return world.bodies[b].body.simulated; });
  const auto touches = [](const auto& objects) { return [&](int k) { return objects[k].contact.has_value(); }; };
  const bool touching =
      std::any_of(content.cloths.begin(), content.cloths.end(), touches(world.cloths)) ||
      std::any_of(content.rods.begin(), content.rods.end(), touches(world.rods)) ||
      std::any_of(content.bodies.begin(), content.bodies.end(), [&](int b) { return meetsSolids(world, b); });
  const bool may_join = touching || std::any_of(content.bodies.begin(), content.bodies.end(),
                                                [&](int b) { return world.bodies[b].shape; });
  need(world.time.integrator != Integrator::symplectic_euler || !simulates ||
           !(touching || (touching_threads && may_join)),
       "symplectic_euler takes no contact, whose forces are too stiff for explicit steps: take implicit_euler, bdf2 "
       "or tr_bdf2 (time.integrator)");
  need(!touching_threads || !simulates || !may_join || world.time.integrator == Integrator::implicit_euler,
       "threads that touch other objects are stepped together with them, by implicit Euler: set time.integrator: "
       "implicit_euler");
  return content;
}

}   // namespace

IslandScheduler::IslandScheduler(const WorldModel& world, WorldContent content, WorldState& state)
  : world_(world),
    objects_(world, checked(world, std::move(content)), state)
{
  for (const RodObject& rod : objects_.rods)
    nodes_ += rod.stepper->model->nodes();
  for (const int c : objects_.content.cloths)
    nodes_ += world.cloths[c].model->vertices();
  for (const WorldObject* object : objects_.all)
    reach_.push_back(object->reach());
  checkClearance(state);
}

// ---- what the last step leaves

void IslandScheduler::addContacts(ContactLoads& out) const
{
  for (const ObjectIsland* island : islands_)
    island->addContacts(out);
}

/// On the surface points of an object that is one part [N].
Eigen::Matrix3Xd IslandScheduler::contactForces(const WorldObject& object, const Part& part) const
{
  const int points = part.points();
  Eigen::Matrix3Xd forces = Eigen::Matrix3Xd::Zero(3, points);
  for (const ObjectIsland* island : islands_)
  {
    if (points == 0 || !island->contact() ||
        !std::binary_search(island->places().begin(), island->places().end(), object.place))
      continue;
    for (const ContactTerm& term : island->contact()->terms())
      for (int k = 0; k < 4; ++k)
        if (const int point = term.point[k] - part.first_point; term.point[k] >= 0 && point >= 0 && point < points)
          forces.col(point) += term.weight[k] * term.force;
  }
  return forces;
}

// ---- statics

StepReport IslandScheduler::solveEquilibrium(WorldState& state, const WorldInputs& inputs)
{
  for (const RodObject& rod : objects_.rods)
    if (rod.constraints)
      throw std::invalid_argument("a rod that tracks a guide has no statics");
  StepReport total;
  for (ClothObject& cloth : objects_.cloths)
    if (total.ok)
      total.merge(cloth.solveEquilibrium(state, inputs));
  if (total.ok && !(objects_.rods.empty() && objects_.bodies.empty()))
    total.merge(solveStatics(objects_, loop_.threads, state, inputs));
  return total;
}

}   // namespace slender
