#include "slender_sim/linalg/symmetric_sweeps.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numeric>

#include <Eigen/LU>

#ifdef __SSE__
#include <xmmintrin.h>
#endif

#include "linalg/deflation.h"
#include "slender_sim/linalg/interruption.h"

namespace slender {

namespace {

/// Tiny numbers in single precision become zero while this lives. They arise far from where forces act, and processors
/// are slow with them.
class NoTinyNumbers
{
public:
#ifdef __SSE__
  NoTinyNumbers() : before_(_mm_getcsr()) { _mm_setcsr(before_ | kFlushToZero | kTinyAreZero); }
  ~NoTinyNumbers() { _mm_setcsr(before_); }

private:
  static constexpr unsigned kFlushToZero = 0x8000, kTinyAreZero = 0x0040;
  const unsigned before_;
#endif
};

template <class Scalar>
void putBlock(const Eigen::Matrix3d& block, int stride, Scalar* to)
{
  for (int c = 0; c < 3; ++c)
    for (int r = 0; r < 3; ++r)
      to[stride * c + r] = static_cast<Scalar>(block(r, c));
}

double squareOf(const PointVector& v)
{
  return Eigen::Map<const Eigen::VectorXd>(v.data(), static_cast<Eigen::Index>(v.size())).squaredNorm();
}

double largest(const PointVector& v)
{
  return v.empty()
             ? 0.0
             : Eigen::Map<const Eigen::VectorXd>(v.data(), static_cast<Eigen::Index>(v.size())).cwiseAbs().maxCoeff();
}

}   // namespace

struct SymmetricSweeps::Impl
{
  /// The matrix and the vectors of a search, in one precision.
  template <class Scalar>
  struct Search
  {
    AlignedVector<Scalar> blocks, diagonal, inverse;   ///< as SweptMatrix has them
    AlignedVector<Scalar> x, r, z, p, t, q;
    AlignedVector<Scalar> group_blocks, transposed_blocks, groups;   ///< as GroupBlocks has them
    /// What a search can take from a residual before rounding errors spoil it.
    static constexpr double kLeast = std::is_same_v<Scalar, float> ? 1e-5 : 1e-13;

    void resize(int points, std::size_t entries)
    {
      blocks.resize(9 * entries + 3);   // three more, for wide loads
      for (AlignedVector<Scalar>* v : {&diagonal, &inverse})
        v->resize(12 * static_cast<std::size_t>(points));
      for (AlignedVector<Scalar>* v : {&x, &r, &z, &p, &t, &q})
        v->assign(4 * static_cast<std::size_t>(points), Scalar(0));
    }
  };

  enum class SearchEnd
  {
    solved,   ///< or stopped
    stalled,
    not_definite
  };

  const BlockMatrix* a_ = nullptr;
  const PointMatrix* b_ = nullptr;
  double factor_ = 0;
  const std::vector<char>* held_ = nullptr;
  /// Points in the order in which they are visited: each after its neighbours of lower number, so that points visited
  /// in turn seldom wait for each other. Below, points are numbered by it.
  std::vector<int> order_;
  std::vector<int> starts_, rows_;
  std::vector<int> a_entry_, b_entry_;   ///< of each block of L in A and B, -1: none
  std::vector<int> b_diagonal_;          ///< -1: none
  std::vector<char> moves_;              ///< of each point whether it takes part in common motions
  Deflation deflation_;
  Search<float> single_;
  Search<double> double_;
  PointVector product_;                       ///< in the order of A
  PointVector right_, residual_, solution_;   ///< in the order of visits
  PointVector common_, common_sum_;           ///< motions of groups

