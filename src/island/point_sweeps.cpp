#include "island/point_sweeps.h"

#include <algorithm>
#include <limits>

namespace slender {

void PointSweeps::setPattern(const std::vector<int>& starts, const std::vector<int>& rows,
                             const std::vector<double>& masses)
{
  const std::size_t points = masses.size();
  const int unknowns = 3 * static_cast<int>(points);
  held_.assign(points, 0);
  turns_.assign(points, 0);
  weights_.clear();
  places_.assign(static_cast<std::size_t>(starts[unknowns]), -1);
  std::vector<int> block_starts{0}, block_rows, column;
  for (std::size_t j = 0; j < points; ++j)
  {
    turns_[j] = masses[j] == 0.0;
    column.clear();
    for (int k = starts[3 * j]; k < starts[3 * j + 3]; ++k)
      if (rows[k] < unknowns && (column.empty() || column.back() != rows[k] / 3))
        column.push_back(rows[k] / 3);
    std::sort(column.begin(), column.end());
    column.erase(std::unique(column.begin(), column.end()), column.end());
    for (int c = 0; c < 3; ++c)
    {
      std::size_t at = 0;
      for (int k = starts[3 * j + c]; k < starts[3 * j + c + 1] && rows[k] < unknowns; ++k)
      {
        while (column[at] != rows[k] / 3)
          ++at;
        places_[k] = 9 * (block_starts.back() + static_cast<int>(at)) + 3 * c + rows[k] % 3;
      }
    }
    for (int k = starts[3 * j]; k < starts[3 * j + 1]; ++k)   // All coordinates have the same weights.
      if (rows[k] >= unknowns)
        weights_.push_back({(rows[k] - unknowns) / 3, static_cast<int>(j), k});
    block_rows.insert(block_rows.end(), column.begin(), column.end());
    block_starts.push_back(static_cast<int>(block_rows.size()));
  }
  matrix_ = BlockMatrix(std::move(block_starts), std::move(block_rows));
  for (PointVector* v : {&right_, &solution_})
    v->assign(4 * points, 0.0);
  const int averages = (static_cast<int>(starts.size()) - 1 - unknowns) / 3;
  multipliers_.assign(4 * static_cast<std::size_t>(averages), 0.0);
  averages_known_ = false;
  if (averages == 0)
    sweeps_.setPattern(matrix_, nullptr);
  else
    projected_.setPattern(matrix_, nullptr);
  masses_ = Eigen::Map<const Eigen::VectorXd>(masses.data(), static_cast<Eigen::Index>(points));
}

LinearResult PointSweeps::solve(const std::vector<double>& values, const std::vector<double>& right, double tolerance,
                                int max_iterations)
{
  for (std::size_t k = 0; k < places_.size(); ++k)
    if (places_[k] >= 0)
      matrix_.values()[places_[k]] = values[k];
  for (int j = 0; j < matrix_.points(); ++j)
  {
    double* diagonal = matrix_.values() + 9 * static_cast<std::size_t>(matrix_.starts()[j]);
    diagonal[3] = diagonal[1];
    diagonal[6] = diagonal[2];
    diagonal[7] = diagonal[5];
    std::copy_n(right.data() + 3 * j, 3, right_.data() + 4 * j);
  }
  if (multipliers_.empty())
  {
    sweeps_.set(1.0, held_, &turns_);
    return sweeps_.solve(right_, solution_, tolerance, max_iterations);
  }
  LinearResult failed;
  failed.residual = std::numeric_limits<double>::infinity();
  return takeAverages(values) ? solveProjected(tolerance, max_iterations) : failed;
}

/// Takes the averages of the pattern once. Returns false if they depend on each other.
bool PointSweeps::takeAverages(const std::vector<double>& values)
{
  if (averages_known_)
    return true;
  std::vector<Eigen::Triplet<double>> entries;
  for (const Weight& w : weights_)
    entries.emplace_back(w.average, w.point, values[w.entry]);
  averages_.resize(static_cast<Eigen::Index>(multipliers_.size() / 4), matrix_.points());
  averages_.setFromTriplets(entries.begin(), entries.end());
  projection_ = std::make_unique<AverageProjection>(averages_);
  averages_known_ = projection_->prepare(masses_, [this](int j) { return !turns_[j]; });
  if (averages_known_)
    projected_.setAverages(*projection_);
  return averages_known_;
}

/// With the multipliers m of C x = 0, the equations are A x + C^T m = right.
LinearResult PointSweeps::solveProjected(double tolerance, int max_iterations)
{
  LinearResult result;
  result.definite = projected_.set(1.0, held_, &turns_);
  if (!result.definite)
    return result;
  result = projected_.solve(right_, solution_, tolerance, max_iterations, 0.0);
  for (double& force : right_)
    force = -force;
  matrix_.addProduct(solution_.data(), right_.data());
  projection_->multipliers(right_, multipliers_);
  for (double& m : multipliers_)
    m = -m;
  return result;
}

void PointSweeps::copySolution(double* to) const
{
  for (int j = 0; j < matrix_.points(); ++j)
    std::copy_n(solution_.data() + 4 * j, 3, to + 3 * j);
  for (std::size_t i = 0; 4 * i < multipliers_.size(); ++i)
    std::copy_n(multipliers_.data() + 4 * i, 3, to + 3 * (matrix_.points() + i));
}

}   // namespace slender
