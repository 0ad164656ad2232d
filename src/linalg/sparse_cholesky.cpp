#include "slender_sim/linalg/sparse_cholesky.h"

#include <algorithm>
#include <iterator>
#include <mutex>
#include <new>
#include <numeric>
#include <tuple>

#include <suitesparse/cholmod.h>

#include "slender_sim/linalg/point_kernel.h"
#include "supernodal_factor.h"

// Absent from other BLAS libraries than OpenBLAS.
extern "C" __attribute__((weak)) void openblas_set_num_threads(int);

namespace slender {

namespace {

/// BLAS stays in its caller's thread: dense blocks here are too small for more, whose threads only spin, and sums must
/// not depend on their number.
void useOneBlasThread()
{
  static std::once_flag once;
  std::call_once(once, [] {
    if (openblas_set_num_threads)
      openblas_set_num_threads(1);
  });
}

}   // namespace

struct SparseCholesky::Impl
{
  explicit Impl(bool simplicial)
  {
    useOneBlasThread();
    cholmod_start(&common);
    if (simplicial)
      common.supernodal = CHOLMOD_SIMPLICIAL;
    common.final_ll = 1;   // LL^T finds out that a matrix is not definite; LDL^T would go on with negative pivots
    common.print = 0;
    common.error_handler = nullptr;
  }
  ~Impl()
  {
    cholmod_free_factor(&factor, &common);
    cholmod_free_dense(&right, &common);
    cholmod_free_dense(&solution, &common);
    cholmod_free_dense(&work_y, &common);
    cholmod_free_dense(&work_e, &common);
    cholmod_finish(&common);
  }

  cholmod_sparse view()
  {
    cholmod_sparse a = patternView(starts, rows);
    a.x = values.data();
    a.xtype = CHOLMOD_REAL;
    a.dtype = CHOLMOD_DOUBLE;
    return a;
  }

  /// Symmetric pattern without values, lower triangle by columns.
  static cholmod_sparse patternView(std::vector<int>& starts, std::vector<int>& rows)
  {
    cholmod_sparse a{};
    a.nrow = a.ncol = starts.size() - 1;
    a.nzmax = rows.size();
    a.p = starts.data();
    a.i = rows.data();
    a.stype = -1;
    a.itype = CHOLMOD_INT;
    a.xtype = CHOLMOD_PATTERN;
    a.sorted = 1;
    a.packed = 1;
    return a;
  }

  SupernodalFactor supernodes() const
  {
    return {static_cast<int>(factor->nsuper),    static_cast<const int*>(factor->super),
            static_cast<const int*>(factor->pi), static_cast<const int*>(factor->px),
            static_cast<const int*>(factor->s),  static_cast<const double*>(factor->x)};
  }

  /// Where the values of a block (or number) of a matrix of points go; its columns follow each other, each one shorter
  /// by one.
  struct Target
  {
    int at, column_length;   ///< of its first column, and of that column
    bool transposed, diagonal;
  };
  cholmod_factor* analyse(std::vector<int>& pattern_starts, std::vector<int>& pattern_rows);
  std::vector<int> orderOfPoints(const std::vector<int>& pattern_starts, const std::vector<int>& pattern_rows);
  void takeOrder();
  std::vector<int> placesOfMultipliers() const;
  cholmod_sparse permutedView();

  std::vector<int> place;   ///< of each point (or, without points, unknown) in the order of elimination
  std::vector<Target> targets;
  int unknowns = 1;                 ///< per point
  int multipliers = 0;              ///< The last unknowns of a matrix without points.
  cholmod_dense* right = nullptr;   ///< work space of solvePoints: for blocks
  PointVector permuted;             ///< for numbers
  SupernodalNumeric numeric;
  /// For matrices without points: the matrix in the order of elimination, the place of each entry in it, and the work
  /// space of solve().
  std::vector<int> permuted_starts, permuted_rows, permuted_at;
  std::vector<double> permuted_values, permuted_right;

