#include "world_statics.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numeric>

#include "dynamics/statics_advice.h"
#include "slender_sim/geometry/rotation.h"

namespace slender {

namespace {

TimeConfig timeOfStatics(TimeConfig time)
{
  time.integrator = Integrator::implicit_euler;
  time.error_tolerance = 0;
  time.newton.max_iterations = std::max(60, time.newton.max_iterations);
  time.newton.tolerance = std::min(1e-7, time.newton.tolerance);
  return time;
}

std::vector<int> allParts(const WorldObjects& objects)
{
  std::vector<int> parts(static_cast<std::size_t>(objects.all.size()));
  std::iota(parts.begin(), parts.end(), 0);
  return parts;
}

void standStill(WorldState& state)
{
  for (RodState& rod : state.rods)
  {
    rod.forgetHistory();
    rod.v.setZero();
    for (GraspState& g : rod.grasps)
      g.velocity = {};
  }
  for (RigidBodyState& body : state.bodies)
  {
    body.velocity = {};
    body.last_step = 0.0;
  }
  for (Twist& v : state.obstacle_velocities)
    v = {};
}

StepReport refuseTorques()
{
  return StepReport().refuse(
      StepFailure::input_not_finite,
      "statics of rods with contact or bodies does not know torques about the tangent: weld a body with this torque, "
      "or let the scene settle by time stepping with damping (start: as_given)");
}

}   // namespace

WorldStatics::WorldStatics(WorldObjects& objects)
  : origin_(objects),
    time_(timeOfStatics(objects.world.time)),
    objects_(objects, time_),
    island_(objects_, allParts(objects_), time_),
    lever_(std::numeric_limits<double>::max())
{
  for (const RodObject& rod : objects_.rods)
    lever_ = std::min(lever_, rod.stepper->model->rest_length.minCoeff());
  std::vector<Part*> parts;
  for (WorldObject* object : objects_.all)
    object->addParts(parts);
  setParts(island_.island().equations(), std::move(parts), time_.newton);
  island_.island().keepBarriers();
  // Friction holds as in the steps of the scene, however long the steps of the search are.
  island_.island().equations().setFrictionTime(objects.world.time.step);
}

// ---- states of its parts

/// Copies the part of a state that the search for an equilibrium uses.
void WorldStatics::copy(const WorldState& from, WorldState& to) const
{
  to.rods.resize(from.rods.size());
  for (const RodObject& rod : objects_.rods)
    to.rods[rod.index] = from.rods[rod.index];
  to.bodies = from.bodies;
  to.obstacles = from.obstacles;
  to.obstacle_velocities = from.obstacle_velocities;
  to.contact = from.contact;
}

std::function<void()> WorldStatics::wayBack()
{
  return [this, state = work_, residual = report_.residual, max_strain = report_.max_strain] {
    work_ = state;
    report_.residual = residual;
    report_.max_strain = max_strain;
    report_.message.clear();
  };
}

void WorldStatics::loadParts()
{
  begin(1.0);
  Statics::loadParts();
  if (island_.contact())
  {
    island_.island().loadBarriers(0.0);
    island_.island().equations().contact()->setSprings(island_.island().springs);
  }
}

void WorldStatics::takeTrial()
{
  Statics::takeTrial();
  takeParts();
}

/// Takes over where the parts are now.
void WorldStatics::takeParts()
{
  for (const RodObject& rod : objects_.rods)
    work_.rods[rod.index] = rod.stepper->work;
  for (const BodyObject& body : objects_.bodies)
    work_.bodies[body.index] = body.part->state();
}

// ---- steps

/// Loads the present configuration for a step of this duration [s].
void WorldStatics::begin(double duration)
{
  for (RodObject& rod : objects_.rods)
    rod.stepper->begin(work_.rods[rod.index], rod.inputs, duration);
  for (const BodyObject& body : objects_.bodies)
    body.part->begin(work_.bodies[body.index], inputs_->gravity);
  island_.begin(work_, *inputs_);
}

StepReport WorldStatics::step(double h)
{
  begin(h);
  const StepReport report = island_.step(h);
  if (!report.ok)
    return report;
  takeParts();
  island_.end(work_);
  moveGiven(objects_.world, *inputs_, h, work_);
  return report;
}

/// Returns the largest unbalanced force [N]: the one that accelerates rods and bodies in a step of h from rest.
/// `farthest`: how far they move in it [m].
double WorldStatics::unbalanced(double h, double& farthest) const
{
  double sum = 0.0;
  farthest = 0.0;
  for (const RodObject& rod : objects_.rods)
  {
    const RodModel& m = *rod.stepper->model;
    const Eigen::Matrix3Xd &from = before_.rods[rod.index].x, &to = work_.rods[rod.index].x;
    for (int i = 0; i < m.nodes(); ++i)
      if (const double move = (to.col(i) - from.col(i)).norm(); rod.stepper->system.isMoving(i))
      {
        sum = std::max(sum, m.mass[i] * move / (h * h));
        farthest = std::max(farthest, move);
      }
  }
  for (const BodyObject& body : objects_.bodies)
  {
    const RigidBodyModel& m = objects_.world.bodies[body.index].body;
    const Pose &from = before_.bodies[body.index].X_WB, &to = work_.bodies[body.index].X_WB;
    const Eigen::Vector3d turn = rotationVector(from.orientation.conjugate() * to.orientation);
    const double move = (to.position - from.position).norm();
    sum = std::max({sum, m.mass * move / (h * h), (m.inertia * turn).norm() / (lever_ * h * h)});
    farthest = std::max(farthest, move);
  }
  return sum;
}

/// Steps from rest, the first of `h` seconds, until nothing is accelerated. Returns false when that does not end.
bool WorldStatics::settle(double h)
{
  constexpr int kMaxRounds = 400, kMostSliding = 200;
  constexpr double kUnbalanced = 1e-8;   // of the largest force
  constexpr double kDrift = 1e6;         // gaps: what moves farther from rest is held by nothing
  for (int round = 0, failures = 0; round < kMaxRounds; ++round)
  {
    standStill(work_);
    before_ = work_;
    const StepReport report = step(h);
    report_.iterations += report.iterations;
    report_.factorizations += report.factorizations;
    if (!report.ok)
    {
      failure_ = report.failure;
      report_.message.clear();
      h *= 0.1;
      if (++failures > 12 || failure_ == StepFailure::interrupted)
        return false;
      continue;
    }
    ++report_.substeps;
    force_scale_ = std::max(force_scale_, equations().forceScale());
    double farthest = 0.0;
    const double force = unbalanced(h, farthest);
    report_.residual = force == 0.0 ? 0.0 : force / force_scale_;
    report_.max_strain = report.max_strain;
    if (round > 0 && report_.residual < kUnbalanced)
    {
      standStill(work_);
      return true;
    }
    if (island_.contact() && farthest > kDrift * island_.contact()->options().gap)
      break;
    // In a long step things slide far before they press on each other enough for friction to hold them.
    const bool slides =
        round < kMostSliding && !island_.island().springs.empty() && farthest > island_.contact()->options().gap;
    if (!slides)
      h = std::min(h * (report.iterations < 10 ? 4.0 : 1.5), 1e6);
  }
  failure_ = StepFailure::newton_diverged;
  report_.message =
      "the equilibrium did not settle: something may be free to drift; hold it, or let it settle by time stepping with "
      "damping (start: as_given)";
  return false;
}

bool WorldStatics::settleFrom(double lowest)
{
  // Inertia above the negative eigenvalue makes the first steps convex, so that they slide down instead of jumping.
  return settle(std::isfinite(lowest) ? 0.7 / std::sqrt(-lowest) : 1e-3 * time_.step);
}

StepReport WorldStatics::solve(WorldState& state, const WorldInputs& inputs)
{
  report_ = StepReport();
  for (const RodObject& rod : objects_.rods)
    if (rod.index < static_cast<int>(inputs.rods.size()) && inputs.rods[rod.index].torques.size() > 0)
      return refuseTorques();
  if (!objects_.takeInputs(state, inputs, report_))
    return report_;
  inputs_ = &inputs;
  copy(state, work_);
  if (settle(time_.step))
  {
    settleStably(true);
    load();   // The search for a way down from a saddle leaves contacts of other places.
    report_.message.clear();
    copy(work_, state);
    for (const RodObject& rod : objects_.rods)
      findObject(origin_.rods, rod.index)->stepper->wrenches = rod.stepper->wrenches;
    return report_;
  }
  return report_.refuse(failure_, report_.message.empty() ? explainStatics(failure_) : report_.message);
}

StepReport solveStatics(WorldObjects& objects, int threads, WorldState& state, const WorldInputs& inputs,
                        std::unique_ptr<WorldStatics>& together)
{
  StepReport total;
  if (!objects.takeInputs(state, inputs, total))
    return total;
  bool meet = !objects.bodies.empty();
  for (RodObject& rod : objects.rods)
  {
    meet = meet || rod.meets;
    if (RodStepper* alone = rod.alone(); alone && total.ok)
      total.merge(alone->solveEquilibrium(state.rods[rod.index], rod.inputs));
  }
  if (!meet || !total.ok)
    return total;
  together = std::make_unique<WorldStatics>(objects);
  together->setThreads(threads);
  total.merge(together->solve(state, inputs));
  return total;
}

}   // namespace slender
