#include "yaml_tree.h"

#include <cmath>
#include <map>
#include <sstream>

#include <yaml-cpp/eventhandler.h>
#include <yaml-cpp/yaml.h>

#include "slender_sim/scene/reader.h"
#include "yaml_cursor.h"

namespace slender {

namespace {

constexpr int max_depth = 64;
constexpr std::size_t max_values = 5'000'000;   // also stops documents whose aliases multiply

/// Builds the tree from yaml-cpp's parser events: its own nodes hide repeated keys and share aliased values.
class TreeBuilder final : public YAML::EventHandler
{
public:
  explicit TreeBuilder(std::string file) : file_(std::move(file)) {}

  YamlTree take() { return std::move(root_); }

  void OnDocumentStart(const YAML::Mark&) override {}
  void OnDocumentEnd() override {}
  void OnAnchor(const YAML::Mark&, const std::string&) override {}

  void OnNull(const YAML::Mark& mark, YAML::anchor_t anchor) override
  {
    YamlTree value;
    value.line = mark.line + 1;
    finished(std::move(value), anchor);
  }

  void OnScalar(const YAML::Mark& mark, const std::string&, YAML::anchor_t anchor, const std::string& text) override
  {
    YamlTree value;
    value.kind = YamlTree::Kind::scalar;
    value.line = mark.line + 1;
    value.scalar = text;
    finished(std::move(value), anchor);
  }

  void OnAlias(const YAML::Mark& mark, YAML::anchor_t anchor) override
  {
    const auto found = anchors_.find(anchor);
    if (found == anchors_.end())
      fail(mark.line + 1, "an alias inside its own anchor");
    count(found->second.second - 1, mark.line + 1);   // before the copy is made
    finished(found->second.first, 0);
  }

  void OnSequenceStart(const YAML::Mark& mark, const std::string&, YAML::anchor_t anchor,
                       YAML::EmitterStyle::value) override
  {
    open(mark, YamlTree::Kind::list, anchor);
  }
  void OnSequenceEnd() override { close(); }

  void OnMapStart(const YAML::Mark& mark, const std::string&, YAML::anchor_t anchor, YAML::EmitterStyle::value) override
  {
    open(mark, YamlTree::Kind::map, anchor);
  }
  void OnMapEnd() override { close(); }

private:
  struct Level
  {
    YamlTree value;
    YAML::anchor_t anchor;
    std::size_t count_before;
    bool has_key = false;
    std::string key;
  };

  [[noreturn]] void fail(int line, const std::string& reason) const
  {
    throw SceneError(file_ + ":" + std::to_string(line) + ": " + reason);
  }

  void count(std::size_t more, int line)
  {
    count_ += more;
    if (count_ > max_values)
      fail(line, "more than " + std::to_string(max_values) + " values");
  }

  void open(const YAML::Mark& mark, YamlTree::Kind kind, YAML::anchor_t anchor)
  {
    if (levels_.size() >= max_depth)
      fail(mark.line + 1, "nested more than " + std::to_string(max_depth) + " levels deep");
    Level level;
    level.value.kind = kind;
    level.value.line = mark.line + 1;
    level.anchor = anchor;
    level.count_before = count_;
    levels_.push_back(std::move(level));
  }

  void close()
  {
    Level level = std::move(levels_.back());
    levels_.pop_back();
    const std::size_t size = count_ - level.count_before + 1;
    finished(std::move(level.value), level.anchor, size);
  }

  void finished(YamlTree value, YAML::anchor_t anchor, std::size_t size = 1)
  {
    count(1, value.line);
    if (anchor)
      anchors_[anchor] = {value, size};
    if (levels_.empty())
    {
      root_ = std::move(value);
      return;
    }
    Level& level = levels_.back();
    if (level.value.kind == YamlTree::Kind::list)
    {
      level.value.items.push_back(std::move(value));
      return;
    }
    if (!level.has_key)
    {
      if (value.kind == YamlTree::Kind::list || value.kind == YamlTree::Kind::map)
        fail(value.line, "a key must be a plain word, not a list or a map");
      level.key = value.scalar;
      level.has_key = true;
      if (level.value.find(level.key))
        fail(value.line, "key '" + level.key + "' is given twice");
      return;
    }
    level.value.members.emplace_back(std::move(level.key), std::move(value));
    level.has_key = false;
  }

