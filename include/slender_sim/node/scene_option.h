#pragma once

#include "slender_sim/node/node_options.h"
#include "slender_sim/scene/config.h"

namespace slender {

/// Reads ~scene, which is the path of a scene file or its YAML text, with ~set. Throws SceneError.
SceneConfig readScene(const NodeOptions& options);

}   // namespace slender
