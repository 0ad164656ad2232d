#pragma once

#include <string>

#include "key_log.h"

namespace slender {

/// The whole of a file. Throws SceneError "FILE: reason": no such file, not a regular one, too large, cannot be read.
std::string fileText(const std::string& path);

/// Reads a scene file and notes what is asked for. Throws as readScene.
void logKeys(const std::string& path, KeyLog& log);

/// The same of a scene in memory. What is wrong with the scene does not matter.
void logKeysOf(const std::string& text, KeyLog& log);

}   // namespace slender
