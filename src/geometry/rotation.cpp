#include "slender_sim/geometry/rotation.h"

namespace slender {

Eigen::Quaterniond rotationBetween(const Eigen::Vector3d& from, const Eigen::Vector3d& to)
{
  const Eigen::Vector3d a = from.normalized(), between = a + to.normalized();
  const double length = between.norm();   // twice the cosine of half the angle
  if (length < 1e-12)
  {
    const Eigen::Vector3d axis = anyNormal(a);
    return {0.0, axis.x(), axis.y(), axis.z()};
  }
  const Eigen::Vector3d middle = between / length, sine = a.cross(middle);
  return Eigen::Quaterniond(a.dot(middle), sine.x(), sine.y(), sine.z()).normalized();
}

}   // namespace slender
