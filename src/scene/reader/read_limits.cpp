#include "read_parts.h"

namespace slender {

namespace {

/// Reads a positive number, or `none` as infinity. Returns nothing if a problem was reported.
std::optional<double> readLimit(const YamlCursor& at, const char* unit)
{
  if (at.isScalar() && at.tree()->scalar == "none")
    return std::numeric_limits<double>::infinity();
  return at.number(Range::above(0, 1e12, unit));
}

}   // namespace

LimitsConfig readLimits(const YamlCursor& at)
{
  LimitsConfig limits;
  YamlMap map(at);
  assign(limits.strain, readLimit(map.get("strain",
                                          "Largest stretch strain of an edge of a rod, or of a mesh edge of a cloth; "
                                          "`none` for no limit. Without the key: 0.01 for inextensible rods, 0.05 for "
                                          "rods of at least 1 GPa, otherwise 0.5.")
                                      .takes("a number in (0, 1e12], or none"),
                                  ""));
  assign(limits.force, readLimit(map.get("force",
                                         "Largest force on a grasp; `none` for no limit. Grasps may have limits of "
                                         "their own. Without the key: none.")
                                     .takes("a number in (0, 1e12] N, or none"),
                                 "N"));
  assign(limits.torque, readLimit(map.get("torque",
                                          "Largest torque on a grasp, about its origin; `none` for no limit. Grasps "
                                          "may have limits of their own. Without the key: none.")
                                      .takes("a number in (0, 1e12] N m, or none"),
                                  "N m"));
  assign(limits.speed, readLimit(map.get("speed",
                                         "Largest speed with which grasps, bodies, obstacles, nozzles and guides are "
                                         "moved; `none` for no limit. Without the key: 10 m/s.")
                                     .takes("a number in (0, 1e12] m/s, or none"),
                                 "m/s"));
  assign(limits.on_limit,
         map.get("on_limit",
                 "What happens when a limit is exceeded, besides a warning. `hold`: everything that is driven stays "
                 "where it is, in a node until `~pause` with false lets it go on. `release`: the grasp is released; "
                 "for a strain the grasp of that object with the largest force. `stop`: the simulation stops as after "
                 "a failed step. Without the key: warn.")
             .choice<OnLimit>({{"warn", OnLimit::warn},
                               {"hold", OnLimit::hold},
                               {"release", OnLimit::release},
                               {"stop", OnLimit::stop}}));
  map.finish();
  return limits;
}

GraspLimits readGraspLimits(const YamlCursor& at)
{
  GraspLimits limits;
  YamlMap map(at);
  const auto force = readLimit(map.get("force",
                                       "Largest force on this grasp; `none` for no limit. Without the key: "
                                       "`limits.force` of the scene.")
                                   .takes("a number in (0, 1e12] N, or none"),
                               "N"),
             torque = readLimit(map.get("torque",
                                        "Largest torque on this grasp; `none` for no limit. Without the key: "
                                        "`limits.torque` of the scene.")
                                    .takes("a number in (0, 1e12] N m, or none"),
                                "N m");
  limits.force = force;
  limits.torque = torque;
  map.finish();
  return limits;
}

}   // namespace slender
