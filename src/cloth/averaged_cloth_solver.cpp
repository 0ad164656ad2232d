// Averages of a cloth that are prescribed.
#include <algorithm>
#include <cmath>

#include "averaged_cloth_solver.h"

namespace slender {

namespace {

/// Measured (study tracking_overhead): for fewer points and fewer averages sweeps are faster. The more averages there
/// are, the less their stiffness is that of the preconditioner.
constexpr int kMostSwept = 3000, kPointsPerAverage = 50;
// measured likewise: of bending over inertia. Sweeps carry from edge to edge what bends a plate as a whole
constexpr double kStiffestSwept = 300.0;

}   // namespace

AveragedClothSolver::AveragedClothSolver(const ClothModel& model, const ClothOptions& options, ClothSystem& system)
  : ClothLinearSolver(model, options, system),
    choose_(options.solver == ClothSolver::automatic && options.one_newton_step),
    average_sets_(model.averages.size())
{
  for (std::size_t s = 0; s < average_sets_.size(); ++s)
  {
    average_sets_[s].prescribed = &model.averages[s];
    const bool swept = sweepsSuit(model.averages[s]);
    using Schur = ConstrainedCholesky::Schur;
    average_sets_[s].solver.setConstraints(*model.averages[s].weights, model.averages[s].bounds.size() > 0
                                                                           ? Schur::bounded
                                                                       : swept ? Schur::inverse
                                                                               : Schur::none);
    average_sets_[s].swept = swept;
  }
  if (std::any_of(average_sets_.begin(), average_sets_.end(), [](const AverageSet& set) { return set.swept; }))
    sweeps_.setPattern(system.matrix(), system.constantMatrix());
  if (model.averages[0].bounds.size() > 0)
  {
    bounds_ = std::make_unique<AverageBounds>();
    bounds_->first_guess = bounds_->before = bounds_->image = bounds_->image_before =
        PointVector(4 * static_cast<std::size_t>(points()), 0.0);
  }
  use(average_sets_[0]);
}

void AveragedClothSolver::use(AverageSet& set)
{
  used_ = &set;
  averages_ = &set.solver;
  gap_.assign(4 * static_cast<std::size_t>(set.prescribed->count()), 0.0);
  multipliers_ = gap_;
  if (bounds_)
  {
    bounds_->at.clear();
    bounds_->taken = bounds_->pulls = bounds_->wanted = bounds_->bounded = bounds_->response = gap_;
    bounds_->stiffness = bounds_->weights = set.prescribed->bounds;
    bounds_->at.reserve(static_cast<std::size_t>(set.prescribed->count()));
    bounds_->forces.setZero(3, set.prescribed->count());
  }
}

void AveragedClothSolver::use(const ClothState& state)
{
  AverageSet& set = average_sets_[static_cast<std::size_t>(state.average_set)];
  if (used_ != &set)
    use(set);
}

void AveragedClothSolver::beginStage()
{
  if (updatePreconditioner())
  {
    limp_ = bendsLittle();
    for (AverageSet& set : average_sets_)
      set.ready = false;
  }
  if (!preconditioned_ || used_->ready)
    return;
  const ShiftedMatrix& p = preconditioner_->constant();
  used_->independent = averages_->factor(p.pattern(), p.values(), p.factorization(), system_.held().data());
  used_->ready = true;
}

LinearOutcome AveragedClothSolver::solve(PointVector& d, const PointVector*, long& linear_iterations, long&,
                                         double tolerance)
{
  return solveMeeting(nullptr, d, linear_iterations, tolerance);
}

LinearOutcome AveragedClothSolver::solveTo(const Eigen::Matrix3Xd& averages, PointVector& d, long& linear_iterations)
{
  return solveMeeting(&averages, d, linear_iterations, 0.0);
}

LinearOutcome AveragedClothSolver::solveMeeting(const Eigen::Matrix3Xd* averages, PointVector& d,
                                                long& linear_iterations, double tolerance)
{
  if (!independent() || !preconditioned_)
    return LinearOutcome::not_definite;
  setRight(d);
  load_ = 0.0;
  const double allowed = tolerance > 0 ? tolerance : linear_tolerance_;
  if (averages && used_->swept && limp_)
  {
    if (sweepWithAverages(d, *averages, allowed, linear_iterations) == LinearOutcome::solved)
      return LinearOutcome::solved;
    setRight(d);
  }
  const double reference = takeFirstStep(d, averages, allowed);
  const LinearResult result = search(
      allowed, [&](PointVector& r, PointVector& z) { preconditionWithin(r, z); }, reference);
  return correct(d, result, allowed, load_, linear_iterations);
}

/// Of the averages that are met; those at their bounds have forces of their own.
void AveragedClothSolver::takeOutAverages(PointVector& r)
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

void AveragedClothSolver::averagesOf(const PointVector& x, Eigen::Matrix3Xd& averages) const
{
  const auto& c = *used_->prescribed->weights;
  averages.setZero(3, c.rows());
  for (Eigen::Index i = 0; i < c.rows(); ++i)
    for (Eigen::SparseMatrix<double, Eigen::RowMajor>::InnerIterator entry(c, i); entry; ++entry)
      averages.col(i) += entry.value() * point(x, entry.col());
}

void AveragedClothSolver::setGap(const Eigen::Matrix3Xd& averages, const PointVector& x)
{
  averagesOf(x, averages_now_);
  for (Eigen::Index i = 0; i < averages.cols(); ++i)
    point(gap_, i) = averages.col(i) - averages_now_.col(i);
  if (bounds_)
    for (const int i : bounds_->at)
      point(gap_, i).setZero();
}

void AveragedClothSolver::meetAverages(const Eigen::Matrix3Xd& averages, PointVector& x)
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

void AveragedClothSolver::balanceAverages(Eigen::Matrix3Xd& forces, bool response)
{
  forces.resize(3, count());
  if (bounds_ && !response)
    for (const int i : bounds_->at)
      for (Eigen::SparseMatrix<double, Eigen::RowMajor>::InnerIterator entry(*used_->prescribed->weights, i); entry;
           ++entry)
        point(system_.gradient(), entry.col()) -= entry.value() * bounds_->forces.col(i);
  std::copy(system_.gradient().begin(), system_.gradient().end(), right_.begin());
  clearHeld(right_);
  averages_->multipliers(right_.data(), multipliers_.data());
  takeOutAverages(system_.gradient());
  for (Eigen::Index i = 0; i < forces.cols(); ++i)
  {
    forces.col(i) = point(multipliers_, i);
    for (Eigen::SparseMatrix<double, Eigen::RowMajor>::InnerIterator entry(*used_->prescribed->weights, i); entry;
         ++entry)
      if (system_.held()[static_cast<std::size_t>(entry.col())])   // what holds it bears its share
        point(system_.gradient(), entry.col()) -= entry.value() * forces.col(i);
  }
  if (bounds_ && !response)
    forces = bounds_->forces;
}

/// z = P r, among directions that leave the averages alone. What the averages balance is taken out of r, where it would
/// drown the rest in rounding errors [Gould, Hribar, Nocedal, SIAM J. Sci. Comput. 23 (2001), 5].
void AveragedClothSolver::preconditionWithin(PointVector& r, PointVector& z)
{
  averages_->solve(r.data(), nullptr, z.data(), multipliers_.data());
  takeOutAverages(r);
}

/// By correction_, whose image is in product_.
void AveragedClothSolver::move(PointVector& d)
{
  for (std::size_t i = 0; i < d.size(); ++i)
  {
    d[i] += correction_[i];
    right_[i] -= product_[i];
  }
}

/// By what the preconditioner takes for the least motion that closes gap_.
void AveragedClothSolver::moveAverages(PointVector& d)
{
  std::fill(correction_.begin(), correction_.end(), 0.0);
  averages_->solve(correction_.data(), gap_.data(), correction_.data(), multipliers_.data());
  system_.applyMatrix(correction_, product_);
  clearHeld(product_);
  move(d);
}

/// Before conjugate gradients with averages: takes out of right_ what these balance. With `averages` d is moved there,
/// and on by a step of the preconditioned gradient, which comes for nothing; returns what the load on the cloth was
/// without the forces of the averages, which the tolerance counts from as it does for a cloth without; less near
/// equilibrium, where that load stays (the averages hold it) and errors of one step must not outlive the next. Where
/// cloth is strained so much that the step leads uphill, it is far stiffer than the preconditioner: then that load says
/// nothing about motions. d is moved by the least, and the tolerance counts from what is left: 0.
double AveragedClothSolver::takeFirstStep(PointVector& d, const Eigen::Matrix3Xd* averages, double tolerance)
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
    product_[i] = system_.start()[i] + d[i];
  setGap(*averages, product_);
  ConstrainedCholesky::Norms norms;
  averages_->solve(right_.data(), gap_.data(), correction_.data(), multipliers_.data(), &norms);
  load_ = norms.load;
  first_step_ = norms.step;
  takeOutAverages(right_);
  system_.applyMatrix(correction_, product_);
  clearHeld(product_);
  const bool downhill =
      pointKernels().dot(points(), correction_.data(), product_.data()) < 2.0 * norms.step * norms.step;
  if (!downhill)
    moveAverages(d);
  else
    move(d);
  return downhill ? std::max(std::min(norms.load, kLeft / tolerance * norms.step), kRounding * norms.load) : 0.0;
}

