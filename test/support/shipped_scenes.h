#pragma once

#include <algorithm>
#include <filesystem>
#include <string>
#include <vector>

namespace slender::test {

inline const std::string kSceneFolder = std::string(SLENDER_SOURCE_DIR) + "/config/scenes/";

/// Names of the package's scenes without ".yaml", sorted.
inline std::vector<std::string> shippedScenes()
{
  std::vector<std::string> names;
  for (const auto& entry : std::filesystem::directory_iterator(kSceneFolder))
    if (entry.path().extension() == ".yaml")
      names.push_back(entry.path().stem().string());
  std::sort(names.begin(), names.end());
  return names;
}

}   // namespace slender::test
