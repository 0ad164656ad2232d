#pragma once

#include <string>

#include <Eigen/Core>
#include <visualization_msgs/MarkerArray.h>

#include "slender_sim/node/node_options.h"
#include "slender_sim/scene/simulation.h"

/// Shared by the pictures of rods, cloths and solids.
namespace slender {

std_msgs::ColorRGBA color(double r, double g, double b, double a = 1.0);
visualization_msgs::Marker makeMarker(const std_msgs::Header& header, const std::string& ns, int id, int type);
/// rviz does not light triangles that have colours of their own, so light from above and the side is painted in.
std_msgs::ColorRGBA lit(const std_msgs::ColorRGBA& paint, const Eigen::Vector3d& normal);

/// One marker per cloth and per grasp of it.
void addClothMarkers(const Simulation& simulation, const std_msgs::Header& header, MarkerStyle style, visualization_msgs::MarkerArray& out);

/// One marker per body and obstacle that has a shape.
void addSolidMarkers(const Simulation& simulation, const std_msgs::Header& header, visualization_msgs::MarkerArray& out);

}  // namespace slender
