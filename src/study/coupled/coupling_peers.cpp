// Scenes of cloth and bodies beside STARK, the nearest peer: iterations of Newton's method, time, range of contact.
#include <algorithm>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <limits>
#include <memory>
#include <sstream>
#include <stdexcept>
#include <string>
#include <vector>

#include "slender_sim/scene/reader.h"
#include "slender_sim/scene/simulation.h"
#include "study/framework/cpu_clock.h"
#include "study/framework/processes.h"
#include "study/rod/rod_cases.h"

namespace slender::study {

namespace {

constexpr double kMostSeconds = 300.0;     // CPU time after which a scene ends early [s]
constexpr double kSpeedTolerance = 1e-3;   // A step ends when velocities change by less, as in the peer [m/s].

/// A scene that both programs simulate. `hang`, `ball` and `sphere` have a square sheet of cotton with sides of 1 m and
/// E h = 100 N/m. `boxes` and `twist` are examples of the peer. `peer_solutions` are the linear equations per step
/// that the peer solves (InteractiveComputerGraphics/stark 0.1.0, commit 16197f7): one more than its iterations,
/// because it does not count the last solution, which ends the step. 0 means that the peer was not measured.
struct PeerScene
{
  std::string name;
  int cells;
  double seconds;
  double peer_solutions;

