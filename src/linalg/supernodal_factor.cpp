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
                                   const std::vector<int>& matrix_rows)
{
  f_ = factor;
  starts_ = starts;
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

/// From the block of s the part of L L^T that a supernode before it makes there.
void SupernodalNumeric::subtract(int descendant, int s, double* x)
{
  const int* own = f_.rows + f_.row_starts[descendant];
  const int begin = row_[descendant], all = rows(descendant);
  int end = begin;
  while (end < all && own[end] < f_.first[s + 1])
    ++end;
  const int within = end - begin, length = all - begin, below = all - end, width = columns(descendant),
            height = rows(s);
  const double one = 1.0, zero = 0.0;
  const double* block = x + f_.value_starts[descendant] + begin;
  dsyrk_("L", "N", &within, &width, &one, block, &all, &zero, update_.data(), &length);
  if (below > 0)
    dgemm_("N", "C", &below, &within, &width, &one, block + within, &all, block, &all, &zero, update_.data() + within,
           &length);
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
  const int width = columns(s), height = rows(s), below = height - width;
  double* block = x + f_.value_starts[s];
  int info = 0;
  dpotrf_("L", &width, block, &height, &info);
  if (info != 0)
    return false;
  for (int j = 0; j < width; ++j)   // not every LAPACK finds what is not finite
    if (!std::isfinite(block[static_cast<std::ptrdiff_t>(j) * (height + 1)]))
      return false;
  const double one = 1.0;
  if (below > 0)
    dtrsm_("R", "L", "C", "N", &below, &width, &one, block, &height, block + width, &height);
  return true;
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
