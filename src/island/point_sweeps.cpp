#include "island/point_sweeps.h"

#include <algorithm>

namespace slender {

void PointSweeps::setPattern(const std::vector<int>& starts, const std::vector<int>& rows,
                             const std::vector<char>& turns)
{
  turns_ = turns;
  held_.assign(turns.size(), 0);
  places_.resize(rows.size());
  std::vector<int> block_starts{0}, block_rows, column;
  for (std::size_t j = 0; j < turns.size(); ++j)
  {
    column.clear();
    for (int k = starts[3 * j]; k < starts[3 * j + 3]; ++k)
      if (column.empty() || column.back() != rows[k] / 3)
        column.push_back(rows[k] / 3);
    std::sort(column.begin(), column.end());
    column.erase(std::unique(column.begin(), column.end()), column.end());
    for (int c = 0; c < 3; ++c)
    {
      std::size_t at = 0;
      for (int k = starts[3 * j + c]; k < starts[3 * j + c + 1]; ++k)
      {
        while (column[at] != rows[k] / 3)
          ++at;
        places_[k] = 9 * (block_starts.back() + static_cast<int>(at)) + 3 * c + rows[k] % 3;
      }
    }
    block_rows.insert(block_rows.end(), column.begin(), column.end());
    block_starts.push_back(static_cast<int>(block_rows.size()));
  }
  matrix_ = BlockMatrix(std::move(block_starts), std::move(block_rows));
  sweeps_.setPattern(matrix_, nullptr);
  for (PointVector* v : {&right_, &solution_})
    v->assign(4 * turns.size(), 0.0);
}

LinearResult PointSweeps::solve(const std::vector<double>& values, const std::vector<double>& right, double tolerance,
                                int max_iterations)
{
  for (std::size_t k = 0; k < values.size(); ++k)
    matrix_.values()[places_[k]] = values[k];
  for (int j = 0; j < matrix_.points(); ++j)
  {
    double* diagonal = matrix_.values() + 9 * static_cast<std::size_t>(matrix_.starts()[j]);
    diagonal[3] = diagonal[1];
    diagonal[6] = diagonal[2];
    diagonal[7] = diagonal[5];
    std::copy_n(right.data() + 3 * j, 3, right_.data() + 4 * j);
  }
  sweeps_.set(1.0, held_, &turns_);
  return sweeps_.solve(right_, solution_, tolerance, max_iterations);
}

void PointSweeps::copySolution(double* to) const
{
  for (int j = 0; j < matrix_.points(); ++j)
    std::copy_n(solution_.data() + 4 * j, 3, to + 3 * j);
}

}   // namespace slender
