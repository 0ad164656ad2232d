#pragma once

#include <cstring>

#include <Eigen/Core>

#include "slender_sim/linalg/banded_ldlt.h"
#include "test/support/random.h"

/// Band matrices of rods as dense ones.
namespace slender::test {

/// Is (row, column), row >= column, inside the staircase of an open band?
inline bool inBand(int row, int column) { return row <= column / 4 * 4 + 10; }

/// Panels from the lower triangle of a dense matrix; `closed` wraps the last panels to the first rows.
inline AlignedVector<RodPanel> panelsOf(const Eigen::MatrixXd& a, bool closed = false)
{
  const int n = static_cast<int>(a.rows()), blocks = n / 4;
  AlignedVector<RodPanel> panels(blocks);
  for (int b = 0; b < blocks; ++b)
  {
    std::memset(static_cast<void*>(&panels[b]), 0, sizeof(RodPanel));
    for (int c = 0; c < 4; ++c)
    {
      for (int r = c; r < 4; ++r)
        panels[b].diag[c][r] = a(4 * b + r, 4 * b + c);
      for (int r = 0; r < RodPanel::kBelow; ++r)
        if (closed || 4 * (b + 1) + r < n)
          panels[b].below[c][r] = a((4 * (b + 1) + r) % n, 4 * b + c);
    }
  }
  return panels;
}

/// L D L^T with a random unit lower L that fills the whole staircase, and the given D: its inertia is known.
inline Eigen::MatrixXd bandWithPivots(const Eigen::VectorXd& d, Random& random)
{
  const int n = static_cast<int>(d.size());
  Eigen::MatrixXd l = Eigen::MatrixXd::Identity(n, n);
  for (int j = 0; j < n; ++j)
    for (int i = j + 1; i < n && inBand(i, j); ++i)
      l(i, j) = random.uniform(-0.4, 0.4);
  return l * d.asDiagonal() * l.transpose();
}

/// Random symmetric matrix on the periodic staircase, with `diagonal` added.
inline Eigen::MatrixXd periodicBand(const Eigen::VectorXd& diagonal, Random& random)
{
  const int n = static_cast<int>(diagonal.size()), blocks = n / 4;
  Eigen::MatrixXd a = diagonal.asDiagonal();
  const auto add = [&](int i, int j) {
    const double v = random.uniform();
    a(i, j) += v;
    if (i != j)
      a(j, i) += v;
  };
  for (int b = 0; b < blocks; ++b)
    for (int c = 0; c < 4; ++c)
    {
      for (int r = c; r < 4; ++r)
        add(4 * b + r, 4 * b + c);
      for (int r = 0; r < RodPanel::kBelow; ++r)
        add((4 * (b + 1) + r) % n, 4 * b + c);
    }
  return a;
}

/// Size of the residual against what one rounding of A x would give.
inline double backwardError(const Eigen::MatrixXd& a, const Eigen::VectorXd& x, const Eigen::VectorXd& b)
{
  return (a * x - b).lpNorm<Eigen::Infinity>() /
         (a.cwiseAbs().rowwise().sum().maxCoeff() * x.lpNorm<Eigen::Infinity>() + b.lpNorm<Eigen::Infinity>());
}

}   // namespace slender::test
