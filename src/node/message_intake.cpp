#include "slender_sim/node/message_intake.h"

#include <set>

#include "slender_sim/node/converters.h"

namespace slender {

std::optional<Pose> checkedPose(const geometry_msgs::Pose& message, const std::string& what, const std::string& whose,
                                DropCounter& drops)
{
  Pose X;
  const PoseFault fault = fromMessage(message, X);
  if (fault == PoseFault::none)
    return X;
  if (fault == PoseFault::not_finite)
    drops.drop(Drop::not_finite, what, "position and orientation of " + whose + " must be finite");
  else
    drops.drop(Drop::bad_quaternion, what, "the orientation of " + whose + ", whose length must be 1 within 1 %");
  return std::nullopt;
}

bool isComplete(const slender_sim::BodyStates& message, const std::string& what, DropCounter& drops)
{
  const std::size_t bodies = message.name.size();
  if (message.pose.size() != bodies || (!message.twist.empty() && message.twist.size() != bodies))
    drops.drop(Drop::wrong_length, what, "name, pose and twist must be equally long (twist may be empty)");
  else if (std::set<std::string>(message.name.begin(), message.name.end()).size() != bodies)
    drops.drop(Drop::wrong_length, what, "a name comes twice; there must be one pose per body");
  else
    return true;
  return false;
}

std::optional<std::string> frameOf(const std_msgs::Header& header, const std::string& what, DropCounter& drops)
{
  const std::string& frame = header.frame_id;
  if (!frame.empty())
    return frame.front() == '/' ? frame.substr(1) : frame;   // tf2 wants no slash
  drops.drop(Drop::bad_frame, what, "header.frame_id is empty");
  return std::nullopt;
}

std::optional<Pose> lookUp(const tf2_ros::Buffer& tf, const std::string& target, const std::string& frame,
                           const ros::Time& stamp, const std::string& what, DropCounter& drops)
{
  Pose X_TF;
  const PoseFault fault = fromMessage(tf.lookupTransform(target, frame, stamp).transform, X_TF);
  if (fault == PoseFault::none)
    return X_TF;
  drops.drop(fault == PoseFault::not_finite ? Drop::not_finite : Drop::bad_quaternion, what,
             "in the transform from " + frame);
  return std::nullopt;
}

void dropOutOfRange(const std::string& what, DropCounter& drops)
{
  drops.drop(Drop::out_of_range, what,
             "coordinates must be within " + std::to_string(static_cast<long>(kMaxCoordinate)) + " m");
}

}   // namespace slender
