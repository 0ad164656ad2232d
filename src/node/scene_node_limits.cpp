// If a limit of the scene is exceeded, the node warns and reacts as `on_limit` says.
#include "slender_sim/node/scene_node.h"

#include <algorithm>

namespace slender {
namespace {

constexpr double kLimitReminder = 1.0;   // [s] wall time between warnings

diagnostic_msgs::KeyValue entry(const std::string& key, const std::string& value)
{
  diagnostic_msgs::KeyValue pair;
  pair.key = key;
  pair.value = value;
  return pair;
}

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
  for (const int grasp : limits_->released())
  {
    ROS_WARN("%s: grasp %s is released, because a limit is exceeded (on_limit: release)", who.c_str(),
             topics_->grasps[static_cast<std::size_t>(grasp)].c_str());
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

void SceneNode::addLimits(diagnostic_msgs::DiagnosticStatus& status) const
{
  const auto raise = [&status](std::uint8_t level, const std::string& message) {
    status.message += (status.message.empty() ? "" : "; ") + message;
    if (level > status.level)
      status.level = level;
  };
  const std::vector<std::string> lasting = limits_->lasting();
  if (!limits_->held().empty())
    raise(diagnostic_msgs::DiagnosticStatus::ERROR,
          "inputs are held (call ~pause with false to let them go on): " + limits_->held());
  else if (!lasting.empty())
    raise(diagnostic_msgs::DiagnosticStatus::WARN,
          lasting.front() + (lasting.size() > 1 ? " and " + std::to_string(lasting.size() - 1) + " more limits" : ""));
  const std::vector<std::string>& inside = crossings_->heldInside();
  if (!inside.empty())
    raise(diagnostic_msgs::DiagnosticStatus::WARN, inside.front());
  for (const std::string& pair : inside)
    status.values.push_back(entry("held inside", pair));
  status.values.push_back(entry("limits exceeded now", std::to_string(lasting.size())));
  status.values.push_back(entry("limits exceeded so far", std::to_string(limits_->count())));
  if (!lasting.empty())
    status.values.push_back(entry("last limit exceeded", lasting.back()));
}

}   // namespace slender
