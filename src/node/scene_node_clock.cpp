// When steps are due, and what their stamps are.
#include <algorithm>

#include "slender_sim/node/scene_node.h"

namespace slender {
namespace {

constexpr double kIdle = 0.02;           // [s] longest sleep: how late diagnostics and markers may be
constexpr double kClockPatience = 2.0;   // [s] until the first complaint that there is no /clock
constexpr double kSkipReminder = 10.0;   // [s] between complaints about skipped time

}   // namespace

void SceneNode::checkClock() const
{
  bool use_sim_time = false;
  nh_.getParam("/use_sim_time", use_sim_time);
  if (options_.pace == Pace::follow && options_.publish_clock)
    throw OptionError("~pace: follow waits for /clock, which ~publish_clock: true would publish; choose one");
  if (options_.pace == Pace::follow && !use_sim_time)
    throw OptionError(
        "~pace: follow needs the parameter /use_sim_time set to true (and somebody who publishes /clock)");
  if (options_.publish_clock && !use_sim_time)
    throw OptionError(
        "~publish_clock: true needs the parameter /use_sim_time set to true, or no other node will listen to /clock");
  if (use_sim_time && !options_.publish_clock && options_.pace != Pace::follow)
    throw OptionError(
        std::string("/use_sim_time is true, but ~pace: ") + toString(options_.pace) +
        " without ~publish_clock keeps its own time; use ~pace: follow, or ~publish_clock: true, or unset it");
  if (options_.speed != 1.0 && !options_.publish_clock && !replay_)
    ROS_WARN(
        "~speed: %g without ~publish_clock: stamps pass at %g times real time; poses must be stamped likewise, or with "
        "zero (now)",
        options_.speed, options_.speed);
}

/// With `follow` that may be the first /clock.
std::optional<ros::Time> SceneNode::firstStamp()
{
  if (replay_)
    return replay_->start();
  if (options_.start_time)
    return ros::Time(*options_.start_time);
  if (options_.pace == Pace::follow)
  {
    const ros::Time now = ros::Time::now();
    if (!now.isZero())
      return now;
    if (next_clock_reminder_.isZero())
      next_clock_reminder_ = ros::WallTime::now() + ros::WallDuration(kClockPatience);
    return std::nullopt;   // no /clock yet; asked again in work()
  }
  return options_.pace == Pace::wall && !options_.publish_clock ? ros::Time::now() : ros::Time(1.0);
}

bool SceneNode::stampsAreOfTheWall() const
{
  return options_.pace == Pace::wall && !options_.publish_clock && !options_.start_time && !replay_ &&
         options_.speed == 1.0;
}

ros::Time SceneNode::presentOfOthers() const
{
  const bool goes_on = mode_ != Mode::running && (options_.pace == Pace::follow || stampsAreOfTheWall());
  return goes_on ? ros::Time::now() : clock_.stamp();
}

void SceneNode::anchor()
{
  // the very time of the stamp, so that no lag is left of what is shorter than a step
  const ros::Time stamp = clock_.stamp();
  wall_start_ = stampsAreOfTheWall() ? ros::WallTime(stamp.sec, stamp.nsec) : ros::WallTime::now();
  wall_start_ticks_ = clock_.ticks();
}

std::uint64_t SceneNode::jumped()
{
  ++epoch_;
  wrenches_->restart();
  limits_->reset();
  clock_.tick();   // stamps grow even so
  showHandles();
  const std::uint64_t skipped = replay_ ? 0 : realign();
  step_ended_ = "the state was replaced by ~reset or ~load_state";
  return skipped;
}

std::uint64_t SceneNode::realign()
{
  // Where others keep the time, skip to their present: guides then act when they come, not late by the length of the
  // pause.
  std::uint64_t ticks = 0;
  if (options_.pace == Pace::follow || stampsAreOfTheWall())
  {
    const double behind = clock_.secondsAt(ros::Time::now()) - clock_.seconds();
    if (behind > clock_.step())
      ticks = static_cast<std::uint64_t>(behind / clock_.step());
    skip(ticks);
  }
  anchor();
  return ticks;
}

void SceneNode::skip(std::uint64_t ticks)
{
  if (ticks == 0)
    return;
  clock_.skip(ticks);
  inputs_->skip(static_cast<double>(ticks) * clock_.step());
}

double SceneNode::stampLag() const
{
  if (options_.pace == Pace::follow)
    return clock_.secondsAt(ros::Time::now()) - clock_.seconds();
  return (ros::WallTime::now() - wall_start_).toSec() -
         static_cast<double>(clock_.ticks() - wall_start_ticks_) * clock_.step() / options_.speed;
}

void SceneNode::skipToPresent()
{
  const std::uint64_t tick = clock_.ticks(), skipped = realign();
  if (skipped > 0)
    note(makeInput(slender_sim::Input::SKIP, {static_cast<double>(skipped)}), tick);
}

/// Physics takes every step; only the clock skips, as after a pause.
void SceneNode::keepUp()
{
  const double lag = stampLag();
  if (options_.pace != Pace::wall || options_.max_lag <= 0.0 || lag <= options_.max_lag)
    return;
  skipToPresent();
  total_.skipped += lag;
  recent_.skipped += lag;
  if (ros::WallTime::now() < next_skip_warning_)
    return;
  next_skip_warning_ = ros::WallTime::now() + ros::WallDuration(kSkipReminder);
  ROS_WARN(
      "%s is slower than real time: %s skip %.3g s to the present (~max_lag), %.3g s so far; a longer step, fewer "
      "nodes or ~speed below 1 help",
      nh_priv_.getNamespace().c_str(), stampsAreOfTheWall() ? "stamps" : "due times", lag, total_.skipped);
}

ros::WallDuration SceneNode::untilDue() const
{
  if (!clock_started_ || mode_ != Mode::running || options_.pace == Pace::step)
    return ros::WallDuration(kIdle);
  if (options_.pace == Pace::fast)
    return ros::WallDuration(0.0);
  if (options_.pace == Pace::follow)
    return ros::WallDuration(clock_.nextStamp() <= ros::Time::now() ? 0.0 : 0.001);
  return ros::WallDuration(std::clamp(clock_.step() / options_.speed - stampLag(), 0.0, kIdle));
}

}   // namespace slender
