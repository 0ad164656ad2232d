// Inputs that are one number or vector, which hold from the next step on: flow, belt, wind.
#include "slender_sim/node/guide_inputs.h"

#include <cmath>

namespace slender {
namespace {

std::string text(double value) { return shortNumber(value, 6); }

}   // namespace

void GuideInputs::onFlow(std::size_t thread, const std_msgs::Float64& message)
{
  drops_.receive();
  const std::string what = prefixes_[thread] + "nozzle/flow";
  if (!std::isfinite(message.data))
    drops_.drop(Drop::not_finite, what, "it must be finite [m^3/s]");
  else if (message.data < 0.0 || message.data > threads_[thread].greatest_flow)
    drops_.drop(Drop::out_of_range, what,
                text(message.data) + "; it must be from 0 to " + text(threads_[thread].greatest_flow) +
                    " m^3/s, with which a thousand edges leave the nozzle per step");
  else
  {
    threads_[thread].flow = message.data;
    takenValues(slender_sim::Input::FLOW, thread, {message.data});
  }
}

/// In whatever frame the message names, as that stands now. Nothing when dropped.
std::optional<Eigen::Vector3d> GuideInputs::velocityOf(const geometry_msgs::Vector3Stamped& message,
                                                       const std::string& what)
{
  const Eigen::Vector3d velocity = fromMessage(message.vector);
  if (!velocity.allFinite())
  {
    drops_.drop(Drop::not_finite, what, "it must be finite [m/s]");
    return std::nullopt;
  }
  const std::optional<std::string> frame = frameOf(message.header, what, drops_);
  if (!frame || *frame == options_.frame_id)
    return frame ? std::optional(velocity) : std::nullopt;
  try
  {
    if (const auto X_WF = lookUp(tf_buffer_, options_.frame_id, *frame, ros::Time(0), what, drops_))
      return X_WF->orientation * velocity;
  }
  catch (const tf2::TransformException& e)
  {
    drops_.drop(Drop::no_transform, what, e.what());
  }
  return std::nullopt;
}

/// Only its horizontal part can be a belt's.
void GuideInputs::onBelt(std::size_t thread, const geometry_msgs::Vector3Stamped& message)
{
  drops_.receive();
  const std::string what = prefixes_[thread] + "belt/velocity";
  const std::optional<Eigen::Vector3d> velocity = velocityOf(message, what);
  if (!velocity)
    return;
  if (!(velocity->head<2>().cwiseAbs().maxCoeff() <= kMaxBeltSpeed))
    return drops_.drop(Drop::out_of_range, what, "components must be within " + text(kMaxBeltSpeed) + " m/s");
  threads_[thread].belt = Eigen::Vector3d(velocity->x(), velocity->y(), 0.0);
  takenValues(slender_sim::Input::BELT, thread, {velocity->x(), velocity->y(), 0.0});
}

void GuideInputs::onWind(const geometry_msgs::Vector3Stamped& message)
{
  drops_.receive();
  const std::optional<Eigen::Vector3d> velocity = velocityOf(message, "wind");
  if (!velocity)
    return;
  if (!(velocity->cwiseAbs().maxCoeff() <= kMaxWindSpeed))
    return drops_.drop(Drop::out_of_range, "wind", "components must be within " + text(kMaxWindSpeed) + " m/s");
  wind_ = velocity;
  takenValues(slender_sim::Input::WIND, 0, {wind_->x(), wind_->y(), wind_->z()});
}

std::vector<GuideInputs::Setting> GuideInputs::settings() const
{
  std::vector<Setting> settings;
  if (wind_topic_)
    settings.push_back(
        {"wind [m/s]", wind_ ? text(wind_->x()) + " " + text(wind_->y()) + " " + text(wind_->z()) : "none yet"});
  for (std::size_t k = 0; k < threads_.size(); ++k)
  {
    const Driven& thread = threads_[k];
    if (thread.flow_topic)
      settings.push_back({prefixes_[k] + "nozzle/flow [m^3/s]", thread.flow ? text(*thread.flow) : "none yet"});
    if (thread.belt_topic)
      settings.push_back({prefixes_[k] + "belt/velocity [m/s]",
                          thread.belt ? text(thread.belt->x()) + " " + text(thread.belt->y()) : "none yet"});
  }
  return settings;
}

}   // namespace slender
