#pragma once

#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "rod/rod_part.h"
#include "world_object.h"

namespace slender {

class RodObject final : public WorldObject
{
public:
  RodObject(const WorldModel& world, int number, const TimeConfig& time);
  std::string name() const override { return "rod '" + stepper->model->name + "'"; }
  bool load(const WorldState& state, const WorldInputs& inputs, StepReport& report) override;
  void addParts(std::vector<Part*>& parts) override { parts.push_back(part.get()); }
  IslandFinder::Reach reach() const override { return reachOf(contact_); }
  void finish(WorldState& state) override { state.rods[index] = stepper->work; }
  ContactMemory& contact(WorldState& state) const override { return state.contact.rods[index]; }
  void addTo(Meeting& meeting, const WorldState& state) override;

  /// Null: it may meet others, or tracks a guide.
  RodStepper* alone() { return meets || constraints ? nullptr : whole.get(); }
  void finishGuide(const WorldInputs& inputs, WorldState& state, StepReport& report) const override;

  const std::unique_ptr<RodStepper> whole;
  RodWork* const stepper;                                     ///< of `whole`
  const std::shared_ptr<const WeakConstraints> constraints;   ///< null: tracks nothing
  const std::unique_ptr<RodPart> part;
  RodInputs inputs;   ///< of the present step, with the targets of grasps that driven bodies carry
  const bool meets;   ///< contact or welds may let it meet others

private:
  const WorldModel& world_;
  const std::optional<ContactProperties>& contact_;
  Eigen::Matrix3Xd targets_;   ///< of its averages at the end of the step [m]
};

/// Returns true if contact or welds may let a rod meet something.
bool meetsOthers(const WorldModel& world, int rod);

}   // namespace slender
