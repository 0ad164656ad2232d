#pragma once

#include <string>
#include <vector>

#include <Eigen/Core>
#include <Eigen/Geometry>
#include <visualization_msgs/MarkerArray.h>

#include "slender_sim/node/node_options.h"
#include "slender_sim/scene/simulation.h"

/// Shared by the pictures of rods, cloths and solids.
namespace slender {

std_msgs::ColorRGBA color(double r, double g, double b, double a = 1.0);
visualization_msgs::Marker makeMarker(const std_msgs::Header& header, const std::string& ns, int id, int type);
/// rviz lights its own cubes and cylinders from the camera, so that their tops are black. It does not light triangles
/// that have colours of their own: light from above and the side is painted into these.
std_msgs::ColorRGBA lit(const std_msgs::ColorRGBA& paint, const Eigen::Vector3d& normal);

/// Makes the marker a list of the mesh's triangles [m], in the marker's pose and colour, lit; creases stay sharp.
void paintMesh(const TriangleMesh& mesh, visualization_msgs::Marker& marker);

/// Box around all rods, threads and cloths [m]; empty when there are none.
Eigen::AlignedBox3d sceneBox(const SceneState& state);

/// What colours show, per node or vertex (see MarkerOptions::range for units); empty: nothing to show.
std::vector<double> shownValues(const RodModel& model, const RodState& state, MarkerColor what);
std::vector<double> shownValues(const ThreadState& state, MarkerColor what);
std::vector<double> shownValues(const ClothModel& model, const Eigen::Matrix3Xd& x, MarkerColor what);
/// Value of the full colour.
double shownRange(const Simulation& simulation, const MarkerOptions& options);
/// From -1 blue over 0 grey to 1 red.
std_msgs::ColorRGBA valueColor(double share);

/// One marker per cloth and per grasp of it. `range`: see shownRange().
void addClothMarkers(const Simulation& simulation, const std_msgs::Header& header, const MarkerOptions& options,
                     double range, visualization_msgs::MarkerArray& out);

/// Arrows of forces, `scale` [m/N] long.
void addForceMarkers(const Simulation& simulation, const std_msgs::Header& header, double scale,
                     visualization_msgs::MarkerArray& out);

/// A text above the scene that says what colours, axes and arrows mean; nothing when the options show none of them.
void addLegend(const Simulation& simulation, const std_msgs::Header& header, const MarkerOptions& options, double range,
               visualization_msgs::MarkerArray& out);

/// One marker per body and obstacle that has a shape.
void addSolidMarkers(const Simulation& simulation, const std_msgs::Header& header,
                     visualization_msgs::MarkerArray& out);

}   // namespace slender
