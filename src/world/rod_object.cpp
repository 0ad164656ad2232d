#include "rod_object.h"

#include <algorithm>
#include <stdexcept>

#include "meeting.h"
#include "tracked_parts.h"

namespace slender {

namespace {

bool touches(const WorldModel::Rod& rod) { return rod.contact.has_value(); }

/// Null: the rod tracks nothing.
std::shared_ptr<const WeakConstraints> constraintsOf(const WorldModel::Rod& rod)
{
  if (!rod.tracked.sets)
    return nullptr;
  const auto& constraints = rod.tracked.sets->front().constraints;
  if (!constraints || constraints->count() == 0 || constraints->matrix().cols() != rod.model->nodes())
    throw std::invalid_argument("rod '" + rod.model->name + "': averages of its " + std::to_string(rod.model->nodes()) +
                                " nodes expected, at least one");
  return constraints;
}

/// Throws std::invalid_argument if a rod cannot track its guide in these steps.
void checkTracking(const TimeConfig& time, const std::string& rod)
{
  const std::string who = "rod '" + rod + "': ";
  if (time.integrator != Integrator::implicit_euler || time.error_tolerance > 0)
    throw std::invalid_argument(who + "prescribed averages need time.integrator: implicit_euler, with fixed steps");
}

}   // namespace

bool meetsOthers(const WorldModel& world, int rod)
{
  return world.rods[rod].contact || std::any_of(world.welds.begin(), world.welds.end(),
                                                [rod](const WorldModel::RodWeld& weld) { return weld.rod == rod; });
}

RodObject::RodObject(const WorldModel& world, int number, const TimeConfig& time)
  : WorldObject(number),
    whole(std::make_unique<RodStepper>(world.rods[number].model, time)),
    stepper(&whole->work()),
    constraints(constraintsOf(world.rods[number])),
    part(std::make_unique<RodPart>(*stepper, touches(world.rods[number]),
                                   constraints ? &constraints->matrix() : nullptr)),
    meets(meetsOthers(world, number)),
    world_(world),
    contact_(world.rods[number].contact)
{
  if (constraints)
    checkTracking(world.time, stepper->model->name);
  if (contact_)
    part->setContact(*contact_, world.rods[number].ignored);
}

bool RodObject::load(const WorldState& state, const WorldInputs& with, StepReport& report)
{
  stepper->begin(state.rods[index], inputs, world_.time.step);
  if (!constraints)
    return true;
  takeTargets(world_, {ObjectRef::rod, index}, state, with, targets_);
  if (!targets_.allFinite())
    return refuseInput(name() + ": its guide", report);
  part->averages()->begin(state.rods[index].x, targets_);
  return true;
}

void RodObject::finishGuide(const WorldInputs& with, WorldState& state, StepReport& report) const
{
  if (constraints)
    takeGuide(world_, {ObjectRef::rod, index}, targets_, part->averages()->forces, with, state, report);
}

void RodObject::addTo(Meeting& meeting, const WorldState& state)
{
  if (!contact_)
    return;
  part->addSurface(meeting.surface);
  meeting.add(name(), state.rods[index].x);
}

}   // namespace slender
