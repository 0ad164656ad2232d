// Whether an equilibrium of coupled rods, bodies and contact is stable.
#include <algorithm>
#include <cmath>
#include <limits>

#include "coupled_system.h"
#include "statics_advice.h"

namespace slender {

void CoupledSystem::beginStability(const RodGroupState& state, const RodGroupInputs& inputs)
{
  begin(state, inputs, 1.0);
  coupled_.exact = true;
  for (RodPart& part : parts_)
  {
    part.rod->begin(state.rods[part.index]);
    part.rod->system.leaveOutStretching(false);
    part.rod->system.load(part.rod->work);
    part.rod->system.setResponse(0.0, nullptr);
    mapUnknowns(part);
    part.rod->placeAt(inputs.rods[part.index], 1.0, 1.0);
  }
  for (std::size_t b = 0; b < model_.bodies.size(); ++b)
    if (simulated_[b] >= 0)
      bodies_[simulated_[b]].load(state.bodies[b]);
  placeDriven(1.0);
  placeWelds();
  if (contact_)
  {
    contact_->setStiffness(stiffness_now_);
    gather(points_base_, solids_base_);
    // Friction sticks below its slip speed over the whole step. In a step without end nothing sticks.
    constexpr double kForever = 1e15;
    contact_->begin(points_base_, solids_base_, kForever);
  }
  energyAt(0.0);
  accept();
}

RodEvaluation CoupledSystem::energyAt(double s)
{
  for (RodPart& part : parts_)
  {
    RodSystem& system = part.rod->system;
    for (int i = 0; i < part.rod->model->nodes(); ++i)
      system.setInertia(i, system.isMoving(i) ? s * part.rod->model->mass[i] : 0.0, system.position(i),
                        part.rod->load(inputs_->rods[part.index], i));
  }
  for (BodySystem& body : bodies_)
    body.hold(s, inputs_->gravity);
  return evaluate(false);
}

bool CoupledSystem::definite(double s)
{
  energyAt(s);
  return evaluate(true).inertia.positiveDefinite();
}

double CoupledSystem::neutralBand() const
{
  double mass = 0.0, length = 0.0, stiffness = std::numeric_limits<double>::infinity(), rounding = 0.0,
         least_mass = stiffness;
  for (const RodPart& part : parts_)
  {
    const RodModel& m = *part.rod->model;
    mass += m.totalMass();
    length = std::max(length, m.rest_length.sum());
    stiffness = std::min(
        {stiffness, m.bend_modulus.row(0).minCoeff(), m.bend_modulus.row(2).minCoeff(), m.twist_modulus.minCoeff()});
    for (int j = 0; j < m.edges(); ++j)
      rounding = std::max(
          rounding, 4 * m.stretch_modulus[j] / (m.rest_length[j] * std::min(m.mass[j], m.mass[(j + 1) % m.nodes()])));
    least_mass = std::min(least_mass, m.mass.minCoeff());
  }
  for (const BodySystem& body : bodies_)
    mass += body.model().mass;
  if (contact_)
    for (const ContactTerm& term : contact_->terms())
      rounding = std::max(rounding, 4 * term.stiffness.norm() / least_mass);
  // as for a single rod: the bending stiffness of the longest rod, and rounding errors of the largest entries
  const double bending = parts_.empty() ? 0.0 : stiffness / (mass * std::pow(length, 3));
  constexpr double kLeast = 1e-12;   // [1/s^2] of bodies on their own: a period of twelve days
  return std::max(kLeast, kNeutralShare * bending + 2.0 * std::numeric_limits<double>::epsilon() * rounding);
}

void CoupledSystem::findLowestMode()
{
  // a start without a symmetry that a mode could be orthogonal to
  const auto start = [](std::size_t k) {
    return std::sin(1.0 + 1.7 * static_cast<double>(k)) + 0.5 * std::cos(0.3 * static_cast<double>(k));
  };
  Eigen::Map<Eigen::VectorXd> shared(coupled_.matrix.solution(), coupled_.matrix.unknowns());
  for (Eigen::Index k = 0; k < shared.size(); ++k)
    shared[k] = start(static_cast<std::size_t>(k));
  for (RodPart& part : parts_)
    if (!part.coupled)
      for (std::size_t d = 0; d < part.dof.size(); ++d)
        part.rod->system.direction()[d] = part.dof[d] >= 0 ? start(d) : 0.0;
  const auto own = [](RodPart& part) {
    return Eigen::Map<Eigen::VectorXd>(part.rod->system.direction(), static_cast<Eigen::Index>(part.dof.size()));
  };
  for (int k = 0; k < 12; ++k)
  {
    double square = shared.squaredNorm();
    for (RodPart& part : parts_)
      square += part.coupled ? 0.0 : own(part).squaredNorm();
    const double scale = 1.0 / std::sqrt(std::max(square, 1e-300));
    shared *= scale;
    coupled_.matrix.solve();
    for (RodPart& part : parts_)
      if (!part.coupled)
      {
        own(part) *= scale;
        part.rod->system.solveFor(part.rod->system.direction());
      }
  }
  for (std::size_t b = 0; b < bodies_.size(); ++b)
    body_direction_[b] = bodySolution(b);
  spread();
  double turn = 0.0, move = 0.0, length = 0.0;
  for (RodPart& part : parts_)
  {
    const Eigen::Map<Eigen::Matrix4Xd> v(part.rod->system.direction(), 4, part.rod->model->nodes());
    const RodModel& m = *part.rod->model;
    for (int j = 0; j < m.edges(); ++j)
      turn = std::max(
          {turn, (v.col((j + 1) % m.nodes()) - v.col(j)).head<3>().norm() / m.rest_length[j], std::abs(v(3, j))});
    move = std::max(move, v.topRows<3>().cwiseAbs().maxCoeff());
    length = std::max(length, m.rest_length.sum());
  }
  for (const BodySystem::Vector6& d : body_direction_)
    turn = std::max(turn, d.tail<3>().norm());
  // a mode that moves everything as a whole turns nothing
  const double scale = std::max({turn, length > 0 ? move / length : 0.0, 1e-300});
  for (RodPart& part : parts_)
    own(part) /= scale;
  for (BodySystem::Vector6& d : body_direction_)
    d /= scale;
}

bool CoupledSystem::displaceAlongMode(double alpha, RodGroupState& state)
{
  moveAlong(alpha);
  if (contact_)
  {
    gather(points_end_, solids_end_);
    const double room = contact_->stepLimit(points_base_, points_end_, solids_base_, solids_end_);
    constexpr double kTooLittle = 1e-3;   // contact is in the way of this direction
    if (room < kTooLittle)
      return false;
    moveAlong(room * alpha);
  }
  const RodEvaluation at = evaluate(false);
  if (!std::isfinite(at.energy()) || at.min_chi <= kFoldedChi)
    return false;
  for (RodPart& part : parts_)
  {
    RodState& rod = state.rods[part.index];
    part.rod->system.store(rod);
    for (std::size_t k = 0; k < rod.grasps.size(); ++k)
      if (rod.grasps[k].active)
        rod.grasps[k].X_WG = part.rod->stage_poses[k];
  }
  for (std::size_t b = 0; b < model_.bodies.size(); ++b)
    if (simulated_[b] >= 0)
      state.bodies[b].X_WB = bodies_[simulated_[b]].pose;
  return true;
}

}   // namespace slender
