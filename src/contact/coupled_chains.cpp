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
  unknowns_ = 0;
  for (Chain* chain : chains)
  {
    chain->offset = unknowns_;
    if (chain->coupled)
      unknowns_ += chain->unknowns;
  }
  others_ = unknowns_;
  unknowns_ += others;
  solution_.assign(unknowns_, 0.0);
  valid_ = true;
  if (static_cast<int>(columns_.size()) < unknowns_)
    columns_.resize(unknowns_);
  for (int u = 0; u < unknowns_; ++u)
    columns_[u].clear();
  for (const Chain* chain : chains)
    if (chain->coupled)
      forPanels(*chain, [this](int a, int b) {
        if (a >= 0)
          note(a, b);
      });
}

void CoupledChains::notePairs(const Columns& a, const Columns& b)
{
  for (int i = 0; i < a.count; ++i)
    for (int j = 0; j < b.count; ++j)
      note(a.index[i], b.index[j]);
}

std::array<int, 4> CoupledChains::basesOf(const int (&point)[4]) const
{
  std::array<int, 4> bases;
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

void CoupledChains::noteBases(const std::array<int, 4>& bases)
{
  for (int i = 0; i < 4; ++i)
    for (int j = 0; j <= i; ++j)
      if (bases[i] >= 0 && bases[j] >= 0)
        for (int r = 0; r < 3; ++r)
          for (int c = 0; c < 3; ++c)
            note(bases[i] + r, bases[j] + c);
}

void CoupledChains::endPattern()
{
  std::vector<int> starts{0}, rows;
  for (int u = 0; u < unknowns_; ++u)
  {
    std::vector<int>& column = columns_[u];
    std::sort(column.begin(), column.end());
    rows.insert(rows.end(), column.begin(), std::unique(column.begin(), column.end()));
    starts.push_back(static_cast<int>(rows.size()));
  }
  if (unknowns_ > 0)
    matrix_.setPattern(unknowns_, std::move(starts), std::move(rows));
  for (Chain* chain : chains)
  {
    chain->slots.clear();
    if (chain->coupled)
      forPanels(*chain, [&](int a, int b) {
        chain->slots.push_back(a < 0 ? -1 : matrix_.index(std::max(a, b), std::min(a, b)));
      });
  }
}

// ---- values

void CoupledChains::assemble(const HessianShift& shift)
{
  double* values = matrix_.values();
  std::fill_n(values, matrix_.rows().size(), 0.0);
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

void CoupledChains::addPair(const Columns& a, const Columns& b, double value)
{
  for (int i = 0; i < a.count; ++i)
    for (int j = 0; j < b.count; ++j)
      add(a.index[i], b.index[j], (a.index[i] == b.index[j] ? 2.0 : 1.0) * a.value[i] * b.value[j] * value);
}

void CoupledChains::addSquare(const Columns& a, double value)
{
  for (int i = 0; i < a.count; ++i)
    for (int j = 0; j <= i; ++j)
      add(a.index[i], a.index[j], (i != j && a.index[i] == a.index[j] ? 2.0 : 1.0) * a.value[i] * a.value[j] * value);
}

/// block(i, j), 3 x 3, for the points i and j. A point's three rows follow each other.
template <class Block>
void CoupledChains::addBlocks(const std::array<int, 4>& bases, Block&& block)
{
  double* values = matrix_.values();
  for (int i = 0; i < 4; ++i)
    for (int j = 0; j < 4; ++j)
      if (bases[i] >= bases[j] && bases[j] >= 0)
      {
        const Eigen::Matrix3d b = block(i, j);
        for (int c = 0; c < 3; ++c)
        {
          const int first = i == j ? c : 0, at = matrix_.index(bases[i] + first, bases[j] + c);
          for (int r = first; r < 3; ++r)
            values[at + r - first] += b(r, c);
        }
      }
}

void CoupledChains::addTerm(const ContactTerm& term, const std::array<int, 4>& bases, bool whole)
{
  const Eigen::Matrix3d stiffness = whole ? Eigen::Matrix3d(term.stiffness + term.geometric) : term.stiffness;
  addBlocks(bases, [&](int i, int j) { return Eigen::Matrix3d(term.weight[i] * term.weight[j] * stiffness); });
}

void CoupledChains::addRow(const ContactRow& row, const std::array<int, 4>& bases, bool whole)
{
  Eigen::Vector3d r[4];
  for (int k = 0; k < 4; ++k)
    r[k] = row.along[k] * row.normal + (whole ? row.across[k] : 0.0) * row.turning;
  addBlocks(bases, [&](int i, int j) { return Eigen::Matrix3d(row.stiffness * r[i] * r[j].transpose()); });
}

void CoupledChains::takeGradients()
{
  for (const Chain* chain : chains)
    if (chain->coupled)
      for (std::size_t u = 0; u < chain->dof.size(); ++u)
        if (chain->dof[u] >= 0)
          solution_[chain->offset + chain->dof[u]] = -chain->system->gradient()[u];
}

void CoupledChains::spread(Chain& chain) const
{
  double* const direction = chain.system->direction();
  for (std::size_t u = 0; u < chain.dof.size(); ++u)
    direction[u] = chain.dof[u] < 0 ? 0.0 : solution_[chain.offset + chain.dof[u]];
}

}   // namespace slender
