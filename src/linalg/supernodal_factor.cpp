#include "supernodal_factor.h"

#include <algorithm>
#include <cmath>
#include <cstddef>

extern "C" {
void dsyrk_(const char* uplo, const char* trans, const int* n, const int* k, const double* alpha, const double* a,
            const int* lda, const double* beta, double* c, const int* ldc);
void dgemm_(const char* transa, const char* transb, const int* m, const int* n, const int* k, const double* alpha,
            const double* a, const int* lda, const double* b, const int* ldb, const double* beta, double* c,
            const int* ldc);
void dtrsm_(const char* side, const char* uplo, const char* transa, const char* diag, const int* m, const int* n,
            const double* alpha, const double* a, const int* lda, double* b, const int* ldb);
void dpotrf_(const char* uplo, const int* n, double* a, const int* lda, int* info);
}

namespace slender {

void SupernodalNumeric::setPattern(const SupernodalFactor& factor, const std::vector<int>& starts,
                                   const std::vector<int>& matrix_rows, const std::vector<int>& negative)
{
  f_ = factor;
  starts_ = starts;
  findRuns(negative);
  const int n = static_cast<int>(starts.size()) - 1;
  supernode_of_.assign(n, 0);
  place_.assign(n, 0);
  targets_.assign(matrix_rows.size(), 0);
  std::size_t most_rows = 0, most_updates = 0;
  for (int s = 0; s < f_.supernodes; ++s)
    for (int j = f_.first[s]; j < f_.first[s + 1]; ++j)
      supernode_of_[j] = s;
  for (int s = 0; s < f_.supernodes; ++s)
  {
    const int* own = f_.rows + f_.row_starts[s];
    for (int i = 0; i < rows(s); ++i)
      place_[own[i]] = i;
    for (int j = f_.first[s]; j < f_.first[s + 1]; ++j)
      for (int k = starts[j]; k < starts[j + 1]; ++k)
        targets_[k] = f_.value_starts[s] + (j - f_.first[s]) * rows(s) + place_[matrix_rows[k]];
    // the largest of the products that subtract() makes
    most_rows = std::max(most_rows, static_cast<std::size_t>(rows(s)));
    for (int i = columns(s); i < rows(s);)
    {
      const int begin = i;
      while (i < rows(s) && supernode_of_[own[i]] == supernode_of_[own[begin]])
        ++i;
      most_updates = std::max(most_updates, static_cast<std::size_t>(rows(s) - begin) * (i - begin));
    }
  }
  relative_.assign(most_rows, 0);
  update_.assign(most_updates, 0.0);
  for (std::vector<int>* v : {&head_, &next_, &row_})
    v->assign(f_.supernodes, -1);
}

void SupernodalNumeric::findRuns(const std::vector<int>& negative)
{
  auto next = negative.begin();
  runs_.clear();
  first_run_.assign(1, 0);
  for (int s = 0; s < f_.supernodes; ++s)
  {
    for (int j = 0; j < columns(s); ++j)
    {
      const bool is_negative = next != negative.end() && *next == f_.first[s] + j;
      next += is_negative;
      const double sign = is_negative ? -1.0 : 1.0;
      if (j == 0 || runs_.back().sign != sign)
        runs_.push_back({j, j, sign});
      runs_.back().end = j + 1;
    }
    first_run_.push_back(static_cast<int>(runs_.size()));
  }
}

/// Into the list of the supernode that row `row` of supernode s belongs to.
void SupernodalNumeric::queue(int s, int row)
{
  row_[s] = row;
  if (row == rows(s))
    return;
  int& head = head_[supernode_of_[f_.rows[f_.row_starts[s] + row]]];
  next_[s] = head;
  head = s;
}

/// From the block of s the part of L D L^T that a supernode before it makes there.
void SupernodalNumeric::subtract(int descendant, int s, double* x)
{
  const int* own = f_.rows + f_.row_starts[descendant];
  const int begin = row_[descendant], all = rows(descendant);
  int end = begin;
  while (end < all && own[end] < f_.first[s + 1])
    ++end;
  const int within = end - begin, length = all - begin, below = all - end, height = rows(s);
  for (int r = first_run_[descendant]; r < first_run_[descendant + 1]; ++r)
  {
    const Run& run = runs_[r];
    const int width = run.end - run.begin;
    const double kept = r == first_run_[descendant] ? 0.0 : 1.0;
    const double* block = x + f_.value_starts[descendant] + begin + static_cast<std::ptrdiff_t>(run.begin) * all;
    dsyrk_("L", "N", &within, &width, &run.sign, block, &all, &kept, update_.data(), &length);
    if (below > 0)
      dgemm_("N", "C", &below, &within, &width, &run.sign, block + within, &all, block, &all, &kept,
             update_.data() + within, &length);
  }
  for (int i = 0; i < length; ++i)
    relative_[i] = place_[own[begin + i]];
  for (int j = 0; j < within; ++j)
  {
    double* to = x + f_.value_starts[s] + static_cast<std::ptrdiff_t>(relative_[j]) * height;
    const double* from = update_.data() + static_cast<std::size_t>(j) * length;
    for (int i = j; i < length; ++i)
      to[relative_[i]] -= from[i];
  }
  queue(descendant, end);
}

/// From the block of s, from which all updates have been subtracted, its columns of L.
bool SupernodalNumeric::finish(int s, double* x) const
{
  for (int r = first_run_[s]; r < first_run_[s + 1]; ++r)
    if (!factorRun(runs_[r], columns(s), rows(s), x + f_.value_starts[s]))
      return false;
  return true;
}

/// The columns of one run, whose part of L D L^T is then subtracted from the columns of the supernode after it.
bool SupernodalNumeric::factorRun(const Run& run, int width, int height, double* block)
{
  const int count = run.end - run.begin, below = height - run.end, after = width - run.end, last = height - width;
  double* const first = block + static_cast<std::ptrdiff_t>(run.begin) * (height + 1);
  for (int j = 0; run.sign < 0.0 && j < count; ++j)
    for (int i = j; i < height - run.begin; ++i)
      first[static_cast<std::ptrdiff_t>(j) * height + i] *= -1.0;
  int info = 0;
  dpotrf_("L", &count, first, &height, &info);
  if (info != 0)
    return false;
  for (int j = 0; j < count; ++j)   // not every LAPACK finds what is not finite
    if (!std::isfinite(first[static_cast<std::ptrdiff_t>(j) * (height + 1)]))
      return false;
  const double one = 1.0, minus = -run.sign;
  if (below > 0)
    dtrsm_("R", "L", "C", "N", &below, &count, &one, first, &height, first + count, &height);
  if (after == 0)
    return true;
  const double* const rest = first + count;
  double* const next = block + static_cast<std::ptrdiff_t>(run.end) * (height + 1);
  dsyrk_("L", "N", &after, &count, &minus, rest, &height, &one, next, &height);
  if (last > 0)
    dgemm_("N", "C", &last, &after, &count, &minus, rest + after, &height, rest, &height, &one, next + after, &height);
  return true;
}

double SupernodalNumeric::pivot(int column, const double* x) const
{
  const int s = supernode_of_[column], at = column - f_.first[s];
  const double root = x[f_.value_starts[s] + static_cast<std::ptrdiff_t>(at) * (rows(s) + 1)];
  return root * root;
}

bool SupernodalNumeric::factor(const double* values, double* x)
{
  std::fill(head_.begin(), head_.end(), -1);
  for (int s = 0; s < f_.supernodes; ++s)
  {
    std::fill(x + f_.value_starts[s], x + f_.value_starts[s + 1], 0.0);
    for (int k = starts_[f_.first[s]]; k < starts_[f_.first[s + 1]]; ++k)
      x[targets_[k]] = values[k];
    const int* own = f_.rows + f_.row_starts[s];
    for (int i = 0; i < rows(s); ++i)
      place_[own[i]] = i;
    for (int descendant = head_[s]; descendant >= 0;)
    {
      const int next = next_[descendant];
      subtract(descendant, s, x);
      descendant = next;
    }
    if (!finish(s, x))
      return false;
    queue(s, columns(s));
  }
  return true;
}

}   // namespace slender
