#pragma once

#include <vector>

#include <Eigen/Cholesky>

namespace slender {

/// Keeps directions of Newton's method within linear constraints C d = 0, by the Schur complement S = C K^-1 C^T of a
/// matrix K that somebody else can solve with.
class SchurComplement
{
public:
  /// C has no entries from now on.
  void begin(Eigen::Index rows, Eigen::Index unknowns)
  {
    entries_.clear();
    columns_.setZero(unknowns, rows);
    schur_.setZero(rows, rows);
    change_.setZero(rows);
    if (factor_.cols() != rows)
      factor_ = Eigen::LDLT<Eigen::MatrixXd>(rows);
  }
  void add(Eigen::Index row, Eigen::Index unknown, double value) { entries_.push_back({row, unknown, value}); }

  /// Takes the part out of a direction that leaves the constraints. solve(x): x := K^-1 x.
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
  /// By how much correct() changed the multiplier of each row. The constraints act on the unknowns with -C^T times the
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
