#pragma once

#include "slender_sim/node/node_options.h"
#include "slender_sim/scene/config.h"

namespace slender {

/// Reads ~scene, which is the path of a scene file or the YAML text of a scene, and applies the overrides of ~set.
/// Throws SceneError.
SceneConfig readScene(const NodeOptions& options);

}   // namespace slender
