#include <algorithm>
#include <sstream>

#include "scene_text.h"
#include "slender_sim/scene/reader.h"
#include "slender_sim/scene/scene_edit.h"
#include "yaml_cursor.h"

namespace slender {

namespace {

/// An object of a scene, and the place of its text.
struct ObjectEntry
{
  std::string section, name;
  std::size_t index = 0;
  bool generated = false;   ///< made by `generate`, without a text of its own
};

std::size_t entriesIn(const YamlTree& scene, const char* section)
{
  const YamlTree* list = scene.find(section);
  return list ? list->items.size() : 0;
}

/// Returns all objects in the order of the configuration: first those listed in the text, then generated ones.
std::vector<ObjectEntry> objectsOf(const SceneConfig& config, const YamlTree& scene)
{
  std::vector<ObjectEntry> all;
  const auto add = [&](const char* section, const auto& objects, std::size_t first, std::size_t last) {
    const std::size_t listed = entriesIn(scene, section);
    for (std::size_t k = first; k < last; ++k)
      all.push_back({section, objects[k].name, k - first, k - first >= listed});
  };
  const std::size_t cloths = std::min(entriesIn(scene, "cloths"), config.cloths.size());
  add("rods", config.rods, 0, config.rods.size());
  add("threads", config.threads, 0, config.threads.size());
  add("cloths", config.cloths, 0, cloths);
  add("tracked", config.cloths, cloths, config.cloths.size());
  add("bodies", config.bodies, 0, config.bodies.size());
  add("obstacles", config.obstacles, 0, config.obstacles.size());
  return all;
}

YamlTree scalar(const std::string& value, const std::string& origin)
{
  YamlTree tree;
  tree.kind = YamlTree::Kind::scalar;
  tree.scalar = value;
  tree.origin = origin;
  return tree;
}

/// Returns the value of a key of a map. Adds the key if it is missing.
YamlTree& keyOf(YamlTree& map, const std::string& key)
{
  map.kind = YamlTree::Kind::map;
  if (!map.find(key))
    map.members.emplace_back(key, YamlTree{});
  return *map.find(key);
}

void eraseKey(YamlTree& map, const std::string& key)
{
  const auto has_key = [&](const auto& member) { return member.first == key; };
  map.members.erase(std::remove_if(map.members.begin(), map.members.end(), has_key), map.members.end());
}

/// Writes default names into the text. A default name depends on the number of objects, and an edit may change this
/// number.
void writeNames(const std::vector<ObjectEntry>& objects, YamlTree& scene)
{
  for (const ObjectEntry& object : objects)
  {
    if (object.generated)
      continue;
    YamlTree& entry = keyOf(scene, object.section).items[object.index];
    if (!entry.find("name"))
    {
      entry.kind = YamlTree::Kind::map;
      entry.members.insert(entry.members.begin(), {"name", scalar(object.name, "")});
    }
  }
}

/// Keys whose values ~set_parameter may change, by section.
const std::vector<std::pair<std::string, std::vector<std::string>>> changeable{
    {"wind", {"velocity"}},
    {"contact", {"gap", "slip_speed"}},
    {"rods", {"material", "damping", "contact", "loads"}},
    {"threads", {"fluid", "contact"}},
    {"cloths", {"material", "membrane", "bending", "plasticity", "damping", "aerodynamics", "contact", "loads"}},
    {"tracked", {"material", "membrane", "bending", "plasticity", "damping", "aerodynamics", "contact"}},
    {"bodies", {"mass", "density", "inertia", "gravity", "force", "torque", "damping", "friction", "contact"}},
    {"obstacles", {"friction"}}};

const std::vector<std::string> all_sections{"rods", "threads", "cloths", "tracked", "bodies", "obstacles"};

/// One edit of the text of a scene.
class SceneText
{
public:
  SceneText(const SceneConfig& scene, const SceneEdit& edit)
    : where_(toString(edit.kind)),
      tree_(parseYaml(scene.source, scene.file)),
      objects_(objectsOf(scene, tree_))
  {
    writeNames(objects_, tree_);
  }

  void spawn(const std::string& text)
  {
    const YamlTree added = parsed(text);
    if (added.kind != YamlTree::Kind::map || added.members.empty())
      refuse("the text must be a section with an object, as in a scene file, for example bodies: [{name: ball, ...}]");
    for (const auto& [section, entries] : added.members)
    {
      if (section == "tracked" || section == "generate")
      {
        refuse(section +
               " belongs into the scene from its start; what can be spawned: rods, threads, cloths, bodies, obstacles");
      }
      if (std::find(all_sections.begin(), all_sections.end(), section) == all_sections.end())
      {
        refuse("'" + section + "' is no section of objects; must be one of rods, threads, cloths, bodies, obstacles" +
               " (values are changed by ~set_parameter)");
      }
      const bool one = entries.kind == YamlTree::Kind::map;
      if (!one && (entries.kind != YamlTree::Kind::list || entries.items.empty()))
        refuse(section + " is " + toString(entries.kind) + "; must be a list of objects: " + section + ": [{...}]");
      YamlTree& list = keyOf(tree_, section);
      list.kind = YamlTree::Kind::list;
      for (const YamlTree& entry : one ? std::vector<YamlTree>{entries} : entries.items)
      {
        if (section == "rods" && entry.find("track"))
          refuse("a rod that tracks a guide belongs into the scene from its start; leave track out");
        list.items.push_back(entry);
      }
    }
  }

