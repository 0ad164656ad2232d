#include "slender_sim/node/grasp_wrenches.h"

#include <cmath>

#include "slender_sim/node/converters.h"

namespace slender {
namespace {

void approach(geometry_msgs::Vector3& value, const geometry_msgs::Vector3& target, double share)
{
  value.x += share * (target.x - value.x);
  value.y += share * (target.y - value.y);
  value.z += share * (target.z - value.z);
}

}   // namespace

GraspWrenches::GraspWrenches(ros::NodeHandle& nh, const std::vector<std::string>& names,
                             std::vector<std::string> frames, const Options& options)
  : options_(options),
    channels_(names.size())
{
  for (std::size_t g = 0; g < names.size(); ++g)
  {
    channels_[g].raw = nh.advertise<geometry_msgs::WrenchStamped>("grasps/" + names[g] + "/wrench", 100);
    channels_[g].filtered = nh.advertise<geometry_msgs::WrenchStamped>("grasps/" + names[g] + "/wrench_filtered", 100);
    channels_[g].frame = std::move(frames[g]);
  }
}

bool GraspWrenches::isHeard() const
{
  for (const Channel& channel : channels_)
    if (channel.raw.getNumSubscribers() > 0 || channel.filtered.getNumSubscribers() > 0)
      return true;
  return false;
}

void GraspWrenches::publish(const SceneMessages& messages)
{
  for (std::size_t g = 0; g < channels_.size(); ++g)
  {
    Channel& channel = channels_[g];
    const geometry_msgs::WrenchStamped& now = messages.wrenches[g];
    if (channel.raw.getNumSubscribers() > 0)
      publish(channel.raw, channel, now, messages.grasps.pose[g]);
    if (channel.filtered.getNumSubscribers() == 0)
    {
      channel.started = false;
      continue;
    }
    if (!channel.started)
      channel.last = now;
    channel.started = true;
    const double elapsed = std::max(0.0, (now.header.stamp - channel.last.header.stamp).toSec());
    const double share = -std::expm1(-elapsed / options_.filter_time);
    approach(channel.last.wrench.force, now.wrench.force, share);
    approach(channel.last.wrench.torque, now.wrench.torque, share);
    channel.last.header = now.header;
    publish(channel.filtered, channel, channel.last, messages.grasps.pose[g]);
  }
}

void GraspWrenches::publish(const ros::Publisher& publisher, const Channel& channel,
                            geometry_msgs::WrenchStamped message, const geometry_msgs::Pose& pose) const
{
  if (!options_.world)
  {
    message.header.frame_id = channel.frame;
    const Eigen::Quaterniond to_grasp = fromMessage(pose.orientation).conjugate();
    const auto turn = [&](geometry_msgs::Vector3& v) { v = toVector3(to_grasp * fromMessage(v)); };
    turn(message.wrench.force);
    turn(message.wrench.torque);
  }
  publisher.publish(message);
}

void GraspWrenches::takeOver(const GraspWrenches& before)
{
  for (Channel& channel : channels_)
    for (const Channel& earlier : before.channels_)
      if (earlier.filtered.getTopic() == channel.filtered.getTopic())
      {
        channel.last = earlier.last;
        channel.started = earlier.started;
      }
}

void GraspWrenches::restart()
{
  for (Channel& channel : channels_)
    channel.started = false;
}

}   // namespace slender