  int points() const { return static_cast<int>(order_.size()); }
  void setPattern(const BlockMatrix& a, const PointMatrix* b);
  void orderPoints();
  void noteMoving(const std::vector<char>* apart);
  Eigen::Matrix3d blockOf(int entry) const;
  Eigen::Matrix3d diagonalOf(int visit) const;
  template <class Scalar>
  void pack(Search<Scalar>& s, bool deflated);
  template <class Scalar>
  SweptMatrix<Scalar> matrixOf(const Search<Scalar>& s) const
  {
    return {points(), starts_.data(), rows_.data(), s.blocks.data(), s.diagonal.data(), s.inverse.data()};
  }
  template <class Scalar>
  GroupBlocks<Scalar> groupsOf(Search<Scalar>& s) const
  {
    return {deflation_.starts().data(), deflation_.columns().data(), s.group_blocks.data(), s.transposed_blocks.data(),
            s.groups.data()};
  }
  void leave(PointVector& x);
  template <class Scalar>
  double load(Search<Scalar>& s, const PointVector& from, double size);
  template <class Scalar>
  double norm(Search<Scalar>& s, const PointVector& r);
  template <class Scalar>
  void deflate(Search<Scalar>& s);
  template <class Scalar>
  bool begin(Search<Scalar>& s, LinearResult& result);
  template <class Scalar, class Between, class Advanced>
  SearchEnd iterate(Search<Scalar>& s, const GroupBlocks<Scalar>& groups, double square, double scale, double tolerance,
                    int max_iterations, LinearResult& result, Between&& between, Advanced&& advanced);
  template <class Scalar>
  SearchEnd negative(const Search<Scalar>& s, double curvature) const;
  template <class Scalar>
  SearchEnd refine(Search<Scalar>& s, PointVector& x, double tolerance, int max_iterations, LinearResult& result);
  LinearResult solve(const PointVector& right_hand_side, PointVector& x, double tolerance, int max_iterations);
  LinearResult solve(const ConstrainedCholesky& constraints, double stiffness, const PointVector& right_hand_side,
                     PointVector& x, double tolerance, int max_iterations, double reference, double least);
  void toVisits(const PointVector& from, PointVector& to) const;
  template <class Vector>
  void fromVisits(const Vector& from, PointVector& to) const;
};

SymmetricSweeps::SymmetricSweeps() : impl_(std::make_unique<Impl>()) {}
SymmetricSweeps::SymmetricSweeps(const BlockMatrix& a, const PointMatrix* b) : SymmetricSweeps() { setPattern(a, b); }
SymmetricSweeps::~SymmetricSweeps() = default;
SymmetricSweeps::SymmetricSweeps(SymmetricSweeps&&) noexcept = default;
SymmetricSweeps& SymmetricSweeps::operator=(SymmetricSweeps&&) noexcept = default;

void SymmetricSweeps::setPattern(const BlockMatrix& a, const PointMatrix* b) { impl_->setPattern(a, b); }

void SymmetricSweeps::set(double factor, const std::vector<char>& held, const std::vector<char>* apart)
{
  impl_->factor_ = factor;
  impl_->held_ = &held;
  impl_->noteMoving(apart);
}

double SymmetricSweeps::norm(const PointVector& r)
{
  impl_->pack(impl_->double_, false);
  impl_->toVisits(r, impl_->right_);
  return impl_->norm(impl_->double_, impl_->right_);
}

LinearResult SymmetricSweeps::solve(const PointVector& right_hand_side, PointVector& x, double tolerance,
                                    int max_iterations)
{
  return impl_->solve(right_hand_side, x, tolerance, max_iterations);
}

LinearResult SymmetricSweeps::solve(const ConstrainedCholesky& constraints, double stiffness,
                                    const PointVector& right_hand_side, PointVector& x, double tolerance,
                                    int max_iterations, double reference, double least)
{
  return impl_->solve(constraints, stiffness, right_hand_side, x, tolerance, max_iterations, reference, least);
}

// ---- pattern and values

void SymmetricSweeps::Impl::orderPoints()
{
  const int n = a_->points();
  std::vector<int> level(n, 0);
  const auto follow = [&](int j, int i) { level[i] = std::max(level[i], level[j] + 1); };
  for (int j = 0; j < n; ++j)
  {
    for (int k = a_->starts()[j] + 1; k < a_->starts()[j + 1]; ++k)
      follow(j, a_->rows()[k]);
    for (int k = b_ ? b_->starts()[j] : 0; k < (b_ ? b_->starts()[j + 1] : 0); ++k)
      if (b_->column(k) > j)
        follow(j, b_->column(k));
  }
  order_.resize(n);
  std::iota(order_.begin(), order_.end(), 0);
  std::stable_sort(order_.begin(), order_.end(), [&](int i, int j) { return level[i] < level[j]; });
}

void SymmetricSweeps::Impl::setPattern(const BlockMatrix& a, const PointMatrix* b)
{
  a_ = &a;
  b_ = b;
  orderPoints();
  const int n = points();
  std::vector<int> visit(n);
  for (int v = 0; v < n; ++v)
    visit[order_[v]] = v;
  starts_.assign(1, 0);
  for (std::vector<int>* v : {&rows_, &a_entry_, &b_entry_})
    v->clear();
  b_diagonal_.assign(n, -1);
  for (int v = 0; v < n; ++v)
  {
    const int j = order_[v];
    int in_b = b ? b->starts()[j] : 0;
    const int b_end = b ? b->starts()[j + 1] : 0;
    const auto take = [&](int row, int a_entry, int b_entry) {
      rows_.push_back(visit[row]);
      a_entry_.push_back(a_entry);
      b_entry_.push_back(b_entry);
    };
    for (; in_b < b_end && b->column(in_b) <= j; ++in_b)
      if (b->column(in_b) == j)
        b_diagonal_[v] = in_b;
    for (int k = a.starts()[j] + 1; k < a.starts()[j + 1]; ++k)
    {
      for (; in_b < b_end && b->column(in_b) < a.rows()[k]; ++in_b)
        take(b->column(in_b), -1, in_b);
      const bool both = in_b < b_end && b->column(in_b) == a.rows()[k];
      take(a.rows()[k], k, both ? in_b++ : -1);
    }
    for (; in_b < b_end; ++in_b)
      take(b->column(in_b), -1, in_b);
    starts_.push_back(static_cast<int>(rows_.size()));
  }
  deflation_.setPattern(starts_, rows_);
  for (PointVector* v : {&product_, &right_, &residual_, &solution_})
    v->assign(4 * static_cast<std::size_t>(n), 0.0);
  for (PointVector* v : {&common_, &common_sum_})
    v->assign(4 * static_cast<std::size_t>(deflation_.groups()), 0.0);
}

void SymmetricSweeps::Impl::noteMoving(const std::vector<char>* apart)
{
  moves_.resize(order_.size());
  for (int v = 0; v < points(); ++v)
    moves_[v] = !(*held_)[order_[v]] && !(apart && (*apart)[order_[v]]);
}

Eigen::Matrix3d SymmetricSweeps::Impl::blockOf(int entry) const
{
  Eigen::Matrix3d block = Eigen::Matrix3d::Zero();
  if (a_entry_[entry] >= 0)
    block = Eigen::Map<const Eigen::Matrix3d>(a_->values() + 9 * static_cast<std::size_t>(a_entry_[entry]));
  if (b_entry_[entry] >= 0)
    block.diagonal().array() += factor_ * b_->values()[b_entry_[entry]];
  return block;
}

Eigen::Matrix3d SymmetricSweeps::Impl::diagonalOf(int visit) const
{
  Eigen::Matrix3d block =
      Eigen::Map<const Eigen::Matrix3d>(a_->values() + 9 * static_cast<std::size_t>(a_->starts()[order_[visit]]));
  if (b_diagonal_[visit] >= 0)
    block.diagonal().array() += factor_ * b_->values()[b_diagonal_[visit]];
  return block;
}

/// Takes over the values of the matrix, for deflated searches also into deflation_.
template <class Scalar>
void SymmetricSweeps::Impl::pack(Search<Scalar>& s, bool deflated)
{
  s.resize(points(), rows_.size());
  for (int v = 0; v < points(); ++v)
  {
    const Eigen::Matrix3d diagonal = diagonalOf(v);
    const bool held = (*held_)[order_[v]] != 0;
    putBlock(held ? Eigen::Matrix3d::Zero().eval() : diagonal, 4, s.diagonal.data() + 12 * static_cast<std::size_t>(v));
    putBlock(held ? Eigen::Matrix3d::Zero().eval() : diagonal.inverse().eval(), 4,
             s.inverse.data() + 12 * static_cast<std::size_t>(v));
    if (deflated)
      deflation_.addDiagonal(v, diagonal);
    for (int k = starts_[v]; k < starts_[v + 1]; ++k)
    {
      const Eigen::Matrix3d block = blockOf(k);
      putBlock(block, 3, s.blocks.data() + 9 * static_cast<std::size_t>(k));
      if (deflated)
        deflation_.add(k, rows_[k], v, block);
    }
  }
}

void SymmetricSweeps::Impl::toVisits(const PointVector& from, PointVector& to) const
{
  for (int v = 0; v < points(); ++v)
    point(to, v) = point(from, order_[v]);
}

template <class Vector>
void SymmetricSweeps::Impl::fromVisits(const Vector& from, PointVector& to) const
{
  for (int v = 0; v < points(); ++v)
    std::copy_n(from.data() + 4 * static_cast<std::size_t>(v), 3, to.data() + 4 * static_cast<std::size_t>(order_[v]));
}

// ---- searches

/// residual_ := right_ - (A + factor B) solution_, and x := solution_.
void SymmetricSweeps::Impl::leave(PointVector& x)
{
  fromVisits(solution_, x);
  std::fill(product_.begin(), product_.end(), 0.0);
  a_->addProduct(x.data(), product_.data());
  if (b_)
    b_->addProduct(factor_, x.data(), product_.data());
  for (int v = 0; v < points(); ++v)
    point(residual_, v) = point(right_, v) - point(product_, order_[v]);
}

/// Begins a search for the solution with the right-hand side from / size. Sets x = 0, r = (D + L)^-1 from / size and
/// z = p = D r. Returns r . z.
template <class Scalar>
double SymmetricSweeps::Impl::load(Search<Scalar>& s, const PointVector& from, double size)
{
  const SweepKernels<Scalar>& kernels = pointKernels().sweeps<Scalar>();
  for (AlignedVector<Scalar>* v : {&s.x, &s.r, &s.t})
    std::fill(v->begin(), v->end(), Scalar(0));
  for (int v = 0; v < points(); ++v)
    for (int c = 0; c < 3; ++c)
      s.q[4 * v + c] = (*held_)[order_[v]] ? Scalar(0) : static_cast<Scalar>(from[4 * v + c] / size);
  kernels.down(matrixOf(s), {}, s.r.data(), s.t.data(), s.q.data());
  const double square = kernels.advance(matrixOf(s), -1.0, s.t.data(), s.q.data(), s.x.data(), s.r.data(), s.z.data());
  s.p = s.z;
  return square;
}

/// Negative, or not a number, where the matrix is not definite.
template <class Scalar>
double SymmetricSweeps::Impl::norm(Search<Scalar>& s, const PointVector& r)
{
  const double size = largest(r);
  if (size == 0)
    return 0.0;
  const double square = load(s, r, size);
  return square >= 0 ? std::sqrt(square) * size : square;
}

/// Sets the common motions that are to be left out of the direction t, from what the upward sweep gathered in groups.
template <class Scalar>
void SymmetricSweeps::Impl::deflate(Search<Scalar>& s)
{
  std::copy(s.groups.begin(), s.groups.end(), common_.begin());
  deflation_.solve(common_);
  std::transform(common_.begin(), common_.end(), s.groups.begin(), [](double c) { return static_cast<Scalar>(c); });
}

/// Iterates from what load() has left, until the norm is `tolerance` times `scale`. In the norm of D, the matrix is
/// (D + L)^-1 A (D + L^T)^-1, and its product with p is t + (D + L)^-1 (p - D t) with t = (D + L^T)^-1 p, where
/// p - D t = L^T t. What the common motions of `groups` would need is taken from this L^T t.
/// `between` sets them, or adds to L^T t what a larger matrix has beside A. `advanced` follows each step along t.
template <class Scalar, class Between, class Advanced>
SymmetricSweeps::Impl::SearchEnd SymmetricSweeps::Impl::iterate(Search<Scalar>& s, const GroupBlocks<Scalar>& groups,
                                                                double square, double scale, double tolerance,
                                                                int max_iterations, LinearResult& result,
                                                                Between&& between, Advanced&& advanced)
{
  const SweepKernels<Scalar>& kernels = pointKernels().sweeps<Scalar>();
  const SweptMatrix<Scalar> matrix = matrixOf(s);
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
    kernels.turn(points(), next / square, s.z.data(), s.p.data());
    square = next;
    norm = std::sqrt(std::abs(square)) / scale;
  }
  result.residual = norm;
  return SearchEnd::solved;
}

