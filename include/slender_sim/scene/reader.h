#pragma once

#include <stdexcept>
#include <string>
#include <vector>

#include "slender_sim/scene/config.h"

namespace slender {

/// A scene that cannot be used: what() holds file, line, key, value and the allowed range, one problem per line.
class SceneError : public std::runtime_error
{
public:
  using std::runtime_error::runtime_error;
};

/// Reads and checks a scene file. `overrides` are "path.to.value=YAML" strings applied before checking.
/// Files named in the scene are relative to the scene file. Throws SceneError listing every problem found.
SceneConfig readScene(const std::string& path, const std::vector<std::string>& overrides = {});

/// The same for text; `name` stands for the file in messages.
SceneConfig parseScene(const std::string& text, const std::string& name = "scene",
                       const std::vector<std::string>& overrides = {}, const std::string& directory = ".");

}   // namespace slender
