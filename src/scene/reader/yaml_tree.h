#pragma once

#include <string>
#include <utility>
#include <vector>

namespace slender {

/// A parsed YAML document as plain values that know where they stand. Private to the reader: yaml-cpp stays inside
/// yaml_tree.cpp. Aliases become copies, so that overriding one value never changes another; repeated keys are errors.
struct YamlTree
{
  enum class Kind
  {
    null,
    scalar,
    list,
    map
  };

  Kind kind = Kind::null;
  int line = 0;         ///< from 1; 0 when it came from an override
  std::string origin;   ///< the override that set it, else empty
  std::string scalar;
  std::vector<YamlTree> items;
  std::vector<std::pair<std::string, YamlTree>> members;   ///< in file order

  const YamlTree* find(const std::string& key) const;
  YamlTree* find(const std::string& key);
};

const char* toString(YamlTree::Kind kind);

/// Calls an action with a value and with all values in it.
template <class Action>
void forEachValue(YamlTree& tree, const Action& action)
{
  action(tree);
  for (YamlTree& item : tree.items)
    forEachValue(item, action);
  for (auto& member : tree.members)
    forEachValue(member.second, action);
}

/// Parses one document. Throws SceneError "FILE:LINE: reason".
YamlTree parseYaml(const std::string& text, const std::string& file);

/// The document written out again (what nodes publish after overrides).
std::string writeYaml(const YamlTree& tree);

/// Returns the parts of a text between its separators. There is at least one.
std::vector<std::string> split(const std::string& text, char separator);

/// Applies "path.to.value=YAML". Missing keys are created. An entry of a list is given by its index (negative: from the
/// end), or by its name if it has a key `name`. Throws SceneError with the part of the path that does not fit. `source`
/// is the origin of the assignment, for messages.
void applyOverride(YamlTree& root, const std::string& assignment, const std::string& source = "--set");

}   // namespace slender
