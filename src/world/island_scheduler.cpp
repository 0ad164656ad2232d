// The objects that are stepped in islands, and what a step leaves.
#include "island_scheduler.h"

#include <algorithm>
#include <stdexcept>

namespace slender {

IslandScheduler::IslandScheduler(const WorldModel& world, bool leaders, WorldState& state)
  : world_(world),
    objects_(world, leaders, state)
{
  checkIntegrator();
  for (const RodObject& rod : objects_.rods)
    nodes_ += rod.stepper->model->nodes();
  for (const ClothObject& cloth : objects_.cloths)
    nodes_ += cloth.part().points();
  if (objects_.impulses)
    nodes_ += objects_.impulses->vertices();
  for (const WorldObject* object : objects_.all)
    reach_.push_back(object->reach());
  checkClearance(state);
}

/// Throws std::invalid_argument if the integrator of the world cannot step contacts that its objects may have.
void IslandScheduler::checkIntegrator() const
{
  const auto any = [](const auto& objects, const auto& is) { return std::any_of(objects.begin(), objects.end(), is); };
  const auto touches = [](const WorldObject& object) { return object.hasSurface(); };
  const bool simulates = !objects_.bodies.empty() || any(objects_.rods, [](const RodObject& rod) { return rod.meets; });
  const bool touching = any(objects_.cloths, touches) || any(objects_.rods, touches) || any(objects_.bodies, touches);
  const bool touching_threads = any(objects_.threads, touches);
  const bool may_join = touching || any(world_.bodies, [](const auto& body) { return body.shape.has_value(); });
  const Integrator integrator = world_.time.integrator;
  const bool takes_contact =
      integrator == Integrator::implicit_euler || integrator == Integrator::bdf2 || integrator == Integrator::tr_bdf2;
  if (!takes_contact && simulates && (touching || (touching_threads && may_join)))
    throw std::invalid_argument(std::string(toString(integrator)) +
                                " takes no contact, because it does not damp stiff forces: take implicit_euler, bdf2 "
                                "or tr_bdf2 (time.integrator)");
  if (touching_threads && simulates && may_join && integrator != Integrator::implicit_euler)
    throw std::invalid_argument(
        "threads that touch other objects are stepped together with them, by implicit Euler: set time.integrator: "
        "implicit_euler");
}

// ---- what the last step leaves

void IslandScheduler::addContacts(ContactLoads& out) const
{
  for (const ObjectIsland* island : islands_)
    island->addContacts(out);
}

void IslandScheduler::forgetContacts()
{
  islands_.clear();
  statics_.reset();
  if (objects_.impulses)
    objects_.impulses->forgetContacts();
}

/// On the surface points of an object that is one part [N]. `count`: number of its points.
Eigen::Matrix3Xd IslandScheduler::contactForces(const WorldObject& object, const Part& part, int count) const
{
  Eigen::Matrix3Xd forces = Eigen::Matrix3Xd::Zero(3, count);
  const int points = part.points();   // 0 without contact
  for (const ObjectIsland* island : islands_)
  {
    if (points == 0 || !island->contact() ||
        !std::binary_search(island->places().begin(), island->places().end(), object.place))
      continue;
    for (const ContactTerm& term : island->contact()->terms())
      for (int k = 0; k < 4; ++k)
        if (const int point = term.point[k] - part.first_point; term.point[k] >= 0 && point >= 0 && point < points)
          forces.col(point) += term.share(k, term.force);
  }
  return forces;
}

Eigen::Matrix3Xd IslandScheduler::contactForces(const ObjectRef& of) const
{
  if (of.kind == ObjectRef::rod)
  {
    const RodObject* in_statics = statics_ ? findObject(statics_->objects().rods, of.index) : nullptr;
    const RodObject& rod = in_statics ? *in_statics : objects_.rods.at(of.index);
    return contactForces(rod, *rod.part, rod.stepper->model->nodes());
  }
  if (const ClothObject* cloth = findObject(objects_.cloths, of.index))
    return contactForces(*cloth, cloth->part(), cloth->part().points());
  return objects_.impulses->contactForces(of.index);
}

ClothEnergies IslandScheduler::clothEnergies(int number, const ClothState& state, const Eigen::Vector3d& gravity) const
{
  if (const ClothObject* cloth = findObject(objects_.cloths, number))
    return cloth->part().work().energies(state, gravity);
  return objects_.impulses->energies(number, state, gravity);
}

const Eigen::Matrix3Xd& IslandScheduler::pinForces(int number) const
{
  if (const ClothObject* cloth = findObject(objects_.cloths, number))
    return cloth->part().work().pin_forces;
  return objects_.impulses->pinForces(number);
}

// ---- statics

StepReport IslandScheduler::solveEquilibrium(WorldState& state, const WorldInputs& inputs)
{
  for (const RodObject& rod : objects_.rods)
    if (rod.constraints)
      throw std::invalid_argument("a rod that tracks a guide has no statics");
  if (objects_.impulses)
    throw std::invalid_argument("cloth with contact has no statics");
  StepReport total;
  for (ClothObject& cloth : objects_.cloths)
    if (total.ok)
      total.merge(cloth.solveEquilibrium(state, inputs));
  std::unique_ptr<WorldStatics> together;
  if (total.ok && !(objects_.rods.empty() && objects_.bodies.empty()))
    total.merge(solveStatics(objects_, threads_, state, inputs, together));
  if (!total.ok)
    return total;
  forgetContacts();
  statics_ = std::move(together);
  if (statics_)
    islands_.push_back(&statics_->island());
  return total;
}

}   // namespace slender
