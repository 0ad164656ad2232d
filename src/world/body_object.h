#pragma once

#include <memory>
#include <string>
#include <vector>

#include "rod/body_part.h"
#include "world_object.h"

namespace slender {

/// Returns true if a simulated body touches solids, and there are any besides its own.
bool meetsSolids(const WorldModel& world, int body);

/// A simulated body.
class BodyObject final : public WorldObject
{
public:
  BodyObject(const WorldModel& world, int number);
  std::string name() const override { return "body '" + model_.body.name + "'"; }
  bool load(const WorldState& state, const WorldInputs& inputs, StepReport& report) override;
  void addParts(std::vector<Part*>& parts) override { parts.push_back(part.get()); }
  IslandFinder::Reach reach() const override;
  void finish(WorldState& state) override { state.bodies[index] = part->state(); }
  ContactMemory& contact(WorldState& state) const override { return state.contact.bodies[index]; }
  void addTo(Meeting& meeting, const WorldState& state) override;

  const std::unique_ptr<BodyPart> part;

private:
  const WorldModel::Body& model_;
};

}   // namespace slender
