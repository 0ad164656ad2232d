// Viscous threads under whatever may be asked of them: done or refused with a reason, never NaN, no fluid lost, bounded
// memory.
#include <algorithm>
#include <cmath>
#include <cstdio>
#include <functional>
#include <string>
#include <vector>

#include "slender_sim/scene/reader.h"
#include "slender_sim/scene/state_bytes.h"
#include "study/framework/cpu_clock.h"
#include "slender_sim/world/world.h"
#include "study/framework/stability.h"
#include "thread_cases.h"

namespace slender::study {
namespace {

struct Verdict
{
  StabilityCell cell;
  int folds = 0;
  std::size_t most_nodes = 0, most_threads = 0;
  double volume_drift = 0;
};

bool isFinite(const ThreadGroupState& s)
{
  bool finite = std::isfinite(s.volumeBalance());
  for (const ThreadState& t : s.threads)
  {
    for (int i = 0; i < t.nodes(); ++i)
      finite = finite && t.x[i].allFinite() && t.v[i].allFinite() && std::isfinite(t.twist[i]);
    for (int j = 0; j < t.edges(); ++j)
      finite = finite && t.d1[j].allFinite() && std::isfinite(t.spin[j]) && t.volume[j] > 0;
  }
  return finite;
}

std::size_t nodesOf(const ThreadGroupState& s)
{
  std::size_t sum = 0;
  for (const ThreadState& t : s.threads)
    sum += t.x.size();
  return sum;
}

using Motion = std::function<void(double time, ThreadInputs& inputs)>;

/// Runs `steps` steps of h; `motion` sets the inputs for the end of each.
Verdict run(const ThreadSetup& setup, double h, int steps, const Motion& motion)
{
  Verdict v;
  WorldModel model;
  model.time.step = h;
  model.threads.push_back({std::make_shared<ThreadModel>(setup.model), {}, 0.0});
  WorldState whole;
  whole.threads.resize(1);
  whole.end_loads.resize(1);
  WorldInputs all;
  all.threads = {setup.inputs};
  World world(model, whole);
  ThreadGroupState& state = whole.threads[0];
  ThreadInputs& inputs = all.threads[0];
  state.threads = {setup.state};
  const double start = state.volumeBalance(), begin = threadSeconds();
  double fed = 0.0;
  for (int k = 0; k < steps; ++k)
  {
    motion((k + 1) * h, inputs);
    const ThreadGroupState before = state;
    const StepReport report = world.step(whole, all);
    v.folds += report.mended_folds;
    if (!v.cell.took(report, isFinite(state), stateBytes(before) == stateBytes(state)))
      break;
    fed += inputs.flow_rate * h;
    v.most_nodes = std::max(v.most_nodes, nodesOf(state));
    v.most_threads = std::max(v.most_threads, state.threads.size());
    v.volume_drift = std::max(v.volume_drift, std::abs(state.volumeBalance() - start) / (start + fed));
  }
  v.cell.cpu_seconds = threadSeconds() - begin;
  return v;
}

/// Poured from a nozzle of 5 mm, 10 cm above a floor.
ThreadSetup pouredThread(double viscosity, double surface_tension, double speed = 0.05)
{
  ThreadModel m;
  m.name = "poured";
  m.density = 1000;
  m.viscosity = viscosity;
  m.surface_tension = surface_tension;
  m.nozzle_diameter = 5e-3;
  m.feed_length = 3e-3;
  m.floor.present = true;
  m.limits.max_edge_length = 5e-3;
  m.limits.min_edge_length = 5e-4;
  m.limits.min_radius = 2e-5;
  m.limits.max_deposited = 100;
  m.limits.scene.min() = Eigen::Vector3d(-0.5, -0.5, -0.1);
  m.limits.scene.max() = Eigen::Vector3d(0.5, 0.5, 1.0);
  ThreadSetup t = nozzleThread(m, {0, 0, 0.1}, speed);
  t.state.x[0].x() += 1e-4;
  t.state.v[0].y() += 1e-4;
  return t;
}

/// The same by a scene that says nothing of edges, deposits and break-up. A scene that is refused is a cell that is.
Verdict pourByDefaults(double viscosity, double surface_tension, double h, int steps)
{
  char text[500];
  std::snprintf(
      text, sizeof text,
      "time: {step: %g, duration: 1}\nthreads:\n  - fluid: {density: 1000, viscosity: %g, surface_tension: %g}\n"
      "    nozzle: {position: [0, 0, 0.1], diameter: 5e-3, flow: 1e-6}\n    floor: {height: 0}\n",
      h, viscosity, surface_tension);
  Verdict v;
  try
  {
    const Simulation scene(parseScene(text, "poured"));
    ThreadSetup t;
    t.model = scene.threadModel(0);
    t.state = scene.state().threads[0].threads[0];
    t.inputs.ends[1] = t.state.ends[1].X_WE;
    t.inputs.flow_rate = 1e-6;
    v = run(t, h, steps, [](double, ThreadInputs&) {});
  }
  catch (const SceneError& error)
  {
    v.cell.refuseAtOnce(error.what());
  }
  return v;
}

void recordVerdict(StudyContext& context, StabilityTally& tally, double& volume_drift, const std::string& test,
                   double h, const Verdict& v)
{
  Row& row = context.row();
  row.set("case", test).set("step_s", h);
  tally.record(row, v.cell);
  row.check(v.volume_drift, 0.0, 1e-10, "all fluid is accounted for");
  row.set("folds", v.folds)
      .set("most_nodes", static_cast<double>(v.most_nodes))
      .set("most_threads", static_cast<double>(v.most_threads));
  volume_drift = std::max(volume_drift, v.volume_drift);
}

/// Fixed between plates, pulled to `ratio` times its length.
Verdict stretch(double ratio, double h, int steps)
{
  ThreadSetup t = straightThread(0.1, Eigen::VectorXd::Constant(20, 2e-3));
  t.model.viscosity = 1e3;
  t.hold(0);
  t.hold(1);
  return run(t, h, steps, [=](double time, ThreadInputs& inputs) {
    inputs.ends[1].position.x() = 0.1 * std::pow(ratio, time / (h * steps));
  });
}

}   // namespace

void runThreadStability(StudyContext& context)
{
  StabilityTally tally(context);
  double drift = 0;
  const Motion steady = [](double, ThreadInputs&) {};
  const auto name = [](const std::string& what, double value) {
    char text[64];
    std::snprintf(text, sizeof text, "%s %g", what.c_str(), value);
    return std::string(text);
  };
  const std::vector<double> viscosities =
      context.quick() ? std::vector<double>{1e-3, 1e3, 1e9} : std::vector<double>{1e-3, 1e-1, 1e1, 1e3, 1e6, 1e9};
  const std::vector<double> tensions = {0.0, 0.07, 1.0};
  int done = 0;
  for (const double mu : viscosities)
    for (const double gamma : tensions)
      for (const double h : {1e-5, 1e-3, 1e-1})
      {
        const std::string test = name("viscosity", mu) + name(", surface tension", gamma);
        context.progress(done++, static_cast<int>(9 * viscosities.size()), test);
        recordVerdict(context, tally, drift, test, h,
                      run(pouredThread(mu, gamma), h,
                          h < 1e-4   ? 300
                          : h < 1e-2 ? 600
                                     : 40,
                          steady));
      }
  for (const double mu : viscosities)
    for (const double gamma : tensions)
    {
      const std::string test = "by defaults, " + name("viscosity", mu) + name(", surface tension", gamma);
      context.progress(done, done + 1, test);
      ++done;
      recordVerdict(context, tally, drift, test, 2e-3, pourByDefaults(mu, gamma, 2e-3, context.quick() ? 250 : 1000));
    }
  // Held at both ends and let go: thin and thick, thin and thick fluids.
  const auto held = [](double viscosity, double radius, double gravity) {
    char text[700];
    std::snprintf(text, sizeof text, R"(
gravity: [0, 0, %g]
threads:
  - fluid: {density: 1000, viscosity: %g, surface_tension: 0.02}
    centerline: {straight: {from: [0, 0, 0], to: [0.1, 0, 0], edges: 20}}
    radius: %g
    ends: {oldest: held, newest: held}
)",
                  gravity, viscosity, radius);
    return MapScene{text, {}};
  };
  const std::vector<double> map_steps =
      context.quick() ? std::vector<double>{1e-4, 1e-2} : std::vector<double>{1e-5, 1e-4, 1e-3, 1e-2, 1e-1};
  stabilityMap(context, tally, "thread_stability_viscosity", "viscosity [Pa s]",
               context.quick() ? std::vector<double>{1e-2, 1e2, 1e6}
                               : std::vector<double>{1e-3, 1e-2, 1e-1, 1, 1e1, 1e2, 1e4, 1e6, 1e9},
               map_steps, 10, [&](double viscosity) { return held(viscosity, 2e-3, -9.81); });
  stabilityMap(
      context, tally, "thread_stability_slenderness", "radius over length",
      context.quick() ? std::vector<double>{1e-4, 1e-2, 0.1} : std::vector<double>{1e-5, 1e-4, 1e-3, 1e-2, 0.1, 0.3},
      map_steps, 10, [&](double slenderness) { return held(100, 0.1 * slenderness, -9.81); });
  for (const double ratio : {1e2, 1e5})
    recordVerdict(context, tally, drift, name("stretched by", ratio), 0.1, stretch(ratio, 0.1, 200));

