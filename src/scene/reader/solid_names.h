#pragma once

#include <map>
#include <string>

#include "yaml_cursor.h"

namespace slender {

/// Checks that the names of obstacles and bodies differ, because both are entries of the same topic.
class SolidNames
{
public:
  void take(const YamlCursor& at, const std::string& name, bool generated)
  {
    const auto [other, is_new] = paths_.emplace(name, at.path());
    if (!is_new)
    {
      const std::string reason = "is also the name of " + other->second + "; names of bodies and obstacles must differ";
      generated ? at.problem("makes " + name + ", which " + reason) : YamlMap(at).find("name").problem(reason);
    }
  }

private:
  std::map<std::string, std::string> paths_;
};

}   // namespace slender
