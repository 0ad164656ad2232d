#pragma once

#include <array>

#include "slender_sim/scene/snapshot_meshes.h"

namespace slender {

/// Red, green, blue in [0, 1]: about what the nodes' markers have.
inline Eigen::Vector3d objectColor(ObjectKind kind, int index)
{
  using Color = Eigen::Vector3d;
  static const std::array<Color, 4> rods = {Color(0.93, 0.55, 0.16), Color(0.16, 0.50, 0.72), Color(0.35, 0.62, 0.30),
                                            Color(0.62, 0.36, 0.66)};
  static const std::array<Color, 4> cloths = {Color(0.20, 0.47, 0.72), Color(0.85, 0.38, 0.28), Color(0.40, 0.62, 0.38),
                                              Color(0.87, 0.70, 0.32)};
  switch (kind)
  {
    case ObjectKind::rod: return rods[index % rods.size()];
    case ObjectKind::thread: return {0.90, 0.60, 0.12};
    case ObjectKind::cloth: return cloths[index % cloths.size()];
    case ObjectKind::body: return {0.70, 0.28, 0.24};
    case ObjectKind::gripper: return {0.22, 0.27, 0.33};
    case ObjectKind::nozzle: return {0.55, 0.57, 0.60};
    case ObjectKind::obstacle: break;
  }
  return {0.62, 0.64, 0.66};
}

}   // namespace slender
