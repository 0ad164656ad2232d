// Whether an equilibrium of rods, bodies and contact is stable.
#include <algorithm>
#include <cmath>
#include <functional>
#include <limits>

#include "dynamics/statics_advice.h"
#include "slender_sim/dynamics/lowest_eigenvalue.h"
#include "world_statics.h"

namespace slender {

/// Loads the present configuration, at which everything stands still. The functions below are about it.
void WorldStatics::beginStability()
{
  load(1.0);
  system().beginStep(1.0);
  for (const RodObject& rod : objects_.rods)
  {
    RodSystem& chain = rod.stepper->system;
    chain.leaveOutStretching(false);
    chain.load(rod.stepper->work);
    chain.setResponse(0.0, nullptr);
  }
  for (const BodyObject& body : objects_.bodies)
    body.part->system.load(body.part->state());
  system().place(1.0);
  system().beginSubstep(1.0);
  system().setExact(true);
  if (ContactPotential* contact = system().contact())
  {
    island_.island().loadStiffness(0.0);
    // Friction sticks below its slip speed over the whole step. In a step without end nothing sticks.
    constexpr double kForever = 1e15;
    contact->begin(system().startPoints(), system().startSolids(), kForever);
  }
  energyAt(0.0);
  system().accept();
}

RodEvaluation WorldStatics::energyAt(double s)
{
  for (const RodObject& rod : objects_.rods)
  {
    RodSystem& chain = rod.stepper->system;
    for (int i = 0; i < chain.nodes(); ++i)
      chain.setInertia(i, chain.isMoving(i) ? s * rod.stepper->model->mass[i] : 0.0, chain.position(i),
                       rod.stepper->load(i));
  }
  for (const BodyObject& body : objects_.bodies)
    body.part->system.hold(s, inputs_->gravity);
  return system().evaluate(false);
}

/// Factors K + s M, with the exact second derivative of contact and without friction. Returns whether the matrix is
/// positive definite.
bool WorldStatics::definite(double s)
{
  energyAt(s);
  return system().evaluate(true).inertia.positiveDefinite();
}

/// Half width of the band of eigenvalues that count as zero [1/s^2].
double WorldStatics::neutralBand() const
{
  double mass = 0.0, length = 0.0, stiffness = std::numeric_limits<double>::infinity(), rounding = 0.0,
         least_mass = stiffness;
  for (const RodObject& rod : objects_.rods)
  {
    const RodModel& m = *rod.stepper->model;
    mass += m.totalMass();
    length = std::max(length, m.rest_length.sum());
    stiffness = std::min(
        {stiffness, m.bend_modulus.row(0).minCoeff(), m.bend_modulus.row(2).minCoeff(), m.twist_modulus.minCoeff()});
    for (int j = 0; j < m.edges(); ++j)
      rounding = std::max(
          rounding, 4 * m.stretch_modulus[j] / (m.rest_length[j] * std::min(m.mass[j], m.mass[(j + 1) % m.nodes()])));
    least_mass = std::min(least_mass, m.mass.minCoeff());
  }
  for (const BodyObject& body : objects_.bodies)
    mass += objects_.world.bodies[body.index].body.mass;
  if (const ContactPotential* contact = island_.contact())
    for (const ContactTerm& term : contact->terms())
      rounding = std::max(rounding, 4 * term.stiffness.norm() / least_mass);
  // as for a single rod: the bending stiffness of the longest rod, and rounding errors of the largest entries
  const double bending = objects_.rods.empty() ? 0.0 : stiffness / (mass * std::pow(length, 3));
  constexpr double kLeast = 1e-12;   // [1/s^2] of bodies on their own: a period of twelve days
  return std::max(kLeast, kNeutralShare * bending + 2.0 * std::numeric_limits<double>::epsilon() * rounding);
}

/// The direction becomes the mode of the lowest eigenvalue, by inverse iteration with the matrix last factored.
void WorldStatics::findLowestMode()
{
  SharedMatrix& matrix = system().matrix();
  Eigen::Map<Eigen::VectorXd> shared(matrix.solution(), matrix.unknowns());
  for (Eigen::Index k = 0; k < shared.size(); ++k)
    shared[k] = startOfMode(static_cast<double>(k));
  std::vector<Eigen::Map<Eigen::VectorXd>> own;   // of the parts that solve on their own, each with
  std::vector<std::function<void()>> solve;       // its solution
  for (const RodObject& rod : objects_.rods)
    if (!rod.part->coupled)
    {
      RodSystem& chain = rod.stepper->system;
      own.emplace_back(chain.direction(), 4 * chain.nodes());
      for (int u = 0; u < 4 * chain.nodes(); ++u)
        own.back()[u] = rod.part->isUnknown(u) ? startOfMode(u) : 0.0;
      solve.emplace_back([&chain] { chain.solveFor(chain.direction()); });
    }
  for (const BodyObject& body : objects_.bodies)
    if (!body.part->coupled)
    {
      BodyPart& part = *body.part;
      own.emplace_back(part.direction.data(), 6);
      for (int u = 0; u < 6; ++u)
        own.back()[u] = startOfMode(u);
      solve.emplace_back([&part] { part.solveFor(part.direction); });
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
  system().spread();
  scaleMode();
}

/// Nothing turns by more than 1 rad. A mode that moves everything as a whole turns nothing.
void WorldStatics::scaleMode()
{
  double turn = 0.0, move = 0.0, length = 0.0;
  const auto directionOf = [](const RodObject& rod) {
    return Eigen::Map<Eigen::Matrix4Xd>(rod.stepper->system.direction(), 4, rod.stepper->model->nodes());
  };
  for (const RodObject& rod : objects_.rods)
  {
    const Eigen::Map<Eigen::Matrix4Xd> v = directionOf(rod);
    const RodModel& m = *rod.stepper->model;
    for (int j = 0; j < m.edges(); ++j)
      turn = std::max(
          {turn, (v.col((j + 1) % m.nodes()) - v.col(j)).head<3>().norm() / m.rest_length[j], std::abs(v(3, j))});
    move = std::max(move, v.topRows<3>().cwiseAbs().maxCoeff());
    length = std::max(length, m.rest_length.sum());
  }
  for (const BodyObject& body : objects_.bodies)
    turn = std::max(turn, body.part->direction.tail<3>().norm());
  const double scale = std::max({turn, length > 0 ? move / length : 0.0, 1e-300});
  for (const RodObject& rod : objects_.rods)
    directionOf(rod) /= scale;
  for (const BodyObject& body : objects_.bodies)
    body.part->direction /= scale;
}

/// The present configuration becomes what is `alpha` times the mode away from the equilibrium. Returns false when
/// something is in the way.
bool WorldStatics::displaceAlongMode(double alpha)
{
  system().moveAlong(alpha);
  if (system().contact())
  {
    const double room = system().roomToTrial();
    constexpr double kTooLittle = 1e-3;   // contact is in the way of this direction
    if (room < kTooLittle)
      return false;
    system().moveAlong(room * alpha);
  }
  const RodEvaluation at = system().evaluate(false);
  if (!std::isfinite(at.energy()) || at.min_chi <= kFoldedChi)
    return false;
  for (const RodObject& rod : objects_.rods)
  {
    RodState& state = work_.rods[rod.index];
    rod.stepper->system.store(state);
    for (std::size_t k = 0; k < state.grasps.size(); ++k)
      if (state.grasps[k].active)
        state.grasps[k].X_WG = rod.stepper->stage_poses[k];
  }
  for (const BodyObject& body : objects_.bodies)
    work_.bodies[body.index].X_WB = body.part->pose();
  return true;
}

}   // namespace slender
