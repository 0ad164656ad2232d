#include "slender_sim/rod/rod_system.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "slender_sim/geometry/rotation.h"

namespace slender {

namespace {
constexpr int kHalo = RodArrays::kHalo;
constexpr int kPiece = 256;         ///< nodes whose panels stay in the second-level cache from assembly to elimination
constexpr int kLongRod = 1 << 13;   ///< nodes beyond which all panels do not
}   // namespace

RodSystem::RodSystem(const RodModel& model) : model_(model)
{
  a_.nodes = model.nodes();
  a_.edges = model.edges();
  a_.closed = model.closed;
  max_stretch_modulus_ = model.stretch_modulus.maxCoeff();
  min_rest_length_ = model.rest_length.minCoeff();
}

/// Arrays of the hot loops, which explicit steps of isotropic rods do without.
void RodSystem::allocate()
{
  const int n = a_.nodes;
  const std::size_t padded = n + 2 * kHalo;
  const auto allocate = [&](double*& p, double fill) {
    storage_.emplace_back(padded, fill);
    p = storage_.back().data() + kHalo;
  };
  storage_.reserve(64);
  for (int k = 0; k < 3; ++k)
    for (double** p : {&a_.x[k], &a_.base_t[k], &a_.base_d1[k], &a_.t[k], &a_.d1[k], &a_.target[k], &a_.force[k]})
      allocate(*p, 0.0);
  for (double** p : {&a_.turn, &a_.base_twist, &a_.twist, &a_.strain, &a_.kappa1, &a_.kappa2, &a_.stretch,
                     &a_.rest_strain, &a_.b11, &a_.b12, &a_.b22, &a_.beta, &a_.rest_kappa1, &a_.rest_kappa2,
                     &a_.rest_twist, &a_.weight, &a_.theta_diagonal, &a_.theta_off})
    allocate(*p, 0.0);
  a_.coupling = nullptr;
  if (model_.curvature == Curvature::compensated)
    allocate(a_.coupling, 0.0);
  for (double** p : {&a_.inverse_length, &a_.inverse_rest_length})
    allocate(*p, 1.0);
  gradient_.assign(4 * n, 0.0);
  direction_.assign(4 * n, 0.0);
  reduced_.assign(4 * n, 0.0);
  a_.gradient = gradient_.data();
  for (auto& x : x_base_)
    x.assign(n, 0.0);
  for (auto& s : saved_)
    s.assign(padded, 0.0);
  matrix_.resize(n, model_.closed);
  if (n > kLongRod && !model_.closed)
    piece_.resize(kPiece + RodSweep::kOvershoot + 2);
  for (int j = 0; j < a_.edges; ++j)
    a_.inverse_rest_length[j] = 1.0 / model_.rest_length[j];
  wrapHalo(a_.inverse_rest_length, a_.edges);
}

void RodSystem::wrapHalo(double* p, int count) const
{
  if (model_.closed)
    for (int i = 1; i <= kHalo; ++i)
    {
      p[-i] = p[((count - i) % count + count) % count];
      p[count - 1 + i] = p[(i - 1) % count];
    }
}

void RodSystem::load(const RodState& state)
{
  if (storage_.empty())
  {
    allocate();
    if (!held_.empty())
      setResponse(0.0, nullptr);
  }
  compose(state);
  const int n = a_.nodes, edges = a_.edges;
  for (int i = 0; i < n; ++i)
    for (int k = 0; k < 3; ++k)
      x_base_[k][i] = a_.x[k][i] = state.x(k, i);
  for (int j = -2; j < edges + 10; ++j)
  {
    const int s = model_.closed ? (j % edges + edges) % edges : std::clamp(j, 0, edges - 1);
    const Eigen::Vector3d t = (state.x.col((s + 1) % n) - state.x.col(s)).normalized();
    for (int k = 0; k < 3; ++k)
    {
      a_.base_t[k][j] = t[k];
      a_.base_d1[k][j] = state.d1(k, s);
    }
  }
  for (int i = 0; i < n; ++i)
    a_.base_twist[i] = state.twist[i];
  wrapHalo(a_.base_twist, n);
  std::fill(a_.turn - kHalo, a_.turn + n + kHalo, 0.0);
  std::fill(turned_.begin(), turned_.end(), 0.0);
  for (ClampJoint& c : clamps_)
  {
    const GraspState& g = state.grasps[c.grasp];
    const Eigen::Matrix3d section = g.X_WG.orientation.toRotationMatrix() * g.section_G[c.side];
    c.base_t = c.t = section.col(0);
    c.base_d1 = c.d1 = section.col(1);
    c.base_twist = c.twist = g.section_twist[c.side];
    c.turn = 0.0;
  }
}

void RodSystem::store(RodState& state) const
{
  for (int i = 0; i < a_.nodes; ++i)
  {
    for (int k = 0; k < 3; ++k)
      state.x(k, i) = a_.x[k][i];
    state.twist[i] = a_.twist[i];
  }
  for (int j = 0; j < a_.edges; ++j)
    for (int k = 0; k < 3; ++k)
      state.d1(k, j) = a_.d1[k][j];
  for (const ClampJoint& c : clamps_)
    state.grasps[c.grasp].section_twist[c.side] = c.twist;
}

void RodSystem::setInertia(int node, double weight, const Eigen::Vector3d& target, const Eigen::Vector3d& force)
{
  a_.weight[node] = weight;
  for (int k = 0; k < 3; ++k)
  {
    a_.target[k][node] = target[k];
    a_.force[k][node] = force[k];
  }
}

void RodSystem::setTwistLoads(const Eigen::VectorXd& torques)
{
  twist_load_.assign(torques.data(), torques.data() + torques.size());
  if (turned_.size() != twist_load_.size())
    turned_.assign(twist_load_.size(), 0.0);
}

double RodSystem::twistWork() const
{
  double work = 0.0;
  for (std::size_t j = 0; j < twist_load_.size(); ++j)
    work += twist_load_[j] * (turned_[j] + a_.turn[j]);
  return work;
}

void RodSystem::addTwistLoads(int from, int to)
{
  const int end = std::min(to, static_cast<int>(twist_load_.size()));
  for (int j = from; j < end; ++j)
    gradient_[4 * j + 3] -= twist_load_[j];
}

bool RodSystem::mayTurn(int edge) const
{
  return std::find(held_angles_.begin(), held_angles_.end(), edge) == held_angles_.end();
}

void RodSystem::strains(Eigen::Matrix4Xd& out) const
{
  const int n = a_.nodes;
  out.resize(4, n + 2 * grasps_.size());
  for (int i = 0; i < n; ++i)
    out.col(i) << a_.strain[i], a_.kappa1[i], a_.kappa2[i], a_.twist[i];
  out.rightCols(2 * grasps_.size()).setZero();
  for (const ClampJoint& c : clamps_)
    out.col(n + 2 * c.grasp + c.side) << 0.0, c.kappa1, c.kappa2, c.twist;
}

RodEvaluation RodSystem::evaluate(bool with_hessian, const HessianShift& shift)
{
  const RodKernels& kernels = rodKernels();
  RodKernels::Advance* const advance = kernels.advance[static_cast<int>(model_.curvature)];
  const int n = a_.nodes;
  RodSweep sweep;
  kernels.begin(a_, sweep);
  RodEvaluation clamped;   // of the clamps alone
  BandCarry carry;
  const bool by_pieces = with_hessian && !model_.closed;
  panels_ = piece_.empty() ? matrix_.panels() : piece_.data();
  first_panel_ = 0;
  int done = 0, eliminated = 0;
  while (done < n)
  {
    const int before = done;
    done = advance(a_, sweep, with_hessian ? panels_ : nullptr, first_panel_, by_pieces ? done + kPiece : n);
    for (ClampJoint& c : clamps_)
    {
      const int last = std::max(c.edge, (c.edge + 1) % n);   // node that must be there
      if (last < done && last >= before)
        evaluateClamp(c, with_hessian, clamped);
    }
    // the newest node may still receive from a clamp on the edge after it
    const int complete = done < n ? done - 1 : n;
    addTwistLoads(eliminated, complete);
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
        piece_[0] = panel(complete);
        first_panel_ = complete;
      }
    }
    eliminated = complete;
  }
  RodEvaluation result = kernels.end(sweep);
  result.bend_twist += clamped.bend_twist;
  result.potential -= twistWork();
  result.min_chi = std::min(result.min_chi, clamped.min_chi);
  if (by_pieces)
    result.inertia = {4 * n - carry.negative - carry.zero, carry.negative, carry.zero};
  else if (with_hessian)
    result.inertia = matrix_.factor();
  return result;
}

