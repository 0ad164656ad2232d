#include "slender_sim/node/tf_inputs.h"

#include <algorithm>

#include <ros/console.h>

#include "scene/reader/yaml_cursor.h"
#include "slender_sim/node/converters.h"
#include "slender_sim/node/message_intake.h"

namespace slender {
namespace {

// Smallest interval between poses that are taken at the time of a step, as a share of ~guide_delay. Two intervals must
// fit into the delay.
constexpr double kSpacing = 0.4;
constexpr int kMostParents = 100;

}   // namespace

TfInputs::TfInputs(const NodeOptions& options, const SimClock& clock, const tf2_ros::Buffer& tf, DropCounter& drops,
                   std::set<std::string> own)
  : options_(options),
    clock_(clock),
    tf_(tf),
    drops_(drops),
    own_(std::move(own))
{
}

void TfInputs::follow(const std::string& frame, const std::string& who, Sink sink)
{
  auto found = std::find_if(frames_.begin(), frames_.end(), [&](const Frame& f) { return f.name == frame; });
  if (found == frames_.end())
  {
    Frame added;
    added.name = frame;
    found = frames_.insert(frames_.end(), std::move(added));
  }
  found->followers.push_back({who, std::move(sink)});
}

void TfInputs::look()
{
  if (stopped_)
    return;
  for (Frame& frame : frames_)
    lookAt(frame);
}

/// Returns the time at which the frame must be looked up, or nothing if there is no new pose. Throws
/// tf2::TransformException if tf does not know the frame.
std::optional<ros::Time> TfInputs::newest(Frame& frame) const
{
  const ros::Time step = clock_.nextStamp();
  ros::Time stamp;
  if (frame.name != options_.frame_id)
    stamp = tf_.lookupTransform(options_.frame_id, frame.name, ros::Time(0)).header.stamp;
  const bool beyond = stamp.isZero() || stamp > step;   // a static frame has stamp zero
  if (beyond)
    stamp = step;
  const double time = clock_.secondsAt(stamp), age = clock_.seconds() - time;
  frame.stale = age > options_.guide_timeout;
  if (frame.stale)
  {
    frame.why = "its newest transform is " + shortNumber(age, 3) + " s old (~guide_timeout)";
    return std::nullopt;
  }
  const double spacing = beyond ? kSpacing * options_.guide_delay - 0.5 * clock_.step() : 0.0;
  frame.why.clear();
  return frame.last && time - *frame.last <= std::max(spacing, 0.0) ? std::nullopt : std::optional<ros::Time>(stamp);
}

void TfInputs::lookAt(Frame& frame)
{
  Pose X_WF;
  std::optional<ros::Time> stamp;
  try
  {
    stamp = newest(frame);
    if (!stamp)
      return;
    if (frame.name != options_.frame_id)
    {
      drops_.receive();
      const PoseFault fault = fromMessage(tf_.lookupTransform(options_.frame_id, frame.name, *stamp).transform, X_WF);
      if (fault != PoseFault::none)
      {
        drops_.drop(fault == PoseFault::not_finite ? Drop::not_finite : Drop::bad_quaternion, "tf " + frame.name,
                    "in the transform to " + options_.frame_id);
        return;
      }
    }
  }
  catch (const tf2::TransformException& e)
  {
    frame.why = e.what();
    return;
  }
  const double time = clock_.secondsAt(*stamp);
  if (!(X_WF.position.cwiseAbs().maxCoeff() <= kMaxCoordinate))
    return dropOutOfRange("tf " + frame.name, drops_);
  if (!frame.checked)
  {
    ROS_INFO("%s: the frame %s of tf has come", frame.followers.front().who.c_str(), frame.name.c_str());
    warnOfLoop(frame);
  }
  frame.last = time;
  for (const Follower& follower : frame.followers)
    follower.sink(time, X_WF);
}

/// Warns if the frame depends on an object of this node. Its motion then feeds back on itself and may diverge.
void TfInputs::warnOfLoop(Frame& frame) const
{
  frame.checked = true;
  std::string child = frame.name, parent;
  for (int k = 0; k < kMostParents && tf_._getParent(child, ros::Time(0), parent); ++k)
  {
    if (own_.count(parent))
      ROS_WARN(
          "%s follows the frame %s of tf, a descendant of %s, which this node broadcasts: if the motion of %s depends "
          "on "
          "%s, both follow each other and may diverge",
          frame.followers.front().who.c_str(), frame.name.c_str(), parent.c_str(), parent.c_str(),
          frame.followers.front().who.c_str());
    child = parent;
  }
}

void TfInputs::restart()
{
  for (Frame& frame : frames_)
    frame.last.reset();
}

std::vector<TfInputs::State> TfInputs::states() const
{
  std::vector<State> states;
  for (const Frame& frame : frames_)
  {
    std::vector<std::string> who;
    for (const Follower& follower : frame.followers)
      who.push_back(follower.who);
    states.push_back({frame.name, joinWords(who), frame.last.has_value(), frame.stale, frame.why});
  }
  return states;
}

}   // namespace slender
