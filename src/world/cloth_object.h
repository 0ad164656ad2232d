#pragma once

#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "cloth/cloth_part.h"
#include "slender_sim/cloth/cloth_stepper.h"
#include "world_object.h"

namespace slender {

/// A cloth that touches nothing or whose contact is the barrier. Its own stepper advances a cloth that touches nothing,
/// and offers all integrators and solvers of cloth.
class ClothObject final : public WorldObject
{
public:
  ClothObject(const WorldModel& world, int number);
  std::string name() const override { return "cloth '" + model_.model->name + "'"; }
  bool load(const WorldState& state, const WorldInputs& inputs, StepReport& report) override;
  void addParts(std::vector<Part*>& parts) override;
  std::optional<StepReport> stepAlone() override;
  IslandFinder::Reach reach() const override { return reachOf(model_.contact); }
  void finish(WorldState& state) override { part_->end(state.cloths[index]); }
  void finishGuide(const WorldInputs& inputs, WorldState& state, StepReport& report) const override;
  ContactMemory& contact(WorldState& state) const override { return state.contact.cloths[index]; }
  void addTo(Meeting& meeting, const WorldState& state) override;

  /// State, forces and energies of the last step.
  ClothPart& part() const { return *part_; }
  /// Throws std::invalid_argument for a cloth that touches something or tracks a guide.
  StepReport solveEquilibrium(WorldState& state, const WorldInputs& inputs);

private:
  const WorldModel& world_;
  const WorldModel::Cloth& model_;
  std::unique_ptr<ClothStepper> stepper_;   ///< of a cloth that touches nothing
  std::unique_ptr<ClothPart> own_part_;     ///< of one that does
  ClothPart* part_ = nullptr;               ///< either that one or that of the stepper
  ClothInputs inputs_;                      ///< of the present step, with the averages
};

}   // namespace slender
