// Threads whose scenes give neither edges nor break-up: fluids from water to pitch, of which each works, is warned of or is refused; and coils at
// the heights of coiling_grid.csv, resolved by the defaults alone.
#include <algorithm>
#include <cmath>
#include <cstdarg>
#include <cstdio>
#include <string>
#include <vector>

#include "coil_cases.h"
#include "slender_sim/scene/reader.h"
#include "slender_sim/scene/simulation.h"
#include "slender_sim/study/cpu_clock.h"
#include "slender_sim/thread/thread_flow.h"
#include "slender_sim/thread/thread_group.h"

namespace slender::study {
namespace {

constexpr double kGravity = 9.81;
constexpr double kFewPerTurn = 10.0;   // edges: the readers' warning begins there
constexpr double kCoilBound = 0.05;    // of frequency and radius

struct Fluid
{
  const char* name;
  double density, viscosity, surface_tension;   ///< [kg/m^3], [Pa s], [N/m]: round values of handbooks, which differ by the kind and the temperature
};

const std::vector<Fluid> kFluids = {
    {"water", 1000, 1e-3, 0.072},      {"milk", 1030, 2e-3, 0.047},       {"blood", 1060, 4e-3, 0.056},         {"olive oil", 912, 0.08, 0.032},
    {"motor oil", 880, 0.25, 0.031},   {"castor oil", 960, 0.99, 0.039},  {"glycerin", 1260, 1.4, 0.063},       {"warm honey", 1400, 2, 0.05},
    {"shampoo", 1020, 4, 0.03},        {"chocolate", 1300, 3, 0.04},      {"corn syrup", 1380, 5, 0.08},        {"honey", 1400, 10, 0.05},
    {"glue", 1100, 20, 0.04},          {"molasses", 1420, 50, 0.07},      {"caramel", 1400, 100, 0.05},         {"silicone oil", 970, 1e3, 0.021},
    {"glass melt", 2500, 1e3, 0.3},    {"stiff glass", 2500, 1e5, 0.3},   {"tar", 1200, 3e4, 0.03},             {"pitch", 1100, 2e8, 0.03}};

struct Outlet
{
  double diameter, height, speed;   ///< [m], of the nozzle above the floor [m], of the fluid in the nozzle [m/s]
};

const std::vector<Outlet> kOutlets = {{0.001, 0.03, 0.2}, {0.003, 0.1, 0.05}, {0.005, 0.2, 0.02}, {0.01, 0.1, 0.1}, {0.02, 0.5, 0.3}};

std::string text(const char* format, ...)
{
  char buffer[1000];
  va_list arguments;
  va_start(arguments, format);
  std::vsnprintf(buffer, sizeof buffer, format, arguments);
  va_end(arguments);
  return buffer;
}

/// No key says how it is resolved.
std::string sceneText(const Fluid& fluid, const Outlet& outlet, double step, const std::string& more_nozzle, const std::string& more_floor)
{
  const double flow = 0.25 * M_PI * outlet.diameter * outlet.diameter * outlet.speed;
  return text("time: {step: %.9g, duration: 1}\ngravity: [0, 0, %g]\nthreads:\n  - name: poured\n    fluid: {density: %.9g, viscosity: %.9g, surface_tension: %.9g}\n"
              "    nozzle: {position: [0, 0, %.9g], diameter: %.9g, flow: %.9g%s}\n    floor: {height: 0%s}\n",
              step, -kGravity, fluid.density, fluid.viscosity, fluid.surface_tension, outlet.height, outlet.diameter, flow, more_nozzle.c_str(), more_floor.c_str());
}

Landing landingOf(const Fluid& fluid, const Outlet& outlet)
{
  const double flow = 0.25 * M_PI * outlet.diameter * outlet.diameter * outlet.speed;
  return estimateLanding({fluid.density, fluid.viscosity, kGravity, outlet.diameter, flow, outlet.height});
}

/// What is no state of a thread that falls onto a floor, in the words of the report; empty: it is one. That is: numbers that are not finite; an edge
/// wider in radius than five times the nozzle's radius or a puddle's depth 2 sqrt(gamma / (rho g)), whichever is larger, and wider than it is
/// long; an edge longer than half the fall; a node more than two puddle depths and nozzle diameters below the floor or above the nozzle, or
/// farther from the nozzle's axis than the fall is high; one that is faster than twice free fall and than a film that breaks retracts.
std::string absurdityOf(const ThreadGroupState& group, const Fluid& fluid, const Outlet& outlet, double thinnest)
{
  const double puddle = 2.0 * std::sqrt(fluid.surface_tension / (fluid.density * kGravity)), nozzle = 0.5 * outlet.diameter;
  const double widest = 5.0 * std::max(nozzle, puddle), around = 2.0 * (puddle + outlet.diameter);
  const double fastest = 2.0 * std::sqrt(outlet.speed * outlet.speed + 2.0 * kGravity * outlet.height) +
                         2.0 * std::sqrt(2.0 * fluid.surface_tension / (fluid.density * std::max(thinnest, 1e-9)));
  for (const ThreadState& t : group.threads)
  {
    for (int i = 0; i < t.nodes(); ++i)
    {
      if (!t.x[i].allFinite() || !t.v[i].allFinite())
        return "a number that is not finite";
      if (t.x[i].z() > outlet.height + around || t.x[i].z() < -around || t.x[i].head<2>().norm() > outlet.height + around)
        return text("a node %g m aside and %g m above the floor", t.x[i].head<2>().norm(), t.x[i].z());
      if (t.v[i].norm() > fastest)
        return text("a node of %g m/s, where %g is fast", t.v[i].norm(), fastest);
    }
    for (int j = 0; j < t.edges(); ++j)
    {
      const double length = t.edge(j).norm(), radius = t.radius(j);
      if (!(t.volume[j] > 0) || !std::isfinite(radius))
        return "an edge without a radius";
      if (radius > widest && radius > length)
        return text("an edge of %g m in radius and %g m long", radius, length);
      if (length > 0.5 * outlet.height)
        return text("an edge of %g m", length);
    }
  }
  return "";
}

struct Poured
{
  std::string outcome;           ///< works, warned, refused, stopped
  std::string says;              ///< the first warning, or why it was refused
  std::string absurd;
  double lost = 0.0;             ///< of the fluid
  double turns = 0.0, per_turn = 0.0;
  double simulated = 0.0, seconds = 0.0;
  long substeps = 0;
};

/// Until the thread has landed and should have turned some times; or `most` substeps.
Poured pour(const Fluid& fluid, const Outlet& outlet, double turns, long most)
{
  Poured p;
  const double begin = threadSeconds();
  SceneConfig config;
  try
  {
    config = parseScene(sceneText(fluid, outlet, 0.002, "", ""), "poured");
  }
  catch (const SceneError& error)
  {
    p.outcome = "refused";
    p.says = error.what();
    return p;
  }
  p.outcome = config.warnings.empty() ? "works" : "warned";
  p.says = config.warnings.empty() ? "" : config.warnings.front();
  const Landing landing = landingOf(fluid, outlet);
  const double duration = 1.5 * 2.0 * outlet.height / (outlet.speed + landing.speed) + (landing.slender() ? turns * 2.0 * M_PI / landing.frequency : 1.0);
  const double thinnest = config.threads[0].breakup_radius;
  Simulation simulation(config);
  Landings landings(simulation.state().threads[0].threads[0]);
  while (simulation.state().time < duration && p.substeps < most)
  {
    const StepReport report = simulation.step(simulation.defaultInputs());
    p.substeps += report.substeps;
    if (!report.ok)
    {
      p.outcome = "stopped";
      p.says = report.message;
      break;
    }
    const ThreadGroupState& group = simulation.state().threads[0];
    p.absurd = absurdityOf(group, fluid, outlet, thinnest);
    if (!p.absurd.empty())
      break;
    landings.look(group.threads[0], simulation.state().time);
    ThreadVolumes volumes;
    volumes.add(group);
    p.lost = std::max(p.lost, std::abs(volumes.missing()));
  }
  const CoilTrace trace(landings);
  p.turns = trace.turns();
  p.per_turn = p.turns > 0 ? trace.perTurn() : 0.0;
  p.simulated = simulation.state().time;
  p.seconds = threadSeconds() - begin;
  return p;
}

/// What 100 scenes add up to.
struct Tally
{
  int scenes = 0, works = 0, warned = 0, refused = 0, stopped = 0, absurd = 0, unwarned = 0;
  double lost = 0.0;

