#include "free_rotation.h"

#include <algorithm>
#include <cmath>

#include <Eigen/LU>

#include "slender_sim/geometry/rotation.h"

namespace slender {

namespace {

/// Solves inertia turn = h (l + exp(-turn) l) / 2 by Newton's method, where l is the momentum at the start, in body
/// axes. The change of l is normal to this turn, as with the midpoint rule, so l . inertia^-1 l stays.
Eigen::Vector3d midpointTurn(const Eigen::Matrix3d& inertia, const Eigen::Vector3d& l, double h)
{
  constexpr int kMostIterations = 12;
  constexpr double kRoundOff = 2e-15;
  Eigen::Vector3d turn = h * (inertia.inverse() * l);
  for (int k = 0; k < kMostIterations; ++k)
  {
    const Eigen::Vector3d end = fromRotationVector(turn).conjugate() * l;
    const Eigen::Vector3d defect = 0.5 * h * (l + end) - inertia * turn;
    if (defect.norm() <= kRoundOff * h * l.norm())
      break;
    const Eigen::Matrix3d slope = inertia - 0.5 * h * skew(end) * rotationRate(-turn);
    turn += slope.partialPivLu().solve(defect);
  }
  return turn;
}

}   // namespace

Eigen::Vector3d angularVelocity(const Eigen::Matrix3d& inertia, const Eigen::Quaterniond& q,
                                const Eigen::Vector3d& momentum)
{
  return q * (inertia.inverse() * (q.conjugate() * momentum));
}

Eigen::Quaterniond rotateFreely(const Eigen::Matrix3d& inertia, const Eigen::Quaterniond& q,
                                const Eigen::Vector3d& momentum, double h)
{
  // Newton's method converges if a part of the time turns the body by less than 1.5 rad, or a needle by 1 rad.
  constexpr double kMostTurn = 0.5;
  constexpr double kMostParts = 1e5;   // This limits the cost; faster bodies turn thousands of times in a step.
  const double parts = std::ceil(h * angularVelocity(inertia, q, momentum).norm() / kMostTurn);
  const int count = std::isfinite(parts) ? static_cast<int>(std::clamp(parts, 1.0, kMostParts)) : 1;
  Eigen::Quaterniond end = q;
  for (int i = 0; i < count; ++i)
  {
    const Eigen::Vector3d turn = midpointTurn(inertia, end.conjugate() * momentum, h / count);
    end = (end * fromRotationVector(turn)).normalized();
  }
  return end;
}

}   // namespace slender
