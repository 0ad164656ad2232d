#pragma once

#include "linalg/deflation.h"
#include "linalg/swept_blocks.h"
#include "slender_sim/linalg/conjugate_gradients.h"
#include "slender_sim/linalg/point_kernel.h"

namespace slender {

/// Conjugate gradients for (A + factor B) x = b with blocks A and a matrix B that acts on each coordinate alike,
/// preconditioned by symmetric Gauss-Seidel sweeps, (D + L) D^-1 (D + L^T). An iteration is one sweep down and one up,
/// without a product [Eisenstat, SIAM J. Sci. Stat. Comput. 2 (1981), 1].
///
/// Sweeps find local motions fast. The motions of groups of about fifty points as a whole are left to a direct
/// solution (Deflation), so that iterations grow little with the number of points. Iterations are in single precision;
/// residuals and the sum of the corrections are in double precision (iterative refinement). Where that does not
/// converge, iterations are in double precision, too.
class SymmetricSweeps
{
public:
  SymmetricSweeps() = default;
  SymmetricSweeps(const BlockMatrix& a, const PointMatrix* b) { setPattern(a, b); }

  /// Comes first. `b`: null for none. Both must outlive this, and keep their patterns.
  void setPattern(const BlockMatrix& a, const PointMatrix* b);
  /// The values of A as they are now; right-hand sides and solutions are zero at held points, which must stay where
  /// they are. `apart`: 1 for points that do not take part in common motions, because their unknowns are not
  /// coordinates; null: all points take part.
  void set(double factor, const std::vector<char>& held, const std::vector<char>* apart = nullptr)
  {
    blocks_.set(factor, held, apart);
  }
  /// As ConjugateGradients::solve. No force on a group as a whole is left, so that all points together fall as they
  /// should and keep their momentum.
  LinearResult solve(const PointVector& right_hand_side, PointVector& x, double tolerance, int max_iterations);

private:
  /// The matrix and the vectors of a search, in one precision.
  template <class Scalar>
  struct Search
  {
    SweptValues<Scalar> matrix;
    AlignedVector<Scalar> x, r, z, p, t, q;
    AlignedVector<Scalar> group_blocks, transposed_blocks, groups;   ///< as GroupBlocks has them
    /// What a search can take from a residual before rounding errors spoil it.
    static constexpr double kLeast = std::is_same_v<Scalar, float> ? 1e-5 : 1e-13;
  };

  enum class SearchEnd
  {
    solved,   ///< or stopped
    stalled,
    not_definite
  };

  template <class Scalar>
  void pack(Search<Scalar>& s);
  template <class Scalar>
  GroupBlocks<Scalar> groupsOf(Search<Scalar>& s) const
  {
    return {deflation_.starts().data(), deflation_.columns().data(), s.group_blocks.data(), s.transposed_blocks.data(),
            s.groups.data()};
  }
  void leave(PointVector& x);
  template <class Scalar>
  double load(Search<Scalar>& s, const PointVector& from, double size);
  template <class Scalar>
  double normOf(Search<Scalar>& s, const PointVector& r);
  template <class Scalar>
  void deflate(Search<Scalar>& s);
  template <class Scalar>
  bool begin(Search<Scalar>& s, LinearResult& result);
  template <class Scalar, class Between, class Advanced>
  SearchEnd iterate(Search<Scalar>& s, const GroupBlocks<Scalar>& groups, double square, double scale, double tolerance,
                    int max_iterations, LinearResult& result, Between&& between, Advanced&& advanced);
  template <class Scalar>
  SearchEnd negative(const Search<Scalar>& s, double curvature) const;
  template <class Scalar>
  SearchEnd refine(Search<Scalar>& s, PointVector& x, double tolerance, int max_iterations, LinearResult& result);

  SweptBlocks blocks_;   ///< Points are numbered as it visits them.
  Deflation deflation_;
  Search<float> single_;
  Search<double> double_;
  PointVector product_;                       ///< in the order of A
  PointVector right_, residual_, solution_;   ///< in the order of visits
  PointVector common_, common_sum_;           ///< motions of groups
};

}   // namespace slender
