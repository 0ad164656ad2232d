#include "chain_part.h"

#include <algorithm>

namespace slender {

void ChainPart::numberFree()
{
  unknowns_ = 0;
  for (int& number : dof_)
    if (number >= 0)
      number = unknowns_++;
}

void ChainPart::retreat(double share)
{
  for (int i = 0; i < system_.nodes(); ++i)
    if (system_.isFree(i))
    {
      const Eigen::Vector3d base = system_.basePosition(i);
      system_.setPosition(i, base + share * (system_.position(i) - base));
    }
}

/// Adds the stiffness of a displacement to the panels: of the weighted sum of a node and the next one, plus `column`
/// times the turn of the edge between them. The panel of the first node has room for all of it.
void ChainPart::addToPanels(const int (&point)[4], const double (&weight)[4], const Eigen::Matrix3d& stiffness,
                            const Eigen::Vector3d& column)
{
  const int node[2] = {nodeOf(point[0] - first_point), nodeOf(point[1] - first_point)};
  RodPanel* const panels = system_.panels();
  for (int p = 0; p < 2; ++p)
    if (node[p] >= 0)
      for (int c = 0; c < 3; ++c)
        for (int r = c; r < 3; ++r)
          panels[node[p]].diag[c][r] += weight[p] * weight[p] * stiffness(r, c);
  if (node[0] >= 0 && node[1] >= 0)
    for (int c = 0; c < 3; ++c)
      for (int r = 0; r < 3; ++r)
        panels[node[0]].below[c][r] += weight[0] * weight[1] * stiffness(r, c);
  if (node[0] < 0 || column.isZero(0.0))
    return;
  const Eigen::Vector3d torque = stiffness * column;
  for (int c = 0; c < 3; ++c)
  {
    panels[node[0]].diag[c][3] += weight[0] * torque[c];
    if (node[1] >= 0)
      panels[node[0]].below[3][c] += weight[1] * torque[c];
  }
  panels[node[0]].diag[3][3] += column.dot(torque);
}

/// Contacts with solids have no indefinite second derivatives, so that the whole of them goes into the band.
void ChainPart::evaluate(bool with_hessian, const HessianShift& shift)
{
  const bool alone = !coupled && own_terms.empty();
  evaluation = alone ? system_.evaluate(with_hessian, shift) : system_.evaluateWhole(with_hessian);
  if (averages_)
    averages_->forEntries([&](Eigen::Index i, int node, double weight) {
      Eigen::Map<Eigen::Vector3d>(system_.gradient() + 4 * node) -= weight * averages_->forces.col(i);
    });
  if (alone || coupled)
    return;
  for (const ContactTerm* term : own_terms)
  {
    for (int p = 0; p < 2; ++p)
      addForce(term->point[p] - first_point, term->weight[p] * term->force);
    if (term->turns())
      addTorque(term->point[0] - first_point, term->turn[0].column.dot(term->force));
    if (with_hessian)
      addToPanels(term->point, term->weight, term->stiffness, term->turn[0].column);
  }
  if (!with_hessian)
  {
    system_.closeGradient();
    return;
  }
  for (const ContactRow* row : own_rows)
    addToPanels(row->point, row->along, row->stiffness * row->normal * row->normal.transpose());
  evaluation.inertia = system_.factorWhole(shift);
}

void ChainPart::meetAverages()
{
  if (!averages_)
    return;
  averages_->meet([this](int node) { return system_.position(node); },
                  [this](int node, int component, double length) {
                    Eigen::Vector3d x = system_.position(node);
                    x[component] += length;
                    system_.setPosition(node, x);
                  });
}

/// An average spreads its force over the nodes.
double ChainPart::forceScale() const
{
  double largest = system_.forceScale();
  if (averages_)
    largest =
        std::max(largest, averages_->forces.cwiseAbs().maxCoeff() /
                              static_cast<double>(std::max<Eigen::Index>(1, system_.nodes() / averages_->count())));
  return largest;
}

// ---- the matrix of the island

/// Calls f(a, b) for every place of the panels, row after row of each column: with the numbers in the part of its two
/// unknowns, or with kPrescribed twice where one of them has no number.
template <class F>
void ChainPart::forPanels(F&& f) const
{
  for (int i = 0; i < system_.nodes(); ++i)
    for (int c = 0; c < 4; ++c)
      for (int r = c; r < ChainSystem::kPanelRows; ++r)
      {
        const int a = dof_[4 * i + c], at = system_.panelUnknown(i, r), b = at < 0 ? kPrescribed : dof_[at];
        a < 0 || b < 0 ? f(kPrescribed, kPrescribed) : f(a, b);
      }
}

void ChainPart::notePattern(SharedMatrix& matrix)
{
  forPanels([&](int a, int b) {
    if (a >= 0)
      matrix.note(offset + a, offset + b);
  });
}

void ChainPart::findEntries(const SharedMatrix& matrix)
{
  entries_.clear();
  forPanels([&](int a, int b) { entries_.push_back(a < 0 ? -1 : matrix.index(offset + a, offset + b)); });
}

void ChainPart::addHessian(SharedMatrix& matrix, const HessianShift& shift)
{
  double* const values = matrix.values();
  const RodPanel* panels = system_.panels();
  const int* entry = entries_.data();
  for (int i = 0; i < system_.nodes(); ++i)
  {
    const auto shifts = system_.diagonalShift(i, shift);
    for (int c = 0; c < 4; ++c)
      for (int r = c; r < ChainSystem::kPanelRows; ++r, ++entry)
        if (*entry >= 0)
          values[*entry] += ChainSystem::panelEntry(panels[i], c, r) + (r == c ? shifts[c == 3] : 0.0);
  }
}

void ChainPart::takeGradient(double* right) const
{
  for (std::size_t u = 0; u < dof_.size(); ++u)
    if (dof_[u] >= 0)
      right[offset + dof_[u]] = -system_.gradient()[u];
}

void ChainPart::takeDirection(const double* solution)
{
  for (std::size_t u = 0; u < dof_.size(); ++u)
    system_.direction()[u] = dof_[u] < 0 ? 0.0 : solution[offset + dof_[u]];
}

// ---- contact

void ChainPart::gatherTurns(Eigen::VectorXd& turns) const
{
  for (int point = 0; point < points(); ++point)
    if (const int node = nodeOf(point); node >= 0 && node < system_.arrays().edges)
      turns[first_point + point] = system_.turn(node);
}

void ChainPart::addColumns(int point, int component, double weight, Columns& row) const
{
  const int node = nodeOf(point), number = node < 0 ? kPrescribed : dof_[4 * node + component];
  if (number >= 0)
    row.push(offset + number, weight);
}

void ChainPart::addTorque(int point, double torque)
{
  if (const int node = nodeOf(point); node >= 0)
    system_.gradient()[4 * node + 3] -= torque;
}

double ChainPart::moveTurn(int point) const
{
  const int node = nodeOf(point);
  return node < 0 ? 0.0 : system_.direction()[4 * node + 3];
}

int ChainPart::base(int point) const
{
  const int node = nodeOf(point);
  if (node < 0)
    return kPrescribed;
  const int number = dof_[4 * node];
  return number < 0 ? number : offset + number;
}

void ChainPart::addForce(int point, const Eigen::Vector3d& force)
{
  touched_ = true;
  if (const int node = nodeOf(point); node >= 0)
    Eigen::Map<Eigen::Vector3d>(system_.gradient() + 4 * node) -= force;
}

Eigen::Vector3d ChainPart::move(int point) const
{
  const int node = nodeOf(point);
  return node < 0 ? Eigen::Vector3d(Eigen::Vector3d::Zero())
                  : Eigen::Vector3d(Eigen::Map<const Eigen::Vector3d>(system_.direction() + 4 * node));
}

}   // namespace slender
