// What is dragged by hand in rviz: its poses go the way that messages of the same thing go.
#include <algorithm>

#include "marker_tools.h"
#include "slender_sim/contact/solids.h"
#include "slender_sim/node/guide_inputs.h"
#include "subscribe.h"

namespace slender {
namespace {

/// Of the box around an object [m].
double diagonal(const Eigen::AlignedBox3d& box) { return box.isEmpty() ? 1.0 : std::max(box.diagonal().norm(), 1e-3); }

/// The ball is little wider than the gripper of a rod, so that the rod is seen beside it, but wide enough to be caught
/// with a mouse where all of the object is in view.
void sizeGraspHandle(const Simulation& simulation, const GraspRef& ref, Handle& handle)
{
  if (ref.object.isCloth())
  {
    const Eigen::Matrix3Xd& x = simulation.state().points(ref.object);
    const double size = diagonal(Eigen::AlignedBox3d(x.rowwise().minCoeff(), x.rowwise().maxCoeff()));
    handle.size = 0.12 * size;
    handle.ball = 0.03 * size;
    return;
  }
  const RodModel& model = simulation.rodModel(ref.object.index);
  const double radius = std::max(model.radius_a.maxCoeff(), model.radius_b.maxCoeff()),
               length = model.rest_length.sum();
  handle.size = std::max(12.0 * radius, 0.08 * length);
  handle.ball = std::max(5.0 * radius, 0.02 * length);
  handle.turns = simulation.state().rods[ref.object.index].grasps[ref.index].holds_frame;
}

/// How far a shape reaches from its origin [m]. Of a plane only a piece is drawn.
double reachOf(const Shape& shape) { return std::holds_alternative<Plane>(shape) ? 0.3 : boundingRadius(shape); }

}   // namespace

void GuideInputs::listenToHand(ros::NodeHandle nh, const std::string& topic)
{
  using Feedback = visualization_msgs::InteractiveMarkerFeedback;
  subscribers_.push_back(
      subscribe<Feedback>(nh, topic + "/feedback", 100, [this](const Feedback& message) { onHand(message); }));
  if (!tf_listener_)
    tf_listener_ = std::make_unique<tf2_ros::TransformListener>(tf_buffer_, true, ros::TransportHints().tcpNoDelay());
}

bool GuideInputs::isDraggable(std::size_t guided) const
{
  const Guided& g = guided_[guided];
  // A grasp on a body moves with the body, and an object that follows tf moves with a robot.
  return g.buffer && g.frame.empty() && (g.kind != Kind::grasp || g.body.empty());
}

std::string GuideInputs::handleName(std::size_t guided) const
{
  const Guided& g = guided_[guided];
  return g.kind == Kind::grasp ? "grasps/" + g.name : g.kind == Kind::nozzle ? g.name : "bodies/" + g.name;
}

std::vector<Handle> GuideInputs::handles(const Simulation& simulation) const
{
  std::vector<Handle> out;
  const SceneConfig& scene = simulation.config();
  for (std::size_t g = 0; g < guided_.size(); ++g)
  {
    const auto [kind, index] = std::pair(guided_[g].kind, guided_[g].index);
    if (!isDraggable(g) || (kind == Kind::grasp && !simulation.grasps().isActive(index)))
      continue;
    Handle handle{handleName(g), poseOf(simulation, g)};
    if (kind == Kind::grasp)
      sizeGraspHandle(simulation, simulation.grasps()[index], handle);
    else if (kind != Kind::nozzle)
    {
      const Shape* shape = kind == Kind::obstacle      ? &scene.obstacles[index].shape
                           : scene.bodies[index].shape ? &*scene.bodies[index].shape
                                                       : nullptr;
      handle.size = shape ? 2.4 * reachOf(*shape) : 0.15 * diagonal(sceneBox(simulation.state()));
      handle.ball = 0.35 * handle.size;
    }
    else
    {
      const double diameter = scene.threads[index].nozzle->diameter;
      handle.size = 8.0 * diameter;
      handle.ball = 1.8 * diameter;
    }
    out.push_back(handle);
  }
  return out;
}

void GuideInputs::onHand(const visualization_msgs::InteractiveMarkerFeedback& message)
{
  drops_.receive();
  using Feedback = visualization_msgs::InteractiveMarkerFeedback;
  if (message.event_type != Feedback::POSE_UPDATE && message.event_type != Feedback::MOUSE_DOWN &&
      message.event_type != Feedback::MOUSE_UP)
    return;
  for (std::size_t g = 0; g < guided_.size(); ++g)
    if (isDraggable(g) && handleName(g) == message.marker_name)
    {
      const auto X_FH = checkedPose(message.pose, "interactive/feedback", message.marker_name, drops_);
      if (X_FH)
        hand_[g] = {*X_FH, message.header.frame_id};   // the newest of an instant counts
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
    const Pose X_FG = last ? moved->second.X_FH : poseOf(*simulation_, g);
    const Entry entry{static_cast<int>(g), X_FG * guided_[g].buffer->graspInGripper().inverse()};
    const bool solid = guided_[g].kind == Kind::body || guided_[g].kind == Kind::obstacle;
    intake_.take({{solid ? kBodiesSource : static_cast<int>(g), handleName(g)}, {entry}}, header);
    moved = last ? hand_.erase(moved) : std::next(moved);
  }
}

}   // namespace slender
