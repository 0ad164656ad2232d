#include "slender_sim/thread/thread_system.h"

#include <algorithm>
#include <cmath>
#include <limits>

namespace slender {

void ThreadSystem::allocate(int capacity)
{
  capacity_ = capacity;
  const std::size_t padded = capacity + 2 * kHalo;
  storage_.clear();
  storage_.reserve(64);
  const auto array = [&](double*& p) {
    storage_.emplace_back(padded, 0.0);
    p = storage_.back().data() + kHalo;
  };
  for (int k = 0; k < 3; ++k)
    for (double** p : {&a_.x[k], &a_.base_t[k], &a_.base_d1[k], &a_.t[k], &a_.d1[k], &a_.target[k], &a_.force[k]})
      array(*p);
  for (double** p : {&a_.turn,
                     &a_.base_twist,
                     &a_.twist,
                     &a_.strain,
                     &a_.kappa1,
                     &a_.kappa2,
                     &a_.stretch,
                     &a_.rest_strain,
                     &a_.b11,
                     &a_.b12,
                     &a_.b22,
                     &a_.beta,
                     &a_.rest_kappa1,
                     &a_.rest_kappa2,
                     &a_.rest_twist,
                     &a_.weight,
                     &a_.theta_diagonal,
                     &a_.theta_off,
                     &a_.inverse_length,
                     &a_.inverse_rest_length})
    array(*p);
  for (auto* v : {&gradient_, &reactions_, &direction_, &reduced_})
    v->resize(4 * capacity);
  for (auto& v : x_base_)
    v.resize(capacity);
  for (auto& v : saved_)
    v.resize(padded);
  for (auto* v : {&volume_, &spin_weight_, &spin_target_, &turn_base_})
    v->resize(capacity);
  held_.resize(4 * capacity);
  matrix_.resize(capacity);
  a_.coupling = nullptr;   // of the thesis's curvature there is none
  a_.gradient = gradient_.data();
}

void ThreadSystem::resize(int nodes)
{
  if (nodes > capacity_)
    allocate(std::max(64, nodes + nodes / 2));
  a_.nodes = nodes;
  a_.edges = nodes - 1;
  a_.closed = false;
  matrix_.resize(nodes);
  const auto clear = [&](double* p, double value) { std::fill(p - kHalo, p + nodes + kHalo, value); };
  for (double* p : {a_.turn,     a_.base_twist, a_.twist,    a_.strain,      a_.stretch,     a_.rest_strain, a_.b11,
                    a_.b12,      a_.b22,        a_.beta,     a_.rest_kappa1, a_.rest_kappa2, a_.rest_twist,  a_.weight,
                    a_.force[0], a_.force[1],   a_.force[2], a_.target[0],   a_.target[1],   a_.target[2]})
    clear(p, 0.0);
  clear(a_.inverse_length, 1.0);
  clear(a_.inverse_rest_length, 1.0);
  std::fill_n(gradient_.begin(), 4 * nodes, 0.0);
  for (auto* v : {&volume_, &spin_weight_, &spin_target_, &turn_base_})
    std::fill_n(v->begin(), nodes, 0.0);
  std::fill_n(held_.begin(), 4 * nodes, 0);
  held_[4 * nodes - 1] = 1;   // the last node has no edge
  gamma_ = max_modulus_ = 0.0;
}

RodEvaluation ThreadSystem::takeRestStrains()
{
  const int edges = a_.edges;
  for (int k = 0; k < 3; ++k)
    for (int j = -2; j < edges + 10; ++j)   // the halo continues the end edges
      if (j < 0 || j >= edges)
      {
        a_.base_t[k][j] = a_.base_t[k][std::clamp(j, 0, edges - 1)];
        a_.base_d1[k][j] = a_.base_d1[k][std::clamp(j, 0, edges - 1)];
      }
  const RodKernels& kernels = rodKernels();
  RodSweep sweep;
  kernels.begin(a_, sweep);
  kernels.advance[static_cast<int>(Curvature::tangent)](a_, sweep, nullptr, 0, a_.nodes);
  min_rest_length_ = std::numeric_limits<double>::infinity();
  for (int j = 0; j < edges; ++j)
  {
    a_.inverse_rest_length[j] = a_.inverse_length[j];
    min_rest_length_ = std::min(min_rest_length_, 1.0 / a_.inverse_length[j]);
  }
  for (int i = 1; i + 1 < a_.nodes; ++i)
  {
    a_.rest_kappa1[i] = a_.kappa1[i];
    a_.rest_kappa2[i] = a_.kappa2[i];
    a_.rest_twist[i] = a_.base_twist[i] = a_.twist[i];
  }
  return kernels.end(sweep);
}

int ThreadSystem::sharpestJoint() const
{
  double sharpest = 0.0;
  int joint = -1;
  for (int i = 1; i + 1 < a_.nodes; ++i)
  {
    const double cosine = get(a_.t, i - 1).dot(get(a_.t, i));
    if (cosine < sharpest)
    {
      sharpest = cosine;
      joint = i;
    }
  }
  return joint;
}

void ThreadSystem::setEdge(int j, double modulus, double volume)
{
  a_.stretch[j] = modulus;
  volume_[j] = volume;
  max_modulus_ = std::max(max_modulus_, modulus);
}

void ThreadSystem::setInertia(int i, double weight, const Eigen::Vector3d& target, const Eigen::Vector3d& force)
{
  a_.weight[i] = weight;
  put(a_.target, i, target);
  put(a_.force, i, force);
}

RodEvaluation ThreadSystem::evaluateWhole(bool with_hessian)
{
  const RodKernels& kernels = rodKernels();
  RodSweep sweep;
  kernels.begin(a_, sweep);
  kernels.advance[static_cast<int>(Curvature::tangent)](a_, sweep, with_hessian ? matrix_.panels() : nullptr, 0,
                                                        a_.nodes);
  RodEvaluation result = kernels.end(sweep);
  if (gamma_ != 0.0)
    result.stretch += addSurface(with_hessian);
  result.potential += addSpin(with_hessian);
  if (with_hessian)
  {
    // what a shift adds is measured by the bending, twisting and inertia that are there
    double bend = 0.0;
    shift_theta_ = 0.0;
    for (int i = 0; i < a_.nodes; ++i)
    {
      bend = std::max(bend, a_.b11[i]);
      shift_theta_ = std::max(shift_theta_, a_.beta[i]);
    }
    shift_x_ = 1e-2 * bend / (min_rest_length_ * min_rest_length_);
  }
  return result;
}

void ThreadSystem::closeGradient()
{
  const int unknowns = 4 * a_.nodes;
  std::copy_n(gradient_.begin(), unknowns, reactions_.begin());
  for (int u = 0; u < unknowns; ++u)
    if (held_[u])
      gradient_[u] = 0.0;
}

RodEvaluation ThreadSystem::evaluate(bool with_hessian, const HessianShift& shift)
{
  RodEvaluation result = evaluateWhole(with_hessian);
  const int n = a_.nodes;
  closeGradient();
  if (!with_hessian)
    return result;

  for (int i = 0; i < n; ++i)
  {
    fixHeld(i);
    RodPanel& p = matrix_.panels()[i];
    for (int c = 0; c < 3; ++c)
      p.diag[c][c] += diagonalShift(i, shift)[0];
    p.diag[3][3] += diagonalShift(i, shift)[1];
  }
  for (int u = 0; u < 4 * n; ++u)
    reduced_[u] = -gradient_[u];
  BandCarry carry;
  matrix_.eliminate(matrix_.panels(), 0, n, reduced_.data(), carry);
  result.inertia = {4 * n - carry.negative - carry.zero, carry.negative, carry.zero};
  return result;
}

/// Replaces the equations of the held unknowns of node i by identities.
void ThreadSystem::fixHeld(int i)
{
  const char* held = held_.data() + 4 * i;
  if (!(held[0] | held[1] | held[2] | held[3]))
    return;
  RodPanel* panels = matrix_.panels();
  for (int c = 0; c < 4; ++c)
  {
    if (!held[c])
      continue;
    RodPanel& p = panels[i];
    for (int r = c + 1; r < 4; ++r)
      p.diag[c][r] = 0.0;
    for (int k = 0; k < c; ++k)
      p.diag[k][c] = 0.0;
    p.diag[c][c] = 1.0;
    for (double& entry : p.below[c])
      entry = 0.0;
    for (int back = 1; back <= 2 && back <= i; ++back)
      if (4 * (back - 1) + c < RodPanel::kBelow)
        for (auto& column : panels[i - back].below)
          column[4 * (back - 1) + c] = 0.0;
  }
}

double ThreadSystem::addSpin(bool with_hessian)
{
  double energy = 0.0;
  for (int j = 0; j < a_.edges; ++j)
  {
    const double away = turn(j) - spin_target_[j];
    energy += 0.5 * spin_weight_[j] * away * away;
    gradient_[4 * j + 3] += spin_weight_[j] * away;
    if (with_hessian)
      matrix_.panels()[j].diag[3][3] += spin_weight_[j];
  }
  return energy;
}

void ThreadSystem::solve()
{
  std::swap(direction_, reduced_);
  matrix_.substitute(direction_.data());
}

void ThreadSystem::moveAlong(double alpha)
{
  if (alpha == 0.0)   // whatever the direction is, which may be that of an attempt that overflowed
  {
    for (int k = 0; k < 3; ++k)
      std::copy_n(x_base_[k].data(), a_.nodes, a_.x[k]);
    std::fill_n(a_.turn, a_.nodes, 0.0);
    return;
  }
  for (int i = 0; i < a_.nodes; ++i)
  {
    for (int k = 0; k < 3; ++k)
      a_.x[k][i] = x_base_[k][i] + alpha * direction_[4 * i + k];
    a_.turn[i] = alpha * direction_[4 * i + 3];
  }
}

void ThreadSystem::accept()
{
  for (int k = 0; k < 3; ++k)
  {
    std::swap(a_.base_t[k], a_.t[k]);
    std::swap(a_.base_d1[k], a_.d1[k]);
    std::copy_n(a_.x[k], a_.nodes, x_base_[k].data());
  }
  std::swap(a_.base_twist, a_.twist);
  for (int j = 0; j < a_.nodes; ++j)
  {
    turn_base_[j] += a_.turn[j];
    a_.turn[j] = 0.0;
  }
}

void ThreadSystem::saveBase()
{
  const std::size_t count = a_.nodes + 2 * kHalo;
  for (int k = 0; k < 3; ++k)
  {
    std::copy_n(x_base_[k].data(), a_.nodes, saved_[k].data());
    std::copy_n(a_.base_t[k] - kHalo, count, saved_[3 + k].data());
    std::copy_n(a_.base_d1[k] - kHalo, count, saved_[6 + k].data());
  }
  std::copy_n(a_.base_twist - kHalo, count, saved_[9].data());
  std::copy_n(turn_base_.data(), a_.nodes, saved_[10].data());
}

void ThreadSystem::restoreBase()
{
  const std::size_t count = a_.nodes + 2 * kHalo;
  for (int k = 0; k < 3; ++k)
  {
    std::copy_n(saved_[k].data(), a_.nodes, x_base_[k].data());
    std::copy_n(saved_[3 + k].data(), count, a_.base_t[k] - kHalo);
    std::copy_n(saved_[6 + k].data(), count, a_.base_d1[k] - kHalo);
  }
  std::copy_n(saved_[9].data(), count, a_.base_twist - kHalo);
  std::copy_n(saved_[10].data(), a_.nodes, turn_base_.data());
}

double ThreadSystem::stepLimit() const
{
  double worst = 0.0;   // largest turn of an edge per unit step
  for (int j = 0; j < a_.edges; ++j)
  {
    double move = 0.0;
    for (int k = 0; k < 3; ++k)
    {
      const double d = direction_[4 * j + 4 + k] - direction_[4 * j + k];
      move += d * d;
    }
    worst = std::max({worst, std::sqrt(move) * a_.inverse_length[j] / 0.7, std::abs(direction_[4 * j + 3]) / 1.5});
  }
  return worst > 1.0 ? 1.0 / worst : 1.0;
}

double ThreadSystem::incrementSize() const
{
  double largest = 0.0;
  for (int i = 0; i < a_.nodes; ++i)
    for (int k = 0; k < 3; ++k)
      largest = std::max(largest, std::abs(direction_[4 * i + k]));
  return largest / min_rest_length_;
}

double ThreadSystem::slope() const
{
  double sum = 0.0;
  for (int u = 0; u < 4 * a_.nodes; ++u)
    sum += gradient_[u] * direction_[u];
  return sum;
}

double ThreadSystem::residual() const
{
  double largest = 0.0;
  for (int i = 0; i < a_.nodes; ++i)
    for (int c = 0; c < 4; ++c)
      largest = std::max(largest, std::abs(gradient_[4 * i + c]) * (c < 3 ? 1.0 : a_.inverse_rest_length[i]));
  return largest;
}

double ThreadSystem::forceScale() const
{
  double largest = 1e-9 * max_modulus_;   // a thread at rest has no forces to compare with, only their round-off
  for (int i = 0; i < a_.nodes; ++i)
  {
    largest = std::max(largest, std::abs(a_.stretch[i] * a_.strain[i]));
    for (int k = 0; k < 3; ++k)
      largest = std::max(largest, std::abs(a_.force[k][i]));
    const double moment = a_.b11[i] * std::hypot(a_.kappa1[i] - a_.rest_kappa1[i], a_.kappa2[i] - a_.rest_kappa2[i]);
    largest = std::max(largest, moment * a_.inverse_rest_length[i]);
  }
  return largest;
}

double ThreadSystem::noiseLevel() const
{
  double extent = 0.0;
  for (int k = 0; k < 3; ++k)
    for (int i = 0; i < a_.nodes; ++i)
      extent = std::max(extent, std::abs(a_.x[k][i]));
  return 4.0 * std::numeric_limits<double>::epsilon() * max_modulus_ * extent / min_rest_length_;
}

}   // namespace slender
