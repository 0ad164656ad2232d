#pragma once

#include <string>
#include <vector>

#include "study/rod/contact_cases.h"
#include "slender_sim/scene/pose_file.h"
#include "slender_sim/scene/simulation.h"
#include "slender_sim/study/study.h"

namespace slender::study {

/// config/scenes/NAME.yaml as it was when the package was built, with overrides as of `simulate --set`.
/// Throws std::out_of_range for a scene that is not among those built in, SceneError as it does.
SceneConfig packageSceneConfig(const std::string& name, const std::vector<std::string>& overrides = {});
/// The same, composed. Throws SimulationError as well.
Simulation packageScene(const std::string& name, const std::vector<std::string>& overrides = {});

/// config/motion/NAME.csv, timed poses of bodies, as it was when the package was built. Throws SceneError if it is not
/// among the files built in.
std::vector<BodyTrajectory> packageMotion(const std::string& name);

/// The rods, obstacles and contact of a scene without bodies, where they are now; grasps and obstacles stay.
GroupSetup groupOf(const Simulation& scene);

/// A picture of shapes: a plane seen along `view`, with `up` upwards.
struct Camera
{
  Eigen::Vector3d view{0, 1, 0}, up{0, 0, 1};
};

/// Draws a curve as a line of the series `label`; several curves of one series are kept apart.
void draw(Plot& picture, const std::string& label, const Eigen::Matrix3Xd& nodes, bool closed, const Camera& camera,
          const Eigen::Vector3d& shift = Eigen::Vector3d::Zero());

/// A plot for draw(): equal axes, no markers.
Plot& addPicture(StudyContext& context, const std::string& name, const std::string& title, const std::string& x_label,
                 const std::string& y_label);

}   // namespace slender::study
