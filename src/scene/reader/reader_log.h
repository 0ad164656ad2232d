#pragma once

#include <string>

#include "key_log.h"

namespace slender {

/// The whole of a file. Throws SceneError "FILE: reason": no such file, not a regular one, too large, cannot be read.
std::string fileText(const std::string& path);

/// Reads a scene and notes what is asked for. What is wrong with the scene does not matter.
void logKeysOf(const std::string& text, KeyLog& log, const std::string& directory = ".");

/// The same of a scene file. Throws as fileText.
void logKeys(const std::string& path, KeyLog& log);

}   // namespace slender
