#pragma once

#include <cmath>
#include <vector>

#include <Eigen/SparseCholesky>
#include <Eigen/SparseCore>

namespace slender {

/// The least displacements of points, by the sum of mass times distance squared, that change weighted averages of them
/// by given amounts.
class AverageProjection
{
public:
  using Averages = Eigen::SparseMatrix<double, Eigen::RowMajor>;

  /// c: averages x points; must outlive it.
  explicit AverageProjection(const Averages& c)
    : c_(c),
      scale_(Eigen::VectorXd::Zero(c.cols())),
      free_(static_cast<std::size_t>(c.cols()), 2),
      rooted_(c),
      pull_(c.rows()),
      solved_(c.rows()),
      moved_(c.cols())
  {
  }

  /// For points of these masses [kg], which are always the same, of which isFree(point) may move. False: averages
  /// depend on each other on these.
  template <class IsFree>
  bool prepare(const Eigen::VectorXd& mass, const IsFree& isFree)
  {
    bool known = true;
    for (Eigen::Index j = 0; j < c_.cols(); ++j)
    {
      const char is_free = isFree(static_cast<int>(j));
      known = known && free_[j] == is_free;
      free_[j] = is_free;
      scale_[j] = is_free ? 1.0 / mass[j] : 0.0;
    }
    if (!known)
      independent_ = factor();
    return independent_;
  }

  /// One coordinate of the displacements (per point, 0 where held), for changes of the averages; valid until the next
  /// call.
  template <class Changes>
  const Eigen::VectorXd& displacements(const Changes& changes)
  {
    pull_ = changes;
    solved_ = factor_.permutationP() * pull_;
    factor_.matrixL().solveInPlace(solved_);
    solved_.array() /= pivots_.array();
    factor_.matrixU().solveInPlace(solved_);
    pull_ = factor_.permutationPinv() * solved_;   // factor_.solve() would take memory
    moved_.setZero();
    for (Eigen::Index i = 0; i < c_.rows(); ++i)
      for (Averages::InnerIterator entry(c_, i); entry; ++entry)
        moved_[entry.col()] += entry.value() * scale_[entry.col()] * pull_[i];
    return moved_;
  }

private:
  /// Factors C M^-1 C^T over the free points. Returns false if its rows depend on each other.
  bool factor()
  {
    for (Eigen::Index i = 0; i < c_.rows(); ++i)
      for (Averages::InnerIterator entry(c_, i), rooted(rooted_, i); entry; ++entry, ++rooted)
        rooted.valueRef() = entry.value() * std::sqrt(scale_[entry.col()]);
    const Eigen::SparseMatrix<double> gram = rooted_ * rooted_.transpose();
    factor_.compute(gram);
    pivots_ = factor_.vectorD();
    // what is left of a row beside the others
    return factor_.info() == Eigen::Success && pivots_.minCoeff() > 1e-12 * gram.diagonal().maxCoeff();
  }

  const Averages& c_;
  Eigen::VectorXd scale_;    ///< per point: 1 / mass, 0 where it is held
  std::vector<char> free_;   ///< for which factor_ was made
  Averages rooted_;          ///< C M^-1/2
  Eigen::SimplicialLDLT<Eigen::SparseMatrix<double>> factor_;
  bool independent_ = false;
  Eigen::VectorXd pivots_, pull_, solved_, moved_;
};

}   // namespace slender
