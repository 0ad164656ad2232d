#pragma once

#include <optional>
#include <string>
#include <vector>

#include "island/part.h"
#include "island_finder.h"
#include "slender_sim/world/world.h"
#include "slender_sim/world/world_model.h"
#include "slender_sim/world/world_state.h"

namespace slender {

struct Meeting;

/// Calls make(). An std::invalid_argument becomes a WorldError of this part, unless it tells the part already.
template <class Make>
auto built(FailurePlace::Kind kind, int index, const Make& make)
{
  try
  {
    return make();
  }
  catch (const WorldError&)
  {
    throw;
  }
  catch (const std::invalid_argument& error)
  {
    throw WorldError(kind, index, error.what());
  }
}

/// A rod, a thread, a cloth or a simulated body: something of which an island has parts.
class WorldObject
{
public:
  explicit WorldObject(int number) : index(number) {}
  virtual ~WorldObject() = default;
  WorldObject(const WorldObject&) = delete;
  WorldObject& operator=(const WorldObject&) = delete;

  const int index;   ///< among the objects of its kind in the world
  int place = 0;     ///< in WorldObjects::all

  /// For messages: "rod 'rope'".
  virtual std::string name() const = 0;
  /// Loads the state where a step begins. Returns false, and fills the report, if the state or the inputs are not
  /// valid.
  virtual bool load(const WorldState& state, const WorldInputs& inputs, StepReport& report) = 0;
  /// Appends its parts of the present step, once the object is loaded.
  virtual void addParts(std::vector<Part*>& parts) = 0;
  /// What it may touch; without a box.
  virtual IslandFinder::Reach reach() const = 0;
  /// Steps an object that its own stepper advances. Nothing: an island steps its parts.
  virtual std::optional<StepReport> stepAlone() { return std::nullopt; }
  /// Writes the end of the step into the state.
  virtual void finish(WorldState& state) = 0;
  /// Writes the guide that the object tracks, and the guide's forces, into the state, whose time is the end of the
  /// step.
  virtual void finishGuide(const WorldInputs&, WorldState&, StepReport&) const {}
  /// What contact has kept of the object in the island that had it last.
  virtual ContactMemory& contact(WorldState& state) const = 0;
  /// Appends its surface in a state, if it has one.
  virtual void addTo(Meeting& meeting, const WorldState& state) = 0;
  bool hasSurface() const { return reach().has_points; }
};

/// What an object with these properties of contact may touch, without a box. Nothing: it touches nothing.
IslandFinder::Reach reachOf(const std::optional<ContactProperties>& contact);

inline Pose normalized(const Pose& pose) { return {pose.position, pose.orientation.normalized()}; }

/// Completes the report of a step whose inputs are not valid. Returns false.
bool refuseInput(const std::string& what, StepReport& report);

}   // namespace slender
