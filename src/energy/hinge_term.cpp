#include "slender_sim/energy/hinge_term.h"

#include <cmath>
#include <stdexcept>

namespace slender {

HingeTerm::HingeTerm(const Eigen::Matrix4Xi& hinges, const Eigen::VectorXd& stiffness,
                     const Eigen::VectorXd& rest_angles)
  : energy_(hinges, stiffness, rest_angles)
{
  for (const double k : stiffness)
    if (!(k >= 0) || !std::isfinite(k))
      throw std::invalid_argument("hinges: stiffness [N m] must be zero or more, got " + std::to_string(k));
  if (!rest_angles.allFinite())
    throw std::invalid_argument("hinges: rest angles [rad] must be finite");
}

void HingeTerm::addAngles(const PointVector& x, double part)
{
  other_angles_.resize(angles_.size());
  energy_.angles(x.data(), other_angles_.data());
  for (std::size_t i = 0; i < angles_.size(); ++i)   // the shorter way round
    angles_[i] += part * std::remainder(other_angles_[i] - start_angles_[i], 2 * M_PI);
}

void HingeTerm::takeStrains(const StrainReference& at)
{
  angles_.resize(static_cast<std::size_t>(energy_.paddedCount()));
  energy_.angles(at.x->data(), angles_.data());
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
  const int n = energy_.count();
  for (int h = 0; h < n; ++h)
    energy_.setRestAngle(h, state.rest_angles[h]);
  if (state.stiffening.size() != n)
    return;
  if (unstiffened_.size() == 0)
  {
    unstiffened_.resize(n);
    for (int h = 0; h < n; ++h)
      unstiffened_[h] = energy_.stiffness(h);
  }
  for (int h = 0; h < n; ++h)
    energy_.setStiffness(h, state.stiffening[h] * unstiffened_[h]);
}

}   // namespace slender
