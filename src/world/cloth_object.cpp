#include "cloth_object.h"

#include <stdexcept>

#include "meeting.h"
#include "tracked_parts.h"

namespace slender {

ClothObject::ClothObject(const WorldModel& world, int number)
  : WorldObject(number),
    world_(world),
    model_(world.cloths[number])
{
  if (!model_.contact)
  {
    stepper_ = std::make_unique<ClothStepper>(model_.model, model_.options);
    return;
  }
  part_ = std::make_unique<ClothPart>(model_.model, model_.options);
  part_->setContact(*model_.contact, world.time.step, model_.ignored);
}

bool ClothObject::load(const WorldState& state, const WorldInputs& inputs, StepReport& report)
{
  const ClothState& from = state.cloths[index];
  inputs_ = &inputs.cloths[index];
  if (tracks())
  {
    trackedInputs(world_, index, state, inputs, tracked_inputs_);
    inputs_ = &tracked_inputs_;
  }
  if (stepper_)
  {
    work_ = from;
    return true;
  }
  if (!part_->accepts(from, *inputs_, world_.time.step, report))
    return false;
  part_->begin(from, *inputs_, world_.time.step);
  return true;
}

void ClothObject::addParts(std::vector<Part*>& parts)
{
  if (part_)
    parts.push_back(part_.get());
}

std::optional<StepReport> ClothObject::stepAlone()
{
  if (!stepper_)
    return std::nullopt;
  return stepper_->step(work_, *inputs_, world_.time.step);
}

IslandFinder::Reach ClothObject::reach() const
{
  const auto& contact = model_.contact;
  return {contact.has_value(), contact && contact->others, contact && contact->solids, false, BoundingBox::empty()};
}

void ClothObject::finish(WorldState& state)
{
  if (stepper_)
    std::swap(state.cloths[index], work_);
  else
    part_->end(state.cloths[index]);
}

void ClothObject::finishGuide(const WorldInputs& inputs, WorldState& state, StepReport& report) const
{
  if (tracks())
    takeClothGuide(world_, index, tracked_inputs_.averages,
                   stepper_ ? stepper_->averageForces() : part_->stages().average_forces, inputs, state, report);
}

void ClothObject::addTo(Meeting& meeting, const WorldState& state)
{
  if (!part_)
    return;
  part_->setPins(state.cloths[index].pins);
  part_->addSurface(meeting.surface);
  meeting.add(name(), state.cloths[index].x);
}

StepReport ClothObject::solveEquilibrium(WorldState& state, const WorldInputs& inputs)
{
  if (tracks())
    throw std::invalid_argument("a cloth that tracks a guide has no statics");
  if (!stepper_)
    throw std::invalid_argument("cloth with contact has no statics");
  return stepper_->solveEquilibrium(state.cloths[index], inputs.cloths[index]);
}

const Eigen::Matrix3Xd& ClothObject::pinForces() const
{
  return stepper_ ? stepper_->pinForces() : part_->stages().pin_forces;
}

ClothEnergies ClothObject::energies(const ClothState& state, const Eigen::Vector3d& gravity) const
{
  return stepper_ ? stepper_->energies(state, gravity) : part_->stages().energies(state, gravity);
}

}   // namespace slender
