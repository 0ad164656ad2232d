// Solves Newton's equations of a stage, and checks the energy of linearised steps.
#include "cloth_work.h"

namespace slender {

LinearOutcome ClothWork::solveNewton(PointVector& d, bool linearized, StepReport& counts)
{
  if (!averages || !linearized)
    return linear->solve(d, counts.linear_iterations, counts.factorizations);
  return averages->bounded() ? averages->solveBounded(d, averages_, at_bound_, counts.linear_iterations)
                             : averages->solveTo(averages_, d, counts.linear_iterations);
}

/// Implicit Euler is linearised at the start of the stage, where the cloth is balanced. Methods of second order are
/// linearised at the motion carried on, which is near enough to the end that the semidefinite matrix costs no order.
void ClothWork::placeLinearized(PointVector& motion)
{
  const bool ahead = order(options.integrator) == 2;
  for (int i = 0; i < model->vertices(); ++i)
  {
    const Eigen::Vector3d end = system->held()[i] ? Eigen::Vector3d(point(system->start(), i) + point(pin_motion_, i))
                                                  : Eigen::Vector3d(point(guess_, i));
    point(x, i) = ahead ? end : Eigen::Vector3d(point(system->start(), i));
    point(motion, i) = end - point(x, i);
  }
}

/// The strains at this point are those from which viscous forces are counted.
void ClothWork::takeStartEnergy(double energy)
{
  if (order(options.integrator) == 2)
    return;   // known since the substep began
  energy_start_ = energy;
  elastic_start_ = (1.0 + system->viscosity()) * energy;
}

double ClothWork::closeGradient()
{
  const double internal = largestInternal();
  pin_work_ = average_work_ = 0.0;
  for (const int p : work_.pins)
    pin_work_ += system->internalGradient(p).dot(point(x, p) - point(x_start_, p));
  if (!averages)
    return internal;
  average_work_ = workOnFree(system->gradient());
  averages->balanceAverages(average_forces);
  average_work_ -= workOnFree(system->gradient());
  return internal;
}

/// Work [J] of forces on the free vertices, from the start of a step to x.
double ClothWork::workOnFree(const PointVector& forces) const
{
  double work = 0.0;
  for (int i = 0; i < model->vertices(); ++i)
    if (!system->held()[i])
      work += point(forces, i).dot(point(x, i) - point(x_start_, i));
  return work;
}

/// A step of implicit Euler that is solved loses some energy, but for what buckling releases. A linearised one that
/// turns or swings stretched cloth too far for its tangent leaves forces unbalanced, whose work is the energy that
/// appears.
bool ClothWork::createsEnergy(double energy) const
{
  // of what there was: sound steps lose energy, those that blow up create many times that
  constexpr double kCreated = 0.1;
  const bool elastic_alone = order(options.integrator) == 2 && model->stiffness_damping > 0;
  const double strains = 1e-12 * (model->membrane.c11 + model->membrane.c22) *
                         static_cast<double>(model->rest.triangles.cols()) * shortest_edge_ * shortest_edge_;
  const double loads = system->loadWork(x_start_, x);
  double gain = (elastic_alone ? system->elasticEnergy(x) : energy) - energy_start_ - average_work_;
  double given = strains + elastic_start_ + std::abs(average_work_);   // strains of a millionth: of a cloth at rest
  for (int i = 0; i < model->vertices(); ++i)
  {
    if (!system->held()[i])
    {
      const double before = 0.5 * model->mass[i] * work_.v.col(i).squaredNorm();
      gain += 0.5 * model->mass[i] * next_.v.col(i).squaredNorm() - before;
      given += before;
    }
  }
  gain -= loads + pin_work_;
  given += std::abs(loads) + std::abs(pin_work_);
  return gain > kCreated * given;
}

}   // namespace slender
