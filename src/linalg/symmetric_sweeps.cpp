#include "symmetric_sweeps.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "slender_sim/linalg/flush_denormals.h"
#include "slender_sim/linalg/interruption.h"

namespace slender {

namespace {

double squareOf(const PointVector& v)
{
  return Eigen::Map<const Eigen::VectorXd>(v.data(), static_cast<Eigen::Index>(v.size())).squaredNorm();
}

}   // namespace

void SymmetricSweeps::setPattern(const BlockMatrix& a, const PointMatrix* b)
{
  blocks_.setPattern(a, b);
  deflation_.setPattern(blocks_.starts(), blocks_.rows());
  for (PointVector* v : {&product_, &right_, &residual_, &solution_})
    v->assign(4 * static_cast<std::size_t>(blocks_.points()), 0.0);
  for (PointVector* v : {&common_, &common_sum_})
    v->assign(4 * static_cast<std::size_t>(deflation_.groups()), 0.0);
}

/// Takes over the values of the matrix, also into deflation_.
template <class Scalar>
void SymmetricSweeps::pack(Search<Scalar>& s)
{
  blocks_.pack(s.matrix, &deflation_);
  for (AlignedVector<Scalar>* v : {&s.x, &s.r, &s.z, &s.p, &s.t, &s.q})
    v->assign(4 * static_cast<std::size_t>(blocks_.points()), Scalar(0));
}

/// residual_ := right_ - (A + factor B) solution_, and x := solution_.
void SymmetricSweeps::leave(PointVector& x)
{
  blocks_.fromVisits(solution_, x);
  blocks_.multiply(x, product_);
  for (int v = 0; v < blocks_.points(); ++v)
    point(residual_, v) = point(right_, v) - point(product_, blocks_.pointAt(v));
}

/// Begins a search for the solution with the right-hand side from / size. Sets x = 0, r = (D + L)^-1 from / size and
/// z = p = D r. Returns r . z.
template <class Scalar>
double SymmetricSweeps::load(Search<Scalar>& s, const PointVector& from, double size)
{
  const SweepKernels<Scalar>& kernels = pointKernels().sweeps<Scalar>();
  for (AlignedVector<Scalar>* v : {&s.x, &s.r, &s.t})
    std::fill(v->begin(), v->end(), Scalar(0));
  for (int v = 0; v < blocks_.points(); ++v)
    for (int c = 0; c < 3; ++c)
      s.q[4 * v + c] = blocks_.isHeld(v) ? Scalar(0) : static_cast<Scalar>(from[4 * v + c] / size);
  kernels.down(blocks_.matrixOf(s.matrix), {}, s.r.data(), s.t.data(), s.q.data());
  const double square =
      kernels.advance(blocks_.matrixOf(s.matrix), -1.0, s.t.data(), s.q.data(), s.x.data(), s.r.data(), s.z.data());
  s.p = s.z;
  return square;
}

/// Negative, or not a number, where the matrix is not definite.
template <class Scalar>
double SymmetricSweeps::normOf(Search<Scalar>& s, const PointVector& r)
{
  const double size = largestEntry(r);
  if (size == 0)
    return 0.0;
  const double square = load(s, r, size);
  return square >= 0 ? std::sqrt(square) * size : square;
}

/// Sets the common motions that are to be left out of the direction t, from what the upward sweep gathered in groups.
template <class Scalar>
void SymmetricSweeps::deflate(Search<Scalar>& s)
{
  std::copy(s.groups.begin(), s.groups.end(), common_.begin());
  deflation_.solve(common_);
  std::transform(common_.begin(), common_.end(), s.groups.begin(), [](double c) { return static_cast<Scalar>(c); });
}

/// Iterates from what load() has left, until the norm is `tolerance` times `scale`. In the norm of D, the matrix is
/// (D + L)^-1 A (D + L^T)^-1, and its product with p is t + (D + L)^-1 (p - D t) with t = (D + L^T)^-1 p, where
/// p - D t = L^T t. The downward sweep subtracts from this L^T t the forces B c of the common motions c of `groups`.
/// `between` is called before it and sets c.
/// `advanced` is called after each step along t.
template <class Scalar, class Between, class Advanced>
SymmetricSweeps::SearchEnd SymmetricSweeps::iterate(Search<Scalar>& s, const GroupBlocks<Scalar>& groups, double square,
                                                    double scale, double tolerance, int max_iterations,
                                                    LinearResult& result, Between&& between, Advanced&& advanced)
{
  const SweepKernels<Scalar>& kernels = pointKernels().sweeps<Scalar>();
  const SweptMatrix<Scalar> matrix = blocks_.matrixOf(s.matrix);
  double norm = std::sqrt(square) / scale;
  for (; norm > tolerance && result.iterations < max_iterations && !stepsInterrupted(); ++result.iterations)
  {
    if (groups.starts)
      std::fill(s.groups.begin(), s.groups.end(), Scalar(0));
    kernels.up(matrix, groups, s.p.data(), s.t.data(), s.q.data());
    between();
    const double curvature = kernels.down(matrix, groups, s.p.data(), s.t.data(), s.q.data());
    if (!(curvature > 0))
      return negative(s, curvature);
    const double alpha = square / curvature;
    const double next = kernels.advance(matrix, alpha, s.t.data(), s.q.data(), s.x.data(), s.r.data(), s.z.data());
    advanced(alpha);
    kernels.turn(blocks_.points(), next / square, s.z.data(), s.p.data());
    square = next;
    norm = std::sqrt(std::abs(square)) / scale;
  }
  result.residual = norm;
  return SearchEnd::solved;
}

/// What a curvature that is not positive means: in single precision it may be a rounding error.
template <class Scalar>
SymmetricSweeps::SearchEnd SymmetricSweeps::negative(const Search<Scalar>& s, double curvature) const
{
  if (std::is_same_v<Scalar, double>)
    return SearchEnd::not_definite;
  double sum = 0.0;
  for (std::size_t v = 0; v < s.p.size() / 4; ++v)
    for (int c = 0; c < 3; ++c)
      for (int r = 0; r < 3; ++r)
        sum += static_cast<double>(s.p[4 * v + r]) * s.matrix.inverse[12 * v + 4 * c + r] * s.p[4 * v + c];
  // `sum` is p . D^-1 p, the square of the norm of the direction p.
  return curvature < -Search<Scalar>::kLeast * sum ? SearchEnd::not_definite : SearchEnd::stalled;
}

/// Repeats a search for the correction of solution_ (iterative refinement), until the residual is small.
template <class Scalar>
SymmetricSweeps::SearchEnd SymmetricSweeps::refine(Search<Scalar>& s, PointVector& x, double tolerance,
                                                   int max_iterations, LinearResult& result)
{
  constexpr double kLeastGain = 0.3;
  constexpr double kMargin = 0.5;   // A search that stops just below the tolerance would have to be repeated.
  s.group_blocks.assign(deflation_.blocks().begin(), deflation_.blocks().end());
  s.transposed_blocks.resize(s.group_blocks.size());
  for (std::size_t k = 0; k + 9 <= s.group_blocks.size(); k += 9)
    for (int c = 0; c < 3; ++c)
      for (int r = 0; r < 3; ++r)
        s.transposed_blocks[k + 3 * c + r] = s.group_blocks[k + 3 * r + c];
  s.groups.resize(common_.size());
  for (double before = std::numeric_limits<double>::infinity();;)
  {
    deflation_.correct(residual_, solution_);
    const double size = largestEntry(residual_), square = size > 0 ? load(s, residual_, size) : 0.0;
    if (!(square >= 0))
      return negative(s, square);
    result.residual = std::sqrt(square) * size / result.scale;
    if (result.residual <= tolerance || result.iterations >= max_iterations || stepsInterrupted())
    {
      blocks_.fromVisits(solution_, x);
      return SearchEnd::solved;
    }
    if (result.residual > kLeastGain * before)
      return SearchEnd::stalled;
    before = result.residual;
    std::fill(common_sum_.begin(), common_sum_.end(), 0.0);
    const double least = std::max(kMargin * tolerance, Search<Scalar>::kLeast * result.residual);
    const SearchEnd end = iterate(
        s, groupsOf(s), square, result.scale / size, least, max_iterations, result, [&] { deflate(s); },
        [&](double alpha) {
          for (std::size_t i = 0; i < common_.size(); ++i)
            common_sum_[i] += alpha * common_[i];
        });
    for (int v = 0; v < blocks_.points(); ++v)
      for (int c = 0; c < 3; ++c)
        solution_[4 * v + c] +=
            size * (s.x[4 * v + c] - (blocks_.moves()[v] ? common_sum_[4 * deflation_.groupOf(v) + c] : 0.0));
    leave(x);
    if (end != SearchEnd::solved)
      return end;
  }
}

/// Sets what a solution in this precision needs, and the norm of the right-hand side. Returns false if the matrix is
/// not positive definite.
template <class Scalar>
bool SymmetricSweeps::begin(Search<Scalar>& s, LinearResult& result)
{
  deflation_.begin(blocks_.moves());
  pack(s);
  result.scale = normOf(s, right_);
  result.definite = result.scale >= 0 && deflation_.factor();
  return result.definite;
}

LinearResult SymmetricSweeps::solve(const PointVector& right_hand_side, PointVector& x, double tolerance,
                                    int max_iterations)
{
  constexpr double kLeastInSinglePrecision = 1e-6;   // More accurate solutions would need several searches.
  [[maybe_unused]] const FlushDenormals flush;       // Tiny numbers arise far from where forces act.
  LinearResult result;
  std::fill(x.begin(), x.end(), 0.0);
  std::fill(solution_.begin(), solution_.end(), 0.0);
  blocks_.toVisits(right_hand_side, right_);
  residual_ = right_;
  SearchEnd end = SearchEnd::stalled;
  if (tolerance >= kLeastInSinglePrecision)
  {
    if (!begin(single_, result) || result.scale == 0)
      return result;
    end = refine(single_, x, tolerance, max_iterations, result);
  }
  if (end == SearchEnd::stalled)
  {
    if (!(squareOf(residual_) <= squareOf(right_)))   // or it is not finite
    {
      std::fill(solution_.begin(), solution_.end(), 0.0);
      residual_ = right_;
    }
    if (!begin(double_, result) || result.scale == 0)
      return result;
    end = refine(double_, x, tolerance, max_iterations, result);
  }
  result.definite = end != SearchEnd::not_definite;
  return result;
}

}   // namespace slender
