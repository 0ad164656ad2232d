#pragma once

#include <stdexcept>
#include <string>
#include <vector>

#include "slender_sim/scene/reader.h"
#include "slender_sim/scene/scene_state.h"
#include "slender_sim/world/world.h"

/// From the checked configuration of a scene to the model and the first state of its world.
namespace slender {

struct SceneParts
{
  WorldModel model;
  SceneState state;   ///< without the grasps of welds, which the world adds
  // The entries of these two lists point into the configuration.
  std::vector<GraspRef> grasps;   ///< of all rods, then of all cloths
  std::vector<GuideRef> guides;   ///< of all tracked cloths, then of all tracked rods
  WorldInputs inputs;             ///< gravity and the loads of rods and cloths, which act all the time
};

/// Builds all parts. Warnings, and the motions of grasps that turn their sections, go into the configuration. Throws
/// SceneError.
SceneParts buildParts(SceneConfig& scene);

void buildRods(SceneConfig& scene, SceneParts& parts);
void buildThreads(const SceneConfig& scene, SceneParts& parts);
void buildCloths(SceneConfig& scene, SceneParts& parts);
/// Warns of guides that touch nothing but each other, because they are stepped ahead of what tracks them. Throws
/// SceneError for bodies that cloth would have to push. Call it after the cloths got their guides.
void checkClothContact(SceneConfig& scene, const WorldModel& model);
/// Bodies and obstacles.
void buildBodies(const SceneConfig& scene, SceneParts& parts);

/// Sets in the model which obstacles the objects of the scene pass through. These are the obstacles in `contact.ignore`
/// of a grasp, and, near a grasp, the links of a robot that its held part touches at the start. Adds a sentence for
/// each of them to the notes of the configuration. Call it after all parts and obstacles were built.
void ignoreHeldContacts(SceneConfig& scene, SceneParts& parts);

/// Where a part is in the scene's file, for messages; kind none: the file.
std::string placeOf(const SceneConfig& scene, FailurePlace::Kind kind, int index);

/// Calls build(index) for each of `count` parts of a kind. Where that throws std::invalid_argument, throws SceneError
/// with the place of the part.
template <class Build>
void buildEach(const SceneConfig& scene, FailurePlace::Kind kind, std::size_t count, const Build& build)
{
  for (int k = 0; k < static_cast<int>(count); ++k)
  {
    try
    {
      build(k);
    }
    catch (const std::invalid_argument& error)
    {
      throw SceneError(placeOf(scene, kind, k) + ": " + error.what());
    }
  }
}

}   // namespace slender
