#include "cholesky6.h"

#include <cmath>

namespace slender {

bool Cholesky6::compute(const Matrix& a)
{
  for (int j = 0; j < 6; ++j)
  {
    double pivot = a(j, j);
    for (int k = 0; k < j; ++k)
      pivot -= l_(j, k) * l_(j, k);
    if (!(pivot > 0) || !std::isfinite(pivot))
      return false;
    l_(j, j) = std::sqrt(pivot);
    for (int i = j + 1; i < 6; ++i)
    {
      double entry = a(i, j);
      for (int k = 0; k < j; ++k)
        entry -= l_(i, k) * l_(j, k);
      l_(i, j) = entry / l_(j, j);
    }
  }
  return true;
}

void Cholesky6::solveInPlace(Vector& v) const
{
  for (int i = 0; i < 6; ++i)
  {
    for (int k = 0; k < i; ++k)
      v[i] -= l_(i, k) * v[k];
    v[i] /= l_(i, i);
  }
  for (int i = 5; i >= 0; --i)
  {
    for (int k = i + 1; k < 6; ++k)
      v[i] -= l_(k, i) * v[k];
    v[i] /= l_(i, i);
  }
}

}   // namespace slender
