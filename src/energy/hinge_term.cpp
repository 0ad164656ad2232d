#include "slender_sim/energy/hinge_term.h"

#include <cmath>
#include <stdexcept>

namespace slender {

HingeTerm::HingeTerm(const Eigen::Matrix4Xi& hinges, const Eigen::VectorXd& stiffness,
                     const Eigen::VectorXd& rest_angles)
  : hinges_(hinges)
{
  const Eigen::Index n = hinges.cols(), padded = (n + kPack - 1) / kPack * kPack;
  if (stiffness.size() != n || rest_angles.size() != n)
    throw std::invalid_argument("hinges: one stiffness and one rest angle per hinge are needed");
  for (const double k : stiffness)
    if (!(k >= 0) || !std::isfinite(k))
      throw std::invalid_argument("hinges: stiffness [N m] must be zero or more, got " + std::to_string(k));
  if (!rest_angles.allFinite())
    throw std::invalid_argument("hinges: rest angles [rad] must be finite");
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

void HingeTerm::setPattern(const BlockMatrix& matrix)
{
  Eigen::Matrix4Xi padded(4, paddedCount());
  for (int h = 0; h < paddedCount(); ++h)
    padded.col(h) = hinges_.col(std::min(h, count() - 1));
  slots_ = matrix.slots(padded);
}

HingeArrays HingeTerm::arrays() const
{
  HingeArrays a;
  a.count = paddedCount();
  for (int k = 0; k < 4; ++k)
    a.points[k] = points_[k].data();
  a.stiffness = response_stiffness_.data();
  a.rest_angle = response_rest_.data();
  return a;
}

TermSums HingeTerm::addHessian(HessianKind kind, const double* x, double* gradient, double* values, const double*)
{
  if (count() == 0)
    return {};
  const auto& k = hingeKernels();
  const auto add = kind == HessianKind::exact ? k.hessian : k.semidefiniteHessian;
  return {add(arrays(), x, slots_.data(), gradient, values)};
}

/// The elastic response and a viscous one of moment ratio k (theta - viscous angle) are together that of stiffness (1 +
/// ratio) k about the weighted mean of both angles.
void HingeTerm::setResponse(double ratio)
{
  for (std::size_t h = 0; h < stiffness_.size(); ++h)
  {
    // the shorter way round from the rest angle to the other one
    const double away = ratio > 0 ? std::remainder(angles_[h] - rest_angle_[h], 2 * M_PI) : 0.0;
    response_stiffness_[h] = (1.0 + ratio) * stiffness_[h];
    response_rest_[h] = rest_angle_[h] + ratio / (1.0 + ratio) * away;
  }
}

void HingeTerm::addAngles(const PointVector& x, double part)
{
  other_angles_.resize(angles_.size());
  angles(x.data(), other_angles_.data());
  for (std::size_t i = 0; i < angles_.size(); ++i)   // the shorter way round
    angles_[i] += part * std::remainder(other_angles_[i] - start_angles_[i], 2 * M_PI);
}

void HingeTerm::takeStrains(const StrainReference& at)
{
  angles_.resize(stiffness_.size());
  angles(at.x->data(), angles_.data());
  start_angles_ = angles_;
  if (at.share != 0.0)
    addAngles(*at.other, at.share);
  if (at.move)
  {
    addAngles(*at.ahead, 0.5);
    addAngles(*at.behind, -0.5);
  }
}

void HingeTerm::setPlasticState(const PlasticState& state)
{
  for (int h = 0; h < count(); ++h)
    rest_angle_[h] = response_rest_[h] = state.rest_angles[h];
  if (state.stiffening.size() != count())
    return;
  if (unstiffened_.empty())
    unstiffened_ = stiffness_;
  for (int h = 0; h < count(); ++h)
    stiffness_[h] = response_stiffness_[h] = state.stiffening[h] * unstiffened_[h];
}

}   // namespace slender
