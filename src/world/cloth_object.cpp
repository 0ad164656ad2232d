#include "cloth_object.h"

#include <stdexcept>

#include "cloth/cloth_stepper_impl.h"
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
    part_ = &stepper_->impl().part();
    return;
  }
  own_part_ = std::make_unique<ClothPart>(model_.model, model_.options);
  part_ = own_part_.get();
  part_->setContact(*model_.contact, world.time.step, model_.ignored);
}

bool ClothObject::load(const WorldState& state, const WorldInputs& inputs, StepReport& report)
{
  const ClothState& from = state.cloths[index];
  takeClothInputs(world_, index, state, inputs, inputs_);
  const double duration = world_.time.step;
  if (stepper_)
    return stepper_->impl().load(from, inputs_, duration, report);
  if (!part_->accepts(from, inputs_, duration, report))
    return false;
  part_->begin(from, inputs_, duration);
  return true;
}

void ClothObject::addParts(std::vector<Part*>& parts)
{
  if (own_part_)
    parts.push_back(part_);
}

std::optional<StepReport> ClothObject::stepAlone()
{
  return stepper_ ? std::make_optional(stepper_->impl().advance()) : std::nullopt;
}

void ClothObject::finishGuide(const WorldInputs& inputs, WorldState& state, StepReport& report) const
{
  takeGuide(world_, {ObjectRef::cloth, index}, inputs_.averages, part_->work().average_forces, inputs, state, report);
}

void ClothObject::addTo(Meeting& meeting, const WorldState& state)
{
  if (!model_.contact)
    return;
  part_->setPins(state.cloths[index].pins);
  part_->addSurface(meeting.surface);
  meeting.add(name(), state.cloths[index].x);
}

StepReport ClothObject::solveEquilibrium(WorldState& state, const WorldInputs& inputs)
{
  if (model_.tracked.sets)
    throw std::invalid_argument("a cloth that tracks a guide has no statics");
  if (!stepper_)
    throw std::invalid_argument("cloth with contact has no statics");
  return stepper_->solveEquilibrium(state.cloths[index], inputs.cloths[index]);
}

}   // namespace slender