  void remove(const std::string& name)
  {
    const ObjectEntry& object = find(trimmed(name), all_sections);
    if (objects_.size() == 1)
      refuse(object.name + " is the last object of the scene; a scene has at least one");
    YamlTree& list = *tree_.find(object.section);
    list.items.erase(list.items.begin() + static_cast<std::ptrdiff_t>(object.index));
    if (list.items.empty())
      eraseKey(tree_, object.section);
  }

  void attach(const std::string& text)
  {
    const YamlTree added = parsed(text);
    const bool fits = added.kind == YamlTree::Kind::map && added.members.size() == 1 &&
                      added.members[0].second.kind == YamlTree::Kind::map && !added.members[0].second.members.empty();
    if (!fits)
    {
      refuse(
          "the text must be OBJECT: {GRASP: {...}} with the keys of a grasp in a scene file, for example rope: {hand: "
          "{edges: [-1], motion: {topic: true}}}");
    }
    YamlTree& grasps = keyOf(textOf(find(added.members[0].first, {"rods", "cloths", "tracked"})), "grasps");
    for (const auto& [name, grasp] : added.members[0].second.members)
    {
      if (grasps.find(name))
        refuse(added.members[0].first + " has a grasp " + name + " already; ~set_grasp moves it, ~detach removes it");
      for (const char* key : {"direction", "director"})
        if (grasp.find(key))
          refuse(std::string(key) +
                 " turns a section as the scene starts; a grasp that is attached later holds it as it is: leave " +
                 key + " out");
      keyOf(grasps, name) = grasp;
    }
  }

  void detach(const std::string& name)
  {
    const std::string wanted = trimmed(name);
    std::vector<std::string> names;
    for (const ObjectEntry& object : objects_)
    {
      if (object.generated)
        continue;
      YamlTree* grasps = textOf(object).find("grasps");
      if (grasps && grasps->find(wanted))
      {
        eraseKey(*grasps, wanted);
        if (grasps->members.empty())
          eraseKey(textOf(object), "grasps");
        return;
      }
      for (std::size_t g = 0; grasps && g < grasps->members.size(); ++g)
        names.push_back(grasps->members[g].first);
    }
    refuse("there is no grasp \"" + wanted + "\" in the text of the scene" +
           (names.empty() ? "" : "; it has: " + joinWords(names)) + didYouMean(wanted, names));
  }

  void setParameters(const std::string& text)
  {
    std::istringstream lines(text);
    std::string line;
    bool any = false;
    while (std::getline(lines, line))
    {
      line = trimmed(line);
      if (line.empty())
        continue;
      any = true;
      if (line.find('=') == std::string::npos)
        refuse(line + ": must be PATH=VALUE, for example rods.rope.material.youngs_modulus=1e7");
      checkPath(line);
      applyOverride(tree_, line, where_);
    }
    if (!any)
      refuse("the text is empty; must be PATH=VALUE, for example rods.rope.material.youngs_modulus=1e7");
  }

  /// Writes defaults that depend on all objects into the text, if the edit would change them. Returns true if anything
  /// was written.
  bool keepDefaults(const SceneConfig& before, const SceneConfig& after)
  {
    const std::string origin = where_ + " (kept as it was)";
    bool wrote = false;
    const auto keep = [&](YamlTree& map, const char* key, const std::string& value) {
      if (map.find(key))
        return;
      keyOf(map, key) = scalar(value, origin);
      wrote = true;
    };
    const bool integrates =
        !before.rods.empty() || !before.bodies.empty() || !before.cloths.empty();   // more than threads
    if (integrates && after.time.integrator != before.time.integrator)
      keep(keyOf(tree_, "time"), "integrator", toString(before.time.integrator));
    if (before.contact.gap > 0 && after.contact.gap > 0 && after.contact.gap != before.contact.gap)
      keep(keyOf(tree_, "contact"), "gap", shortNumber(before.contact.gap, 17));
    for (std::size_t k = 0; k < entriesIn(tree_, "cloths") && k < after.cloths.size(); ++k)
    {
      const ClothConfig& cloth = after.cloths[k];
      const auto same = std::find_if(before.cloths.begin(), before.cloths.end(),
                                     [&](const ClothConfig& other) { return other.name == cloth.name; });
      if (same == before.cloths.end() || !same->contact || !cloth.contact ||
          same->contact->method == cloth.contact->method)
        continue;
      keep(keyOf(tree_.find("cloths")->items[k], "contact"), "method",
           same->contact->method == ContactMethod::barrier ? "barrier" : "impulses");
    }
    return wrote;
  }

