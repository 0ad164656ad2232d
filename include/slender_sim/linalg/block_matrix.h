#pragma once

#include <vector>

#include <Eigen/Core>

#include "slender_sim/linalg/point_matrix.h"

namespace slender {

/// Sparse symmetric matrix of 3 x 3 blocks, one row of blocks per point, whose pattern is fixed: the pairs of points
/// that share an element. Lower triangle by columns, the diagonal block first; blocks are stored by columns.
class BlockMatrix
{
public:
  BlockMatrix() = default;
  /// Elements by their points, one column each; several kinds with different numbers of points.
  BlockMatrix(int points, const std::vector<Eigen::MatrixXi>& elements);
  /// By its pattern: column j has the blocks starts[j] .. starts[j + 1] - 1, with ascending rows from j on.
  BlockMatrix(std::vector<int> starts, std::vector<int> rows);

  int points() const { return static_cast<int>(starts_.size()) - 1; }
  int blocks() const { return static_cast<int>(rows_.size()); }
  const std::vector<int>& starts() const { return starts_; }
  const std::vector<int>& rows() const { return rows_; }
  double* values() { return values_.data(); }
  const double* values() const { return values_.data(); }

  /// Number of the block with these points; -1: not in the pattern.
  int block(int a, int b) const;
  /// Where the blocks of an element go: for its points p >= q in the order (0,0) (1,0) (1,1) (2,0) ... twice the
  /// block's number, plus 1 where the block to add must be transposed.
  std::vector<int> slots(const Eigen::MatrixXi& elements) const;

  void setZero();
  /// += factor A for each coordinate; the pattern must hold that of A. map: from mapOf(A).
  void add(double factor, const PointMatrix& matrix, const std::vector<int>& map);
  /// Block of each entry of A on or below the diagonal, -1 above. Throws std::invalid_argument if the pattern lacks
  /// one.
  std::vector<int> mapOf(const PointMatrix& matrix) const;
  /// y += A x (4 doubles per point).
  void addProduct(const double* x, double* y) const;

private:
  std::vector<int> starts_{0}, rows_;
  AlignedVector<double> values_;   ///< four more than blocks, for wide loads
};

}   // namespace slender
