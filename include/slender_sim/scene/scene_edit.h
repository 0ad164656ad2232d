#pragma once

#include <memory>
#include <string>
#include <vector>

#include "slender_sim/scene/config.h"
#include "slender_sim/scene/simulation.h"

/// Changes of a scene that runs. The text of the scene is changed and read anew, so that everything holds that holds
/// for scene files, and the state of what stays is handed over. An edit is deterministic: the same edits of the same
/// run give the same bits.
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

/// Name of the service that asks for it, "~spawn" and so on, which also stands before error messages.
const char* toString(SceneEdit::Kind kind);

/// The scene with the edit, read and checked. What follows from other objects unless the scene gives it stays as it is:
/// the integrator, the gap of contact, and the method of contact of each cloth. Throws SceneError with what is wrong.
SceneConfig editedScene(const SceneConfig& scene, const SceneEdit& edit);

/// The edited scene, which goes on where `running` is. An edit that changes nothing leaves the motion the same to the
/// last bit. Throws SceneError; `running` stays as it is in any case.
std::unique_ptr<Simulation> editedSimulation(const Simulation& running, const SceneEdit& edit);

}   // namespace slender