  void add(StudyContext& context, const Fluid& fluid, const Outlet& outlet, const Poured& p)
  {
    // few edges in what turns: a coil of which nothing was said
    const bool unresolved = p.outcome == "works" && p.turns > 2.0 && p.per_turn < kFewPerTurn;
    ++scenes;
    works += p.outcome == "works";
    warned += p.outcome == "warned";
    refused += p.outcome == "refused";
    stopped += p.outcome == "stopped";
    absurd += !p.absurd.empty();
    unwarned += unresolved;
    lost = std::max(lost, p.lost);
    Row& row = context.row();
    row.set("fluid", fluid.name).set("viscosity", fluid.viscosity).set("nozzle_mm", 1e3 * outlet.diameter).set("height_m", outlet.height);
    row.set("speed_m_s", outlet.speed).set("outcome", p.absurd.empty() ? p.outcome : "ABSURD: " + p.absurd);
    row.set("turns", p.turns).set("edges_per_turn", p.per_turn).set("simulated_s", p.simulated).set("substeps", static_cast<double>(p.substeps));
    row.set("seconds", p.seconds).set("lost", p.lost).set("says", p.says.substr(0, 200));
  }
};

void pourAll(StudyContext& context)
{
  Tally tally;
  int done = 0;
  for (std::size_t f = 0; f < kFluids.size(); ++f)
    for (std::size_t o = 0; o < kOutlets.size(); ++o)
    {
      ++done;
      if (context.quick() && (f % 4 != 0 || o == 2))
        continue;
      context.progress(done, static_cast<int>(kFluids.size() * kOutlets.size()), kFluids[f].name);
      tally.add(context, kFluids[f], kOutlets[o], context.quick() ? pour(kFluids[f], kOutlets[o], 2, 600) : pour(kFluids[f], kOutlets[o], 6, 60000));
    }
  context.metric("scenes", tally.scenes);
  context.metric("works", tally.works);
  context.metric("warned", tally.warned);
  context.metric("refused", tally.refused);
  context.metric("stopped", tally.stopped);
  context.metric("lost_volume", tally.lost);
  context.metric("unresolved_unwarned", tally.unwarned);
  context.metric("absurd_states", tally.absurd);
}

/// The coils of the reference in the units of some fluid: lengths and times of coils without surface tension scale with its kinematic viscosity.
struct Scaled
{
  const char* name;
  double density, viscosity;
  double time() const { return std::cbrt(viscosity / density / (CoilFluid::viscosity / CoilFluid::density)); }
  double length() const { return time() * time(); }
};

/// Waits for a steady coil and measures it.
void coil(StudyContext& context, const Scaled& fluid, double height, double& worst_frequency, double& worst_radius)
{
  const double begin = threadSeconds();
  const Fluid thin{fluid.name, fluid.density, fluid.viscosity, 0.0};
  const Outlet outlet{fluid.length() * CoilFluid::diameter, fluid.length() * height, CoilFluid::speed * fluid.length() / fluid.time()};
  const Landing landing = landingOf(thin, outlet);
  Simulation simulation(parseScene(sceneText(thin, outlet, 0.05 * fluid.time(), ", swirl: 0.3", ", centreline_on_surface: true"), "coil"));
  const auto watch = [&](double duration) {
    Landings landings(simulation.state().threads[0].threads[0]);
    for (const double end = simulation.state().time + duration; simulation.state().time < end;)
    {
      const StepReport report = simulation.step(simulation.defaultInputs());
      if (!report.ok)
        throw std::runtime_error(std::string("coil of ") + fluid.name + ": " + report.message);
      landings.look(simulation.state().threads[0].threads[0], simulation.state().time);
    }
    return CoilTrace(landings);
  };
  constexpr double kSteady = 2e-3;   // change of the frequency, and of the radius, from one window to the next
  constexpr int kMostWindows = 60;
  double before = 0.0, radius_before = 0.0;
  CoilTrace trace = watch(2.0 * outlet.height / (outlet.speed + landing.speed));
  int windows = 0, steady = 0;
  for (; windows < kMostWindows && steady < 2; ++windows)
  {
    // the estimate is up to three times too fast; while the thread folds to and fro it hardly turns
    trace = watch(6.0 * M_PI / (before > 0 ? std::max(before, landing.frequency / 4) : landing.frequency));
    const double now = trace.turns() > 1.0 ? trace.frequency() : 0.0;
    steady = now > 0 && std::abs(now - before) < kSteady * now && std::abs(trace.radius() - radius_before) < kSteady * trace.radius() ? steady + 1 : 0;
    before = now;
    radius_before = trace.radius();
  }
  const double frequency = trace.frequency() * fluid.time(), radius = trace.radius() / fluid.length();
  Row& row = context.row();
  row.set("fluid", fluid.name).set("H", height).set("Omega", frequency).set("R", radius).set("unsteadiness", trace.unsteadiness());
  row.set("edges_per_turn", trace.turns() > 0 ? trace.perTurn() : 0.0).set("windows", windows).set("simulated_s", simulation.state().time);
  row.set("nodes", simulation.state().threads[0].threads[0].nodes()).set("seconds", threadSeconds() - begin);
  const SteadyCoil* reference = nearestStableCoil(height, frequency);
  if (!reference)
    return;
  row.set("branch", reference->branch).set("R_error", radius / reference->radius - 1);
  row.check(frequency, reference->frequency, kCoilBound * reference->frequency, "steady coils, coiling_grid.csv");
  worst_frequency = std::max(worst_frequency, std::abs(frequency / reference->frequency - 1));
  worst_radius = std::max(worst_radius, std::abs(radius / reference->radius - 1));
}

void coilAll(StudyContext& context)
{
  const std::vector<Scaled> fluids = {{"thesis 5.5", CoilFluid::density, CoilFluid::viscosity}, {"honey", 1400, 10}, {"glass melt", 2500, 1e3}, {"tar", 1200, 3e4}};
  double frequency = 0.0, radius = 0.0, last = 0.0;
  int done = 0;
  if (context.quick())
    for (std::size_t k = 1; k < fluids.size(); ++k)
      coil(context, fluids[k], steadyCoils()[4 * k].height, frequency, radius);
  else
    for (const SteadyCoil& c : steadyCoils())
      if (c.stable && c.height > 1.0001 * last)
      {
        last = c.height;
        context.progress(done++, 32, "coil at H = " + std::to_string(c.height));
        coil(context, fluids[0], c.height, frequency, radius);
      }
  context.metric("worst_frequency_error", frequency);
  context.metric("worst_radius_error", radius);
}

}  // namespace

void runThreadDefaults(StudyContext& context)
{
  coilAll(context);
  pourAll(context);
  context.note("works: without a warning. refused: when the scene was read. stopped: in a step, whose message says why.");
}

}  // namespace slender::study
