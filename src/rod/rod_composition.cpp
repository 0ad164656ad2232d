// What a rod's equations consist of at the moment: held parts, clamps, joints and their stiffness.
#include <algorithm>
#include <cmath>

#include "slender_sim/geometry/rotation.h"
#include "slender_sim/rod/rod_system.h"

namespace slender {

namespace {
/// JointCompensation::coupling of the joint at a node.
double couplingOf(const RodModel& model, int node)
{
  const Eigen::Vector3d B = model.bend_modulus.col(node);
  const double alpha = 0.5 * (B[0] + B[2]);
  const bool isotropic = std::abs(B[0] - B[2]) <= 2e-9 * alpha && std::abs(B[1]) <= 2e-9 * alpha;
  return isotropic && model.rest_curvature.col(node).norm() < 1e-9
             ? std::pow(model.twist_modulus[node] / (4 * alpha), 2)
             : 0.0;
}
}   // namespace

void RodSystem::compose(const RodState& state)
{
  const auto same = [](const GraspState& a, const GraspState& b) {
    return a.active == b.active && a.first_node == b.first_node && a.last_node == b.last_node &&
           a.holds_frame == b.holds_frame && a.body == b.body;
  };
  const bool unchanged = composition_ > 0 && grasps_.size() == state.grasps.size() &&
                         std::equal(grasps_.begin(), grasps_.end(), state.grasps.begin(), same);
  grasps_ = state.grasps;
  if (unchanged)
    return;
  ++composition_;
  const std::vector<char> jointless = holdNodes();
  // Voronoi lengths of the joints that remain, with the half cells of the clamps next to them
  std::vector<double> length(a_.nodes, 0.0);
  for (int i = 0; i < a_.nodes; ++i)
    if (!jointless[i])
      length[i] = 0.5 * (model_.rest_length[before(i)] + model_.rest_length[i]);
  addClamps(jointless, length);
  composeJoints(length);
  listTerms();
  if (allocated())
    setResponse(0.0, nullptr);
}

/// Holds what active grasps hold. Returns for each node whether it has no joint: ends, and what frames are held of.
std::vector<char> RodSystem::holdNodes()
{
  const int n = a_.nodes;
  holds_.release(n);
  carried_.assign(n, 0);
  std::vector<char> jointless(n, 0);
  if (!model_.closed)
    jointless[0] = jointless[n - 1] = 1;
  for (const GraspState& g : grasps_)
    if (g.active)
      for (int i = g.first_node; i <= g.last_node; ++i)
      {
        holds_.hold(i);
        carried_[i] = g.body >= 0;
        if (g.holds_frame)
          jointless[i] = 1;
        if (i < g.last_node)
          holds_.holdTurn(i);
      }
  return jointless;
}

/// Half joints between a held frame and the edge beside it.
void RodSystem::addClamps(const std::vector<char>& jointless, std::vector<double>& length)
{
  const int n = a_.nodes;
  clamps_.joints.clear();
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
        // Joints sample the curvature at the nodes: a trapezoidal rule from a clamp on. Gregory's end correction moves
        // h/12 of the clamp's weight to the next joint and removes the leading error, the slope of the curvature at the
        // clamp.
        const int next = side ? (node + 1) % n : before(node),
                  after = side ? (next + 1) % n : (model_.closed ? before(next) : next - 1);
        const bool has_after = model_.closed || (after >= 0 && after < n);
        if (!jointless[next] && has_after && !jointless[after])
        {
          l -= h / 12.0;
          length[next] += h / 12.0;
        }
        setClamp(c, l);
        clamps_.joints.push_back(c);
      }
}

/// Stiffness of a clamp over a length [m], and its rest shape.
void RodSystem::setClamp(ClampJoint& c, double length) const
{
  const int node = c.node, side = c.side;
  c.b11 = model_.bend_modulus(0, node) / length;
  c.b12 = model_.bend_modulus(1, node) / length;
  c.b22 = model_.bend_modulus(2, node) / length;
  c.beta = model_.twist_modulus[node] / length;
  // The half joint of the rest shape turns and twists by its share of the joint; its directors' mean lies elsewhere
  // between the edges than the joint's own, and strains are tangents of half angles (3.13, 3.14).
  const double share = shareOfEdge(model_, node, side), m = model_.rest_twist[node];
  const Eigen::Vector2d kappa = model_.rest_curvature.col(node);
  double ratio = share;
  if (model_.curvature == Curvature::tangent)
  {
    const double mean = std::abs(std::cos(0.5 * m)) > 1e-3 ? std::cos(0.5 * m) : 1.0,
                 half_tangent = 0.5 * kappa.norm() / std::abs(mean);
    ratio = half_tangent > 0
                ? std::tan(share * std::atan(half_tangent)) / half_tangent * std::cos(0.5 * share * m) / mean
                : 0.0;
  }
  const Eigen::Vector2d half = ratio * (Eigen::Rotation2Dd((side ? -0.5 : 0.5) * (1 - share) * m) * kappa);
  c.rest_kappa1 = half[0];
  c.rest_kappa2 = half[1];
  c.rest_twist = share * m;
  c.coupling = couplingOf(model_, node);
}