  const double flow = pouredThread(1, 0).inputs.flow_rate;
  const struct
  {
    const char* name;
    Motion motion;
  } motions[] = {
      {"nozzle that jumps by 5 cm twice a second",
       [](double t, ThreadInputs& in) {
         in.ends[1].position = {0.05 * (std::fmod(t, 1.0) < 0.5), 0, 0.1};
       }},
      {"nozzle that turns about its axis, 3 rad/s",
       [start = pouredThread(1, 0).inputs.ends[1].orientation](double t, ThreadInputs& in) {
         in.ends[1].orientation = Eigen::Quaterniond(Eigen::AngleAxisd(3 * t, Eigen::Vector3d::UnitZ())) * start;
       }},
      {"flow that stops and starts again",
       [flow](double t, ThreadInputs& in) { in.flow_rate = std::fmod(t, 1.0) < 0.5 ? flow : 0.0; }},
      {"belt that reverses",
       [](double t, ThreadInputs& in) { in.belt_velocity.x() = std::fmod(t, 1.0) < 0.5 ? 0.2 : -0.2; }},
  };
  for (const auto& m : motions)
    for (const double mu : {1.0, 1e2, 1e4})
      for (const double h : {1e-3, 1e-2})
      {
        context.progress(done, done + 1, m.name);
        ++done;
        const int steps = static_cast<int>((context.quick() ? 1.5 : 4.0) / h);
        recordVerdict(context, tally, drift, std::string(m.name) + name(", viscosity", mu), h,
                      run(pouredThread(mu, 0.03), h, steps, m.motion));
      }

  context.progress(done, done + 1, "an hour");
  const double hour = context.quick() ? 300.0 : 3600.0, h = 0.02;
  const Verdict early = run(pouredThread(1e2, 0.03), h, static_cast<int>(60 / h), steady);
  const Verdict late = run(pouredThread(1e2, 0.03), h, static_cast<int>(hour / h), steady);
  recordVerdict(context, tally, drift, name("poured, seconds:", hour), h, late);
  const double growth = static_cast<double>(late.most_nodes) / static_cast<double>(early.most_nodes);
  context.row()
      .set("case", "most nodes at a time, over those of the first minute")
      .check(growth, 1.0, 0.1, "bounded memory");
  context.metric("volume_drift", drift);
  context.metric("most_nodes_in_the_long_run", static_cast<double>(late.most_nodes));
}

const StudyRegistration kThreadStabilityRegistration{
    "thread_stability",
    "viscous threads in all ranges of viscosity, surface tension, step and motion; an hour of pouring",
    runThreadStability};

}   // namespace slender::study
