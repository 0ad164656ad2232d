#pragma once

#include <memory>
#include <string>

#include "slender_sim/scene/config.h"
#include "slender_sim/scene/simulation.h"

/// Changes a scene while it runs. An edit changes the text of the scene and reads it again, so that the rules of scene
/// files apply. Objects that stay keep their state. An edit is deterministic: the same edits of the same run give
/// results that are equal to the last bit.
namespace slender {

struct SceneEdit
{
  enum class Kind
  {
    /// adds objects; text: YAML as in a scene file, for example "bodies: [{name: ball, ...}]"
    spawn,
    /// removes an object; text: its name, or "SECTION.NAME" where objects of several sections have this name
    remove,
    /// adds a grasp to an object; text: YAML "OBJECT: {GRASP: {...}}", with the keys of `grasps`
    attach,
    /// removes a grasp; text: its name
    detach,
    /// changes values; text: lines PATH=VALUE, for example "rods.rope.material.youngs_modulus=1e7"
    set_parameter
  };
  Kind kind = Kind::spawn;
  std::string text;
};

/// Returns the name of the service for this edit, for example "~spawn". Error messages begin with this name.
const char* toString(SceneEdit::Kind kind);

/// Returns the edited scene after reading and checking it. Some defaults depend on all objects of a scene: the
/// integrator, the gap of contact, and the contact method of each cloth. An edit does not change their values. Throws
/// SceneError with the reason.
SceneConfig editedScene(const SceneConfig& scene, const SceneEdit& edit);

/// Returns a simulation of the edited scene that continues from the present state of `running`. If the edit changes
/// nothing, the motion is the same to the last bit. Throws SceneError with the reason. Never changes `running`.
std::unique_ptr<Simulation> editedSimulation(const Simulation& running, const SceneEdit& edit);

}   // namespace slender
