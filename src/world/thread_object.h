#pragma once

#include <memory>
#include <string>
#include <vector>

#include "thread/thread_part.h"
#include "world_object.h"

namespace slender {

/// A thread, with what has broken off it.
class ThreadObject final : public WorldObject
{
public:
  /// Throws std::invalid_argument for a model that is not valid.
  ThreadObject(const WorldModel& world, int number);
  std::string name() const override { return "thread '" + model.model->name + "'"; }
  bool load(const WorldState& state, const WorldInputs& inputs, StepReport& report) override;
  void addParts(std::vector<Part*>& parts) override;
  IslandFinder::Reach reach() const override { return reachOf(model.contact); }
  void finish(WorldState& state) override;
  ContactMemory& contact(WorldState& state) const override { return state.contact.threads[index]; }
  void addTo(Meeting& meeting, const WorldState& state) override;

  struct Strand
  {
    std::unique_ptr<ThreadWork> stepper;
    std::unique_ptr<ThreadPart> part;
  };
  /// Strands of the present step.
  std::size_t strands() const { return work_.threads.size(); }
  Strand& strand(std::size_t number) { return strands_[number]; }

  const WorldModel::Thread& model;

private:
  void makeStrands(std::size_t count);

  const TimeConfig& time_;
  std::vector<Strand> strands_;   ///< as many as there have ever been at once
  ThreadInputs inputs_, still_;   ///< of the present step; without flow, for what has broken off
  ThreadGroupState work_;
};

}   // namespace slender