/// What a curvature that is not positive means: in single precision it may be a rounding error.
template <class Scalar>
SymmetricSweeps::Impl::SearchEnd SymmetricSweeps::Impl::negative(const Search<Scalar>& s, double curvature) const
{
  if (std::is_same_v<Scalar, double>)
    return SearchEnd::not_definite;
  double sum = 0.0;
  for (std::size_t v = 0; v < order_.size(); ++v)
    for (int c = 0; c < 3; ++c)
      for (int r = 0; r < 3; ++r)
        sum += static_cast<double>(s.p[4 * v + r]) * s.inverse[12 * v + 4 * c + r] * s.p[4 * v + c];
  // `sum` is p . D^-1 p, the square of the norm of the direction p.
  return curvature < -Search<Scalar>::kLeast * sum ? SearchEnd::not_definite : SearchEnd::stalled;
}

/// Repeats a search for the correction of solution_ (iterative refinement), until the residual is small.
template <class Scalar>
SymmetricSweeps::Impl::SearchEnd SymmetricSweeps::Impl::refine(Search<Scalar>& s, PointVector& x, double tolerance,
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
    const double size = largest(residual_), square = size > 0 ? load(s, residual_, size) : 0.0;
    if (!(square >= 0))
      return negative(s, square);
    result.residual = std::sqrt(square) * size / result.scale;
    if (result.residual <= tolerance || result.iterations >= max_iterations || stepsInterrupted())
    {
      fromVisits(solution_, x);
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
    for (int v = 0; v < points(); ++v)
      for (int c = 0; c < 3; ++c)
        solution_[4 * v + c] +=
            size * (s.x[4 * v + c] - (moves_[v] ? common_sum_[4 * deflation_.groupOf(v) + c] : 0.0));
    leave(x);
    if (end != SearchEnd::solved)
      return end;
  }
}

