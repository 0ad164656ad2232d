#pragma once

#include <vector>

#include "cloth_terms.h"
#include "slender_sim/linalg/sparse_cholesky.h"

namespace slender {

/// diag(w) + c A with a constant A that acts on each coordinate alike, held points fixed; factored.
class ShiftedMatrix
{
public:
  ShiftedMatrix() = default;
  explicit ShiftedMatrix(const PointMatrix& a);

  /// `diagonal`: w [n]. False: not positive definite.
  bool factor(const std::vector<double>& diagonal, double c, const std::vector<char>& held);
  /// y += (diag(w) + c A) x, held points as all others.
  void addProduct(const double* x, double* y) const;
  void solve(const PointVector& b, PointVector& x) const { factor_.solvePoints(b.data(), x.data()); }
  const PointMatrix& pattern() const { return a_; }
  const double* values() const { return values_.data(); }
  const SparseCholesky& factorization() const { return factor_; }

private:
  PointMatrix a_;   ///< with a whole diagonal
  std::vector<int> diagonal_;
  AlignedVector<double> values_;
  std::vector<double> weight_;
  double c_ = 0;
  SparseCholesky factor_;
};

/// What preconditions conjugate gradients: mass and rest membrane, as if it acted on each coordinate alike (and
/// bending, where it is not small beside them), factored once. Cloth is far softer along its normals; with align() that
/// part of forces and motions goes by the matrix's own part along the normals, an n x n matrix that is factored each
/// time.
class ClothPreconditioner
{
public:
  /// `pattern`: that of the matrices for align(), which hold all terms but the one with a constant matrix. The model
  /// must outlive this; the terms are read here only.
  ClothPreconditioner(const ClothModel& model, const std::vector<ClothTerm>& terms, const BlockMatrix& pattern);

  /// Weights of inertia [n], factor of the stiffness. False: not positive definite, and not to be applied.
  bool setConstant(const std::vector<double>& weights, double factor, const std::vector<char>& held);
  /// Along the normals at x of the matrix given. Where that is not positive definite, the constant part stands for all.
  void align(const PointVector& x, const BlockMatrix& matrix, const std::vector<char>& held);
  void useConstant() { aligned_ = false; }
  void apply(const PointVector& r, PointVector& z);
  const ShiftedMatrix& constant() const { return constant_; }
  /// Diagonal of the bending at rest, per point [N/m].
  const std::vector<double>& bendingDiagonal() const { return bending_diagonal_; }

private:
  ClothPreconditioner(const ClothModel& model, const std::vector<ClothTerm>& terms, const BlockMatrix& pattern,
                      const PointMatrix& bending);

  const ClothModel& model_;
  ShiftedMatrix constant_;
  std::vector<double> bending_diagonal_;
  double factor_ = 1.0;
  bool aligned_ = false;
  PointMatrix normal_pattern_;
  std::vector<int> normal_block_;   ///< per entry: block of the matrix, -1: none or above the diagonal
  AlignedVector<double> normal_bending_, normal_values_;
  SparseCholesky normal_factor_;
  PointVector normals_, along_, within_;
};

}   // namespace slender
