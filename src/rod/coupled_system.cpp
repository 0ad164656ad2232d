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
    coupled_.take(contact_->terms(), nullptr, contact_->rows());
  }
  if (!coupled_.patternValid())
    buildPattern();
  forRods([&](RodPart& part) { coupled_.evaluate(part, with_hessian, shift); });
  coupled_.addEvaluations(sum);
  for (BodySystem& body : bodies_)
  {
    body.evaluate(with_hessian);
    sum.potential += body.energy();
  }
  reduceGradient();
  if (with_hessian && coupled_.matrix.unknowns() > 0)
    sum.inertia.negative += !coupled_.factor([&](bool whole) { assemble(shift, whole); });
  coupled_.closeGradients();
  return sum;
}

/// Contact forces on the nodes, and all that acts on the bodies.
void CoupledSystem::reduceGradient()
{
  coupled_.forTerms([&](const ContactTerm& term) {
    coupled_.addForce(term);
    if (term.solid < 0 || !coupled_.solid_moves[term.solid])
      return;
    const int obstacles = static_cast<int>(obstacles_.size());
    BodySystem& body = bodies_[simulated_[model_.contact.bodies[term.solid - obstacles].body]];
    body.gradient.head<3>() += term.force;
    body.gradient.tail<3>() += (term.position - body.pose.position).cross(term.force);
  });
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
  coupled_.takeGradients();
  for (std::size_t b = 0; b < bodies_.size(); ++b)
    bodySolution(b) = -bodies_[b].gradient;
  coupled_.matrix.solve();
  for (std::size_t b = 0; b < bodies_.size(); ++b)
    body_direction_[b] = bodySolution(b);
  forRods([&](RodPart& part) {
    if (!part.coupled)
      part.rod->system.solve();
  });
  spread();
}

/// The solution of the matrix becomes the directions of the rods in it.
void CoupledSystem::spread()
{
  forRods([&](RodPart& part) {
    if (!part.coupled)
      return;
    coupled_.spread(part);
    Columns row;
    for (std::size_t d = 0; part.welded && d < part.dof.size(); ++d)
    {
      if (part.dof[d] >= kPrescribed)
        continue;
      row.count = 0;
      mapDof(part, static_cast<int>(d), 1.0, row);
      double value = 0.0;
      for (int i = 0; i < row.count; ++i)
        value += row.value[i] * coupled_.matrix.solution()[row.index[i]];
      part.rod->system.direction()[d] = value;
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
  const double at_contact = coupled_.largestMove(contact_->terms());
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
