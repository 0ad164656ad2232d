// Threads that touch as one system for minimize().
#include "thread_contact.h"

#include <algorithm>
#include <cmath>

namespace slender {

int ThreadContact::dofOf(int point) const
{
  const Part& part = parts_[point_part_[point]];
  const int k = part.thread->inSystem(point - part.point);
  return k < 0 ? -1 : part.dof[4 * k];
}

/// Numbers the unknowns; the pattern holds as long as they stay the same.
void ThreadContact::mapUnknowns()
{
  for (std::size_t p = 0; p < part_count_; ++p)
  {
    Part& part = parts_[p];
    const ChainSystem& system = part.thread->system;
    const int count = 4 * system.nodes();
    bool same = static_cast<int>(part.dof.size()) == count;
    part.dof.resize(count);
    part.unknowns = 0;
    for (int u = 0; u < count; ++u)
    {
      const int number = system.held(u) ? -1 : part.unknowns++;
      same = same && part.dof[u] == number;
      part.dof[u] = number;
    }
    pattern_valid_ = pattern_valid_ && same;
  }
}

/// Makes room for the present terms; true when there was none for some of them.
bool ThreadContact::takeKeys()
{
  bool grown = false;
  forTerms([&](const ContactTerm& term) {
    std::array<int, 4> key;
    std::copy_n(term.point, 4, key.begin());
    const auto at = std::lower_bound(keys_.begin(), keys_.end(), key);
    if (at == keys_.end() || *at != key)
    {
      keys_.insert(at, key);
      grown = true;
    }
  });
  return grown;
}

void ThreadContact::buildPattern()
{
  for (std::size_t p = 0; p < part_count_; ++p)
    parts_[p].touched = false;
  for (const auto& key : keys_)
    for (int k = 0; k < 4; ++k)
      if (key[k] >= 0)
        parts_[point_part_[key[k]]].touched = true;
  unknowns_ = 0;
  for (std::size_t p = 0; p < part_count_; ++p)
  {
    parts_[p].offset = unknowns_;
    if (parts_[p].touched)
      unknowns_ += parts_[p].unknowns;
  }
  pattern_valid_ = true;
  rhs_.assign(unknowns_, 0.0);
  if (unknowns_ == 0)
    return;

  if (static_cast<int>(columns_.size()) < unknowns_)
    columns_.resize(unknowns_);
  for (int u = 0; u < unknowns_; ++u)
    columns_[u].clear();
  const auto note = [&](int a, int b) { columns_[std::min(a, b)].push_back(std::max(a, b)); };
  const auto forPanels = [&](const Part& part, auto&& f) {
    const ChainSystem& system = systemOf(part);
    for (int i = 0; i < system.nodes(); ++i)
      for (int c = 0; c < 4; ++c)
        for (int r = c; r < ChainSystem::kPanelRows; ++r)
        {
          const int a = part.dof[4 * i + c], at = system.panelUnknown(i, r), b = at < 0 ? -1 : part.dof[at];
          f(a < 0 || b < 0 ? -1 : part.offset + a, part.offset + b);
        }
  };
  for (std::size_t p = 0; p < part_count_; ++p)
    if (parts_[p].touched)
      forPanels(parts_[p], [&](int a, int b) {
        if (a >= 0)
          note(a, b);
      });
  for (const auto& key : keys_)
  {
    int base[4];
    for (int k = 0; k < 4; ++k)
    {
      base[k] = key[k] < 0 ? -1 : dofOf(key[k]);
      if (base[k] >= 0)
        base[k] += parts_[point_part_[key[k]]].offset;
    }
    for (int i = 0; i < 4; ++i)
      for (int j = 0; j <= i; ++j)
        if (base[i] >= 0 && base[j] >= 0)
          for (int r = 0; r < 3; ++r)
            for (int c = 0; c < 3; ++c)
              note(base[i] + r, base[j] + c);
  }
  std::vector<int> starts{0}, rows;
  for (int u = 0; u < unknowns_; ++u)
  {
    std::vector<int>& column = columns_[u];
    std::sort(column.begin(), column.end());
    rows.insert(rows.end(), column.begin(), std::unique(column.begin(), column.end()));
    starts.push_back(static_cast<int>(rows.size()));
  }
  matrix_.setPattern(unknowns_, std::move(starts), std::move(rows));
  for (std::size_t p = 0; p < part_count_; ++p)
  {
    Part& part = parts_[p];
    part.slots.clear();
    if (part.touched)
      forPanels(part, [&](int a, int b) {
        part.slots.push_back(a < 0 ? -1 : matrix_.index(std::max(a, b), std::min(a, b)));
      });
  }
}

/// `whole`: with the part of the contacts' second derivatives that may be negative.
void ThreadContact::assemble(const HessianShift& shift, bool whole)
{
  std::fill_n(matrix_.values(), matrix_.rows().size(), 0.0);
  double* values = matrix_.values();
  for (std::size_t p = 0; p < part_count_; ++p)
  {
    const Part& part = parts_[p];
    if (!part.touched)
      continue;
    ChainSystem& system = part.thread->system;
    const RodPanel* panels = system.panels();
    const int* slot = part.slots.data();
    for (int i = 0; i < system.nodes(); ++i)
    {
      const auto shifts = system.diagonalShift(i, shift);
      for (int c = 0; c < 4; ++c)
        for (int r = c; r < ChainSystem::kPanelRows; ++r, ++slot)
          if (*slot >= 0)
            values[*slot] += ChainSystem::panelEntry(panels[i], c, r) + (r == c ? shifts[c == 3] : 0.0);
    }
  }
  // of four points, block(i, j) for i, j
  const auto add = [&](const int(&points)[4], auto&& block) {
    int base[4];
    for (int k = 0; k < 4; ++k)
    {
      base[k] = points[k] < 0 ? -1 : dofOf(points[k]);
      if (base[k] >= 0)
        base[k] += parts_[point_part_[points[k]]].offset;
    }
    for (int i = 0; i < 4; ++i)
      for (int j = 0; j < 4; ++j)
        if (base[i] >= base[j] && base[j] >= 0)   // a node's three rows follow each other
        {
          const Eigen::Matrix3d b = block(i, j);
          for (int c = 0; c < 3; ++c)
          {
            const int first = i == j ? c : 0, at = matrix_.index(base[i] + first, base[j] + c);
            for (int r = first; r < 3; ++r)
              values[at + r - first] += b(r, c);
          }
        }
  };
  forTerms([&](const ContactTerm& term) {
    const Eigen::Matrix3d stiffness = whole ? Eigen::Matrix3d(term.stiffness + term.geometric) : term.stiffness;
    add(term.point, [&](int i, int j) { return Eigen::Matrix3d(term.weight[i] * term.weight[j] * stiffness); });
  });
  for (const ContactRow& row : contact_.rows())
  {
    Eigen::Vector3d r[4];
    for (int k = 0; k < 4; ++k)
      r[k] = row.along[k] * row.normal + (whole ? row.across[k] : 0.0) * row.turning;
    add(row.point, [&](int i, int j) { return Eigen::Matrix3d(row.stiffness * r[i] * r[j].transpose()); });
  }
}

bool ThreadContact::factor(const HessianShift& shift)
{
  if (!contact_.terms().empty() && whole_.due())
  {
    assemble(shift, true);
    const bool definite = matrix_.factor();
    whole_.tried(definite);
    if (definite)
      return true;
  }
  assemble(shift, false);
  return matrix_.factor();
}

RodEvaluation ThreadContact::evaluate(bool with_hessian, const HessianShift& shift)
{
  RodEvaluation sum;
  gather(points_);
  sum.potential = contact_.evaluate(points_, solids_, with_hessian);
  if (!std::isfinite(sum.potential))
    return sum;
  if (merges_)
    sum.potential += merging_.evaluate(points_, with_hessian);
  if (takeKeys() || !pattern_valid_)
    buildPattern();
  for (std::size_t p = 0; p < part_count_; ++p)
  {
    Part& part = parts_[p];
    ChainSystem& system = part.thread->system;
    const RodEvaluation e = part.touched ? system.evaluateWhole(with_hessian) : system.evaluate(with_hessian, shift);
    sum.stretch += e.stretch;
    sum.bend_twist += e.bend_twist;
    sum.potential += e.potential;
    sum.min_chi = std::min(sum.min_chi, e.min_chi);
    sum.max_strain = std::max(sum.max_strain, e.max_strain);
    if (!part.touched)
    {
      sum.inertia.negative += e.inertia.negative;
      sum.inertia.zero += e.inertia.zero;
    }
  }
  forTerms([&](const ContactTerm& term) {
    for (int k = 0; k < 4; ++k)
      if (term.point[k] >= 0)
      {
        const Part& part = parts_[point_part_[term.point[k]]];
        const int node = part.thread->inSystem(term.point[k] - part.point);
        if (node >= 0)
          for (int c = 0; c < 3; ++c)
            part.thread->system.gradient()[4 * node + c] -= term.weight[k] * term.force[c];
      }
  });
  if (with_hessian && unknowns_ > 0)
    sum.inertia.negative += !factor(shift);
  for (std::size_t p = 0; p < part_count_; ++p)
    if (parts_[p].touched)
      parts_[p].thread->system.closeGradient();
  return sum;
}

void ThreadContact::solve()
{
  const auto forDofs = [&](auto&& f) {
    for (std::size_t p = 0; p < part_count_; ++p)
      if (parts_[p].touched)
        for (std::size_t u = 0; u < parts_[p].dof.size(); ++u)
          f(parts_[p], u);
  };
  if (unknowns_ > 0)
  {
    forDofs([&](Part& part, std::size_t u) {
      if (part.dof[u] >= 0)
        rhs_[part.offset + part.dof[u]] = -part.thread->system.gradient()[u];
    });
    matrix_.solve(rhs_.data());
  }
  forDofs([&](Part& part, std::size_t u) {
    part.thread->system.direction()[u] = part.dof[u] < 0 ? 0.0 : rhs_[part.offset + part.dof[u]];
  });
  for (std::size_t p = 0; p < part_count_; ++p)
    if (!parts_[p].touched)
      parts_[p].thread->system.solve();
}

void ThreadContact::moveAlong(double alpha)
{
  for (std::size_t p = 0; p < part_count_; ++p)
    parts_[p].thread->system.moveAlong(alpha);
}

void ThreadContact::accept()
{
  for (std::size_t p = 0; p < part_count_; ++p)
    parts_[p].thread->system.accept();
  points_base_ = points_;
  solids_base_ = solids_;
}

void ThreadContact::saveBase()
{
  for (std::size_t p = 0; p < part_count_; ++p)
    parts_[p].thread->system.saveBase();
}

void ThreadContact::restoreBase()
{
  for (std::size_t p = 0; p < part_count_; ++p)
    parts_[p].thread->system.restoreBase();
}

double ThreadContact::stepLimit()
{
  double alpha = 1.0;
  for (std::size_t p = 0; p < part_count_; ++p)
    alpha = std::min(alpha, systemOf(parts_[p]).stepLimit());
  moveAlong(alpha);
  points_end_ = points_;   // what lies on the floor beyond the systems
  gather(points_end_);
  return alpha * contact_.stepLimit(points_base_, points_end_, solids_, solids_);
}

double ThreadContact::incrementSize() const
{
  double largest = 0.0, at_contact = 0.0;
  for (std::size_t p = 0; p < part_count_; ++p)
    largest = std::max(largest, systemOf(parts_[p]).incrementSize());
  for (const ContactTerm& term : contact_.terms())   // a barrier is resolved when its gaps are
  {
    Eigen::Vector3d u = Eigen::Vector3d::Zero();
    for (int k = 0; k < 4; ++k)
      if (term.point[k] >= 0)
      {
        const Part& part = parts_[point_part_[term.point[k]]];
        if (const int node = part.thread->inSystem(term.point[k] - part.point); node >= 0)
          u += term.weight[k] * Eigen::Map<const Eigen::Vector3d>(part.thread->system.direction() + 4 * node);
      }
    at_contact = std::max(at_contact, u.norm());
  }
  return at_contact > 0.0 ? std::max(largest, tolerance_ * at_contact / (gap_tolerance_ * contact_.smallestGap()))
                          : largest;
}

double ThreadContact::slope() const
{
  double sum = 0.0;
  for (std::size_t p = 0; p < part_count_; ++p)
    sum += systemOf(parts_[p]).slope();
  return sum;
}

double ThreadContact::residual() const
{
  double largest = 0.0;
  for (std::size_t p = 0; p < part_count_; ++p)
    largest = std::max(largest, systemOf(parts_[p]).residual());
  return largest;
}

double ThreadContact::forceScale() const
{
  double largest = 0.0;
  for (std::size_t p = 0; p < part_count_; ++p)
    largest = std::max(largest, systemOf(parts_[p]).forceScale());
  forTerms([&](const ContactTerm& term) { largest = std::max(largest, term.force.norm()); });
  return largest;
}

double ThreadContact::noiseLevel() const
{
  double largest = 0.0;
  for (std::size_t p = 0; p < part_count_; ++p)
    largest = std::max(largest, systemOf(parts_[p]).noiseLevel());
  return largest;
}

}   // namespace slender
