#include "slender_sim/linalg/constrained_cholesky.h"

#include <algorithm>
#include <cmath>

#include <Eigen/Cholesky>

#include "slender_sim/linalg/point_kernel.h"

namespace slender {

namespace {

/// Lower triangle of a positive definite matrix: its factor.
void factorInPlace(Eigen::Ref<Eigen::MatrixXd> a)
{
  const Eigen::Index n = a.rows();
  for (Eigen::Index b = 0; b < n; ++b)
  {
    for (Eigen::Index j = 0; j < b; ++j)
      a.col(b).tail(n - b) -= a(b, j) * a.col(j).tail(n - b);
    a.col(b).tail(n - b) /= std::sqrt(a(b, b));
  }
}

}   // namespace

double ConstrainedCholesky::Rows::multiply(double factor, const double* x, double* y) const
{
  return pointKernels().multiply(static_cast<int>(starts.size()) - 1, starts.data(), offsets.data(), values.data(),
                                 factor, x, y);
}

void ConstrainedCholesky::setConstraints(const Constraints& c)
{
  c_ = c;
  for (Eigen::MatrixXd* matrix : {&s_, &soft_})
    matrix->resize(c.rows(), c.rows());
  stiffness_.resize(c.rows());
  give_.resize(c.rows(), 3);
  pull_.assign(4 * static_cast<std::size_t>(c.cols()), 0.0);
  const std::size_t size = 4 * static_cast<std::size_t>(std::max(c.rows(), c.cols()));
  for (PointVector* v : {&y_, &t_, &mu_})
    v->assign(size, 0.0);
}

void ConstrainedCholesky::fill(const Constraints& from, Rows& to)
{
  to.starts.assign(from.outerIndexPtr(), from.outerIndexPtr() + from.rows() + 1);
  to.values.assign(from.valuePtr(), from.valuePtr() + from.nonZeros());
  to.offsets.resize(from.nonZeros());
  for (Eigen::Index k = 0; k < from.nonZeros(); ++k)
    to.offsets[k] = 4u * static_cast<unsigned>(from.innerIndexPtr()[k]);
}

bool ConstrainedCholesky::factor(const SparseCholesky& p, const char* fixed)
{
  p_ = &p;
  Constraints free = c_.transpose();
  free.prune([fixed](Eigen::Index point, Eigen::Index, double) { return !fixed || !fixed[point]; });
  fill(free, c_transposed_);
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
  fill(v, v_);
  fill(Constraints(v.transpose()), v_transposed_);
  s_ = Eigen::MatrixXd(Constraints(v * v.transpose()));
  const Eigen::LLT<Eigen::MatrixXd> factor(s_);
  if (factor.info() != Eigen::Success || !s_.allFinite() || (m > 0 && !(factor.rcond() > 1e-14)))
    return false;
  stiffness_ = factor.solve(Eigen::MatrixXd::Identity(m, m)).diagonal();
  return true;
}

ConstrainedCholesky::Norms ConstrainedCholesky::solveBounded(const double* r, const double* gap, const double* bounds,
                                                             double l, double tolerance, double* z, double* f)
{
  constexpr int kSweeps = 200;
  const int m = count(), n = static_cast<int>(c_.cols());
  p_->forwardPoints(r, y_.data());
  Norms norms;
  norms.load = pointKernels().dot(n, y_.data(), y_.data());
  v_.multiply(0.0, y_.data(), t_.data());
  for (int i = 0; i < 4 * m; ++i)
    t_[i] = gap[i] - t_[i] / l;
  for (int j = 0; j < m; ++j)
    for (int i = 0; i < m; ++i)
      for (int c = 0; c < 3; ++c)
        t_[4 * i + c] -= s_(i, j) / l * f[4 * j + c];
  for (int sweep = 0; sweep < kSweeps; ++sweep)
  {
    double largest = 0.0;
    for (int i = 0; i < m; ++i)
    {
      Eigen::Map<Eigen::Vector3d> now(f + 4 * i);
      const double give = s_(i, i) / l;
      Eigen::Vector3d wanted = now + Eigen::Map<const Eigen::Vector3d>(t_.data() + 4 * i) / give;
      const double size = wanted.norm();
      if (size > bounds[i])
        wanted *= bounds[i] / size;
      const Eigen::Vector3d change = wanted - now;
      now = wanted;
      largest = std::max(largest, change.norm() / std::min(bounds[i], std::max(size, 1e-300)));
      for (int k = 0; k < m; ++k)
        for (int c = 0; c < 3; ++c)
          t_[4 * k + c] -= s_(k, i) / l * change[c];
    }
    ++norms.sweeps;
    norms.converged = largest <= tolerance;
    if (norms.converged)
      break;
  }
  std::copy_n(f, 4 * m, mu_.data());
  std::fill(pull_.begin(), pull_.end(), 0.0);
  v_transposed_.multiply(1.0, mu_.data(), pull_.data());
  norms.load = std::sqrt(norms.load + pointKernels().dot(n, pull_.data(), pull_.data()));
  for (int i = 0; i < 4 * n; ++i)
    y_[i] += pull_[i];
  norms.step = std::sqrt(pointKernels().dot(n, y_.data(), y_.data()));
  for (int i = 0; i < 4 * n; ++i)
    y_[i] /= l;
  p_->backwardPoints(y_.data(), z);
  return norms;
}

void ConstrainedCholesky::soften(const Eigen::VectorXd& weights)
{
  soft_ = s_;
  soft_.diagonal() += weights.cwiseInverse();
  factorInPlace(soft_);
}

/// Woodbury's formula.
void ConstrainedCholesky::solveSoftened(const double* r, double* z) const
{
  p_->forwardPoints(r, y_.data());
  v_.multiply(0.0, y_.data(), t_.data());
  for (int i = 0; i < count(); ++i)
    give_.row(i) = Eigen::Map<const Eigen::RowVector3d>(t_.data() + 4 * i);
  const auto lower = soft_.triangularView<Eigen::Lower>();
  lower.solveInPlace(give_);
  lower.transpose().solveInPlace(give_);
  for (int i = 0; i < count(); ++i)
    Eigen::Map<Eigen::RowVector3d>(mu_.data() + 4 * i) = give_.row(i);
  v_transposed_.multiply(-1.0, mu_.data(), y_.data());
  p_->backwardPoints(y_.data(), z);
}

void ConstrainedCholesky::addForces(const double* f, double* r) const
{
  std::copy_n(f, 4 * count(), mu_.data());
  c_transposed_.multiply(1.0, mu_.data(), r);
}

}   // namespace slender
