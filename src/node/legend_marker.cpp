#include "marker_tools.h"
#include "slender_sim/dynamics/failure_place.h"
#include "slender_sim/node/converters.h"
#include "slender_sim/node/scene_markers.h"

namespace slender {
namespace {

using visualization_msgs::Marker;

std::string colorLine(MarkerColor what, double range)
{
  const char* const name = what == MarkerColor::strain      ? "strain"
                           : what == MarkerColor::curvature ? "curvature"
                                                            : "twist";
  const char* const unit = what == MarkerColor::strain ? "" : what == MarkerColor::curvature ? " 1/m" : " rad/m";
  const std::string end = shortNumber(range, 3) + unit;
  return std::string(name) + ": blue -" + end + ", grey 0, red " + end + "\n";
}

/// Returns the box of all objects, with the nozzles that rviz shows behind threads.
Eigen::AlignedBox3d shownBox(const Simulation& simulation)
{
  Eigen::AlignedBox3d box = sceneBox(simulation.state());
  for (std::size_t k = 0; k < simulation.config().threads.size(); ++k)
    if (const auto& nozzle = simulation.config().threads[k].nozzle)
    {
      const Pose& X = simulation.state().threads[k].threads.front().ends[1].X_WE;
      box.extend(X * Eigen::Vector3d(-4.0 * nozzle->diameter, 0, 0));
    }
  return box;
}

}   // namespace

double legendLetters(const Simulation& simulation)
{
  const Eigen::AlignedBox3d box = shownBox(simulation);
  return box.isEmpty() ? 0.0 : 0.04 * box.diagonal().norm();
}

Eigen::AlignedBox3d sceneBox(const SceneState& state)
{
  Eigen::AlignedBox3d box;
  const auto extend = [&box](const Eigen::Matrix3Xd& x) {
    box.extend(x.rowwise().minCoeff()).extend(x.rowwise().maxCoeff());
  };
  for (const RodState& rod : state.rods)
    extend(rod.x);
  for (const ThreadGroupState& group : state.threads)
    for (const ThreadState& thread : group.threads)
      for (const Eigen::Vector3d& x : thread.x)
        box.extend(x);
  for (const ClothState& cloth : state.cloths)
    extend(cloth.x);
  return box;
}

void addLegend(const Simulation& simulation, const std_msgs::Header& header, const MarkerOptions& options, double range,
               visualization_msgs::MarkerArray& out)
{
  std::string text = options.note.empty() ? "" : options.note + "\n";
  if (options.color != MarkerColor::none)
    text += colorLine(options.color, range);
  if (options.style == MarkerStyle::regions)
    text += "one colour per test function\n";
  if (options.frames && !simulation.state().rods.empty())
    text += "frames: tangent red, d1 green, d2 blue\n";
  if (options.forces > 0.0)
    text += "arrows, " + shortNumber(options.forces, 3) +
            " m per N: contact green, holder red, its torque over 0.1 m violet\n";
  const Eigen::AlignedBox3d box = shownBox(simulation);
  Marker marker = makeMarker(header, "legend", 0, Marker::TEXT_VIEW_FACING);
  if (text.empty() || box.isEmpty())
  {
    marker.action = Marker::DELETE;   // rviz would keep an earlier text
    out.markers.push_back(std::move(marker));
    return;
  }
  const double letters = options.letters > 0.0 ? options.letters : legendLetters(simulation);
  Eigen::Vector3d place = box.center();
  place.z() = box.max().z() + 2.5 * letters;
  marker.pose.position = toPoint(place);
  marker.scale.z = letters;
  marker.color = color(0.15, 0.15, 0.18);
  marker.text = text.substr(0, text.size() - 1);
  out.markers.push_back(std::move(marker));
}

}   // namespace slender
