#include "read_parts.h"

namespace slender {

namespace {

/// Reads a positive number, or `none` as infinity.
template <class Limit>
void readLimit(YamlMap& map, const char* key, Limit& limit, const char* unit, const char* meaning)
{
  const YamlCursor at = map.get(key, meaning);
  const std::string space = *unit ? " " : "";
  at.takes(("a number in (0, 1e12]" + space + unit + ", or none").c_str());
  if (at.isWord("none"))
    limit = std::numeric_limits<double>::infinity();
  else
    at.read(limit, Range::above(0, 1e12, unit));
}

}   // namespace

LimitsConfig readLimits(const YamlCursor& at)
{
  LimitsConfig limits;
  YamlMap map(at);
  readLimit(map, "strain", limits.strain, "",
            "Largest stretch strain of an edge of a rod, or of a mesh edge of a cloth; `none` for no limit. Without "
            "the key: 0.01 for inextensible rods, 0.05 for rods of at least 1 GPa, otherwise 0.5.");
  readLimit(
      map, "force", limits.force, "N",
      "Largest force on a grasp; `none` for no limit. Grasps may have limits of their own. Without the key: none.");
  readLimit(map, "torque", limits.torque, "N m",
            "Largest torque on a grasp, about its origin; `none` for no limit. Grasps may have limits of their own. "
            "Without the key: none.");
  readLimit(map, "speed", limits.speed, "m/s",
            "Largest speed with which grasps, bodies, obstacles, nozzles and guides are moved; `none` for no limit. "
            "Without the key: 10 m/s.");
  map.get("on_limit", limits.on_limit,
          {{"warn", OnLimit::warn}, {"hold", OnLimit::hold}, {"release", OnLimit::release}, {"stop", OnLimit::stop}},
          "What happens when a limit is exceeded, besides a warning. `hold`: everything that is driven stays where it "
          "is, in a node until `~pause` with false lets it go on. `release`: the grasp is released; for a strain the "
          "grasp of that object with the largest force. `stop`: the simulation stops as after a failed step. Without "
          "the key: warn.");
  return limits;
}

GraspLimits readGraspLimits(const YamlCursor& at)
{
  GraspLimits limits;
  YamlMap map(at);
  readLimit(map, "force", limits.force, "N",
            "Largest force on this grasp; `none` for no limit. Without the key: `limits.force` of the scene.");
  readLimit(map, "torque", limits.torque, "N m",
            "Largest torque on this grasp; `none` for no limit. Without the key: `limits.torque` of the scene.");
  return limits;
}

}   // namespace slender
