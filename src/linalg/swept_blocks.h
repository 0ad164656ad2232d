#pragma once

#include <vector>

#include "linalg/deflation.h"
#include "slender_sim/linalg/block_matrix.h"
#include "slender_sim/linalg/point_kernel.h"

namespace slender {

/// The largest size of a number, 0 of none.
double largestEntry(const PointVector& v);

/// The numbers of a SweptMatrix.
template <class Scalar>
struct SweptValues
{
  AlignedVector<Scalar> blocks, diagonal, inverse;
};

/// The matrix A + factor B of SymmetricSweeps and ProjectedSweeps in the order in which sweeps visit its points. Each
/// point comes after its neighbours of lower number, so that points visited in turn seldom wait for each other. `visit`
/// is the number of a point in this order.
class SweptBlocks
{
public:
  /// `b`: null for none. Both must outlive this, and keep their patterns.
  void setPattern(const BlockMatrix& a, const PointMatrix* b);
  /// Takes the values as they are now; see SymmetricSweeps::set().
  void set(double factor, const std::vector<char>& held, const std::vector<char>* apart);

  int points() const { return static_cast<int>(order_.size()); }
  /// Lower triangle by columns, without diagonal blocks: the rows of the point v are rows()[starts()[v]] ..
  /// rows()[starts()[v + 1] - 1].
  const std::vector<int>& starts() const { return starts_; }
  const std::vector<int>& rows() const { return rows_; }
  /// Number of a point in A.
  int pointAt(int visit) const { return order_[visit]; }
  bool isHeld(int visit) const { return (*held_)[order_[visit]] != 0; }
  /// Of each point whether it takes part in common motions.
  const std::vector<char>& moves() const { return moves_; }

  /// A block of the lower triangle; `entry` counts as rows() do.
  Eigen::Matrix3d block(int entry) const;
  Eigen::Matrix3d diagonal(int visit) const;
  /// Copies the matrix, and adds it to `deflation` (null: none) after its begin(). In `values` the blocks of held
  /// points are zero.
  template <class Scalar>
  void pack(SweptValues<Scalar>& values, Deflation* deflation) const;
  /// `values`: of pack().
  template <class Scalar>
  SweptMatrix<Scalar> matrixOf(const SweptValues<Scalar>& values) const
  {
    return {
        points(), starts_.data(), rows_.data(), values.blocks.data(), values.diagonal.data(), values.inverse.data()};
  }
  /// product := (A + factor B) x, both in the order of A.
  void multiply(const PointVector& x, PointVector& product) const;

  void toVisits(const PointVector& from, PointVector& to) const;
  /// The fourth number of each point stays as it is.
  template <class Vector>
  void fromVisits(const Vector& from, PointVector& to) const
  {
    for (int v = 0; v < points(); ++v)
      std::copy_n(from.data() + 4 * static_cast<std::size_t>(v), 3,
                  to.data() + 4 * static_cast<std::size_t>(order_[v]));
  }

private:
  void orderPoints();

  const BlockMatrix* a_ = nullptr;
  const PointMatrix* b_ = nullptr;
  double factor_ = 0;
  const std::vector<char>* held_ = nullptr;
  std::vector<int> order_, starts_, rows_;
  std::vector<int> a_entry_, b_entry_;   ///< of each block of the lower triangle in A and B, -1: none
  std::vector<int> b_diagonal_;          ///< -1: none
  std::vector<char> moves_;
};

}   // namespace slender
