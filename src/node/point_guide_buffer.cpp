#include "slender_sim/node/point_guide_buffer.h"

#include <algorithm>
#include <stdexcept>

namespace slender {
namespace {

constexpr double kInstant = 1e-7;   // [s] for limits from the right; shorter than any step
constexpr double kOpenCoast = 0.5;  // [s], and the next: see guide_buffer.cpp
constexpr double kGentle = 0.3;
constexpr double kSame = 1e-10;     // [m] round-off of evaluating the same motion twice

double largest(const Eigen::Matrix3Xd& m) { return m.cols() > 0 ? m.colwise().norm().maxCoeff() : 0.0; }

}  // namespace

PointGuideBuffer::PointGuideBuffer(const GuideBuffer::Options& options, const Eigen::Matrix3Xd& points) : options_(options), timing_(options.timing())
{
  if (!(options.catch_up_time > 0.0) || !(options.catch_up_speed > 0.0))
    throw std::invalid_argument("PointGuideBuffer: catch-up time and speed must be > 0");
  restart(points);
}

void PointGuideBuffer::restart(const Eigen::Matrix3Xd& points)
{
  timing_.restart();
  trajectory_ = PointTrajectory();
  trajectory_.coast(options_.coast);
  next_.reset();
  last_stamp_.reset();
  following_ = changed_ = open_ = false;
  offset_duration_ = 0.0;
  x_ = points;
  v_.setZero(3, points.cols());
}

bool PointGuideBuffer::push(double time, const Eigen::Matrix3Xd& points)
{
  if (points.cols() != x_.cols())
    throw std::invalid_argument("guide: " + std::to_string(points.cols()) + " points, but the guide has " + std::to_string(x_.cols()));
  if (last_stamp_ && !(time > *last_stamp_))
    return false;
  if (!points.allFinite())   // before the timing hears of it
    throw std::invalid_argument("guide: a position is not finite");
  const bool fresh = timing_.sample(time);
  if (fresh && !trajectory_.empty())
    next_ = PointTrajectory();
  (next_ ? *next_ : trajectory_).append(time, points);
  last_stamp_ = time;
  changed_ = true;
  return true;
}

/// The stream takes effect: the first one, or one after a pause.
void PointGuideBuffer::begin(double time, const GuideTiming::Instant& now)
{
  if (next_)
    trajectory_ = std::move(*next_);
  next_.reset();
  trajectory_.coast(options_.coast);
  open_ = false;
  if (!following_)
    v_.setZero();
  following_ = changed_ = true;
  query_ = trajectory_.times().front();
  plain_x_.resize(3, 0);
  last_time_ = now.rate > 0.0 ? time - (now.time - query_) : time;
  rate_ = now.rate;
}

const Eigen::Matrix3Xd& PointGuideBuffer::target(double time)
{
  GuideTiming::Instant now = timing_.advance(time);
  if (now.began)
    begin(time, now);
  else if (!now.following && following_)   // the stream before goes on until the next one takes effect
    now.time = query_ + rate_ * (time - *last_time_);
  if (now.jumped)
  {
    query_ = now.time;
    rate_ = now.rate;
    plain_x_.resize(3, 0);
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
    if (changed_)   // do the points still pass where the guide was led to?
      blendFrom(*last_time_);
    changed_ = false;
    query_ = now.time;
    rate_ = now.rate;
    follow(query_, rate_, x_, v_);
    plain_x_ = x_;
    plain_v_ = v_;
    addOffset(time, x_, v_);
    trajectory_.forgetBefore(query_);
  }
  last_time_ = time;
  return x_;
}

void PointGuideBuffer::attachAt(const Eigen::Matrix3Xd& points)
{
  x_ = points;
  v_.setZero(3, points.cols());
  offset_duration_ = 0.0;
  plain_x_.resize(3, 0);
  if (following_)
    blendFrom(*last_time_);
}

void PointGuideBuffer::skip(double seconds)
{
  timing_.skip(seconds);
  query_ += seconds;
  plain_x_.resize(3, 0);
  offset_start_ += seconds;
  if (last_time_)
    *last_time_ += seconds;
  changed_ = true;
}

void PointGuideBuffer::follow(double query, double rate, Eigen::Matrix3Xd& x, Eigen::Matrix3Xd& v) const
{
  trajectory_.evaluate(query, x, &v);
  v *= rate;
}

void PointGuideBuffer::addOffset(double time, Eigen::Matrix3Xd& x, Eigen::Matrix3Xd& v) const
{
  const double d = offset_duration_;
  if (!(d > 0.0) || time >= offset_start_ + d)
    return;
  // cubic Hermite from (value, rate) at the start to (0, 0) at the end of d; the rate, however long d is, within the shortest blending time:
  // over a long one it would lead far away
  const double t = offset_rate_duration_, s = std::clamp((time - offset_start_) / d, 0.0, 1.0), u = std::clamp((time - offset_start_) / t, 0.0, 1.0);
  const double h0 = (1 + 2 * s) * (1 - s) * (1 - s), h1 = t * u * (1 - u) * (1 - u);
  const double dh0 = 6 * s * (s - 1) / d, dh1 = (1 - u) * (1 - 3 * u);
  x += h0 * offset_ + h1 * offset_rate_;
  v += dh0 * offset_ + dh1 * offset_rate_;
}

/// From x_, v_ at `time` to what the trajectory now says.
void PointGuideBuffer::blendFrom(double time)
{
  Eigen::Matrix3Xd to, to_rate;
  follow(query_, rate_, to, to_rate);
  if (plain_x_.cols() == to.cols() && to == plain_x_ && to_rate == plain_v_)
    return;   // to the last bit what it was
  follow(query_ + kInstant, rate_, to, to_rate);
  Eigen::Matrix3Xd expected = to, expected_rate = to_rate;   // an instant away: allow for that
  addOffset(time, expected, expected_rate);
  const double speed = largest(to_rate);
  if (largest(x_ - expected) <= kSame + 2.0 * speed * kInstant && largest(v_ - expected_rate) < 1e-4 * (1e-2 + speed))
    return;
  offset_ = x_ - to;
  offset_rate_ = v_ - to_rate;
  offset_start_ = time;
  offset_rate_duration_ = timing_.overran() ? std::max(options_.catch_up_time, kGentle) : options_.catch_up_time;
  offset_duration_ = std::max(offset_rate_duration_, largest(offset_) / options_.catch_up_speed);
}

}  // namespace slender
