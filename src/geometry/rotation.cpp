#include "slender_sim/geometry/rotation.h"

namespace slender {

Eigen::Quaterniond rotationBetween(const Eigen::Vector3d& from, const Eigen::Vector3d& to)
{
  const Eigen::Vector3d a = from.normalized(), b = to.normalized(), cross = a.cross(b);
  const double sine = cross.norm(), cosine = a.dot(b);
  if (cosine > -0.5)
    return Eigen::Quaterniond(1.0 + cosine, cross.x(), cross.y(), cross.z()).normalized();
  // 1 + cosine suffers from cancellation near opposite directions, so the axis is used. It must be normal to a to the
  // last digit.
  const Eigen::Vector3d axis = sine > 1e-15 ? (cross / sine - a * a.dot(cross / sine)).normalized() : anyNormal(a);
  const double half = 0.5 * std::atan2(sine, cosine);
  const Eigen::Vector3d v = std::sin(half) * axis;
  return {std::cos(half), v.x(), v.y(), v.z()};
}

}   // namespace slender
