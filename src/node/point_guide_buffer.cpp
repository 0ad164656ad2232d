#include "slender_sim/node/point_guide_buffer.h"

#include <stdexcept>

namespace slender {
namespace {

double largest(const Eigen::Matrix3Xd& m) { return m.cols() > 0 ? m.colwise().norm().maxCoeff() : 0.0; }

PointMotion standing(const Eigen::Matrix3Xd& points) { return {points, Eigen::Matrix3Xd::Zero(3, points.cols())}; }

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
  last_ = standing(points);
}

bool PointGuideBuffer::push(double time, const Eigen::Matrix3Xd& points)
{
  if (points.cols() != last_.x.cols())
    throw std::invalid_argument("guide: " + std::to_string(points.cols()) + " points, but the guide has " +
                                std::to_string(last_.x.cols()));
  if (!isNew(time))
    return false;
  if (!points.allFinite())   // refused samples must not reach the timing
    throw std::invalid_argument("guide: a position is not finite");
  append(time, points);
  return true;
}

void PointGuideBuffer::join(double) { last_.v.setZero(); }

const Eigen::Matrix3Xd& PointGuideBuffer::target(double time)
{
  advance(time);
  return last_.x;
}

void PointGuideBuffer::attachAt(const Eigen::Matrix3Xd& points) { standAt(standing(points)); }

void PointGuideBuffer::follow(double query, double rate, PointMotion& motion) const
{
  trajectory_.evaluate(query, motion.x, &motion.v);
  motion.v *= rate;
}

void PointGuideBuffer::addOffset(double time, PointMotion& motion) const
{
  const FadeWeights w = fade(time);
  motion.x += w.value * offset_.x + w.slope * offset_.v;
  motion.v += w.value_rate * offset_.x + w.slope_rate * offset_.v;
}

void PointGuideBuffer::blend(double time, const PointMotion& from, const PointMotion& to)
{
  PointMotion expected = to;
  fadeIn(time, expected);
  const double speed = largest(to.v);
  if (largest(from.x - expected.x) <= kSameMotion + 2.0 * speed * kLimitOffset &&
      largest(from.v - expected.v) < 1e-4 * (1e-2 + speed))
    return;
  offset_ = {from.x - to.x, from.v - to.v};
  beginFade(time, largest(offset_.x) / options_.catch_up_speed);
}

}   // namespace slender