RodEvaluation RodSystem::evaluateWhole(bool with_hessian)
{
  const RodKernels& kernels = rodKernels();
  RodSweep sweep;
  kernels.begin(a_, sweep);
  panels_ = matrix_.panels();
  first_panel_ = 0;
  kernels.advance[static_cast<int>(model_.curvature)](a_, sweep, with_hessian ? panels_ : nullptr, 0, a_.nodes);
  RodEvaluation clamped;
  for (ClampJoint& c : clamps_)
    evaluateClamp(c, with_hessian, clamped);
  addTwistLoads(0, a_.nodes);
  RodEvaluation result = kernels.end(sweep);
  result.bend_twist += clamped.bend_twist;
  result.potential -= twistWork();
  result.min_chi = std::min(result.min_chi, clamped.min_chi);
  return result;
}

Inertia RodSystem::factorWhole(const HessianShift& shift)
{
  const int n = a_.nodes;
  takeReactions(0, n);
  fixPanels(0, n);
  addShift(0, n, shift);
  if (model_.closed)
    return matrix_.factor();
  for (int i = 0; i < 4 * n; ++i)
    reduced_[i] = -gradient_[i];
  BandCarry carry;
  matrix_.band().eliminate(matrix_.panels(), 0, n, reduced_.data(), carry);
  return {4 * n - carry.negative - carry.zero, carry.negative, carry.zero};
}

