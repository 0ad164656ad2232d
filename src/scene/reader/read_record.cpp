// The section `record`: which steps are recorded, and which fields besides the motion.
#include <algorithm>

#include "read_parts.h"
#include "slender_sim/scene/record_fields.h"

namespace slender {

RecordConfig readRecord(const YamlCursor& at)
{
  RecordConfig record;
  YamlMap map(at);
  assign(record.every, map.get("every",
                               "`simulate` records every n-th step, in tables, bags and OBJ files alike; nodes take "
                               "their parameter `~state_every` instead. Without the key: 1, every step.")
                           .integer(1, 1'000'000'000, "steps"));
  if (const YamlCursor fields = map.get("fields",
                                        "Quantities that are recorded in addition to the motion; docs/quantities.md "
                                        "defines them. Without the key nothing is computed or recorded in addition.");
      fields.present())
    for (const YamlCursor& item : fields.items())
      if (const auto field = item.choice(recordFieldNames()))
      {
        if (std::find(record.fields.begin(), record.fields.end(), *field) != record.fields.end())
          item.problem("is named twice; leave one out");
        record.fields.push_back(*field);
      }
  map.finish();
  return record;
}

void checkRecord(const YamlCursor& at, const SceneConfig& scene)
{
  if (scene.record.fields.empty() || !at.problems().empty())
    return;
  const YamlCursor fields = YamlMap(at).find("fields");
  const bool bodies =
      std::any_of(scene.bodies.begin(), scene.bodies.end(), [](const BodyConfig& body) { return !body.motion; });
  for (const YamlCursor& item : fields.items())
  {
    const auto field = item.choice(recordFieldNames());
    if (!field)
      continue;
    if (*field == RecordField::energy && scene.rods.empty() && scene.cloths.empty() && !bodies)
      item.problem("is recorded of rods, cloths and simulated bodies, and the scene has none; leave it out");
    if (*field == RecordField::contact_force && scene.rods.empty() && scene.cloths.empty())
      item.problem("is recorded of rods and cloths, and the scene has none; leave it out");
    const bool of_threads =
        *field == RecordField::curvature || *field == RecordField::strain || *field == RecordField::force;
    if (*field < RecordField::energy && scene.rods.empty() && !(of_threads && !scene.threads.empty()))
      item.problem(of_threads ? "is recorded of rods and threads, and the scene has none; leave it out"
                              : "is recorded of rods, and the scene has none; leave it out");
    const auto projected = std::find_if(scene.rods.begin(), scene.rods.end(),
                                        [](const RodConfig& rod) { return rod.stretching == Stretching::projected; });
    if (*field == RecordField::force && projected != scene.rods.end())
      item.problem("is not known of rod " + projected->name +
                   ", whose edges keep their lengths by projection (stretching: projected): its tension is no function "
                   "of the state; leave it out, or take stretching: stiff");
  }
}

}   // namespace slender
