#pragma once

#include <map>
#include <string>
#include <vector>

#include "slender_sim/scene/scene_reference.h"

namespace slender {

/// Whether a part of a path is a place in a list: a number.
bool isPlaceInList(const std::string& part);

/// The keys that readers ask for, in the order of the first question. Places in lists and names that the user gives are
/// put as N and NAME. Keys that several sections share stand where their owner has them.
class KeyLog
{
public:
  void note(const std::string& path, const std::string& what);
  /// The first meaning of a key counts.
  void noteMeaning(const std::string& path, const std::string& meaning);
  /// Values in words, which replace what note() gets to hear of the same key.
  void noteValue(const std::string& path, const std::string& what);
  /// The keys below `path` are those below `owner`, which is the general path of a key.
  void noteShared(const std::string& path, const std::string& owner);
  /// The children of this path have names that the user gives.
  void noteNamed(const std::string& path);
  /// Every key after the keys that it is part of.
  std::vector<SceneKey> keys() const;

private:
  struct Entry
  {
    SceneKey key;
    long order = 0;   ///< of the first question at the key's own place; others come later
    bool value_in_words = false;
  };
  Entry& entryOf(const std::string& path);
  /// The path with N and NAME, at the owner of shared keys. `own`: the path has not led to another owner.
  std::string general(const std::string& path, bool& own) const;

  std::vector<Entry> entries_;
  std::map<std::string, std::size_t> places_;   ///< in entries_
  std::map<std::string, std::string> shared_;   ///< general path to owner
  std::map<std::string, bool> named_;
  long asked_ = 0;
};

}   // namespace slender
