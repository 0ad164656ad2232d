// The section `record`: which steps and nodes are recorded, and which fields besides the motion.
#include <algorithm>

#include "read_parts.h"

namespace slender {

RecordConfig readRecord(const YamlCursor& at)
{
  RecordConfig record;
  YamlMap map(at);
  map.get("every", record.every, Range::closed(1, 1'000'000'000, "steps"),
          "`simulate` records every n-th step, in tables, bags and OBJ files alike; nodes take their parameter "
          "`~state_every` instead. Without the key: 1, every step.");
  map.get("nodes",
          "Nodes of rods and vertices of cloths that the tables of `simulate --csv` hold: a list if the scene has one "
          "object, otherwise a map from names of rods and cloths to lists. Objects that are not named, and threads, "
          "are written whole, and [] writes none. Bags, tables made from bags, OBJ files and states always hold all "
          "nodes. Without the key: all nodes.")
      .takes("a list of indices from 0 (negative: from the end) and ranges FIRST..LAST");
  const YamlCursor fields = map.get("fields",
                                    "Quantities that are recorded in addition to the motion; docs/quantities.md "
                                    "defines them. Without the key nothing is computed or recorded in addition.");
  const Choices<RecordField> names = {{"curvature", RecordField::curvature},
                                      {"twist", RecordField::twist},
                                      {"strain", RecordField::strain},
                                      {"force", RecordField::force},
                                      {"moment", RecordField::moment},
                                      {"energy", RecordField::energy},
                                      {"contact_force", RecordField::contact_force}};
  for (const YamlCursor& item : fields.items())
    if (const auto field = item.choice(names))
    {
      if (std::find(record.fields.begin(), record.fields.end(), *field) != record.fields.end())
        item.problem("is named twice; leave one out");
      record.fields.push_back(*field);
    }
  return record;
}

namespace {

void checkFields(const YamlCursor& fields, const SceneConfig& scene)
{
  const bool bodies =
      std::any_of(scene.bodies.begin(), scene.bodies.end(), [](const BodyConfig& body) { return !body.motion; });
  const std::vector<YamlCursor> items = fields.items();
  for (std::size_t k = 0; k < items.size(); ++k)
  {
    const YamlCursor& item = items[k];
    const RecordField field = scene.record.fields[k];
    if (field == RecordField::energy && scene.rods.empty() && scene.cloths.empty() && !bodies)
      item.problem("is recorded of rods, cloths and simulated bodies, and the scene has none; leave it out");
    if (field == RecordField::contact_force && scene.rods.empty() && scene.cloths.empty() && scene.bodies.empty() &&
        scene.obstacles.empty())
      item.problem("is recorded of rods, cloths, bodies and obstacles, and the scene has none; leave it out");
    const bool of_threads =
        field == RecordField::curvature || field == RecordField::strain || field == RecordField::force;
    if (field < RecordField::energy && scene.rods.empty() && !(of_threads && !scene.threads.empty()))
      item.problem(of_threads ? "is recorded of rods and threads, and the scene has none; leave it out"
                              : "is recorded of rods, and the scene has none; leave it out");
    const auto projected = std::find_if(scene.rods.begin(), scene.rods.end(),
                                        [](const RodConfig& rod) { return rod.stretching == Stretching::projected; });
    if (field == RecordField::force && projected != scene.rods.end())
      item.problem("is not known of rod " + projected->name +
                   ", whose edges keep their lengths by projection (stretching: projected): its tension is no function "
                   "of the state; leave it out, or take stretching: stiff");
  }
}

/// The objects of a scene that have nodes, in the order of the scene.
struct Recorded
{
  std::vector<std::string> names;   ///< of rods and cloths
  std::vector<int> counts;          ///< of their nodes; 0: not known
  std::vector<std::string> threads;
};

/// `known`: the objects are sound, so that their nodes can be counted.
Recorded recordedOf(const SceneConfig& scene, bool known)
{
  Recorded all;
  for (const RodConfig& rod : scene.rods)
  {
    all.names.push_back(rod.name);
    all.counts.push_back(known ? rod.nodes() : 0);
  }
  for (const ClothConfig& cloth : scene.cloths)
  {
    all.names.push_back(cloth.name);
    all.counts.push_back(known ? static_cast<int>(cloth.mesh.vertices.cols()) : 0);
  }
  for (const ThreadConfig& thread : scene.threads)
    all.threads.push_back(thread.name);
  return all;
}

std::vector<int> readNodes(const YamlCursor& at, int count)
{
  if (at.isList() && at.tree()->items.empty())
    return {};
  std::vector<int> nodes = readIndexList(at, count);
  const auto twice = std::adjacent_find(nodes.begin(), nodes.end());
  if (twice != nodes.end())
    at.problem("names node " + std::to_string(*twice) + " twice; give each once");
  return nodes;
}

/// Reports a name that no single rod or cloth has. Returns its place in `all`, or -1.
int findRecorded(const YamlCursor& at, const std::string& name, const Recorded& all)
{
  const auto found = std::find(all.names.begin(), all.names.end(), name);
  if (std::find(all.threads.begin(), all.threads.end(), name) != all.threads.end())
  {
    at.problem("is a thread, whose nodes are made and dropped as it flows; threads are written whole, leave it out");
    return -1;
  }
  if (found == all.names.end())
  {
    at.problem("is no rod or cloth of the scene" + didYouMean(name, all.names) + itHas(all.names));
    return -1;
  }
  if (std::find(found + 1, all.names.end(), name) != all.names.end())
  {
    at.problem("is the name of a rod and of a cloth; give them different names to choose nodes");
    return -1;
  }
  return static_cast<int>(found - all.names.begin());
}

NodeChoice readNodeChoice(const YamlCursor& at, const SceneConfig& scene)
{
  NodeChoice choice;
  if (!at.present())
    return choice;
  const Recorded all = recordedOf(scene, at.problems().empty());
  if (at.isMap())
  {
    for (const auto& [name, list] : at.members("Nodes of the rod, or vertices of the cloth, of this name."))
    {
      const int place = findRecorded(list, name, all);
      if (place >= 0)
        choice[name] = readNodes(list, all.counts[static_cast<std::size_t>(place)]);
    }
    return choice;
  }
  const std::size_t objects = all.names.size() + all.threads.size();
  if (objects == 1 && !all.names.empty())
    choice[all.names[0]] = readNodes(at, all.counts[0]);
  else if (objects > 1)
    at.problem("is for the only object of a scene, and this one has " + std::to_string(objects) +
               " rods, cloths and threads; must be a map from names to lists, for example nodes: {" +
               (all.names.empty() ? "NAME" : all.names[0]) + ": [0, -1]}");
  else
    at.problem("is for rods and cloths, of which the scene has none; threads are written whole, leave it out");
  return choice;
}

}   // namespace

void completeRecord(const YamlCursor& at, SceneConfig& scene)
{
  if (!scene.record.fields.empty() && at.problems().empty())
    checkFields(at.find("fields"), scene);
  if (at.isMap())
    scene.record.nodes = readNodeChoice(at.find("nodes"), scene);
}

}   // namespace slender
