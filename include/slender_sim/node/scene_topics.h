#pragma once

#include <algorithm>
#include <string>
#include <vector>

#include "slender_sim/scene/simulation.h"

namespace slender {

/// Returns true if at least one of the rods or cloths tracks a guide.
template <class Objects>
bool tracksGuide(const Objects& objects)
{
  return std::any_of(objects.begin(), objects.end(), [](const auto& object) { return object.tracking != nullptr; });
}

/// Names of a scene's topics, relative to the namespace of the node. In a scene that has objects of one kind these are
/// `state`, `poses`, `points` and `mesh`. In a scene with objects of several kinds each kind has its own namespace:
/// `rods/state`, `threads/state`, `cloths/state` and so on.
struct SceneTopics
{
  /// Throws std::invalid_argument if the name of a rod, thread, cloth or grasp cannot be part of a topic.
  explicit SceneTopics(const Simulation& simulation);

  bool has_rods = false;   ///< also true for a scene with only bodies
  bool has_threads = false;
  bool has_cloths = false;
  std::string rods, threads, cloths;   ///< prefixes of the kinds: empty, or "rods/" and so on
  std::vector<std::string> grasps;     ///< names of the grasps in scene order
  /// Per thread: prefix of its input topics and of the topic of its wrench. The prefix is empty in a scene with one
  /// thread, otherwise "threads/NAME/".
  std::vector<std::string> nozzles;
};

}   // namespace slender
