#pragma once

#include "scene_parts.h"

namespace slender {

/// Sets in the model which obstacles the objects of the scene pass through. These are the obstacles in `contact.ignore`
/// of a grasp, and, near a grasp, the links of a robot that its held part touches at the start. Adds a sentence for
/// each of them to the notes of the configuration. Call it after all parts and obstacles were built.
void ignoreHeldContacts(SceneConfig& scene, SceneParts& parts);

}   // namespace slender
