#pragma once

#include "slender_sim/scene/scene_state.h"

/// Inputs of a step of a scene, but for its grasps: from the scene's motions, and to the world.
namespace slender {

/// Motions of bodies, obstacles, nozzles, belts and guides at `time`: tables evaluated, everything else held where it
/// is.
void sceneInputsAt(const SceneConfig& config, const std::vector<GuideRef>& guides, const SceneState& state, double time,
                   SceneInputs& inputs);
/// Throws std::invalid_argument unless there is one entry per grasp, body, thread, obstacle and guide of the scene, and
/// guides have as many points as those of the state.
void checkSceneInputs(const SceneConfig& config, const std::vector<GuideRef>& guides, const SceneState& state,
                      std::size_t grasps, const SceneInputs& inputs);
/// Hands inputs over to the world. Ends of threads that are held stay where they are in the state `initial`.
void takeSceneInputs(const SceneConfig& config, const SceneState& initial, const SceneInputs& inputs,
                     WorldInputs& world);

}   // namespace slender