  double side() const { return name == "boxes" || name == "twist" ? 0.5 : 1.0; }   ///< of the sheet [m]
};

struct Sheet
{
  double side = 1.0, z = 0.0;         ///< length of a side, and height [m]
  double modulus = 1e5;               ///< Young's modulus [Pa]
  double mass_damping = 0.1;          ///< [1/s]
  double stiffness_damping = 0.005;   ///< [s]
};

std::string sheet(int cells, const Sheet& s, const std::string& more)
{
  std::ostringstream text;
  text << "cloths:\n  - name: sheet\n    grid: {corner: [" << -0.5 * s.side << ", " << -0.5 * s.side << ", " << s.z
       << "], sides: [[" << s.side << ", 0, 0], [0, " << s.side << ", 0]], cells: " << cells
       << ", pattern: alternating}\n    material: {area_density: 0.2, thickness: 0.001, youngs_modulus: " << s.modulus
       << ", poissons_ratio: 0.3}\n    bending: {modulus: 1.0e-6}\n    damping: {mass: " << s.mass_damping
       << ", stiffness: " << s.stiffness_damping << "}\n"
       << more;
  return text.str();
}

std::string corners(const std::vector<std::string>& names)
{
  std::string text = "    grasps:\n";
  for (const std::string& name : names)
    text += "      " + name + ": {corner: " + name + "}\n";
  return text;
}

const std::string kTouching = "    contact: {friction: 0.3, thickness: 0.002, method: barrier}\n";

/// `range`: distance beyond the thickness of 2 mm within which surfaces repel each other [m]. Surfaces of the peer
/// repel each other within 2 mm of each surface.
std::string fallingBall(int cells, double range)
{
  std::ostringstream text;
  text << "time: {step: 0.01, duration: 1, integrator: implicit_euler}\ncontact: {gap: " << range << "}\n"
       << sheet(cells, {}, kTouching + corners({"lower_left", "lower_right", "upper_left", "upper_right"}))
       << "bodies:\n  - {name: ball, mass: 1, shape: {sphere: {radius: 0.1}}, friction: 0.3, pose: {position: [0, 0, "
          "0.4]}}\n";
  return text.str();
}

std::string sheetOnSphere(int cells, double range)
{
  std::ostringstream text;
  text << "time: {step: 0.01, duration: 1.5}\ncontact: {gap: " << range << "}\n"
       << sheet(cells, {1.0, 0.25}, kTouching)
       << "obstacles:\n  - {name: sphere, shape: {sphere: {radius: 0.2}}, friction: 0.3}\n";
  return text.str();
}

/// An example of the peer: 24 boxes of 1 kg stand in stacks of eight on a sheet. One edge of the sheet is lifted and
/// then pulled. The sheet of the peer has E h = 5 N/m and a limit of strain. This sheet has no such limit and is ten
/// times as stiff.
std::string boxesOnCloth(int cells)
{
  constexpr double kSide = 0.08, kThickness = 1e-3, kLift = 0.1, kSpeed = 0.125;   // [m], [m/s]
  std::ostringstream motion, text;
  for (int k = 0; k <= 40; ++k)
  {
    const double t = 0.1 * k, u = std::clamp(t - 1.0, 0.0, 1.0), way = std::max(0.0, t - 2.0) * kSpeed;
    motion << (k == 0 ? "[" : ", [") << t << ", 0, " << way << ", " << kLift * u * u * (3.0 - 2.0 * u)
           << ", 0, 0, 0, 1]";
  }
  text << "time: {step: 0.03333333333, duration: 4, integrator: implicit_euler}\ncontact: {gap: 0.0005}\n"
       << sheet(cells, {0.5, kThickness, 5e4, 1.0, 0.2},
                "    contact: {friction: 0.5, thickness: 0.001, method: barrier}\n    grasps:\n      edge: {edge: "
                "upper, attach: initial, motion: {table: [" +
                    motion.str() + "]}}\n")
       << "obstacles:\n  - {name: floor, shape: {plane: {}}, friction: 0.5}\nbodies:\n";
  for (int level = 0; level < 8; ++level)
    for (int k = -1; k <= 1; ++k)
      text << "  - {name: box_" << level << "_" << k + 1 << ", mass: 1, friction: 0.5, shape: {box: {size: [" << kSide
           << ", " << kSide << ", " << kSide << "]}}, pose: {position: [" << k * (kSide + kThickness) << ", "
           << (k == 0 ? -kSide : -1.5 * kSide) << ", "
           << 0.5 * kSide + 1.7 * kThickness + level * (kSide + 0.5 * kThickness) << "]}}\n";
  return text.str();
}

/// An example of the peer: two opposite edges of a sheet rotate in opposite directions, by 90 degrees a second each.
std::string twistedSheet(int cells)
{
  const auto turning = [](double sign) {
    std::ostringstream rows;
    for (int k = 0; k <= 60; ++k)
    {
      const double half = sign * 0.25 * M_PI * 0.05 * k;
      rows << (k == 0 ? "[" : ", [") << 0.05 * k << ", 0, 0, 0, " << std::sin(half) << ", 0, 0, " << std::cos(half)
           << "]";
    }
    return "{attach: initial, motion: {table: [" + rows.str() + "]}, edge: ";
  };
  return "time: {step: 0.03333333333, duration: 3}\ngravity: [0, 0, 0]\ncontact: {gap: 0.0005}\n" +
         sheet(cells, {0.5, 0.0, 5e3, 0.1, 0.1},
               "    contact: {friction: 0, thickness: 0.001, method: barrier}\n    grasps:\n      left: " +
                   turning(1.0) + "left}\n      right: " + turning(-1.0) + "right}\n");
}

std::string textOf(const PeerScene& scene, double range)
{
  if (scene.name == "ball")
    return fallingBall(scene.cells, range);
  if (scene.name == "sphere")
    return sheetOnSphere(scene.cells, range);
  if (scene.name == "boxes")
    return boxesOnCloth(scene.cells);
  if (scene.name == "twist")
    return twistedSheet(scene.cells);
  return "time: {step: 0.01, duration: 1}\n" + sheet(scene.cells, {}, corners({"upper_left", "upper_right"}));
}

struct PeerRun
{
  double seconds = 0.0;   ///< simulated time [s]
  double cpu = 0.0;       ///< CPU time [s]
  int steps = 0, iterations = 0, cut_steps = 0;
  double lowest = 0.0;   ///< lowest height of the body's centre [m]
  double cpuPerSecond() const { return cpu / seconds; }
  double iterationsPerStep() const { return static_cast<double>(iterations) / steps; }
};

PeerRun runScene(const PeerScene& scene, double range)
{
  SceneConfig config = parseScene(textOf(scene, range), scene.name);
  const double step = config.time.step;
  config.time.newton.tolerance = kSpeedTolerance * step * scene.cells / scene.side();
  Simulation simulation(config);
  simulation.setThreads(1);
  PeerRun run;
  while (run.seconds < scene.seconds - 0.5 * step && run.cpu < kMostSeconds)
  {
    const SceneInputs inputs = simulation.defaultInputs();
    const double begin = threadSeconds();
    const StepReport report = simulation.step(inputs);
    run.cpu += threadSeconds() - begin;
    if (!report.ok)
      throw std::runtime_error("coupling_peers: " + scene.name + ": " + report.message);
    run.seconds += step;
    ++run.steps;
    run.iterations += report.iterations;
    run.cut_steps += report.cut_steps;
    if (!simulation.state().bodies.empty())
      run.lowest = std::min(run.lowest, simulation.state().bodies[0].X_WB.position.z());
  }
  return run;
}

/// Runs the peer and returns its CPU time per simulated second. The command prints cpu_per_sim_s=NUMBER. Returns 0 if
/// there is no command.
double peerTime(const PeerScene& scene)
{
  const char* const command = std::getenv("SLENDER_PEER");
  if (!command)
    return 0.0;
  const std::string line = shellWord(command) + " " + scene.name + " " + std::to_string(scene.cells);
  const std::unique_ptr<FILE, int (*)(FILE*)> output(popen(line.c_str(), "r"), pclose);
  double time = 0.0;
  char text[512];
  while (output && std::fgets(text, sizeof text, output.get()))
    if (const char* at = std::strstr(text, "cpu_per_sim_s="))
      time = std::atof(at + 14);
  if (!(time > 0.0))
    throw std::runtime_error("coupling_peers: '" + line + "' printed no line with cpu_per_sim_s=NUMBER");
  return time;
}

/// Runs a scene with ranges of the barrier from 0.5 to 4 mm. Returns the most CPU time over the least.
double costOfRange(StudyContext& context, const PeerScene& scene)
{
  double least = std::numeric_limits<double>::infinity(), most = 0.0;
  for (const double range : {0.0005, 0.001, 0.002, 0.004})
  {
    const PeerRun run = runScene(scene, range);
    context.row()
        .set("scene", scene.name)
        .set("cells", scene.cells)
        .set("range_mm", 1e3 * range)
        .set("cpu_per_second", run.cpuPerSecond())
        .set("iterations_per_step", run.iterationsPerStep())
        .set("cut_steps", run.cut_steps);
    least = std::min(least, run.cpuPerSecond());
    most = std::max(most, run.cpuPerSecond());
  }
  return most / least;
}

}   // namespace

void runCouplingPeers(StudyContext& context)
{
  constexpr double kRange = 0.002;   // [m], that of the peer
  std::vector<PeerScene> scenes{{"hang", 20, 1.0, 3.77}, {"ball", 20, 1.0, 5.44}};
  if (!context.quick())
    scenes = {{"hang", 20, 1, 3.77},      {"hang", 40, 1, 4.46},     {"hang", 80, 1, 5.04},   {"hang", 160, 1, 5.66},
              {"ball", 20, 1, 5.44},      {"ball", 40, 1, 7.11},     {"ball", 80, 1, 9.77},   {"sphere", 20, 1.5, 6.95},
              {"sphere", 40, 1.5, 12.37}, {"sphere", 80, 1.5, 25.7}, {"boxes", 64, 4, 12.80}, {"twist", 64, 3, 11.03}};
  double iterations = 0.0, ball_iterations = 0.0, time = 0.0, depth[2] = {0.0, 0.0};
  for (std::size_t k = 0; k < scenes.size(); ++k)
  {
    const PeerScene& scene = scenes[k];
    context.progress(static_cast<int>(k), static_cast<int>(scenes.size()) + 2, scene.name);
    const PeerRun run = runScene(scene, kRange);
    const double peer = peerTime(scene);
    Row& row = context.row()
                   .set("scene", scene.name)
                   .set("cells", scene.cells)
                   .set("range_mm", scene.side() < 1.0 ? 0.5 : 1e3 * kRange)
                   .set("cpu_per_second", run.cpuPerSecond())
                   .set("iterations_per_step", run.iterationsPerStep())
                   .set("cut_steps", run.cut_steps)
                   .set("simulated_seconds", run.seconds);
    if (scene.peer_solutions > 0.0)
    {
      row.set("peer_solutions", scene.peer_solutions);
      iterations = std::max(iterations, run.iterationsPerStep() / scene.peer_solutions);
    }
    if (peer > 0.0)
    {
      row.set("cpu_over_peer", run.cpuPerSecond() / peer);
      time = std::max(time, run.cpuPerSecond() / peer);
    }
    if (scene.name == "ball" && scene.cells == 20)
      ball_iterations = run.iterationsPerStep();
    if (scene.name == "ball" && scene.cells >= 40)
      depth[scene.cells == 80] = run.lowest;
  }
  const int cells = context.quick() ? 10 : 20;
  const double ball = costOfRange(context, {"ball", cells, 1.0, 0.0});
  const double sphere = context.quick() ? ball : costOfRange(context, {"sphere", cells, 1.5, 0.0});
  context.metric("iterations_ball_20", ball_iterations);
  context.metric("cost_of_range", std::max(ball, sphere));
  if (!context.quick())
    context.metric("iterations_over_peer", iterations);
  if (!context.quick())
    context.metric("depth_error", std::abs(depth[0] / depth[1] - 1.0));
  if (time > 0.0)
    context.metric("cpu_over_peer", time);
  context.note(
      "one thread; each scene ends after 300 s of CPU time; with SLENDER_PEER=COMMAND, `COMMAND SCENE CELLS` runs the "
      "peer after each scene");
}

const StudyRegistration kCouplingPeersRegistration{
    "coupling_peers", "cloth and bodies beside the nearest peer: iterations, time, cost of the range of contact",
    runCouplingPeers};

}   // namespace slender::study
