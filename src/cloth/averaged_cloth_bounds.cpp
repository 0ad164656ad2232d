// Averages of a cloth whose forces have bounds.
#include <algorithm>
#include <cmath>

#include "averaged_cloth_solver.h"
#include "slender_sim/linalg/interruption.h"

namespace slender {

namespace {

constexpr long kFlops = 600;   // of dense matrices, to a count of a WorkBudget

}   // namespace

/// Factors what preconditions, where it has changed.
void AveragedClothSolver::prepareBounded()
{
  AverageBounds& b = *bounds_;
  if (system_.viscosity() != b.ratio || system_.weights() != b.inertia || system_.held() != b.held)
  {
    b.inertia = system_.weights();
    b.held = system_.held();
    b.ratio = system_.viscosity();
    b.definite = b.constant.factor(b.inertia, 1.0 + b.ratio, b.held);
    for (AverageSet& set : average_sets_)
      set.factored = false;
  }
  if (!b.definite || used_->factored)
    return;
  used_->independent_bounded = used_->bounded.factor(b.constant.factorization(), b.held.data());
  used_->factored = true;
}

/// As solve() of a linearised step, but forces of averages are at most their bounds: what the step minimises gets bound
/// times |target - average| for each instead of the condition that both are the same. An average is either met, or its
/// force is at the bound and points from it to its target. Where no bound is reached that is solve().
LinearOutcome AveragedClothSolver::solveBounded(PointVector& d, const Eigen::Matrix3Xd& averages,
                                                std::vector<int>& at_bound, long& linear_iterations)
{
  AverageBounds& b = *bounds_;
  const Eigen::VectorXd& most = used_->prescribed->bounds;
  if (!independent() || !b.definite)
    return LinearOutcome::not_definite;
  b.at.clear();
  used_->projection.leaveOut(b.at);
  if (at_bound.empty())
  {
    b.first_guess = d;
    const LinearOutcome outcome = solveTo(averages, d, linear_iterations);
    if (outcome != LinearOutcome::solved)
      return outcome;
    setRight(d);
    used_->projection.multipliers(right_, multipliers_);
    bool within = true;
    for (int i = 0; i < count(); ++i)
    {
      b.forces.col(i) = -point(multipliers_, i);
      within = within && b.forces.col(i).norm() <= most[i];
    }
    if (within)
      return LinearOutcome::solved;
    d = b.first_guess;
  }
  std::fill(b.pulls.begin(), b.pulls.end(), 0.0);
  // of what the bounds could do: forces far below them, of a shell at rest, are rounding errors
  constexpr double kSmall = 1e-6;
  double reference = 0.0;
  for (int i = 0; i < count(); ++i)
    if (std::isfinite(most[i]))
      reference = std::max(reference, kSmall * most[i] / std::sqrt(used_->bounded.stiffness(i)));
  LinearOutcome outcome = stepTowardsBounded(d, averages, reference, linear_iterations);
  if (outcome == LinearOutcome::not_converged)
    outcome = minimizeBounded(d, averages, reference, linear_iterations);
  at_bound.clear();
  for (int i = 0; i < count(); ++i)
  {
    b.forces.col(i) = point(b.pulls, i);
    if (b.forces.col(i).norm() > (1.0 - 1e-9) * most[i])
      at_bound.push_back(i);
  }
  b.at = at_bound;
  used_->projection.leaveOut(b.at);
  return outcome;
}

/// By steps of the preconditioned gradient, with the averages and their bounds solved exactly for the preconditioner
/// (proximal gradient method, accelerated [Beck & Teboulle, SIAM J. Imaging Sci. 2 (2009), 183] and restarted
/// [O'Donoghue & Candes, Found. Comput. Math. 15 (2015), 715]). Forces keep their bounds whatever is left to converge.
/// Gives up early where cloth is stiff: there Gauss-Seidel sweeps over the averages take thousands, and steps hundreds.
LinearOutcome AveragedClothSolver::stepTowardsBounded(PointVector& d, const Eigen::Matrix3Xd& averages,
                                                      double& reference, long& linear_iterations)
{
  constexpr int kMostIterations = 25;
  constexpr double kSteepest = 1e6;   // of the preconditioner
  AverageBounds& b = *bounds_;
  const Eigen::VectorXd& most = used_->prescribed->bounds;
  const PointKernels& kernels = pointKernels();
  const double tolerance = 1e-2 * linear_tolerance_;
  const int m = count();
  system_.applyMatrix(d, b.image);
  b.before = d;
  b.image_before = b.image;
  double l = 1.0, t = 1.0;
  for (int iteration = 0; iteration < kMostIterations; ++iteration)
  {
    const double next = 0.5 * (1.0 + std::sqrt(1.0 + 4.0 * t * t)), carry = (t - 1.0) / next;
    t = next;
    for (std::size_t i = 0; i < d.size(); ++i)   // the point to step from, and its image
    {
      const double x = d[i] + carry * (d[i] - b.before[i]),
                   image = b.image[i] + carry * (b.image[i] - b.image_before[i]);
      b.before[i] = d[i];
      b.image_before[i] = b.image[i];
      d[i] = x;
      b.image[i] = image;
      right_[i] = -system_.gradient()[i] - image;
      product_[i] = system_.start()[i] + x;
    }
    clearHeld(right_);
    setGap(averages, product_);
    double step = 0.0;
    bool exact = false;
    for (;; l *= 2.0)
    {
      const ConstrainedCholesky::Norms norms = used_->bounded.solveBounded(
          right_.data(), gap_.data(), most.data(), l, tolerance, correction_.data(), b.pulls.data());
      step = norms.step;
      exact = norms.converged;
      spend(1);
      budget_->spend(static_cast<long>(norms.sweeps) * m * m * 3 / kFlops);
      reference = iteration == 0 ? std::max(reference, norms.load) : reference;
      system_.applyMatrix(correction_, product_);
      const double curvature = kernels.dot(points(), correction_.data(), product_.data());
      if (!std::isfinite(curvature) || l > kSteepest)
        return LinearOutcome::not_definite;
      if (curvature <= 1.0001 * step * step / l)
        break;
    }
    ++linear_iterations;
    if (budget_->spent() || stepsInterrupted())
      return LinearOutcome::not_converged;
    used_->bounded.addForces(b.pulls.data(), right_.data());
    double along = 0.0;
    for (std::size_t i = 0; i < d.size(); ++i)
    {
      d[i] += correction_[i];
      b.image[i] += product_[i];
      along += right_[i] * (d[i] - b.before[i]);
    }
    if (!exact)
      return LinearOutcome::not_converged;
    if (step <= linear_tolerance_ * reference)
      return LinearOutcome::solved;
    if (along < 0.0)
      t = 1.0;
  }
  return LinearOutcome::not_converged;
}

/// Of the bounded averages' forces `b.pulls` and the gap they leave: u = f + stiffness gap, the forces that are u
/// within their bounds, and how stiff these are along the gap, for the preconditioner in all directions alike. Returns
/// the work that is left in the gap: the Moreau envelope of bound |gap|.
double AveragedClothSolver::boundedForces()
{
  AverageBounds& b = *bounds_;
  double envelope = 0.0;
  for (int i = 0; i < count(); ++i)
  {
    const double most = used_->prescribed->bounds[i], stiffness = b.stiffness[i];
    const Eigen::Vector3d wanted = point(b.pulls, i) + stiffness * point(gap_, i);
    const double size = wanted.norm();
    const bool beyond = size > most;
    point(b.wanted, i) = beyond ? Eigen::Vector3d(wanted / size) : Eigen::Vector3d(0, 0, 0);
    point(b.bounded, i) = beyond ? most * point(b.wanted, i) : wanted;
    b.weights[i] = beyond ? stiffness * most / size : stiffness;
    envelope += (beyond ? most * (size - 0.5 * most) : 0.5 * size * size) / stiffness;
  }
  return envelope;
}

void AveragedClothSolver::setBoundedGap(const PointVector& d, const Eigen::Matrix3Xd& averages)
{
  for (std::size_t i = 0; i < d.size(); ++i)
    product_[i] = system_.start()[i] + d[i];
  setGap(averages, product_);
}

/// Solves the linear system of one semismooth Newton step by conjugate gradients. The right-hand side is right_; the
/// step is written to bounds_->before.
LinearResult AveragedClothSolver::solveBoundedStep(double tolerance, int most)
{
  AverageBounds& b = *bounds_;
  return b.cg.solve(
      right_, b.before, tolerance, most,
      [&](const PointVector& p, PointVector& ap) {
        system_.applyMatrix(p, ap);
        clearHeld(ap);
        averagesOf(p, averages_now_);
        for (int i = 0; i < count(); ++i)   // a force at its bound only turns
        {
          const Eigen::Vector3d n = point(b.wanted, i);
          point(b.response, i) = b.weights[i] * (averages_now_.col(i) - n.dot(averages_now_.col(i)) * n);
        }
        used_->bounded.addForces(b.response.data(), ap.data());
      },
      [&](PointVector& r, PointVector& z) { used_->bounded.solveSoftened(r.data(), z.data()); });
}

/// Moves d along the Newton step bounds_->before. A line search keeps the sum of the quadratic part and the envelope
/// falling; `start` is the envelope at d. Returns the envelope where the search ends.
double AveragedClothSolver::moveBounded(PointVector& d, const Eigen::Matrix3Xd& averages, double start)
{
  constexpr double kArmijo = 1e-4;
  AverageBounds& b = *bounds_;
  const PointKernels& kernels = pointKernels();
  const PointVector& move = b.before;
  PointVector& image = b.image_before;
  double envelope = start;
  // the quadratic part along the step, and the envelope
  system_.applyMatrix(move, image);
  const double slope = -kernels.dot(points(), right_.data(), move.data()),
               curvature = kernels.dot(points(), move.data(), image.data());
  double linear = 0.0, alpha = 1.0;
  for (std::size_t i = 0; i < d.size(); ++i)
    linear += (system_.gradient()[i] + b.image[i]) * move[i];
  for (double change = 1.0;; change = -0.5 * alpha, alpha *= 0.5)   // of the share of the step that is taken
  {
    for (std::size_t i = 0; i < d.size(); ++i)
      d[i] += change * move[i];
    setBoundedGap(d, averages);
    envelope = boundedForces();
    if (alpha * linear + 0.5 * alpha * alpha * curvature + envelope - start <=
            kArmijo * alpha * slope + 1e-12 * std::abs(start) ||
        alpha < 1e-6)
      break;
  }
  for (std::size_t i = 0; i < d.size(); ++i)
    b.image[i] += alpha * image[i];
  return envelope;
}

/// The same problem by the method of multipliers [Rockafellar, Math. Oper. Res. 1 (1976), 97], whose smooth problems
/// take a few steps of semismooth Newton with a line search [Li, Sun & Toh, SIAM J. Optim. 28 (2018), 433], and these
/// conjugate gradients.
LinearOutcome AveragedClothSolver::minimizeBounded(PointVector& d, const Eigen::Matrix3Xd& averages, double reference,
                                                   long& linear_iterations)
{
  // rounds of multipliers, Newton steps in each, and all of conjugate gradients
  constexpr int kMostRounds = 60, kMostSteps = 60, kMostIterations = 4000;
  constexpr double kStiff = 10.0;     // of the averages
  constexpr double kForcing = 0.05;   // of a Newton step's residual
  AverageBounds& b = *bounds_;
  const PointKernels& kernels = pointKernels();
  const int m = count(), before = linear_iterations;
  for (int i = 0; i < m; ++i)
    b.stiffness[i] = kStiff * used_->bounded.stiffness(i);
  system_.applyMatrix(d, b.image);
  for (int round = 0; round < kMostRounds; ++round)
  {
    setBoundedGap(d, averages);
    double envelope = boundedForces();
    bool balanced = false;
    for (int step = 0; step < kMostSteps && !balanced; ++step)
    {
      for (std::size_t i = 0; i < d.size(); ++i)
        right_[i] = -system_.gradient()[i] - b.image[i];
      clearHeld(right_);
      used_->bounded.addForces(b.bounded.data(), right_.data());
      used_->bounded.soften(b.weights);
      budget_->spend(static_cast<long>(m) * m * m / kFlops);
      used_->bounded.solveSoftened(right_.data(), b.before.data());
      const double left = std::sqrt(std::max(kernels.dot(points(), right_.data(), b.before.data()), 0.0)),
                   allowed = 0.5 * linear_tolerance_ * reference;
      if (!std::isfinite(left))
        return LinearOutcome::not_definite;
      balanced = left <= allowed;
      if (balanced)
        break;
      const int most = iterationsWithin(kMostIterations - (linear_iterations - before));
      if (most <= 0 || budget_->spent())
        return LinearOutcome::not_converged;
      const LinearResult result = solveBoundedStep(std::max(kForcing, 0.5 * allowed / left), most);
      linear_iterations += result.iterations;
      spend(result.iterations + 1);
      if (!result.definite)
        return LinearOutcome::not_definite;
      envelope = moveBounded(d, averages, envelope);
    }
    if (!balanced)
      return LinearOutcome::not_converged;
    double change = 0.0;
    for (int i = 0; i < m; ++i)
      change += (point(b.bounded, i) - point(b.pulls, i)).squaredNorm() / used_->bounded.stiffness(i);
    std::copy(b.bounded.begin(), b.bounded.end(), b.pulls.begin());
    if (std::sqrt(change) <= linear_tolerance_ * reference)
      return LinearOutcome::solved;
  }
  return LinearOutcome::not_converged;
}

}   // namespace slender
