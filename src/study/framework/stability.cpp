#include "stability.h"

#include <algorithm>
#include <cmath>
#include <optional>
#include <stdexcept>

#include "slender_sim/scene/reader.h"
#include "study/framework/cpu_clock.h"
#include "slender_sim/scene/state_bytes.h"
#include "slender_sim/thread/thread_surface.h"

namespace slender::study {

using Eigen::Matrix3Xd;
using Eigen::Vector3d;

const char* toString(Outcome outcome)
{
  switch (outcome)
  {
    case Outcome::done: return "done";
    case Outcome::cut: return "cut";
    case Outcome::refused: return "refused";
    case Outcome::unsound: break;
  }
  return "UNSOUND";
}

bool StabilityCell::took(const StepReport& report, bool state_finite, bool unchanged)
{
  cuts += report.cut_steps;
  substeps += report.substeps;
  iterations += report.iterations;
  if (!state_finite)
  {
    finite = explained = false;
    complaint = "state is not finite";
    return false;
  }
  if (!report.ok)
  {
    refused = true;
    reason = report.message;
    if (report.message.empty())
      complaint = "refused without a reason";
    else if (!unchanged)
      complaint = "refused, but the state has changed";
    explained = complaint.empty();
    return false;
  }
  ++steps;
  residual = std::max(residual, report.residual);
  max_strain = std::max(max_strain, report.max_strain);
  end_strain = report.max_strain;
  if (!linear_steps && !(report.residual <= kResidualMet))
    complaint = "done, but with forces unbalanced by " + std::to_string(report.residual) + " of the largest";
  return complaint.empty();
}

bool StabilityCell::energyIs(double growth, double allowed)
{
  energy_growth = std::max(energy_growth, growth);
  if (!(growth <= allowed))
    complaint = "energy grew by " + std::to_string(growth) + " of what there was";
  return complaint.empty();
}

Path::Path(const Matrix3Xd& start) : x{start}, size((start.rowwise().maxCoeff() - start.rowwise().minCoeff()).norm()) {}

double Path::moved() const
{
  double farthest = 0;
  for (const Matrix3Xd& now : x)
    if (now.cols() == x[0].cols())
      farthest = std::max(farthest, (now - x[0]).colwise().norm().maxCoeff());
  return farthest;
}

void StabilityCell::compare(const Path& path, const Path& fine)
{
  constexpr double kFar = 0.5;   // 1 where nothing moves that should
  const std::size_t often = (fine.x.size() - 1) / (path.x.size() - 1);
  const double allowed = fine.moved() + 1e-2 * fine.size;
  for (std::size_t k = 1; k < path.x.size(); ++k)
    if (path.x[k].cols() == fine.x[often * k].cols())
      fine_distance = std::max(fine_distance, (path.x[k] - fine.x[often * k]).colwise().norm().maxCoeff() / allowed);
  if (!(fine_distance <= kFar))
    complaint = "goes another way than a run with a quarter of the step";
}

void StabilityCell::refuseAtOnce(const std::string& why)
{
  refused = true;
  reason = why;
  if (why.empty())
  {
    complaint = "refused without a reason";
    explained = false;
  }
}

Outcome StabilityCell::outcome() const
{
  return !complaint.empty() ? Outcome::unsound : refused ? Outcome::refused : cuts > 0 ? Outcome::cut : Outcome::done;
}

StabilityTally::StabilityTally(StudyContext& context) : context_(context)
{
  for (const char* metric :
       {"nan_count", "unexplained_failures", "silently_wrong", "not_compared", "done", "cut", "refused"})
    context.metric(metric, 0);
  context.note(
      "done: every step at once; cut: some in shorter steps; refused: the step said why and left the state alone. "
      "UNSOUND: a state that "
      "is not finite, a refusal without a reason or with a changed state (unexplained_failures); energy out of "
      "nothing, a step called done with forces unbalanced "
      "by a tenth of the largest, or (silently_wrong; fine_distance > 0.5, maps) another way than that of a run with a "
      "quarter of the step: farther from it after a step than half as "
      "far as that run ever moves, with a hundredth of the size allowed besides. not_compared: cells done or cut "
      "without that comparison (those beside the maps, and where the "
      "finer run is refused).");
}

void StabilityTally::record(Row& row, const StabilityCell& cell)
{
  const Outcome outcome = cell.outcome();
  ++count_[static_cast<int>(outcome)];
  not_finite_ += cell.finite ? 0 : 1;
  unexplained_ += cell.explained ? 0 : 1;
  not_compared_ += (outcome == Outcome::done || outcome == Outcome::cut) && cell.fine_distance < 0 ? 1 : 0;
  row.set("outcome", toString(outcome))
      .set("steps", cell.steps)
      .set("cuts", cell.cuts)
      .set("residual", cell.residual)
      .set("energy_growth", cell.energy_growth)
      .set("max_strain", cell.max_strain);
  if (cell.fine_distance >= 0)
    row.set("fine_distance", cell.fine_distance);
  row.set("cpu_seconds", cell.cpu_seconds);
  const std::string reason = cell.complaint + (cell.complaint.empty() || cell.reason.empty() ? "" : ": ") + cell.reason;
  if (!reason.empty())
    row.set("reason", reason);
  context_.metric("nan_count", not_finite_);
  context_.metric("unexplained_failures", unexplained_);
  context_.metric("silently_wrong", count_[static_cast<int>(Outcome::unsound)] - unexplained_);
  context_.metric("not_compared", not_compared_);
  context_.metric("done", count_[static_cast<int>(Outcome::done)]);
  context_.metric("cut", count_[static_cast<int>(Outcome::cut)]);
  context_.metric("refused", count_[static_cast<int>(Outcome::refused)]);
}

namespace {

/// Nodes or vertices of the scene's object.
Matrix3Xd positions(const SceneState& state)
{
  if (!state.rods.empty())
    return state.rods[0].x;
  if (!state.cloths.empty())
    return state.cloths[0].x;
  const ThreadState& t = state.threads[0].threads[0];
  return Eigen::Map<const Matrix3Xd>(t.x[0].data(), 3, t.nodes());
}

struct Energy
{
  double now = 0, mass = 0;
};

Energy energyOf(const Simulation& simulation)
{
  const SceneState& state = simulation.state();
  const SceneConfig& config = simulation.config();
  if (!state.rods.empty())
    return {simulation.energies(0).total(), simulation.rodModel(0).totalMass()};
  if (!state.cloths.empty())
    return {simulation.clothEnergies(0).total(), simulation.clothModel(0).mass.sum()};
  // A thread stores none but by its motion, weight and surface.
  Energy e;
  for (const ThreadState& t : state.threads[0].threads)
  {
    e.now += config.threads[0].surface_tension * surfaceArea(t);
    for (int j = 0; j < t.edges(); ++j)
    {
      const double mass = config.threads[0].density * t.volume[j];
      e.mass += mass;
      for (const int i : {j, j + 1})
        e.now += 0.5 * mass * (0.5 * t.v[i].squaredNorm() - config.gravity.dot(t.x[i]));
    }
  }
  return e;
}

struct Run
{
  StabilityCell cell;
  std::optional<Path> path;            ///< none of what cannot be set up
  std::vector<double> energy, scale;   ///< per step [J]; of what there is to give
};

constexpr int kAlong = 64;

/// Of a guide that moves far in a step the force at the end says little about its work. Then `along`, the same motion
/// in kAlong times as many steps, as far as that goes, has the energy that the guide has given; null: the end of the
/// step counts.
Run run(const MapScene& scene, double step, int steps, const Run* along = nullptr)
{
  Run r;
  std::optional<Simulation> simulation;
  try
  {
    simulation.emplace(
        parseScene(scene.yaml, "map.yaml", {"time={step: " + std::to_string(step * 1e6) + "e-6, duration: 1}"}));
  }
  catch (const std::exception& refusal)
  {
    r.cell.refuseAtOnce(refusal.what());
    return r;
  }
  simulation->setThreads(1);
  const auto& cloths = simulation->config().cloths;
  r.cell.linear_steps = !cloths.empty() && cloths[0].one_newton_step;
  r.path.emplace(positions(simulation->state()));
  const Energy start = energyOf(*simulation);
  const TrackingConfig* tracking = scene.guide ? cloths[0].tracking.get() : nullptr;
  Matrix3Xd guide, averages;
  if (tracking)
  {
    guide = tracking->guide.mesh.vertices;
    averages = simulation->functions({ObjectRef::cloth, 0}).constraints->averages(guide);
  }
  // What there is to give: the fall through its own size, and what the guide puts in.
  double work = 0, scale = start.mass * simulation->config().gravity.norm() * r.path->size + 1e-12;
  const double begin = threadSeconds();
  for (int k = 0; k < steps; ++k)
  {
    const std::size_t there = static_cast<std::size_t>(kAlong * (k + 1) - 1);
    if (along && there >= along->energy.size())
      break;
    const SceneState before = simulation->state();
    SceneInputs inputs = simulation->defaultInputs();
    if (tracking)
      inputs.guides.at(0) = scene.guide(guide, step * (k + 1));
    const StepReport report = simulation->step(inputs);
    const SceneState& state = simulation->state();
    const Energy now = energyOf(*simulation);
    if (!r.cell.took(report, allFinite(state) && std::isfinite(now.now), stateBytes(before) == stateBytes(state)))
      break;
    r.path->x.push_back(positions(state));
    if (tracking)
    {
      const Matrix3Xd reached =
          simulation->functions({ObjectRef::cloth, 0}).constraints->averages(state.cloth_guides[0].points);
      const double given = (reached - averages).cwiseProduct(state.cloth_guides[0].forces).sum();
      averages = reached;
      work += given;
      scale += std::abs(given);
    }
    r.energy.push_back(now.now);
    r.scale.push_back(scale);
    const double growth =
        along ? (now.now - along->energy[there]) / along->scale[there] : (now.now - start.now - work) / scale;
    // one step and many may end in folds that differ by a little of what there is
    if (!r.cell.energyIs(growth, r.cell.linear_steps || along ? 1e-2 : energyGrowth(Integrator::implicit_euler)))
      break;
  }
  r.cell.cpu_seconds = threadSeconds() - begin;
  return r;
}

}   // namespace

StabilityCell runScene(const MapScene& scene, double step, int steps)
{
  Run coarse = run(scene, step, steps);
  if (scene.guide && coarse.cell.complaint.find("energy") != std::string::npos)
  {
    Run along = run(scene, step / kAlong, kAlong * steps);
    if (!along.cell.complaint.empty() && !along.energy.empty())
      along.energy.pop_back();
    if (along.energy.size() >= kAlong * coarse.energy.size())
      coarse = run(scene, step, steps, &along);
  }
  if (coarse.cell.outcome() != Outcome::done && coarse.cell.outcome() != Outcome::cut)
    return coarse.cell;
  const Run fine = run(scene, step / 4, 4 * steps);
  const Outcome there = fine.cell.outcome();
  if (there == Outcome::done || there == Outcome::cut)
    coarse.cell.compare(*coarse.path, *fine.path);
  return coarse.cell;
}

void stabilityMap(StudyContext& context, StabilityTally& tally, const std::string& name, const std::string& quantity,
                  const std::vector<double>& values, const std::vector<double>& step_lengths, int steps,
                  const std::function<MapScene(double)>& scene)
{
  Plot& plot = context.plot(name, "Outcome over " + quantity + " and step", quantity, "step [s]");
  plot.lines = false;
  int done = 0;
  for (const double value : values)
    for (const double step : step_lengths)
    {
      context.progress(done++, static_cast<int>(values.size() * step_lengths.size()), name);
      const StabilityCell cell = runScene(scene(value), step, steps);
      tally.record(context.row().set("case", "map of " + quantity).set("value", value).set("step_s", step), cell);
      Series& series = plot.at(toString(cell.outcome()));
      series.x.push_back(value);
      series.y.push_back(step);
    }
}

void sheetMaps(StudyContext& context, StabilityTally& tally, const std::string& study, double side,
               const std::function<MapScene(double youngs_modulus, double thickness)>& scene)
{
  using Values = std::vector<double>;
  const bool quick = context.quick();
  const Values step_lengths = quick ? Values{1e-3, 1.0 / 30} : Values{1e-4, 1e-3, 1e-2, 1.0 / 30, 0.1};
  const int steps = quick ? 5 : 15;
  stabilityMap(context, tally, study + "_stiffness", "Young's modulus [Pa]",
               quick ? Values{1e4, 1e8} : Values{1e2, 1e4, 1e5, 1e6, 1e7, 1e8, 1e10}, step_lengths, steps,
               [&](double modulus) { return scene(modulus, 5e-4); });
  stabilityMap(context, tally, study + "_slenderness", "thickness over side",
               quick ? Values{1e-4, 1e-2} : Values{1e-5, 1e-4, 1e-3, 1e-2, 0.1}, step_lengths, steps,
               [&](double slenderness) { return scene(1e6, slenderness * side); });
}

}   // namespace slender::study