  /// Removes the key `contact` of the scene, because the reader refuses it if no object has contact. Returns true if
  /// the key existed.
  bool dropContact()
  {
    const bool there = tree_.find("contact") != nullptr;
    eraseKey(tree_, "contact");
    return there;
  }

  const YamlTree& tree() const { return tree_; }

private:
  [[noreturn]] void refuse(const std::string& why) const { throw SceneError(where_ + ": " + why); }

  YamlTree parsed(const std::string& text) const
  {
    // error messages name lines of the text of the request
    YamlTree tree = parseYaml(text, where_);
    forEachValue(tree, [&](YamlTree& value) { value.origin = where_ + ":" + std::to_string(std::max(1, value.line)); });
    return tree;
  }

  /// Returns the only object with this name, or with "SECTION.NAME", in these sections. Throws SceneError otherwise.
  const ObjectEntry& find(const std::string& name, const std::vector<std::string>& sections) const
  {
    std::vector<const ObjectEntry*> found;
    std::vector<std::string> names;
    for (const ObjectEntry& object : objects_)
    {
      if (std::find(sections.begin(), sections.end(), object.section) == sections.end())
        continue;
      names.push_back(object.name);
      if (object.name == name || object.section + "." + object.name == name)
        found.push_back(&object);
    }
    if (found.empty())
    {
      refuse("there is no object \"" + name + "\" for this" +
             (names.empty() ? "" : "; the scene has: " + joinWords(names, 20)) + didYouMean(name, names));
    }
    if (found.size() > 1)
    {
      refuse("objects of several sections have the name " + name + "; give " + found[0]->section + "." + name + " or " +
             found[1]->section + "." + name);
    }
    if (found[0]->generated)
      refuse(name + " was made by generate and has no text of its own that could be changed");
    return *found[0];
  }

  YamlTree& textOf(const ObjectEntry& object) { return tree_.find(object.section)->items[object.index]; }

  void checkPath(const std::string& assignment) const
  {
    const std::vector<std::string> parts = split(assignment.substr(0, assignment.find('=')), '.');
    for (const auto& [section, keys] : changeable)
    {
      if (section != parts[0])
        continue;
      const bool listed = std::find(all_sections.begin(), all_sections.end(), section) != all_sections.end();
      const std::size_t at = listed ? 2 : 1;
      if (parts.size() > at && std::find(keys.begin(), keys.end(), parts[at]) != keys.end())
        return;
      refuse(assignment + ": of " + section + " these may change while the scene runs: " + section +
             (listed ? ".NAME." : ".") + "KEY with KEY one of " + joinWords(keys) +
             "; for others start the scene anew");
    }
    refuse(
        assignment +
        ": may not change while the scene runs; what may: wind.velocity, contact, and materials, damping, contact and "
        "loads of rods, threads, cloths, tracked, bodies and obstacles");
  }

  const std::string where_;
  YamlTree tree_;
  const std::vector<ObjectEntry> objects_;
};

const std::string edited_mark = " (edited)";

/// The service of each kind of edit, and what it does.
const std::pair<const char*, void (SceneText::*)(const std::string&)> edits[] = {
    {"~spawn", &SceneText::spawn},
    {"~remove", &SceneText::remove},
    {"~attach", &SceneText::attach},
    {"~detach", &SceneText::detach},
    {"~set_parameter", &SceneText::setParameters}};

}   // namespace

const char* toString(SceneEdit::Kind kind) { return edits[static_cast<int>(kind)].first; }

SceneConfig editedScene(const SceneConfig& scene, const SceneEdit& edit)
{
  SceneText text(scene, edit);
  (text.*edits[static_cast<int>(edit.kind)].second)(edit.text);
  // Error messages count lines in the edited text, not in the file, so the name of the file is marked.
  const bool edited_before =
      scene.file.size() > edited_mark.size() &&
      scene.file.compare(scene.file.size() - edited_mark.size(), std::string::npos, edited_mark) == 0;
  const std::string file = scene.file + (edited_before ? "" : edited_mark);
  SceneConfig edited;
  try
  {
    edited = sceneOfTree(text.tree(), file, scene.directory);
  }
  catch (const SceneError&)
  {
    if (edit.kind != SceneEdit::Kind::remove || !text.dropContact())
      throw;
    edited = sceneOfTree(text.tree(), file, scene.directory);
  }
  if (text.keepDefaults(scene, edited))
    edited = sceneOfTree(text.tree(), file, scene.directory);
  if (edit.kind == SceneEdit::Kind::set_parameter && edited.wind_topic && edited.wind != scene.wind)
    throw SceneError(
        "~set_parameter: wind.velocity: messages on the topic wind set the wind of this scene (wind: {topic: true}); "
        "publish there instead");
  edited.source = writeYaml(text.tree());
  return edited;
}

}   // namespace slender
