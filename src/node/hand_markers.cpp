#include "slender_sim/node/hand_markers.h"

#include "marker_tools.h"
#include "slender_sim/geometry/rotation.h"
#include "slender_sim/node/converters.h"

namespace slender {
namespace {

using visualization_msgs::InteractiveMarker;
using visualization_msgs::InteractiveMarkerControl;

InteractiveMarker makeHandle(const Handle& handle, const std::string& frame_id)
{
  InteractiveMarker out;
  out.header.frame_id = frame_id;   // stamp zero: what the hand does counts from now on
  out.name = out.description = handle.name;
  out.pose = toMessage(handle.X_WH);
  out.scale = static_cast<float>(handle.size);
  for (int axis = 0; axis < 3; ++axis)
    for (const bool turn : {false, true})
    {
      if (turn && !handle.turns)
        continue;
      InteractiveMarkerControl control;
      const Eigen::Vector3d along = Eigen::Vector3d::Unit(axis);
      control.orientation = toQuaternion(rotationBetween(Eigen::Vector3d::UnitX(), along));
      control.name = std::string(turn ? "turn_" : "move_") + "xyz"[axis];
      control.interaction_mode = turn ? InteractiveMarkerControl::ROTATE_AXIS : InteractiveMarkerControl::MOVE_AXIS;
      out.controls.push_back(control);
    }
  InteractiveMarkerControl ball;
  ball.name = "move_in_view";
  ball.orientation.w = 1.0;
  ball.orientation_mode = InteractiveMarkerControl::VIEW_FACING;
  ball.interaction_mode = InteractiveMarkerControl::MOVE_PLANE;
  ball.independent_marker_orientation = true;
  ball.always_visible = true;
  visualization_msgs::Marker picture;
  picture.type = visualization_msgs::Marker::SPHERE;
  picture.pose.orientation.w = 1.0;
  picture.scale = toVector3(Eigen::Vector3d::Constant(handle.ball));
  picture.color = color(0.95, 0.75, 0.20, 0.6);
  ball.markers.push_back(picture);
  out.controls.push_back(ball);
  return out;
}

}   // namespace

HandMarkers::HandMarkers(const std::string& topic, const std::string& frame_id)
  : frame_id_(frame_id),
    server_(topic, "", true)
{
}

void HandMarkers::show(const std::vector<Handle>& handles)
{
  server_.clear();
  for (const Handle& handle : handles)
    // other viewers, too, see the handle go with the hand
    server_.insert(makeHandle(handle, frame_id_),
                   [this](const visualization_msgs::InteractiveMarkerFeedbackConstPtr&) { server_.applyChanges(); });
  server_.applyChanges();
}

}   // namespace slender