  cholmod_common common;
  cholmod_factor* factor = nullptr;
  cholmod_dense *solution = nullptr, *work_y = nullptr, *work_e = nullptr;
  std::vector<int> starts{0}, rows;
  std::vector<double> values;
};

SparseCholesky::SparseCholesky(bool simplicial) : impl_(std::make_unique<Impl>(simplicial)) {}
SparseCholesky::~SparseCholesky() = default;
SparseCholesky::SparseCholesky(SparseCholesky&&) noexcept = default;
SparseCholesky& SparseCholesky::operator=(SparseCholesky&&) noexcept = default;

/// Analyses a pattern, with multipliers after the other unknowns of their constraints.
cholmod_factor* SparseCholesky::Impl::analyse(std::vector<int>& pattern_starts, std::vector<int>& pattern_rows)
{
  cholmod_sparse a = patternView(pattern_starts, pattern_rows);
  cholmod_factor* result = nullptr;
  if (multipliers == 0)
    result = cholmod_analyze(&a, &common);
  else
  {
    std::vector<int> order = orderOfPoints(pattern_starts, pattern_rows);
    const auto [methods, ordering, kind] = std::tuple(common.nmethods, common.method[0].ordering, common.supernodal);
    common.nmethods = 1;
    common.method[0].ordering = CHOLMOD_GIVEN;
    common.supernodal = CHOLMOD_SUPERNODAL;
    result = cholmod_analyze_p(&a, order.data(), nullptr, 0, &common);
    common.nmethods = methods;
    common.method[0].ordering = ordering;
    common.supernodal = kind;
  }
  if (!result)
    throw std::bad_alloc();
  return result;
}

/// An order in which all unknowns but multipliers are eliminated with little fill. Each multiplier comes right after
/// the last unknown of its constraint, where its pivot is negative if the matrix without multipliers is positive
/// definite.
std::vector<int> SparseCholesky::Impl::orderOfPoints(const std::vector<int>& pattern_starts,
                                                     const std::vector<int>& pattern_rows)
{
  const int n = static_cast<int>(pattern_starts.size()) - 1, first = n - multipliers;
  std::vector<int> own_starts{0}, own_rows, last(n, first - 1), order;
  if (first == 0)   // The matrix is zero.
  {
    order.resize(n);
    std::iota(order.begin(), order.end(), 0);
    return order;
  }
  for (int j = 0; j < first; ++j)
  {
    std::copy_if(pattern_rows.begin() + pattern_starts[j], pattern_rows.begin() + pattern_starts[j + 1],
                 std::back_inserter(own_rows), [first](int row) { return row < first; });
    own_starts.push_back(static_cast<int>(own_rows.size()));
  }
  cholmod_sparse a = patternView(own_starts, own_rows);
  cholmod_factor* analysed = cholmod_analyze(&a, &common);
  if (!analysed)
    throw std::bad_alloc();
  const std::vector<int> points(static_cast<int*>(analysed->Perm), static_cast<int*>(analysed->Perm) + first);
  cholmod_free_factor(&analysed, &common);
  std::vector<std::vector<int>> after(first);   // multipliers, by the place of the last unknown
  for (int k = 0; k < first; ++k)
    for (int at = pattern_starts[points[k]]; at < pattern_starts[points[k] + 1]; ++at)
      last[pattern_rows[at]] = k;
  for (int multiplier = first; multiplier < n; ++multiplier)
    after[last[multiplier]].push_back(multiplier);
  for (int k = 0; k < first; ++k)
  {
    order.push_back(points[k]);
    order.insert(order.end(), after[k].begin(), after[k].end());
  }
  return order;
}

/// In the order of elimination, ascending.
std::vector<int> SparseCholesky::Impl::placesOfMultipliers() const
{
  std::vector<int> places(place.end() - multipliers, place.end());
  std::sort(places.begin(), places.end());
  return places;
}

void SparseCholesky::setPattern(int size, std::vector<int> starts, std::vector<int> rows, int multipliers)
{
  Impl& m = *impl_;
  m.multipliers = multipliers;
  m.starts = std::move(starts);
  m.rows = std::move(rows);
  m.starts.resize(size + 1);
  m.values.assign(m.rows.size(), 0.0);
  cholmod_free_factor(&m.factor, &m.common);
  m.factor = m.analyse(m.starts, m.rows);
  m.takeOrder();
}

/// Keeps the matrix in the order of elimination, because CHOLMOD would otherwise make a permuted copy in each
/// factorisation. Supernodes need the lower triangle. CHOLMOD itself reads the columns of the upper triangle.
void SparseCholesky::Impl::takeOrder()
{
  const int n = static_cast<int>(starts.size()) - 1;
  const bool lower = factor->is_super;
  place.resize(n);
  for (int k = 0; k < n; ++k)
    place[static_cast<int*>(factor->Perm)[k]] = k;
  const auto columnOf = [&](int i, int j) { return (place[i] < place[j]) == lower ? place[i] : place[j]; };
  permuted_starts.assign(n + 1, 0);
  permuted_rows.resize(rows.size());
  for (int j = 0; j < n; ++j)
    for (int k = starts[j]; k < starts[j + 1]; ++k)
      ++permuted_starts[columnOf(j, rows[k]) + 1];
  std::partial_sum(permuted_starts.begin(), permuted_starts.end(), permuted_starts.begin());
  std::vector<int> next(permuted_starts.begin(), permuted_starts.end() - 1);
  permuted_at.resize(rows.size());
  for (int j = 0; j < n; ++j)
    for (int k = starts[j]; k < starts[j + 1]; ++k)
    {
      const int column = columnOf(j, rows[k]), at = next[column]++;
      permuted_at[k] = at;
      permuted_rows[at] = place[j] + place[rows[k]] - column;
    }
  permuted_values.resize(rows.size());
  permuted_right.resize(n);
  rows = {};                            // permuted_rows has taken their place
  factor->ordering = CHOLMOD_NATURAL;   // The permuted matrix has the right order.
  std::iota(static_cast<int*>(factor->Perm), static_cast<int*>(factor->Perm) + n, 0);
  if (!lower)
    return;
  if (!cholmod_change_factor(CHOLMOD_REAL, 1, 1, 1, 1, factor, &common))
    throw std::bad_alloc();
  numeric.setPattern(supernodes(), permuted_starts, permuted_rows, placesOfMultipliers());
}

/// The upper triangle in the order of elimination.
cholmod_sparse SparseCholesky::Impl::permutedView()
{
  cholmod_sparse a = patternView(permuted_starts, permuted_rows);
  a.stype = 1;
  a.sorted = 0;
  a.x = permuted_values.data();
  a.xtype = CHOLMOD_REAL;
  a.dtype = CHOLMOD_DOUBLE;
  return a;
}

void SparseCholesky::setPattern(const BlockMatrix& matrix) { setPointPattern(matrix, 3); }

void SparseCholesky::setPattern(const PointMatrix& matrix)
{
  std::vector<std::pair<int, int>> pairs;
  for (int i = 0; i < matrix.size(); ++i)
    for (int k = matrix.starts()[i]; k < matrix.starts()[i + 1]; ++k)
      if (matrix.column(k) < i)
        pairs.emplace_back(matrix.column(k), i);
  Eigen::MatrixXi edges(2, static_cast<Eigen::Index>(pairs.size()));
  for (std::size_t k = 0; k < pairs.size(); ++k)
    edges.col(static_cast<Eigen::Index>(k)) << pairs[k].first, pairs[k].second;
  setPointPattern(BlockMatrix(matrix.size(), {edges}), 1);
  // entries of the lower triangle in the order of the rows, each to the target of its block
  const BlockMatrix pattern(matrix.size(), {edges});
  const std::vector<int> map = pattern.mapOf(matrix);
  std::vector<Impl::Target> targets;
  for (const int block : map)
    if (block >= 0)
      targets.push_back(impl_->targets[block]);
  impl_->targets.swap(targets);
}

void SparseCholesky::setPointPattern(const BlockMatrix& pattern, int unknowns)
{
  Impl& m = *impl_;
  m.multipliers = 0;
  const int points = pattern.points(), d = unknowns;
  // order of the points, postordered, by CHOLMOD's analysis of their graph
  std::vector<int> starts = pattern.starts(), rows = pattern.rows();
  m.common.nmethods = 1;
  m.common.method[0].ordering = CHOLMOD_METIS;
  m.common.postorder = 1;
  cholmod_factor* order = m.analyse(starts, rows);
  m.unknowns = d;
  m.place.resize(points);
  for (int k = 0; k < points; ++k)
    m.place[static_cast<int*>(order->Perm)[k]] = k;
  cholmod_free_factor(&order, &m.common);

  // the permuted pattern; CHOLMOD takes it as it is, without making copies
  std::vector<std::vector<std::pair<int, int>>> columns(points);   // row, block
  for (int j = 0; j < points; ++j)
    for (int k = pattern.starts()[j]; k < pattern.starts()[j + 1]; ++k)
    {
      const int a = m.place[j], b = m.place[pattern.rows()[k]];
      columns[std::min(a, b)].emplace_back(std::max(a, b), k);
    }
  m.targets.resize(pattern.blocks());
  m.starts.assign(1, 0);
  m.rows.clear();
  std::vector<int> column_of(pattern.blocks());
  for (int j = 0; j < points; ++j)
    for (int k = pattern.starts()[j]; k < pattern.starts()[j + 1]; ++k)
      column_of[k] = j;
  for (int j = 0; j < points; ++j)
  {
    std::sort(columns[j].begin(), columns[j].end());
    const int begin = m.starts.back(), length = d * static_cast<int>(columns[j].size());
    for (std::size_t r = 0; r < columns[j].size(); ++r)
    {
      const int k = columns[j][r].second;
      m.targets[k] = {begin + d * static_cast<int>(r), length, m.place[column_of[k]] != j, r == 0};
    }
    for (int c = 0; c < d; ++c)
    {
      for (const auto& [row, block] : columns[j])
        for (int e = row == j ? c : 0; e < d; ++e)
          m.rows.push_back(d * row + e);
      m.starts.push_back(static_cast<int>(m.rows.size()));
    }
  }
  m.values.assign(m.rows.size(), 0.0);
  m.common.method[0].ordering = CHOLMOD_NATURAL;
  m.common.postorder = 0;
  // wide supernodes make factoring faster; factors of numbers are made for their back-solves, which read less without
  // the zeros
  const std::size_t widths[3] = {d == 1 ? 4u : 16u, d == 1 ? 16u : 48u, d == 1 ? 48u : 128u};
  const double zeros[3] = {0.8, d == 1 ? 0.1 : 0.3, d == 1 ? 0.05 : 0.1};
  for (int k = 0; k < 3; ++k)
  {
    m.common.nrelax[k] = widths[k];
    m.common.zrelax[k] = zeros[k];
  }
  m.common.supernodal = CHOLMOD_SUPERNODAL;
  cholmod_free_factor(&m.factor, &m.common);
  cholmod_sparse a = m.view();
  m.factor = cholmod_analyze(&a, &m.common);
  cholmod_free_dense(&m.right, &m.common);
  if (d == 1)
    m.permuted.assign(4 * points, 0.0);
  else
    m.right = cholmod_allocate_dense(d * points, 1, d * points, CHOLMOD_REAL, &m.common);
  if (!m.factor || (d != 1 && !m.right) || !cholmod_change_factor(CHOLMOD_REAL, 1, 1, 1, 1, m.factor, &m.common))
    throw std::bad_alloc();
  m.numeric.setPattern(m.supernodes(), m.starts, m.rows, m.placesOfMultipliers());
}

bool SparseCholesky::factor(const BlockMatrix& matrix, const char* fixed)
{
  Impl& m = *impl_;
  for (int j = 0; j < matrix.points(); ++j)
    for (int k = matrix.starts()[j]; k < matrix.starts()[j + 1]; ++k)
    {
      const Impl::Target& t = m.targets[k];
      const double* block = matrix.values() + 9 * static_cast<std::size_t>(k);
      const bool leave_out = fixed && (fixed[j] || fixed[matrix.rows()[k]]);
      // column c of the target begins after c columns, each one shorter by one, and has lost its first c rows
      for (int c = 0; c < 3; ++c)
      {
        double* out = m.values.data() + t.at + c * t.column_length - c * (c - 1) / 2 - c;
        for (int r = t.diagonal ? c : 0; r < 3; ++r)
          out[r] = leave_out ? (t.diagonal && r == c) : t.transposed ? block[3 * r + c] : block[3 * c + r];
      }
    }
  return m.numeric.factor(m.values.data(), static_cast<double*>(m.factor->x));
}

bool SparseCholesky::factor(const PointMatrix& matrix, const char* fixed)
{
  return factor(matrix, matrix.values().data(), fixed);
}

bool SparseCholesky::factor(const PointMatrix& matrix, const double* values, const char* fixed)
{
  Impl& m = *impl_;
  std::size_t next = 0;
  for (int i = 0; i < matrix.size(); ++i)
    for (int k = matrix.starts()[i]; k < matrix.starts()[i + 1]; ++k)
    {
      const int j = matrix.column(k);
      if (j > i)
        continue;
      const bool leave_out = fixed && (fixed[i] || fixed[j]);
      m.values[m.targets[next++].at] = leave_out ? i == j : values[k];
    }
  return m.numeric.factor(m.values.data(), static_cast<double*>(m.factor->x));
}

void SparseCholesky::solvePoints(const double* b, double* x) const
{
  Impl& m = *impl_;
  const int points = static_cast<int>(m.place.size());
  if (m.unknowns == 1)
  {
    forwardPoints(b, m.permuted.data());
    backwardPoints(m.permuted.data(), x);
    return;
  }
  double* right = static_cast<double*>(m.right->x);
  for (int i = 0; i < points; ++i)
    std::copy_n(b + 4 * i, 3, right + 3 * m.place[i]);
  cholmod_solve2(CHOLMOD_A, m.factor, m.right, nullptr, &m.solution, nullptr, &m.work_y, &m.work_e, &m.common);
  const double* solution = static_cast<const double*>(m.solution->x);
  for (int i = 0; i < points; ++i)
  {
    std::copy_n(solution + 3 * m.place[i], 3, x + 4 * i);
    x[4 * i + 3] = 0.0;
  }
}

// three right-hand sides are too few for BLAS: kernels of our own take a third of the time
void SparseCholesky::forwardPoints(const double* b, double* y) const
{
  for (std::size_t i = 0; i < impl_->place.size(); ++i)
    std::copy_n(b + 4 * i, 4, y + 4 * impl_->place[i]);
  pointKernels().forwardSupernodal(impl_->supernodes(), y);
}

void SparseCholesky::backwardPoints(double* y, double* x) const
{
  pointKernels().backwardSupernodal(impl_->supernodes(), y);
  for (std::size_t i = 0; i < impl_->place.size(); ++i)
    std::copy_n(y + 4 * impl_->place[i], 4, x + 4 * i);
}

int SparseCholesky::size() const { return static_cast<int>(impl_->starts.size()) - 1; }
double* SparseCholesky::values() { return impl_->values.data(); }

bool SparseCholesky::factor()
{
  Impl& m = *impl_;
  for (std::size_t k = 0; k < m.values.size(); ++k)
    m.permuted_values[m.permuted_at[k]] = m.values[k];
  if (m.factor->is_super)
    return m.numeric.factor(m.permuted_values.data(), static_cast<double*>(m.factor->x));
  cholmod_sparse a = m.permutedView();
  m.common.status = CHOLMOD_OK;
  cholmod_factorize(&a, m.factor, &m.common);
  return m.common.status == CHOLMOD_OK && m.factor->minor == m.factor->n;
}

void SparseCholesky::solve(double* x) const
{
  Impl& m = *impl_;
  for (int i = 0; i < size(); ++i)
    m.permuted_right[m.place[i]] = x[i];
  cholmod_dense b{};
  b.nrow = b.d = b.nzmax = size();
  b.ncol = 1;
  b.x = m.permuted_right.data();
  b.xtype = CHOLMOD_REAL;
  b.dtype = CHOLMOD_DOUBLE;
  const auto solve = [&](int part) {
    cholmod_solve2(part, m.factor, &b, nullptr, &m.solution, nullptr, &m.work_y, &m.work_e, &m.common);
    return static_cast<const double*>(m.solution->x);
  };
  if (m.multipliers > 0)
  {
    std::copy_n(solve(CHOLMOD_L), size(), m.permuted_right.begin());
    for (auto k = m.place.end() - m.multipliers; k < m.place.end(); ++k)
      m.permuted_right[*k] *= -1.0;
  }
  const double* const solution = solve(m.multipliers > 0 ? CHOLMOD_Lt : CHOLMOD_A);
  for (int i = 0; i < size(); ++i)
    x[i] = solution[m.place[i]];
}

double SparseCholesky::pivot(int unknown) const
{
  return impl_->numeric.pivot(impl_->place[unknown], static_cast<const double*>(impl_->factor->x));
}

}   // namespace slender
