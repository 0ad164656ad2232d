#include "linalg/average_projection.h"

#include <algorithm>
#include <cmath>

namespace slender {

namespace {

using Entry = AverageProjection::Averages::InnerIterator;

}   // namespace

AverageProjection::AverageProjection(const Averages& c)
  : c_(c),
    give_(Eigen::VectorXd::Zero(c.cols())),
    free_(static_cast<std::size_t>(c.cols()), 2),
    left_out_(static_cast<std::size_t>(c.rows()), 0),
    mu_(4 * static_cast<std::size_t>(c.rows()), 0.0),
    moved_(4 * static_cast<std::size_t>(c.cols()), 0.0)
{
}

bool AverageProjection::factor()
{
  std::fill(left_out_.begin(), left_out_.end(), 0);
  // A row depends on the others if its pivot is a smaller share of the largest entry than this.
  constexpr double kLeast = 1e-12;
  Averages rooted = c_;
  for (Eigen::Index i = 0; i < c_.rows(); ++i)
    for (Averages::InnerIterator entry(rooted, i); entry; ++entry)
      entry.valueRef() *= std::sqrt(give_[entry.col()]);
  const Averages gram = rooted * rooted.transpose();
  std::vector<Eigen::Triplet<double>> entries;
  double largest = 0.0;
  for (Eigen::Index i = 0; i < gram.rows(); ++i)
    for (Entry entry(gram, i); entry; ++entry)
    {
      entries.emplace_back(i, entry.col(), entry.value());
      largest = std::max(largest, entry.value());
    }
  const std::vector<int> starts = gram_.starts();
  gram_ = PointMatrix(count(), entries);
  if (gram_.starts() != starts)   // Held points leave zeros, so that the pattern stays.
    factor_.setPattern(gram_);
  if (!factor_.factor(gram_, nullptr))
    return false;
  for (int i = 0; i < count(); ++i)
    if (!(factor_.pivot(i) > kLeast * largest))
      return false;
  return true;
}

void AverageProjection::leaveOut(const std::vector<int>& averages)
{
  bool changed = false;
  for (int i = 0; i < count(); ++i)
  {
    const char is_left_out = std::binary_search(averages.begin(), averages.end(), i);
    changed = changed || is_left_out != left_out_[static_cast<std::size_t>(i)];
    left_out_[static_cast<std::size_t>(i)] = is_left_out;
  }
  if (independent_ && changed)
    independent_ = factor_.factor(gram_, left_out_.data());
}

void AverageProjection::solve(PointVector& mu) const
{
  for (int i = 0; i < count(); ++i)
    if (left_out_[static_cast<std::size_t>(i)])
      point(mu, i).setZero();
  factor_.solvePoints(mu.data(), mu.data());
}

void AverageProjection::averagesOf(const PointVector& x, PointVector& g) const
{
  for (Eigen::Index i = 0; i < c_.rows(); ++i)
  {
    Eigen::Vector3d sum = Eigen::Vector3d::Zero();
    for (Entry entry(c_, i); entry; ++entry)
      sum += entry.value() * point(x, entry.col());
    point(g, i) = sum;
  }
}

void AverageProjection::multipliers(const PointVector& r, PointVector& mu) const
{
  for (Eigen::Index i = 0; i < c_.rows(); ++i)
  {
    Eigen::Vector3d sum = Eigen::Vector3d::Zero();
    for (Entry entry(c_, i); entry; ++entry)
      sum += entry.value() * give_[entry.col()] * point(r, entry.col());
    point(mu, i) = sum;
  }
  solve(mu);
}

void AverageProjection::addMotion(double factor, const PointVector& mu, PointVector& x) const
{
  for (Eigen::Index i = 0; i < c_.rows(); ++i)
    for (Entry entry(c_, i); entry; ++entry)
      point(x, entry.col()) += factor * entry.value() * give_[entry.col()] * point(mu, i);
}

void AverageProjection::addForces(double factor, const PointVector& mu, PointVector& r) const
{
  for (Eigen::Index i = 0; i < c_.rows(); ++i)
    for (Entry entry(c_, i); entry; ++entry)
      if (free_[entry.col()])
        point(r, entry.col()) += factor * entry.value() * point(mu, i);
}

const PointVector& AverageProjection::displacements(const Eigen::Matrix3Xd& changes)
{
  for (Eigen::Index i = 0; i < c_.rows(); ++i)
    point(mu_, i) = changes.col(i);
  solve(mu_);
  std::fill(moved_.begin(), moved_.end(), 0.0);
  addMotion(1.0, mu_, moved_);
  return moved_;
}

}   // namespace slender
