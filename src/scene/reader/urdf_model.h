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
  Pose X_LC;   ///< pose in the frame of the link
};

struct UrdfLink
{
  std::string name;
  Pose X_RL;   ///< pose in the frame of the root link
  std::vector<UrdfElement> elements;
};

struct UrdfOptions
{
  std::map<std::string, double> joints;   ///< positions of joints [rad] or [m]; 0 for joints not in the map
  std::set<std::string> ignored;          ///< links whose collision elements are not read
  /// Returns the path of the mesh file for a `filename` in the description. Throws std::runtime_error.
  std::function<std::string(const std::string&)> resolve;
};

/// Reads the links of a robot description (URDF text) with the parser of urdfdom and returns parents before children.
/// Throws std::runtime_error with the reason if the text is no URDF, if a link has two parent joints, if the robot
/// lacks a joint or link of `options`, or if a mesh cannot be read.
std::vector<UrdfLink> readUrdf(const std::string& text, const UrdfOptions& options);

}   // namespace slender