  std::string file_;
  YamlTree root_;
  std::vector<Level> levels_;
  std::map<YAML::anchor_t, std::pair<YamlTree, std::size_t>> anchors_;
  std::size_t count_ = 0;
};

void emit(YAML::Emitter& out, const YamlTree& tree)
{
  switch (tree.kind)
  {
    case YamlTree::Kind::null: out << YAML::Null; break;
    case YamlTree::Kind::scalar: out << tree.scalar; break;
    case YamlTree::Kind::list:
    {
      bool plain = !tree.items.empty();
      for (const YamlTree& item : tree.items)
        plain = plain && item.kind == YamlTree::Kind::scalar;
      if (plain)
        out << YAML::Flow;
      out << YAML::BeginSeq;
      for (const YamlTree& item : tree.items)
        emit(out, item);
      out << YAML::EndSeq;
      break;
    }
    case YamlTree::Kind::map:
      out << YAML::BeginMap;
      for (const auto& [key, value] : tree.members)
      {
        out << YAML::Key << key << YAML::Value;
        emit(out, value);
      }
      out << YAML::EndMap;
      break;
  }
}

/// The name of an entry of a list; null if it has none.
const std::string* nameOf(const YamlTree& entry)
{
  const YamlTree* name = entry.find("name");
  return name && name->kind == YamlTree::Kind::scalar ? &name->scalar : nullptr;
}

/// " (0 is rope, 1 is cable)", for a list whose entries have names; of long lists the first ones.
std::string placesByName(const YamlTree& list)
{
  constexpr std::size_t most = 10;
  std::string text;
  for (std::size_t k = 0; k < list.items.size() && k < most; ++k)
    if (const std::string* name = nameOf(list.items[k]))
      text += (text.empty() ? " (" : ", ") + std::to_string(k) + " is " + *name;
  return text.empty() ? text : text + ")";
}

/// Returns the index in a list that a part of a path refers to. The part is a number or the name of an entry.
std::optional<double> placeIn(const YamlTree& list, const std::string& part)
{
  for (std::size_t k = 0; k < list.items.size(); ++k)
    if (const std::string* name = nameOf(list.items[k]); name && *name == part)
      return static_cast<double>(k);
  return parseNumber(part);
}

/// A new grasp can be set as a whole. A key of a grasp that is not there is a mistaken name: the reader would only see
/// a grasp that holds nothing.
void requireKnownGrasp(const YamlTree& map, const std::string& path, const std::string& name, std::size_t parts,
                       const std::string& where)
{
  const std::vector<std::string> passed = split(path, '.');
  if (passed.back() != "grasps" || parts == passed.size() + 1)
    return;
  std::vector<std::string> names;
  for (const auto& member : map.members)
    names.push_back(member.first);
  throw SceneError(where + ": " + path + " has no grasp '" + name + "'" +
                   (names.empty() ? "" : "; it has: " + joinWords(names)) + didYouMean(name, names));
}

}   // namespace

const char* toString(YamlTree::Kind kind)
{
  static const char* const words[] = {"nothing", "a single value", "a list", "a map"};
  return words[static_cast<int>(kind)];
}

const YamlTree* YamlTree::find(const std::string& key) const
{
  for (const auto& member : members)
    if (member.first == key)
      return &member.second;
  return nullptr;
}

YamlTree* YamlTree::find(const std::string& key)
{
  return const_cast<YamlTree*>(static_cast<const YamlTree*>(this)->find(key));
}

std::vector<std::string> split(const std::string& text, char separator)
{
  std::vector<std::string> parts(1);
  for (char c : text)
    if (c == separator)
      parts.emplace_back();
    else
      parts.back() += c;
  return parts;
}

YamlTree parseYaml(const std::string& text, const std::string& file)
{
  try
  {
    std::istringstream stream(text);
    YAML::Parser parser(stream);
    TreeBuilder builder(file);
    if (!parser.HandleNextDocument(builder))
      return {};
    TreeBuilder second(file);
    if (parser.HandleNextDocument(second))
      throw SceneError(file + ": holds more than one YAML document; keep one");
    return builder.take();
  }
  catch (const YAML::Exception& error)
  {
    throw SceneError(file + ":" + std::to_string(error.mark.line + 1) + ": not valid YAML: " + error.msg);
  }
}

std::string writeYaml(const YamlTree& tree)
{
  YAML::Emitter out;
  emit(out, tree);
  return std::string(out.c_str()) + "\n";
}

void applyOverride(YamlTree& root, const std::string& assignment, const std::string& source)
{
  const std::string where = source + " " + assignment;
  const auto equals = assignment.find('=');
  if (equals == std::string::npos || equals == 0)
    throw SceneError(where + ": must be PATH=VALUE, for example rods.0.material.youngs_modulus=1e7");
  YamlTree value = parseYaml(assignment.substr(equals + 1), where);
  forEachValue(value, [&](YamlTree& part) {
    part.origin = where;
    part.line = 0;
  });

  YamlTree* at = &root;
  std::string passed;
  const std::vector<std::string> parts = split(assignment.substr(0, equals), '.');
  for (const std::string& part : parts)
  {
    const std::string here = passed.empty() ? "the scene" : "'" + passed + "'";
    if (part.empty())
      throw SceneError(where + ": the path has an empty part; parts are separated by single dots");
    if (at->kind == YamlTree::Kind::null)
    {
      at->kind = YamlTree::Kind::map;
      at->origin = where;
    }
    if (at->kind == YamlTree::Kind::scalar)
    {
      throw SceneError(where + ": " + here + " is the single value '" + at->scalar + "' and has no part '" + part +
                       "'");
    }
    if (at->kind == YamlTree::Kind::list)
    {
      const long size = static_cast<long>(at->items.size());
      const auto index = placeIn(*at, part);
      if (!index || !(*index >= -size && *index < size) || *index != std::floor(*index))
      {
        throw SceneError(where + ": " + here + " is a list; '" + part + "' must be a whole number in [" +
                         std::to_string(-size) + ", " + std::to_string(size - 1) + "]" + placesByName(*at));
      }
      at = &at->items[static_cast<long>(*index) + (*index < 0 ? size : 0)];
    }
    else
    {
      if (!at->find(part))
      {
        requireKnownGrasp(*at, passed, part, parts.size(), where);
        at->members.emplace_back(part, YamlTree{});
      }
      at = at->find(part);
    }
    passed += (passed.empty() ? "" : ".") + part;
  }
  *at = std::move(value);
}

}   // namespace slender
