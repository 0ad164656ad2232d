// Averages of a cloth that are prescribed, and bounds of the forces that may be used for it.
#include <algorithm>
#include <cmath>
#include <limits>

#include "cloth_system.h"

namespace slender {

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
  const auto& c = *model_.averages;
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
  constexpr double kRounding = 4e-15;   // of the coordinates: what is left after one solve, or conjugate gradients that began there
  setGap(averages, x);
  if ((averages - averages_now_).cwiseAbs().maxCoeff() <= kRounding * averages.cwiseAbs().maxCoeff())
    return;
  std::fill(right_.begin(), right_.end(), 0.0);
  averages_->solve(right_.data(), gap_.data(), correction_.data(), multipliers_.data());
  for (std::size_t i = 0; i < x.size(); ++i)
    x[i] += correction_[i];
}

void ClothSystem::balanceAverages(Eigen::Matrix3Xd& forces, bool response)
{
  forces.resize(3, model_.averageCount());
  if (bounds_ && !response)
    for (const int i : bounds_->at)
      for (Eigen::SparseMatrix<double, Eigen::RowMajor>::InnerIterator entry(*model_.averages, i); entry; ++entry)
        point(gradient_, entry.col()) -= entry.value() * bounds_->forces.col(i);
  std::copy(gradient_.begin(), gradient_.end(), right_.begin());
  clearHeld(right_);
  averages_->multipliers(right_.data(), multipliers_.data());
  takeOutAverages(gradient_);
  for (Eigen::Index i = 0; i < forces.cols(); ++i)
    forces.col(i) = point(multipliers_, i);
  if (bounds_ && !response)
    forces = bounds_->forces;
}

/// z = P r, among directions that leave the averages alone. What the averages balance is taken out of r, where it would drown the rest in rounding errors
/// [Gould, Hribar, Nocedal, SIAM J. Sci. Comput. 23 (2001), 5].
void ClothSystem::preconditionWithin(PointVector& r, PointVector& z)
{
  averages_->solve(r.data(), nullptr, z.data(), multipliers_.data());
  takeOutAverages(r);
}

/// Before conjugate gradients with averages: takes out of right_ what these balance. With `averages` d is moved there, and on by a step of the
/// preconditioned gradient, which comes for nothing; returns what the load on the cloth was without the forces of the averages, which the tolerance counts
/// from as it does for a cloth without. Where cloth is strained so much that the step leads uphill, it is far stiffer than the preconditioner: then
/// that load says nothing about motions. d is moved by the least, and the tolerance counts from what is left: 0.
double ClothSystem::takeFirstStep(PointVector& d, const Eigen::Matrix3Xd* averages)
{
  if (!averages)
  {
    averages_->multipliers(right_.data(), multipliers_.data());
    takeOutAverages(right_);
    return 0.0;
  }
  for (std::size_t i = 0; i < d.size(); ++i)
    product_[i] = start_[i] + d[i];
  setGap(*averages, product_);
  const ConstrainedCholesky::Norms norms = averages_->solve(right_.data(), gap_.data(), correction_.data(), multipliers_.data());
  takeOutAverages(right_);
  applyMatrix(correction_, product_);
  clearHeld(product_);
  const bool downhill = pointKernels().dot(points(), correction_.data(), product_.data()) < 2.0 * norms.step * norms.step;
  if (!downhill)
  {
    std::fill(correction_.begin(), correction_.end(), 0.0);
    averages_->solve(correction_.data(), gap_.data(), correction_.data(), multipliers_.data());
    applyMatrix(correction_, product_);
    clearHeld(product_);
  }
  for (std::size_t i = 0; i < d.size(); ++i)
  {
    d[i] += correction_[i];
    right_[i] -= product_[i];
  }
  return downhill ? norms.load : 0.0;
}

