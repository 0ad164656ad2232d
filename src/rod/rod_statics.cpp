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
  begin(state);
  const int n = model->nodes();
  addFrames(*model, work);
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
  double ease = 0.01;      // smallest factor by which it falls from round to round
  bool steady = false;     // definite with the last, very small weight: what is left is a motion that costs nothing
  int failures = 0, nudges = 0;
  RodState saddle;
  system.leaveOutStretching(false);
  system.load(work);
  system.setResponse(0.0, nullptr);
  constexpr int kMaxRounds = 1000, kMaxEscapes = 25;
  for (int round = 0; round < kMaxRounds; ++round)
  {
    const double fraction = std::min(1.0, done + advance);
    const bool arrived = done >= 1.0;
    const double weight = relative < 1e-9 && arrived ? 0.0 : relative * base_weight;
    system.load(work);
    placeAt(targets, 1.0, arrived ? 1.0 : fraction);
    carryFreeNodes(inputs, weight);
    const NewtonResult result = minimize(system, newton);
    report.iterations += result.iterations;
    report.factorizations += result.factorizations;
    if (!result.ok() && nudges > 0 && ++failures > kMaxEscapes)
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
      if (arrived)
      {
        if (result.failure == StepFailure::newton_diverged && weight > 0)
        {
          // not there, but further down: the next round begins here
          system.moveAlong(0.0);
          system.evaluate(false);
          system.store(work);
        }
        relative = std::max(10.0 * relative, 1e-6);
        ease = std::sqrt(ease);   // let go more slowly, so as not to come back here at once
      }
      else
      {
        relative = std::min(10.0 * relative, 1e8);
        advance *= 0.5;
      }
      if (++failures > 40 || advance < 1e-6)
        return refuse(report, result.failure, "no equilibrium was found: " + explainFailure(result.failure, 0.0, false));
      continue;
    }
    ++report.substeps;
    next = work;
    system.store(next);
    for (std::size_t k = 0; k < next.grasps.size(); ++k)
      if (next.grasps[k].active)
        next.grasps[k].X_WG = stage_poses[k];   // frames and twists belong to these
    const double shift = (next.x - work.x).colwise().norm().maxCoeff() / length;
    std::swap(work, next);
    if (!arrived)
    {
      done = fraction;
      failures = 0;
      relative = std::max(0.2 * relative, 1.0);
      advance = std::min(1.5 * advance, move > 1 ? 1.0 / move : 1.0);
      continue;
    }
    if (weight > 0)
      steady = result.definite;
    if (weight == 0.0 && !result.definite && !steady && nudges < 3)
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
      report.stable = result.definite || steady;
      return finishEquilibrium(state, inputs, report);
    }
    failures = 0;
    relative *= std::max(ease, shift < 1e-3 ? 0.01 : shift < 0.05 ? 0.2 : 0.7);
    ease = std::max(0.01, 0.7 * ease);
  }
  return refuse(report, StepFailure::newton_diverged, "the equilibrium did not settle: the rod may be free to drift; hold it, or let it settle by time stepping with damping");
}

/// Trial of a round: free nodes, and what the proximal term holds them to, go along with the grasps, by the displacements of the held
/// nodes before and after them. Otherwise a move longer than an edge would fold the rod next to the grasp.
void RodStepper::Impl::carryFreeNodes(const RodInputs& inputs, double weight)
{
  const int n = model->nodes();
  const auto moved = [&](int i) { return Eigen::Vector3d(system.position(i % n) - work.x.col(i % n)); };
  const auto place = [&](int i, const Eigen::Vector3d& by) {
    const Eigen::Vector3d x = work.x.col(i % n) + by;
    system.setPosition(i % n, x);
    system.setInertia(i % n, weight, x, load(inputs, i % n));
  };
  int first = 0;
  while (first < n && system.isFree(first))
    ++first;
  if (first == n)
  {
    for (int i = 0; i < n; ++i)
      place(i, Eigen::Vector3d::Zero());
    return;
  }
  if (!model->closed)
    for (int i = 0; i < first; ++i)
      place(i, moved(first));
  const int end = model->closed ? first + n : n;   // a loop ends at its first held node again
  for (int left = first; left < end;)
  {
    system.setInertia(left % n, 0.0, Eigen::Vector3d::Zero(), load(inputs, left % n));
    int right = left + 1;
    while (right < end && system.isFree(right % n))
      ++right;
    const Eigen::Vector3d a = moved(left), b = right < end || model->closed ? moved(right) : a;
    for (int i = left + 1; i < right; ++i)
      place(i, a + (b - a) * (static_cast<double>(i - left) / (right - left)));
    left = right;
  }
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
