#pragma once

#include <vector>

#include <Eigen/Core>

#include "slender_sim/linalg/block_matrix.h"
#include "slender_sim/linalg/sparse_cholesky.h"

namespace slender {

/// Common motions of groups of neighbouring points, which conjugate gradients with local preconditioners find last. A
/// deflated search leaves these motions out and solves their equations directly [Saad, Yeung, Erhel and Guyomarc'h,
/// SIAM J. Sci. Comput. 21 (2000), 1909]. W has one column per group and coordinate: one at its points, zero elsewhere.
///
/// The points are those of a matrix A of blocks, numbered as the blocks are: setPattern(), then for each A begin(),
/// addDiagonal() for each point, add() for each block and factor().
class Deflation
{
public:
  /// Lower triangle by columns, without diagonal blocks: the rows of column j are rows[starts[j]] .. rows[starts[j + 1]
  /// - 1]. Takes memory.
  void setPattern(const std::vector<int>& starts, const std::vector<int>& rows);
  /// `moves`: 1 for each point that takes part in the motion of its group.
  void begin(const std::vector<char>& moves);
  void addDiagonal(int point, const Eigen::Matrix3d& block) { add(own_[point], moves_[point], block); }
  /// `entry` counts as `rows` of the pattern.
  void add(int entry, int row, int column, const Eigen::Matrix3d& block)
  {
    add(lower_[entry], moves_[column], block);
    add(upper_[entry], moves_[row], block.transpose());
  }
  /// Factors W^T A W. Returns false if it is not positive definite.
  bool factor();

  int groups() const { return static_cast<int>(common_.starts().size()) - 1; }
  int groupOf(int point) const { return group_[point]; }
  /// A W: its blocks of point i are starts()[i] .. starts()[i + 1] - 1.
  const std::vector<int>& starts() const { return starts_; }
  const std::vector<int>& columns() const { return columns_; }
  const std::vector<double>& blocks() const { return blocks_; }

  /// c := (W^T A W)^-1 c, for groups.
  void solve(PointVector& c) const { factor_.solvePoints(c.data(), c.data()); }
  /// Moves the groups so that no force on a group as a whole is left: x += W c, r -= A W c.
  void correct(PointVector& r, PointVector& x);

private:
  void add(int slot, bool moves, const Eigen::Matrix3d& block)
  {
    if (moves)
      Eigen::Map<Eigen::Matrix3d>(blocks_.data() + 9 * static_cast<std::size_t>(slot)) += block;
  }
  void findGroups(const std::vector<int>& starts, const std::vector<int>& neighbours);
  void setCommonPattern();

  std::vector<int> group_;   ///< of each point
  std::vector<int> starts_{0}, columns_;
  std::vector<double> blocks_;
  /// Where a point's diagonal block, and each block of the lower triangle and its transpose, go in blocks_.
  std::vector<int> own_, lower_, upper_;
  BlockMatrix common_;                ///< W^T A W
  std::vector<int> in_common_;        ///< for each block of A W the block of common_, -1: above the diagonal
  std::vector<char> moves_, still_;   ///< still_: of groups without a point that moves
  SparseCholesky factor_;
  PointVector motion_;
};

}   // namespace slender