void RodSystem::solve()
{
  if (model_.closed)
  {
    for (std::size_t i = 0; i < gradient_.size(); ++i)
      direction_[i] = -gradient_[i];
    matrix_.solve(direction_.data());
    return;
  }
  std::swap(direction_, reduced_);
  matrix_.band().substitute(direction_.data());
}

void RodSystem::takeReactions(int from, int to)
{
  for (std::size_t k = 0; k < held_nodes_.size(); ++k)
  {
    const int node = held_nodes_[k];
    if (node >= from && node < to)
      for (int c = 0; c < 3; ++c)
      {
        reactions_[k][c] = gradient_[4 * node + c];
        gradient_[4 * node + c] = 0.0;
      }
  }
  for (std::size_t k = 0; k < held_angles_.size(); ++k)
  {
    const int edge = held_angles_[k];
    if (edge >= from && edge < to)
    {
      angle_reactions_[k] = gradient_[4 * edge + 3];
      gradient_[4 * edge + 3] = 0.0;
    }
  }
  if (!model_.closed && to == a_.nodes)   // the last node has no edge
    gradient_[4 * a_.nodes - 1] = 0.0;
}

void RodSystem::fixUnknown(int node, int c, int from, int to)
{
  const int n = a_.nodes;
  if (node >= from && node < to)
  {
    RodPanel& p = panel(node);
    for (int r = c + 1; r < 4; ++r)
      p.diag[c][r] = 0.0;
    for (int k = 0; k < c; ++k)
      p.diag[k][c] = 0.0;
    p.diag[c][c] = 1.0;
    for (double& entry : p.below[c])
      entry = 0.0;
  }
  for (int back = 1; back <= 2; ++back)
  {
    const int above = model_.closed ? (node + n - back) % n : node - back;
    if (above >= from && above < to)
      for (auto& column : panel(above).below)
        column[4 * (back - 1) + c] = 0.0;
  }
}

/// Replaces the equations of prescribed unknowns by identities, in panels from .. to-1.
void RodSystem::fixPanels(int from, int to)
{
  const auto near = [&](int node) { return model_.closed || (node >= from && node < to + 2); };
  for (int node : held_nodes_)
    if (near(node))
      for (int c = 0; c < 3; ++c)
        fixUnknown(node, c, from, to);
  for (int edge : held_angles_)
    if (near(edge))
      fixUnknown(edge, 3, from, to);
  if (!model_.closed)
    fixUnknown(a_.nodes - 1, 3, from, to);
}

void RodSystem::addShift(int from, int to, const HessianShift& shift)
{
  if (shift.position > 0)
    for (int i = from; i < to; ++i)
      for (int c = 0; c < 3; ++c)
        panel(i).diag[c][c] += shift.position * (a_.weight[i] + shift_x_);
  if (shift.angle > 0 || spin_ > 0)
    for (int i = from; i < to; ++i)
      panel(i).diag[3][3] += shift.angle * shift_theta_ + spin_;
}

void RodSystem::moveAlong(double alpha)
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
      a_.x[k][i] = x_base_[k][i] + alpha * direction_[4 * i + k];
    a_.turn[i] = alpha * direction_[4 * i + 3];
  }
  wrapHalo(a_.turn, a_.edges);
}

void RodSystem::accept()
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
  for (ClampJoint& c : clamps_)
  {
    c.base_t = c.t;
    c.base_d1 = c.d1;
    c.base_twist = c.twist;
    c.turn = 0.0;
  }
}

void RodSystem::saveBase()
{
  const std::size_t count = a_.nodes + 2 * kHalo;
  for (int k = 0; k < 3; ++k)
  {
    std::copy_n(x_base_[k].data(), a_.nodes, saved_[k].data());
    std::copy_n(a_.base_t[k] - kHalo, count, saved_[3 + k].data());
    std::copy_n(a_.base_d1[k] - kHalo, count, saved_[6 + k].data());
  }
  std::copy_n(a_.base_twist - kHalo, count, saved_[9].data());
  saved_clamps_ = clamps_;
  saved_turned_ = turned_;
}

