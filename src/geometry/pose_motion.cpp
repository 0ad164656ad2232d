#include "slender_sim/geometry/pose_motion.h"

#include "slender_sim/geometry/rotation.h"

namespace slender {

Pose poseBetween(const Pose& start, const Twist& v0, const GraspTarget& target, double duration, double s,
                 Twist* velocity)
{
  const Eigen::Vector3d move = target.X_WG.position - start.position;
  const Eigen::Vector3d turn =
      start.orientation * rotationVector(start.orientation.conjugate() * target.X_WG.orientation);
  const bool smooth = target.velocity.has_value();
  // cubic Hermite blend of displacement and end velocities; with neither the motion is uniform
  const double h01 = smooth ? s * s * (3 - 2 * s) : s, d01 = smooth ? 6 * s * (1 - s) : 1.0;
  const double h10 = smooth ? s * (1 - s) * (1 - s) : 0.0, d10 = smooth ? (1 - s) * (1 - 3 * s) : 0.0;
  const double h11 = smooth ? s * s * (s - 1) : 0.0, d11 = smooth ? s * (3 * s - 2) : 0.0;
  const Twist v1 = smooth ? *target.velocity : Twist{};
  if (velocity)
  {
    velocity->linear = (d01 * move) / duration + d10 * v0.linear + d11 * v1.linear;
    velocity->angular = (d01 * turn) / duration + d10 * v0.angular + d11 * v1.angular;
  }
  if (s >= 1.0)
    return {target.X_WG.position, target.X_WG.orientation.normalized()};
  const Eigen::Vector3d phi = h01 * turn + duration * (h10 * v0.angular + h11 * v1.angular);
  return {start.position + h01 * move + duration * (h10 * v0.linear + h11 * v1.linear),
          (fromRotationVector(phi) * start.orientation).normalized()};
}

}   // namespace slender
