#include "coupled_chains.h"

namespace slender {

namespace {

/// Adds a stiffness between a node of a chain and the next one to its panels: the first one's panel has room for both.
/// A node of -1 is no unknown.
void addToPanels(ChainSystem& chain, const int (&node)[2], const double (&weight)[4], const Eigen::Matrix3d& stiffness)
{
  for (int p = 0; p < 2; ++p)
    if (node[p] >= 0)
      for (int c = 0; c < 3; ++c)
        for (int r = c; r < 3; ++r)
          chain.panels()[node[p]].diag[c][r] += weight[p] * weight[p] * stiffness(r, c);
  if (node[0] >= 0 && node[1] >= 0)
    for (int c = 0; c < 3; ++c)
      for (int r = 0; r < 3; ++r)
        chain.panels()[node[0]].below[c][r] += weight[0] * weight[1] * stiffness(r, c);
}

}   // namespace

// ---- contacts

void CoupledChains::makeRoom(const ContactTerm& term)
{
  const Key key{term.point[0], term.point[1], term.point[2], term.point[3], term.solid};
  const auto at = std::lower_bound(keys_.begin(), keys_.end(), key);
  if (at != keys_.end() && *at == key)
    return;
  keys_.insert(at, key);
  valid_ = false;
}

void CoupledChains::take(const std::vector<ContactTerm>& terms, const std::vector<ContactTerm>* more,
                         const std::vector<ContactRow>& rows)
{
  terms_ = {&terms, more};
  rows_ = &rows;
  for (Chain* chain : chains)
  {
    chain->own_terms.clear();
    chain->own_rows.clear();
  }
  for (const std::vector<ContactTerm>* list : terms_)
    for (std::size_t k = 0; list && k < list->size(); ++k)
    {
      const ContactTerm& term = (*list)[k];
      if (isOwn(term))
        points[term.point[0]].chain->own_terms.push_back(&term);
      else
        makeRoom(term);
    }
  for (const ContactRow& row : rows)
    if (row.point[2] < 0)   // of a segment and a solid
      points[row.point[0]].chain->own_rows.push_back(&row);
}

void CoupledChains::takeFirst(const std::vector<ContactTerm>& terms, const std::vector<ContactTerm>* more,
                              const std::vector<ContactRow>& rows)
{
  const bool valid = valid_;
  keys_before_.swap(keys_);
  keys_.clear();
  take(terms, more, rows);
  valid_ = valid && keys_ == keys_before_;
}

void CoupledChains::addForce(const ContactTerm& term)
{
  for (int p = 0; p < 4; ++p)
    if (term.point[p] >= 0)
      if (const Point& at = points[term.point[p]]; at.node >= 0)
        for (int c = 0; c < 3; ++c)
          at.chain->system->gradient()[4 * at.node + c] -= term.weight[p] * term.force[c];
}

/// Contacts with solids have no indefinite second derivatives.
void CoupledChains::evaluate(Chain& chain, bool with_hessian, const HessianShift& shift)
{
  ChainSystem& system = *chain.system;
  const bool alone = !chain.coupled && chain.own_terms.empty();
  chain.evaluation = alone ? system.evaluate(with_hessian, shift) : system.evaluateWhole(with_hessian);
  if (alone || chain.coupled)
    return;
  const auto nodesOf = [this](const int(&point)[4], int(&node)[2]) {
    for (int p = 0; p < 2; ++p)
      node[p] = points[point[p]].node;
  };
  int node[2];
  for (const ContactTerm* term : chain.own_terms)
  {
    addForce(*term);
    nodesOf(term->point, node);
    if (with_hessian)
      addToPanels(system, node, term->weight, term->stiffness);
  }
  if (!with_hessian)
  {
    system.closeGradient();
    return;
  }
  for (const ContactRow* row : chain.own_rows)
  {
    nodesOf(row->point, node);
    addToPanels(system, node, row->along, row->stiffness * row->normal * row->normal.transpose());
  }
  chain.evaluation.inertia = system.factorWhole(shift);
}

void CoupledChains::addEvaluations(RodEvaluation& sum) const
{
  for (const Chain* chain : chains)
  {
    const RodEvaluation& e = chain->evaluation;
    sum.stretch += e.stretch;
    sum.bend_twist += e.bend_twist;
    sum.potential += e.potential;
    sum.min_chi = std::min(sum.min_chi, e.min_chi);
    sum.max_strain = std::max(sum.max_strain, e.max_strain);
    if (!chain->coupled)
    {
      sum.inertia.negative += e.inertia.negative;
      sum.inertia.zero += e.inertia.zero;
    }
  }
}

void CoupledChains::closeGradients()
{
  for (Chain* chain : chains)
    if (chain->coupled)
      chain->system->closeGradient();
}

double CoupledChains::largestMove(const std::vector<ContactTerm>& terms) const
{
  double largest = 0.0;
  for (const ContactTerm& term : terms)
  {
    Eigen::Vector3d u = Eigen::Vector3d::Zero();
    for (int p = 0; p < 4; ++p)
      if (term.point[p] >= 0)
        if (const Point& at = points[term.point[p]]; at.node >= 0)
          u += term.weight[p] * Eigen::Map<const Eigen::Vector3d>(at.chain->system->direction() + 4 * at.node);
    largest = std::max(largest, u.norm());
  }
  return largest;
}

// ---- pattern

/// Calls f(a, b) for every place of the panels, row after row of each column: the numbers of its unknowns in the
/// matrix, or less than 0 where the chain has no such unknown.
template <class F>
void CoupledChains::forPanels(const Chain& chain, F&& f)
{
  const ChainSystem& system = *chain.system;
  for (int i = 0; i < system.nodes(); ++i)
    for (int c = 0; c < 4; ++c)
      for (int r = c; r < ChainSystem::kPanelRows; ++r)
      {
        const int a = chain.dof[4 * i + c], at = system.panelUnknown(i, r), b = at < 0 ? kPrescribed : chain.dof[at];
        f(a < 0 || b < 0 ? kPrescribed : chain.offset + a, chain.offset + b);
      }
}

void CoupledChains::beginPattern(int others)
{
  int unknowns = 0;
  for (Chain* chain : chains)
  {
    chain->offset = unknowns;
    if (chain->coupled)
      unknowns += chain->unknowns;
  }
  others_ = unknowns;
  matrix.begin(unknowns + others);
  for (const Chain* chain : chains)
    if (chain->coupled)
      forPanels(*chain, [this](int a, int b) {
        if (a >= 0)
          matrix.note(a, b);
      });
}

CouplingMatrix::Bases CoupledChains::basesOf(const int (&point)[4]) const
{
  CouplingMatrix::Bases bases;
  for (int p = 0; p < 4; ++p)
  {
    bases[p] = kPrescribed;
    if (point[p] < 0)
      continue;
    const Point& at = points[point[p]];
    if (at.node < 0)
      continue;
    const int number = at.chain->dof[4 * at.node];
    bases[p] = number < 0 ? number : at.chain->offset + number;
  }
  return bases;
}

void CoupledChains::endPattern()
{
  matrix.finish();
  valid_ = true;
  for (Chain* chain : chains)
  {
    chain->slots.clear();
    if (chain->coupled)
      forPanels(*chain, [&](int a, int b) { chain->slots.push_back(a < 0 ? -1 : matrix.index(a, b)); });
  }
}

// ---- values

void CoupledChains::assemble(const HessianShift& shift)
{
  matrix.clear();
  double* const values = matrix.values();
  for (const Chain* chain : chains)
  {
    if (!chain->coupled)
      continue;
    ChainSystem& system = *chain->system;
    const RodPanel* panels = system.panels();
    const int* slot = chain->slots.data();
    for (int i = 0; i < system.nodes(); ++i)
    {
      const auto shifts = system.diagonalShift(i, shift);
      for (int c = 0; c < 4; ++c)
        for (int r = c; r < ChainSystem::kPanelRows; ++r, ++slot)
          if (*slot >= 0)
            values[*slot] += ChainSystem::panelEntry(panels[i], c, r) + (r == c ? shifts[c == 3] : 0.0);
    }
  }
}

void CoupledChains::takeGradients()
{
  for (const Chain* chain : chains)
    if (chain->coupled)
      for (std::size_t u = 0; u < chain->dof.size(); ++u)
        if (chain->dof[u] >= 0)
          matrix.solution()[chain->offset + chain->dof[u]] = -chain->system->gradient()[u];
}

void CoupledChains::spread(Chain& chain) const
{
  double* const direction = chain.system->direction();
  for (std::size_t u = 0; u < chain.dof.size(); ++u)
    direction[u] = chain.dof[u] < 0 ? 0.0 : matrix.solution()[chain.offset + chain.dof[u]];
}

}   // namespace slender
