// Steps without Newton's method: explicit ones, and those whose matrix is constant.
#include <algorithm>
#include <cmath>
#include <limits>

#include "cloth_work.h"

namespace slender {

namespace {

/// Length of the longest of n vectors.
double largest(int n, const PointVector& d)
{
  double square = 0.0;
  for (int i = 0; i < n; ++i)
    square = std::max(square, point(d, i).squaredNorm());
  return std::sqrt(square);
}

}   // namespace

/// The matrix of imex steps, with the bending of the system.
void ClothWork::useConstantMatrix()
{
  if (options.integrator != Integrator::imex)
    return;
  const PointMatrix* matrix = system->constantMatrix();
  constant_ = std::make_unique<ShiftedMatrix>(matrix ? *matrix : PointMatrix(model->vertices(), {}));
  constant_weight_.assign(model->vertices(), 0.0);
  constant_h_ = 0.0;   // The matrix is not factored yet.
}

/// h^2 w^2 + 2 b h w^2 < 4 with viscous forces from the strains one step ago, b the damping by stiffness.
double ClothWork::stableStep() const
{
  constexpr int kIterations = 60;
  if (!isExplicit())
    return std::numeric_limits<double>::infinity();
  const int n = model->vertices();
  const bool with_constant = options.integrator == Integrator::symplectic_euler;
  PointVector rest, away(4 * n), up(4 * n), down(4 * n);
  toPoints(model->rest.vertices, rest);
  ClothState at_rest = makeClothState(*model, model->rest.vertices);
  system->usePlasticState(at_rest);
  system->setViscosity(0.0, rest);
  const double small = 1e-4 * shortest_edge_;
  PointVector mode(4 * n, 0.0);
  for (int i = 0; i < n; ++i)   // anything that is not orthogonal to the stiffest
    point(mode, i) << std::sin(12.9898 * i), std::sin(78.233 * i + 1.0), std::sin(37.719 * i + 2.0);
  double square = 0.0;
  for (int k = 0; k < kIterations; ++k)
  {
    const double scale = small / std::max(largest(n, mode), 1e-300);
    for (std::size_t i = 0; i < mode.size(); ++i)
    {
      mode[i] *= scale;
      away[i] = rest[i] + mode[i];
    }
    std::fill(up.begin(), up.end(), 0.0);
    system->addInternal(away, up, with_constant);
    for (std::size_t i = 0; i < mode.size(); ++i)
      away[i] = rest[i] - mode[i];
    std::fill(down.begin(), down.end(), 0.0);
    system->addInternal(away, down, with_constant);
    double work = 0.0, inertia = 0.0;   // Rayleigh's quotient
    for (int i = 0; i < n; ++i)
    {
      const Eigen::Vector3d force = 0.5 * (point(up, i) - point(down, i));
      work += point(mode, i).dot(force);
      inertia += model->mass[i] * point(mode, i).squaredNorm();
      point(mode, i) = force / model->mass[i];
    }
    square = std::max(square, work / inertia);
  }
  const double b = model->stiffness_damping;
  return 4.0 / square / (b + std::sqrt(b * b + 4.0 / square));
}

StepFailure ClothWork::stepExplicitly(const Substep& substep, StepReport& report)
{
  if (workExceeded())
    return StepFailure::work_exceeded;
  const double h = substep.length, end = substep.to / duration_;
  toPoints(work_.x, x);
  toPoints(work_.v, v_);
  next_ = work_;
  system->hold(work_);
  if (model->stiffness_damping > 0)   // viscous forces from the strains one step ago
  {
    for (std::size_t i = 0; i < x.size(); ++i)
      trial_[i] = x[i] - h * v_[i];
    system->setViscosity(model->stiffness_damping / h, trial_);
  }
  const ClothEvaluation here = addForces(!constant_);
  pin_forces.resize(3, static_cast<Eigen::Index>(work_.pins.size()));
  if (!constant_)
    moveByMasses(h, end);
  else if (!moveByMatrix(h, end, report))
    return StepFailure::singular_matrix;
  report.max_strain = std::max(report.max_strain, here.max_strain);
  const bool slow = next_.v.cwiseAbs().maxCoeff() < 1e8;
  return std::isfinite(here.energy()) && next_.x.allFinite() && slow ? StepFailure::none
                                                                     : StepFailure::state_not_finite;
}

/// Symplectic Euler: velocities by the forces at the start, then positions. Pins are at this fraction of the step.
void ClothWork::moveByMasses(double h, double fraction)
{
  const int n = model->vertices();
  for (int i = 0; i < n; ++i)
  {
    point(force_, i) -= model->mass[i] * model->mass_damping * point(v_, i);
    point(v_, i) += h / model->mass[i] * point(force_, i);
  }
  for (std::size_t k = 0; k < work_.pins.size(); ++k)
  {
    const int p = work_.pins[k];
    const Eigen::Vector3d v = (pinAt(k, fraction) - work_.x.col(p)) / h;
    pin_forces.col(static_cast<Eigen::Index>(k)) = point(force_, p) - model->mass[p] * (v - work_.v.col(p)) / h;
    point(v_, p) = v;
  }
  for (int i = 0; i < n; ++i)
  {
    next_.v.col(i) = point(v_, i);
    next_.x.col(i) += h * point(v_, i);
  }
}

/// (M (1/h^2 + a/h) + (1 + b/h) K) d = M v/h + f - K x for the motion d of the step, with a and b of the damping, K of
/// the bending, and f the membrane's forces (elastic and viscous) and the wind at the start, and the loads. Returns
/// false if the matrix is singular.
bool ClothWork::moveByMatrix(double h, double fraction, StepReport& report)
{
  const int n = model->vertices();
  if (h != constant_h_ || system->held() != constant_held_)
  {
    for (int i = 0; i < n; ++i)
      constant_weight_[i] = model->mass[i] * (1.0 / (h * h) + model->mass_damping / h);
    constant_h_ = 0.0;
    ++report.factorizations;
    if (!constant_->factor(constant_weight_, 1.0 + model->stiffness_damping / h, system->held()))
      return false;
    constant_h_ = h;
    constant_held_ = system->held();
  }
  std::fill(trial_.begin(), trial_.end(), 0.0);
  if (const PointMatrix* constant = system->constantMatrix())
    constant->addProduct(-1.0, x.data(), trial_.data());
  std::fill(d_.begin(), d_.end(), 0.0);
  for (int i = 0; i < n; ++i)
    point(force_, i) += point(trial_, i) + model->mass[i] / h * point(v_, i);
  for (std::size_t k = 0; k < work_.pins.size(); ++k)
    point(d_, work_.pins[k]) = pinAt(k, fraction) - work_.x.col(work_.pins[k]);
  // what is held moves as given
  std::fill(trial_.begin(), trial_.end(), 0.0);
  constant_->addProduct(d_.data(), trial_.data());
  for (int i = 0; i < n; ++i)
    point(trial_, i) =
        system->held()[i] ? Eigen::Vector3d(point(d_, i)) : Eigen::Vector3d(point(force_, i) - point(trial_, i));
  constant_->solve(trial_, d_);
  std::fill(trial_.begin(), trial_.end(), 0.0);
  constant_->addProduct(d_.data(), trial_.data());
  for (int i = 0; i < n; ++i)
  {
    next_.v.col(i) = point(d_, i) / h;
    next_.x.col(i) += point(d_, i);
  }
  for (std::size_t k = 0; k < work_.pins.size(); ++k)
  {
    const int p = work_.pins[k];
    pin_forces.col(static_cast<Eigen::Index>(k)) = point(force_, p) - point(trial_, p);
    next_.x.col(p) = pinAt(k, fraction);
  }
  return true;
}

}   // namespace slender
