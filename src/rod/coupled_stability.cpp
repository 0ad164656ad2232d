// Whether an equilibrium of coupled rods, bodies and contact is stable.
#include <algorithm>
#include <cmath>
#include <functional>
#include <limits>

#include "coupled_system.h"
#include "statics_advice.h"

namespace slender {

void CoupledSystem::beginStability(const RodGroupState& state, const RodGroupInputs& inputs)
{
  begin(state, inputs, 1.0);
  for (std::size_t r = 0; r < rods_.size(); ++r)
  {
    RodStepper::Impl& rod = rods_[r]->rod();
    rod.begin(state.rods[r]);
    rod.system.leaveOutStretching(false);
    rod.system.load(rod.work);
    rod.system.setResponse(0.0, nullptr);
  }
  for (std::size_t b = 0; b < model_.bodies.size(); ++b)
    if (simulated_[b])
      simulated_[b]->system.load(state.bodies[b]);
  island_.place(1.0);
  island_.beginSubstep(1.0);
  island_.setExact(true);
  if (hasContact())
  {
    island_.contact()->setStiffness(stiffness_now_);
    // Friction sticks below its slip speed over the whole step. In a step without end nothing sticks.
    constexpr double kForever = 1e15;
    island_.contact()->begin(island_.startPoints(), island_.startSolids(), kForever);
  }
  energyAt(0.0);
  island_.accept();
}

RodEvaluation CoupledSystem::energyAt(double s)
{
  for (const auto& part : rods_)
  {
    RodStepper::Impl& rod = part->rod();
    for (int i = 0; i < rod.model->nodes(); ++i)
      rod.system.setInertia(i, rod.system.isMoving(i) ? s * rod.model->mass[i] : 0.0, rod.system.position(i),
                            rod.load(part->inputs(), i));
  }
  for (const auto& body : bodies_)
    body->system.hold(s, inputs_->gravity);
  return island_.evaluate(false);
}

bool CoupledSystem::definite(double s)
{
  energyAt(s);
  return island_.evaluate(true).inertia.positiveDefinite();
}

double CoupledSystem::neutralBand() const
{
  double mass = 0.0, length = 0.0, stiffness = std::numeric_limits<double>::infinity(), rounding = 0.0,
         least_mass = stiffness;
  for (const auto& rod : model_.rods)
  {
    const RodModel& m = *rod;
    mass += m.totalMass();
    length = std::max(length, m.rest_length.sum());
    stiffness = std::min(
        {stiffness, m.bend_modulus.row(0).minCoeff(), m.bend_modulus.row(2).minCoeff(), m.twist_modulus.minCoeff()});
    for (int j = 0; j < m.edges(); ++j)
      rounding = std::max(
          rounding, 4 * m.stretch_modulus[j] / (m.rest_length[j] * std::min(m.mass[j], m.mass[(j + 1) % m.nodes()])));
    least_mass = std::min(least_mass, m.mass.minCoeff());
  }
  for (const auto& body : bodies_)
    mass += body->system.model().mass;
  for (const ContactTerm& term : contacts())
    rounding = std::max(rounding, 4 * term.stiffness.norm() / least_mass);
  // as for a single rod: the bending stiffness of the longest rod, and rounding errors of the largest entries
  const double bending = rods_.empty() ? 0.0 : stiffness / (mass * std::pow(length, 3));
  constexpr double kLeast = 1e-12;   // [1/s^2] of bodies on their own: a period of twelve days
  return std::max(kLeast, kNeutralShare * bending + 2.0 * std::numeric_limits<double>::epsilon() * rounding);
}

void CoupledSystem::findLowestMode()
{
  // a start without a symmetry that a mode could be orthogonal to
  const auto start = [](std::size_t k) {
    return std::sin(1.0 + 1.7 * static_cast<double>(k)) + 0.5 * std::cos(0.3 * static_cast<double>(k));
  };
  CouplingMatrix& matrix = island_.matrix();
  Eigen::Map<Eigen::VectorXd> shared(matrix.solution(), matrix.unknowns());
  for (Eigen::Index k = 0; k < shared.size(); ++k)
    shared[k] = start(static_cast<std::size_t>(k));
  std::vector<Eigen::Map<Eigen::VectorXd>> own;   // of the parts that solve on their own, each with
  std::vector<std::function<void()>> solve;       // its solution
  for (const auto& rod : rods_)
    if (!rod->coupled)
    {
      RodSystem& system = rod->rod().system;
      own.emplace_back(system.direction(), 4 * system.nodes());
      for (int u = 0; u < 4 * system.nodes(); ++u)
        own.back()[u] = rod->isUnknown(u) ? start(static_cast<std::size_t>(u)) : 0.0;
      solve.emplace_back([&system] { system.solveFor(system.direction()); });
    }
  for (const auto& body : bodies_)
    if (!body->coupled)
    {
      own.emplace_back(body->direction.data(), 6);
      for (int u = 0; u < 6; ++u)
        own.back()[u] = start(static_cast<std::size_t>(u));
      solve.emplace_back([&body] { body->solveFor(body->direction); });
    }
  for (int k = 0; k < 12; ++k)
  {
    double square = shared.squaredNorm();
    for (const auto& v : own)
      square += v.squaredNorm();
    const double scale = 1.0 / std::sqrt(std::max(square, 1e-300));
    shared *= scale;
    matrix.solve();
    for (std::size_t p = 0; p < own.size(); ++p)
    {
      own[p] *= scale;
      solve[p]();
    }
  }
  island_.spread();
  scaleMode();
}

/// Nothing turns by more than 1 rad. A mode that moves everything as a whole turns nothing.
void CoupledSystem::scaleMode()
{
  double turn = 0.0, move = 0.0, length = 0.0;
  const auto directionOf = [](const RodPart& part) {
    return Eigen::Map<Eigen::Matrix4Xd>(part.rod().system.direction(), 4, part.rod().model->nodes());
  };
  for (const auto& part : rods_)
  {
    const Eigen::Map<Eigen::Matrix4Xd> v = directionOf(*part);
    const RodModel& m = *part->rod().model;
    for (int j = 0; j < m.edges(); ++j)
      turn = std::max(
          {turn, (v.col((j + 1) % m.nodes()) - v.col(j)).head<3>().norm() / m.rest_length[j], std::abs(v(3, j))});
    move = std::max(move, v.topRows<3>().cwiseAbs().maxCoeff());
    length = std::max(length, m.rest_length.sum());
  }
  for (const auto& body : bodies_)
    turn = std::max(turn, body->direction.tail<3>().norm());
  const double scale = std::max({turn, length > 0 ? move / length : 0.0, 1e-300});
  for (const auto& part : rods_)
    directionOf(*part) /= scale;
  for (const auto& body : bodies_)
    body->direction /= scale;
}

bool CoupledSystem::displaceAlongMode(double alpha, RodGroupState& state)
{
  island_.moveAlong(alpha);
  if (hasContact())
  {
    const double room = island_.roomToTrial();
    constexpr double kTooLittle = 1e-3;   // contact is in the way of this direction
    if (room < kTooLittle)
      return false;
    island_.moveAlong(room * alpha);
  }
  const RodEvaluation at = island_.evaluate(false);
  if (!std::isfinite(at.energy()) || at.min_chi <= kFoldedChi)
    return false;
  for (std::size_t r = 0; r < rods_.size(); ++r)
  {
    RodState& rod = state.rods[r];
    rods_[r]->rod().system.store(rod);
    for (std::size_t k = 0; k < rod.grasps.size(); ++k)
      if (rod.grasps[k].active)
        rod.grasps[k].X_WG = rods_[r]->rod().stage_poses[k];
  }
  for (std::size_t b = 0; b < model_.bodies.size(); ++b)
    if (simulated_[b])
      state.bodies[b].X_WB = simulated_[b]->pose();
  return true;
}

}   // namespace slender
