#pragma once

#include <string>
#include <vector>

namespace slender {

/// A key of scene files: its path with N for places in lists and NAME for names that the user gives, and what the
/// reader takes there, with range and unit; empty: more keys.
struct SceneKey
{
  std::string path;
  std::string what;
};

/// Every key that the reader asks for as it reads these scene files, whether they have it or not, in its order. What is
/// wrong with them does not matter; keys below one that none of the files has may be missing. Throws SceneError for a
/// file that is not there.
std::vector<SceneKey> sceneKeys(const std::vector<std::string>& files);

/// These keys as a table in Markdown, with a heading per part of the scene.
std::string sceneReference(const std::vector<SceneKey>& keys);

}   // namespace slender
