#pragma once

#include <limits>
#include <optional>

namespace slender {

/// What happens when a limit is exceeded, besides a warning.
enum class OnLimit
{
  warn,      ///< nothing
  hold,      ///< everything that is driven stays where it is until somebody lets it go on
  release,   ///< the grasp is released
  stop,      ///< the simulation stops
};

/// Limits beyond which a run is told of. An infinite one never is exceeded.
struct LimitsConfig
{
  /// Of the stretch strain of rods' edges and of cloths' mesh edges [-]. The laws of stretching are linear: at 0.5 the
  /// cross-section that they leave out of account has changed by a third to a half, and only rubber bears as much.
  double strain = 0.5;
  /// On a grasp [N], [N m]. What is too much depends on the gripper.
  double force = std::numeric_limits<double>::infinity(), torque = std::numeric_limits<double>::infinity();
  /// Of what is driven [m/s]: several times what robots and trackers of hands move at.
  double speed = 10.0;
  OnLimit on_limit = OnLimit::warn;
};

/// What a grasp has instead of the limits of the scene.
struct GraspLimits
{
  std::optional<double> force, torque;   ///< [N], [N m]
};

}   // namespace slender
