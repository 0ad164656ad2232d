#include "rod_part.h"

#include <algorithm>

#include "slender_sim/geometry/rotation.h"

namespace slender {

void RodPart::addWeld(const Weld& weld)
{
  weld.body->carry({&rod_, weld.grasp, weld.X_BG});
  welds_.push_back(weld);
}

/// Null: no body carries the grasp.
const RodPart::Weld* RodPart::weldOf(int grasp) const
{
  for (const Weld& weld : welds_)
    if (weld.grasp == grasp)
      return &weld;
  return nullptr;
}

/// An unknown that the body of grasp k carries gets the number -2 - k. Where nothing carries the grasp of a weld, it
/// stays at its pose.
bool RodPart::numberUnknowns()
{
  const std::vector<GraspState>& grasps = rod_.work.grasps;
  const RodModel& model = *rod_.model;
  const auto hold = [](const GraspState& g) { return std::array<int, 4>{g.active, g.first_node, g.last_node, g.body}; };
  if (holds_.size() == grasps.size() && !dof_.empty() &&
      std::equal(grasps.begin(), grasps.end(), holds_.begin(),
                 [&](const GraspState& g, const std::array<int, 4>& held) { return hold(g) == held; }))
    return true;
  ++surface_version_;   // with other driven points
  holds_.clear();
  dof_.assign(4 * model.nodes(), 0);
  welded_ = false;
  if (!model.closed)
    dof_.back() = kPrescribed;   // the last node has no edge
  for (std::size_t k = 0; k < grasps.size(); ++k)
  {
    const GraspState& g = grasps[k];
    holds_.push_back(hold(g));
    if (!g.active)
      continue;
    const bool carried = weldOf(static_cast<int>(k)) != nullptr;
    const int code = carried ? -2 - static_cast<int>(k) : kPrescribed;
    welded_ = welded_ || carried;
    for (int i = g.first_node; i <= g.last_node; ++i)
      for (int c = 0; c < (i < g.last_node ? 4 : 3); ++c)
        dof_[4 * i + c] = code;
  }
  numberFree();
  return false;
}

// ---- configuration

void RodPart::placeHeld(double fraction)
{
  rod_.placeAt(fraction);
  if (averages_)
    averages_->place(fraction);
}

/// Returns true if a grasp that no body carries goes elsewhere in the step. With `to_rest` this also holds for one that
/// returns to where it was, with a velocity.
bool RodPart::graspsMove(bool to_rest) const
{
  const std::vector<GraspState>& grasps = rod_.work.grasps;
  for (std::size_t k = 0; k < grasps.size(); ++k)
  {
    const GraspTarget& target = rod_.inputs->grasps[k];
    const Pose &from = grasps[k].X_WG, &to = target.X_WG;
    if (grasps[k].active && grasps[k].body < 0 &&
        (from.position != to.position || from.orientation.coeffs() != to.orientation.coeffs() ||
         (to_rest && target.velocity)))
      return true;
  }
  return false;
}

bool RodPart::heldMoves(double from_fraction, double to_fraction) const
{
  return from_fraction != to_fraction && ((averages_ && averages_->move()) || graspsMove(true));
}

void RodPart::followJoints()
{
  for (const Weld& weld : welds_)
    rod_.stage_poses[weld.grasp] = weld.body->pose() * weld.X_BG;
  if (!welds_.empty())
    rod_.system.placeGrasps(rod_.stage_poses);
}

void RodPart::gather(Eigen::Matrix3Xd& x) const
{
  for (int i = 0, n = points(); i < n; ++i)
    x.col(first_point + i) = system_.position(i);
}

// ---- a stage

void RodPart::setCarriedInertia(const Stage& stage)
{
  const double inertia = 1.0 / (stage.tau_a * stage.tau_a), damping = 1.0 / stage.tau_v;
  const RodModel& m = *rod_.model;
  forActiveWelds([&](const Weld& weld, const GraspState& g) {
    const BodySystem& body = weld.body->system;
    for (int i = g.first_node; i <= g.last_node; ++i)
    {
      const Eigen::Vector3d r = weld.X_BG * g.nodes_G[i - g.first_node];
      const double wm = m.mass[i] * inertia, wd = m.damping(i) * damping;
      system_.setInertia(i, wm + wd, (wm * body.inertiaTarget(r) + wd * body.dampingTarget(r)) / (wm + wd),
                         rod_.load(i));
    }
  });
}

void RodPart::takeCarriedMotion()
{
  for (const Weld& weld : welds_)
  {
    const BodySystem& body = weld.body->system;
    const Twist& v = body.velocity();
    rod_.stage_poses[weld.grasp] = body.pose * weld.X_BG;
    rod_.carried_velocity[weld.grasp] = {v.linear + v.angular.cross(body.pose.orientation * weld.X_BG.position),
                                         v.angular};
  }
}

// ---- equations

/// What acts on the carried nodes, edges and clamps acts on the bodies.
void RodPart::passGradient()
{
  if (!welded_)
    return;
  const RodArrays& a = system_.arrays();
  const double* gradient = system_.gradient();
  forActiveWelds([&](const Weld& weld, const GraspState& g) {
    for (int i = g.first_node; i <= g.last_node; ++i)
      weld.body->addForceAt(system_.position(i), -Eigen::Map<const Eigen::Vector3d>(gradient + 4 * i));
    for (int j = g.first_node; j < g.last_node; ++j)
      weld.body->system.gradient.tail<3>() += gradient[4 * j + 3] * Eigen::Vector3d(a.t[0][j], a.t[1][j], a.t[2][j]);
    for (const ClampJoint& c : system().clamps())
      if (c.grasp == weld.grasp)
        weld.body->system.gradient.tail<3>() -= c.torque;
  });
}

/// Weighted unknowns that an unknown of the rod stands for: itself, or those of the body that carries it.
void RodPart::columnsOf(int unknown, double weight, Columns& row) const
{
  const int number = dof_[unknown];
  if (number >= 0)
    row.push(offset + number, weight);
  if (number >= kPrescribed)
    return;
  const BodyPart& body = *weldOf(-2 - number)->body;
  const int node = unknown / 4, c = unknown % 4;
  const RodArrays& a = system_.arrays();
  if (c < 3)
    body.addColumnsAt(system_.position(node), c, weight, row);
  else
    for (int k = 0; k < 3; ++k)
      row.push(body.offset + 3 + k, weight * a.t[k][node]);
}

void RodPart::addColumns(int point, int component, double weight, Columns& row) const
{
  columnsOf(4 * point + component, weight, row);
}

/// What panels and clamps couple with the bodies that carry the rod.
void RodPart::notePattern(SharedMatrix& matrix)
{
  ChainPart::notePattern(matrix);
  carried_entries_.clear();
  for (int i = 0; welded_ && i < system_.nodes(); ++i)
    for (int c = 0; c < 4; ++c)
      for (int r = c; r < ChainSystem::kPanelRows; ++r)
      {
        const int a = 4 * i + c, b = system_.panelUnknown(i, r);
        if (b < 0 || dof_[a] == kPrescribed || dof_[b] == kPrescribed || (dof_[a] >= 0 && dof_[b] >= 0))
          continue;
        carried_entries_.push_back({i, c, r});
        Columns ca, cb;
        columnsOf(a, 1.0, ca);
        columnsOf(b, 1.0, cb);
        matrix.notePairs(ca, cb);
      }
  for (const ClampJoint& clamp : system().clamps())
    if (const Weld* weld = weldOf(clamp.grasp))
    {
      Columns edge, turn;
      const int next = (clamp.edge + 1) % system_.nodes();
      for (int c = 0; c < 3; ++c)
      {
        columnsOf(4 * clamp.edge + c, 1.0, edge);
        columnsOf(4 * next + c, 1.0, edge);
        turn.push(weld->body->offset + 3 + c, 1.0);
      }
      columnsOf(4 * clamp.edge + 3, 1.0, edge);
      matrix.notePairs(edge, turn);
    }
}

void RodPart::addHessian(SharedMatrix& matrix, const HessianShift& shift)
{
  ChainPart::addHessian(matrix, shift);
  if (!welded_)
    return;
  addCarried(matrix);
  addClamps(matrix);
}

/// Entries of carried unknowns, and what the curvature of a rotation adds: for a point at r with gradient g, (g r^T + r
/// g^T)/2 - (g.r) I.
void RodPart::addCarried(SharedMatrix& matrix) const
{
  const RodPanel* panels = system_.panels();
  Columns a, b;
  for (const auto& [node, column, row] : carried_entries_)
  {
    const double value = ChainSystem::panelEntry(panels[node], column, row);
    const int unknown = system_.panelUnknown(node, row);
    a.count = b.count = 0;
    columnsOf(4 * node + column, 1.0, a);
    if (unknown == 4 * node + column)
    {
      matrix.addSquare(a, value);
      continue;
    }
    columnsOf(unknown, 1.0, b);
    matrix.addPair(a, b, value);
  }
  forActiveWelds([&](const Weld& weld, const GraspState& g) {
    const int base = weld.body->offset + 3;
    for (int i = g.first_node; i <= g.last_node; ++i)
    {
      const Eigen::Vector3d r = system_.position(i) - weld.body->pose().position;
      const Eigen::Vector3d grad = Eigen::Map<const Eigen::Vector3d>(system_.gradient() + 4 * i);
      for (int p = 0; p < 3; ++p)
        for (int q = 0; q <= p; ++q)
          matrix.add(base + p, base + q, 0.5 * (grad[p] * r[q] + r[p] * grad[q]) - (p == q ? grad.dot(r) : 0.0));
    }
  });
}

/// The turn of a clamped section that a body carries. Turning the section is turning the edge backwards, so its
/// derivatives follow from those of the edge: gradient -(e x g + g_theta t), and so on.
void RodPart::addClamps(SharedMatrix& matrix) const
{
  const RodArrays& arrays = system_.arrays();
  for (const ClampJoint& c : system().clamps())
  {
    const Weld* weld = weldOf(c.grasp);
    if (!weld)
      continue;
    const int j = c.edge, next = (j + 1) % arrays.nodes;
    const Eigen::Vector3d t(arrays.t[0][j], arrays.t[1][j], arrays.t[2][j]), e = t / arrays.inverse_length[j];
    const Eigen::Matrix3d by_edge =
        -skew(c.gradient_e) + skew(e) * c.hessian_ee + t * c.hessian_et.transpose() +
        c.gradient_t * arrays.inverse_length[j] * (Eigen::Matrix3d::Identity() - t * t.transpose());
    const Eigen::Vector3d by_angle = e.cross(c.hessian_et) + c.hessian_tt * t;
    Eigen::Matrix3d turn = skew(c.torque) - by_edge * skew(e) + by_angle * t.transpose();
    turn = (0.5 * (turn + turn.transpose())).eval();
    const int base = weld->body->offset + 3;
    Columns row, column;
    for (int p = 0; p < 3; ++p)
    {
      row.count = 0;
      row.push(base + p, 1.0);
      for (int k = 0; k < 3; ++k)
      {
        column.count = 0;
        columnsOf(4 * next + k, 1.0, column);
        columnsOf(4 * j + k, -1.0, column);
        matrix.addPair(row, column, -by_edge(p, k));
      }
      column.count = 0;
      columnsOf(4 * j + 3, 1.0, column);
      matrix.addPair(row, column, -by_angle[p]);
      for (int q = 0; q <= p; ++q)
        matrix.add(base + p, base + q, turn(p, q));
    }
  }
}

void RodPart::takeDirection(const double* solution)
{
  ChainPart::takeDirection(solution);
  Columns row;
  for (std::size_t u = 0; welded_ && u < dof_.size(); ++u)
  {
    if (dof_[u] >= kPrescribed)
      continue;
    row.count = 0;
    columnsOf(static_cast<int>(u), 1.0, row);
    double value = 0.0;
    for (int i = 0; i < row.count; ++i)
      value += row.value[i] * solution[row.index[i]];
    system_.direction()[u] = value;
  }
}

}   // namespace slender
