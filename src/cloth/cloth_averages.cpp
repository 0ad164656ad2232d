// Averages of a cloth that are prescribed, and bounds of the forces that may be used for it.
#include <algorithm>
#include <cmath>
#include <limits>

#include "cloth_system.h"
#include "slender_sim/linalg/interruption.h"

namespace slender {

namespace {

constexpr long kFlops = 600;   // of dense matrices, to a count of a WorkBudget
/// Measured (study tracking_overhead): for fewer averages sweeps are faster. The more there are, the less their
/// stiffness is that of the preconditioner.
constexpr int kPointsPerAverage = 50;
// measured likewise: of bending over inertia. Sweeps carry from edge to edge what bends a plate as a whole
constexpr double kStiffestSwept = 300.0;

}   // namespace

/// Of the averages that are met; those at their bounds have forces of their own.
void ClothSystem::takeOutAverages(PointVector& r)
{
  if (bounds_)
  {
    for (const int i : bounds_->at)
      point(multipliers_, i).setZero();
    for (std::size_t k = 0; k < multipliers_.size(); ++k)
      bounds_->taken[k] += multipliers_[k];
  }
  averages_->takeOut(multipliers_.data(), r.data());
}

void ClothSystem::averagesOf(const PointVector& x, Eigen::Matrix3Xd& averages) const
{
  const auto& c = *used_->prescribed->weights;
  averages.setZero(3, c.rows());
  for (Eigen::Index i = 0; i < c.rows(); ++i)
    for (Eigen::SparseMatrix<double, Eigen::RowMajor>::InnerIterator entry(c, i); entry; ++entry)
      averages.col(i) += entry.value() * point(x, entry.col());
}

void ClothSystem::setGap(const Eigen::Matrix3Xd& averages, const PointVector& x)
{
  averagesOf(x, averages_now_);
  for (Eigen::Index i = 0; i < averages.cols(); ++i)
    point(gap_, i) = averages.col(i) - averages_now_.col(i);
  if (bounds_)
    for (const int i : bounds_->at)
      point(gap_, i).setZero();
}

void ClothSystem::meetAverages(const Eigen::Matrix3Xd& averages, PointVector& x)
{
  // of the coordinates: what is left after a solve, or conjugate gradients that began there
  constexpr double kRounding = 4e-15;
  for (int pass = 0; pass < 2; ++pass)   // of averages that nearly depend on each other one leaves more
  {
    setGap(averages, x);
    if ((averages - averages_now_).cwiseAbs().maxCoeff() <= kRounding * averages.cwiseAbs().maxCoeff())
      return;
    std::fill(right_.begin(), right_.end(), 0.0);
    averages_->solve(right_.data(), gap_.data(), correction_.data(), multipliers_.data());
    for (std::size_t i = 0; i < x.size(); ++i)
      x[i] += correction_[i];
  }
}

void ClothSystem::balanceAverages(Eigen::Matrix3Xd& forces, bool response)
{
  forces.resize(3, averageCount());
  if (bounds_ && !response)
    for (const int i : bounds_->at)
      for (Eigen::SparseMatrix<double, Eigen::RowMajor>::InnerIterator entry(*used_->prescribed->weights, i); entry;
           ++entry)
        point(gradient_, entry.col()) -= entry.value() * bounds_->forces.col(i);
  std::copy(gradient_.begin(), gradient_.end(), right_.begin());
  clearHeld(right_);
  averages_->multipliers(right_.data(), multipliers_.data());
  takeOutAverages(gradient_);
  for (Eigen::Index i = 0; i < forces.cols(); ++i)
  {
    forces.col(i) = point(multipliers_, i);
    for (Eigen::SparseMatrix<double, Eigen::RowMajor>::InnerIterator entry(*used_->prescribed->weights, i); entry;
         ++entry)
      if (held_[static_cast<std::size_t>(entry.col())])   // what holds it bears its share
        point(gradient_, entry.col()) -= entry.value() * forces.col(i);
  }
  if (bounds_ && !response)
    forces = bounds_->forces;
}

/// z = P r, among directions that leave the averages alone. What the averages balance is taken out of r, where it would
/// drown the rest in rounding errors [Gould, Hribar, Nocedal, SIAM J. Sci. Comput. 23 (2001), 5].
void ClothSystem::preconditionWithin(PointVector& r, PointVector& z)
{
  averages_->solve(r.data(), nullptr, z.data(), multipliers_.data());
  takeOutAverages(r);
}

/// By correction_, whose image is in product_.
void ClothSystem::move(PointVector& d)
{
  for (std::size_t i = 0; i < d.size(); ++i)
  {
    d[i] += correction_[i];
    right_[i] -= product_[i];
  }
}

/// By what the preconditioner takes for the least motion that closes gap_.
void ClothSystem::moveAverages(PointVector& d)
{
  std::fill(correction_.begin(), correction_.end(), 0.0);
  averages_->solve(correction_.data(), gap_.data(), correction_.data(), multipliers_.data());
  applyMatrix(correction_, product_);
  clearHeld(product_);
  move(d);
}

/// Before conjugate gradients with averages: takes out of right_ what these balance. With `averages` d is moved there,
/// and on by a step of the preconditioned gradient, which comes for nothing; returns what the load on the cloth was
/// without the forces of the averages, which the tolerance counts from as it does for a cloth without; less near
/// equilibrium, where that load stays (the averages hold it) and errors of one step must not outlive the next. Where
/// cloth is strained so much that the step leads uphill, it is far stiffer than the preconditioner: then that load says
/// nothing about motions. d is moved by the least, and the tolerance counts from what is left: 0.
double ClothSystem::takeFirstStep(PointVector& d, const Eigen::Matrix3Xd* averages, double tolerance)
{
  constexpr double kLeft = 0.1;         // of what is not balanced at the start
  constexpr double kRounding = 1e-12;   // of the load
  if (!averages)
  {
    averages_->multipliers(right_.data(), multipliers_.data());
    takeOutAverages(right_);
    return 0.0;
  }
  for (std::size_t i = 0; i < d.size(); ++i)
    product_[i] = start_[i] + d[i];
  setGap(*averages, product_);
  ConstrainedCholesky::Norms norms;
  averages_->solve(right_.data(), gap_.data(), correction_.data(), multipliers_.data(), &norms);
  load_ = norms.load;
  first_step_ = norms.step;
  takeOutAverages(right_);
  applyMatrix(correction_, product_);
  clearHeld(product_);
  const bool downhill =
      pointKernels().dot(points(), correction_.data(), product_.data()) < 2.0 * norms.step * norms.step;
  if (!downhill)
    moveAverages(d);
  else
    move(d);
  return downhill ? std::max(std::min(norms.load, kLeft / tolerance * norms.step), kRounding * norms.load) : 0.0;
}

bool ClothSystem::sweepsSuit(const PrescribedAverages& averages) const
{
  return choose_ && averages.bounds.size() == 0 && points() <= kMostSwept &&
         points() >= kPointsPerAverage * averages.count();
}

bool ClothSystem::bendsLittle(double viscosity) const
{
  const std::vector<double>& stiffness = preconditioner_->bendingDiagonal();
  for (std::size_t i = 0; i < stiffness.size(); ++i)
    if ((1.0 + viscosity) * stiffness[i] > kStiffestSwept * weight_[i])
      return false;
  return true;
}

/// By conjugate gradients with symmetric sweeps, after takeFirstStep(). What keeps the averages met is a stiffness,
/// which costs an iteration next to nothing, and after them the motion of the preconditioner that meets averages, which
/// meetAverages() makes in the end: a method of multipliers. The tolerance is that of the equations with that
/// stiffness; rounds go on until that motion is so small that positions are as good as those of the same cloth without
/// averages.
LinearOutcome ClothSystem::sweepWithAverages(PointVector& d, const Eigen::Matrix3Xd& averages, double tolerance,
                                             int& linear_iterations)
{
  constexpr int kMostRounds = 4;
  // measured (study tracking_overhead): of the preconditioner; of the tolerance, in its norm
  constexpr double kStiff = 3.0, kMotion = 40.0;
  constexpr double kLeft = 0.1;   // of what is not balanced at the start
  // of what it takes to move the averages, much of the load of cloth that they tear at
  constexpr double kMoving = 0.1;
  sweeps_.set(1.0 + ratio_, held_);
  double reference = sweeps_.norm(right_);
  if (!(takeFirstStep(d, &averages, tolerance) >
        0))   // where cloth is so much stiffer than the preconditioner this leads away
    return LinearOutcome::not_converged;
  double gap = averages_->norm(gap_.data());
  const double moving = kMoving * gap, load = std::max(std::sqrt(std::max(load_ * load_ - gap * gap, 0.0)), moving);
  const double allowed = std::min(kMotion * tolerance * load, kLeft * first_step_);
  reference = std::max(reference, moving);
  for (int round = 0; round < kMostRounds; ++round)
  {
    const LinearResult result = sweeps_.solve(*averages_, kStiff, right_, correction_, tolerance,
                                              iterationsWithin(kMostIterations), reference, round == 0 ? kLeft : 1.0);
    linear_iterations += result.iterations;
    spend(result.iterations + 1);
    for (std::size_t i = 0; i < d.size(); ++i)
    {
      d[i] += correction_[i];
      product_[i] = start_[i] + d[i];
    }
    if (!result.definite || result.residual > tolerance)
      break;
    setGap(averages, product_);
    const double left = averages_->norm(gap_.data());
    if (result.iterations == 0 || left <= allowed)
      return LinearOutcome::solved;
    if (round > 0 && left > 0.5 * gap)
      break;
    gap = left;
    setRight(d);
    moveAverages(d);
    averages_->multipliers(right_.data(), multipliers_.data());
    takeOutAverages(right_);
  }
  return LinearOutcome::not_converged;
}

/// As solve() of a linearised step, but forces of averages are at most their bounds: what the step minimises gets bound
/// times |target - average| for each instead of the condition that both are the same. An average is either met, or its
/// force is at the bound and points from it to its target. Where no bound is reached that is solve().
LinearOutcome ClothSystem::solveBounded(PointVector& d, const Eigen::Matrix3Xd& averages, std::vector<int>& at_bound,
                                        int& linear_iterations)
{
  AverageBounds& b = *bounds_;
  const Eigen::VectorXd& most = used_->prescribed->bounds;
  b.at.clear();
  averages_->leaveOut(b.at);
  if (at_bound.empty())
  {
    int factorizations = 0;
    b.first_guess = d;
    std::fill(b.taken.begin(), b.taken.end(), 0.0);
    const LinearOutcome outcome = solve(d, nullptr, linear_iterations, factorizations, 0.0, &averages);
    if (outcome != LinearOutcome::solved)
      return outcome;
    bool within = true;
    for (int i = 0; i < averages_->count(); ++i)
    {
      b.forces.col(i) = -point(b.taken, i);
      within = within && b.forces.col(i).norm() <= most[i];
    }
    if (within)
      return LinearOutcome::solved;
    d = b.first_guess;
  }
  else if (!averagesIndependent() || !preconditioned_)
    return LinearOutcome::not_definite;
  std::fill(b.pulls.begin(), b.pulls.end(), 0.0);
  // of what the bounds could do: forces far below them, of a shell at rest, are rounding errors
  constexpr double kSmall = 1e-6;
  double reference = 0.0;
  for (int i = 0; i < averages_->count(); ++i)
    if (std::isfinite(most[i]))
      reference = std::max(reference, kSmall * most[i] / std::sqrt(averages_->stiffness(i)));
  LinearOutcome outcome = stepTowardsBounded(d, averages, reference, linear_iterations);
  if (outcome == LinearOutcome::not_converged)
    outcome = minimizeBounded(d, averages, reference, linear_iterations);
  at_bound.clear();
  for (int i = 0; i < averages_->count(); ++i)
  {
    b.forces.col(i) = point(b.pulls, i);
    if (b.forces.col(i).norm() > (1.0 - 1e-9) * most[i])
      at_bound.push_back(i);
  }
  b.at = at_bound;
  averages_->leaveOut(b.at);
  return outcome;
}

/// By steps of the preconditioned gradient, with the averages and their bounds solved exactly for the preconditioner
/// (proximal gradient method, accelerated [Beck & Teboulle, SIAM J. Imaging Sci. 2 (2009), 183] and restarted
/// [O'Donoghue & Candes, Found. Comput. Math. 15 (2015), 715]). Forces keep their bounds whatever is left to converge.
/// Gives up early where cloth is stiff: there Gauss-Seidel sweeps over the averages take thousands, and steps hundreds.
LinearOutcome ClothSystem::stepTowardsBounded(PointVector& d, const Eigen::Matrix3Xd& averages, double& reference,
                                              int& linear_iterations)
{
  constexpr int kMostIterations = 25;
  constexpr double kSteepest = 1e6;   // of the preconditioner
  AverageBounds& b = *bounds_;
  const Eigen::VectorXd& most = used_->prescribed->bounds;
  const PointKernels& kernels = pointKernels();
  const double tolerance = 1e-2 * linear_tolerance_;
  const int m = averages_->count();
  applyMatrix(d, b.image);
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
      right_[i] = -gradient_[i] - image;
      product_[i] = start_[i] + x;
    }
    clearHeld(right_);
    setGap(averages, product_);
    double step = 0.0;
    bool exact = false;
    for (;; l *= 2.0)
    {
      const ConstrainedCholesky::Norms norms = averages_->solveBounded(right_.data(), gap_.data(), most.data(), l,
                                                                       tolerance, correction_.data(), b.pulls.data());
      step = norms.step;
      exact = norms.converged;
      spend(1);
      budget_->spend(static_cast<long>(norms.sweeps) * m * m * 3 / kFlops);
      reference = iteration == 0 ? std::max(reference, norms.load) : reference;
      applyMatrix(correction_, product_);
      const double curvature = kernels.dot(points(), correction_.data(), product_.data());
      if (!std::isfinite(curvature) || l > kSteepest)
        return LinearOutcome::not_definite;
      if (curvature <= 1.0001 * step * step / l)
        break;
    }
    ++linear_iterations;
    if (budget_->spent() || stepsInterrupted())
      return LinearOutcome::not_converged;
    averages_->addForces(b.pulls.data(), right_.data());
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
double ClothSystem::boundedForces()
{
  AverageBounds& b = *bounds_;
  double envelope = 0.0;
  for (int i = 0; i < averages_->count(); ++i)
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

/// The same problem by the method of multipliers [Rockafellar, Math. Oper. Res. 1 (1976), 97], whose smooth problems
/// take a few steps of semismooth Newton with a line search [Li, Sun & Toh, SIAM J. Optim. 28 (2018), 433], and these
/// conjugate gradients.
LinearOutcome ClothSystem::minimizeBounded(PointVector& d, const Eigen::Matrix3Xd& averages, double reference,
                                           int& linear_iterations)
{
  // rounds of multipliers, Newton steps in each, and all of conjugate gradients
  constexpr int kMostRounds = 60, kMostSteps = 60, kMostIterations = 4000;
  constexpr double kStiff = 10.0;     // of the averages
  constexpr double kForcing = 0.05;   // of a Newton step's residual
  constexpr double kArmijo = 1e-4;
  AverageBounds& b = *bounds_;
  const PointKernels& kernels = pointKernels();
  const int m = averages_->count(), before = linear_iterations;
  for (int i = 0; i < m; ++i)
    b.stiffness[i] = kStiff * averages_->stiffness(i);
  applyMatrix(d, b.image);
  const auto setBoundedGap = [&] {
    for (std::size_t i = 0; i < d.size(); ++i)
      product_[i] = start_[i] + d[i];
    setGap(averages, product_);
  };
  PointVector &move = b.before, &image = b.image_before;
  for (int round = 0; round < kMostRounds; ++round)
  {
    setBoundedGap();
    double envelope = boundedForces();
    bool balanced = false;
    for (int step = 0; step < kMostSteps && !balanced; ++step)
    {
      for (std::size_t i = 0; i < d.size(); ++i)
        right_[i] = -gradient_[i] - b.image[i];
      clearHeld(right_);
      averages_->addForces(b.bounded.data(), right_.data());
      averages_->soften(b.weights);
      budget_->spend(static_cast<long>(m) * m * m / kFlops);
      averages_->solveSoftened(right_.data(), move.data());
      const double left = std::sqrt(std::max(kernels.dot(points(), right_.data(), move.data()), 0.0)),
                   allowed = 0.5 * linear_tolerance_ * reference;
      if (!std::isfinite(left))
        return LinearOutcome::not_definite;
      balanced = left <= allowed;
      if (balanced)
        break;
      const int most = iterationsWithin(kMostIterations - (linear_iterations - before));
      if (most <= 0 || budget_->spent())
        return LinearOutcome::not_converged;
      const LinearResult result = cg_.solve(
          right_, move, std::max(kForcing, 0.5 * allowed / left), most,
          [&](const PointVector& p, PointVector& ap) {
            applyMatrix(p, ap);
            clearHeld(ap);
            averagesOf(p, averages_now_);
            for (int i = 0; i < m; ++i)   // a force at its bound only turns
            {
              const Eigen::Vector3d n = point(b.wanted, i);
              point(b.response, i) = b.weights[i] * (averages_now_.col(i) - n.dot(averages_now_.col(i)) * n);
            }
            averages_->addForces(b.response.data(), ap.data());
          },
          [&](PointVector& r, PointVector& z) { averages_->solveSoftened(r.data(), z.data()); });
      linear_iterations += result.iterations;
      spend(result.iterations + 1);
      if (!result.definite)
        return LinearOutcome::not_definite;
      // the quadratic part along the step, and the envelope
      applyMatrix(move, image);
      const double slope = -kernels.dot(points(), right_.data(), move.data()),
                   curvature = kernels.dot(points(), move.data(), image.data());
      const double start = envelope;
      double linear = 0.0, alpha = 1.0;
      for (std::size_t i = 0; i < d.size(); ++i)
        linear += (gradient_[i] + b.image[i]) * move[i];
      for (double change = 1.0;; change = -0.5 * alpha, alpha *= 0.5)   // of the share of the step that is taken
      {
        for (std::size_t i = 0; i < d.size(); ++i)
          d[i] += change * move[i];
        setBoundedGap();
        envelope = boundedForces();
        if (alpha * linear + 0.5 * alpha * alpha * curvature + envelope - start <=
                kArmijo * alpha * slope + 1e-12 * std::abs(start) ||
            alpha < 1e-6)
          break;
      }
      for (std::size_t i = 0; i < d.size(); ++i)
        b.image[i] += alpha * image[i];
    }
    if (!balanced)
      return LinearOutcome::not_converged;
    double change = 0.0;
    for (int i = 0; i < m; ++i)
      change += (point(b.bounded, i) - point(b.pulls, i)).squaredNorm() / averages_->stiffness(i);
    std::copy(b.bounded.begin(), b.bounded.end(), b.pulls.begin());
    if (std::sqrt(change) <= linear_tolerance_ * reference)
      return LinearOutcome::solved;
  }
  return LinearOutcome::not_converged;
}

}   // namespace slender