/// Stiffness and rest shape of the joints with a length [m], and of the edges.
void RodSystem::composeJoints(const std::vector<double>& length)
{
  const int n = a_.nodes, edges = a_.edges;
  const auto resize = [n](AlignedVector<double>& v) { v.assign(n, 0.0); };
  for (auto* v : {&stretch_, &b11_, &b12_, &b22_, &beta_, &rest_k1_, &rest_k2_, &rest_m_, &coupling_})
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
      coupling_[i] = couplingOf(model_, i);
      bend = std::max(bend, (b11_[i] + b22_[i]) / (length[i] * length[i]));
      twist = std::max(twist, beta_[i] + b11_[i] + b22_[i]);
    }
  }
  shift_x_ = 1e-2 * bend;
  shift_theta_ = twist;
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
      const Eigen::Vector3d t0 = get(a_.base_t, j), d0 = get(a_.base_d1, j);
      const Eigen::Vector3d t = (position(j + 1) - position(j)).normalized();
      const Eigen::Vector3d d = X_WG[k].orientation * g.directors_G[j - g.first_node];
      a_.turn[j] = signedAngle(parallelTransport(d0, t0, t), d, t);
    }
  }
  wrapHalo(a_.turn, a_.edges);
  for (ClampJoint& c : clamps_.joints)
  {
    const Eigen::Matrix3d section = X_WG[c.grasp].orientation.toRotationMatrix() * grasps_[c.grasp].section_G[c.side];
    c.t = section.col(0);
    c.d1 = section.col(1);
    c.turn = signedAngle(parallelTransport(c.base_d1, c.base_t, c.t), c.d1, c.t);
  }
}

void RodSystem::setResponse(double r, const Eigen::Matrix4Xd* strain)
{
  const double scale = 1.0 + r, share = r / scale;
  const int n = a_.nodes;
  const auto rest = [&](double elastic, int row, int column) {
    return r > 0 ? elastic + share * ((*strain)(row, column) - elastic) : elastic;
  };
  for (int i = 0; i < n; ++i)
  {
    a_.stretch[i] = no_stretching_ ? 0.0 : scale * stretch_[i];
    a_.rest_strain[i] = rest(0.0, 0, i);
    a_.b11[i] = scale * b11_[i];
    a_.b12[i] = scale * b12_[i];
    a_.b22[i] = scale * b22_[i];
    a_.beta[i] = scale * beta_[i];
    a_.rest_kappa1[i] = rest(rest_k1_[i], 1, i);
    a_.rest_kappa2[i] = rest(rest_k2_[i], 2, i);
    a_.rest_twist[i] = rest(rest_m_[i], 3, i);
  }
  for (double* p :
       {a_.stretch, a_.rest_strain, a_.b11, a_.b12, a_.b22, a_.beta, a_.rest_kappa1, a_.rest_kappa2, a_.rest_twist})
    wrapHalo(p, n);
  if (model_.curvature == Curvature::compensated)
  {
    // at rest the twist from the mean rest strain is 1 / scale of that from the elastic one
    for (int i = 0; i < n; ++i)
      a_.coupling[i] = scale * scale * coupling_[i];
    wrapHalo(a_.coupling, n);
  }
  // A joint's bending is stiffer than an edge's stretching where edges are shorter than the rod is thick.
  const double h = min_rest_length_;
  node_stiffness_ = scale * ((no_stretching_ ? 0.0 : stretch_modulus_ / h) + bend_modulus_ / (h * h * h));
  for (ClampJoint& c : clamps_.joints)
  {
    const int column = n + 2 * c.grasp + c.side;
    c.scale = scale;
    c.rest1 = rest(c.rest_kappa1, 1, column);
    c.rest2 = rest(c.rest_kappa2, 2, column);
    c.rest3 = rest(c.rest_twist, 3, column);
  }
}

}   // namespace slender
