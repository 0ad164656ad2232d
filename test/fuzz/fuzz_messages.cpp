// Clouds of points (first byte even) and streams of poses (odd), as nodes take them from messages: taken over or
// refused, and a guide that follows what was taken over stays finite.
#include <cmath>
#include <cstdlib>
#include <stdexcept>

#include <fuzzer/FuzzedDataProvider.h>

#include "slender_sim/node/converters.h"
#include "slender_sim/node/guide_buffer.h"
#include "slender_sim/node/point_guide_buffer.h"

namespace {

constexpr double kFar = 1e6;   // [m] beyond, sums may overflow

sensor_msgs::PointCloud2 cloudOf(FuzzedDataProvider& in)
{
  sensor_msgs::PointCloud2 cloud;
  cloud.height = in.ConsumeIntegral<std::uint32_t>();
  cloud.width = in.ConsumeIntegral<std::uint32_t>();
  cloud.point_step = in.ConsumeIntegral<std::uint32_t>();
  cloud.row_step = in.ConsumeIntegral<std::uint32_t>();
  cloud.is_bigendian = in.ConsumeIntegral<std::uint8_t>();
  cloud.fields.resize(in.ConsumeIntegralInRange(0, 5));
  for (auto& field : cloud.fields)
  {
    field.name = in.PickValueInArray({"x", "y", "z", "", "rgb"});
    field.offset = in.ConsumeIntegral<std::uint32_t>();
    field.datatype = in.ConsumeIntegral<std::uint8_t>();
    field.count = in.ConsumeIntegral<std::uint32_t>();
  }
  cloud.data = in.ConsumeRemainingBytes<std::uint8_t>();
  return cloud;
}

void followPoints(const Eigen::Matrix3Xd& points)
{
  if (points.cols() == 0)
    return;
  slender::PointGuideBuffer guide({}, Eigen::Matrix3Xd::Zero(3, points.cols()));
  try
  {
    guide.push(0.0, points);
  }
  catch (const std::invalid_argument&)   // not finite
  {
    return;
  }
  for (int k = 0; k < 4; ++k)
    if (!guide.target(0.03 * k).allFinite() && points.cwiseAbs().maxCoeff() < kFar)
      std::abort();
}

geometry_msgs::Pose poseOf(FuzzedDataProvider& in)
{
  geometry_msgs::Pose pose;
  for (double* number : {&pose.position.x, &pose.position.y, &pose.position.z, &pose.orientation.x, &pose.orientation.y,
                         &pose.orientation.z})
    *number = in.ConsumeFloatingPoint<double>();
  const double rest = 1.0 - pose.orientation.x * pose.orientation.x - pose.orientation.y * pose.orientation.y -
                      pose.orientation.z * pose.orientation.z;
  pose.orientation.w = rest > 0 && in.ConsumeBool() ? std::sqrt(rest) : in.ConsumeFloatingPoint<double>();
  return pose;
}

void followPoses(FuzzedDataProvider& in)
{
  slender::GuideBuffer::Options options;
  options.coast = in.PickValueInArray({0.0, 0.2});
  slender::GuideBuffer guide(options, in.ConsumeBool() ? slender::Attach::initial : slender::Attach::section, {});
  double now = 0.0;
  while (in.remaining_bytes() > 0)
  {
    slender::Pose X;
    // stamps come in nanoseconds, early, late and twice
    const double stamp = now + 1e-9 * in.ConsumeIntegral<std::int32_t>();
    if (slender::fromMessage(poseOf(in), X) == slender::PoseFault::none && X.position.cwiseAbs().maxCoeff() < kFar)
      guide.push(stamp, X);
    now += 1e-9 * in.ConsumeIntegral<std::uint32_t>();
    const slender::GraspTarget target = guide.target(now);
    const slender::Twist rate = target.velocity.value_or(slender::Twist());
    if (!target.X_WG.position.allFinite() || !target.X_WG.orientation.coeffs().allFinite() ||
        !rate.linear.allFinite() || !rate.angular.allFinite())
      std::abort();
    if (in.ConsumeIntegral<std::uint8_t>() == 0)
      guide.attachAt(target.X_WG);
  }
}

}   // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size)
{
  FuzzedDataProvider in(data, size);
  if (in.ConsumeIntegral<std::uint8_t>() % 2 == 1)
  {
    followPoses(in);
    return 0;
  }
  Eigen::Matrix3Xd points;
  if (slender::fromPoints(cloudOf(in), points).empty())
    followPoints(points);
  return 0;
}
