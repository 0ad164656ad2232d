#pragma once

#include <map>
#include <string>
#include <vector>

#include "slender_sim/scene/scene_reference.h"

namespace slender {

/// The keys that readers ask for, in the order of the first question. Places in lists and names that the user gives are
/// put as N and NAME.
class KeyLog
{
public:
  void note(const std::string& path, const std::string& what);
  /// The children of this path have names that the user gives.
  void noteNamed(const std::string& path);
  std::vector<SceneKey> keys() const;

private:
  std::string general(const std::string& path) const;

  std::vector<SceneKey> keys_;
  std::map<std::string, std::size_t> places_;   ///< in keys_
  std::map<std::string, bool> named_;
};

}   // namespace slender
