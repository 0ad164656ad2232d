// If a limit of the scene is exceeded, the node warns and reacts as `on_limit` says.
#include "slender_sim/node/scene_node.h"

namespace slender {
namespace {

constexpr double kLimitReminder = 1.0;   // [s] wall time between warnings

}   // namespace

bool SceneNode::mindLimits(const std::vector<LimitExcess>& begun)
{
  const std::string who = nh_priv_.getNamespace();
  const bool held = !limits_->held().empty();
  for (const LimitExcess& excess : begun)
  {
    if (ros::WallTime::now() < next_limit_warning_)
    {
      ++limits_silent_;
      continue;
    }
    next_limit_warning_ = ros::WallTime::now() + ros::WallDuration(kLimitReminder);
    ROS_WARN("%s: %s%s; %lu more limits were exceeded since the last warning", who.c_str(), excess.text.c_str(),
             held ? "; what is driven stays where it is until ~pause is called with false (on_limit: hold)" : "",
             static_cast<unsigned long>(limits_silent_));
    limits_silent_ = 0;
  }
  for (const auto& [grasp, why] : limits_->released())
  {
    ROS_WARN("%s: grasp %s is released, because a limit is exceeded (on_limit: release): %s", who.c_str(),
             topics_->grasps[static_cast<std::size_t>(grasp)].c_str(), why.c_str());
    slender_sim::SetGrasp::Request request;
    request.name = topics_->grasps[static_cast<std::size_t>(grasp)];
    request.action = slender_sim::SetGrasp::Request::RELEASE;
    noteGrasp(request, kByLimit);
    showHandles();
  }
  if (limits_->stopped().empty() || replay_)   // a recorded run either ends here or went on after ~reset or ~load_state
    return true;
  fail("a limit is exceeded (on_limit: stop): " + limits_->stopped());
  return false;
}

/// Lets objects follow their inputs again after `on_limit: hold`. They catch up as after a pause.
void SceneNode::letInputsGoOn()
{
  limits_->goOn();
  inputs_->catchUp(*simulation_);
}

}   // namespace slender
