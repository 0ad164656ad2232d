#pragma once

#include <string>
#include <vector>

#include "key_log.h"
#include "slender_sim/scene/config.h"
#include "yaml_tree.h"

/// Texts of scenes on their way to the reader.
namespace slender {

/// The whole of a file. Throws SceneError "FILE: reason": no such file, not a regular one, too large, cannot be read.
std::string fileText(const std::string& path);

/// Reads and checks a scene in the same way as readScene(). Messages name `file`. Relative file names start from
/// `directory`. Throws SceneError.
SceneConfig sceneOfTree(const YamlTree& tree, const std::string& file, const std::string& directory);

/// Reads a scene and notes what is asked for. What is wrong with the scene does not matter.
void logKeysOf(const std::string& text, KeyLog& log, const std::string& directory = ".");
/// The same of a scene file. Throws as fileText.
void logKeys(const std::string& path, KeyLog& log);

/// Scenes that together have every section that the reader knows. They are not to be simulated, and the reader refuses
/// parts of them: they only lead the reader to every key (see sceneKeys()). They need no files.
const std::vector<std::string>& everyKeyScenes();

}   // namespace slender
