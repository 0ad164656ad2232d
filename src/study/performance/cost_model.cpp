// CPU time per step and memory against size, for every solver with contact and without: measured, and fitted by powers
// of the size.
#include <malloc.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <cstring>
#include <fstream>
#include <stdexcept>
#include <string>
#include <vector>

#include "study/cloth/cloth_cases.h"
#include "study/rod/rod_cases.h"
#include "slender_sim/scene/reader.h"
#include "slender_sim/scene/simulation.h"
#include "study/framework/cpu_clock.h"
#include "slender_sim/study/study.h"

namespace slender::study {

namespace {

std::string format(const char* text, double a, double b)
{
  char out[1200];
  std::snprintf(out, sizeof out, text, a, b);
  return out;
}

/// Scenes grow by their length or area; edges are as long in all of them.
struct Family
{
  const char* name;
  bool contact;
  std::string (*scene)(int vertices);
};

std::string rodScene(int vertices)
{
  return format(R"(
time: {step: 0.001, duration: 1}
rods:
  - centerline: {straight: {from: [0, 0, 0], to: [%.17g, 0, 0], edges: %.0f}}
    cross_section: {radius: 0.004}
    material: {density: 1100, youngs_modulus: 1.0e7, poissons_ratio: 0.45}
    grasps: {left: {edges: [0]}}
)",
                0.005 * (vertices - 1), vertices - 1);
}

std::string threadScene(int vertices)
{
  return format(R"(
time: {step: 0.001, duration: 1}
threads:
  - fluid: {density: 907, viscosity: 10, surface_tension: 0.02}
    centerline: {straight: {from: [0, 0, 0], to: [%.17g, 0, 0], edges: %.0f}}
    radius: 0.000875
    ends: {oldest: held, newest: held}
)",
                0.0005 * (vertices - 1), vertices - 1);
}

std::string clothScene(int vertices)
{
  const double cells = std::max(1.0, std::round(std::sqrt(static_cast<double>(vertices)) - 1));
  const std::string side = format("%.17g", 0.01 * cells, 0);
  return "time: {step: 0.01, duration: 1}\ncloths:\n  - grid: {corner: [0, 0, 0], sides: [[" + side + ", 0, 0], [0, " +
         side +
         format(R"(, 0]], cells: %.0f, pattern: alternating}
    material: {area_density: 0.2, thickness: 0.0005, youngs_modulus: 5.0e5, poissons_ratio: 0.3}
    solver: {one_newton_step: true}
    grasps: {left: {corner: lower_left}, right: {corner: lower_right}}
)",
                cells, 0);
}

/// The guide is subdivided so often: 4^subdivisions vertices for each of its own, all of whose hats are test functions.
/// It waves (guideAt).
std::string trackedScene(int vertices, int subdivisions)
{
  const double finer = std::exp2(subdivisions),
               cells = std::max(1.0, std::round((std::sqrt(static_cast<double>(vertices)) - 1) / finer));
  const std::string side = format("%.17g", 0.01 * finer * cells, 0), count = format("%.0f", cells, 0);
  return "time: {step: 0.01, duration: 1}\ntracked:\n  - guide: {grid: {corner: [0, 0, 0], sides: [[" + side +
         ", 0, 0], [0, " + side + ", 0]], cells: [" + count + ", " + count +
         R"(], pattern: alternating}, motion: {topic: points}}
    mesh: {subdivide: )" +
         std::to_string(subdivisions) + R"(}
    test_functions: {basis: subdivision}
    material: {area_density: 0.2, thickness: 0.0005, youngs_modulus: 5.0e5, poissons_ratio: 0.3}
    bending: {model: hinge}
    solver: {one_newton_step: true}
)";
}

/// Lies on a floor, all of it, and may touch itself.
std::string onFloor(std::string scene, double height, const char* contact)
{
  return scene + "    contact: " + contact +
         format("\nobstacles: [{name: floor, shape: {plane: {}}, pose: {position: [0, 0, %.17g]}}]\n", height, 0);
}

