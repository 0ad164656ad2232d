#include "slender_sim/linalg/constrained_cholesky.h"

#include <algorithm>
#include <cmath>

#include <Eigen/Cholesky>

#include "slender_sim/linalg/point_kernel.h"

namespace slender {

namespace {

// W over what it takes to move a constraint's points apart from all others: a round leaves one over it, rounding errors
// are it times as large
constexpr double kStiff = 2e5;
constexpr int kRounds = 3;   // to rounding
// of a preconditioner: the gap that is left is closed when all motions of a step are known
constexpr int kFewRounds = 2;

/// Measured: entries of C^T W C, and of a factor without it, against those of S^-1.
bool roundsSuit(const ConstrainedCholesky::Constraints& c)
{
  constexpr Eigen::Index kLeast = 400;
  const double m = static_cast<double>(c.rows()), n = static_cast<double>(c.cols());
  if (c.rows() < kLeast || c.rows() > c.cols() || m * m < 25.0 * n)
    return false;
  double entries = 0.0;
  for (Eigen::Index i = 0; i < c.rows(); ++i)
    entries += std::pow(static_cast<double>(c.row(i).nonZeros()), 2);
  return entries < 2.0 * m * m;
}

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

void ConstrainedCholesky::setConstraints(const Constraints& c, bool bounded)
{
  c_ = c;
  c_rows_ = Rows();
  if (bounded)
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
  many_ = !bounded && roundsSuit(c);
  pattern_fixed_.clear();
  if (many_)
    for (PointVector* v : {&load_, &right_})
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

bool ConstrainedCholesky::factor(const PointMatrix& pattern, const double* values, const SparseCholesky& p,
                                 const char* fixed)
{
  p_ = &p;
  left_out_.clear();
  Constraints free = c_.transpose();
  free.prune([fixed](Eigen::Index point, Eigen::Index, double) { return !fixed || !fixed[point]; });
  fill(free, c_transposed_);
  if (c_rows_.values.empty())
    fill(c_, c_rows_);
  in_rounds_ = many_ && factorRounds(pattern, values, fixed);
  return in_rounds_ || factorSchur(p, fixed);
}

/// False: too stiff for a factor, or rounds do not converge as fast as those of constraints that are well apart.
bool ConstrainedCholesky::factorRounds(const PointMatrix& pattern, const double* values, const char* fixed)
{
  const int m = count(), n = pattern.size();
  std::vector<Eigen::Triplet<double>> entries;
  for (int i = 0; i < n; ++i)
    for (int k = pattern.starts()[i]; k < pattern.starts()[i + 1]; ++k)
      entries.emplace_back(i, pattern.column(k), values[k]);
  Constraints p(n, n);
  p.setFromTriplets(entries.begin(), entries.end());
  fill(p, p_rows_);
  const Eigen::VectorXd diagonal = p.diagonal();
  Constraints c = c_;
  c.prune([fixed](Eigen::Index, Eigen::Index point, double) { return !fixed || !fixed[point]; });
  weights_.resize(m);
  for (int i = 0; i < m; ++i)
  {
    double give = 0.0;
    for (Constraints::InnerIterator entry(c, i); entry; ++entry)
      give += entry.value() * entry.value() / diagonal[entry.col()];
    weights_[i] = kStiff / give;
    if (!std::isfinite(weights_[i]))
      return false;
  }
  const Constraints added =
      c.transpose() * Constraints(Eigen::Map<const Eigen::VectorXd>(weights_.data(), m).asDiagonal() * c);
  for (Eigen::Index i = 0; i < n; ++i)
    for (Constraints::InnerIterator entry(added, i); entry; ++entry)
      entries.emplace_back(i, entry.col(), entry.value());
  const PointMatrix stiff(n, entries);
  std::vector<char> now(static_cast<std::size_t>(n) + 1, 1);   // not empty
  if (fixed)
    std::copy_n(fixed, n, now.begin());
  if (now != pattern_fixed_)
    stiff_.setPattern(stiff);
  pattern_fixed_ = std::move(now);
  if (!stiff_.factor(stiff, fixed))
    return false;
  // a gap that is as rough as one can be
  constexpr double kLeft = 1e-8;
  PointVector gap(4 * static_cast<std::size_t>(m), 0.0), mu(gap.size()), z(4 * static_cast<std::size_t>(n), 0.0);
  for (int i = 0; i < m; ++i)
    point(gap, i) = Eigen::Vector3d(1.0, i % 2 == 0 ? 1.0 : -1.0, std::cos(static_cast<double>(i) * i));
  solveInRounds(z.data(), gap.data(), kFewRounds, z.data(), mu.data());
  c_rows_.multiply(0.0, z.data(), t_.data());
  double left = 0.0;
  for (int i = 0; i < m; ++i)
    left = std::max(left, (point(t_, i) - point(gap, i)).lpNorm<Eigen::Infinity>());
  return left <= kLeft;
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

/// From mu = 0: z is that of the constraints' forces so far and of a stiffness W that closes what they leave open; its
/// forces are the next. 4 doubles each.
void ConstrainedCholesky::solveInRounds(const double* r, const double* g, int rounds, double* z, double* mu) const
{
  const int m = count(), n = static_cast<int>(c_.cols());
  if (r)
    std::copy_n(r, 4 * n, load_.data());
  else
    std::fill(load_.begin(), load_.end(), 0.0);
  std::fill_n(mu, 4 * m, 0.0);
  for (int round = 0; round < rounds; ++round)
  {
    for (int i = 0; i < m; ++i)
      for (int k = 4 * i; k < 4 * i + 4; ++k)
        right_[k] = (g ? weights_[i] * g[k] : 0.0) - mu[k];
    std::copy_n(load_.data(), 4 * n, y_.data());
    c_transposed_.multiply(1.0, right_.data(), y_.data());
    stiff_.solvePoints(y_.data(), y_.data());
    c_rows_.multiply(0.0, y_.data(), right_.data());
    for (int i = 0; i < m; ++i)
      for (int k = 4 * i; k < 4 * i + 4; ++k)
        mu[k] += weights_[i] * (right_[k] - (g ? g[k] : 0.0));
  }
  if (z)
    std::copy_n(y_.data(), 4 * n, z);
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
  if (in_rounds_)
  {
    if (norms)
    {
      p_->forwardPoints(r, y_.data());
      const double load = pointKernels().dot(n, y_.data(), y_.data());
      norms->load = std::hypot(std::sqrt(load), norm(g));
    }
    solveInRounds(r, g, g ? kRounds : kFewRounds, z, mu);
    if (norms)   // y_ is z
      norms->step = std::sqrt(std::max(p_rows_.multiply(0.0, y_.data(), load_.data()), 0.0));
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
  if (in_rounds_)   // of z, whose errors are small where those of mu, times W, are not
  {
    solveInRounds(nullptr, g, kRounds, nullptr, mu_.data());
    return std::sqrt(std::max(p_rows_.multiply(0.0, y_.data(), load_.data()), 0.0));
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
  if (in_rounds_)
    return solveInRounds(r, nullptr, kRounds, nullptr, mu);
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
