// Thesis table 5.1: time per frame of its thread examples (and of the hair of Fig. 4.8), fastest, slowest and mean.
#include <algorithm>
#include <limits>
#include <stdexcept>
#include <string>

#include "slender_sim/scene/reader.h"
#include "study/framework/scene_cases.h"
#include "study/framework/cpu_clock.h"
#include "slender_sim/study/study.h"

namespace slender::study {
namespace {

constexpr double kFilmFrame = 1.0 / 24;   // [s]; the thesis names no rate, its step of 0.208 ms is 1/200 of this

/// A row of the thesis's table, and a scene with about as many vertices and the same step.
struct ThreadExample
{
  const char* figure;
  const char* what;
  const char* vertices;
  double step;                        ///< [s]
  double fastest, slowest, average;   ///< thesis [ms] per frame
  double seconds;                     ///< simulated before and while frames are timed
  const char* scene;                  ///< null: the package's hair
};

const ThreadExample kThreadExamples[] = {
    {"5.1", "sewing on a belt", "180", 10e-3, 0.241, 59.7, 16.8, 20.0, R"(
threads:
  - fluid: {density: 1000, viscosity: 28, surface_tension: 0.021}
    nozzle: {position: [0, 0, 0.05], direction: [0.01, 0.02, -1], diameter: 0.008, flow: 5.0e-7}
    floor: {height: 0, belt: [0.012, 0]}
    edges: {feed: 0.001, longest: 0.002, shortest: 0.0004, deposited: 120}
)"},
    {"5.2", "coiling", "40-350", 40e-3, 0.05, 35.1, 3.64, 40.0, R"(
threads:
  - fluid: {density: 1400, viscosity: 60, surface_tension: 0.05}
    nozzle: {position: [0, 0, 0.08], direction: [0.01, 0.02, -1], diameter: 0.005, flow: 1.0e-7}
    floor: {height: 0}
    edges: {feed: 0.001, longest: 0.0015, shortest: 0.0003, deposited: 250}
)"},
    {"5.5", "coiling, short steps", "200-1500", 0.208e-3, 0.292, 916, 202, 5.0, R"(
threads:
  - fluid: {density: 1400, viscosity: 20, surface_tension: 0.05}
    nozzle: {position: [0, 0, 0.07], direction: [0.01, 0.02, -1], diameter: 0.005, flow: 3.0e-7}
    floor: {height: 0}
    edges: {feed: 0.0003, longest: 0.0005, shortest: 0.0001, deposited: 1300}
)"},
    {"5.4", "sagging between plates", "51", 1e-3, 3.84, 56.9, 25.5, 0.5, R"(
threads:
  - fluid: {density: 907, viscosity: 10, surface_tension: 0.02}
    centerline: {straight: {from: [0, 0, 0], to: [0.025, 0, 0], edges: 50}}
    radius: 0.000875
    ends: {oldest: held, newest: held}
)"},
    {"4.8", "hair", "54460", 10e-3, 23500, 226000, 77000, 0.125, nullptr},
};

}   // namespace

void runThreadTables(StudyContext& context)
{
  double least = std::numeric_limits<double>::infinity();
  int done = 0;
  double most_cut = 0.0;
  for (const ThreadExample& e : kThreadExamples)
  {
    context.progress(done++, static_cast<int>(std::size(kThreadExamples)), e.what);
    const std::string step = "time.step=" + std::to_string(e.step);
    if (!e.scene && context.quick())
      continue;   // minutes
    Simulation simulation = e.scene ? Simulation(parseScene(e.scene, std::string("table_5_1/") + e.figure, {step}))
                                    : packageScene("hair", {step});
    const double seconds = context.quick() ? 0.2 * e.seconds : e.seconds;
    double fastest = std::numeric_limits<double>::infinity(), slowest = 0.0, total = 0.0;
    int frames = 0, fewest = std::numeric_limits<int>::max(), most = 0, cuts = 0;
    for (double frame = kFilmFrame; frame <= seconds; frame += kFilmFrame)
    {
      const double start = threadSeconds();
      while (simulation.state().time < frame)
      {
        const StepReport report = simulation.step(simulation.defaultInputs());
        if (!report.ok)
          throw std::runtime_error(std::string("figure ") + e.figure + ": " + report.message);
        cuts += report.cut_steps;
      }
      const double time = threadSeconds() - start;
      int vertices = 0;
      for (const ThreadGroupState& group : simulation.state().threads)
        for (const ThreadState& thread : group.threads)
          vertices += thread.nodes();
      for (const RodState& rod : simulation.state().rods)
        vertices += static_cast<int>(rod.x.cols());
      fewest = std::min(fewest, vertices);
      most = std::max(most, vertices);
      fastest = std::min(fastest, time);
      slowest = std::max(slowest, time);
      total += time;
      ++frames;
    }
    const double mean = 1e3 * total / frames;
    context.row()
        .set("figure", e.figure)
        .set("example", e.what)
        .set("vertices", std::to_string(fewest) + "-" + std::to_string(most))
        .set("thesis_vertices", e.vertices)
        .set("step_ms", 1e3 * e.step)
        .set("frames", frames)
        .set("cut_steps", cuts)
        .set("fastest_ms", 1e3 * fastest)
        .set("thesis_fastest_ms", e.fastest)
        .set("slowest_ms", 1e3 * slowest)
        .set("thesis_slowest_ms", e.slowest)
        .set("mean_ms", mean)
        .set("thesis_mean_ms", e.average)
        .set("speedup", e.average / mean);
    most_cut = std::max(most_cut, cuts * e.step / seconds);
    least = std::min(least, e.average / mean);
  }
  context.metric("speedup_min", least);
  context.metric("cut_steps_share_max", most_cut);
}

const StudyRegistration kThreadTablesRegistration{
    "thread_tables", "time per frame of the thesis's thread examples and of hair, beside its table 5.1",
    runThreadTables};

}   // namespace slender::study
