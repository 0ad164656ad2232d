// Rods, bodies and contact as one system for minimize().
#include "coupled_system.h"

#include <algorithm>
#include <cmath>

#ifdef _OPENMP
#include <omp.h>
#endif

namespace slender {

template <class F>
void CoupledSystem::forRods(F&& f)
{
  const int count = static_cast<int>(parts_.size());
#ifdef _OPENMP
#pragma omp parallel for schedule(dynamic, 4) if (parallel_ && threads != 1) \
    num_threads(threads > 0 ? threads : omp_get_max_threads())
#endif
  for (int r = 0; r < count; ++r)
    f(parts_[r]);
}

RodEvaluation CoupledSystem::evaluate(bool with_hessian, const HessianShift& shift)
{
  RodEvaluation sum;
  if (contact_)
  {
    gather(points_, solids_);
    sum.potential = contact_->evaluate(points_, solids_, with_hessian);
    if (!std::isfinite(sum.potential))
      return sum;
    if (takeKeys())
      pattern_valid_ = false;
    findOwnTerms();
  }
  if (!pattern_valid_)
    buildPattern();
  forRods([&](RodPart& part) {
    RodSystem& system = part.rod->system;
    if (part.coupled)
      part.evaluation = system.evaluateWhole(with_hessian);
    else
      part.evaluation =
          part.own_terms.empty() ? system.evaluate(with_hessian, shift) : evaluateWithOwn(part, with_hessian, shift);
  });
  for (const RodPart& part : parts_)
  {
    const RodEvaluation& e = part.evaluation;
    sum.stretch += e.stretch;
    sum.bend_twist += e.bend_twist;
    sum.potential += e.potential;
    sum.min_chi = std::min(sum.min_chi, e.min_chi);
    sum.max_strain = std::max(sum.max_strain, e.max_strain);
    if (!part.coupled)
    {
      sum.inertia.negative += e.inertia.negative;
      sum.inertia.zero += e.inertia.zero;
    }
  }
  for (BodySystem& body : bodies_)
  {
    body.evaluate(with_hessian);
    sum.potential += body.energy();
  }
  reduceGradient();
  if (with_hessian && unknowns_ > 0)
    sum.inertia.negative += !factor(shift);
  for (RodPart& part : parts_)
    if (part.coupled)
      part.rod->system.closeGradient();
  return sum;
}

/// Whether a contact couples no more than two neighbouring nodes of a rod: a segment touches what moves as prescribed.
bool CoupledSystem::isOwn(const ContactTerm& term) const
{
  if (exact_ || term.solid < 0)
    return false;
  const int obstacles = static_cast<int>(obstacles_.size());
  return term.solid < obstacles || simulated_[model_.contact.bodies[term.solid - obstacles].body] < 0;
}

/// Sorts contacts with solids by rods, for rods with band matrices of their own.
void CoupledSystem::findOwnTerms()
{
  for (RodPart& part : parts_)
  {
    part.own_terms.clear();
    part.own_rows.clear();
  }
  const std::vector<ContactTerm>& terms = contact_->terms();
  for (std::size_t k = 0; k < terms.size(); ++k)
    if (isOwn(terms[k]))
      parts_[point_part_[terms[k].point[0]]].own_terms.push_back(static_cast<int>(k));
  const std::vector<ContactRow>& rows = contact_->rows();
  for (std::size_t k = 0; k < rows.size(); ++k)
    if (rows[k].point[2] < 0)   // of a segment and a solid
      parts_[point_part_[rows[k].point[0]]].own_rows.push_back(static_cast<int>(k));
}

/// Of a rod with its own band matrix and contacts that couple nothing. A segment's second node follows its first one,
/// so that the first one's panel has room for both. Contacts with solids have no indefinite second derivatives.
RodEvaluation CoupledSystem::evaluateWithOwn(RodPart& part, bool with_hessian, const HessianShift& shift)
{
  RodSystem& system = part.rod->system;
  RodEvaluation e = system.evaluateWhole(with_hessian);
  const int n = part.rod->model->nodes();
  const auto add = [&](int point, const double(&weight)[4], const Eigen::Matrix3d& stiffness) {
    const int first = point - part.point, second = (first + 1) % n;
    RodPanel& a = system.panels()[first];
    RodPanel& b = system.panels()[second];
    for (int c = 0; c < 3; ++c)
      for (int r = 0; r < 3; ++r)
      {
        if (r >= c)
        {
          a.diag[c][r] += weight[0] * weight[0] * stiffness(r, c);
          b.diag[c][r] += weight[1] * weight[1] * stiffness(r, c);
        }
        a.below[c][r] += weight[0] * weight[1] * stiffness(r, c);
      }
  };
  for (const int k : part.own_terms)
  {
    const ContactTerm& term = contact_->terms()[k];
    for (int p = 0; p < 2; ++p)
      for (int c = 0; c < 3; ++c)
        system.gradient()[4 * (term.point[p] - part.point) + c] -= term.weight[p] * term.force[c];
    if (with_hessian)
      add(term.point[0], term.weight, term.stiffness);
  }
  if (!with_hessian)
  {
    system.closeGradient();
    return e;
  }
  for (const int k : part.own_rows)
  {
    const ContactRow& row = contact_->rows()[k];
    add(row.point[0], row.along, row.stiffness * row.normal * row.normal.transpose());
  }
  e.inertia = system.factorWhole(shift);
  return e;
}

bool CoupledSystem::factor(const HessianShift& shift)
{
  if (exact_)
  {
    assemble(shift, true);
    return matrix_.factor();
  }
  if (contact_ && !contact_->terms().empty() && whole_.due())
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

/// Contact forces on the nodes, and all that acts on the bodies.
void CoupledSystem::reduceGradient()
{
  if (contact_)
    for (const ContactTerm& term : contact_->terms())
    {
      if (isOwn(term) && !partOf(term.point[0]).coupled)
        continue;
      for (int p = 0; p < 4; ++p)
        if (term.point[p] >= 0)
        {
          const RodPart& part = partOf(term.point[p]);
          double* g = part.rod->system.gradient() + 4 * (term.point[p] - part.point);
          for (int c = 0; c < 3; ++c)
            g[c] -= term.weight[p] * term.force[c];
        }
      const int obstacles = static_cast<int>(obstacles_.size());
      if (term.solid < obstacles)
        continue;
      const int body = simulated_[model_.contact.bodies[term.solid - obstacles].body];
      if (body < 0)
        continue;
      bodies_[body].gradient.head<3>() += term.force;
      bodies_[body].gradient.tail<3>() += (term.position - bodies_[body].pose.position).cross(term.force);
    }
  for (RodPart& part : parts_)
  {
    if (!part.welded)
      continue;
    const RodSystem& system = part.rod->system;
    const RodArrays& a = system.arrays();
    const double* gradient = part.rod->system.gradient();
    for (const GraspState& g : part.rod->work.grasps)
    {
      if (!g.active || g.body < 0)
        continue;
      BodySystem& body = bodies_[simulated_[g.body]];
      for (int i = g.first_node; i <= g.last_node; ++i)
      {
        const Eigen::Vector3d grad = Eigen::Map<const Eigen::Vector3d>(gradient + 4 * i);
        body.gradient.head<3>() += grad;
        body.gradient.tail<3>() += (system.position(i) - body.pose.position).cross(grad);
      }
      for (int j = g.first_node; j < g.last_node; ++j)
        body.gradient.tail<3>() += gradient[4 * j + 3] * Eigen::Vector3d(a.t[0][j], a.t[1][j], a.t[2][j]);
    }
    for (const ClampJoint& c : system.clamps())
      if (const int body = part.rod->work.grasps[c.grasp].body; body >= 0)
        bodies_[simulated_[body]].gradient.tail<3>() -= c.torque;
  }
}

void CoupledSystem::solve()
{
  if (unknowns_ > 0)
  {
    for (RodPart& part : parts_)
      if (part.coupled)
        for (std::size_t d = 0; d < part.dof.size(); ++d)
          if (part.dof[d] >= 0)
            rhs_[part.offset + part.dof[d]] = -part.rod->system.gradient()[d];
    for (std::size_t b = 0; b < bodies_.size(); ++b)
      Eigen::Map<BodySystem::Vector6>(rhs_.data() + body_offset_ + 6 * b) = -bodies_[b].gradient;
    matrix_.solve(rhs_.data());
    for (std::size_t b = 0; b < bodies_.size(); ++b)
      body_direction_[b] = Eigen::Map<BodySystem::Vector6>(rhs_.data() + body_offset_ + 6 * b);
  }
  forRods([&](RodPart& part) {
    if (!part.coupled)
      part.rod->system.solve();
  });
  spread();
}

void CoupledSystem::spread()
{
  forRods([&](RodPart& part) {
    RodSystem& system = part.rod->system;
    if (!part.coupled)
      return;
    Columns row;
    for (std::size_t d = 0; d < part.dof.size(); ++d)
    {
      row.count = 0;
      mapDof(part, static_cast<int>(d), 1.0, row);
      double value = 0.0;
      for (int i = 0; i < row.count; ++i)
        value += row.value[i] * rhs_[row.index[i]];
      system.direction()[d] = value;
    }
  });
}

void CoupledSystem::moveAlong(double alpha)
{
  forRods([&](RodPart& part) { part.rod->system.moveAlong(alpha); });
  for (std::size_t b = 0; b < bodies_.size(); ++b)
    bodies_[b].moveAlong(body_direction_[b], alpha);
  placeWelds();
}

void CoupledSystem::accept()
{
  forRods([](RodPart& part) { part.rod->system.accept(); });
  for (BodySystem& body : bodies_)
    body.accept();
  if (contact_)
  {
    points_base_ = points_;
    solids_base_ = solids_;
  }
}

void CoupledSystem::saveBase()
{
  for (RodPart& part : parts_)
    part.rod->system.saveBase();
  for (BodySystem& body : bodies_)
    body.saveBase();
}

void CoupledSystem::restoreBase()
{
  for (RodPart& part : parts_)
    part.rod->system.restoreBase();
  for (BodySystem& body : bodies_)
    body.restoreBase();
}

double CoupledSystem::stepLimit()
{
  double alpha = 1.0;
  for (const RodPart& part : parts_)
    alpha = std::min(alpha, part.rod->system.stepLimit());
  for (const BodySystem::Vector6& d : body_direction_)
    alpha = std::min(alpha, 0.7 / std::max(0.7, d.tail<3>().norm()));
  if (!contact_)
    return alpha;
  moveAlong(alpha);
  gather(points_end_, solids_end_);
  return alpha * contact_->stepLimit(points_base_, points_end_, solids_base_, solids_end_);
}

double CoupledSystem::incrementSize() const
{
  double largest = 0.0;
  for (const RodPart& part : parts_)
    largest = std::max(largest, part.rod->system.incrementSize());
  for (const BodySystem::Vector6& d : body_direction_)
    largest =
        std::max({largest, d.head<3>().lpNorm<Eigen::Infinity>() / least_edge_, d.tail<3>().lpNorm<Eigen::Infinity>()});
  if (!contact_)
    return largest;
  // a barrier is resolved when its gaps are
  double at_contact = 0.0;
  for (const ContactTerm& term : contact_->terms())
  {
    Eigen::Vector3d u = Eigen::Vector3d::Zero();
    for (int p = 0; p < 4; ++p)
      if (term.point[p] >= 0)
      {
        const RodPart& part = partOf(term.point[p]);
        u += term.weight[p] *
             Eigen::Map<const Eigen::Vector3d>(part.rod->system.direction() + 4 * (term.point[p] - part.point));
      }
    at_contact = std::max(at_contact, u.norm());
  }
  return std::max(largest, tolerance_ * at_contact / (gap_tolerance_ * contact_->smallestGap()));
}

double CoupledSystem::slope() const
{
  double sum = 0.0;
  for (const RodPart& part : parts_)
    sum += part.rod->system.slope();
  for (std::size_t b = 0; b < bodies_.size(); ++b)
    sum += bodies_[b].gradient.dot(body_direction_[b]);
  return sum;
}

double CoupledSystem::residual() const
{
  double largest = 0.0;
  for (const RodPart& part : parts_)
    largest = std::max(largest, part.rod->system.residual());
  for (const BodySystem& body : bodies_)
    largest = std::max({largest, body.gradient.head<3>().lpNorm<Eigen::Infinity>(),
                        body.gradient.tail<3>().lpNorm<Eigen::Infinity>() *
                            std::sqrt(body.model().mass / body.model().inertia.trace())});
  return largest;
}

double CoupledSystem::forceScale() const
{
  double largest = 0.0;
  for (const RodPart& part : parts_)
    largest = std::max(largest, part.rod->system.forceScale());
  for (const BodySystem& body : bodies_)
    largest = std::max(largest, body.model().mass * inputs_->gravity.norm() + body.model().force.norm());
  if (contact_)
    for (const ContactTerm& term : contact_->terms())
      largest = std::max(largest, term.force.norm());
  return largest;
}

double CoupledSystem::noiseLevel() const
{
  double largest = 0.0;
  for (const RodPart& part : parts_)
    largest = std::max(largest, part.rod->system.noiseLevel());
  return largest;
}

}   // namespace slender
