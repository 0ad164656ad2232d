#pragma once

#include <string>
#include <vector>

namespace slender {

/// Scenes that together have every section that the reader knows. They are not to be simulated, and the reader refuses
/// parts of them: they only lead the reader to every key (see sceneKeys()). They need no files.
const std::vector<std::string>& everyKeyScenes();

}   // namespace slender
