#pragma once

#include <cmath>

#include <Eigen/Cholesky>
#include <Eigen/SparseCore>

namespace slender {

/// The least displacements of nodes, by the sum of mass times distance squared, that change weighted averages of them
/// by given amounts.
class AverageProjection
{
public:
  using Averages = Eigen::SparseMatrix<double, Eigen::RowMajor>;

  /// c: averages x nodes; must outlive it.
  explicit AverageProjection(const Averages& c)
    : c_(c),
      weighted_(c.rows(), c.cols()),
      gram_(c.rows(), c.rows()),
      factor_(c.rows()),
      pull_(c.rows()),
      moved_(c.cols())
  {
  }

  /// For nodes of these masses [kg], of which isFree(node) may move. False: averages depend on each other on these.
  template <class IsFree>
  bool prepare(const Eigen::VectorXd& mass, const IsFree& isFree)
  {
    mass_ = &mass;
    weighted_.setZero();
    for (Eigen::Index i = 0; i < c_.rows(); ++i)
      for (Averages::InnerIterator entry(c_, i); entry; ++entry)
        if (isFree(static_cast<int>(entry.col())))
          weighted_(i, entry.col()) = entry.value() / std::sqrt(mass[entry.col()]);
    gram_.noalias() = weighted_ * weighted_.transpose();
    const double scale = gram_.diagonal().maxCoeff();
    factor_.compute(gram_);
    for (Eigen::Index i = 0; i < c_.rows(); ++i)   // what is left of a row beside the others
      if (!(factor_.vectorD()[i] > 1e-12 * scale))
        return false;
    return true;
  }

  /// One coordinate of the displacements (per node, 0 where held), for changes of the averages; valid until the next
  /// call.
  template <class Changes>
  const Eigen::VectorXd& displacements(const Changes& changes)
  {
    pull_ = changes;
    factor_.solveInPlace(pull_);
    for (Eigen::Index j = 0; j < c_.cols(); ++j)
      moved_[j] = weighted_.col(j).dot(pull_) / std::sqrt((*mass_)[j]);
    return moved_;
  }

private:
  const Averages& c_;
  const Eigen::VectorXd* mass_ = nullptr;
  Eigen::MatrixXd weighted_, gram_;
  Eigen::LDLT<Eigen::MatrixXd> factor_;
  Eigen::VectorXd pull_, moved_;
};

}   // namespace slender
