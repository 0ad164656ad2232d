#include "slender_sim/linalg/symmetric_sweeps.h"

#include <algorithm>
#include <cmath>
#include <numeric>

#include <Eigen/Cholesky>
#include <Eigen/LU>

#include "slender_sim/linalg/interruption.h"

namespace slender {

SymmetricSweeps::SymmetricSweeps(const BlockMatrix& a, const PointMatrix* b) : a_(&a), b_(b)
{
  const int n = a.points();
  for (PointVector* v : {&diagonal_, &inverse_})
    v->assign(12 * n, 0.0);
  for (PointVector* v : {&r_, &z_, &p_, &t_, &q_})
    v->assign(4 * n, 0.0);
  std::vector<int> level(n, 0);
  for (int j = 0; j < n; ++j)
  {
    for (int k = a.starts()[j] + 1; k < a.starts()[j + 1]; ++k)
      level[a.rows()[k]] = std::max(level[a.rows()[k]], level[j] + 1);
    for (int k = b ? b->starts()[j] : 0; k < (b ? b->starts()[j + 1] : 0); ++k)
      if (b->column(k) > j)
        level[b->column(k)] = std::max(level[b->column(k)], level[j] + 1);
  }
  order_.resize(n);
  std::iota(order_.begin(), order_.end(), 0);
  std::stable_sort(order_.begin(), order_.end(), [&](int i, int j) { return level[i] < level[j]; });
  for (int i = 0; b && i < n; ++i)
  {
    int k = b->starts()[i];
    const int end = b->starts()[i + 1];
    while (k < end && b->column(k) < i)
      ++k;
    const bool diagonal = k < end && b->column(k) == i;
    b_diagonal_.push_back(diagonal ? k : -1);
    b_right_.push_back(diagonal ? k + 1 : k);
    b_ends_.push_back(end);
  }
}

void SymmetricSweeps::set(double factor, const std::vector<char>& held, const std::vector<char>* apart)
{
  factor_ = factor;
  held_ = &held;
  apart_ = apart;
  for (int i = 0; i < a_->points(); ++i)
  {
    Eigen::Matrix3d d = Eigen::Matrix3d::Zero(), inverse = d;
    if (!held[i])
    {
      d = Eigen::Map<const Eigen::Matrix3d>(a_->values() + 9 * static_cast<std::size_t>(a_->starts()[i]));
      if (b_ && b_diagonal_[i] >= 0)
        d.diagonal().array() += factor * b_->values()[b_diagonal_[i]];
      inverse = d.inverse();
    }
    Eigen::Map<Eigen::Matrix<double, 3, 3>, 0, Eigen::OuterStride<4>>(diagonal_.data() +
                                                                      12 * static_cast<std::size_t>(i)) = d;
    Eigen::Map<Eigen::Matrix<double, 3, 3>, 0, Eigen::OuterStride<4>>(inverse_.data() +
                                                                      12 * static_cast<std::size_t>(i)) = inverse;
  }
  swept_ = SweptMatrix{
      a_->points(), a_->starts().data(), a_->rows().data(), a_->values(), nullptr, nullptr, nullptr, nullptr,
      factor,       order_.data(),       inverse_.data()};
  if (b_)
  {
    swept_.right = b_right_.data();
    swept_.ends = b_ends_.data();
    swept_.offsets = b_->offsets().data();
    swept_.values = b_->values().data();
  }
}

void SymmetricSweeps::setWhole()
{
  Eigen::Matrix3d whole = Eigen::Matrix3d::Zero();
  for (int j = 0; j < a_->points(); ++j)
  {
    if (!moves(j))
      continue;
    for (int k = a_->starts()[j]; k < a_->starts()[j + 1]; ++k)
    {
      const Eigen::Map<const Eigen::Matrix3d> block(a_->values() + 9 * static_cast<std::size_t>(k));
      if (a_->rows()[k] == j)
        whole += block;
      else if (moves(a_->rows()[k]))
        whole += block + block.transpose();
    }
    for (int k = b_ ? b_->starts()[j] : 0; k < (b_ ? b_->starts()[j + 1] : 0); ++k)
      if (moves(b_->column(k)))
        whole.diagonal().array() += factor_ * b_->values()[k];
  }
  whole_.compute(whole);
}

void SymmetricSweeps::leave(const PointVector& right_hand_side, const PointVector& x)
{
  std::fill(r_.begin(), r_.end(), 0.0);
  a_->addProduct(x.data(), r_.data());
  if (b_)
    b_->addProduct(factor_, x.data(), r_.data());
  for (int j = 0; j < a_->points(); ++j)
    if ((*held_)[j])
      point(r_, j).setZero();
    else
      point(r_, j) = point(right_hand_side, j) - point(r_, j);
}

void SymmetricSweeps::translate(const PointVector& forces, PointVector& x) const
{
  if (whole_.info() != Eigen::Success)   // nothing is free, or not definite
    return;
  Eigen::Vector3d sum = Eigen::Vector3d::Zero();
  for (int j = 0; j < a_->points(); ++j)
    if (moves(j))
      sum += point(forces, j);
  const Eigen::Vector3d motion = whole_.solve(sum);
  for (int j = 0; j < a_->points(); ++j)
    if (moves(j))
      point(x, j) += motion;
}

double SymmetricSweeps::sweepResidual()
{
  pointKernels().sweepDown(swept_, r_.data());
  return pointKernels().multiplyDiagonal(a_->points(), diagonal_.data(), r_.data(), z_.data());
}

double SymmetricSweeps::begin(const PointVector& right_hand_side, PointVector& x, LinearResult& result)
{
  std::fill(x.begin(), x.end(), 0.0);
  std::copy(right_hand_side.begin(), right_hand_side.end(), r_.begin());
  const double square = sweepResidual();
  result.definite = square >= 0.0;
  return square;
}

double SymmetricSweeps::norm(const PointVector& r)
{
  std::copy(r.begin(), r.end(), r_.begin());
  return std::sqrt(std::max(sweepResidual(), 0.0));
}

LinearResult SymmetricSweeps::solve(const PointVector& right_hand_side, PointVector& x, double tolerance,
                                    int max_iterations)
{
  setWhole();
  LinearResult result;
  const double square = begin(right_hand_side, x, result);
  if (!(square > 0))
    return result;
  translate(right_hand_side, x);
  leave(right_hand_side, x);
  iterate(nullptr, 0.0, sweepResidual(), std::sqrt(square), x, tolerance, max_iterations, result);
  if (result.definite)
  {
    leave(right_hand_side, x);
    translate(r_, x);
  }
  return result;
}

LinearResult SymmetricSweeps::solve(const ConstrainedCholesky& constraints, double stiffness,
                                    const PointVector& right_hand_side, PointVector& x, double tolerance,
                                    int max_iterations, double reference, double least)
{
  constexpr double kRounding = 1e-12;   // of the reference
  LinearResult result;
  const double square = begin(right_hand_side, x, result);
  if (!(square > 0))
    return result;
  const double scale = std::max(std::min(reference, least / tolerance * std::sqrt(square)), kRounding * reference);
  iterate(&constraints, stiffness, square, scale, x, tolerance, max_iterations, result);
  return result;
}

/// r_ = (D + L)^-1 times the residual; in the norm of D, where (D + L)^-1 A (D + L^T)^-1 p = t + (D + L)^-1 (p - D t)
/// with t = (D + L^T)^-1 p
void SymmetricSweeps::iterate(const ConstrainedCholesky* constraints, double stiffness, double square, double scale,
                              PointVector& x, double tolerance, int max_iterations, LinearResult& result)
{
  const PointKernels& k = pointKernels();
  const int n = a_->points();
  double rz = square;
  result.definite = rz >= 0.0;
  result.scale = scale;
  result.residual = std::sqrt(std::max(rz, 0.0)) / scale;
  std::copy(z_.begin(), z_.end(), p_.begin());
  while (result.definite && result.residual > tolerance && result.iterations < max_iterations && !stepsInterrupted())
  {
    k.sweepUp(swept_, p_.data(), t_.data());
    k.multiplyDiagonal(n, diagonal_.data(), t_.data(), q_.data());
    for (std::size_t i = 0; i < q_.size(); ++i)
      q_[i] = p_[i] - q_[i];
    if (constraints)
      constraints->addStiffness(stiffness, t_.data(), q_.data());
    k.sweepDown(swept_, q_.data());
    for (std::size_t i = 0; i < q_.size(); ++i)
      q_[i] += t_[i];
    const double curvature = k.dot(n, p_.data(), q_.data());
    if (!(curvature > 0))
    {
      result.definite = false;
      break;
    }
    const double alpha = rz / curvature;
    for (std::size_t i = 0; i < x.size(); ++i)
    {
      x[i] += alpha * t_[i];
      r_[i] -= alpha * q_[i];
    }
    ++result.iterations;
    const double next = k.multiplyDiagonal(n, diagonal_.data(), r_.data(), z_.data());
    result.residual = std::sqrt(std::abs(next)) / scale;
    const double beta = next / rz;
    rz = next;
    for (std::size_t i = 0; i < p_.size(); ++i)
      p_[i] = z_[i] + beta * p_[i];
  }
}

}   // namespace slender
