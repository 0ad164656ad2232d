#pragma once

#include "scene_parts.h"

namespace slender {

/// Says in the model which obstacles the objects of the scene pass through: those that `contact.ignore` of a grasp
/// names, and near a grasp the link of a robot that its held part touches at the start. Each of them is a sentence in
/// the notes of the configuration. All parts and obstacles have been built.
void ignoreHeldContacts(SceneConfig& scene, SceneParts& parts);

}   // namespace slender