const std::vector<Family>& families()
{
  static const std::vector<Family> all = {
      {"rod", false, rodScene},
      {"rod", true, [](int n) { return onFloor(rodScene(n), -0.00405, "{friction: 0.3}"); }},
      {"thread", false, threadScene},
      {"thread", true, [](int n) { return onFloor(threadScene(n), -0.00089, "{friction: 0.3}"); }},
      {"cloth", false, clothScene},
      {"cloth", true, [](int n) { return onFloor(clothScene(n), -0.00101, "{friction: 0.3, thickness: 0.002}"); }},
      {"tracked", false, [](int n) { return trackedScene(n, 3); }},
      {"tracked", true,
       [](int n) { return onFloor(trackedScene(n, 3), -0.00101, "{friction: 0.3, thickness: 0.002}"); }},
      {"tracked_closely", false, [](int n) { return trackedScene(n, 1); }},
  };
  return all;
}

/// Waves of 0.32 m that rise, and shorten the guide in x a little, as of a wrinkling sheet.
void guideAt(double time, const Eigen::Matrix3Xd& rest, Eigen::Matrix3Xd& guide)
{
  constexpr double kNumber = 2 * M_PI / 0.32;
  const double height = 0.2 * time;   // 0.2 m/s
  guide = rest;
  for (Eigen::Index i = 0; i < rest.cols(); ++i)
  {
    guide(0, i) *= 1.0 - 0.25 * height * height * kNumber * kNumber;   // as long as before
    guide(2, i) += height * (1.0 - std::cos(kNumber * rest(0, i)));
  }
}

/// From the start, the same number of steps at all sizes, so that each has the same motion behind it.
constexpr int kWarm = 4, kTimed = 12;

struct Sample
{
  double vertices = 0, seconds = 0, all_seconds = 0, bytes = 0, iterations = 0, linear_iterations = 0;
  int steps = 0;
  char error[240] = "";
};

double residentBytes()
{
  std::ifstream file("/proc/self/statm");
  double total = 0, resident = 0;
  file >> total >> resident;
  return resident * static_cast<double>(sysconf(_SC_PAGESIZE));
}

double availableBytes()
{
  std::ifstream file("/proc/meminfo");
  std::string key, unit;
  for (double kilobytes = 0; file >> key >> kilobytes; std::getline(file, unit))
    if (key == "MemAvailable:")
      return 1024 * kilobytes;
  return 4e9;
}

void measureSample(const std::string& scene, double enough, Sample& sample)
{
  const double start = threadSeconds(), before = residentBytes();
  Simulation simulation(parseScene(scene, "cost_model.yaml"));
  simulation.setThreads(1);
  const SceneConfig& config = simulation.config();
  SceneInputs inputs;
  const auto advance = [&] {
    simulation.defaultInputs(inputs);
    if (!config.cloths.empty() && config.cloths[0].tracking)
      guideAt(simulation.state().time + config.time.step, config.cloths[0].tracking->guide.mesh.vertices,
              inputs.guides.at(0));
    const double begin = threadSeconds();
    const StepReport report = simulation.step(inputs);
    const double seconds = threadSeconds() - begin;
    if (!report.ok)
      throw std::runtime_error(report.message);
    if (simulation.state().steps <= kWarm)   // what stays is factored, lists have grown
      return;
    sample.seconds += seconds;
    ++sample.steps;
    sample.iterations += report.iterations;
    sample.linear_iterations += report.linear_iterations;
  };
  do   // small ones often
  {
    simulation.reset();
    for (int k = 0; k < kWarm + kTimed; ++k)
      advance();
  }
  while (sample.seconds < enough);
  sample.seconds /= sample.steps;
  sample.iterations /= sample.steps;
  sample.linear_iterations /= sample.steps;
  malloc_trim(0);   // what building has left
  sample.bytes = residentBytes() - before;
  sample.vertices = !config.rods.empty()      ? simulation.rodModel(0).nodes()
                    : !config.threads.empty() ? static_cast<double>(simulation.state().threads[0].threads[0].nodes())
                                              : simulation.clothModel(0).vertices();
  sample.all_seconds = threadSeconds() - start;
}

