// What is dragged by hand in rviz: its poses go the way that messages of the same thing go.
#include <algorithm>
#include <cmath>

#include "slender_sim/node/guide_inputs.h"

namespace slender {
namespace {

/// [m] Diagonal of the box around all rods, threads and cloths.
double sceneSize(const SceneState& state)
{
  Eigen::AlignedBox3d box;
  for (const RodState& rod : state.rods)
    box.extend(rod.x.rowwise().minCoeff()).extend(rod.x.rowwise().maxCoeff());
  for (const ThreadGroupState& group : state.threads)
    for (const ThreadState& thread : group.threads)
      for (const Eigen::Vector3d& x : thread.x)
        box.extend(x);
  for (const SceneCloth& held : state.cloths)
    box.extend(held.cloth.x.rowwise().minCoeff()).extend(held.cloth.x.rowwise().maxCoeff());
  return box.isEmpty() ? 1.0 : std::max(box.diagonal().norm(), 1e-3);
}

struct Reach   // [m] how far a shape reaches from its origin
{
  double operator()(const Plane&) const { return 0.3; }
  double operator()(const Sphere& s) const { return s.radius; }
  double operator()(const Box& b) const { return 0.5 * b.size.norm(); }
  double operator()(const Cylinder& c) const { return std::hypot(c.radius, 0.5 * c.length); }
  double operator()(const Capsule& c) const { return c.radius + 0.5 * c.length; }
  double operator()(const std::shared_ptr<const TriangleMesh>& mesh) const { return mesh->vertices.colwise().norm().maxCoeff(); }
};

}  // namespace

void GuideInputs::listenToHand(ros::NodeHandle nh, const std::string& topic)
{
  const boost::function<void(const visualization_msgs::InteractiveMarkerFeedback&)> callback =
      [this](const visualization_msgs::InteractiveMarkerFeedback& message) { onHand(message); };
  subscribers_.push_back(nh.subscribe<const visualization_msgs::InteractiveMarkerFeedback&>(topic + "/feedback", 100, callback, ros::VoidConstPtr(),
                                                                                          ros::TransportHints().tcpNoDelay()));
  if (!tf_listener_)
    tf_listener_ = std::make_unique<tf2_ros::TransformListener>(tf_buffer_, true, ros::TransportHints().tcpNoDelay());
}

bool GuideInputs::isDraggable(std::size_t guided) const
{
  const Guided& g = guided_[guided];
  return g.buffer && (guided >= grasps_ || g.body.empty());   // grasps with a body are its, not the hand's
}

std::string GuideInputs::handleName(std::size_t guided) const
{
  const Guided& g = guided_[guided];
  return guided < grasps_ ? "grasps/" + g.name : guided < grasps_ + bodies_ + obstacles_ ? "bodies/" + g.name : g.name;
}

std::vector<Handle> GuideInputs::handles(const Simulation& simulation) const
{
  std::vector<Handle> out;
  const SceneConfig& scene = simulation.config();
  const double size = sceneSize(simulation.state());
  for (std::size_t g = 0; g < guided_.size(); ++g)
  {
    if (!isDraggable(g) || (g < grasps_ && !simulation.isActive(static_cast<int>(g))))
      continue;
    Handle handle{handleName(g), poseOf(simulation, g), 0.15 * size, true};
    if (g < grasps_)
    {
      const GraspRef& ref = simulation.grasps()[g];
      handle.turns = ref.cloth >= 0 || simulation.state().rods[ref.rod].grasps[ref.index].holds_frame;
    }
    else if (g < grasps_ + bodies_ + obstacles_)
    {
      const std::size_t solid = g - grasps_;
      const Shape* shape = solid >= bodies_ ? &scene.obstacles[solid - bodies_].shape : scene.bodies[solid].shape ? &*scene.bodies[solid].shape : nullptr;
      if (shape)
        handle.size = 2.4 * std::visit(Reach(), *shape);
    }
    else
      handle.size = 8.0 * scene.threads[g - grasps_ - bodies_ - obstacles_].nozzle->diameter;
    out.push_back(handle);
  }
  return out;
}

void GuideInputs::onHand(const visualization_msgs::InteractiveMarkerFeedback& message)
{
  drops_.receive();
  using Feedback = visualization_msgs::InteractiveMarkerFeedback;
  if (message.event_type != Feedback::POSE_UPDATE && message.event_type != Feedback::MOUSE_DOWN && message.event_type != Feedback::MOUSE_UP)
    return;
  for (std::size_t g = 0; g < guided_.size(); ++g)
    if (isDraggable(g) && handleName(g) == message.marker_name)
    {
      Entry entry{static_cast<int>(g), Pose()};
      if (checkPose(message.pose, "interactive/feedback", message.marker_name, entry.X_FH))
        hand_[g] = {entry.X_FH, message.header.frame_id};   // the newest of an instant counts
      return;
    }
  drops_.drop(Drop::unknown_name, "interactive/feedback", "nothing by hand moves \"" + message.marker_name + "\"");
}

/// One pose per thing and instant, at the present time.
void GuideInputs::takeHand()
{
  for (auto moved = hand_.begin(); moved != hand_.end();)
  {
    const std::size_t g = moved->first;
    const std::optional<double> last = guided_[g].buffer->lastTime();
    if (last && *last >= clock_.seconds())
    {
      ++moved;   // with the next step
      continue;
    }
    std_msgs::Header header;   // stamp zero: now
    header.frame_id = last ? moved->second.frame : options_.frame_id;
    // the first pose of all is where the thing is: there the hand took hold of it
    const Entry entry{static_cast<int>(g), last ? moved->second.X_FH * guided_[g].buffer->graspInGripper().inverse() : poseOf(*simulation_, g)};
    const bool solid = g >= grasps_ && g < grasps_ + bodies_ + obstacles_;
    take(solid ? kBodiesSource : static_cast<int>(g), handleName(g), header, {entry});
    moved = last ? hand_.erase(moved) : std::next(moved);
  }
}

}  // namespace slender
