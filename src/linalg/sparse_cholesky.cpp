#include "slender_sim/linalg/sparse_cholesky.h"

#include <algorithm>
#include <new>

#include <suitesparse/cholmod.h>

namespace slender {

struct SparseCholesky::Impl
{
  explicit Impl(bool simplicial)
  {
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
    cholmod_free_dense(&solution, &common);
    cholmod_free_dense(&work_y, &common);
    cholmod_free_dense(&work_e, &common);
    cholmod_finish(&common);
  }

  cholmod_sparse view()
  {
    cholmod_sparse a{};
    a.nrow = a.ncol = starts.size() - 1;
    a.nzmax = rows.size();
    a.p = starts.data();
    a.i = rows.data();
    a.x = values.data();
    a.stype = -1;
    a.itype = CHOLMOD_INT;
    a.xtype = CHOLMOD_REAL;
    a.dtype = CHOLMOD_DOUBLE;
    a.sorted = 1;
    a.packed = 1;
    return a;
  }

  cholmod_common common;
  cholmod_factor* factor = nullptr;
  cholmod_dense *solution = nullptr, *work_y = nullptr, *work_e = nullptr;
  std::vector<int> starts{0}, rows;
  std::vector<double> values;
};

SparseCholesky::SparseCholesky(bool simplicial) : impl_(std::make_unique<Impl>(simplicial)) {}
SparseCholesky::~SparseCholesky() = default;
SparseCholesky::SparseCholesky(SparseCholesky&&) noexcept = default;

void SparseCholesky::setPattern(int size, std::vector<int> starts, std::vector<int> rows)
{
  Impl& m = *impl_;
  m.starts = std::move(starts);
  m.rows = std::move(rows);
  m.starts.resize(size + 1);
  m.values.assign(m.rows.size(), 0.0);
  cholmod_free_factor(&m.factor, &m.common);
  cholmod_sparse a = m.view();
  m.factor = cholmod_analyze(&a, &m.common);
  if (!m.factor)
    throw std::bad_alloc();
}

int SparseCholesky::size() const { return static_cast<int>(impl_->starts.size()) - 1; }
double* SparseCholesky::values() { return impl_->values.data(); }
const std::vector<int>& SparseCholesky::starts() const { return impl_->starts; }
const std::vector<int>& SparseCholesky::rows() const { return impl_->rows; }

int SparseCholesky::index(int row, int column) const
{
  const auto begin = impl_->rows.begin();
  return static_cast<int>(std::lower_bound(begin + impl_->starts[column], begin + impl_->starts[column + 1], row) - begin);
}

bool SparseCholesky::factor()
{
  Impl& m = *impl_;
  cholmod_sparse a = m.view();
  m.common.status = CHOLMOD_OK;
  cholmod_factorize(&a, m.factor, &m.common);
  return m.common.status == CHOLMOD_OK && m.factor->minor == m.factor->n;
}

void SparseCholesky::solve(double* x) const
{
  Impl& m = *impl_;
  cholmod_dense b{};
  b.nrow = b.d = b.nzmax = size();
  b.ncol = 1;
  b.x = x;
  b.xtype = CHOLMOD_REAL;
  b.dtype = CHOLMOD_DOUBLE;
  cholmod_solve2(CHOLMOD_A, m.factor, &b, nullptr, &m.solution, nullptr, &m.work_y, &m.work_e, &m.common);
  std::copy_n(static_cast<const double*>(m.solution->x), b.nrow, x);
}

}  // namespace slender
