// What additional forces do at the end of a step.
#include <algorithm>

#include "cloth_stepper_impl.h"

namespace slender {

/// With the stiffness of the last stage.
bool ClothStepper::Impl::respond(const Eigen::Matrix3Xd& forces, double duration, Eigen::Matrix3Xd& displacement,
                                 Eigen::Matrix3Xd& pin_forces_change, Eigen::Matrix3Xd& average_forces_change)
{
  if (isExplicit())   // whose forces do not know the end of the step
  {
    for (int i = 0; i < model->vertices(); ++i)
      displacement.col(i) = duration * duration / model->mass[i] * forces.col(i);
    for (const int p : work_.pins)
      displacement.col(p).setZero();
    pin_forces_change.setZero(3, pin_forces.cols());
    average_forces_change.setZero(3, average_forces.cols());
    return true;
  }
  long iterations = 0, factorizations = 0;
  // what it leaves unbalanced the grasps' wrenches lack: below a thousandth of the load
  constexpr double kTolerance = 5e-4;
  const auto solve = [&] {
    system->setInertia(duration);
    for (int i = 0; i < model->vertices(); ++i)
      point(system->gradient(), i) = -forces.col(i);
    std::fill(d_.begin(), d_.end(), 0.0);
    return linear->solve(d_, iterations, factorizations, kTolerance) == LinearOutcome::solved;
  };
  if (!solve())   // the inertia of a longer step does not hold up what a short stage's does
  {
    system->evaluateHessian(x, HessianKind::semidefinite);
    if (!solve())
      return false;
  }
  for (int i = 0; i < model->vertices(); ++i)
    displacement.col(i) = point(d_, i);
  pin_forces_change.resize(3, pin_forces.cols());
  average_forces_change.resize(3, averages ? averages->count() : 0);
  if (pin_forces.cols() == 0 && !averages)
    return true;
  system->applyMatrix(d_, trial_);
  for (std::size_t i = 0; i < trial_.size(); ++i)
    system->gradient()[i] += trial_[i];
  if (averages)
    averages->balanceAverages(average_forces_change, true);
  Eigen::Index pin = 0;
  for (int i = 0; i < model->vertices(); ++i)
    if (system->held()[i])
      pin_forces_change.col(pin++) = -point(system->gradient(), i);
  return true;
}

double ClothStepper::Impl::inertia(int vertex, double h) const
{
  double air = 0.0;   // Loads of explicit steps have no stiffness.
  if (!averages)      // With averages, the factored matrix has to serve many steps. So it lacks the air.
    for (const auto& load : system->loads())
      air += h * h * load->stiffness(vertex).norm();
  const double damping = options.integrator == Integrator::symplectic_euler ? 0.0 : h * model->mass_damping;
  return (1.0 + damping) * model->mass[vertex] + air;
}

}   // namespace slender
