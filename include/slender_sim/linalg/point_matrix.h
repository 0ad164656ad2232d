#pragma once

#include <vector>

#include <Eigen/Core>
#include <Eigen/SparseCore>

#include "slender_sim/linalg/banded_ldlt.h"

namespace slender {

/// Vectors of n points for the hot loops: 4 doubles each (x, y, z, unused), so that a point is one aligned load.
using PointVector = AlignedVector<double>;

inline Eigen::Map<Eigen::Vector3d> point(PointVector& v, Eigen::Index i)
{
  return Eigen::Map<Eigen::Vector3d>(v.data() + 4 * i);
}
inline Eigen::Map<const Eigen::Vector3d> point(const PointVector& v, Eigen::Index i)
{
  return Eigen::Map<const Eigen::Vector3d>(v.data() + 4 * i);
}
/// Takes memory only where `to` is shorter.
void toPoints(const Eigen::Matrix3Xd& from, PointVector& to);
void fromPoints(const PointVector& from, Eigen::Matrix3Xd& to);

/// Sparse symmetric n x n matrix that acts on the three coordinates of n points alike.
class PointMatrix
{
public:
  PointMatrix() = default;
  /// Entries of the whole matrix, which must be symmetric; equal indices are summed. Throws std::invalid_argument if it
  /// is not symmetric.
  PointMatrix(int size, const std::vector<Eigen::Triplet<double>>& entries);

  int size() const { return static_cast<int>(starts_.size()) - 1; }
  /// Row i has the entries starts()[i] .. starts()[i + 1] - 1, by ascending columns.
  const std::vector<int>& starts() const { return starts_; }
  int column(int entry) const { return static_cast<int>(offsets_[entry] / 4); }
  /// Four times the columns.
  const AlignedVector<unsigned>& offsets() const { return offsets_; }
  const AlignedVector<double>& values() const { return values_; }
  Eigen::SparseMatrix<double> toEigen() const;

  /// y = A x for points (4 doubles each; unused ones become zero). Returns x . y.
  double multiply(const double* x, double* y) const;
  /// y += factor A x. Returns x . A x.
  double addProduct(double factor, const double* x, double* y) const;
  /// What a product must at least move between memory and processor: matrix, x, y [bytes].
  double bytes() const;

private:
  std::vector<int> starts_{0};
  AlignedVector<unsigned> offsets_;   ///< of the columns' points in a PointVector
  AlignedVector<double> values_;
};

}   // namespace slender
