#pragma once

#include <string>

#include "slender_sim/scene/config.h"
#include "yaml_tree.h"

namespace slender {

/// Reads and checks a scene as readScene() does. `file`: for messages; `directory`: to which file names are relative.
/// Throws SceneError.
SceneConfig sceneOfTree(const YamlTree& tree, const std::string& file, const std::string& directory);

}   // namespace slender
