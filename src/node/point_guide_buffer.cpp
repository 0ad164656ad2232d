#include "slender_sim/node/point_guide_buffer.h"

#include <stdexcept>

namespace slender {
namespace {

double largest(const Eigen::Matrix3Xd& m) { return m.cols() > 0 ? m.colwise().norm().maxCoeff() : 0.0; }

}   // namespace

PointGuideBuffer::PointGuideBuffer(const GuideBuffer::Options& options, const Eigen::Matrix3Xd& points)
  : GuideStream(options, options.catch_up_time),
    options_(options)
{
  if (!(options.catch_up_time > 0.0) || !(options.catch_up_speed > 0.0))
    throw std::invalid_argument("PointGuideBuffer: catch-up time and speed must be > 0");
  restart(points);
}

void PointGuideBuffer::restart(const Eigen::Matrix3Xd& points)
{
  restartStream();
  x_ = points;
  v_.setZero(3, points.cols());
}

bool PointGuideBuffer::push(double time, const Eigen::Matrix3Xd& points)
{
  if (points.cols() != x_.cols())
    throw std::invalid_argument("guide: " + std::to_string(points.cols()) + " points, but the guide has " +
                                std::to_string(x_.cols()));
  if (!isNew(time))
    return false;
  if (!points.allFinite())   // refused samples must not reach the timing
    throw std::invalid_argument("guide: a position is not finite");
  append(time, points);
  return true;
}

void PointGuideBuffer::join(double) { v_.setZero(); }

void PointGuideBuffer::forgetPlain() { plain_x_.resize(3, 0); }

void PointGuideBuffer::output(double time)
{
  follow(query_, rate_, x_, v_);
  plain_x_ = x_;
  plain_v_ = v_;
  addOffset(time, x_, v_);
}

const Eigen::Matrix3Xd& PointGuideBuffer::target(double time)
{
  advance(time);
  return x_;
}

void PointGuideBuffer::attachAt(const Eigen::Matrix3Xd& points)
{
  x_ = points;
  v_.setZero(3, points.cols());
  endFade();
  forgetPlain();
  if (following_)
    rejoin(*last_time_);
}

void PointGuideBuffer::follow(double query, double rate, Eigen::Matrix3Xd& x, Eigen::Matrix3Xd& v) const
{
  trajectory_.evaluate(query, x, &v);
  v *= rate;
}

void PointGuideBuffer::addOffset(double time, Eigen::Matrix3Xd& x, Eigen::Matrix3Xd& v) const
{
  if (!fades(time))
    return;
  const FadeWeights w = fade(time);
  x += w.value * offset_ + w.slope * offset_rate_;
  v += w.value_rate * offset_ + w.slope_rate * offset_rate_;
}

/// Starts an offset at `time` that leads from x_, v_ to the trajectory, unless the trajectory passes through them.
void PointGuideBuffer::rejoin(double time)
{
  Eigen::Matrix3Xd to, to_rate;
  follow(query_, rate_, to, to_rate);
  if (plain_x_.cols() == to.cols() && to == plain_x_ && to_rate == plain_v_)
    return;   // the trajectory has not changed here
  follow(query_ + kLimitOffset, rate_, to, to_rate);
  // `to` was evaluated kLimitOffset later than x_, so the two may differ by what passes in that time.
  Eigen::Matrix3Xd expected = to, expected_rate = to_rate;
  addOffset(time, expected, expected_rate);
  const double speed = largest(to_rate);
  if (largest(x_ - expected) <= kSameMotion + 2.0 * speed * kLimitOffset &&
      largest(v_ - expected_rate) < 1e-4 * (1e-2 + speed))
    return;
  offset_ = x_ - to;
  offset_rate_ = v_ - to_rate;
  beginFade(time, largest(offset_) / options_.catch_up_speed);
}

}   // namespace slender
