// Equilibria under growing loads, and the load at which they cease to be stable.
#include "statics_runner.h"

#include <algorithm>

#include "scene_parts.h"
#include "slender_sim/rod/rod_path.h"
#include "slender_sim/scene/reader.h"

namespace slender {

namespace {

std::string atFactor(double factor) { return "load factor " + shortNumber(factor, 6) + ": "; }

double largestDistance(const Eigen::Matrix3Xd& a, const Eigen::Matrix3Xd& b)
{
  return (a - b).colwise().norm().maxCoeff();
}

void fail(StaticsRun& run, const std::string& message) { run.end.refuse(StepFailure::newton_diverged, message); }

/// Ends the run with the report of an equilibrium that was not found.
void fail(StaticsRun& run, const StepReport& report, double factor)
{
  run.end = report;
  run.end.message = atFactor(factor) + report.message;
}

/// Sum of the sizes of all loads, torques as forces at the end of the rod [N].
double sumOfLoads(const RodModel& model, const RodInputs& loads)
{
  double sum = 0.0;
  for (int i = 0; i < model.nodes(); ++i)
  {
    Eigen::Vector3d force = model.mass[i] * loads.gravity;
    if (loads.forces.cols() > 0)
      force += loads.forces.col(i);
    sum += force.norm();
  }
  return sum + loads.torques.cwiseAbs().sum() / model.rest_length.sum();
}

void requireStatics(const SceneConfig& config)
{
  const std::string where = placeOf(config, FailurePlace::Kind::none, -1);
  for (const ClothConfig& cloth : config.cloths)
  {
    if (cloth.tracking || cloth.contact)
    {
      throw SceneError(where + ": statics is not for cloth that " +
                       (cloth.tracking ? "tracks a guide" : "has contact") + ", as cloth " + cloth.name +
                       " does; let it settle by time stepping with damping");
    }
  }
  for (const RodConfig& rod : config.rods)
    if (rod.tracking)
      throw SceneError(where + ": statics is not for rods that track a guide, as rod " + rod.name + " does");
  const bool simulated = std::any_of(config.bodies.begin(), config.bodies.end(),
                                     [](const BodyConfig& body) { return !body.motion.has_value(); });
  if (config.rods.empty() && config.cloths.empty() && !simulated)
  {
    throw SceneError(where +
                     ": statics needs a rod, a cloth or a simulated body; threads flow, and have no equilibrium");
  }
}

}   // namespace

StaticsRunner::StaticsRunner(const SceneConfig& config, const SceneState& start, WorldInputs inputs, World& world,
                             SceneGrasps& grasps, SceneState& state)
  : config_(config),
    start_(start),
    inputs_(std::move(inputs)),
    world_(world),
    grasps_(grasps),
    state_(state),
    scales_(config.statics ? config.statics->scales : FactorScales::all)
{
  requireStatics(config);
}

RodStepper& StaticsRunner::stepper()
{
  RodStepper* stepper = world_.rodStepper(0);
  if (!stepper)
    throw SceneError(placeOf(config_, FailurePlace::Kind::none, -1) + ": statics: the rod is not on its own");
  return *stepper;
}

Eigen::Vector3d StaticsRunner::gravityAt(double factor) const
{
  return (scales_ != FactorScales::loads ? factor : 1.0) * config_.gravity;
}

RodInputs StaticsRunner::loadsAt(int rod, double factor) const
{
  const double scale = scales_ != FactorScales::gravity ? factor : 1.0;
  RodInputs inputs = inputs_.rods[rod];
  inputs.gravity = gravityAt(factor);
  inputs.forces *= scale;
  inputs.torques *= scale;
  if (imperfection_.cols() > 0)
    inputs.forces = inputs.forces.cols() > 0 ? Eigen::Matrix3Xd(inputs.forces + imperfection_) : imperfection_;
  return inputs;
}

RodInputs StaticsRunner::loadsPerFactor(int rod, double factor) const
{
  RodInputs inputs;
  inputs.gravity =
      scales_ == FactorScales::loads ? Eigen::Vector3d(0, 0, 0) : Eigen::Vector3d(factor * config_.gravity);
  if (scales_ != FactorScales::gravity)
  {
    inputs.forces = factor * inputs_.rods[rod].forces;
    inputs.torques = factor * inputs_.rods[rod].torques;
  }
  return inputs;
}

StepReport StaticsRunner::solve(double factor)
{
  const std::vector<RigidBodyState> before = state_.bodies;
  WorldInputs loads = inputs_;
  loads.gravity = gravityAt(factor);
  for (std::size_t r = 0; r < loads.rods.size(); ++r)
    loads.rods[r] = loadsAt(static_cast<int>(r), factor);
  for (ClothInputs& cloth : loads.cloths)
  {
    cloth.gravity = loads.gravity;
    cloth.forces *= scales_ != FactorScales::gravity ? factor : 1.0;
  }
  const StepReport report = world_.solveEquilibrium(state_, loads);
  if (!report.ok)
    return report;
  grasps_.takeWrenches(world_);
  for (std::size_t b = 0; config_.start.keep_velocities && b < before.size(); ++b)
    state_.bodies[b].velocity = before[b].velocity;
  return report;
}

/// The present state as a row.
StaticsRow StaticsRunner::rowAt(double factor, const StepReport& report)
{
  StaticsRow row;
  row.factor = factor;
  row.report = report;
  for (std::size_t r = 0; r < state_.rods.size(); ++r)
  {
    row.nodes.push_back(state_.rods[r].x);
    const RodStepper* stepper = world_.rodStepper(static_cast<int>(r));
    row.modes.push_back(stepper ? Eigen::Matrix4Xd(stepper->lowestMode()) : Eigen::Matrix4Xd(4, 0));
    row.displacement = std::max(row.displacement, largestDistance(state_.rods[r].x, start_.rods[r].x));
  }
  for (std::size_t b = 0; b < state_.bodies.size(); ++b)
    row.displacement =
        std::max(row.displacement, (state_.bodies[b].X_WB.position - start_.bodies[b].X_WB.position).norm());
  for (std::size_t k = 0; k < state_.cloths.size(); ++k)
    row.displacement = std::max(row.displacement, largestDistance(state_.cloths[k].x, start_.cloths[k].x));
  return row;
}

StaticsRun StaticsRunner::run()
{
  StaticsRun run;
  const StaticsConfig statics = config_.statics.value_or(StaticsConfig{});
  if (statics.buckling)
    findCritical(*statics.buckling, run);
  const bool only_buckling = statics.buckling && statics.factors.empty() && !statics.path;
  const std::vector<double> factors = statics.factors.empty() ? std::vector<double>{1.0} : statics.factors;
  if (statics.perturbation != 0 && run.end.ok)
    perturb(statics.path ? statics.path->from : factors.front(), run);
  if (run.end.ok && statics.path)
    runPath(*statics.path, run);
  else if (run.end.ok && !only_buckling)
    runFactors(factors, run);
  imperfection_.resize(3, 0);
  if (run.end.ok)
    grasps_.takeWrenches(world_);
  return run;
}

/// Forces along the lowest mode of the equilibrium at the first factor, which need not be stable.
void StaticsRunner::perturb(double first_factor, StaticsRun& run)
{
  RodState state = state_.rods[0];
  run.end.merge(stepper().solveEquilibrium(state, loadsAt(0, first_factor), false));
  if (!run.end.ok)
    return;
  const Eigen::Matrix3Xd mode = stepper().lowestMode().topRows<3>();
  const double size = mode.colwise().norm().sum();
  if (!(size > 0))
  {
    return fail(run,
                "statics.perturbation: the lowest mode of the first equilibrium moves no node, so that no force lies "
                "along it; leave perturbation out");
  }
  imperfection_ =
      config_.statics->perturbation * sumOfLoads(*world_.model().rods[0].model, loadsPerFactor(0, 1.0)) / size * mode;
}

void StaticsRunner::runFactors(const std::vector<double>& factors, StaticsRun& run)
{
  for (const double factor : factors)
  {
    const StepReport report = solve(factor);
    if (!report.ok)
      return fail(run, report, factor);
    run.rows.push_back(rowAt(factor, report));
  }
}

void StaticsRunner::runPath(const PathConfig& path, StaticsRun& run)
{
  constexpr int kMostTimes = 20;   // longer paths than so many times their scale wander off, or go round in circles
  const double range = path.to - path.from;
  RodStepper& stepper = this->stepper();
  RodState& state = state_.rods[0];
  const StepReport first = stepper.solveEquilibrium(state, loadsAt(0, path.from), false);
  if (!first.ok)
    return fail(run, first, path.from);
  run.rows.push_back(rowAt(path.from, first));
  RodPath walk(world_.model().rods[0].model, state, loadsAt(0, path.from), loadsPerFactor(0, range), 1.0);
  for (int k = 0; k < kMostTimes * path.steps; ++k)
  {
    const StepReport moved = walk.advance(1.0 / path.steps);
    if (moved.ok && walk.factor() > 1.0)
      walk.settleAt(1.0);   // where that fails, the path ends just beyond
    const double factor = path.from + walk.factor() * range;
    if (!moved.ok)
      return fail(run, atFactor(factor) + moved.message);
    state = walk.state();
    StepReport report = stepper.assessEquilibrium(state, loadsAt(0, factor));
    report.iterations = moved.iterations;
    run.rows.push_back(rowAt(factor, report));
    if (walk.factor() >= 1.0)
      return;
  }
  fail(run, "statics.path: the path has become " + std::to_string(kMostTimes) +
                " times as long as its scale without reaching factor " + shortNumber(path.to, 6) +
                "; it ends at factor " + shortNumber(run.rows.back().factor, 6));
}

/// Follows the path from factor 0 until its equilibria are unstable, or the factor turns back; then bisects.
void StaticsRunner::findCritical(double up_to, StaticsRun& run)
{
  constexpr int kMostSteps = 1000;
  // far below the mesh's error; the neutral band of eigenvalues is 1e-6 of a bending frequency squared
  constexpr double kRelative = 1e-7;
  RodStepper& stepper = this->stepper();
  const RodModel& model = *world_.model().rods[0].model;
  RodState safe = state_.rods[0];
  const StepReport first = stepper.solveEquilibrium(safe, loadsAt(0, 0.0), false);
  if (!first.ok || !first.stable)
  {
    return fail(run, "statics.buckling: " + (first.ok ? "the equilibrium without the load (factor 0) is unstable"
                                                      : atFactor(0) + first.message));
  }
  const RodInputs unit = loadsPerFactor(0, 1.0);
  const double length = model.rest_length.sum(),
               bend = std::max(model.bend_modulus.row(0).maxCoeff(), model.bend_modulus.row(2).maxCoeff());
  const double scale = std::min(up_to, 10.0 * bend / (length * length * sumOfLoads(model, unit)));
  double low = 0.0, before = 0.0, high = 0.0, share = 0.02;
  RodPath walk(world_.model().rods[0].model, safe, loadsAt(0, 0.0), unit, scale);
  for (int k = 0;; ++k, share *= 1.1)
  {
    const StepReport moved = walk.advance(share);
    if (!moved.ok || low >= up_to || k == kMostSteps)
    {
      return fail(run,
                  "statics.buckling: " + (moved.ok ? "no critical load was found up to factor " + shortNumber(low, 6)
                                                   : atFactor(low) + moved.message));
    }
    high = walk.factor();
    if (high <= low || !stepper.assessEquilibrium(walk.state(), loadsAt(0, high)).stable)
      break;
    before = low;
    low = high;
    safe = walk.state();
  }
  // what is further away is another path
  const double reach = 2.0 * largestDistance(walk.state().x, safe.x) + 1e-6 * length;
  CriticalLoad critical;
  critical.fold = true;
  high = high > low ? high : low + 2.0 * (low - before);
  while (high - low > kRelative * high)
  {
    const double middle = 0.5 * (low + high);
    RodPath probe(world_.model().rods[0].model, safe, loadsAt(0, low), unit, scale);
    const bool near = probe.settleAt(middle - low).ok && largestDistance(probe.state().x, safe.x) <= reach;
    if (near && stepper.assessEquilibrium(probe.state(), loadsAt(0, middle)).stable)
    {
      low = middle;
      safe = probe.state();
      continue;
    }
    critical.fold = critical.fold && !near;
    high = middle;
  }
  critical.factor = low;
  critical.beyond = high;
  std::swap(state_.rods[0], safe);
  critical.at = rowAt(low, stepper.assessEquilibrium(state_.rods[0], loadsAt(0, low)));
  std::swap(state_.rods[0], safe);
  run.critical = std::move(critical);
}

}   // namespace slender
