#include "stability.h"

#include <algorithm>
#include <cmath>
#include <optional>
#include <stdexcept>

#include "slender_sim/scene/reader.h"
#include "slender_sim/study/cpu_clock.h"

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

void StabilityCell::compare(const Matrix3Xd& end, const Matrix3Xd& fine_end, double fine_moved, double size)
{
  fine_distance = (end - fine_end).colwise().norm().maxCoeff() / (fine_moved + 1e-2 * size);
  if (!(fine_distance <= 1))
    complaint = "ends farther from a run with a quarter of the step than that has moved";
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
  for (const char* metric : {"nan_count", "unexplained_failures", "silently_wrong", "done", "cut", "refused"})
    context.metric(metric, 0);
  context.note("done: every step at once; cut: some in shorter steps; refused: the step said why and left the state alone. UNSOUND: a state that "
               "is not finite, a refusal without a reason or with a changed state (unexplained_failures); energy out of nothing, a step called done with forces unbalanced "
               "by a tenth of the largest, or (silently_wrong; fine_distance > 1, maps) an end that is further from that of a run with a quarter of the step than that run has ever moved, "
               "with a hundredth of the size allowed besides.");
}

void StabilityTally::record(Row& row, const StabilityCell& cell)
{
  const Outcome outcome = cell.outcome();
  ++count_[static_cast<int>(outcome)];
  not_finite_ += cell.finite ? 0 : 1;
  unexplained_ += cell.explained ? 0 : 1;
  row.set("outcome", toString(outcome)).set("steps", cell.steps).set("cuts", cell.cuts).set("residual", cell.residual).set("energy_growth", cell.energy_growth)
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
  context_.metric("done", count_[static_cast<int>(Outcome::done)]);
  context_.metric("cut", count_[static_cast<int>(Outcome::cut)]);
  context_.metric("refused", count_[static_cast<int>(Outcome::refused)]);
}

namespace {

/// Nodes or vertices of the scene's object, and their velocities.
void gather(const SceneState& state, Matrix3Xd& x, Matrix3Xd& v)
{
  if (!state.rods.empty())
  {
    x = state.rods[0].x;
    v = state.rods[0].v;
  }
  else if (!state.cloths.empty())
  {
    x = state.cloths[0].cloth.x;
    v = state.cloths[0].cloth.v;
  }
  else
  {
    const ThreadState& t = state.threads[0].threads[0];
    x.resize(3, t.nodes());
    v.resize(3, t.nodes());
    for (int i = 0; i < t.nodes(); ++i)
    {
      x.col(i) = t.x[i];
      v.col(i) = t.v[i];
    }
  }
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
    for (int j = 0; j < t.edges(); ++j)
    {
      const double mass = config.threads[0].density * t.volume[j], length = (t.x[j + 1] - t.x[j]).norm();
      e.mass += mass;
      for (const int i : {j, j + 1})
        e.now += 0.5 * mass * (0.5 * t.v[i].squaredNorm() - config.gravity.dot(t.x[i]));
      e.now += config.threads[0].surface_tension * 2.0 * std::sqrt(M_PI * t.volume[j] * length);
    }
  return e;
}

struct Run
{
  StabilityCell cell;
  Matrix3Xd end;
  double moved = 0, size = 0;   ///< the farthest that a node has been from its start; of the object [m]
};

Run run(const MapScene& scene, double step, int steps)
{
  Run r;
  std::optional<Simulation> simulation;
  try
  {
    simulation.emplace(parseScene(scene.yaml, "map.yaml", {"time={step: " + std::to_string(step * 1e6) + "e-6, duration: 1}"}));
  }
  catch (const std::exception& refusal)
  {
    r.cell.refuseAtOnce(refusal.what());
    return r;
  }
  simulation->setThreads(1);
  const auto& cloths = simulation->config().cloths;
  r.cell.linear_steps = !cloths.empty() && cloths[0].one_newton_step;
  Matrix3Xd start, x, v, x_before, v_before;
  gather(simulation->state(), start, v);
  r.size = (start.rowwise().maxCoeff() - start.rowwise().minCoeff()).norm();
  const Energy at_start = energyOf(*simulation);
  const Matrix3Xd guide = simulation->state().cloths.empty() ? Matrix3Xd() : simulation->state().cloths[0].guide;
  // What there is to give: the fall through its own size, its motion and deformation, and what the guide puts in.
  const double g = simulation->config().gravity.norm(), rise = scene.lift * step * steps;
  const double scale = at_start.mass * g * (r.size + rise) + at_start.mass * scene.lift * scene.lift + 1e-12;
  const double begin = threadSeconds();
  x = start;
  for (int k = 0; k < steps; ++k)
  {
    x_before = x;
    v_before = v;
    SceneInputs inputs = simulation->defaultInputs();
    if (scene.lift != 0)
      inputs.guides.at(0) = guide.colwise() + Vector3d(0, 0, scene.lift * step * (k + 1));
    const StepReport report = simulation->step(inputs);
    gather(simulation->state(), x, v);
    const bool same = x.cols() == x_before.cols() && x == x_before && v == v_before;
    const Energy now = energyOf(*simulation);
    if (!r.cell.took(report, x.allFinite() && v.allFinite() && std::isfinite(now.now), same))
      break;
    if (x.cols() == start.cols())
      r.moved = std::max(r.moved, (x - start).colwise().norm().maxCoeff());
    if (!r.cell.energyIs((now.now - at_start.now) / scale, scene.lift != 0 ? 1.0 : 1e-2))
      break;
  }
  r.end = x;
  r.cell.cpu_seconds = threadSeconds() - begin;
  return r;
}

}  // namespace

StabilityCell runScene(const MapScene& scene, double step, int steps)
{
  Run coarse = run(scene, step, steps);
  if (coarse.cell.outcome() != Outcome::done && coarse.cell.outcome() != Outcome::cut)
    return coarse.cell;
  const Run fine = run(scene, step / 4, 4 * steps);
  const Outcome there = fine.cell.outcome();
  if ((there == Outcome::done || there == Outcome::cut) && fine.end.cols() == coarse.end.cols())
    coarse.cell.compare(coarse.end, fine.end, fine.moved, fine.size);
  return coarse.cell;
}

void stabilityMap(StudyContext& context, StabilityTally& tally, const std::string& name, const std::string& quantity, const std::vector<double>& values,
                  const std::vector<double>& step_lengths, int steps, const std::function<MapScene(double)>& scene)
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

}  // namespace slender::study
