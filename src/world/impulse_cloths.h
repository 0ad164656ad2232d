#pragma once

#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "world_object.h"

namespace slender {

/// Returns true if a cloth collides by impulses.
inline bool byImpulses(const WorldModel::Cloth& cloth)
{
  return cloth.contact && cloth.contact->method == ContactMethod::impulses;
}

/// All cloths of an IslandScheduler whose contact is by impulses, tracked or not, and the obstacles and driven bodies
/// that they meet. They are one object, which meets no other one.
class ImpulseCloths final : public WorldObject
{
public:
  /// `cloths`: numbers in the world, at least one. The model of the world outlives the object. Throws
  /// std::invalid_argument for models that are not valid.
  ImpulseCloths(const WorldModel& world, std::vector<int> cloths);
  std::string name() const override { return "cloths"; }
  bool load(const WorldState& state, const WorldInputs& inputs, StepReport& report) override;
  void addParts(std::vector<Part*>&) override {}
  IslandFinder::Reach reach() const override { return {}; }
  std::optional<StepReport> stepAlone() override { return group_->step(state_, inputs_, world_.time.step); }
  void finish(WorldState& state) override;
  void finishGuide(const WorldInputs& inputs, WorldState& state, StepReport& report) const override;
  ContactMemory& contact(WorldState& state) const override { return state.contact.cloths[cloths_.front()]; }
  void addTo(Meeting&, const WorldState&) override {}

  /// Throws std::invalid_argument where its cloths cross something in this state.
  void check(const WorldState& state);
  const ClothGroup& group() const { return *group_; }
  void forgetContacts() { group_->forgetContacts(); }
  /// Place of a cloth of the world in the group.
  int placeOf(int cloth) const;
  int vertices() const;

private:
  void take(const WorldState& state);

  const WorldModel& world_;
  const std::vector<int> cloths_;   ///< numbers in the world, ascending
  std::vector<int> bodies_;         ///< of the world, likewise: those that they meet
  std::unique_ptr<ClothGroup> group_;
  ClothGroupState state_;
  ClothGroupInputs inputs_;
};

}   // namespace slender
