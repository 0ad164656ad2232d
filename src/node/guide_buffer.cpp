#include "slender_sim/node/guide_buffer.h"

#include <algorithm>
#include <cmath>
#include <stdexcept>

#include "slender_sim/geometry/rotation.h"

namespace slender {

GuideBuffer::GuideBuffer(const Options& options, Attach attach, const Pose& X_WG, const std::optional<Pose>& X_HG)
  : GuideStream(options, options.catch_up_time),
    options_(options),
    attach_(X_HG ? Attach::section : attach),
    X_HG_(X_HG.value_or(Pose()))
{
  if (!(options.catch_up_time > 0.0) || !(options.catch_up_speed > 0.0) || !(options.catch_up_turning > 0.0))
    throw std::invalid_argument("GuideBuffer: catch-up time and speeds must be > 0");
  last_.X = X_WG;
}

bool GuideBuffer::push(double time, const Pose& X_WH)
{
  if (!isNew(time))
    return false;
  append(time, X_WH);
  return true;
}

void GuideBuffer::join(double start)
{
  if (attach_ == Attach::initial && (held_anew_ || !first_X_HG_))
    X_HG_ = trajectory_.evaluate(start).inverse() * last_.X;
  if (attach_ == Attach::initial && !held_anew_)
    first_X_HG_ = X_HG_;
  last_.V = Twist();
}

GraspTarget GuideBuffer::target(double time)
{
  advance(time);
  return {last_.X, last_.V};
}

void GuideBuffer::attachAt(const Pose& X_WG)
{
  held_anew_ = true;
  if (following_ && attach_ == Attach::initial)
    X_HG_ = trajectory_.evaluate(query_).inverse() * X_WG;
  catchUpFrom(X_WG);
}

void GuideBuffer::catchUpFrom(const Pose& X_WG) { standAt({X_WG, Twist()}); }

void GuideBuffer::restart(const Pose& X_WG)
{
  restartStream();
  held_anew_ = false;
  if (attach_ == Attach::initial)
    X_HG_ = first_X_HG_.value_or(Pose());
  last_ = {X_WG, Twist()};
}

void GuideBuffer::follow(double query, double rate, GraspMotion& motion) const
{
  Twist V_WH;
  const Pose X_WH = trajectory_.evaluate(query, &V_WH);
  motion.X = X_WH * X_HG_;
  motion.V.angular = rate * V_WH.angular;
  motion.V.linear = rate * (V_WH.linear + V_WH.angular.cross(motion.X.position - X_WH.position));
}

void GuideBuffer::addOffset(double time, GraspMotion& motion) const
{
  const Offset& o = offset_;
  const FadeWeights w = fade(time);
  const Eigen::Vector3d r = w.value * o.r + w.slope * o.r_rate, r_rate = w.value_rate * o.r + w.slope_rate * o.r_rate;
  const Eigen::Quaterniond turn = fromRotationVector(r);
  motion.X.position = motion.X.position + w.value * o.p + w.slope * o.p_rate;
  motion.V.linear = motion.V.linear + w.value_rate * o.p + w.slope_rate * o.p_rate;
  motion.X.orientation = (turn * motion.X.orientation).normalized();
  motion.V.angular = rotationRate(r) * r_rate + turn * motion.V.angular;
}

void GuideBuffer::blend(double time, const GraspMotion& from, const GraspMotion& to)
{
  const auto differ = [](const Eigen::Vector3d& a, const Eigen::Vector3d& b, double scale) {
    return (a - b).norm() > kSameMotion * (1.0 + scale);
  };
  const auto rotated = [](const GraspMotion& a, const GraspMotion& b) {
    return rotationVector(a.X.orientation * b.X.orientation.conjugate());
  };
  GraspMotion expected = to;
  fadeIn(time, expected);
  const double speed = (to.V.linear.norm() + to.V.angular.norm()) * kLimitOffset / kSameMotion;
  if (!differ(from.X.position, expected.X.position, speed) &&
      !differ(rotated(from, expected), Eigen::Vector3d::Zero(), speed) &&
      (from.V.linear - expected.V.linear).norm() < 1e-4 * (1e-2 + to.V.linear.norm()) &&
      (from.V.angular - expected.V.angular).norm() < 1e-4 * (1e-2 + to.V.angular.norm()))
    return;
  Offset& o = offset_;
  o.p = from.X.position - to.X.position;
  o.p_rate = from.V.linear - to.V.linear;
  o.r = rotated(from, to);
  o.r_rate = rotationRate(o.r).inverse() * (from.V.angular - fromRotationVector(o.r) * to.V.angular);
  beginFade(time, std::max(o.p.norm() / options_.catch_up_speed, o.r.norm() / options_.catch_up_turning));
}

}   // namespace slender
