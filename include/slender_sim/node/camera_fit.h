#pragma once

#include <optional>
#include <string>
#include <vector>

#include <Eigen/Core>
#include <visualization_msgs/MarkerArray.h>

namespace slender {

/// Where an orbiting camera of rviz looks from: `distance` [m] from the focal point, in the direction of yaw and pitch
/// [rad] as rviz counts them.
struct OrbitView
{
  Eigen::Vector3d focal_point{0, 0, 0};
  double distance = 1.0, yaw = 0.0, pitch = 0.0;
};

/// The points of a picture that a camera should show: of all objects; of solids and floors only as far as they are not
/// much larger than these. Texts, arrows and material frames do not count.
std::vector<Eigen::Vector3d> pointsToShow(const visualization_msgs::MarkerArray& markers);

/// Moves the camera, keeping yaw and pitch, so that the points fill four fifths of the picture's width or height and
/// lie in its middle. `aspect`: width over height. Returns the view unchanged when there are no points.
OrbitView fittedView(const std::vector<Eigen::Vector3d>& points, const OrbitView& view, double aspect);

/// A configuration of rviz with its present view fitted to the points. Returns nothing when the text is no such
/// configuration or its camera does not orbit.
std::optional<std::string> fittedConfig(const std::string& config, const std::vector<Eigen::Vector3d>& points);

/// The topics of the marker displays in a configuration of rviz.
std::vector<std::string> markerTopics(const std::string& config);

}   // namespace slender
