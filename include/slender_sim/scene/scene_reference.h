#pragma once

#include <string>
#include <vector>

namespace slender {

/// A key of scene files: its path with N for places in lists and NAME for names that the user gives.
struct SceneKey
{
  std::string path;
  std::string what;      ///< values that the reader takes there, with range and unit; empty: more keys
  std::string meaning;   ///< sentences that say what the key does and what holds without it
  std::string keys_of;   ///< path of the key whose description holds for the keys below this one; empty: none
};

/// Every key that the reader knows. They are found by reading a scene inside the library that has every section.
std::vector<SceneKey> sceneKeys();

/// Every key that the reader asks for as it reads these scene files, whether they have it or not. What is wrong with
/// the files does not matter; keys below one that none of the files has may be missing. Throws SceneError for a file
/// that is not there.
std::vector<SceneKey> sceneKeys(const std::vector<std::string>& files);

/// The keys as tables in Markdown, with a heading per part of the scene.
std::string sceneReference(const std::vector<SceneKey>& keys);

/// What `query` asks for, as plain text: a path (rods.N.grasps.NAME.attach, or rods.0.grasps.left.attach), with all
/// keys below it, or a word, with all keys that have it as a part of their paths. Empty when there is no such key.
std::string describeKeys(const std::vector<SceneKey>& keys, const std::string& query);

/// A key that is spelled like the last part of `query`; may be empty.
std::string nearestKey(const std::vector<SceneKey>& keys, const std::string& query);

}   // namespace slender
