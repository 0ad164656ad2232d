#include "slender_sim/energy/spin_inertia.h"

#include <algorithm>

namespace slender {

void SpinInertia::resize(int edges)
{
  for (auto* v : {&weight_, &target_})
  {
    v->resize(edges);
    std::fill(v->begin(), v->end(), 0.0);
  }
}

void SpinInertia::add(const ChainRange& range, RodEvaluation& sum)
{
  const int end = std::min(range.to, range.arrays.edges);
  const double *weight = weight_.data(), *target = target_.data(), *turned = range.turned, *turn = range.arrays.turn;
  double* gradient = range.arrays.gradient;
  double energy = sum.potential;
  for (int j = range.from; j < end; ++j)
  {
    const double away = turned[j] + turn[j] - target[j];
    energy += 0.5 * weight[j] * away * away;
    gradient[4 * j + 3] += weight[j] * away;
  }
  sum.potential = energy;
  if (range.panels)
    for (int j = range.from; j < end; ++j)
      range.panel(j).diag[3][3] += weight[j];
}

}   // namespace slender
