#include "slender_sim/energy/twist_loads.h"

#include <algorithm>
#include <cmath>

namespace slender {

double TwistLoads::work(const RodArrays& arrays, const double* turned) const
{
  double work = 0.0;
  for (std::size_t j = 0; j < torque_.size(); ++j)
    work += torque_[j] * (turned[j] + arrays.turn[j]);
  return work;
}

void TwistLoads::add(const ChainRange& range, RodEvaluation& sum)
{
  const RodArrays& a = range.arrays;
  const int end = std::min(range.to, static_cast<int>(torque_.size()));
  for (int j = range.from; j < end; ++j)
  {
    sum.potential -= torque_[j] * (range.turned[j] + a.turn[j]);
    a.gradient[4 * j + 3] -= torque_[j];
  }
}

double TwistLoads::largestForce(const RodArrays& arrays) const
{
  double largest = 0.0;
  for (std::size_t j = 0; j < torque_.size(); ++j)
    largest = std::max(largest, std::abs(torque_[j]) * arrays.inverse_rest_length[j]);
  return largest;
}

}   // namespace slender
