// The sparse matrix of coupled rods, bodies and contacts: its pattern and its entries.
#include <algorithm>

#include "coupled_system.h"
#include "slender_sim/geometry/rotation.h"

namespace slender {

/// Numbers the unknowns of a rod whose grasps have changed.
void CoupledSystem::mapUnknowns(RodPart& part)
{
  const RodState& state = part.rod->work;
  const RodModel& model = *part.rod->model;
  bool same = part.holds.size() == state.grasps.size() && !part.dof.empty();
  for (std::size_t k = 0; same && k < state.grasps.size(); ++k)
  {
    const GraspState& g = state.grasps[k];
    same = part.holds[k] == std::array<int, 4>{g.active, g.first_node, g.last_node, g.body};
  }
  if (same)
    return;
  coupled_.invalidatePattern();
  part.holds.clear();
  part.dof.assign(4 * model.nodes(), 0);
  part.welded = false;
  if (!model.closed)
    part.dof.back() = kPrescribed;   // the last node has no edge
  for (std::size_t k = 0; k < state.grasps.size(); ++k)
  {
    const GraspState& g = state.grasps[k];
    part.holds.push_back({g.active, g.first_node, g.last_node, g.body});
    if (!g.active)
      continue;
    const int code = g.body < 0 ? kPrescribed : -2 - static_cast<int>(k);
    part.welded = part.welded || g.body >= 0;
    for (int i = g.first_node; i <= g.last_node; ++i)
      for (int c = 0; c < (i < g.last_node ? 4 : 3); ++c)
        part.dof[4 * i + c] = code;
  }
  part.unknowns = 0;
  for (int& d : part.dof)
    if (d == 0)
      d = part.unknowns++;
}

/// Weighted unknowns that an unknown of a rod stands for: itself, or those of the body that carries it.
void CoupledSystem::mapDof(const RodPart& part, int dof, double weight, Columns& out) const
{
  const int code = part.dof[dof];
  if (code >= 0)
    out.push(part.offset + code, weight);
  if (code >= kPrescribed)
    return;
  const int body = part.rod->work.grasps[-2 - code].body, base = bodyUnknown(body), node = dof / 4, c = dof % 4;
  const RodArrays& a = part.rod->system.arrays();
  if (c == 3)
  {
    for (int k = 0; k < 3; ++k)
      out.push(base + 3 + k, weight * a.t[k][node]);
    return;
  }
  out.push(base + c, weight);
  const Eigen::Vector3d r = part.rod->system.position(node) - bodies_[simulated_[body]].pose.position;
  const int next = (c + 1) % 3, after = (c + 2) % 3;   // (turn x r)_c = turn_next r_after - turn_after r_next
  out.push(base + 3 + next, weight * r[after]);
  out.push(base + 3 + after, -weight * r[next]);
}

/// Displacement of a contact's points against each other, one row per component.
void CoupledSystem::contactColumns(const ContactTerm& term, std::array<Columns, 3>& rows) const
{
  for (int c = 0; c < 3; ++c)
  {
    rows[c].count = 0;
    for (int p = 0; p < 4; ++p)
      if (term.point[p] >= 0)
      {
        const RodPart& part = partOf(term.point[p]);
        mapDof(part, 4 * (term.point[p] - part.point) + c, term.weight[p], rows[c]);
      }
    const int obstacles = static_cast<int>(obstacles_.size());
    if (term.solid < obstacles)
      continue;
    const int body = model_.contact.bodies[term.solid - obstacles].body;
    if (simulated_[body] < 0)
      continue;
    const int base = bodyUnknown(body), next = (c + 1) % 3, after = (c + 2) % 3;
    const Eigen::Vector3d r = term.position - bodies_[simulated_[body]].pose.position;
    rows[c].push(base + c, -1.0);
    rows[c].push(base + 3 + next, -r[after]);
    rows[c].push(base + 3 + after, r[next]);
  }
}

/// A pair's gap as the place of contact runs.
void CoupledSystem::contactColumns(const ContactRow& contact, bool whole, Columns& row) const
{
  row.count = 0;
  for (int p = 0; p < 4; ++p)
  {
    if (contact.point[p] < 0)
      continue;
    const RodPart& part = partOf(contact.point[p]);
    const Eigen::Vector3d weights =
        contact.along[p] * contact.normal + (whole ? contact.across[p] : 0.0) * contact.turning;
    for (int c = 0; c < 3; ++c)
      mapDof(part, 4 * (contact.point[p] - part.point) + c, weights[c], row);
  }
}

/// Whether a contact cannot be taken as one of points with unknowns of their own: a body carries one of them, or is
/// touched.
bool CoupledSystem::isCarried(const CouplingMatrix::Bases& bases, int solid) const
{
  return (solid >= 0 && coupled_.solid_moves[solid]) ||
         std::any_of(bases.begin(), bases.end(), [](int base) { return base < kPrescribed; });
}

void CoupledSystem::buildPattern()
{
  for (RodPart& part : parts_)
    part.coupled = part.welded;
  for (const CoupledChains::Key& key : coupled_.room())
    for (int p = 0; p < 4; ++p)
      if (key[p] >= 0)
        coupled_.points[key[p]].chain->coupled = true;
  coupled_.beginPattern(6 * static_cast<int>(bodies_.size()));
  for (std::size_t b = 0; b < bodies_.size(); ++b)
    for (int i = 0; i < 6; ++i)
      for (int j = 0; j <= i; ++j)
        coupled_.matrix.note(coupled_.others() + 6 * b + i, coupled_.others() + 6 * b + j);
  for (RodPart& part : parts_)
    if (part.welded)
      noteCarried(part);
  for (const CoupledChains::Key& key : coupled_.room())
  {
    ContactTerm term;
    std::copy_n(key.begin(), 4, term.point);
    term.solid = key[4];
    const CouplingMatrix::Bases bases = coupled_.basesOf(term.point);
    if (!isCarried(bases, term.solid))
    {
      coupled_.matrix.noteBases(bases);
      continue;
    }
    std::array<Columns, 3> rows;
    contactColumns(term, rows);
    for (const Columns& a : rows)
      for (const Columns& b : rows)
        coupled_.matrix.notePairs(a, b);
  }
  coupled_.endPattern();
}

/// Of a rod that bodies carry: what its panels and clamps couple with these.
void CoupledSystem::noteCarried(RodPart& part)
{
  const RodSystem& system = part.rod->system;
  part.carried_entries.clear();
  for (int i = 0; i < system.nodes(); ++i)
    for (int c = 0; c < 4; ++c)
      for (int r = c; r < ChainSystem::kPanelRows; ++r)
      {
        const int a = 4 * i + c, b = system.panelUnknown(i, r);
        if (b < 0 || part.dof[a] == kPrescribed || part.dof[b] == kPrescribed || (part.dof[a] >= 0 && part.dof[b] >= 0))
          continue;
        part.carried_entries.push_back({i, c, r});
        Columns ca, cb;
        mapDof(part, a, 1.0, ca);
        mapDof(part, b, 1.0, cb);
        coupled_.matrix.notePairs(ca, cb);
      }
  for (const ClampJoint& clamp : system.clamps())
    if (const int body = part.rod->work.grasps[clamp.grasp].body; body >= 0)
    {
      Columns edge, turn;
      const int next = (clamp.edge + 1) % system.nodes();
      for (int c = 0; c < 3; ++c)
      {
        mapDof(part, 4 * clamp.edge + c, 1.0, edge);
        mapDof(part, 4 * next + c, 1.0, edge);
        turn.push(bodyUnknown(body) + 3 + c, 1.0);
      }
      mapDof(part, 4 * clamp.edge + 3, 1.0, edge);
      coupled_.matrix.notePairs(edge, turn);
    }
}

/// Entries of carried unknowns, and what the curvature of a rotation adds: for a point at r with gradient g, (g r^T + r
/// g^T)/2 - (g.r) I.
void CoupledSystem::addCarried(const RodPart& part)
{
  RodSystem& system = part.rod->system;
  const RodPanel* panels = system.panels();
  Columns a, b;
  for (const auto& [node, column, row] : part.carried_entries)
  {
    const double value = ChainSystem::panelEntry(panels[node], column, row);
    const int dof = system.panelUnknown(node, row);
    a.count = b.count = 0;
    mapDof(part, 4 * node + column, 1.0, a);
    if (dof == 4 * node + column)
    {
      coupled_.matrix.addSquare(a, value);
      continue;
    }
    mapDof(part, dof, 1.0, b);
    coupled_.matrix.addPair(a, b, value);
  }
  for (const GraspState& g : part.rod->work.grasps)
  {
    if (!g.active || g.body < 0)
      continue;
    const int base = bodyUnknown(g.body) + 3;
    for (int i = g.first_node; i <= g.last_node; ++i)
    {
      const Eigen::Vector3d r = system.position(i) - bodies_[simulated_[g.body]].pose.position;
      const Eigen::Vector3d grad = Eigen::Map<const Eigen::Vector3d>(system.gradient() + 4 * i);
      for (int p = 0; p < 3; ++p)
        for (int q = 0; q <= p; ++q)
          coupled_.matrix.add(base + p, base + q,
                              0.5 * (grad[p] * r[q] + r[p] * grad[q]) - (p == q ? grad.dot(r) : 0.0));
    }
  }
}

/// The turn of a clamped section that a body carries. Turning the section is turning the edge backwards, so its
/// derivatives follow from those of the edge: gradient -(e x g + g_theta t), and so on.
void CoupledSystem::addClamps(const RodPart& part)
{
  const RodArrays& arrays = part.rod->system.arrays();
  for (const ClampJoint& c : part.rod->system.clamps())
  {
    const int body = part.rod->work.grasps[c.grasp].body;
    if (body < 0)
      continue;
    const int j = c.edge, next = (j + 1) % arrays.nodes;
    const Eigen::Vector3d t(arrays.t[0][j], arrays.t[1][j], arrays.t[2][j]), e = t / arrays.inverse_length[j];
    const Eigen::Matrix3d by_edge =
        -skew(c.gradient_e) + skew(e) * c.hessian_ee + t * c.hessian_et.transpose() +
        c.gradient_t * arrays.inverse_length[j] * (Eigen::Matrix3d::Identity() - t * t.transpose());
    const Eigen::Vector3d by_angle = e.cross(c.hessian_et) + c.hessian_tt * t;
    Eigen::Matrix3d turn = skew(c.torque) - by_edge * skew(e) + by_angle * t.transpose();
    turn = (0.5 * (turn + turn.transpose())).eval();
    const int base = bodyUnknown(body) + 3;
    Columns row, column;
    for (int p = 0; p < 3; ++p)
    {
      row.count = 0;
      row.push(base + p, 1.0);
      for (int k = 0; k < 3; ++k)
      {
        column.count = 0;
        mapDof(part, 4 * next + k, 1.0, column);
        mapDof(part, 4 * j + k, -1.0, column);
        coupled_.matrix.addPair(row, column, -by_edge(p, k));
      }
      column.count = 0;
      mapDof(part, 4 * j + 3, 1.0, column);
      coupled_.matrix.addPair(row, column, -by_angle[p]);
      for (int q = 0; q <= p; ++q)
        coupled_.matrix.add(base + p, base + q, turn(p, q));
    }
  }
}

/// `whole`: with the part of the contacts' second derivatives that may be negative.
void CoupledSystem::assemble(const HessianShift& shift, bool whole)
{
  coupled_.assemble(shift);
  for (const RodPart& part : parts_)
    if (part.welded)
    {
      addCarried(part);
      addClamps(part);
    }
  for (std::size_t b = 0; b < bodies_.size(); ++b)
  {
    bodies_[b].addShift(shift);
    for (int i = 0; i < 6; ++i)
      for (int j = 0; j <= i; ++j)
        coupled_.matrix.add(coupled_.others() + 6 * b + i, coupled_.others() + 6 * b + j, bodies_[b].hessian(i, j));
  }
  std::array<Columns, 3> rows;
  coupled_.forTerms([&](const ContactTerm& term) {
    const CouplingMatrix::Bases bases = coupled_.basesOf(term.point);
    if (!isCarried(bases, term.solid))
    {
      coupled_.matrix.addTerm(term, bases, whole);
      return;
    }
    contactColumns(term, rows);
    const Eigen::Matrix3d stiffness = whole ? Eigen::Matrix3d(term.stiffness + term.geometric) : term.stiffness;
    for (int c = 0; c < 3; ++c)
    {
      coupled_.matrix.addSquare(rows[c], stiffness(c, c));
      for (int d = 0; d < c; ++d)
        coupled_.matrix.addPair(rows[c], rows[d], stiffness(c, d));
    }
  });
  coupled_.forRows([&](const ContactRow& row) {
    const CouplingMatrix::Bases bases = coupled_.basesOf(row.point);
    if (!isCarried(bases, -1))
    {
      coupled_.matrix.addRow(row, bases, whole);
      return;
    }
    contactColumns(row, whole, rows[0]);
    coupled_.matrix.addSquare(rows[0], row.stiffness);
  });
}

}   // namespace slender
