#include "slender_sim/rod/rod_system.h"

#include <algorithm>

namespace slender {

RodSystem::RodSystem(const RodModel& model) : model_(model), clamps_(model.curvature)
{
  setSize(model.nodes(), model.closed, model.curvature);
  stretch_modulus_ = model.stretch_modulus.maxCoeff();
  bend_modulus_ = std::max(model.bend_modulus.row(0).maxCoeff(), model.bend_modulus.row(2).maxCoeff());
  min_rest_length_ = model.rest_length.minCoeff();
}

void RodSystem::load(const RodState& state)
{
  if (!allocated())
  {
    allocate(a_.nodes);
    for (int j = 0; j < a_.edges; ++j)
      a_.inverse_rest_length[j] = 1.0 / model_.rest_length[j];
    wrapHalo(a_.inverse_rest_length, a_.edges);
    if (composition_ > 0)
      setResponse(0.0, nullptr);
  }
  compose(state);
  stiffenAngles(1e-8, 0.0);   // keeps the matrix of a rod definite that can spin about itself without energy
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
  forgetTurns();
  if (spins_)
    spin_inertia_.resize(edges);
  for (ClampJoint& c : clamps_.joints)
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
  for (const ClampJoint& c : clamps_.joints)
    state.grasps[c.grasp].section_twist[c.side] = c.twist;
}

void RodSystem::setTwistLoads(const Eigen::VectorXd& torques)
{
  twist_loads_.set(torques);
  listTerms();
}

void RodSystem::keepSpins()
{
  spins_ = true;
  spin_inertia_.resize(a_.edges);
  listTerms();
}

void RodSystem::setTurn(int edge, double turn)
{
  if (!mayTurn(edge))
    return;
  a_.turn[edge] = turn;
  wrapHalo(a_.turn, a_.edges);
}

double RodSystem::twistWork() const { return twist_loads_.work(a_, turned()); }

/// A rod without clamps, torques or spins does not visit them.
void RodSystem::listTerms()
{
  keepTurns(spins_ || !twist_loads_.empty());
  clearTerms();
  if (!clamps_.joints.empty())
    addTerm(clamps_);
  if (!twist_loads_.empty())
    addTerm(twist_loads_);
  if (spins_)
    addTerm(spin_inertia_);
}

void RodSystem::strains(Eigen::Matrix4Xd& out) const
{
  const int n = a_.nodes;
  out.resize(4, n + 2 * grasps_.size());
  for (int i = 0; i < n; ++i)
    out.col(i) << a_.strain[i], a_.kappa1[i], a_.kappa2[i], a_.twist[i];
  out.rightCols(2 * grasps_.size()).setZero();
  for (const ClampJoint& c : clamps_.joints)
    out.col(n + 2 * c.grasp + c.side) << 0.0, c.kappa1, c.kappa2, c.twist;
}

Eigen::Vector3d RodSystem::clampTorque(int grasp) const
{
  Eigen::Vector3d torque = Eigen::Vector3d::Zero();
  for (const ClampJoint& c : clamps_.joints)
    if (c.grasp == grasp)
      torque += c.torque;
  for (int j : holds_.turns())
    if (j >= grasps_[grasp].first_node && j < grasps_[grasp].last_node)
      torque -= angleGradient(j) * get(a_.t, j);
  return torque;
}

}   // namespace slender
