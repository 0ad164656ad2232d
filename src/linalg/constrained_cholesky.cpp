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

void ConstrainedCholesky::setConstraints(const Constraints& c, Schur schur)
{
  c_ = c;
  schur_ = schur;
  fill(c_, c_rows_);
  if (schur == Schur::bounded)
  {
    s_.resize(c.rows(), c.rows());
    inner_.resize(c.rows(), c.rows());
    soft_.resize(c.rows(), c.rows());
    give_.resize(c.rows(), 3);
    pull_.assign(4 * static_cast<std::size_t>(c.cols()), 0.0);
  }
  const std::size_t size = 4 * static_cast<std::size_t>(std::max(c.rows(), c.cols()));
  for (PointVector* v : {&y_, &t_, &mu_})
    v->assign(size, 0.0);
  matrix_ = PointMatrix();
  if (schur == Schur::none)
    for (PointVector* v : {&whole_right_, &image_})
      v->assign(4 * static_cast<std::size_t>(c.rows() + c.cols()), 0.0);
}

void ConstrainedCholesky::fill(const Constraints& from, Rows& to)
{
  to.starts.assign(from.outerIndexPtr(), from.outerIndexPtr() + from.rows() + 1);
  to.values.assign(from.valuePtr(), from.valuePtr() + from.nonZeros());
  to.offsets.resize(from.nonZeros());
  for (Eigen::Index k = 0; k < from.nonZeros(); ++k)
    to.offsets[k] = 4u * static_cast<unsigned>(from.innerIndexPtr()[k]);
}

bool ConstrainedCholesky::factor(const PointMatrix& pattern, const double* values, const SparseCholesky& p,
                                 const char* fixed)
{
  p_ = &p;
  left_out_.clear();
  Constraints free = c_.transpose();
  free.prune([fixed](Eigen::Index point, Eigen::Index, double) { return !fixed || !fixed[point]; });
  fill(free, c_transposed_);
  return schur_ == Schur::none ? factorWhole(pattern, values, fixed) : factorSchur(p, fixed);
}

bool ConstrainedCholesky::factorWhole(const PointMatrix& pattern, const double* values, const char* fixed)
{
  // A constraint depends on others if its pivot is almost zero. The pivot is compared with `gives`, the pivot that the
  // constraint would have if P were diagonal and there were no other constraint. The rounding error of a pivot is about
  // 1e-16 of the pivot of the constraint alone, which may be 1e4 times `gives`.
  constexpr double kLeast = 1e-9;
  const int m = count(), n = pattern.size();
  std::vector<Eigen::Triplet<double>> entries;
  std::vector<double> diagonal(n), gives(m, 0.0);
  for (int i = 0; i < n; ++i)
    for (int k = pattern.starts()[i]; k < pattern.starts()[i + 1]; ++k)
    {
      entries.emplace_back(i, pattern.column(k), values[k]);
      if (pattern.column(k) == i)
        diagonal[i] = values[k];
    }
  for (int i = 0; i < m; ++i)
    for (Constraints::InnerIterator entry(c_, i); entry; ++entry)
    {
      entries.emplace_back(n + i, entry.col(), entry.value());
      entries.emplace_back(entry.col(), n + i, entry.value());
      gives[i] += fixed && fixed[entry.col()] ? 0.0 : entry.value() * entry.value() / diagonal[entry.col()];
    }
  const std::vector<int> starts = matrix_.starts();
  matrix_ = PointMatrix(n + m, entries);
  if (matrix_.starts() != starts)   // the pattern of one mesh
    whole_.setPattern(matrix_, m);
  std::vector<char> is_fixed(static_cast<std::size_t>(n + m), 0);
  if (fixed)
    std::copy_n(fixed, n, is_fixed.begin());
  if (!whole_.factor(matrix_, is_fixed.data()))
    return false;
  for (int i = 0; i < m; ++i)
    if (!(whole_.pivot(n + i) > kLeast * gives[i]))
      return false;
  return true;
}

