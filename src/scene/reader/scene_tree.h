#pragma once

#include <string>

#include "slender_sim/scene/config.h"
#include "yaml_tree.h"

namespace slender {

/// Reads and checks a scene in the same way as readScene(). Messages name `file`. Relative file names start from
/// `directory`. Throws SceneError.
SceneConfig sceneOfTree(const YamlTree& tree, const std::string& file, const std::string& directory);

}   // namespace slender
