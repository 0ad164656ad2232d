#pragma once

#include <limits>
#include <optional>

namespace slender {

/// Reaction to an exceeded limit, besides a warning.
enum class OnLimit
{
  warn,      ///< no further reaction
  hold,      ///< all driven objects stay in place until a user lets them continue
  release,   ///< the grasp is released
  stop,      ///< the simulation stops
};

/// Default limits of strain [-]. The laws of stretching are linear and neglect the change of the cross-section. At a
/// strain of 0.5 this change is a third to a half, and only rubber withstands such a strain. Metals and stiff polymers
/// (a modulus of at least kStiffModulus [Pa]) yield or break below 0.05. An inextensible rod reaches a strain of 0.01
/// only if a gripper pulls it beyond its length.
constexpr double kSoftStrain = 0.5, kStiffStrain = 0.05, kInextensibleStrain = 0.01;
constexpr double kStiffModulus = 1e9;

/// Limits of a run. Infinity means no limit.
struct LimitsConfig
{
  /// Largest stretch strain of the edges of rods and of the mesh edges of cloths [-]. Without a value,
  /// a rod has the default of its material, and a cloth has kSoftStrain.
  std::optional<double> strain;
  /// Largest force [N] and torque [N m] on a grasp. A useful limit depends on the gripper.
  double force = std::numeric_limits<double>::infinity(), torque = std::numeric_limits<double>::infinity();
  /// Largest speed of driven objects [m/s]. The default is several times the speed of robots and of tracked hands.
  double speed = 10.0;
  OnLimit on_limit = OnLimit::warn;
};

/// Limits of one grasp, in place of the limits of the scene. Nothing: the limit of the scene.
struct GraspLimits
{
  std::optional<double> force, torque;   ///< [N], [N m]
};

}   // namespace slender
