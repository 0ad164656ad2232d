#include "slender_sim/dynamics/chain_configuration.h"

namespace slender {

void ChainConfiguration::setSize(int nodes, bool closed, Curvature curvature)
{
  a_.nodes = nodes;
  a_.edges = closed ? nodes : nodes - 1;
  a_.closed = closed;
  curvature_ = curvature;
}

void ChainConfiguration::allocateArrays(int capacity)
{
  capacity_ = capacity;
  const std::size_t padded = capacity + 2 * kHalo;
  const auto array = [&](double*& p, double fill) {
    storage_.emplace_back(padded, fill);
    p = storage_.back().data() + kHalo;
  };
  storage_.clear();
  storage_.reserve(64);
  for (int k = 0; k < 3; ++k)
    for (double** p : {&a_.x[k], &a_.base_t[k], &a_.base_d1[k], &a_.t[k], &a_.d1[k], &a_.target[k], &a_.force[k]})
      array(*p, 0.0);
  for (double** p : {&a_.turn, &a_.base_twist, &a_.twist, &a_.strain, &a_.kappa1, &a_.kappa2, &a_.stretch,
                     &a_.rest_strain, &a_.b11, &a_.b12, &a_.b22, &a_.beta, &a_.rest_kappa1, &a_.rest_kappa2,
                     &a_.rest_twist, &a_.weight, &a_.theta_diagonal, &a_.theta_off})
    array(*p, 0.0);
  a_.coupling = nullptr;
  if (curvature_ == Curvature::compensated)
    array(a_.coupling, 0.0);
  for (double** p : {&a_.inverse_length, &a_.inverse_rest_length})
    array(*p, 1.0);
  for (auto& v : x_base_)
    v.assign(capacity, 0.0);
  for (auto& v : saved_)
    v.assign(padded, 0.0);
}

void ChainConfiguration::wrapHalo(double* p, int count) const
{
  if (a_.closed)
    for (int i = 1; i <= kHalo; ++i)
    {
      p[-i] = p[((count - i) % count + count) % count];
      p[count - 1 + i] = p[(i - 1) % count];
    }
}

void ChainConfiguration::moveTrial(double alpha, const double* direction)
{
  if (alpha == 0.0)   // whatever the direction is, which may be that of an attempt that overflowed
  {
    for (int k = 0; k < 3; ++k)
      std::copy_n(x_base_[k].data(), a_.nodes, a_.x[k]);
    std::fill(a_.turn - kHalo, a_.turn + a_.nodes + kHalo, 0.0);
    return;
  }
  for (int i = 0; i < a_.nodes; ++i)
  {
    for (int k = 0; k < 3; ++k)
      a_.x[k][i] = x_base_[k][i] + alpha * direction[4 * i + k];
    a_.turn[i] = alpha * direction[4 * i + 3];
  }
  wrapHalo(a_.turn, a_.edges);
}

void ChainConfiguration::takeBase()
{
  for (int k = 0; k < 3; ++k)
  {
    std::swap(a_.base_t[k], a_.t[k]);
    std::swap(a_.base_d1[k], a_.d1[k]);
    std::copy_n(a_.x[k], a_.nodes, x_base_[k].data());
  }
  std::swap(a_.base_twist, a_.twist);
  for (std::size_t j = 0; j < turned_.size(); ++j)
    turned_[j] += a_.turn[j];
  std::fill(a_.turn - kHalo, a_.turn + a_.nodes + kHalo, 0.0);
}

void ChainConfiguration::keepBase()
{
  const std::size_t count = a_.nodes + 2 * kHalo;
  for (int k = 0; k < 3; ++k)
  {
    std::copy_n(x_base_[k].data(), a_.nodes, saved_[k].data());
    std::copy_n(a_.base_t[k] - kHalo, count, saved_[3 + k].data());
    std::copy_n(a_.base_d1[k] - kHalo, count, saved_[6 + k].data());
  }
  std::copy_n(a_.base_twist - kHalo, count, saved_[9].data());
  saved_turned_ = turned_;
}

void ChainConfiguration::returnToBase()
{
  const std::size_t count = a_.nodes + 2 * kHalo;
  for (int k = 0; k < 3; ++k)
  {
    std::copy_n(saved_[k].data(), a_.nodes, x_base_[k].data());
    std::copy_n(saved_[3 + k].data(), count, a_.base_t[k] - kHalo);
    std::copy_n(saved_[6 + k].data(), count, a_.base_d1[k] - kHalo);
  }
  std::copy_n(saved_[9].data(), count, a_.base_twist - kHalo);
  turned_ = saved_turned_;
}

}   // namespace slender
