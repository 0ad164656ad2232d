#include "slender_sim/node/guide_buffer.h"

#include <algorithm>
#include <cmath>
#include <stdexcept>

#include "slender_sim/geometry/rotation.h"

namespace slender {
namespace {

using Eigen::Vector3d;

constexpr double kInstant = 1e-7;       // [s] for limits from the right; shorter than any step
constexpr double kSame = 1e-10;         // [m], [rad], [m/s], [rad/s] round-off of evaluating the same motion twice

}  // namespace

GuideBuffer::GuideBuffer(const Options& options, Attach attach, const Pose& X_WG) : options_(options), attach_(attach)
{
  if (!(options.delay >= 0.0) || !(options.catch_up_time > 0.0) || !(options.catch_up_speed > 0.0) || !(options.catch_up_turning > 0.0))
    throw std::invalid_argument("GuideBuffer: delay must be >= 0, catch-up time and speeds > 0");
  last_.X = X_WG;
}

bool GuideBuffer::push(double time, const Pose& X_WH)
{
  if (trajectory_.empty())
  {
    trajectory_ = PoseTrajectory({time}, {X_WH});
    trajectory_.coast(options_.coast);
  }
  else if (time > trajectory_.lastTime())
    trajectory_.append(time, X_WH);
  else
    return false;
  changed_ = true;
  return true;
}

GraspTarget GuideBuffer::target(double time)
{
  const double query = time - options_.delay;
  if (!following_ && !trajectory_.empty() && query >= trajectory_.firstTime())
  {
    const double begin = trajectory_.firstTime();
    following_ = true;
    X_HG_ = attach_ == Attach::initial ? trajectory_.evaluate(begin).inverse() * last_.X : Pose();
    last_query_ = std::max(begin, last_query_.value_or(begin));
    last_.V = Twist();
    changed_ = true;
  }
  if (!following_)
  {
    last_query_ = query;
    return {last_.X, last_.V};
  }

  const double previous = *last_query_;
  if (changed_)   // does the trajectory still pass where the grasp was led to?
    blendFrom(previous, last_, followed(previous + kInstant));
  changed_ = false;
  last_ = blended(query, followed(query));
  last_query_ = query;
  trajectory_.forgetBefore(query);
  return {last_.X, last_.V};
}

void GuideBuffer::attachAt(const Pose& X_WG)
{
  last_ = {X_WG, Twist()};
  offset_.reset();
  if (!following_)
    return;
  const double now = *last_query_;
  if (attach_ == Attach::initial)
    X_HG_ = trajectory_.evaluate(now).inverse() * X_WG;
  blendFrom(now, last_, followed(now + kInstant));
}

void GuideBuffer::restart(const Pose& X_WG)
{
  trajectory_ = PoseTrajectory();
  following_ = changed_ = false;
  offset_.reset();
  last_ = {X_WG, Twist()};
}

std::optional<double> GuideBuffer::lastTime() const
{
  if (trajectory_.empty())
    return std::nullopt;
  return trajectory_.lastTime();
}

GuideBuffer::Motion GuideBuffer::followed(double query) const
{
  Motion m;
  Twist V_WH;
  const Pose X_WH = trajectory_.evaluate(query, &V_WH);
  m.X = X_WH * X_HG_;
  m.V.angular = V_WH.angular;
  m.V.linear = V_WH.linear + V_WH.angular.cross(m.X.position - X_WH.position);
  return m;
}

GuideBuffer::Motion GuideBuffer::blended(double time, const Motion& followed) const
{
  if (!offset_ || time >= offset_->start + offset_->duration)
    return followed;
  const Offset& o = *offset_;
  // cubic Hermite from (value, rate) at the start to (0, 0) at the end of d; the rate, however long d is, within the shortest blending time:
  // over a long one it would lead far away
  const double d = o.duration, t = options_.catch_up_time, s = std::clamp((time - o.start) / d, 0.0, 1.0), u = std::clamp((time - o.start) / t, 0.0, 1.0);
  const double h0 = (1 + 2 * s) * (1 - s) * (1 - s), h1 = t * u * (1 - u) * (1 - u);
  const double dh0 = 6 * s * (s - 1) / d, dh1 = (1 - u) * (1 - 3 * u);
  const Vector3d r = h0 * o.r + h1 * o.r_rate, r_rate = dh0 * o.r + dh1 * o.r_rate;
  const Eigen::Quaterniond turn = fromRotationVector(r);
  Motion m;
  m.X.position = followed.X.position + h0 * o.p + h1 * o.p_rate;
  m.V.linear = followed.V.linear + dh0 * o.p + dh1 * o.p_rate;
  m.X.orientation = (turn * followed.X.orientation).normalized();
  m.V.angular = rotationRate(r) * r_rate + turn * followed.V.angular;
  return m;
}

void GuideBuffer::blendFrom(double time, const Motion& from, const Motion& to)
{
  const auto differ = [](const Vector3d& a, const Vector3d& b, double scale) { return (a - b).norm() > kSame * (1.0 + scale); };
  const auto rotated = [](const Motion& a, const Motion& b) { return rotationVector(a.X.orientation * b.X.orientation.conjugate()); };
  const Motion expected = blended(time, to);   // `to` was evaluated an instant away: allow for that
  const double speed = (to.V.linear.norm() + to.V.angular.norm()) * kInstant / kSame;
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
  o.duration = std::max({options_.catch_up_time, o.p.norm() / options_.catch_up_speed, o.r.norm() / options_.catch_up_turning});
  offset_ = o;
}

}  // namespace slender
