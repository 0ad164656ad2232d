// Cloth in contact: error against run time of its two methods, the barrier and impulses, against converged runs of
// both.
#include <algorithm>
#include <cmath>
#include <cstdio>
#include <limits>
#include <sstream>
#include <stdexcept>
#include <string>
#include <vector>

#include "slender_sim/scene/reader.h"
#include "slender_sim/scene/simulation.h"
#include "cloth_cases.h"
#include "study/framework/cpu_clock.h"
#include "study/framework/work_precision.h"

namespace slender::study {

namespace {

/// A sheet that meets an obstacle without folds that chance decides: a ball is pushed into a sheet that is held at two
/// edges; a sheet that is held at one edge swings onto a bar; a strip is folded onto itself on the floor.
struct ContactScene
{
  const char* name;
  double seconds;
};
constexpr ContactScene kScenes[] = {{"ball", 0.8}, {"bar", 0.6}, {"fold", 0.8}};

/// Rows of a table of poses in which a share of the motion goes smoothly from 0 to 1 in `time` seconds.
template <class Row>
std::string motionTable(double time, Row&& row)
{
  constexpr int kRows = 40;
  std::ostringstream text;
  for (int k = 0; k <= kRows; ++k)
  {
    const double u = static_cast<double>(k) / kRows;
    text << (k == 0 ? "[[" : ", [") << time * u << ", " << row(u * u * (3.0 - 2.0 * u)) << "]";
  }
  return text.str() + "]";
}

/// `method` of contact; `gap`: within which the barrier repels [m].
std::string sceneText(const std::string& name, const std::string& method, double gap, double step)
{
  constexpr double kTurn = 0.97 * M_PI;   // angle of the strip's end [rad]; half a turn would press the layers together
  std::ostringstream text;
  text << "time: {step: " << step << ", duration: 1, integrator: implicit_euler}\n";
  if (method == "barrier")
    text << "contact: {gap: " << gap << "}\n";
  text << "cloths:\n  - name: sheet\n"
       << "    material: {area_density: 0.2, thickness: 0.001, youngs_modulus: 1.0e5, poissons_ratio: 0.3}\n"
       << "    bending: {modulus: 1.0e-5}\n    damping: {mass: 0.5, stiffness: 0.005}\n"
       << "    contact: {friction: 0.3, thickness: 0.004, method: " << method << "}\n    grid: {pattern: alternating, ";
  if (name == "ball")
    text << "corner: [-0.5, -0.5, 0.12], sides: [[1.0, 0, 0], [0, 1.0, 0]], cells: 20}\n"
         << "    grasps: {lower: {edge: lower}, upper: {edge: upper}}\n"
         << "obstacles:\n  - {name: ball, shape: {sphere: {radius: 0.1}}, friction: 0.3, motion: {table: "
         << motionTable(0.6,
                        [](double u) {
                          std::ostringstream row;
                          row << "0, 0, " << 0.27 - 0.2 * u;
                          return row.str();
                        })
         << "}}\n";
  else if (name == "bar")
    text << "corner: [0, -0.25, 0], sides: [[0.6, 0, 0], [0, 0.5, 0]], cells: 20}\n    grasps: {held: {edge: left}}\n"
         << "obstacles:\n  - {name: bar, shape: {capsule: {radius: 0.03, length: 0.7}}, friction: 0.3, pose: "
         << "{position: [0.2, 0, -0.15], rpy: [1.5707963267948966, 0, 0]}}\n";
  else
    text << "corner: [0, -0.1, 0.003], sides: [[0.4, 0, 0], [0, 0.2, 0]], cells: [20, 10]}\n"
         << "    grasps: {end: {edge: right, attach: initial, motion: {table: "
         << motionTable(0.8,
                        [](double u) {
                          std::ostringstream row;
                          row << 0.2 + 0.2 * std::cos(kTurn * u) << ", 0, " << 0.004 + 0.2 * std::sin(kTurn * u);
                          return row.str();
                        })
         << "}}}\nobstacles:\n  - {name: floor, shape: {plane: {}}, friction: 0.5}\n";
  return text.str();
}

struct ContactRun
{
  Eigen::Matrix3Xd x;   ///< at the end [m]
  double cpu = 0.0;     ///< seconds per simulated second
  double iterations = 0.0, cuts = 0.0;
};

ContactRun runScene(const ContactScene& scene, const std::string& method, double gap, double step)
{
  Simulation simulation(parseScene(sceneText(scene.name, method, gap, step)));
  simulation.setThreads(1);
  const int steps = static_cast<int>(std::lround(scene.seconds / step));
  ContactRun run;
  const double start = threadSeconds();
  for (int k = 0; k < steps; ++k)
  {
    const StepReport report = simulation.step(simulation.defaultInputs());
    if (!report.ok)
      throw std::runtime_error(std::string("cloth_contact: ") + scene.name + ", " + method + ": " + report.message);
    run.iterations += static_cast<double>(report.iterations) / steps;
    run.cuts += report.cut_steps;
  }
  run.cpu = (threadSeconds() - start) / scene.seconds;
  run.x = simulation.state().cloths[0].x;
  return run;
}

/// Compares each run of the barrier with the fastest run by impulses whose error is no larger. ratio() is the geometric
/// mean of the quotients of their CPU times. Runs of the barrier without such a partner are left out.
class TimeAtEqualError
{
public:
  void add(bool barrier, double error, double cpu) { runs_[barrier].push_back({error, cpu}); }
  double ratio() const
  {
    double sum = 0.0;
    int count = 0;
    for (const auto& [error, cpu] : runs_[1])
    {
      double fastest = std::numeric_limits<double>::infinity();
      for (const auto& [other_error, other_cpu] : runs_[0])
        if (other_error <= kEqual * error)
          fastest = std::min(fastest, other_cpu);
      if (std::isfinite(fastest))
      {
        sum += std::log(cpu / fastest);
        ++count;
      }
    }
    return count > 0 ? std::exp(sum / count) : std::numeric_limits<double>::infinity();
  }

private:
  static constexpr double kEqual = 1.05;   // errors of the same step, which differ by less, count as equal
  std::vector<std::pair<double, double>> runs_[2];
};

void runClothContact(StudyContext& context)
{
  useOneBlasThread();
  constexpr double kGap = 1e-3, kNarrowGap = 2e-4;   // [m]
  const double fine = context.quick() ? 2.5e-3 : 3.125e-4;
  const std::vector<double> steps =
      context.quick() ? std::vector<double>{0.01, 0.005} : std::vector<double>{0.01, 0.005, 0.0025, 0.00125};
  double largest = 0.0;
  for (const ContactScene& scene : kScenes)
  {
    const std::string name = scene.name;
    context.progress(0, 1, name + ", converged runs");
    const Eigen::Matrix3Xd by_barrier = runScene(scene, "barrier", kNarrowGap, fine).x,
                           by_impulses = runScene(scene, "impulses", kGap, fine).x;
    const Eigen::Matrix3Xd exact = 0.5 * (by_barrier + by_impulses);
    const auto rms = [&](const Eigen::Matrix3Xd& x) {
      return 1e3 * std::sqrt((x - exact).squaredNorm() / static_cast<double>(x.cols()));
    };
    context.metric("methods_apart_mm_" + name, 2.0 * rms(by_barrier));
    const Simulation start(parseScene(sceneText(name, "barrier", kGap, fine)));
    WorkPrecision front(context, "cloth_contact_" + name, "Cloth in contact, " + name, "RMS error of the vertices [mm]",
                        rms(start.state().cloths[0].x));
    TimeAtEqualError time;
    for (const bool barrier : {false, true})
      for (const double step : steps)
      {
        const char* const method = barrier ? "barrier" : "impulses";
        context.progress(barrier, 2, name + ", " + method);
        const ContactRun run = runScene(scene, method, kGap, step);
        const double error = rms(run.x);
        Row& row = context.row();
        row.set("scene", name).set("method", method).set("step_ms", 1e3 * step).set("error_mm", error);
        row.set("iterations_per_step", run.iterations).set("cuts", run.cuts);
        char setting[32];
        std::snprintf(setting, sizeof setting, "step %g ms", 1e3 * step);
        front.add(row, method, setting, error, run.cpu);
        time.add(barrier, error, run.cpu);
      }
    front.conclude();
    context.metric("time_ratio_" + name, time.ratio());
    largest = std::max(largest, time.ratio());
  }
  context.metric("time_ratio", largest);
  context.note(
      "error: from the mean of both methods with short steps, which are methods_apart_mm apart; time_ratio: CPU time "
      "of "
      "the barrier over that of impulses at an error that is no larger; an error of 100 %: how far the vertices "
      "moved.");
}

const StudyRegistration kClothContactRegistration{
    "cloth_contact", "error against run time of cloth in contact: the barrier and impulses", runClothContact};

}   // namespace

}   // namespace slender::study
