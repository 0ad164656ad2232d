#pragma once

#include <visualization_msgs/MarkerArray.h>

#include "slender_sim/node/node_options.h"
#include "slender_sim/scene/simulation.h"

namespace slender {

/// Pictures of a scene for rviz, derived from the state. One marker per thing with a stable ns and id:
/// `rods/NAME` 0 the rod, `frames/NAME` 0 its material frames, `grasps` i the gripper of grasp i, `bodies` i and
/// `obstacles` i their shapes (of a plane a piece); `threads/NAME` i piece i of a thread with its true radius,
/// `nozzles` i, `floors` i; `cloths/NAME` 0 the triangles of a cloth, `grasps` i what grasp i holds of it.
///
/// `guides/NAME` 0 the edges of the guide of a tracked cloth. Style regions colours tracked cloths by their test
/// functions. Cloth is shaded by its vertices' normals, alike on both sides; with style line its edges are drawn. tube:
/// true to scale, drawn through a smooth curve, with a stripe along d1 that shows the twist; line: one line strip. Very
/// fine rods are thinned out to a few hundred sections: a picture has no more pixels. Colours (options.color) are blue
/// for negative values, grey for none, red for positive ones: strain of rods and cloths (a cloth's principal one
/// farthest from zero), curvature (of cloths the mean one, towards the normal), twist of rods and threads. What has no
/// such value keeps its colour. With options.forces: `contacts` 0 what solids and rods do to rods where they touch, and
/// contacts to vertices of cloth, `wrenches` 2 i and 2 i + 1 what grasp i takes of force, and of torque (as the force
/// at a lever of 0.1 m), `nozzle_forces` i. `legend` 0 is a text above the scene. It says what colours, material frames
/// and arrows mean, when the options show any of them.
visualization_msgs::MarkerArray sceneMarkers(const Simulation& simulation, const std_msgs::Header& header,
                                             const MarkerOptions& options = {});

/// Returns the height [m] of the legend's letters that suits the present size of the scene; 0 without objects.
double legendLetters(const Simulation& simulation);

}   // namespace slender
