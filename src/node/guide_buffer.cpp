#include "slender_sim/node/guide_buffer.h"

#include <algorithm>
#include <cmath>
#include <stdexcept>

#include "slender_sim/geometry/rotation.h"
#include "slender_sim/node/catch_up.h"

namespace slender {
namespace {

using Eigen::Vector3d;

}  // namespace

GuideBuffer::GuideBuffer(const Options& options, Attach attach, const Pose& X_WG) : options_(options), attach_(attach), timing_(options.timing())
{
  if (!(options.catch_up_time > 0.0) || !(options.catch_up_speed > 0.0) || !(options.catch_up_turning > 0.0))
    throw std::invalid_argument("GuideBuffer: catch-up time and speeds must be > 0");
  last_.X = X_WG;
}

bool GuideBuffer::push(double time, const Pose& X_WH)
{
  if (last_stamp_ && !(time > *last_stamp_))
    return false;
  const bool fresh = timing_.sample(time);
  if (fresh && !trajectory_.empty())
    next_ = PoseTrajectory();
  (next_ ? *next_ : trajectory_).append(time, X_WH);
  last_stamp_ = time;
  changed_ = true;
  return true;
}

/// Lets the newest stream take effect, which is the first one or one after a pause.
void GuideBuffer::begin(double time, const GuideTiming::Instant& now)
{
  if (next_)
    trajectory_ = std::move(*next_);
  next_.reset();
  trajectory_.coast(options_.coast);
  trajectory_.expectMore();
  open_ = false;
  const double start = trajectory_.firstTime();
  if (!following_)
  {
    X_HG_ = attach_ == Attach::initial ? trajectory_.evaluate(start).inverse() * last_.X : Pose();
    last_.V = Twist();
  }
  following_ = changed_ = true;
  plain_.X.position.setConstant(std::nan(""));   // no earlier query was made of this trajectory
  last_time_ = now.rate > 0.0 ? time - (now.time - start) : time;
  query_ = start;
  rate_ = now.rate;
}

bool GuideBuffer::passesHere() const
{
  const Motion now = followed(query_, rate_);
  return now.X.position == plain_.X.position && now.X.orientation.coeffs() == plain_.X.orientation.coeffs() && now.V.linear == plain_.V.linear &&
         now.V.angular == plain_.V.angular;
}

GraspTarget GuideBuffer::target(double time)
{
  GuideTiming::Instant now = timing_.advance(time);
  if (now.began)
    begin(time, now);
  else if (!now.following && following_)   // the earlier stream goes on until the next one takes effect
    now.time = query_ + rate_ * (time - *last_time_);
  if (now.jumped)
  {
    query_ = now.time;
    rate_ = now.rate;
    plain_.X.position.setConstant(std::nan(""));
    changed_ = true;
  }
  if (following_)
  {
    if (now.following && now.open != open_ && options_.coast == 0.0)
    {
      open_ = now.open;
      trajectory_.coast(open_ ? kOpenCoast : 0.0);
      changed_ = true;
    }
    if (changed_ && !passesHere())   // the trajectory no longer passes through what the solver was given
      blendFrom(*last_time_, last_, followed(query_ + kLimitOffset, rate_));
    changed_ = false;
    query_ = now.time;
    rate_ = now.rate;
    plain_ = followed(query_, rate_);
    last_ = blended(time, plain_);
    trajectory_.forgetBefore(query_);
  }
  last_time_ = time;
  return {last_.X, last_.V};
}

void GuideBuffer::attachAt(const Pose& X_WG)
{
  last_ = {X_WG, Twist()};
  offset_.reset();
  if (!following_)
    return;
  if (attach_ == Attach::initial)
    X_HG_ = trajectory_.evaluate(query_).inverse() * X_WG;
  blendFrom(*last_time_, last_, followed(query_ + kLimitOffset, rate_));
}

void GuideBuffer::restart(const Pose& X_WG)
{
  timing_.restart();
  trajectory_ = PoseTrajectory();
  next_.reset();
  last_stamp_.reset();
  following_ = changed_ = open_ = false;
  offset_.reset();
  last_ = {X_WG, Twist()};
}

void GuideBuffer::skip(double seconds)
{
  timing_.skip(seconds);
  query_ += seconds;
  plain_.X.position.setConstant(std::nan(""));
  if (last_time_)
    *last_time_ += seconds;
  if (offset_)
    offset_->start += seconds;
  changed_ = true;
}

GuideBuffer::Motion GuideBuffer::followed(double query, double rate) const
{
  Motion m;
  Twist V_WH;
  const Pose X_WH = trajectory_.evaluate(query, &V_WH);
  m.X = X_WH * X_HG_;
  m.V.angular = rate * V_WH.angular;
  m.V.linear = rate * (V_WH.linear + V_WH.angular.cross(m.X.position - X_WH.position));
  return m;
}

GuideBuffer::Motion GuideBuffer::blended(double time, const Motion& followed) const
{
  if (!offset_ || time >= offset_->start + offset_->duration)
    return followed;
  const Offset& o = *offset_;
  const FadeWeights w = fadeOut(time - o.start, o.duration, o.rate_duration);
  const Vector3d r = w.value * o.r + w.slope * o.r_rate, r_rate = w.value_rate * o.r + w.slope_rate * o.r_rate;
  const Eigen::Quaterniond turn = fromRotationVector(r);
  Motion m;
  m.X.position = followed.X.position + w.value * o.p + w.slope * o.p_rate;
  m.V.linear = followed.V.linear + w.value_rate * o.p + w.slope_rate * o.p_rate;
  m.X.orientation = (turn * followed.X.orientation).normalized();
  m.V.angular = rotationRate(r) * r_rate + turn * followed.V.angular;
  return m;
}

void GuideBuffer::blendFrom(double time, const Motion& from, const Motion& to)
{
  const auto differ = [](const Vector3d& a, const Vector3d& b, double scale) { return (a - b).norm() > kSameMotion * (1.0 + scale); };
  const auto rotated = [](const Motion& a, const Motion& b) { return rotationVector(a.X.orientation * b.X.orientation.conjugate()); };
  const Motion expected = blended(time, to);
  // `to` was evaluated kLimitOffset later than `from`, so the two may differ by what passes in that time.
  const double speed = (to.V.linear.norm() + to.V.angular.norm()) * kLimitOffset / kSameMotion;
  if (!differ(from.X.position, expected.X.position, speed) && !differ(rotated(from, expected), Vector3d::Zero(), speed) &&
      (from.V.linear - expected.V.linear).norm() < 1e-4 * (1e-2 + to.V.linear.norm()) &&
      (from.V.angular - expected.V.angular).norm() < 1e-4 * (1e-2 + to.V.angular.norm()))
    return;
  Offset o;
  o.start = time;
  o.p = from.X.position - to.X.position;
  o.p_rate = from.V.linear - to.V.linear;
  o.r = rotated(from, to);
  o.r_rate = rotationRate(o.r).inverse() * (from.V.angular - fromRotationVector(o.r) * to.V.angular);
  o.rate_duration = timing_.overran() ? std::max(options_.catch_up_time, kDryBlend) : options_.catch_up_time;
  o.duration = std::max({o.rate_duration, o.p.norm() / options_.catch_up_speed, o.r.norm() / options_.catch_up_turning});
  offset_ = o;
}

}  // namespace slender
