#include "body_object.h"

#include "meeting.h"
#include "slender_sim/contact/solids.h"

namespace slender {

bool meetsSolids(const WorldModel& world, int body)
{
  const std::optional<Shape>& shape = world.bodies[body].shape;
  if (!world.bodies[body].body.simulated || !shape || !(world.contact.gap > 0.0))
    return false;
  bool others = !world.obstacles.empty();
  for (int b = 0; b < static_cast<int>(world.bodies.size()); ++b)
    others = others || (b != body && world.bodies[b].shape);
  return others;
}

BodyObject::BodyObject(const WorldModel& world, int number)
  : WorldObject(number),
    part(std::make_unique<BodyPart>(world.bodies[number].body)),
    model_(world.bodies[number])
{
  if (!model_.shape)
    return;
  double reach = model_.X_BS.position.norm() + boundingRadius(*model_.shape);
  if (meetsSolids(world, number))
  {
    const BodySurface surface = makeBodySurface(*model_.shape, model_.X_BS);
    reach += surface.radius;   // a mesh grows by it
    part->setSurface(surface, model_.friction < 0.0 ? ContactProperties().friction : model_.friction);
  }
  part->setReach(reach);
}

bool BodyObject::load(const WorldState& state, const WorldInputs& inputs, StepReport&)
{
  part->begin(state.bodies[index], inputs.gravity);
  return true;
}

IslandFinder::Reach BodyObject::reach() const
{
  return {part->hasSurface(), false, part->hasSurface(), model_.shape.has_value(), BoundingBox::empty()};
}

void BodyObject::addTo(Meeting& meeting, const WorldState& state)
{
  if (!part->hasSurface())
    return;
  static_cast<const Part&>(*part).addSurface(meeting.surface);
  meeting.add(name(), part->surfaceAt(state.bodies[index].X_WB));
}

}   // namespace slender
