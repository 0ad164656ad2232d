#pragma once

#include "linalg/average_projection.h"
#include "linalg/swept_blocks.h"
#include "slender_sim/linalg/conjugate_gradients.h"

namespace slender {

/// Conjugate gradients for (A + factor B) x = b among the x that leave weighted averages of the points alone, C x = 0.
/// The preconditioner is a symmetric Gauss-Seidel sweep between two projections in the metric of the points' masses
/// (AverageProjection): forces lose what the averages balance, motions what moves the averages. Where averages have
/// local weights, this projection is as good for large motions as a direct solution, and sweeps find local motions, so
/// that iterations do not grow with the number of points. Where there are fewer averages than groups of points, groups
/// move as a whole, too (Deflation).
///
/// As in SymmetricSweeps, iterations are in single precision, with iterative refinement.
class ProjectedSweeps
{
public:
  /// Comes first. `b`: null for none. Both must outlive this, and keep their patterns.
  void setPattern(const BlockMatrix& a, const PointMatrix* b);
  /// Takes the averages and the free points after prepare(). The projection must outlive its use.
  void setAverages(const AverageProjection& projection);
  /// As SymmetricSweeps::set(). Returns false if the matrix is not positive definite on groups of points.
  bool set(double factor, const std::vector<char>& held, const std::vector<char>* apart = nullptr);
  /// Of a load as if there were no averages: sqrt(r . P r), where P is a sweep alone. Negative or not a number where
  /// the matrix is not definite.
  double norm(const PointVector& r);
  /// As ConjugateGradients::solve, but the tolerance counts from `load` if that is positive. At most a fifth of what is
  /// left at the start may be left: near equilibrium a load that the averages hold stays, and errors of one step must
  /// not outlive the next. Where averages hold large motions, it counts from three times the load: errors of positions
  /// are then still smaller than those of the same cloth without averages (study tracking_overhead).
  LinearResult solve(const PointVector& right_hand_side, PointVector& x, double tolerance, int max_iterations,
                     double load);

private:
  template <class Scalar>
  struct Rows
  {
    std::vector<int> starts, columns;
    AlignedVector<Scalar> values;
    PointRows<Scalar> view() const
    {
      return {static_cast<int>(starts.size()) - 1, starts.data(), columns.data(), values.data()};
    }
  };
  /// The matrix and the vectors of a search, in one precision.
  template <class Scalar>
  struct Search
  {
    SweptValues<Scalar> matrix;
    AlignedVector<Scalar> x, r, z, p, q, averages;
    Rows<Scalar> of_forces, of_motions;   ///< C W^-1 and C
    Rows<Scalar> forces, motions;         ///< C^T and W^-1 C^T
    bool packed = false;                  ///< since set()
    static constexpr double kLeast = std::is_same_v<Scalar, float> ? 1e-5 : 1e-13;
  };
  enum class SearchEnd
  {
    solved,   ///< or stopped
    stalled,
    not_definite
  };
  /// What a curvature or square means that is negative or not a number: in single precision it may be a rounding error.
  template <class Scalar>
  static constexpr SearchEnd kNegative = std::is_same_v<Scalar, float> ? SearchEnd::stalled : SearchEnd::not_definite;

  template <class Scalar>
  void setRows(Search<Scalar>& s);
  template <class Scalar>
  void pack(Search<Scalar>& s, Deflation* deflation);
  template <class Scalar>
  void takeOut(Search<Scalar>& s, const Rows<Scalar>& averages, const Rows<Scalar>& back, AlignedVector<Scalar>& v);
  void takeOut(PointVector& r);
  template <class Scalar>
  double precondition(Search<Scalar>& s, bool projected);
  template <class Scalar>
  double load(Search<Scalar>& s, double size, bool projected);
  template <class Scalar>
  SearchEnd iterate(Search<Scalar>& s, double square, double scale, double tolerance, int max_iterations,
                    LinearResult& result);
  template <class Scalar>
  SearchEnd refine(Search<Scalar>& s, PointVector& x, double tolerance, int max_iterations, double load,
                   LinearResult& result);

  SweptBlocks blocks_;   ///< Points are numbered as it visits them.
  Deflation deflation_;
  const AverageProjection* projection_ = nullptr;
  bool grouped_ = false;   ///< Groups move as a whole.
  Search<float> single_;
  Search<double> double_;
  PointVector right_, residual_, product_;   ///< in the order of A
  PointVector mu_, common_;
};

}   // namespace slender
