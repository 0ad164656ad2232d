#pragma once

#include <vector>

#include <Eigen/Core>
#include <Eigen/SparseCore>

#include "slender_sim/linalg/point_matrix.h"
#include "slender_sim/linalg/sparse_cholesky.h"

namespace slender {

/// Weighted averages C x of points x, and the metric of the points' masses W. Of all displacements that change the
/// averages by g, W^-1 C^T (C W^-1 C^T)^-1 g has the least sum of mass times distance squared.
///
/// Vectors of points and of averages have four numbers per point or average, the last of them unused.
class AverageProjection
{
public:
  using Averages = Eigen::SparseMatrix<double, Eigen::RowMajor>;

  /// c: averages x points; must outlive it.
  explicit AverageProjection(const Averages& c);

  /// For points of these masses [kg], of which isFree(point) may move. False: averages depend on each other on these.
  template <class IsFree>
  bool prepare(const Eigen::Ref<const Eigen::VectorXd>& mass, const IsFree& isFree)
  {
    bool known = true;
    for (Eigen::Index j = 0; j < c_.cols(); ++j)
    {
      const char is_free = isFree(static_cast<int>(j));
      const double give = is_free ? 1.0 / mass[j] : 0.0;
      known = known && free_[j] == is_free && give_[j] == give;
      free_[j] = is_free;
      give_[j] = give;
    }
    if (!known)
      independent_ = factor();
    return independent_;
  }

  int count() const { return static_cast<int>(c_.rows()); }
  const Averages& averages() const { return c_; }
  /// 1 / mass per point, 0 where a point is held.
  const Eigen::VectorXd& give() const { return give_; }

  /// C W^-1 C^T.
  const PointMatrix& gram() const { return gram_; }
  /// mu := (C W^-1 C^T)^-1 mu, for averages.
  void solve(PointVector& mu) const;
  /// g := C x.
  void averagesOf(const PointVector& x, PointVector& g) const;
  /// mu of the forces C^T mu that take the averages' accelerations out of other forces r: C W^-1 (r - C^T mu) = 0.
  void multipliers(const PointVector& r, PointVector& mu) const;
  /// x += factor W^-1 C^T mu.
  void addMotion(double factor, const PointVector& mu, PointVector& x) const;
  /// r += factor C^T mu for free points.
  void addForces(double factor, const PointVector& mu, PointVector& r) const;
  /// Leaves averages (ascending) out: their mu is 0, and nothing is said about their values. prepare() for other free
  /// points takes them in again.
  void leaveOut(const std::vector<int>& averages);
  /// The least displacements (0 where held) that change the averages by these (3 x count); valid until the next call.
  const PointVector& displacements(const Eigen::Matrix3Xd& changes);

private:
  /// Factors C W^-1 C^T over the free points. Returns false if its rows depend on each other.
  bool factor();

  const Averages& c_;
  Eigen::VectorXd give_;
  std::vector<char> free_;   ///< for which factor_ was made, and
  std::vector<char> left_out_;
  PointMatrix gram_;
  SparseCholesky factor_;
  bool independent_ = false;
  PointVector mu_, moved_;
};

}   // namespace slender
