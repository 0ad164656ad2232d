#pragma once

#include <functional>
#include <map>
#include <set>
#include <string>
#include <vector>

#include "slender_sim/contact/shape.h"
#include "slender_sim/geometry/pose.h"

namespace slender {

/// A collision element of a link.
struct UrdfElement
{
  Shape shape;
  Pose X_LC;   ///< in the frame of the link
};

struct UrdfLink
{
  std::string name;
  Pose X_RL;   ///< in the frame of the root link
  std::vector<UrdfElement> elements;
};

struct UrdfOptions
{
  std::map<std::string, double> joints;   ///< positions of joints [rad] or [m]; of the others 0
  std::set<std::string> ignored;          ///< links whose collision elements are not read
  /// Path of a mesh file that the description names by `filename`. Throws std::runtime_error.
  std::function<std::string(const std::string&)> resolve;
};

/// Reads the links of a robot description (URDF text) with the parser of urdfdom, parents before children. Throws
/// std::runtime_error with a reason: no URDF, a link with two parent joints, a joint or link of `options` that the
/// robot does not have, a mesh that cannot be read.
std::vector<UrdfLink> readUrdf(const std::string& text, const UrdfOptions& options);

}   // namespace slender
