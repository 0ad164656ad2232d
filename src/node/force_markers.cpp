#include "marker_tools.h"
#include "slender_sim/node/converters.h"

namespace slender {
namespace {

using Eigen::Vector3d;
using visualization_msgs::Marker;

constexpr double kLever = 0.1;   // [m] at which a torque's force acts
constexpr double kHead = 0.25;   // of an arrow's length

/// A shaft and four barbs, so that any number of arrows is one marker.
void addArrow(const Vector3d& from, const Vector3d& along, Marker& marker)
{
  const Vector3d tip = from + along, u = along.unitOrthogonal() * along.norm(),
                 w = along.cross(u).normalized() * along.norm();
  const auto line = [&marker](const Vector3d& a, const Vector3d& b) {
    marker.points.push_back(toPoint(a));
    marker.points.push_back(toPoint(b));
  };
  line(from, tip);
  for (const Vector3d& side : {u, Vector3d(-u), w, Vector3d(-w)})
    line(tip, tip - kHead * along + 0.4 * kHead * side);
}

/// An arrow that grows from `from`; none: deleted.
Marker arrowMarker(const std_msgs::Header& header, const std::string& ns, int id, const Vector3d& from,
                   const Vector3d& along, const std_msgs::ColorRGBA& paint)
{
  Marker marker = makeMarker(header, ns, id, Marker::ARROW);
  const double length = along.norm();
  if (!(length > 1e-6))
  {
    marker.action = Marker::DELETE;
    return marker;
  }
  marker.points = {toPoint(from), toPoint(from + along)};
  marker.scale.x = 0.06 * length;
  marker.scale.y = 0.14 * length;
  marker.scale.z = kHead * length;
  marker.color = paint;
  return marker;
}

}   // namespace

void addForceMarkers(const Simulation& simulation, const std_msgs::Header& header, double scale,
                     visualization_msgs::MarkerArray& out)
{
  const std_msgs::ColorRGBA force = color(0.85, 0.20, 0.55), torque = color(0.35, 0.25, 0.80),
                            touch = color(0.10, 0.60, 0.35);
  Marker contacts = makeMarker(header, "contacts", 0, Marker::LINE_LIST);
  double sum = 0.0;
  std::size_t count = 0;
  const auto add = [&](const Vector3d& at, const Vector3d& force) {
    const Vector3d along = scale * force;
    if (!(along.norm() > 1e-6))
      return;
    sum += along.norm();
    ++count;
    addArrow(at, along, contacts);
  };
  for (const ContactForce& contact : simulation.world().contacts())
    add(contact.position, contact.force);
  for (std::size_t k = 0; k < simulation.state().cloths.size(); ++k)
  {
    const Eigen::Matrix3Xd forces = simulation.world().contactForces({ObjectRef::cloth, static_cast<int>(k)});
    for (Eigen::Index i = 0; i < forces.cols(); ++i)
      add(simulation.state().cloths[k].x.col(i), forces.col(i));
  }
  contacts.scale.x = count > 0 ? 0.04 * sum / static_cast<double>(count) : 0.0;
  contacts.color = touch;
  if (contacts.points.empty())
    contacts.action = Marker::DELETE;
  out.markers.push_back(std::move(contacts));
  for (std::size_t g = 0; g < simulation.grasps().size(); ++g)
  {
    const int grasp = static_cast<int>(g);
    const Wrench wrench = simulation.grasps().isActive(grasp) ? simulation.grasps().wrench(grasp) : Wrench();
    const Vector3d at = simulation.grasps().pose(grasp).position;
    out.markers.push_back(arrowMarker(header, "wrenches", 2 * grasp, at, scale * wrench.force, force));
    out.markers.push_back(arrowMarker(header, "wrenches", 2 * grasp + 1, at, scale / kLever * wrench.torque, torque));
  }
  for (std::size_t k = 0; k < simulation.state().threads.size(); ++k)
    if (simulation.config().threads[k].nozzle)
      out.markers.push_back(arrowMarker(header, "nozzle_forces", static_cast<int>(k),
                                        simulation.state().threads[k].threads.front().ends[1].X_WE.position,
                                        scale * simulation.state().end_loads[static_cast<int>(k)][1].force, force));
}

}   // namespace slender
