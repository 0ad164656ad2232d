// Threads whose scenes give neither edges nor break-up: a hundred pours (thread_pours.cpp), and coils at the heights of
// coiling_grid.csv.
#include <algorithm>
#include <cmath>
#include <stdexcept>
#include <string>
#include <vector>

#include "coil_cases.h"
#include "slender_sim/scene/reader.h"
#include "slender_sim/scene/simulation.h"
#include "study/framework/cpu_clock.h"
#include "thread_pours.h"

namespace slender::study {
namespace {

constexpr double kCoilBound = 0.05;     // of frequency and radius
constexpr double kNearFold = 15.7232;   // its branch of coils ends at 15.9, where small errors decide

/// The coils of the reference in the units of some fluid: lengths and times of coils without surface tension scale with
/// its kinematic viscosity.
struct Scaled
{
  const char* name;
  double density, viscosity;
  double time() const { return std::cbrt(viscosity / density / (CoilFluid::viscosity / CoilFluid::density)); }
  double length() const { return time() * time(); }
  Fluid fluid() const { return {name, density, viscosity, 0.0}; }
  Outlet outlet(double height) const
  {
    return {length() * CoilFluid::diameter, length() * height, CoilFluid::speed * length() / time()};
  }
};

/// How a coil is started, in the units of the reference. Several motions are stable at some heights, and the start
/// decides which one is reached: a steady coil, a coil on another branch, or folding to and fro.
struct Start
{
  double at = 0.0;   ///< height in the table for which this start is; 0: all others, by `swirl: 0.3`
  double frequency = 0.0, radius = 0.0;        ///< of a circle of the nozzle
  double stands_at = 0.0;                      ///< time at which the nozzle stands in the middle
  double from_height = 0.0;                    ///< the nozzle stays there at first
  double rise_begins = 0.0, rise_ends = 0.0;   ///< times; between them the nozzle rises to its height
};

/// At 15.2 and 15.7 the default swirl turns faster than the coil and ends in folding to and fro; a circle as slow as
/// the coil reaches it. At 50.7 circles of the nozzle end in folding; a rise from a height at which the thread coils
/// reaches the coil.
const std::vector<Start> kStarts = {{},
                                    {15.216, 2.05, 0.118, 35, 15.216, 0, 0},
                                    {kNearFold, 2.05, 0.118, 35, kNearFold, 0, 0},
                                    {50.7201, 16, 0.07, 17, 38.0401, 40, 80}};

const Start& startOf(double height)
{
  for (const Start& start : kStarts)
    if (std::abs(start.at / height - 1) < 1e-4)
      return start;
  return kStarts.front();
}

/// The motion as a table of the nozzle's poses.
TableMotion motionOf(const Start& start, double height, const Scaled& fluid, const Pose& nozzle)
{
  constexpr double kInterval = 0.1;
  TableMotion motion;
  const double end = std::max(start.stands_at, start.rise_ends) + 2 * kInterval;
  for (double t = 0; t < end; t += kInterval)
  {
    const double turn = 2 * M_PI / start.frequency,
                 radius = start.radius * std::clamp((start.stands_at - t) / turn, 0.0, std::min(1.0, t / turn));
    const double risen = start.rise_ends > 0
                             ? std::clamp((t - start.rise_begins) / (start.rise_ends - start.rise_begins), 0.0, 1.0)
                             : 1.0;
    Pose pose = nozzle;
    pose.position =
        fluid.length() * Eigen::Vector3d(radius * std::cos(start.frequency * t), radius * std::sin(start.frequency * t),
                                         start.from_height + risen * (height - start.from_height));
    motion.poses.append(t * fluid.time(), pose);
  }
  return motion;
}

SceneConfig coilScene(const Scaled& fluid, double height)
{
  const Start& start = startOf(height);
  SceneConfig scene = parseScene(pouredScene(fluid.fluid(), fluid.outlet(height), 0.05 * fluid.time(),
                                             start.at > 0 ? "" : ", swirl: 0.3", ", centreline_on_surface: true"),
                                 "coil");
  ThreadConfig& thread = scene.threads[0];
  if (start.at > 0)
  {
    thread.nozzle->motion = motionOf(start, height, fluid, thread.nozzle->pose);
    thread.nozzle->pose = std::get<TableMotion>(thread.nozzle->motion).poses.evaluate(0.0);
  }
  return scene;
}

/// Steps for `duration` seconds and returns what landed.
CoilTrace watch(Simulation& simulation, double duration, const char* what)
{
  const ThreadGroupState& group = simulation.state().threads[0];
  Landings landings(group.threads[0]);
  for (const double end = simulation.state().time + duration; simulation.state().time < end;)
  {
    const StepReport report = simulation.step(simulation.defaultInputs());
    if (!report.ok)
      throw std::runtime_error(std::string("coil of ") + what + ": " + report.message);
    landings.look(group.threads[0], simulation.state().time);
  }
  return CoilTrace(landings);
}

/// Largest errors of all coils, and how many of them are steady.
struct CoilErrors
{
  double frequency = 0.0, radius = 0.0;
  int steady = 0, unsteady = 0;
};

/// Waits for a steady coil and measures it.
void coil(StudyContext& context, const Scaled& fluid, double height, CoilErrors& errors)
{
  const double begin = threadSeconds();
  const Outlet outlet = fluid.outlet(height);
  const Landing landing = landingOf(fluid.fluid(), outlet);
  const Start& start = startOf(height);
  Simulation simulation(coilScene(fluid, height));
  // From one window of three turns to the next the coil's frequency and radius change by less than kSteady, twice, and
  // its radius varies by less than kRound within a window. A window ends between two landings, which makes about 3e-3
  // of its frequency.
  constexpr double kSteady = 5e-3, kRound = 0.02;
  constexpr int kMostWindows = 120;   // of which up to 20 pass before the fluid has landed
  const double started = fluid.time() * std::max(start.stands_at, start.rise_ends);
  CoilTrace trace =
      watch(simulation, std::max(started, 2.0 * outlet.height / (outlet.speed + landing.speed)), fluid.name);
  double before = 0.0, radius_before = 0.0;
  int windows = 0, steady = 0;
  for (; windows < kMostWindows && steady < 2; ++windows)
  {
    // The estimate is up to three times too fast. A thread that folds to and fro hardly turns.
    trace = watch(simulation, 6.0 * M_PI / (before > 0 ? std::max(before, landing.frequency / 4) : landing.frequency),
                  fluid.name);
    const double now = trace.turns() > 1.0 ? trace.frequency() : 0.0;
    const bool same = now > 0 && std::abs(now - before) < kSteady * now &&
                      std::abs(trace.radius() - radius_before) < kSteady * trace.radius();
    steady = same && trace.unsteadiness() < kRound ? steady + 1 : 0;
    before = now;
    radius_before = trace.radius();
  }
  const ThreadState& thread = simulation.state().threads[0].threads[0];
  const double frequency = trace.frequency() * fluid.time(), radius = trace.radius() / fluid.length();
  Row& row = context.row();
  row.set("fluid", fluid.name)
      .set("H", height)
      .set("start", start.at > 0 ? "motion of the nozzle" : "swirl")
      .set("several_coils", landing.several_coils ? "yes" : "no");
  row.set("Omega", frequency)
      .set("R", radius)
      .set("unsteadiness", trace.unsteadiness())
      .set("steady", steady >= 2 ? "yes" : "no");
  row.set("edges_per_turn", edgesPerTurn(thread, trace.radius()))
      .set("windows", windows)
      .set("simulated_s", simulation.state().time);
  row.set("nodes", thread.nodes()).set("seconds", threadSeconds() - begin);
  errors.steady += steady >= 2;
  errors.unsteady += steady < 2;
  const SteadyCoil* reference = nearestStableCoil(height, frequency);
  if (!reference)
    return;
  const double frequency_error = frequency / reference->frequency - 1, radius_error = radius / reference->radius - 1;
  row.set("branch", reference->branch).set("Omega_error", frequency_error).set("R_error", radius_error);
  row.check(frequency, reference->frequency, kCoilBound * reference->frequency, "steady coils, coiling_grid.csv");
  errors.frequency = std::max(errors.frequency, std::abs(frequency_error));
  errors.radius = std::max(errors.radius, std::abs(radius_error));
}

void coilAll(StudyContext& context)
{
  const Scaled thesis = {"thesis 5.5", CoilFluid::density, CoilFluid::viscosity};
  const std::vector<Scaled> others = {{"honey", 1400, 10}, {"glass melt", 2500, 1e3}, {"tar", 1200, 3e4}};
  CoilErrors errors;
  double last = 0.0;
  int done = 0;
  if (context.quick())
  {
    for (std::size_t k = 0; k < others.size(); ++k)
      coil(context, others[k], steadyCoils()[4 * k + 4].height, errors);
    coil(context, thesis, kNearFold, errors);
  }
  else
    for (const SteadyCoil& c : steadyCoils())
      if (c.stable && c.height > 1.0001 * last)
      {
        last = c.height;
        context.progress(done++, 30, "coil at H = " + std::to_string(c.height));
        coil(context, thesis, c.height, errors);
      }
  context.metric("steady_coils", errors.steady);
  context.metric("coils_not_steady", errors.unsteady);
  context.metric("worst_frequency_error", errors.frequency);
  context.metric("worst_radius_error", errors.radius);
}

}   // namespace

void runThreadDefaults(StudyContext& context)
{
  coilAll(context);
  pourAll(context);
}

const StudyRegistration kThreadDefaultsRegistration{
    "thread_defaults",
    "poured fluids from water to pitch, and coils, whose scenes give no edges: resolved, warned of or refused",
    runThreadDefaults};

}   // namespace slender::study
