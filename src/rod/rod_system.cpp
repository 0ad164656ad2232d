#include "slender_sim/rod/rod_system.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "slender_sim/geometry/rotation.h"

namespace slender {

namespace {
constexpr int kHalo = RodArrays::kHalo;
}

RodSystem::RodSystem(const RodModel& model) : model_(model)
{
  const int n = model.nodes();
  a_.nodes = n;
  a_.edges = model.edges();
  a_.closed = model.closed;
  const std::size_t padded = n + 2 * kHalo;
  const auto allocate = [&](double*& p, double fill) {
    storage_.emplace_back(padded, fill);
    p = storage_.back().data() + kHalo;
  };
  storage_.reserve(64);
  for (int k = 0; k < 3; ++k)
    for (double** p : {&a_.x[k], &a_.base_t[k], &a_.base_d1[k], &a_.t[k], &a_.d1[k], &a_.d2[k], &a_.target[k], &a_.force[k]})
      allocate(*p, 0.0);
  for (double** p : {&a_.turn, &a_.base_twist, &a_.twist, &a_.strain, &a_.kappa1, &a_.kappa2, &a_.stretch, &a_.rest_strain, &a_.b11, &a_.b12,
                     &a_.b22, &a_.beta, &a_.rest_kappa1, &a_.rest_kappa2, &a_.rest_twist, &a_.weight, &a_.theta_diagonal, &a_.theta_off})
    allocate(*p, 0.0);
  for (double** p : {&a_.length, &a_.inverse_length, &a_.inverse_rest_length})
    allocate(*p, 1.0);
  gradient_.assign(4 * n, 0.0);
  direction_.assign(4 * n, 0.0);
  reduced_.assign(4 * n, 0.0);
  a_.gradient = gradient_.data();
  for (auto& x : x_base_)
    x.assign(n, 0.0);
  for (auto& s : saved_)
    s.assign(padded, 0.0);
  matrix_.resize(n, model.closed);
  for (int j = 0; j < model.edges(); ++j)
    a_.inverse_rest_length[j] = 1.0 / model.rest_length[j];
  wrapHalo(a_.inverse_rest_length, model.edges());
  max_stretch_modulus_ = model.stretch_modulus.maxCoeff();
  min_rest_length_ = model.rest_length.minCoeff();
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

void RodSystem::compose(const RodState& state)
{
  const auto same = [](const GraspState& a, const GraspState& b) {
    return a.active == b.active && a.first_node == b.first_node && a.last_node == b.last_node && a.holds_frame == b.holds_frame;
  };
  const bool unchanged = !held_.empty() && grasps_.size() == state.grasps.size() &&
                         std::equal(grasps_.begin(), grasps_.end(), state.grasps.begin(), same);
  grasps_ = state.grasps;
  if (unchanged)
    return;

  const int n = a_.nodes, edges = a_.edges;
  held_.assign(n, 0);
  held_nodes_.clear();
  held_angles_.clear();
  std::vector<char> jointless(n, 0);
  if (!model_.closed)
    jointless[0] = jointless[n - 1] = 1;
  for (const GraspState& g : grasps_)
    if (g.active)
      for (int i = g.first_node; i <= g.last_node; ++i)
      {
        held_nodes_.push_back(i);
        held_[i] = static_cast<int>(held_nodes_.size());
        if (g.holds_frame)
          jointless[i] = 1;
        if (i < g.last_node)
          held_angles_.push_back(i);
      }
  reactions_.assign(held_nodes_.size(), Eigen::Vector4d::Zero());
  angle_reactions_.assign(held_angles_.size(), 0.0);

  // Voronoi lengths of the joints that remain, with the half cells of the clamps next to them
  std::vector<double> length(n, 0.0);
  for (int i = 0; i < n; ++i)
    if (!jointless[i])
      length[i] = 0.5 * (model_.rest_length[before(i)] + model_.rest_length[i]);
  clamps_.clear();
  for (int g = 0; g < static_cast<int>(grasps_.size()); ++g)
    if (grasps_[g].active && grasps_[g].holds_frame)
      for (int side = 0; side < 2; ++side)
      {
        const int node = side ? grasps_[g].last_node : grasps_[g].first_node;
        if (!model_.closed && node == (side ? n - 1 : 0))
          continue;
        ClampJoint c;
        c.grasp = g;
        c.side = side;
        c.node = node;
        c.edge = side ? node : before(node);
        const double h = model_.rest_length[c.edge];
        double l = 0.5 * h;
        // Joints sample the curvature at the nodes: a trapezoidal rule from a clamp on. Gregory's end correction moves h/12 of
        // the clamp's weight to the next joint and removes the leading error, the slope of the curvature at the clamp.
        const int next = side ? (node + 1) % n : before(node), after = side ? (next + 1) % n : (model_.closed ? before(next) : next - 1);
        const bool has_after = model_.closed || (after >= 0 && after < n);
        if (!jointless[next] && has_after && !jointless[after])
        {
          l -= h / 12.0;
          length[next] += h / 12.0;
        }
        const double half_share = 0.5 * h / (model_.closed || (node > 0 && node < n - 1) ? 0.5 * (model_.rest_length[before(node)] + model_.rest_length[node]) : 0.5 * h);
        c.b11 = model_.bend_modulus(0, node) / l;
        c.b12 = model_.bend_modulus(1, node) / l;
        c.b22 = model_.bend_modulus(2, node) / l;
        c.beta = model_.twist_modulus[node] / l;
        c.rest_kappa1 = model_.rest_curvature(0, node) * half_share;
        c.rest_kappa2 = model_.rest_curvature(1, node) * half_share;
        c.rest_twist = model_.rest_twist[node] * half_share;
        clamps_.push_back(c);
      }

  const auto resize = [n](AlignedVector<double>& v) { v.assign(n, 0.0); };
  for (auto* v : {&stretch_, &b11_, &b12_, &b22_, &beta_, &rest_k1_, &rest_k2_, &rest_m_})
    resize(*v);
  double bend = 0, twist = 0;
  for (int i = 0; i < n; ++i)
  {
    if (i < edges)
      stretch_[i] = model_.stretch_modulus[i];
    if (length[i] > 0)
    {
      b11_[i] = model_.bend_modulus(0, i) / length[i];
      b12_[i] = model_.bend_modulus(1, i) / length[i];
      b22_[i] = model_.bend_modulus(2, i) / length[i];
      beta_[i] = model_.twist_modulus[i] / length[i];
      rest_k1_[i] = model_.rest_curvature(0, i);
      rest_k2_[i] = model_.rest_curvature(1, i);
      rest_m_[i] = model_.rest_twist[i];
      bend = std::max(bend, (b11_[i] + b22_[i]) / (length[i] * length[i]));
      twist = std::max(twist, beta_[i] + b11_[i] + b22_[i]);
    }
  }
  shift_x_ = 1e-2 * bend;
  shift_theta_ = twist;
  setResponse(0.0, nullptr);
}

void RodSystem::placeGrasps(const std::vector<Pose>& X_WG)
{
  for (std::size_t k = 0; k < grasps_.size(); ++k)
  {
    const GraspState& g = grasps_[k];
    if (!g.active)
      continue;
    for (int i = g.first_node; i <= g.last_node; ++i)
      setPosition(i, X_WG[k] * g.nodes_G[i - g.first_node]);
    for (int j = g.first_node; j < g.last_node; ++j)
    {
      const Eigen::Vector3d t0(a_.base_t[0][j], a_.base_t[1][j], a_.base_t[2][j]), d0(a_.base_d1[0][j], a_.base_d1[1][j], a_.base_d1[2][j]);
      const Eigen::Vector3d t = (position(j + 1) - position(j)).normalized();
      const Eigen::Vector3d d = X_WG[k].orientation * g.directors_G[j - g.first_node];
      a_.turn[j] = signedAngle(parallelTransport(d0, t0, t), d, t);
    }
  }
  wrapHalo(a_.turn, a_.edges);
  for (ClampJoint& c : clamps_)
  {
    const Eigen::Matrix3d section = X_WG[c.grasp].orientation.toRotationMatrix() * grasps_[c.grasp].section_G[c.side];
    c.t = section.col(0);
    c.d1 = section.col(1);
    c.turn = signedAngle(parallelTransport(c.base_d1, c.base_t, c.t), c.d1, c.t);
  }
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

void RodSystem::setResponse(double r, const Eigen::Matrix4Xd* strain)
{
  const double scale = 1.0 + r, share = r / scale;
  const int n = a_.nodes;
  const auto rest = [&](double elastic, int row, int column) { return r > 0 ? elastic + share * ((*strain)(row, column) - elastic) : elastic; };
  for (int i = 0; i < n; ++i)
  {
    a_.stretch[i] = scale * stretch_[i];
    a_.rest_strain[i] = rest(0.0, 0, i);
    a_.b11[i] = scale * b11_[i];
    a_.b12[i] = scale * b12_[i];
    a_.b22[i] = scale * b22_[i];
    a_.beta[i] = scale * beta_[i];
    a_.rest_kappa1[i] = rest(rest_k1_[i], 1, i);
    a_.rest_kappa2[i] = rest(rest_k2_[i], 2, i);
    a_.rest_twist[i] = rest(rest_m_[i], 3, i);
  }
  for (double* p : {a_.stretch, a_.rest_strain, a_.b11, a_.b12, a_.b22, a_.beta, a_.rest_kappa1, a_.rest_kappa2, a_.rest_twist})
    wrapHalo(p, n);
  for (ClampJoint& c : clamps_)
  {
    const int column = n + 2 * c.grasp + c.side;
    c.scale = scale;
    c.rest1 = rest(c.rest_kappa1, 1, column);
    c.rest2 = rest(c.rest_kappa2, 2, column);
    c.rest3 = rest(c.rest_twist, 3, column);
  }
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

RodEvaluation RodSystem::evaluate(bool with_hessian, double shift)
{
  // Pieces of this many nodes stay in the second-level cache from assembly to elimination.
  constexpr int kPiece = 256;
  const RodKernels& kernels = rodKernels();
  const int n = a_.nodes;
  RodPanel* panels = with_hessian ? matrix_.panels() : nullptr;
  RodSweep sweep;
  kernels.begin(a_, sweep);
  RodEvaluation clamped;   // of the clamps alone
  BandCarry carry;
  const bool by_pieces = with_hessian && !model_.closed;
  int done = 0, eliminated = 0;
  while (done < n)
  {
    const int before = done;
    done = kernels.advance(a_, sweep, panels, by_pieces ? done + kPiece : n);
    for (ClampJoint& c : clamps_)
    {
      const int last = std::max(c.edge, (c.edge + 1) % n);   // node that must be there
      if (last < done && last >= before)
        evaluateClamp(c, with_hessian, clamped);
    }
    // the newest node may still receive from a clamp on the edge after it
    const int complete = done < n ? done - 1 : n;
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
        matrix_.band().eliminate(eliminated, complete, reduced_.data(), carry);
    }
    eliminated = complete;
  }
  RodEvaluation result = kernels.end(sweep);
  result.bend_twist += clamped.bend_twist;
  result.min_chi = std::min(result.min_chi, clamped.min_chi);
  if (by_pieces)
    result.inertia = {4 * n - carry.negative - carry.zero, carry.negative, carry.zero};
  else if (with_hessian)
    result.inertia = matrix_.factor();
  return result;
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
  RodPanel* panels = matrix_.panels();
  if (node >= from && node < to)
  {
    RodPanel& p = panels[node];
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
      for (auto& column : panels[above].below)
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

void RodSystem::addShift(int from, int to, double shift)
{
  if (shift > 0)
    for (int i = from; i < to; ++i)
    {
      RodPanel& p = matrix_.panels()[i];
      for (int c = 0; c < 3; ++c)
        p.diag[c][c] += shift * (a_.weight[i] + shift_x_);
      p.diag[3][3] += shift * shift_theta_;
    }
}

void RodSystem::moveAlong(double alpha)
{
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
  double largest = std::numeric_limits<double>::min();
  for (int i = 0; i < a_.nodes; ++i)
  {
    largest = std::max(largest, std::abs(a_.stretch[i] * (a_.strain[i] - a_.rest_strain[i])));
    for (int k = 0; k < 3; ++k)
      largest = std::max(largest, std::abs(a_.force[k][i]));
    const double moment = std::hypot(a_.b11[i] * (a_.kappa1[i] - a_.rest_kappa1[i]), a_.b22[i] * (a_.kappa2[i] - a_.rest_kappa2[i]));
    largest = std::max(largest, moment * a_.inverse_rest_length[i]);
  }
  return largest;
}

double RodSystem::noiseLevel() const
{
  double extent = 0.0;
  for (int k = 0; k < 3; ++k)
    for (int i = 0; i < a_.nodes; ++i)
      extent = std::max(extent, std::abs(a_.x[k][i]));
  return 4.0 * std::numeric_limits<double>::epsilon() * max_stretch_modulus_ * (a_.stretch[0] / std::max(stretch_[0], 1e-300)) * extent / min_rest_length_;
}

double RodSystem::turnFrames()
{
  // Thomas' algorithm on the edge angles; held ones are decoupled. A closed rod's corner is treated by Sherman and Morrison.
  const int edges = a_.edges;
  double* d = a_.theta_diagonal;
  double* off = a_.theta_off;   // off[j] couples edges j-1 ... see below: entry i couples edge i and i+1
  for (ClampJoint& c : clamps_)
    d[c.edge] += c.beta * c.scale;
  for (int edge : held_angles_)
  {
    d[edge] = 1.0;
    off[edge] = 0.0;
    if (edge > 0)
      off[edge - 1] = 0.0;
    else if (model_.closed)
      off[edges - 1] = 0.0;
  }
  const double corner = model_.closed ? off[edges - 1] : 0.0;
  const double gamma = -d[0];
  if (corner != 0.0)
  {
    d[edges - 1] -= corner * corner / gamma;
    d[0] -= gamma;
  }
  double* r = a_.turn;
  double* u = direction_.data();
  for (int j = 0; j < edges; ++j)
  {
    r[j] = -gradient_[4 * j + 3];
    u[j] = 0.0;
  }
  u[0] = gamma;
  u[edges - 1] = corner;
  for (int j = 0; j < edges; ++j)
  {
    // twisting alone makes the angles' matrix positive; a curved rod's may not be, then the pivot is lifted
    const double floor = 1e-3 * shift_theta_;
    if (d[j] < floor)
      d[j] = floor;
    if (j + 1 < edges)
    {
      const double f = off[j] / d[j];
      d[j + 1] -= f * off[j];
      r[j + 1] -= f * r[j];
      u[j + 1] -= f * u[j];
    }
  }
  for (int j = edges - 1; j >= 0; --j)
  {
    if (j + 1 < edges)
    {
      r[j] -= off[j] * r[j + 1];
      u[j] -= off[j] * u[j + 1];
    }
    r[j] /= d[j];
    u[j] /= d[j];
  }
  if (corner != 0.0)
  {
    const double factor = (r[0] + corner * r[edges - 1] / gamma) / (1.0 + u[0] + corner * u[edges - 1] / gamma);
    for (int j = 0; j < edges; ++j)
      r[j] -= factor * u[j];
  }
  double largest = 0.0;
  for (int j = 0; j < edges; ++j)
  {
    r[j] = std::clamp(r[j], -1.5, 1.5);
    largest = std::max(largest, std::abs(r[j]));
  }
  wrapHalo(a_.turn, edges);
  return largest;
}

void RodSystem::relaxFrames()
{
  evaluate(false);
  for (int k = 0; k < 50; ++k)
  {
    accept();
    const double turned = turnFrames();
    evaluate(false);
    if (turned < 1e-10)
      break;
  }
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

}  // namespace slender
