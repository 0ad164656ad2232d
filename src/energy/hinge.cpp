#include "slender_sim/energy/hinge.h"

#include <cmath>
#include <stdexcept>

namespace slender {

HingeBending::HingeBending(const Eigen::Matrix4Xi& hinges, const Eigen::VectorXd& stiffness,
                           const Eigen::VectorXd& rest_angles)
  : hinges_(hinges)
{
  const Eigen::Index n = hinges.cols(), padded = (n + kPack - 1) / kPack * kPack;
  if (stiffness.size() != n || rest_angles.size() != n)
    throw std::invalid_argument("HingeBending: one stiffness and one rest angle per hinge are needed");
  for (Eigen::Index h = 0; h < padded; ++h)
  {
    const Eigen::Index from = std::min(h, n - 1);
    for (int k = 0; k < 4; ++k)
      points_[k].push_back(hinges(k, from));
    stiffness_.push_back(h < n ? stiffness[h] : 0.0);
    rest_angle_.push_back(rest_angles[from]);
  }
  response_stiffness_ = stiffness_;
  response_rest_ = rest_angle_;
}

HingeArrays HingeBending::arrays() const
{
  HingeArrays a;
  a.count = paddedCount();
  for (int k = 0; k < 4; ++k)
    a.points[k] = points_[k].data();
  a.stiffness = response_stiffness_.data();
  a.rest_angle = response_rest_.data();
  return a;
}

void HingeBending::setResponse(double ratio, const double* viscous_angles)
{
  for (std::size_t h = 0; h < stiffness_.size(); ++h)
  {
    // the shorter way round from the rest angle to the other one
    const double away = ratio > 0 ? std::remainder(viscous_angles[h] - rest_angle_[h], 2 * M_PI) : 0.0;
    response_stiffness_[h] = (1.0 + ratio) * stiffness_[h];
    response_rest_[h] = rest_angle_[h] + ratio / (1.0 + ratio) * away;
  }
}

double HingeBending::addHessian(HessianKind kind, const double* x, const std::vector<int>& slots, double* gradient,
                                double* values) const
{
  if (count() == 0)
    return 0.0;
  const auto& k = hingeKernels();
  return (kind == HessianKind::exact ? k.hessian : k.semidefiniteHessian)(arrays(), x, slots.data(), gradient, values);
}

std::vector<int> HingeBending::slotsIn(const BlockMatrix& matrix) const
{
  Eigen::Matrix4Xi padded(4, paddedCount());
  for (Eigen::Index h = 0; h < padded.cols(); ++h)
    for (int k = 0; k < 4; ++k)
      padded(k, h) = points_[k][h];
  return matrix.slots(padded);
}

}   // namespace slender
