// Several parts and their contact as one system for Newton's method: forces, the shared matrix, and its solution.
#include <algorithm>
#include <iterator>

#include "island/equations_loops.h"

namespace slender {

// ---- contacts of the present trial

void Equations::makeRoom(const ContactTerm& term)
{
  const Key key{term.point[0], term.point[1],      term.point[2],     term.point[3],
                term.solid,    term.turn[0].point, term.turn[1].point};
  if (!std::binary_search(keys_.begin(), keys_.end(), key))
    new_keys_.push_back(key);
}

void Equations::takeNewKeys()
{
  if (new_keys_.empty())
    return;
  keys_valid_ = false;
  std::sort(new_keys_.begin(), new_keys_.end());
  merged_keys_.clear();
  std::merge(keys_.begin(), keys_.end(), new_keys_.begin(), std::unique(new_keys_.begin(), new_keys_.end()),
             std::back_inserter(merged_keys_));
  keys_.swap(merged_keys_);
  new_keys_.clear();
}

/// Sorts the contacts by parts, and makes room in the pattern for those that couple unknowns.
void Equations::take()
{
  for (Part* part : parts_)
  {
    part->own_terms.clear();
    part->own_rows.clear();
  }
  forTerms([&](const ContactTerm& term) {
    if (isOwn(term))
      partOf(term.point[0]).own_terms.push_back(&term);
    else
      makeRoom(term);
  });
  takeNewKeys();
  for (const ContactRow& row : contact_->rows())
    if (row.point[3] < 0)   // of a segment or a triangle and a solid
      partOf(row.point[0]).own_rows.push_back(&row);
}

/// The same for the first contacts of a substep. The pattern gets room for them alone, so that it follows from the
/// state and not from the steps before.
void Equations::takeFirst()
{
  const bool valid = keys_valid_;
  keys_before_.swap(keys_);
  keys_.clear();
  take();
  keys_valid_ = valid && keys_ == keys_before_;
}

void Equations::addForce(const ContactTerm& term)
{
  for (int p = 0; p < 4 && !term.carried; ++p)
    if (term.point[p] >= 0)
    {
      Part& part = partOf(term.point[p]);
      part.addForce(term.point[p] - part.first_point, term.share(p, term.force));
    }
  if (term.carried)
    carrierOf(term).addForceAt(term.position, term.force);
  if (RigidPart* body = bodyOf(term.solid))
    body->addForceAt(term.position, -term.force);
  forTurns(term, [&](Part& part, int point, const Eigen::Vector3d& column) {
    part.addTorque(point, column.dot(term.force));
  });
}

// ---- the pattern of the matrix

SharedMatrix::Bases Equations::basesOf(const int (&point)[4]) const
{
  SharedMatrix::Bases bases;
  for (int p = 0; p < 4; ++p)
    bases[p] = point[p] < 0 ? Part::kPrescribed : partOf(point[p]).base(point[p] - partOf(point[p]).first_point);
  return bases;
}

/// The unknowns of the turns of a term whose segments no body carries.
std::array<int, 2> Equations::turnsOf(const ContactTerm& term) const
{
  std::array<int, 2> unknowns{Part::kPrescribed, Part::kPrescribed};
  for (int k = 0; k < 2; ++k)
    if (const int point = term.turn[k].point; point >= 0)
    {
      Part::Columns row;
      partOf(point).addColumns(point - partOf(point).first_point, 3, 1.0, row);
      if (row.count > 0)
        unknowns[k] = row.index[0];
    }
  return unknowns;
}

/// Whether a contact is not one of points that have three unknowns each: a body carries one of them or is touched.
bool Equations::needsRows(const SharedMatrix::Bases& bases, int solid) const
{
  return bodyOf(solid) || std::any_of(bases.begin(), bases.end(), [](int base) { return base < Part::kPrescribed; });
}

/// Displacement of a contact's points against each other, one row per component.
void Equations::columnsOf(const ContactTerm& term, std::array<Part::Columns, 3>& rows) const
{
  for (int c = 0; c < 3; ++c)
  {
    rows[c].count = 0;
    if (term.carried)
      carrierOf(term).addColumnsAt(term.position, c, 1.0, rows[c]);
    for (int p = 0; p < 4 && !term.carried; ++p)
      if (term.point[p] >= 0)
      {
        const Part& part = partOf(term.point[p]);
        const Eigen::Vector3d weights = term.share(p, Eigen::Vector3d::Unit(c));
        for (int k = 0; k < 3; ++k)
          if (k == c || weights[k] != 0.0)
            part.addColumns(term.point[p] - part.first_point, k, weights[k], rows[c]);
      }
    if (const RigidPart* body = bodyOf(term.solid))
      body->addColumnsAt(term.position, c, -1.0, rows[c]);
    forTurns(term, [&](const Part& part, int point, const Eigen::Vector3d& column) {
      part.addColumns(point, 3, column[c], rows[c]);
    });
  }
}

/// The gap of a pair as the place of contact runs along the pair.
void Equations::columnsOf(const ContactRow& contact, bool whole, Part::Columns& row) const
{
  row.count = 0;
  for (int p = 0; p < 4; ++p)
  {
    if (contact.point[p] < 0)
      continue;
    const Part& part = partOf(contact.point[p]);
    const Eigen::Vector3d weights =
        contact.along[p] * contact.normal + (whole ? contact.across[p] : 0.0) * contact.turning;
    for (int c = 0; c < 3; ++c)
      part.addColumns(contact.point[p] - part.first_point, c, weights[c], row);
    if (const RigidPart* body = bodyOf(contact.solid))
      for (int c = 0; c < 3; ++c)
        body->addColumnsAt(points_.col(contact.point[p]), c, -weights[c], row);
  }
}

/// Calls f(part, first) for each part that has averages. `first` is the number of its first multiplier. Such parts are
/// always coupled.
template <class F>
void Equations::forAverages(F&& f) const
{
  int first = multipliers_;
  for (Part* part : parts_)
    if (part->averages())
    {
      f(*part, first);
      first += 3 * static_cast<int>(part->averages()->count());
    }
}

/// Calls f(multiplier, row) for each component of each point of each average. `row` is what the component adds to the
/// constraint of the multiplier. If a body carries the point, it has unknowns of the body.
template <class F>
void Equations::forConstraints(F&& f) const
{
  forAverages([&](Part& part, int first) {
    part.averages()->forEntries([&](Eigen::Index i, int point, double weight) {
      for (int c = 0; c < 3; ++c)
      {
        Part::Columns row;
        part.addColumns(point, c, weight, row);
        f(first + 3 * static_cast<int>(i) + c, row);
      }
    });
  });
}

/// Notes what parts couple by themselves, unless the matrix knows it already.
void Equations::noteParts()
{
  coupled_.clear();
  for (Part* part : parts_)
  {
    coupled_.push_back(part->coupled);
    part->coupled = part->joined() || part->averages();
  }
  for (const Key& key : keys_)
  {
    for (int p = 0; p < 4; ++p)
      if (key[p] >= 0)
        partOf(key[p]).coupled = true;
    if (RigidPart* body = bodyOf(key[4]))
      body->coupled = true;
  }
  findGroups();
  const bool same = std::equal(parts_.begin(), parts_.end(), coupled_.begin(),
                               [](const Part* part, char coupled) { return part->coupled == (coupled != 0); });
  if (parts_valid_ && same)
  {
    matrix_.beginAgain();
    return;
  }
  int unknowns = 0;
  for (Part* part : parts_)
  {
    part->offset = unknowns;
    unknowns += part->coupled ? part->unknowns() : 0;
  }
  multipliers_ = unknowns;
  forAverages([&](Part& part, int) { unknowns += 3 * static_cast<int>(part.averages()->count()); });
  matrix_.begin(unknowns, unknowns - multipliers_);
  for (Part* part : parts_)
    if (part->coupled)
      part->notePattern(matrix_);
  for (int multiplier = multipliers_; multiplier < unknowns; ++multiplier)
    matrix_.note(multiplier, multiplier);
  forConstraints([&](int multiplier, const Part::Columns& row) {
    for (int k = 0; k < row.count; ++k)
      matrix_.note(row.index[k], multiplier);
  });
  matrix_.keepNoted();
  parts_valid_ = true;
}

void Equations::findGroups()
{
  groups_.begin(static_cast<int>(parts_.size()));
  const Part* joined = nullptr;
  for (const Part* part : parts_)
    if (part->joined())
    {
      groups_.unite(part->number, (joined ? joined : part)->number);
      joined = part;
    }
  for (const Key& key : keys_)
  {
    const int first = partOf(key[0]).number;
    for (int p = 1; p < 4; ++p)
      if (key[p] >= 0)
        groups_.unite(first, partOf(key[p]).number);
    if (const RigidPart* body = bodyOf(key[4]))
      groups_.unite(first, body->number);
  }
}

void Equations::buildPattern()
{
  noteParts();
  for (const Key& key : keys_)
  {
    ContactTerm term;
    std::copy_n(key.begin(), 4, term.point);
    term.solid = key[4];
    for (int k = 0; k < 2; ++k)
      term.turn[k].point = key[5 + k];
    const SharedMatrix::Bases bases = basesOf(term.point);
    if (term.turn[0].point < 0 && term.turn[1].point < 0 && !needsRows(bases, term.solid))
    {
      matrix_.noteBases(bases);
      continue;
    }
    std::array<Part::Columns, 3> rows;
    columnsOf(term, rows);
    matrix_.noteRows(rows.data(), 3);
  }
  matrix_.finish(chooseSolver(), masses_);
  if (matrix_.solver() == SharedMatrix::Solver::sweeps)
    unsettle();   // Sweeps cannot leave unknowns out.
  keys_valid_ = true;
  forAllParts([&](Part& part) {
    if (part.coupled)
      part.findEntries(matrix_);
  });
}

SharedMatrix::Solver Equations::chooseSolver()
{
  return solver == IslandSolver::automatic && sweepsPay() ? SharedMatrix::Solver::sweeps
                                                          : SharedMatrix::Solver::cholesky;
}

/// Returns whether sweeps over points are the fastest solver. They are faster than a factorisation for cloth of any
/// size, but they converge slowly for rods and for piles of bodies. Small matrices are factored, which solves them to
/// round-off at little cost.
bool Equations::sweepsPay()
{
  constexpr int kLeastUnknowns = 300, kTriplesPerBody = 30;
  masses_.clear();
  for (const Part* part : parts_)
    if (part->coupled)
      part->addTriples(masses_);
  const auto triples = static_cast<int>(masses_.size());
  const auto bodies = static_cast<int>(std::count(masses_.begin(), masses_.end(), 0.0));
  return 3 * triples == multipliers_ && multipliers_ >= kLeastUnknowns && triples >= kTriplesPerBody * bodies;
}

// ---- the matrix

/// `whole`: with the part of the contacts' second derivatives that may be negative.
void Equations::assemble(const HessianShift& shift, bool whole)
{
  matrix_.clear();
  forParts([&](Part& part) {
    if (part.coupled && !part.joined())
      part.addHessian(matrix_, shift);
  });
  for (Part* part : parts_)   // Joints add to entries of both parts.
    if (part->coupled && part->joined() && !part->settled)
      part->addHessian(matrix_, shift);
  forConstraints([&](int multiplier, const Part::Columns& row) {
    for (int k = 0; k < row.count; ++k)
      matrix_.add(row.index[k], multiplier, row.value[k]);
  });
  if (!contact_)
    return;
  // The rows of a term have its points, and follow in the order of terms.
  const ContactRow* row = contact_->rows().data();
  const ContactRow* const end = row + contact_->rows().size();
  forTerms([&](const ContactTerm& term) {
    const ContactRow* const first = row;
    while (row < end && row - first < SharedMatrix::kMostRows && row->solid == term.solid &&
           std::equal(row->point, row->point + 4, term.point))
      ++row;
    if (const Part& part = partOf(term.point[0]); part.coupled && !part.settled)
      addTerm(term, first, static_cast<int>(row - first), whole);
  });
}

void Equations::addTerm(const ContactTerm& term, const ContactRow* rows, int count, bool whole)
{
  const SharedMatrix::Bases bases = basesOf(term.point);
  if (!needsRows(bases, term.solid))
  {
    term.turns() ? matrix_.addTurningTerm(term, bases, turnsOf(term))
                 : matrix_.addTerm(term, rows, count, bases, whole);
    return;
  }
  std::array<Part::Columns, 3> columns;
  columnsOf(term, columns);
  matrix_.addRows(columns.data(), 3, whole ? Eigen::Matrix3d(term.stiffness + term.geometric) : term.stiffness);
  for (int n = 0; n < count; ++n)
  {
    columnsOf(rows[n], whole, columns[0]);
    matrix_.addRows(columns.data(), 1, rows[n].stiffness * Eigen::Matrix3d::Identity());
  }
}

bool Equations::factor(const HessianShift& shift)
{
  for (const Part* part : parts_)
    if (part->coupled)
    {
      matrix_.setIdle(part->offset, part->unknowns(), part->settled);
      part->takeGradient(matrix_.solution());
    }
  std::fill(matrix_.solution() + multipliers_, matrix_.solution() + matrix_.unknowns(), 0.0);
  const auto assembled = [&](bool whole) { assemble(shift, whole); };
  return exact_ ? matrix_.factorExactly(assembled) : matrix_.factor(contact_ && !contact_->terms().empty(), assembled);
}

RodEvaluation Equations::evaluate(bool with_hessian, const HessianShift& shift)
{
  RodEvaluation of_surfaces;
  if (with_hessian)
    shift_ = shift;
  if (contact_)
  {
    gather(points_, poses_);
    forParts([&](const Part& part) {
      part.gatherTurns(turns_);
      turns_.segment(part.first_point, part.points()) -= turns_begin_.segment(part.first_point, part.points());
    });
    of_surfaces.potential = contact_->evaluate(points_, poses_, with_hessian, &turns_);
    if (!std::isfinite(of_surfaces.potential))
      return of_surfaces;
    if (pushing_)
      contact_->pushTerms({points_, points_end_, poses_, poses_end_});
    if (attraction_)
      of_surfaces.potential += attraction_->evaluate(points_, with_hessian);
    take();
    wake(contact_->pointsOfChanges());
  }
  if (!parts_valid_ || !keys_valid_)
    buildPattern();
  wakeGroups();
  RodEvaluation sum = evaluateParts(with_hessian, shift);
  sum.potential += of_surfaces.potential;
  if (with_hessian && matrix_.unknowns() > 0)
    sum.inertia.negative += !factor(shift);
  return sum;
}

/// Computes the energies and gradients of the parts, with the forces of the present contacts. Returns the sum of the
/// energies without that of contact.
RodEvaluation Equations::evaluateParts(bool with_hessian, const HessianShift& shift)
{
  RodEvaluation sum;
  forParts([&](Part& part) { part.evaluate(with_hessian, shift); });
  for (const Part* part : parts_)
  {
    const RodEvaluation& e = part->evaluation;
    sum.stretch += e.stretch;
    sum.bend_twist += e.bend_twist;
    sum.potential += e.potential;
    sum.min_chi = std::min(sum.min_chi, e.min_chi);
    sum.max_strain = std::max(sum.max_strain, e.max_strain);
    if (!part->coupled)
    {
      sum.inertia.negative += e.inertia.negative;
      sum.inertia.zero += e.inertia.zero;
    }
  }
  forTerms([&](const ContactTerm& term) {
    if (const Part& part = partOf(term.point[0]); !part.settled && (part.coupled || !isOwn(term)))
      addForce(term);
  });
  for (Part* part : parts_)
    if (!part->settled)
      part->passGradient();
  for (Part* part : parts_)
    if (part->coupled && !part->settled)
      part->closeGradient();
  return sum;
}

void Equations::solve()
{
  by_newton_ = shift_.none();
  for (Part* part : parts_)
    part->has_direction = !part->settled;
  matrix_.solve();
  linear_iterations_ += matrix_.linearIterations();
  forAverages([&](Part& part, int first) {
    if (!part.settled)
      part.averages()->addMultipliers(matrix_.solution() + first);
  });
  forParts([](Part& part) {
    if (!part.coupled)
      part.solve();
  });
  spread();
  if (contact_)
    measureContacts();
}

void Equations::solveAgain()
{
  for (Part* part : parts_)
    part->coupled ? part->takeGradient(matrix_.solution()) : part->solveAgain();
  std::fill(matrix_.solution() + multipliers_, matrix_.solution() + matrix_.unknowns(), 0.0);
  matrix_.solve();
  spread();
}

/// The solution of the matrix becomes the directions of the coupled parts.
void Equations::spread()
{
  forParts([&](Part& part) {
    if (part.coupled)
      part.takeDirection(matrix_.solution());
  });
}

}   // namespace slender