/// In a process of its own, whose memory nothing else has used before.
Sample measureApart(const std::string& scene, double enough)
{
  int ends[2];
  if (pipe(ends) != 0)
    throw std::runtime_error("cost_model: no pipe");
  const pid_t child = fork();
  if (child < 0)
    throw std::runtime_error("cost_model: no process");
  if (child == 0)
  {
    Sample sample;
    try
    {
      measureSample(scene, enough, sample);
    }
    catch (const std::exception& error)
    {
      std::snprintf(sample.error, sizeof sample.error, "%s", error.what());
    }
    const bool written = write(ends[1], &sample, sizeof sample) == static_cast<ssize_t>(sizeof sample);
    _exit(written ? 0 : 1);
  }
  close(ends[1]);
  Sample sample;
  const ssize_t got = read(ends[0], &sample, sizeof sample);
  close(ends[0]);
  int status = 0;
  waitpid(child, &status, 0);
  if (got != static_cast<ssize_t>(sizeof sample))
    std::snprintf(sample.error, sizeof sample.error, "the process ended by itself (signal %d), of memory perhaps",
                  WIFSIGNALED(status) ? WTERMSIG(status) : 0);
  return sample;
}

/// y = factor x^exponent, least squares in logarithms.
struct PowerLaw
{
  double factor = 0, exponent = 0;
  double misfit = 0;   ///< root mean square of |ln y - ln fit|: about a relative error

  PowerLaw(const std::vector<double>& x, const std::vector<double>& y)
  {
    const double n = static_cast<double>(x.size());
    exponent = logSlope(x, y);
    double mean = 0;
    for (std::size_t k = 0; k < x.size(); ++k)
      mean += (std::log(y[k]) - exponent * std::log(x[k])) / n;
    factor = std::exp(mean);
    for (std::size_t k = 0; k < x.size(); ++k)
      misfit += std::pow(std::log(y[k] / at(x[k])), 2) / n;
    misfit = std::sqrt(misfit);
  }

  double at(double x) const { return factor * std::pow(x, exponent); }
};

/// y = constant + slope x, least squares of relative errors.
struct Line
{
  double constant = 0, slope = 0;

  Line(const std::vector<double>& x, const std::vector<double>& y)
  {
    double s = 0, sx = 0, sy = 0, sxx = 0, sxy = 0;
    for (std::size_t k = 0; k < x.size(); ++k)
    {
      const double w = 1 / (y[k] * y[k]);
      s += w, sx += w * x[k], sy += w * y[k], sxx += w * x[k] * x[k], sxy += w * x[k] * y[k];
    }
    slope = (s * sxy - sx * sy) / (s * sxx - sx * sx);
    constant = (sy - slope * sx) / s;
  }

  double at(double x) const { return constant + slope * x; }
};

// Fits begin at this number of vertices. In smaller scenes, costs that do not depend on the size are visible.
constexpr double kFitFrom = 3500;
constexpr double kLarge = 1e6;

}   // namespace

