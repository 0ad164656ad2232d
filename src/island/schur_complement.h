#pragma once

#include <vector>

#include <Eigen/Cholesky>

namespace slender {

/// Makes directions d of Newton's method satisfy linear constraints C d = 0. It uses the Schur complement S = C K^-1
/// C^T of the matrix K of Newton's method. The caller solves the equations with K.
class SchurComplement
{
public:
  /// Begins a new matrix C of this size, without entries.
  void begin(Eigen::Index rows, Eigen::Index unknowns)
  {
    entries_.clear();
    columns_.setZero(unknowns, rows);
    schur_.setZero(rows, rows);
    change_.setZero(rows);
    if (factor_.cols() != rows)
      factor_ = Eigen::LDLT<Eigen::MatrixXd>(rows);
  }
  /// Adds an entry to C.
  void add(Eigen::Index row, Eigen::Index unknown, double value) { entries_.push_back({row, unknown, value}); }

  /// Removes from a direction the component that violates the constraints. solve(x) replaces x by K^-1 x.
  template <class Solve>
  void correct(double* direction, Solve&& solve)
  {
    for (const Entry& e : entries_)
      columns_(e.unknown, e.row) += e.value;
    for (Eigen::Index r = 0; r < columns_.cols(); ++r)
      solve(columns_.col(r).data());
    for (const Entry& e : entries_)
    {
      schur_.row(e.row) += e.value * columns_.row(e.unknown);
      change_[e.row] += e.value * direction[e.unknown];
    }
    factor_.compute(schur_);
    factor_.solveInPlace(change_);
    Eigen::Map<Eigen::VectorXd>(direction, columns_.rows()).noalias() -= columns_ * change_;
  }
  /// Returns the change of each row's multiplier in the last correct(). The constraints exert the forces -C^T times the
  /// multipliers.
  const Eigen::VectorXd& change() const { return change_; }

private:
  struct Entry
  {
    Eigen::Index row, unknown;
    double value;
  };
  std::vector<Entry> entries_;
  Eigen::MatrixXd columns_, schur_;   ///< columns_: C^T, then K^-1 C^T
  Eigen::LDLT<Eigen::MatrixXd> factor_;
  Eigen::VectorXd change_;
};

}   // namespace slender