/// As solve() of a linearised step, but forces of averages are at most their bounds: what the step minimises gets bound times |target - average|
/// for each instead of the condition that both are the same. An average is either met, or its force is at the bound and points from it to its target.
/// Where no bound is reached that is solve().
bool ClothSystem::solveBounded(PointVector& d, const Eigen::Matrix3Xd& averages, std::vector<int>& at_bound, int& linear_iterations)
{
  AverageBounds& b = *bounds_;
  const Eigen::VectorXd& most = model_.average_bounds;
  b.at.clear();
  averages_->leaveOut(b.at);
  if (at_bound.empty())
  {
    int factorizations = 0;
    b.first_guess = d;
    std::fill(b.taken.begin(), b.taken.end(), 0.0);
    if (!solve(d, nullptr, linear_iterations, factorizations, 0.0, &averages))
      return false;
    bool within = true;
    for (int i = 0; i < averages_->count(); ++i)
    {
      b.forces.col(i) = -point(b.taken, i);
      within = within && b.forces.col(i).norm() <= most[i];
    }
    if (within)
      return true;
    d = b.first_guess;
  }
  else if (!independent_ || !preconditioned_)
    return false;
  return minimizeBounded(d, averages, at_bound, linear_iterations);
}

/// By steps of the preconditioned gradient, with the averages and their bounds solved exactly for the preconditioner (proximal gradient method, accelerated
/// [Beck & Teboulle, SIAM J. Imaging Sci. 2 (2009), 183] and restarted [O'Donoghue & Candes, Found. Comput. Math. 15 (2015), 715]). Newton's method, which has
/// to guess the set of those at their bounds, did not settle where distances are small; here forces keep their bounds whatever is left to converge.
bool ClothSystem::minimizeBounded(PointVector& d, const Eigen::Matrix3Xd& averages, std::vector<int>& at_bound, int& linear_iterations)
{
  constexpr int kMostIterations = 500;
  constexpr double kSteepest = 1e6;   // of the preconditioner
  AverageBounds& b = *bounds_;
  const Eigen::VectorXd& most = model_.average_bounds;
  const PointKernels& kernels = pointKernels();
  const double tolerance = 1e-2 * linear_tolerance_;
  std::fill(b.pulls.begin(), b.pulls.end(), 0.0);
  applyMatrix(d, b.image);
  b.before = d;
  b.image_before = b.image;
  double l = 1.0, t = 1.0, reference = 0.0;
  for (int iteration = 0; iteration < kMostIterations; ++iteration)
  {
    const double next = 0.5 * (1.0 + std::sqrt(1.0 + 4.0 * t * t)), carry = (t - 1.0) / next;
    t = next;
    for (std::size_t i = 0; i < d.size(); ++i)   // the point to step from, and its image
    {
      const double x = d[i] + carry * (d[i] - b.before[i]), image = b.image[i] + carry * (b.image[i] - b.image_before[i]);
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
    for (;; l *= 2.0)
    {
      const ConstrainedCholesky::Norms norms =
        averages_->solveBounded(right_.data(), gap_.data(), most.data(), l, tolerance, correction_.data(), b.pulls.data());
      step = norms.step;
      reference = iteration == 0 ? norms.load : reference;
      applyMatrix(correction_, product_);
      const double curvature = kernels.dot(points(), correction_.data(), product_.data());
      if (!std::isfinite(curvature) || l > kSteepest)
        return false;
      if (curvature <= 1.0001 * step * step / l)
        break;
    }
    ++linear_iterations;
    averages_->addForces(b.pulls.data(), right_.data());
    double along = 0.0;
    for (std::size_t i = 0; i < d.size(); ++i)
    {
      d[i] += correction_[i];
      b.image[i] += product_[i];
      along += right_[i] * (d[i] - b.before[i]);
    }
    if (step <= linear_tolerance_ * reference)
      break;
    if (along < 0.0)
      t = 1.0;
  }
  at_bound.clear();
  for (int i = 0; i < averages_->count(); ++i)
  {
    b.forces.col(i) = point(b.pulls, i);
    if (b.forces.col(i).norm() > (1.0 - 1e-9) * most[i])
      at_bound.push_back(i);
  }
  b.at = at_bound;
  averages_->leaveOut(b.at);
  return true;
}

}  // namespace slender
