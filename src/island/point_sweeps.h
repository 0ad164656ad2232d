#pragma once

#include <vector>

#include "slender_sim/linalg/block_matrix.h"
#include "slender_sim/linalg/conjugate_gradients.h"
#include "slender_sim/linalg/symmetric_sweeps.h"

namespace slender {

/// Solves a sparse symmetric matrix whose unknowns are those of points, three each, by SymmetricSweeps.
class PointSweeps
{
public:
  PointSweeps() = default;
  PointSweeps(const PointSweeps&) = delete;
  PointSweeps& operator=(const PointSweeps&) = delete;

  /// The lower triangle of the pattern by columns, as SparseCholesky has it. `turns`: for each point whether its
  /// unknowns are a turn, and not a place.
  void setPattern(const std::vector<int>& starts, const std::vector<int>& rows, const std::vector<char>& turns);
  /// `values`: of the entries of the pattern. The solution stays until the next call.
  LinearResult solve(const std::vector<double>& values, const std::vector<double>& right, double tolerance,
                     int max_iterations);
  void copySolution(double* to) const;

private:
  BlockMatrix matrix_;
  std::vector<int> places_;   ///< of the entries of the pattern in the values of matrix_
  std::vector<char> held_, turns_;
  SymmetricSweeps sweeps_;
  PointVector right_, solution_;
};

}   // namespace slender
