#pragma once

#include <vector>

#include "slender_sim/linalg/block_matrix.h"
#include "slender_sim/linalg/conjugate_gradients.h"
#include "linalg/symmetric_sweeps.h"

namespace slender {

/// Solves linear equations with a sparse symmetric matrix by SymmetricSweeps. Each three consecutive unknowns are one
/// point of the sweeps: the coordinates of a vertex or of a body's origin, or the rotation vector of a body.
class PointSweeps
{
public:
  PointSweeps() = default;
  PointSweeps(const PointSweeps&) = delete;
  PointSweeps& operator=(const PointSweeps&) = delete;

  /// `starts`, `rows`: the lower triangle of the pattern by columns, as in SparseCholesky. `turns`: one entry per
  /// point, 1 if its unknowns are a rotation vector, else 0.
  void setPattern(const std::vector<int>& starts, const std::vector<int>& rows, const std::vector<char>& turns);
  /// `values` has one number per entry of the pattern, and `right` one per unknown. `tolerance` is relative to the
  /// right-hand side. The solution is kept until the next call.
  LinearResult solve(const std::vector<double>& values, const std::vector<double>& right, double tolerance,
                     int max_iterations);
  void copySolution(double* to) const;

private:
  BlockMatrix matrix_;
  std::vector<int> places_;   ///< where the value of each entry of the pattern lies in matrix_
  std::vector<char> held_, turns_;
  SymmetricSweeps sweeps_;
  PointVector right_, solution_;
};

}   // namespace slender
