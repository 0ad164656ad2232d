#pragma once

#include <Eigen/Core>
#include <Eigen/SparseCore>

#include "linalg/average_projection.h"

namespace slender {

/// Weighted averages of a part's points that are prescribed: C x = targets (thesis 6.4.3, see WeakConstraints). The
/// averages move uniformly in a step, like everything that is prescribed. The base and the trial of the part always
/// have the averages of the present instant. Directions of Newton's method do not change the averages: the matrix of
/// the island has their multipliers, see Equations.
class AverageConstraints
{
public:
  using Matrix = Eigen::SparseMatrix<double, Eigen::RowMajor>;

  /// c: the matrix C, count x points, whose rows sum to 1. It must outlive the object.
  explicit AverageConstraints(const Matrix& c) : projection_(c), c_(c) {}

  Eigen::Index count() const { return c_.rows(); }

  /// A step begins at x (3 x points [m]) and ends at `targets` (3 x count [m]).
  void begin(const Eigen::Matrix3Xd& x, const Eigen::Matrix3Xd& targets)
  {
    end_ = targets;
    start_.setZero(3, count());   // entry by entry: Eigen's product takes memory
    forEntries([&](Eigen::Index i, int point, double weight) { start_.col(i) += weight * x.col(point); });
    forces.setZero(3, count());
  }
  /// A substep begins: points have these masses [kg], and isFree(point) may move. Returns false if averages depend on
  /// each other on these points.
  template <class IsFree>
  bool prepare(const Eigen::VectorXd& mass, const IsFree& isFree)
  {
    return projection_.prepare(mass, isFree);
  }
  /// The present instant is this fraction of the step.
  void place(double fraction) { at_ = start_ + fraction * (end_ - start_); }
  bool move() const { return start_ != end_; }
  /// Moves free points by the least sum of mass times distance squared, so that the averages are those of the present
  /// instant up to rounding. position(point) returns a position; shift(point, component, length) changes one.
  template <class Position, class Shift>
  void meet(const Position& position, const Shift& shift)
  {
    constexpr double kRounding = 4e-15;   // of the averages' coordinates
    gap_ = at_;
    forEntries([&](Eigen::Index i, int point, double weight) { gap_.col(i) -= weight * position(point); });
    if (gap_.cwiseAbs().maxCoeff() <= kRounding * at_.cwiseAbs().maxCoeff())
      return;
    const PointVector& moved = projection_.displacements(gap_);
    for (int j = 0; j < static_cast<int>(c_.cols()); ++j)
      for (int k = 0; k < 3; ++k)
        if (moved[4 * static_cast<std::size_t>(j) + k] != 0.0)
          shift(j, k, moved[4 * static_cast<std::size_t>(j) + k]);
  }

  /// Calls f(average, point, weight) for all entries of C.
  template <class F>
  void forEntries(F&& f) const
  {
    for (Eigen::Index i = 0; i < c_.rows(); ++i)
      for (Matrix::InnerIterator entry(c_, i); entry; ++entry)
        f(i, static_cast<int>(entry.col()), entry.value());
  }
  /// Adds a change of multipliers, three per average.
  void addMultipliers(const double* change) { forces -= Eigen::Map<const Eigen::Matrix3Xd>(change, 3, count()); }

  /// Forces of the averages on the part (3 x count [N]). The weights spread each force over the points.
  Eigen::Matrix3Xd forces;

private:
  AverageProjection projection_;
  const Matrix& c_;
  Eigen::Matrix3Xd start_, end_, at_, gap_;   ///< averages where the step begins and ends, and now [m]
};

}   // namespace slender
