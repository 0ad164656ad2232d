#pragma once

#include <algorithm>

namespace slender {

/// Smallest value of a convex function on [0, 1] by golden section.
template <class Function>
double convexMinimum(Function f)
{
  constexpr double kGolden = 0.6180339887498949;
  double a = 0.0, b = 1.0, p = 1.0 - kGolden, q = kGolden, fp = f(p), fq = f(q);
  double best = std::min({f(0.0), f(1.0), fp, fq});
  for (int k = 0; k < 60; ++k)
  {
    if (fp < fq)
    {
      b = q;
      q = p;
      fq = fp;
      p = b - kGolden * (b - a);
      fp = f(p);
    }
    else
    {
      a = p;
      p = q;
      fp = fq;
      q = a + kGolden * (b - a);
      fq = f(q);
    }
    best = std::min({best, fp, fq});
  }
  return best;
}

}   // namespace slender
