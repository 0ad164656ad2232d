#include "slender_sim/node/point_guide_buffer.h"

#include <algorithm>
#include <stdexcept>

namespace slender {
namespace {

constexpr double kInstant = 1e-7;   // [s] for limits from the right; shorter than any step
constexpr double kSame = 1e-10;     // [m] round-off of evaluating the same motion twice

double largest(const Eigen::Matrix3Xd& m) { return m.cols() > 0 ? m.colwise().norm().maxCoeff() : 0.0; }

}  // namespace

PointGuideBuffer::PointGuideBuffer(const GuideBuffer::Options& options, const Eigen::Matrix3Xd& points) : options_(options)
{
  if (!(options.delay >= 0.0) || !(options.catch_up_time > 0.0) || !(options.catch_up_speed > 0.0) || !(options.coast >= 0.0))
    throw std::invalid_argument("PointGuideBuffer: delay and coast must be >= 0, catch-up time and speed > 0");
  restart(points);
}

void PointGuideBuffer::restart(const Eigen::Matrix3Xd& points)
{
  trajectory_ = PointTrajectory();
  trajectory_.coast(options_.coast);
  following_ = changed_ = false;
  offset_duration_ = 0.0;
  x_ = points;
  v_.setZero(3, points.cols());
}

bool PointGuideBuffer::push(double time, const Eigen::Matrix3Xd& points)
{
  if (points.cols() != x_.cols())
    throw std::invalid_argument("guide: " + std::to_string(points.cols()) + " points, but the guide has " + std::to_string(x_.cols()));
  if (!trajectory_.empty() && !(time > trajectory_.times().back()))
    return false;
  trajectory_.append(time, points);
  changed_ = true;
  return true;
}

const Eigen::Matrix3Xd& PointGuideBuffer::target(double time)
{
  const double query = time - options_.delay;
  if (!following_ && !trajectory_.empty() && query >= trajectory_.times().front())
  {
    const double begin = trajectory_.times().front();
    following_ = changed_ = true;
    last_query_ = std::max(begin, last_query_.value_or(begin));
    v_.setZero();
  }
  if (following_)
  {
    if (changed_)   // do the points still pass where the guide was led to?
      blendFrom(*last_query_);
    changed_ = false;
    follow(query, x_, v_);
    addOffset(query, x_, v_);
    trajectory_.forgetBefore(query);
  }
  last_query_ = query;
  return x_;
}

void PointGuideBuffer::attachAt(const Eigen::Matrix3Xd& points)
{
  x_ = points;
  v_.setZero(3, points.cols());
  offset_duration_ = 0.0;
  if (following_)
    blendFrom(*last_query_);
}

std::optional<double> PointGuideBuffer::lastTime() const
{
  if (trajectory_.empty())
    return std::nullopt;
  return trajectory_.times().back();
}

void PointGuideBuffer::follow(double query, Eigen::Matrix3Xd& x, Eigen::Matrix3Xd& v) const { trajectory_.evaluate(query, x, &v); }

void PointGuideBuffer::addOffset(double time, Eigen::Matrix3Xd& x, Eigen::Matrix3Xd& v) const
{
  const double d = offset_duration_;
  if (!(d > 0.0) || time >= offset_start_ + d)
    return;
  // cubic Hermite from (value, rate) at the start to (0, 0) at the end of d; the rate, however long d is, within the shortest blending time:
  // over a long one it would lead far away
  const double t = options_.catch_up_time, s = std::clamp((time - offset_start_) / d, 0.0, 1.0), u = std::clamp((time - offset_start_) / t, 0.0, 1.0);
  const double h0 = (1 + 2 * s) * (1 - s) * (1 - s), h1 = t * u * (1 - u) * (1 - u);
  const double dh0 = 6 * s * (s - 1) / d, dh1 = (1 - u) * (1 - 3 * u);
  x += h0 * offset_ + h1 * offset_rate_;
  v += dh0 * offset_ + dh1 * offset_rate_;
}

/// From x_, v_ at `time` to what the trajectory now says.
void PointGuideBuffer::blendFrom(double time)
{
  Eigen::Matrix3Xd to, to_rate;
  follow(time + kInstant, to, to_rate);
  Eigen::Matrix3Xd expected = to, expected_rate = to_rate;   // an instant away: allow for that
  addOffset(time, expected, expected_rate);
  const double speed = largest(to_rate);
  if (largest(x_ - expected) <= kSame + 2.0 * speed * kInstant && largest(v_ - expected_rate) < 1e-4 * (1e-2 + speed))
    return;
  offset_ = x_ - to;
  offset_rate_ = v_ - to_rate;
  offset_start_ = time;
  offset_duration_ = std::max(options_.catch_up_time, largest(offset_) / options_.catch_up_speed);
}

}  // namespace slender
