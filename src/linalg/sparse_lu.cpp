#include "slender_sim/linalg/sparse_lu.h"

#include <algorithm>
#include <cmath>
#include <new>

#include <suitesparse/klu.h>

namespace slender {

struct SparseLu::Impl
{
  Impl() { klu_defaults(&common); }
  ~Impl()
  {
    klu_free_numeric(&numeric, &common);
    klu_free_symbolic(&symbolic, &common);
  }

  klu_common common;
  klu_symbolic* symbolic = nullptr;
  klu_numeric* numeric = nullptr;
  std::vector<int> starts{0}, rows;
  std::vector<double> values;
};

SparseLu::SparseLu() : impl_(std::make_unique<Impl>()) {}
SparseLu::~SparseLu() = default;
SparseLu::SparseLu(SparseLu&&) noexcept = default;

void SparseLu::setPattern(int size, std::vector<int> starts, std::vector<int> rows)
{
  Impl& m = *impl_;
  m.starts = std::move(starts);
  m.rows = std::move(rows);
  m.values.assign(m.rows.size(), 0.0);
  klu_free_numeric(&m.numeric, &m.common);
  klu_free_symbolic(&m.symbolic, &m.common);
  m.symbolic = klu_analyze(size, m.starts.data(), m.rows.data(), &m.common);
}

int SparseLu::size() const { return static_cast<int>(impl_->starts.size()) - 1; }
std::vector<double>& SparseLu::values() { return impl_->values; }

int SparseLu::index(int row, int column) const
{
  const auto begin = impl_->rows.begin();
  return static_cast<int>(std::lower_bound(begin + impl_->starts[column], begin + impl_->starts[column + 1], row) - begin);
}

bool SparseLu::factor()
{
  Impl& m = *impl_;
  if (!m.symbolic)   // structurally singular
    return false;
  constexpr double kWorn = 1e-14;   // reciprocal condition below which kept pivots are given up
  if (m.numeric && klu_refactor(m.starts.data(), m.rows.data(), m.values.data(), m.symbolic, m.numeric, &m.common) &&
      klu_rcond(m.symbolic, m.numeric, &m.common) && m.common.rcond > kWorn)
    return true;
  klu_free_numeric(&m.numeric, &m.common);
  m.numeric = klu_factor(m.starts.data(), m.rows.data(), m.values.data(), m.symbolic, &m.common);
  return m.numeric && klu_rcond(m.symbolic, m.numeric, &m.common) && m.common.rcond > 0;
}

void SparseLu::solve(double* x) const
{
  Impl& m = *impl_;
  klu_solve(m.symbolic, m.numeric, size(), 1, x, &m.common);
}

}  // namespace slender
