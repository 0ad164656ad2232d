#pragma once

#include <optional>
#include <string>
#include <vector>

#include <Eigen/Core>
#include <visualization_msgs/MarkerArray.h>

namespace slender {

/// View of rviz's orbit camera. The camera is at `distance` [m] from the focal point, in the direction of yaw and pitch
/// [rad] as rviz defines them.
struct OrbitView
{
  Eigen::Vector3d focal_point{0, 0, 0};
  double distance = 1.0, yaw = 0.0, pitch = 0.0;
};

/// Returns the points of a picture that a camera should show. All objects count. Solids and floors count only if they
/// are not much larger than the objects. Texts, arrows and material frames do not count.
std::vector<Eigen::Vector3d> pointsToShow(const visualization_msgs::MarkerArray& markers);

/// Returns the view with the same yaw and pitch in which the points lie in the middle of the picture and fill three
/// fifths of its width or height. `aspect` is width over height. Returns `view` unchanged if there are no points.
OrbitView fittedView(const std::vector<Eigen::Vector3d>& points, const OrbitView& view, double aspect);

/// Returns the text of a configuration of rviz whose current view is fitted to the points. Returns nothing if `config`
/// is not a configuration of rviz, or if its camera is not an orbit camera.
std::optional<std::string> fittedConfig(const std::string& config, const std::vector<Eigen::Vector3d>& points);

/// Returns the topics of the marker displays in a configuration of rviz.
std::vector<std::string> markerTopics(const std::string& config);

}   // namespace slender
