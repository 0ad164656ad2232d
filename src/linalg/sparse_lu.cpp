#include "slender_sim/linalg/sparse_lu.h"

#include <algorithm>
#include <numeric>

#include <Eigen/OrderingMethods>
#include <Eigen/SparseCore>
#include <suitesparse/klu.h>

namespace slender {

namespace {

/// The first `leading` unknowns as they are, then the others by minimum degree of what eliminating the first leaves.
std::vector<int> pivotOrder(int size, const std::vector<int>& starts, const std::vector<int>& rows, int leading)
{
  std::vector<int> order(size), group(leading);   // groups: leading unknowns that depend on each other
  std::iota(order.begin(), order.end(), 0);
  if (leading == size)
    return order;
  std::iota(group.begin(), group.end(), 0);
  const auto find = [&](int i) {
    while (group[i] != i)
      i = group[i] = group[group[i]];
    return i;
  };
  const auto forEntries = [&](auto&& f) {
    for (int column = 0; column < size; ++column)
      for (int p = starts[column]; p < starts[column + 1]; ++p)
        f(rows[p], column);
  };
  forEntries([&](int i, int j) {
    if (i < leading && j < leading)
      group[find(i)] = find(j);
  });
  std::vector<std::vector<int>> neighbours(leading);   // of each group, among the others
  std::vector<Eigen::Triplet<double>> entries;
  forEntries([&](int i, int j) {
    if (i < leading && j >= leading)
      neighbours[find(i)].push_back(j - leading);
    if (i >= leading && j >= leading)
      entries.emplace_back(i - leading, j - leading, 1.0);
  });
  for (std::vector<int>& all : neighbours)
  {
    std::sort(all.begin(), all.end());
    all.erase(std::unique(all.begin(), all.end()), all.end());
    for (int i : all)
      for (int j : all)
        entries.emplace_back(i, j, 1.0);
  }
  Eigen::SparseMatrix<double> rest(size - leading, size - leading);
  rest.setFromTriplets(entries.begin(), entries.end());
  Eigen::PermutationMatrix<Eigen::Dynamic, Eigen::Dynamic, int> found;
  Eigen::AMDOrdering<int>()(rest, found);
  for (int k = leading; k < size; ++k)
    order[k] = leading + found.indices()[k - leading];
  return order;
}

}   // namespace

struct SparseLu::Impl
{
  Impl()
  {
    klu_defaults(&common);
    common.btf = 0;
    common.tol = 0.0;   // pivots stay on the diagonal
  }
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

void SparseLu::setPattern(int size, std::vector<int> starts, std::vector<int> rows, int leading)
{
  Impl& m = *impl_;
  m.starts = std::move(starts);
  m.rows = std::move(rows);
  m.values.assign(m.rows.size(), 0.0);
  klu_free_numeric(&m.numeric, &m.common);
  klu_free_symbolic(&m.symbolic, &m.common);
  std::vector<int> order = pivotOrder(size, m.starts, m.rows, leading);
  m.symbolic = klu_analyze_given(size, m.starts.data(), m.rows.data(), order.data(), order.data(), &m.common);
}

int SparseLu::size() const { return static_cast<int>(impl_->starts.size()) - 1; }
std::vector<double>& SparseLu::values() { return impl_->values; }

int SparseLu::index(int row, int column) const
{
  const auto begin = impl_->rows.begin();
  return static_cast<int>(std::lower_bound(begin + impl_->starts[column], begin + impl_->starts[column + 1], row) -
                          begin);
}

bool SparseLu::factor()
{
  Impl& m = *impl_;
  if (!m.symbolic)
    return false;
  if (!m.numeric)
    m.numeric = klu_factor(m.starts.data(), m.rows.data(), m.values.data(), m.symbolic, &m.common);
  return m.numeric && klu_refactor(m.starts.data(), m.rows.data(), m.values.data(), m.symbolic, m.numeric, &m.common) &&
         klu_rcond(m.symbolic, m.numeric, &m.common) && m.common.rcond > 0;
}

void SparseLu::solve(double* x) const
{
  Impl& m = *impl_;
  klu_solve(m.symbolic, m.numeric, size(), 1, x, &m.common);
}

}   // namespace slender