/// Sets what a solution in this precision needs, and the norm of the right-hand side. Returns false if the matrix is
/// not positive definite.
template <class Scalar>
bool SymmetricSweeps::Impl::begin(Search<Scalar>& s, LinearResult& result)
{
  deflation_.begin(moves_);
  pack(s, true);
  result.scale = norm(s, right_);
  result.definite = result.scale >= 0 && deflation_.factor();
  return result.definite;
}

LinearResult SymmetricSweeps::Impl::solve(const PointVector& right_hand_side, PointVector& x, double tolerance,
                                          int max_iterations)
{
  constexpr double kLeastInSinglePrecision = 1e-6;   // More accurate solutions would need several searches.
  [[maybe_unused]] const NoTinyNumbers no_tiny_numbers;
  LinearResult result;
  std::fill(x.begin(), x.end(), 0.0);
  std::fill(solution_.begin(), solution_.end(), 0.0);
  toVisits(right_hand_side, right_);
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

LinearResult SymmetricSweeps::Impl::solve(const ConstrainedCholesky& constraints, double stiffness,
                                          const PointVector& right_hand_side, PointVector& x, double tolerance,
                                          int max_iterations, double reference, double least)
{
  constexpr double kRounding = 1e-12;   // of the reference
  LinearResult result;
  std::fill(x.begin(), x.end(), 0.0);
  pack(double_, false);
  toVisits(right_hand_side, right_);
  const double square = load(double_, right_, 1.0);
  result.definite = square >= 0;
  if (!(square > 0))
    return result;
  result.scale = std::max(std::min(reference, least / tolerance * std::sqrt(square)), kRounding * reference);
  const SearchEnd end = iterate(
      double_, {}, square, result.scale, tolerance, max_iterations, result,
      [&] {
        fromVisits(double_.t, residual_);
        std::fill(product_.begin(), product_.end(), 0.0);
        constraints.addStiffness(stiffness, residual_.data(), product_.data());
        for (int v = 0; v < points(); ++v)
          for (int c = 0; c < 3; ++c)
            double_.q[4 * v + c] += product_[4 * order_[v] + c];
      },
      [](double) {});
  fromVisits(double_.x, x);
  result.definite = end == SearchEnd::solved;
  return result;
}

}   // namespace slender