void RodSystem::restoreBase()
{
  const std::size_t count = a_.nodes + 2 * kHalo;
  for (int k = 0; k < 3; ++k)
  {
    std::copy_n(saved_[k].data(), a_.nodes, x_base_[k].data());
    std::copy_n(saved_[3 + k].data(), count, a_.base_t[k] - kHalo);
    std::copy_n(saved_[6 + k].data(), count, a_.base_d1[k] - kHalo);
  }
  std::copy_n(saved_[9].data(), count, a_.base_twist - kHalo);
  clamps_ = saved_clamps_;
  turned_ = saved_turned_;
}

double RodSystem::stepLimit() const
{
  double worst = 0.0;   // largest turn of an edge per unit step
  const int n = a_.nodes;
  for (int j = 0; j < a_.edges; ++j)
  {
    const int next = j + 1 < n ? j + 1 : 0;
    double move = 0.0;
    for (int k = 0; k < 3; ++k)
    {
      const double d = direction_[4 * next + k] - direction_[4 * j + k];
      move += d * d;
    }
    worst = std::max({worst, std::sqrt(move) * a_.inverse_length[j] / 0.7, std::abs(direction_[4 * j + 3]) / 1.5});
  }
  return worst > 1.0 ? 1.0 / worst : 1.0;
}

double RodSystem::incrementSize() const
{
  double largest = 0.0;
  for (int i = 0; i < a_.nodes; ++i)
    for (int k = 0; k < 3; ++k)
      largest = std::max(largest, std::abs(direction_[4 * i + k]));
  return largest / min_rest_length_;
}

double RodSystem::slope() const
{
  double sum = 0.0;
  for (std::size_t i = 0; i < gradient_.size(); ++i)
    sum += gradient_[i] * direction_[i];
  return sum;
}

double RodSystem::residual() const
{
  double largest = 0.0;
  for (int i = 0; i < a_.nodes; ++i)
    for (int c = 0; c < 4; ++c)
      largest = std::max(largest, std::abs(gradient_[4 * i + c]) * (c < 3 ? 1.0 : a_.inverse_rest_length[i]));
  return largest;
}

double RodSystem::forceScale() const
{
  double largest = 1e-9 * max_stretch_modulus_;   // a rod at rest has no forces to compare with, only their round-off
  for (int i = 0; i < a_.nodes; ++i)
  {
    largest = std::max(largest, std::abs(a_.stretch[i] * (a_.strain[i] - a_.rest_strain[i])));
    for (int k = 0; k < 3; ++k)
      largest = std::max(largest, std::abs(a_.force[k][i]));
    const double moment =
        std::hypot(a_.b11[i] * (a_.kappa1[i] - a_.rest_kappa1[i]), a_.b22[i] * (a_.kappa2[i] - a_.rest_kappa2[i]));
    largest = std::max(largest, moment * a_.inverse_rest_length[i]);
  }
  for (std::size_t j = 0; j < twist_load_.size(); ++j)
    largest = std::max(largest, std::abs(twist_load_[j]) * a_.inverse_rest_length[j]);
  return largest;
}

double RodSystem::noiseLevel() const
{
  double extent = 0.0;
  for (int k = 0; k < 3; ++k)
    for (int i = 0; i < a_.nodes; ++i)
      extent = std::max(extent, std::abs(a_.x[k][i]));
  // Positions round to eps of the extent, so that forces round to this times the stiffness of an edge against
  // stretching, and of a joint against bending, which is the larger one where edges are shorter than the rod is thick.
  const double bend = std::max(model_.bend_modulus.row(0).maxCoeff(), model_.bend_modulus.row(2).maxCoeff());
  const double stiffness =
      max_stretch_modulus_ / min_rest_length_ + bend / (min_rest_length_ * min_rest_length_ * min_rest_length_);
  return 4.0 * std::numeric_limits<double>::epsilon() * stiffness * (a_.stretch[0] / std::max(stretch_[0], 1e-300)) *
         extent;
}

Eigen::Vector3d RodSystem::nodeGradient(int node) const
{
  if (held_[node])
    return reactions_[held_[node] - 1].head<3>();
  return Eigen::Map<const Eigen::Vector3d>(gradient_.data() + 4 * node);
}

Eigen::Vector3d RodSystem::clampTorque(int grasp) const
{
  Eigen::Vector3d torque = Eigen::Vector3d::Zero();
  for (const ClampJoint& c : clamps_)
    if (c.grasp == grasp)
      torque += c.torque;
  for (std::size_t k = 0; k < held_angles_.size(); ++k)
  {
    const int j = held_angles_[k];
    if (j >= grasps_[grasp].first_node && j < grasps_[grasp].last_node)
      torque -= angle_reactions_[k] * Eigen::Vector3d(a_.t[0][j], a_.t[1][j], a_.t[2][j]);
  }
  return torque;
}

}   // namespace slender
