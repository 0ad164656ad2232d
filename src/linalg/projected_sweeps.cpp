#include "linalg/projected_sweeps.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "slender_sim/linalg/flush_denormals.h"
#include "slender_sim/linalg/interruption.h"

namespace slender {

void ProjectedSweeps::setPattern(const BlockMatrix& a, const PointMatrix* b)
{
  blocks_.setPattern(a, b);
  deflation_.setPattern(blocks_.starts(), blocks_.rows());
  for (PointVector* v : {&right_, &residual_, &product_})
    v->assign(4 * static_cast<std::size_t>(blocks_.points()), 0.0);
  common_.assign(4 * static_cast<std::size_t>(deflation_.groups()), 0.0);
}

void ProjectedSweeps::setAverages(const AverageProjection& projection)
{
  projection_ = &projection;
  grouped_ = projection.count() < deflation_.groups();
  mu_.assign(4 * static_cast<std::size_t>(projection.count()), 0.0);
  setRows(single_);
  setRows(double_);
}

template <class Scalar>
void ProjectedSweeps::setRows(Search<Scalar>& s)
{
  const AverageProjection::Averages& c = projection_->averages();
  const Eigen::VectorXd& give = projection_->give();
  std::vector<int> visit(static_cast<std::size_t>(blocks_.points()));
  for (int v = 0; v < blocks_.points(); ++v)
    visit[blocks_.pointAt(v)] = v;
  const AverageProjection::Averages transposed = c.transpose();
  const auto fill = [&](Rows<Scalar>& rows, Eigen::Index count, const auto& forEntries) {
    rows.starts.assign(1, 0);
    rows.columns.clear();
    rows.values.clear();
    for (Eigen::Index i = 0; i < count; ++i)
    {
      forEntries(i, [&](Eigen::Index column, double value) {
        rows.columns.push_back(static_cast<int>(column));
        rows.values.push_back(static_cast<Scalar>(value));
      });
      rows.starts.push_back(static_cast<int>(rows.columns.size()));
    }
  };
  using Entry = AverageProjection::Averages::InnerIterator;
  for (const bool forces : {true, false})
  {
    fill(forces ? s.of_forces : s.of_motions, c.rows(), [&](Eigen::Index i, const auto& take) {
      for (Entry entry(c, i); entry; ++entry)
        if (give[entry.col()] > 0)
          take(visit[entry.col()], forces ? entry.value() * give[entry.col()] : entry.value());
    });
    fill(forces ? s.forces : s.motions, c.cols(), [&](Eigen::Index v, const auto& take) {
      const int point = blocks_.pointAt(static_cast<int>(v));
      for (Entry entry(transposed, point); entry && give[point] > 0; ++entry)
        take(entry.col(), forces ? entry.value() : entry.value() * give[point]);
    });
  }
  s.averages.assign(4 * static_cast<std::size_t>(c.rows()), Scalar(0));
}

bool ProjectedSweeps::set(double factor, const std::vector<char>& held, const std::vector<char>* apart)
{
  blocks_.set(factor, held, apart);
  single_.packed = double_.packed = false;
  if (!grouped_)
    return true;
  deflation_.begin(blocks_.moves());
  pack(single_, &deflation_);
  return deflation_.factor();
}

template <class Scalar>
void ProjectedSweeps::pack(Search<Scalar>& s, Deflation* deflation)
{
  if (s.packed)
    return;
  blocks_.pack(s.matrix, deflation);
  for (AlignedVector<Scalar>* v : {&s.x, &s.r, &s.z, &s.p, &s.q})
    v->assign(4 * static_cast<std::size_t>(blocks_.points()), Scalar(0));
  s.packed = true;
}

/// v -= back (C W^-1 C^T)^-1 averages v.
template <class Scalar>
void ProjectedSweeps::takeOut(Search<Scalar>& s, const Rows<Scalar>& averages, const Rows<Scalar>& back,
                              AlignedVector<Scalar>& v)
{
  const SweepKernels<Scalar>& kernels = pointKernels().sweeps<Scalar>();
  std::fill(s.averages.begin(), s.averages.end(), Scalar(0));
  kernels.addRows(averages.view(), 1.0, v.data(), s.averages.data());
  std::copy(s.averages.begin(), s.averages.end(), mu_.begin());
  projection_->solve(mu_);
  std::transform(mu_.begin(), mu_.end(), s.averages.begin(), [](double m) { return static_cast<Scalar>(m); });
  kernels.addRows(back.view(), -1.0, s.averages.data(), v.data());
}

/// Takes what the averages balance out of r, where it would drown the rest in rounding errors [Gould, Hribar, Nocedal,
/// SIAM J. Sci. Comput. 23 (2001), 5].
void ProjectedSweeps::takeOut(PointVector& r)
{
  projection_->multipliers(r, mu_);
  projection_->addForces(-1.0, mu_, r);
}

/// z := P r, where z = r before. Returns r . z.
template <class Scalar>
double ProjectedSweeps::precondition(Search<Scalar>& s, bool projected)
{
  const SweepKernels<Scalar>& kernels = pointKernels().sweeps<Scalar>();
  const bool grouped = grouped_ && projected;   // Loads are measured as those of cloth without averages.
  if (grouped)
  {
    std::fill(common_.begin(), common_.end(), 0.0);
    for (int v = 0; v < blocks_.points(); ++v)
      for (int c = 0; c < 3 && blocks_.moves()[v]; ++c)
        common_[4 * deflation_.groupOf(v) + c] += s.r[4 * v + c];
    deflation_.solve(common_);
  }
  kernels.precondition(blocks_.matrixOf(s.matrix), s.z.data());
  for (int v = 0; v < blocks_.points() && grouped; ++v)
    for (int c = 0; c < 3 && blocks_.moves()[v]; ++c)
      s.z[4 * v + c] += static_cast<Scalar>(common_[4 * deflation_.groupOf(v) + c]);
  if (projected)
    takeOut(s, s.of_motions, s.motions, s.z);
  return kernels.dot(blocks_.points(), s.r.data(), s.z.data());
}

/// Begins a search with the right-hand side residual_ / size: x = 0, p = z = P r. Returns r . z.
template <class Scalar>
double ProjectedSweeps::load(Search<Scalar>& s, double size, bool projected)
{
  std::fill(s.x.begin(), s.x.end(), Scalar(0));
  for (int v = 0; v < blocks_.points(); ++v)
    for (int c = 0; c < 3; ++c)
      s.r[4 * v + c] =
          blocks_.isHeld(v) ? Scalar(0) : static_cast<Scalar>(residual_[4 * blocks_.pointAt(v) + c] / size);
  if (projected)
    takeOut(s, s.of_forces, s.forces, s.r);
  s.z = s.r;
  const double square = precondition(s, projected);
  s.p = s.z;
  return square;
}

double ProjectedSweeps::norm(const PointVector& r)
{
  const double size = largestEntry(r);
  if (size == 0)
    return 0.0;
  residual_ = r;
  pack(single_, nullptr);
  double square = load(single_, size, false);
  if (!(square >= 0))   // It may be a rounding error.
  {
    pack(double_, nullptr);
    square = load(double_, size, false);
  }
  return square >= 0 ? std::sqrt(square) * size : square;
}

/// Iterates from what load() has left, until the norm is `tolerance` times `scale`.
template <class Scalar>
ProjectedSweeps::SearchEnd ProjectedSweeps::iterate(Search<Scalar>& s, double square, double scale, double tolerance,
                                                    int max_iterations, LinearResult& result)
{
  const SweepKernels<Scalar>& kernels = pointKernels().sweeps<Scalar>();
  const SweptMatrix<Scalar> matrix = blocks_.matrixOf(s.matrix);
  const int n = blocks_.points();
  double norm = std::sqrt(square) / scale;
  for (; norm > tolerance && result.iterations < max_iterations && !stepsInterrupted(); ++result.iterations)
  {
    std::fill(s.q.begin(), s.q.end(), Scalar(0));
    const double curvature = kernels.multiply(matrix, s.p.data(), s.q.data());
    if (!(curvature > 0))
      return kNegative<Scalar>;
    takeOut(s, s.of_forces, s.forces, s.q);
    kernels.move(n, square / curvature, s.p.data(), s.q.data(), s.x.data(), s.r.data(), s.z.data());
    const double next = precondition(s, true);
    if (!(next >= 0))
      return kNegative<Scalar>;
    kernels.turn(n, next / square, s.z.data(), s.p.data());
    square = next;
    norm = std::sqrt(square) / scale;
  }
  result.residual = norm;
  return SearchEnd::solved;
}

/// Repeats a search for the correction of x (iterative refinement), until the residual is small.
template <class Scalar>
ProjectedSweeps::SearchEnd ProjectedSweeps::refine(Search<Scalar>& s, PointVector& x, double tolerance,
                                                   int max_iterations, double reference, LinearResult& result)
{
  constexpr double kLeastGain = 0.3;
  constexpr double kMargin = 0.5;       // A search that stops just below the tolerance would have to be repeated.
  constexpr double kLeft = 0.2;         // The most that is left, as a share of the start.
  constexpr double kHeld = 3.0;         // The comment of solve() says why.
  constexpr double kRounding = 1e-12;   // The least scale, as a share of the load.
  pack(s, nullptr);
  for (double before = std::numeric_limits<double>::infinity();;)
  {
    takeOut(residual_);
    const double size = largestEntry(residual_), square = size == 0 ? 0.0 : load(s, size, true);
    if (!(square >= 0))
      return kNegative<Scalar>;
    const double norm = std::sqrt(square) * size;
    if (result.scale == 0)
      result.scale = reference > 0 ? std::max(std::min((grouped_ ? 1.0 : kHeld) * reference, kLeft / tolerance * norm),
                                              kRounding * reference)
                                   : norm;
    result.residual = result.scale > 0 ? norm / result.scale : 0.0;
    if (result.residual <= tolerance || stepsInterrupted())
      return SearchEnd::solved;
    if (result.iterations >= max_iterations)
      return SearchEnd::stalled;
    if (result.residual > kLeastGain * before)
      return SearchEnd::stalled;
    before = result.residual;
    const double least = std::max(kMargin * tolerance, Search<Scalar>::kLeast * result.residual);
    const SearchEnd end = iterate(s, square, result.scale / size, least, max_iterations, result);
    for (int v = 0; v < blocks_.points(); ++v)
      for (int c = 0; c < 3; ++c)
        x[4 * static_cast<std::size_t>(blocks_.pointAt(v)) + c] += size * s.x[4 * v + c];
    projection_->averagesOf(x, mu_);   // Rounding errors have moved the averages by this.
    projection_->solve(mu_);
    projection_->addMotion(-1.0, mu_, x);
    blocks_.multiply(x, product_);
    for (std::size_t i = 0; i < residual_.size(); ++i)
      residual_[i] = right_[i] - product_[i];
    if (end != SearchEnd::solved)
      return end;
  }
}

LinearResult ProjectedSweeps::solve(const PointVector& right_hand_side, PointVector& x, double tolerance,
                                    int max_iterations, double load)
{
  constexpr double kLeastInSinglePrecision = 1e-6;   // More accurate solutions would need several searches.
  constexpr int kShareOfSinglePrecision = 4;         // Stiff matrices converge in double precision alone.
  [[maybe_unused]] const FlushDenormals flush;       // Tiny numbers arise far from where forces act.
  LinearResult result;
  std::fill(x.begin(), x.end(), 0.0);
  right_ = right_hand_side;
  takeOut(right_);
  residual_ = right_;
  SearchEnd end = SearchEnd::stalled;
  if (tolerance >= kLeastInSinglePrecision)
    end = refine(single_, x, tolerance, max_iterations / kShareOfSinglePrecision, load, result);
  if (end == SearchEnd::stalled)
  {
    std::fill(x.begin(), x.end(), 0.0);
    residual_ = right_;
    end = refine(double_, x, tolerance, max_iterations, load, result);
  }
  result.definite = end != SearchEnd::not_definite;
  return result;
}

}   // namespace slender