void runCostModel(StudyContext& context)
{
  useOneBlasThread();
  const std::vector<int> sizes = context.quick()
                                     ? std::vector<int>{100, 1000, 4000, 6000, 8000}
                                     : std::vector<int>{100, 300, 1000, 4000, 10000, 30000, 100000, 300000, 1000000};
  const double enough = context.quick() ? 0.1 : 1.0;     // [s] of steps
  const double longest = context.quick() ? 10.0 : 240;   // [s] for a size
  Plot& free = context.plot(
      "cost_model", "Cost of a step against size, without contact: measured, and powers fitted from 3,500 vertices on",
      "vertices", "CPU time per step [s]");
  Plot& touching = context.plot("cost_model_contact", "Likewise of what lies on a floor and may touch itself",
                                "vertices", "CPU time per step [s]");
  Plot& memory = context.plot("cost_model_memory", "Memory against size", "vertices", "resident memory [bytes]");
  double worst_misfit = 0;
  int done = 0;
  const int total = static_cast<int>(families().size() * sizes.size());
  for (const Family& family : families())
  {
    const std::string label = std::string(family.name) + (family.contact ? ", contact" : ""),
                      key = std::string(family.name) + (family.contact ? "_contact" : "");
    Plot& time = family.contact ? touching : free;
    std::vector<double> x, y, bytes;
    double last_time = 0, last_bytes = 0, last_size = 0;
    for (const int size : sizes)
    {
      context.progress(done++, total, label);
      const double growth = last_size > 0 ? size / last_size : 0;
      if (last_time * growth > longest || last_bytes * growth > 0.7 * availableBytes())
        continue;   // by the fit
      const Sample s = measureApart(family.scene(size), enough);
      Row& row = context.row();
      row.set("solver", family.name)
          .set("contact", family.contact ? "yes" : "no")
          .set("vertices", *s.error ? size : s.vertices);
      if (*s.error)
      {
        row.set("outcome", s.error);
        throw std::runtime_error(label + ", " + std::to_string(size) + " vertices: " + s.error);
      }
      row.set("outcome", "measured")
          .set("seconds_per_step", s.seconds)
          .set("us_per_vertex", 1e6 * s.seconds / s.vertices)
          .set("steps", s.steps)
          .set("iterations", s.iterations)
          .set("linear_iterations", s.linear_iterations)
          .set("bytes", s.bytes)
          .set("bytes_per_vertex", s.bytes / s.vertices)
          .set("run_seconds", s.all_seconds);
      time.at(label).x.push_back(s.vertices);
      time.at(label).y.push_back(s.seconds);
      memory.at(label).x.push_back(s.vertices);
      memory.at(label).y.push_back(s.bytes);
      if (s.vertices >= kFitFrom)
      {
        x.push_back(s.vertices);
        y.push_back(s.seconds);
        bytes.push_back(s.bytes);
      }
      last_size = size, last_time = s.all_seconds, last_bytes = s.bytes;
    }
    if (x.size() < 3)
      throw std::runtime_error(label + ": a power law of " + std::to_string(x.size()) +
                               " sizes would fit whatever they are; three are needed from " +
                               std::to_string(static_cast<int>(kFitFrom)) + " vertices on");
    time.at(label).points = true;
    const PowerLaw law(x, y);
    const Line space(x, bytes);   // what any process takes, and so much for each vertex
    Series& line = time.at(label + ", fit");
    line.line = true;
    for (const double at : {kFitFrom, kLarge})
    {
      line.x.push_back(at);
      line.y.push_back(law.at(at));
    }
    context.row()
        .set("solver", family.name)
        .set("contact", family.contact ? "yes" : "no")
        .set("vertices", kLarge)
        .set("outcome", "by the fit")
        .set("seconds_per_step", law.at(kLarge))
        .set("us_per_vertex", 1e6 * law.at(kLarge) / kLarge)
        .set("bytes", space.at(kLarge))
        .set("bytes_per_vertex", space.slope)
        .set("exponent", law.exponent)
        .set("fit_misfit", law.misfit)
        .set("fitted_up_to", x.back());
    context.metric("exponent_" + key, law.exponent);
    context.metric("seconds_per_step_1e6_" + key, law.at(kLarge));
    context.metric("bytes_per_vertex_" + key, space.slope);
    worst_misfit = std::max(worst_misfit, law.misfit);
    char text[240];
    std::snprintf(text, sizeof text,
                  "%s: %.3g us n^%.3f per step for n vertices (root mean square misfit %.1f %%, %zu sizes up to %.0f); "
                  "%.0f bytes for each vertex more",
                  label.c_str(), 1e6 * law.factor, law.exponent, 100 * law.misfit, x.size(), x.back(), space.slope);
    context.note(text);
  }
  context.metric("fit_misfit", worst_misfit);
  context.note(
      "CPU time of one thread; edges are as long at all sizes, so that length or area grows; contact: all of it lies "
      "on a floor and may touch itself. Steps 5 to 16 of each scene: rods, threads and cloths "
      "fall from a clamp, tracked cloths follow a guide that waves, of a 64th of the vertices, closely: a fourth. "
      "Cloth: one Newton step. Sizes that would take too long or too much memory are left to the fit.");
}

const StudyRegistration kCostModelRegistration{
    "cost_model", "time per step and memory against size, all solvers with contact and without: measured and fitted",
    runCostModel};

}   // namespace slender::study
