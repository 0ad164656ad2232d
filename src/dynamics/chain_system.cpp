#include "slender_sim/dynamics/chain_system.h"

#include <cmath>
#include <limits>

namespace slender {

namespace {

constexpr int kPiece = 256;           ///< nodes whose panels stay in the second-level cache up to their elimination
constexpr int kLongChain = 1 << 13;   ///< nodes beyond which all panels do not

RodEvaluation total(RodEvaluation result, const RodEvaluation& added)
{
  result.stretch += added.stretch;
  result.bend_twist += added.bend_twist;
  result.potential += added.potential;
  result.min_chi = std::min(result.min_chi, added.min_chi);
  return result;
}

}   // namespace

void ChainSystem::allocate(int capacity)
{
  allocateArrays(capacity);
  for (auto* v : {&gradient_, &direction_, &reduced_})
    v->assign(4 * capacity, 0.0);
  a_.gradient = gradient_.data();
  matrix_.resize(capacity, a_.closed);
  if (capacity > kLongChain && !a_.closed)
    piece_.resize(kPiece + RodSweep::kOvershoot + ChainTerm::kReach + 1);
}

/// Evaluates the nodes from `from` to at least `to`, and the terms there. Returns the first node not done.
int ChainSystem::advance(RodSweep& sweep, bool with_hessian, int from, int to, RodEvaluation& added)
{
  RodPanel* const panels = with_hessian ? panels_ : nullptr;
  const int done = kernels_.advance[static_cast<int>(curvature())](a_, sweep, panels, first_panel_, to);
  const ChainRange range{a_, turned(), panels, first_panel_, from, done};
  for (ChainTerm* term : terms_)
    term->add(range, added);
  return done;
}

RodEvaluation ChainSystem::evaluate(bool with_hessian, const HessianShift& shift)
{
  const int n = a_.nodes;
  RodSweep sweep;
  kernels_.begin(a_, sweep);
  RodEvaluation added;   // by the terms
  BandCarry carry;
  const bool by_pieces = with_hessian && !a_.closed;
  panels_ = piece_.empty() ? matrix_.panels() : piece_.data();
  first_panel_ = 0;
  int done = 0, eliminated = 0;
  while (done < n)
  {
    done = advance(sweep, with_hessian, done, by_pieces ? done + kPiece : n, added);
    // the newest nodes may still receive from terms on nodes that follow
    const int complete = done < n ? done - ChainTerm::kReach : n;
    takeReactions(eliminated, complete);
    if (with_hessian)
    {
      fixPanels(eliminated, complete);
      addShift(eliminated, complete, shift);
    }
    if (by_pieces)
    {
      for (int i = 4 * eliminated; i < 4 * complete; ++i)
        reduced_[i] = -gradient_[i];
      if (carry.zero == 0)
        matrix_.band().eliminate(&panel(eliminated), eliminated, complete, reduced_.data(), carry);
      if (!piece_.empty() && complete < n)
      {
        std::copy(&panel(complete), &panel(done), piece_.data());
        first_panel_ = complete;
      }
    }
    eliminated = complete;
  }
  RodEvaluation result = total(kernels_.end(sweep), added);
  if (by_pieces)
    result.inertia = {4 * n - carry.negative - carry.zero, carry.negative, carry.zero};
  else if (with_hessian)
    result.inertia = matrix_.factor();
  return result;
}

RodEvaluation ChainSystem::evaluateWhole(bool with_hessian)
{
  RodSweep sweep;
  kernels_.begin(a_, sweep);
  RodEvaluation added;
  panels_ = matrix_.panels();
  first_panel_ = 0;
  advance(sweep, with_hessian, 0, a_.nodes, added);
  return total(kernels_.end(sweep), added);
}

Inertia ChainSystem::factorWhole(const HessianShift& shift)
{
  const int n = a_.nodes;
  takeReactions(0, n);
  fixPanels(0, n);
  addShift(0, n, shift);
  if (a_.closed)
    return matrix_.factor();
  for (int i = 0; i < 4 * n; ++i)
    reduced_[i] = -gradient_[i];
  BandCarry carry;
  matrix_.band().eliminate(matrix_.panels(), 0, n, reduced_.data(), carry);
  return {4 * n - carry.negative - carry.zero, carry.negative, carry.zero};
}

void ChainSystem::solve()
{
  if (a_.closed)
    return solveAgain();
  std::swap(direction_, reduced_);
  matrix_.band().substitute(direction_.data());
}

void ChainSystem::solveAgain()
{
  for (int u = 0; u < 4 * a_.nodes; ++u)
    direction_[u] = -gradient_[u];
  matrix_.solve(direction_.data());
}

void ChainSystem::takeReactions(int from, int to)
{
  holds_.takeReactions(from, to, gradient_.data());
  if (!a_.closed && to == a_.nodes)   // the last node has no edge
    gradient_[4 * a_.nodes - 1] = 0.0;
}

/// Replaces the equations of a node's position by identities, in panels from .. to-1.
void ChainSystem::fixPosition(int node, int from, int to)
{
  if (node >= from && node < to)
  {
    RodPanel& p = panel(node);
    for (int c = 0; c < 3; ++c)
    {
      std::fill_n(p.below[c], RodPanel::kStride, 0.0);
      for (int r = c; r < 4; ++r)
        p.diag[c][r] = r == c;
    }
  }
  for (int back = 1; back <= 2; ++back)
    if (const int above = nodeBefore(node, back); above >= from && above < to)
      for (auto& column : panel(above).below)
        std::fill_n(column + 4 * (back - 1), 3, 0.0);
}

/// Likewise the equation of an edge's turn. It couples to no more than one node before.
void ChainSystem::fixTurn(int edge, int from, int to)
{
  if (edge >= from && edge < to)
  {
    RodPanel& p = panel(edge);
    std::fill_n(p.below[3], RodPanel::kStride, 0.0);
    for (int c = 0; c < 4; ++c)
      p.diag[c][3] = c == 3;
  }
  if (const int above = nodeBefore(edge, 1); above >= from && above < to)
    for (auto& column : panel(above).below)
      column[3] = 0.0;
}

void ChainSystem::fixPanels(int from, int to)
{
  const auto near = [&](int node) { return a_.closed || (node >= from && node < to + 2); };
  for (int node : holds_.nodes())
    if (near(node))
      fixPosition(node, from, to);
  for (int edge : holds_.turns())
    if (near(edge))
      fixTurn(edge, from, to);
  if (!a_.closed)
    fixTurn(a_.nodes - 1, from, to);
}

void ChainSystem::addShift(int from, int to, const HessianShift& shift)
{
  if (shift.position > 0)
    for (int i = from; i < to; ++i)
      for (int c = 0; c < 3; ++c)
        panel(i).diag[c][c] += diagonalShift(i, shift)[0];
  if (shift.angle > 0 || spin_ > 0)
    for (int i = from; i < to; ++i)
      panel(i).diag[3][3] += diagonalShift(i, shift)[1];
}

void ChainSystem::moveAlong(double alpha) { moveTrial(alpha, direction_.data()); }

void ChainSystem::accept()
{
  takeBase();
  for (ChainTerm* term : terms_)
    term->accept();
}

void ChainSystem::saveBase()
{
  keepBase();
  for (ChainTerm* term : terms_)
    term->saveBase();
}

void ChainSystem::restoreBase()
{
  returnToBase();
  for (ChainTerm* term : terms_)
    term->restoreBase();
}

double ChainSystem::stepLimit() const
{
  double worst = 0.0;   // largest turn of an edge per unit step
  const auto look = [&](int j, int next) {
    double move = 0.0;
    for (int k = 0; k < 3; ++k)
    {
      const double d = direction_[4 * next + k] - direction_[4 * j + k];
      move += d * d;
    }
    worst = std::max({worst, std::sqrt(move) * a_.inverse_length[j] / 0.7, std::abs(direction_[4 * j + 3]) / 1.5});
  };
  for (int j = 0; j + 1 < a_.nodes; ++j)
    look(j, j + 1);
  if (a_.closed)
    look(a_.nodes - 1, 0);
  return worst > 1.0 ? 1.0 / worst : 1.0;
}

double ChainSystem::incrementSize() const
{
  double largest = 0.0;
  for (int i = 0; i < a_.nodes; ++i)
    for (int k = 0; k < 3; ++k)
      largest = std::max(largest, std::abs(direction_[4 * i + k]));
  return largest / min_rest_length_;
}

double ChainSystem::slope() const
{
  double sum = 0.0;
  for (int u = 0; u < 4 * a_.nodes; ++u)
    sum += gradient_[u] * direction_[u];
  return sum;
}

double ChainSystem::residual() const
{
  double largest = 0.0;
  for (int i = 0; i < a_.nodes; ++i)
    for (int c = 0; c < 4; ++c)
      largest = std::max(largest, std::abs(gradient_[4 * i + c]) * (c < 3 ? 1.0 : a_.inverse_rest_length[i]));
  return largest;
}

double ChainSystem::forceScale() const
{
  double largest = 1e-9 * stretch_modulus_;   // a chain at rest has no forces to compare with, only their round-off
  for (int i = 0; i < a_.nodes; ++i)
  {
    largest = std::max(largest, std::abs(a_.stretch[i] * (a_.strain[i] - a_.rest_strain[i])));
    for (int k = 0; k < 3; ++k)
      largest = std::max(largest, std::abs(a_.force[k][i]));
    const double moment =
        std::hypot(a_.b11[i] * (a_.kappa1[i] - a_.rest_kappa1[i]), a_.b22[i] * (a_.kappa2[i] - a_.rest_kappa2[i]));
    largest = std::max(largest, moment * a_.inverse_rest_length[i]);
  }
  for (const ChainTerm* term : terms_)
    largest = std::max(largest, term->largestForce(a_));
  return largest;
}

double ChainSystem::noiseLevel() const
{
  double extent = 0.0;
  for (int k = 0; k < 3; ++k)
    for (int i = 0; i < a_.nodes; ++i)
      extent = std::max(extent, std::abs(a_.x[k][i]));
  // positions round to eps of the extent, so that forces round to this times the stiffness of a node
  return 4.0 * std::numeric_limits<double>::epsilon() * node_stiffness_ * extent;
}

}   // namespace slender
