#pragma once

#include <string>

#include "key_log.h"

namespace slender {

/// Reads a scene file and notes what is asked for. Throws as readScene.
void logKeys(const std::string& path, KeyLog& log);

}  // namespace slender
