#pragma once

#include <memory>
#include <vector>

#include "linalg/projected_sweeps.h"
#include "linalg/symmetric_sweeps.h"

namespace slender {

/// Solves linear equations with a sparse symmetric matrix by SymmetricSweeps. Each three consecutive unknowns are one
/// point of the sweeps: the coordinates of a vertex or of a body's origin, or the rotation vector of a body. If the
/// last unknowns are multipliers of averages of the points, ProjectedSweeps solves the equations.
class PointSweeps
{
public:
  PointSweeps() = default;
  PointSweeps(const PointSweeps&) = delete;
  PointSweeps& operator=(const PointSweeps&) = delete;

  /// `starts`, `rows`: the lower triangle of the pattern by columns, as in SparseCholesky, with ascending rows.
  /// `masses`: one entry per point [kg], 0 if its unknowns are a rotation vector. All unknowns after those of the
  /// points are multipliers, three per average, which has the same weights for all three coordinates of a point.
  void setPattern(const std::vector<int>& starts, const std::vector<int>& rows, const std::vector<double>& masses);
  /// `values` has one number per entry of the pattern, and `right` one per unknown, which is 0 for multipliers.
  /// `tolerance` is relative to the right-hand side, with averages to its projection. The solution is kept until the
  /// next call.
  LinearResult solve(const std::vector<double>& values, const std::vector<double>& right, double tolerance,
                     int max_iterations);
  void copySolution(double* to) const;

private:
  /// An entry of the averages' matrix.
  struct Weight
  {
    int average, point, entry;   ///< `entry`: of the pattern
  };

  bool takeAverages(const std::vector<double>& values);
  LinearResult solveProjected(double tolerance, int max_iterations);

  BlockMatrix matrix_;
  std::vector<int> places_;   ///< where the value of each entry of the points' columns lies in matrix_; -1: nowhere
  std::vector<char> held_, turns_;
  SymmetricSweeps sweeps_;
  PointVector right_, solution_;

  // ---- averages
  std::vector<Weight> weights_;
  Eigen::VectorXd masses_;
  AverageProjection::Averages averages_;
  std::unique_ptr<AverageProjection> projection_;   ///< of averages_
  bool averages_known_ = false;                     ///< projected_ has them
  ProjectedSweeps projected_;
  PointVector multipliers_;
};

}   // namespace slender