bool AveragedClothSolver::sweepsSuit(const PrescribedAverages& averages) const
{
  return choose_ && averages.bounds.size() == 0 && points() <= kMostSwept &&
         points() >= kPointsPerAverage * averages.count();
}

bool AveragedClothSolver::bendsLittle() const
{
  const std::vector<double>& stiffness = preconditioner_->bendingDiagonal();
  for (std::size_t i = 0; i < stiffness.size(); ++i)
    if ((1.0 + system_.viscosity()) * stiffness[i] > kStiffestSwept * system_.weights()[i])
      return false;
  return true;
}

/// By conjugate gradients with symmetric sweeps, after takeFirstStep(). What keeps the averages met is a stiffness,
/// which costs an iteration next to nothing, and after them the motion of the preconditioner that meets averages, which
/// meetAverages() makes in the end: a method of multipliers. The tolerance is that of the equations with that
/// stiffness; rounds go on until that motion is so small that positions are as good as those of the same cloth without
/// averages.
LinearOutcome AveragedClothSolver::sweepWithAverages(PointVector& d, const Eigen::Matrix3Xd& averages, double tolerance,
                                                     long& linear_iterations)
{
  constexpr int kMostRounds = 4;
  // measured (study tracking_overhead): of the preconditioner; of the tolerance, in its norm
  constexpr double kStiff = 3.0, kMotion = 40.0;
  constexpr double kLeft = 0.1;   // of what is not balanced at the start
  // of what it takes to move the averages, much of the load of cloth that they tear at
  constexpr double kMoving = 0.1;
  sweeps_.set(1.0 + system_.viscosity(), system_.held());
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
    const LinearResult result =
        sweeps_.solve(*averages_, kStiff, right_, correction_, tolerance, iterationsWithin(kMostLinearIterations),
                      reference, round == 0 ? kLeft : 1.0);
    linear_iterations += result.iterations;
    spend(result.iterations + 1);
    for (std::size_t i = 0; i < d.size(); ++i)
    {
      d[i] += correction_[i];
      product_[i] = system_.start()[i] + d[i];
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

}   // namespace slender
