// Static equilibrium by continuation: the grasps are carried to their targets in small moves, and at each the energy is
// minimised with a proximal term 1/2 w |x - x_k|^2 whose weight falls to zero as the iteration settles. Only minima of the energy
// attract it, so the equilibrium found is a stable one.
#include <algorithm>
#include <cmath>

#include "rod_stepper_impl.h"
#include "slender_sim/geometry/rotation.h"

namespace slender {

StepReport RodStepper::Impl::solveEquilibrium(RodState& state, const RodInputs& inputs)
{
  StepReport report;
  std::string what;
  if (!inputsFinite(state, inputs, what))
    return refuse(report, StepFailure::input_not_finite, what + " is not finite or not valid; correct this input");
  resizeFor(state);
  const int n = model->nodes();
  work = state;
  work.forgetHistory();
  work.v.setZero();
  for (GraspState& g : work.grasps)
    g.velocity = Twist{};
  const std::vector<GraspState> start = work.grasps;
  origin = &start;

  const double length = model->rest_length.sum();
  double move = 0.0;
  for (std::size_t k = 0; k < start.size(); ++k)
    if (start[k].active)
    {
      const Pose& a = start[k].X_WG;
      const Pose& b = inputs.grasps[k].X_WG;
      move = std::max({move, (b.position - a.position).norm() / (0.02 * length), rotationVector(a.orientation.conjugate() * b.orientation).norm() / 0.2});
    }
  RodInputs targets = inputs;
  for (GraspTarget& g : targets.grasps)
    g.velocity.reset();

  // scale of the proximal weight: the stiffness of the whole rod against bending, or against its weight if that is larger
  const double bend = std::max(model->bend_modulus.row(0).maxCoeff(), model->bend_modulus.row(2).maxCoeff());
  const double spring = bend / std::pow(length, 3);
  double load_total = 0.0;
  for (int i = 0; i < n; ++i)
    load_total += load(inputs, i).norm();
  const double base_weight = std::max(spring, load_total / length) * 100.0 / n;

  NewtonConfig newton = time.newton;
  newton.tolerance = std::min(time.newton.tolerance, 1e-8);
  newton.max_iterations = std::max(60, time.newton.max_iterations);
  double done = move > 0 ? 0.0 : 1.0, advance = move > 1 ? 1.0 / move : 1.0;
  double relative = 1.0;   // proximal weight over base_weight
  int failures = 0, nudges = 0;
  RodState saddle;
  system.load(work);
  system.setResponse(0.0, nullptr);
  constexpr int kMaxRounds = 3000;
  for (int round = 0; round < kMaxRounds; ++round)
  {
    const double fraction = std::min(1.0, done + advance);
    const bool arrived = done >= 1.0;
    const double weight = relative < 1e-9 && arrived ? 0.0 : relative * base_weight;
    system.load(work);
    for (int i = 0; i < n; ++i)
      system.setInertia(i, system.isFree(i) ? weight : 0.0, work.x.col(i), load(inputs, i));
    placeAt(targets, 1.0, arrived ? 1.0 : fraction);
    const NewtonResult result = minimize(system, newton);
    report.iterations += result.iterations;
    report.factorizations += result.factorizations;
    if (!result.ok() && nudges > 0 && ++failures > 3)
    {
      // no minimum within reach of the saddle: give the saddle, and say so
      system.load(saddle);
      for (int i = 0; i < n; ++i)
        system.setInertia(i, 0.0, Eigen::Vector3d::Zero(), load(inputs, i));
      work = saddle;
      placeAt(targets, 1.0, 1.0);
      system.evaluate(false);
      report.stable = false;
      return finishEquilibrium(state, inputs, report);
    }
    if (!result.ok())
    {
      relative = std::max(100.0 * relative, 1e-6);
      if (!arrived)
        advance *= 0.5;
      if (++failures > 40 || advance < 1e-6)
        return refuse(report, result.failure, "no equilibrium was found: " + explainFailure(result.failure, 0.0, false));
      continue;
    }
    ++report.substeps;
    next = work;
    system.store(next);
    const double shift = (next.x - work.x).colwise().norm().maxCoeff() / length;
    std::swap(work, next);
    if (!arrived)
    {
      done = fraction;
      advance = std::min(1.5 * advance, move > 1 ? 1.0 / move : 1.0);
      continue;
    }
    if (weight == 0.0 && !result.definite && nudges < 3)
    {
      // a saddle, for example a straight column beyond its buckling load: push it off, the minimisation does the rest
      if (nudges == 0)
        saddle = work;
      failures = 0;
      const double size = 1e-4 * length * (++nudges);
      for (int i = 0; i < n; ++i)
        if (system.isFree(i))
          work.x.col(i) += size / n * Eigen::Vector3d(std::sin(1.0 + 3.1 * i / n), std::sin(2.0 + 4.7 * i / n), std::sin(3.0 + 2.3 * i / n));
      relative = 1e-2;
      continue;
    }
    if (weight == 0.0)
    {
      report.stable = result.definite;
      return finishEquilibrium(state, inputs, report);
    }
    relative *= shift < 1e-3 ? 0.01 : shift < 0.05 ? 0.2 : 0.7;
  }
  return refuse(report, StepFailure::newton_diverged, "the equilibrium did not settle: the rod may be free to drift; hold it, or let it settle by time stepping with damping");
}

/// Takes over the evaluated equilibrium.
StepReport RodStepper::Impl::finishEquilibrium(RodState& state, const RodInputs& inputs, StepReport& report)
{
  report.residual = system.residual() / system.forceScale();
  for (int j = 0; j < model->edges(); ++j)
    report.max_strain = std::max(report.max_strain, std::abs(system.arrays().strain[j]));
  computeWrenches(inputs, 0.0);
  for (std::size_t k = 0; k < work.grasps.size(); ++k)
    if (work.grasps[k].active)
      work.grasps[k].X_WG = {inputs.grasps[k].X_WG.position, inputs.grasps[k].X_WG.orientation.normalized()};
  state = work;
  return report;
}

}  // namespace slender
