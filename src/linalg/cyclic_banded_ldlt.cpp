#include "slender_sim/linalg/cyclic_banded_ldlt.h"

#include <algorithm>
#include <cmath>
#include <stdexcept>
#include <string>

namespace slender {

void CyclicBandedLdlt::resize(int blocks, bool closed)
{
  if (closed && blocks < 5)
    throw std::invalid_argument("a closed rod needs at least 5 nodes, got " + std::to_string(blocks));
  closed_ = closed;
  inner_ = closed ? blocks - 2 : blocks;
  band_.resize(blocks);
  coupling_.assign(closed ? inner_ * 4 * kBorder : 0, 0.0);
  reduced_ = coupling_;
}

Inertia CyclicBandedLdlt::factor()
{
  if (!closed_)
    return band_.factor();

  // Entry (row, column) of the lower triangle goes to B when one index lies in the separator, to C when both do.
  std::fill(coupling_.begin(), coupling_.end(), 0.0);
  Border c = Border::Zero();
  const int n = blocks(), split = 4 * inner_;
  const auto move = [&](int row, int column, double& value) {
    if (row < split && column >= split)
      std::swap(row, column);
    if (row >= split && column < split)
      coupling_[column * kBorder + row - split] += value;
    else
    {
      c(row - split, column - split) += value;
      if (row != column)
        c(column - split, row - split) += value;
    }
    value = 0.0;
  };
  for (int b = inner_ - 2; b < n; ++b)
    for (int col = 0; col < 4; ++col)
    {
      RodPanel& p = band_.panels()[b];
      if (b >= inner_)
        for (int r = col; r < 4; ++r)
          move(4 * b + r, 4 * b + col, p.diag[col][r]);
      for (int r = 0; r < RodPanel::kBelow; ++r)
      {
        const int row = (4 * (b + 1) + r) % (4 * n);
        if (b >= inner_ || row >= split)
          move(row, 4 * b + col, p.below[col][r]);
      }
    }

  Inertia inertia = band_.factor(inner_);
  if (inertia.zero)
    return inertia;
  reduced_ = coupling_;
  band_.solve8(reduced_.data(), inner_);
  using Rows = Eigen::Matrix<double, Eigen::Dynamic, kBorder, Eigen::RowMajor>;
  const Eigen::Map<const Rows> b_map(coupling_.data(), split, kBorder), z_map(reduced_.data(), split, kBorder);
  Border schur = c;
  for (int i = 0; i < split; ++i)
    schur.noalias() -= b_map.row(i).transpose() * z_map.row(i);
  // L D L^T without pivoting, as in the band: rows of very different size (positions, angles) keep their relative
  // accuracy
  for (int j = 0; j < kBorder; ++j)
  {
    const double pivot = schur(j, j);
    if (!(pivot > 0 || pivot < 0) || !std::isfinite(pivot))
      return {inertia.positive, inertia.negative, 1};
    ++(pivot > 0 ? inertia.positive : inertia.negative);
    for (int k = j + 1; k < kBorder; ++k)
    {
      const double factor = schur(k, j) / pivot;
      for (int i = k; i < kBorder; ++i)
        schur(i, k) -= schur(i, j) * factor;
    }
    schur.col(j).tail(kBorder - 1 - j) /= pivot;
  }
  schur_ = schur;
  return inertia;
}

void CyclicBandedLdlt::solve(double* x) const
{
  if (!closed_)
    return band_.solve(x);
  // x1 = A^-1 b1, x2 = S^-1 (b2 - B^T x1), x1 -= A^-1 B x2
  const int split = 4 * inner_;
  band_.solve(x, inner_);
  Eigen::Map<Eigen::Matrix<double, kBorder, 1>> x2(x + split);
  Eigen::Matrix<double, kBorder, 1> right = x2;
  for (int i = 0; i < split; ++i)
    for (int k = 0; k < kBorder; ++k)
      right[k] -= coupling_[i * kBorder + k] * x[i];
  schur_.triangularView<Eigen::UnitLower>().solveInPlace(right);
  right.array() /= schur_.diagonal().array();
  schur_.transpose().triangularView<Eigen::UnitUpper>().solveInPlace(right);
  x2 = right;
  for (int i = 0; i < split; ++i)
    for (int k = 0; k < kBorder; ++k)
      x[i] -= reduced_[i * kBorder + k] * x2[k];
}

}   // namespace slender
