// Threads that touch as one system for minimize().
#include "thread_contact.h"

#include <algorithm>
#include <cmath>

namespace slender {

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
      const int number = system.held(u) ? CoupledChains::kPrescribed : part.unknowns++;
      same = same && part.dof[u] == number;
      part.dof[u] = number;
    }
    if (!same)
      coupled_.invalidatePattern();
    for (int i = 0; i < part.thread->work.nodes(); ++i)
      coupled_.points[part.point + i] = {&part, part.thread->inSystem(i)};
  }
}

void ThreadContact::buildPattern()
{
  for (std::size_t p = 0; p < part_count_; ++p)
    parts_[p].coupled = false;
  for (const CoupledChains::Key& key : coupled_.room())
    for (int k = 0; k < 4; ++k)
      if (key[k] >= 0)
        coupled_.points[key[k]].chain->coupled = true;
  coupled_.beginPattern(0);
  for (const CoupledChains::Key& key : coupled_.room())
    coupled_.matrix.noteBases(coupled_.basesOf({key[0], key[1], key[2], key[3]}));
  coupled_.endPattern();
}

/// `whole`: with the part of the contacts' second derivatives that may be negative.
void ThreadContact::assemble(const HessianShift& shift, bool whole)
{
  coupled_.assemble(shift);
  coupled_.forTerms(
      [&](const ContactTerm& term) { coupled_.matrix.addTerm(term, coupled_.basesOf(term.point), whole); });
  coupled_.forRows([&](const ContactRow& row) { coupled_.matrix.addRow(row, coupled_.basesOf(row.point), whole); });
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
  coupled_.take(contact_.terms(), attractions(), contact_.rows());
  if (!coupled_.patternValid())
    buildPattern();
  for (std::size_t p = 0; p < part_count_; ++p)
    coupled_.evaluate(parts_[p], with_hessian, shift);
  coupled_.addEvaluations(sum);
  coupled_.forTerms([&](const ContactTerm& term) { coupled_.addForce(term); });
  if (with_hessian && coupled_.matrix.unknowns() > 0)
    sum.inertia.negative += !coupled_.factor([&](bool whole) { assemble(shift, whole); });
  coupled_.closeGradients();
  return sum;
}

void ThreadContact::solve()
{
  coupled_.takeGradients();
  coupled_.matrix.solve();
  for (std::size_t p = 0; p < part_count_; ++p)
    if (parts_[p].coupled)
      coupled_.spread(parts_[p]);
    else
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
  double largest = 0.0;
  for (std::size_t p = 0; p < part_count_; ++p)
    largest = std::max(largest, systemOf(parts_[p]).incrementSize());
  // a barrier is resolved when its gaps are
  const double at_contact = coupled_.largestMove(contact_.terms());
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
  for (const auto* terms : {&contact_.terms(), &merging_.terms()})
    for (const ContactTerm& term : *terms)
      largest = std::max(largest, term.force.norm());
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
