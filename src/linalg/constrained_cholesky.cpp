#include "slender_sim/linalg/constrained_cholesky.h"

#include <algorithm>
#include <cmath>

#include <Eigen/Cholesky>

#include "slender_sim/linalg/point_kernel.h"

namespace slender {

void ConstrainedCholesky::Rows::multiply(double factor, const double* x, double* y) const
{
  pointKernels().multiply(static_cast<int>(starts.size()) - 1, starts.data(), offsets.data(), values.data(), factor, x, y);
}

void ConstrainedCholesky::setConstraints(const Constraints& c)
{
  c_ = c;
  const std::size_t size = 4 * static_cast<std::size_t>(std::max(c.rows(), c.cols()));
  for (PointVector* v : {&y_, &t_, &mu_})
    v->assign(size, 0.0);
}

bool ConstrainedCholesky::factor(const SparseCholesky& p, const char* fixed)
{
  p_ = &p;
  const int m = count(), n = static_cast<int>(c_.cols());
  // three rows of C at a time, as the coordinates of points
  std::vector<Eigen::Triplet<double>> entries;
  PointVector rows(4 * n);
  for (int first = 0; first < m; first += 3)
  {
    std::fill(rows.begin(), rows.end(), 0.0);
    const int several = std::min(3, m - first);
    for (int k = 0; k < several; ++k)
      for (Constraints::InnerIterator entry(c_, first + k); entry; ++entry)
        if (!fixed || !fixed[entry.col()])
          rows[4 * entry.col() + k] = entry.value();
    p.forwardPoints(rows.data(), y_.data());
    for (int k = 0; k < several; ++k)
      for (int i = 0; i < n; ++i)
        if (y_[4 * i + k] != 0.0)
          entries.emplace_back(first + k, i, y_[4 * i + k]);
  }
  Constraints v(m, n);
  v.setFromTriplets(entries.begin(), entries.end());
  const auto fill = [](const Constraints& from, Rows& to) {
    to.starts.assign(from.outerIndexPtr(), from.outerIndexPtr() + from.rows() + 1);
    to.values.assign(from.valuePtr(), from.valuePtr() + from.nonZeros());
    to.offsets.resize(from.nonZeros());
    for (Eigen::Index k = 0; k < from.nonZeros(); ++k)
      to.offsets[k] = 4u * static_cast<unsigned>(from.innerIndexPtr()[k]);
  };
  fill(v, v_);
  fill(Constraints(v.transpose()), v_transposed_);
  Constraints free = c_.transpose();
  free.prune([fixed](Eigen::Index point, Eigen::Index, double) { return !fixed || !fixed[point]; });
  fill(free, c_transposed_);
  const Eigen::MatrixXd s = Eigen::MatrixXd(Constraints(v * v.transpose()));
  const Eigen::LLT<Eigen::MatrixXd> factor(s);
  if (factor.info() != Eigen::Success || !s.allFinite() || (m > 0 && !(factor.rcond() > 1e-14)))
    return false;
  const Eigen::MatrixXd inverse = factor.solve(Eigen::MatrixXd::Identity(m, m));
  s_inverse_.starts.resize(m + 1);
  s_inverse_.values.assign(inverse.data(), inverse.data() + inverse.size());
  s_inverse_.offsets.resize(inverse.size());
  for (int i = 0; i <= m; ++i)
    s_inverse_.starts[i] = i * m;
  for (Eigen::Index k = 0; k < inverse.size(); ++k)
    s_inverse_.offsets[k] = 4u * static_cast<unsigned>(k % m);
  return true;
}

ConstrainedCholesky::Norms ConstrainedCholesky::solve(const double* r, const double* g, double* z, double* mu) const
{
  const int m = count(), n = static_cast<int>(c_.cols());
  p_->forwardPoints(r, y_.data());
  Norms norms;
  if (g)
  {
    std::copy_n(g, 4 * m, t_.data());
    s_inverse_.multiply(0.0, t_.data(), mu_.data());
    norms.load = std::sqrt(pointKernels().dot(n, y_.data(), y_.data()) + pointKernels().dot(m, t_.data(), mu_.data()));
  }
  v_.multiply(0.0, y_.data(), t_.data());
  for (int i = 0; g && i < 4 * m; ++i)
    t_[i] -= g[i];
  s_inverse_.multiply(0.0, t_.data(), mu_.data());
  std::copy_n(mu_.data(), 4 * m, mu);
  v_transposed_.multiply(-1.0, mu_.data(), y_.data());
  if (g)
    norms.step = std::sqrt(pointKernels().dot(n, y_.data(), y_.data()));
  p_->backwardPoints(y_.data(), z);
  return norms;
}

void ConstrainedCholesky::multipliers(const double* r, double* mu) const
{
  p_->forwardPoints(r, y_.data());
  v_.multiply(0.0, y_.data(), t_.data());
  s_inverse_.multiply(0.0, t_.data(), mu_.data());
  std::copy_n(mu_.data(), 4 * count(), mu);
}

void ConstrainedCholesky::takeOut(const double* mu, double* r) const
{
  std::copy_n(mu, 4 * count(), mu_.data());
  c_transposed_.multiply(-1.0, mu_.data(), r);
}

}  // namespace slender
