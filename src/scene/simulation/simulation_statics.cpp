// Statics of a scene: the equilibrium from which it starts, equilibria under growing loads, and the load at which they
// cease to be stable.
#include <algorithm>
#include <cmath>
#include <cstdio>

#include "slender_sim/rod/rod_path.h"
#include "slender_sim/scene/reader.h"
#include "slender_sim/scene/simulation.h"

namespace slender {

namespace {

std::string shortText(double value)
{
  char text[40];
  std::snprintf(text, sizeof text, "%.6g", value);
  return text;
}

double largestDistance(const Eigen::Matrix3Xd& a, const Eigen::Matrix3Xd& b)
{
  return (a - b).colwise().norm().maxCoeff();
}

void fail(StaticsRun& run, const std::string& message)
{
  run.end.ok = false;
  run.end.failure = StepFailure::newton_diverged;
  run.end.message = message;
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

}   // namespace

void Simulation::findEquilibrium()
{
  checkHasStatics();
  takeStaticInputs();
  const StepReport report = solveStatics(1.0);
  if (!report.ok)
  {
    throw SimulationError("start: equilibrium: " + report.message +
                          " (start: as_given starts from the shape in the scene)");
  }
  if (!report.stable)
  {
    const std::string unstable = "start: equilibrium: the equilibrium is unstable (lowest eigenvalue " +
                                 shortText(report.lowest_eigenvalue) + " 1/s^2), and no stable one was reached from it";
    if (!config_.start.accept_unstable)
    {
      throw SimulationError(
          unstable +
          ": start from a shape that is nearer to the stable equilibrium (initial), or hold what drifts by a grasp "
          "(start: as_given starts from the shape in the scene; start: {equilibrium: true, accept_unstable: true} "
          "starts from the unstable equilibrium)");
    }
    config_.warnings.push_back(unstable + ": start.accept_unstable starts from it all the same");
  }
  start_report_ = report;
  takeWrenches();
}

void Simulation::checkHasStatics() const
{
  const std::string where = config_.file.empty() ? "scene " + config_.name : config_.file;
  for (const ClothConfig& cloth : config_.cloths)
  {
    if (cloth.tracking || cloth.contact)
    {
      throw SceneError(where + ": statics is not for cloth that " +
                       (cloth.tracking ? "tracks a guide" : "has contact") + ", as cloth " + cloth.name +
                       " does; let it settle by time stepping with damping");
    }
  }
  for (const RodConfig& rod : config_.rods)
    if (rod.tracking)
      throw SceneError(where + ": statics is not for rods that track a guide, as rod " + rod.name + " does");
  if (config_.rods.empty() && config_.cloths.empty() && !group_)
  {
    throw SceneError(where +
                     ": statics needs a rod, a cloth or a simulated body; threads flow, and have no equilibrium");
  }
}

/// Grasps, bodies and obstacles as their motions have them at time 0.
void Simulation::takeStaticInputs()
{
  inputsAt(0.0, static_inputs_);
  fillRodInputs(static_inputs_);
  fillClothInputs(static_inputs_);
}

Eigen::Vector3d Simulation::gravityAt(double factor) const
{
  const bool scaled = !config_.statics || config_.statics->scales != FactorScales::loads;
  return (scaled ? factor : 1.0) * config_.gravity;
}

/// All inputs of a rod at a load factor, with the imperfection; takeStaticInputs() comes before.
RodInputs Simulation::loadsAt(int rod, double factor) const
{
  const bool scaled = !config_.statics || config_.statics->scales != FactorScales::gravity;
  RodInputs inputs = rod_inputs_[rod];
  inputs.gravity = gravityAt(factor);
  inputs.forces = (scaled ? factor : 1.0) * rod_loads_[rod].forces;
  inputs.torques = (scaled ? factor : 1.0) * rod_loads_[rod].torques;
  if (imperfection_.cols() > 0)
    inputs.forces = inputs.forces.cols() > 0 ? Eigen::Matrix3Xd(inputs.forces + imperfection_) : imperfection_;
  return inputs;
}

/// What the load factor multiplies, times `factor`.
RodInputs Simulation::loadsPerFactor(int rod, double factor) const
{
  const FactorScales scales = config_.statics ? config_.statics->scales : FactorScales::all;
  RodInputs inputs;
  inputs.gravity = scales == FactorScales::loads ? Eigen::Vector3d(0, 0, 0) : Eigen::Vector3d(factor * config_.gravity);
  if (scales != FactorScales::gravity)
  {
    inputs.forces = factor * rod_loads_[rod].forces;
    inputs.torques = factor * rod_loads_[rod].torques;
  }
  return inputs;
}

/// The stable equilibrium that is reached from the present state under loads of this factor.
StepReport Simulation::solveStatics(double factor)
{
  std::vector<Twist> velocities;
  for (const RigidBodyState& body : state_.bodies)
    velocities.push_back(body.velocity);
  gravity_ = gravityAt(factor);
  StepReport report;
  for (std::size_t r = 0; r < steppers_.size() && report.ok; ++r)
  {
    const RodInputs loads = loadsAt(static_cast<int>(r), factor);
    if (steppers_[r])
      report.merge(steppers_[r]->solveEquilibrium(state_.rods[r], loads));
    else
      rod_inputs_[r] = loads;   // the group takes them from here
  }
  if (report.ok && group_)
    report.merge(stepGroup(static_inputs_, true));
  if (report.ok)
    report.merge(solveCloths(factor));
  gravity_ = config_.gravity;
  if (config_.start.keep_velocities)
    for (std::size_t b = 0; b < velocities.size(); ++b)
      state_.bodies[b].velocity = velocities[b];
  return report;
}

/// The stable equilibria of all cloths under loads of this factor; the state is where the search begins.
/// fillClothInputs() comes before.
StepReport Simulation::solveCloths(double factor)
{
  StepReport total;
  const bool scaled = !config_.statics || config_.statics->scales != FactorScales::gravity;
  for (std::size_t k = 0; k < cloth_steppers_.size() && total.ok; ++k)
  {
    ClothInputs loads = cloth_inputs_[k];
    loads.gravity = gravityAt(factor);
    loads.forces *= scaled ? factor : 1.0;
    total.merge(cloth_steppers_[k]->solveEquilibrium(state_.cloths[k].cloth, loads));
  }
  if (total.ok)
    takeClothWrenches();
  return total;
}

/// The present state as a row.
StaticsRow Simulation::rowAt(double factor, const StepReport& report) const
{
  StaticsRow row;
  row.factor = factor;
  row.report = report;
  for (std::size_t r = 0; r < steppers_.size(); ++r)
  {
    row.nodes.push_back(state_.rods[r].x);
    row.modes.push_back(steppers_[r] ? Eigen::Matrix4Xd(steppers_[r]->lowestMode()) : Eigen::Matrix4Xd(4, 0));
    row.displacement = std::max(row.displacement, largestDistance(state_.rods[r].x, initial_.rods[r].x));
  }
  for (std::size_t k = 0; k < state_.cloths.size(); ++k)
  {
    row.displacement =
        std::max(row.displacement, largestDistance(state_.cloths[k].cloth.x, initial_.cloths[k].cloth.x));
  }
  return row;
}

StaticsRun Simulation::runStatics()
{
  checkHasStatics();
  takeStaticInputs();
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
    takeWrenches();
  return run;
}

/// Forces along the lowest mode of the equilibrium at the first factor, which need not be stable.
void Simulation::perturb(double first_factor, StaticsRun& run)
{
  RodState state = state_.rods[0];
  run.end.merge(steppers_[0]->solveEquilibrium(state, loadsAt(0, first_factor), false));
  if (!run.end.ok)
    return;
  const Eigen::Matrix3Xd mode = steppers_[0]->lowestMode().topRows<3>();
  const double size = mode.colwise().norm().sum();
  if (!(size > 0))
  {
    fail(run,
         "statics.perturbation: the lowest mode of the first equilibrium moves no node, so that no force lies along "
         "it; leave perturbation out");
    return;
  }
  imperfection_ = config_.statics->perturbation * sumOfLoads(*models_[0], loadsPerFactor(0, 1.0)) / size * mode;
}

void Simulation::runFactors(const std::vector<double>& factors, StaticsRun& run)
{
  for (const double factor : factors)
  {
    const StepReport report = solveStatics(factor);
    if (!report.ok)
    {
      run.end = report;
      run.end.message = "load factor " + shortText(factor) + ": " + report.message;
      return;
    }
    run.rows.push_back(rowAt(factor, report));
  }
}

void Simulation::runPath(const PathConfig& path, StaticsRun& run)
{
  constexpr int kMostTimes = 20;   // longer paths than so many times their scale wander off, or go round in circles
  const double range = path.to - path.from;
  RodStepper& stepper = *steppers_[0];
  RodState& state = state_.rods[0];
  const StepReport first = stepper.solveEquilibrium(state, loadsAt(0, path.from), false);
  if (!first.ok)
  {
    run.end = first;
    run.end.message = "load factor " + shortText(path.from) + ": " + first.message;
    return;
  }
  run.rows.push_back(rowAt(path.from, first));
  RodPath walk(models_[0], state, loadsAt(0, path.from), loadsPerFactor(0, range), 1.0);
  for (int k = 0; k < kMostTimes * path.steps; ++k)
  {
    const StepReport moved = walk.advance(1.0 / path.steps);
    if (moved.ok && walk.factor() > 1.0)
      walk.settleAt(1.0);   // where that fails, the path ends just beyond
    if (!moved.ok)
    {
      fail(run, "load factor " + shortText(path.from + walk.factor() * range) + ": " + moved.message);
      return;
    }
    const double factor = path.from + walk.factor() * range;
    state = walk.state();
    StepReport report = stepper.assessEquilibrium(state, loadsAt(0, factor));
    report.iterations = moved.iterations;
    run.rows.push_back(rowAt(factor, report));
    if (walk.factor() >= 1.0)
      return;
  }
  fail(run, "statics.path: the path has become " + std::to_string(kMostTimes) +
                " times as long as its scale without reaching factor " + shortText(path.to) + "; it ends at factor " +
                shortText(run.rows.back().factor));
}

/// Follows the path from factor 0 until its equilibria are unstable, or the factor turns back; then bisects.
void Simulation::findCritical(double up_to, StaticsRun& run)
{
  constexpr int kMostSteps = 1000;
  // far below the mesh's error; the neutral band of eigenvalues is 1e-6 of a bending frequency squared
  constexpr double kRelative = 1e-7;
  RodStepper& stepper = *steppers_[0];
  const RodModel& model = *models_[0];
  RodState safe = state_.rods[0];
  const StepReport first = stepper.solveEquilibrium(safe, loadsAt(0, 0.0), false);
  if (!first.ok || !first.stable)
  {
    fail(run, "statics.buckling: " + (first.ok ? std::string("the equilibrium without the load (factor 0) is unstable")
                                               : "load factor 0: " + first.message));
    return;
  }
  const RodInputs unit = loadsPerFactor(0, 1.0);
  const double length = model.rest_length.sum(),
               bend = std::max(model.bend_modulus.row(0).maxCoeff(), model.bend_modulus.row(2).maxCoeff());
  const double scale = std::min(up_to, 10.0 * bend / (length * length * sumOfLoads(model, unit)));
  double low = 0.0, before = 0.0, high = 0.0, share = 0.02;
  RodPath walk(models_[0], safe, loadsAt(0, 0.0), unit, scale);
  for (int k = 0;; ++k, share *= 1.1)
  {
    const StepReport moved = walk.advance(share);
    if (!moved.ok || low >= up_to || k == kMostSteps)
    {
      fail(run, "statics.buckling: " + (moved.ok ? "no critical load was found up to factor " + shortText(low)
                                                 : "load factor " + shortText(low) + ": " + moved.message));
      return;
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
    RodPath probe(models_[0], safe, loadsAt(0, low), unit, scale);
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