bool ConstrainedCholesky::factorSchur(const SparseCholesky& p, const char* fixed)
{
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
  const Eigen::MatrixXd s = Eigen::MatrixXd(Constraints(v * v.transpose()));
  if (s_.size() > 0)
    s_ = s;
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

void ConstrainedCholesky::leaveOut(const std::vector<int>& rows)
{
  left_out_ = rows;
  const auto k = static_cast<Eigen::Index>(rows.size());
  auto inner = inner_.topLeftCorner(k, k);
  for (Eigen::Index b = 0; b < k; ++b)
    for (Eigen::Index a = b; a < k; ++a)
      inner(a, b) = s_inverse_.values[static_cast<std::size_t>(rows[a]) * count() + rows[b]];
  factorInPlace(inner);
}

/// z and mu, one after the other, into whole_right_; r or g null: zero.
void ConstrainedCholesky::solveWhole(const double* r, const double* g) const
{
  const std::size_t ends = 4 * static_cast<std::size_t>(c_.cols());
  std::fill(whole_right_.begin(), whole_right_.end(), 0.0);
  if (r)
    std::copy_n(r, ends, whole_right_.begin());
  if (g)
    std::copy_n(g, 4 * count(), whole_right_.begin() + static_cast<std::ptrdiff_t>(ends));
  whole_.solvePoints(whole_right_.data(), whole_right_.data());
}

/// mu = S^-1 t of what is not left out (Woodbury's formula)
void ConstrainedCholesky::inverse(const double* t, double* mu) const
{
  s_inverse_.multiply(0.0, t, mu);
  const auto k = static_cast<Eigen::Index>(left_out_.size());
  if (k == 0)
    return;
  auto give = give_.topRows(k);
  for (Eigen::Index a = 0; a < k; ++a)
    give.row(a) = Eigen::Map<const Eigen::RowVector3d>(mu + 4 * left_out_[a]);
  const auto inner = inner_.topLeftCorner(k, k).triangularView<Eigen::Lower>();
  inner.solveInPlace(give);
  inner.transpose().solveInPlace(give);
  const int m = count();
  for (Eigen::Index a = 0; a < k; ++a)
  {
    const double* column = s_inverse_.values.data() + static_cast<std::size_t>(left_out_[a]) * m;
    for (int i = 0; i < m; ++i)
      for (int c = 0; c < 3; ++c)
        mu[4 * i + c] -= column[i] * give(a, c);
  }
}

void ConstrainedCholesky::solve(const double* r, const double* g, double* z, double* mu, Norms* norms) const
{
  const int m = count(), n = static_cast<int>(c_.cols());
  if (schur_ == Schur::none)
  {
    if (norms)
    {
      p_->forwardPoints(r, y_.data());
      const double gap = norm(g), load = pointKernels().dot(n, y_.data(), y_.data());
      norms->load = std::hypot(std::sqrt(load), gap);
    }
    solveWhole(r, g);
    std::copy_n(whole_right_.data(), 4 * n, z);
    std::copy_n(whole_right_.data() + 4 * n, 4 * m, mu);
    if (norms)
    {
      std::fill(whole_right_.begin() + 4 * n, whole_right_.end(), 0.0);
      norms->step = std::sqrt(std::max(matrix_.multiply(whole_right_.data(), image_.data()), 0.0));
    }
    return;
  }
  p_->forwardPoints(r, y_.data());
  if (norms)
  {
    std::copy_n(g, 4 * m, t_.data());
    inverse(t_.data(), mu_.data());
    norms->load = std::sqrt(pointKernels().dot(n, y_.data(), y_.data()) + pointKernels().dot(m, t_.data(), mu_.data()));
  }
  v_.multiply(0.0, y_.data(), t_.data());
  for (int i = 0; g && i < 4 * m; ++i)
    t_[i] -= g[i];
  inverse(t_.data(), mu_.data());
  std::copy_n(mu_.data(), 4 * m, mu);
  v_transposed_.multiply(-1.0, mu_.data(), y_.data());
  if (norms)
    norms->step = std::sqrt(pointKernels().dot(n, y_.data(), y_.data()));
  p_->backwardPoints(y_.data(), z);
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

double ConstrainedCholesky::norm(const double* g) const
{
  if (schur_ == Schur::none)
  {
    solveWhole(nullptr, g);
    return std::sqrt(std::max(-pointKernels().dot(count(), g, whole_right_.data() + 4 * c_.cols()), 0.0));
  }
  std::copy_n(g, 4 * count(), t_.data());
  inverse(t_.data(), mu_.data());
  return std::sqrt(std::max(pointKernels().dot(count(), t_.data(), mu_.data()), 0.0));
}

void ConstrainedCholesky::addStiffness(double factor, const double* x, double* y) const
{
  c_rows_.multiply(0.0, x, t_.data());
  inverse(t_.data(), mu_.data());
  c_transposed_.multiply(factor, mu_.data(), y);
}

void ConstrainedCholesky::multipliers(const double* r, double* mu) const
{
  if (schur_ == Schur::none)
  {
    solveWhole(r, nullptr);
    std::copy_n(whole_right_.data() + 4 * c_.cols(), 4 * count(), mu);
    return;
  }
  p_->forwardPoints(r, y_.data());
  v_.multiply(0.0, y_.data(), t_.data());
  inverse(t_.data(), mu_.data());
  std::copy_n(mu_.data(), 4 * count(), mu);
}

void ConstrainedCholesky::takeOut(const double* mu, double* r) const
{
  std::copy_n(mu, 4 * count(), mu_.data());
  c_transposed_.multiply(-1.0, mu_.data(), r);
}

}   // namespace slender
