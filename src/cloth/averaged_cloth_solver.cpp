// Averages of a cloth that are prescribed.
#include <algorithm>
#include <cmath>

#include "averaged_cloth_solver.h"

namespace slender {

AveragedClothSolver::AveragedClothSolver(const ClothModel& model, const ClothOptions& options, ClothSystem& system)
  : ClothLinearSolver(system, options.linear_tolerance),
    mass_(model.mass)
{
  average_sets_.reserve(model.averages.size());
  for (const PrescribedAverages& averages : model.averages)
    average_sets_.emplace_back(averages);
  sweeps_.setPattern(system.matrix(), system.constantMatrix());
  if (model.averages[0].bounds.size() > 0)
  {
    for (AverageSet& set : average_sets_)
      set.bounded.setConstraints(*set.prescribed->weights);
    bounds_ = std::make_unique<AverageBounds>();
    bounds_->first_guess = bounds_->before = bounds_->image = bounds_->image_before =
        PointVector(4 * static_cast<std::size_t>(points()), 0.0);
    bounds_->constant = ShiftedMatrix(constantStiffness(model, system.terms()));
    bounds_->cg.resize(4 * static_cast<std::size_t>(points()));
  }
  use(average_sets_[0]);
}

void AveragedClothSolver::use(AverageSet& set)
{
  used_ = &set;
  swept_held_.clear();
  gap_.assign(4 * static_cast<std::size_t>(count()), 0.0);
  multipliers_ = gap_;
  if (bounds_)
  {
    used_->projection.leaveOut({});
    bounds_->at.clear();
    bounds_->pulls = bounds_->wanted = bounds_->bounded = bounds_->response = gap_;
    bounds_->stiffness = bounds_->weights = set.prescribed->bounds;
    bounds_->at.reserve(static_cast<std::size_t>(count()));
    bounds_->forces.setZero(3, count());
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
  if (swept_held_ != system_.held())
  {
    swept_held_ = system_.held();
    used_->independent = used_->projection.prepare(mass_, [this](int i) { return !swept_held_[i]; });
    if (used_->independent)
      sweeps_.setAverages(used_->projection);
  }
  if (bounds_)
    prepareBounded();
}

LinearOutcome AveragedClothSolver::solve(PointVector& d, long& linear_iterations, long&, double tolerance)
{
  if (!independent())
    return LinearOutcome::not_definite;
  setRight(d);
  if (!sweeps_.set(1.0 + system_.viscosity(), system_.held()))
    return LinearOutcome::not_definite;
  return search(d, tolerance > 0 ? tolerance : linear_tolerance_, 0.0, linear_iterations);
}

/// The tolerance counts from the load on the cloth, as it does for a cloth without averages: what acts on it without
/// their forces, and what it takes to move them.
LinearOutcome AveragedClothSolver::solveTo(const Eigen::Matrix3Xd& averages, PointVector& d, long& linear_iterations)
{
  if (!independent())
    return LinearOutcome::not_definite;
  setRight(d);
  if (!sweeps_.set(1.0 + system_.viscosity(), system_.held()))
    return LinearOutcome::not_definite;
  const double load = sweeps_.norm(right_);
  for (std::size_t i = 0; i < d.size(); ++i)
    product_[i] = system_.start()[i] + d[i];
  setGap(averages, product_);
  used_->projection.solve(gap_);
  std::fill(correction_.begin(), correction_.end(), 0.0);
  used_->projection.addMotion(1.0, gap_, correction_);
  system_.applyMatrix(correction_, product_);
  clearHeld(product_);
  const double moving = pointKernels().dot(points(), correction_.data(), product_.data());
  if (!(load >= 0 && moving >= 0))
    return LinearOutcome::not_definite;
  for (std::size_t i = 0; i < d.size(); ++i)
  {
    d[i] += correction_[i];
    right_[i] -= product_[i];
  }
  return search(d, linear_tolerance_, std::sqrt(load * load + moving), linear_iterations);
}

/// Solves for what is left of the equations in right_. `load`: see ProjectedSweeps::solve().
LinearOutcome AveragedClothSolver::search(PointVector& d, double tolerance, double load, long& linear_iterations)
{
  const LinearResult result =
      sweeps_.solve(right_, correction_, tolerance, iterationsWithin(kMostLinearIterations), load);
  return correct(d, result, tolerance, load, linear_iterations);
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
}

void AveragedClothSolver::meetAverages(const Eigen::Matrix3Xd& averages, PointVector& x)
{
  constexpr double kRounding = 4e-15;    // of the coordinates: what is left after a solve
  for (int pass = 0; pass < 2; ++pass)   // of averages that nearly depend on each other one leaves more
  {
    setGap(averages, x);
    if ((averages - averages_now_).cwiseAbs().maxCoeff() <= kRounding * averages.cwiseAbs().maxCoeff())
      return;
    used_->projection.solve(gap_);
    used_->projection.addMotion(1.0, gap_, x);
  }
}

void AveragedClothSolver::balanceAverages(Eigen::Matrix3Xd& forces, bool response)
{
  using Entry = Eigen::SparseMatrix<double, Eigen::RowMajor>::InnerIterator;
  forces.resize(3, count());
  if (bounds_ && !response)
    for (const int i : bounds_->at)
      for (Entry entry(*used_->prescribed->weights, i); entry; ++entry)
        point(system_.gradient(), entry.col()) -= entry.value() * bounds_->forces.col(i);
  used_->projection.multipliers(system_.gradient(), multipliers_);
  for (Eigen::Index i = 0; i < forces.cols(); ++i)
  {
    forces.col(i) = point(multipliers_, i);
    for (Entry entry(*used_->prescribed->weights, i); entry; ++entry)   // what holds the cloth bears its share
      point(system_.gradient(), entry.col()) -= entry.value() * forces.col(i);
  }
  if (bounds_ && !response)
    forces = bounds_->forces;
}

}   // namespace slender
