// Thesis table 4.1: milliseconds per time step of its rod examples, part by part.
#include <algorithm>
#include <cmath>
#include <functional>
#include <limits>
#include <string>

#include "slender_sim/dynamics/fast_projection.h"
#include "slender_sim/rod/isotropic_rod.h"
#include "slender_sim/rod/rod_system.h"
#include "slender_sim/scene/reader.h"
#include "slender_sim/scene/simulation.h"
#include "study/framework/cpu_clock.h"
#include "slender_sim/study/study.h"

namespace slender::study {
namespace {

constexpr double kAbsent = std::numeric_limits<double>::quiet_NaN();

/// A row of the thesis's table, and a scene with as many vertices and the same step. Its materials are not given there:
/// ours are such that explicit steps of that length are stable.
struct RodExample
{
  const char* figure;
  const char* what;
  int vertices;
  double step;                                              ///< [ms]
  double forces, contact, quasistatic, projection, total;   ///< thesis [ms]
  int settling;                                             ///< steps until something happens
  const char* scene;
};

const RodExample kRodExamples[] = {
    {"4.1", "knot", 60, 4.0, 0.026, 0.05, 0.021, 0.21, 0.31, 250, R"(
rods:
  - centerline: {straight: {from: [0, 0, 0], to: [0.6, 0, 0], edges: 59}}
    initial: {trefoil: {axis: [1, 0, 0], up: [0, 0, 1], radius: 0.06, separation: 0.012, length: 0.6}}
    cross_section: {radius: 0.003}
    material: {density: 1100, youngs_modulus: 2.0e6, poissons_ratio: 0.48}
    damping: {mass: 2, stiffness: 0.002}
    contact: {self: true, friction: 0.1}
    grasps: {left: {edges: [0]}, right: {edges: [-1]}}
)"},
    {"4.2", "V, turned at one end", 49, 1.0, 0.025, 0.018, 0.021, 0.12, 0.18, 500, R"(
rods:
  - centerline: {vee: {direction: [1, -1, 0], normal: [0, 0, 1], arm: 0.3, angle: 1.5707963267948966, edges: 48}}
    cross_section: {ellipse: [0.002, 0.006]}
    director: [0, 0, 1]
    material: {density: 1100, youngs_modulus: 1.0e7, poissons_ratio: 0.45}
    damping: {mass: 5, stiffness: 0.005}
    contact: {self: true}
    grasps: {left: {edges: [0]}, right: {edges: [-1], attach: initial, motion: {table: [[0, 0, 0, 0, 0, 0, 0, 1], [1, 0, 0, 0, 0.8660254, 0, 0, 0.5]]}}}
)"},
    {"4.3", "twisted helix", 75, 2.0, 0.043, kAbsent, 0.1, 0.2, 0.34, 500, R"(
gravity: [0, 0, -1.0e-3]
rods:
  - centerline: {helix: {axis: [1, 0, 0], radius: 0.1, pitch: 0.9, turns: 10, edges: 74}}
    naturally_straight: true
    initial_twist: 20
    cross_section: {radius: 0.02}
    material: {linear_density: 2, stretch_modulus: 1.0e5, bend_modulus: 1.345, twist_modulus: 0.789}
    damping: {mass: 1}
    stretching: projected
    grasps: {left: {edges: [0]}, right: {edges: [-1]}}
)"},
    {"4.4", "twisted ring", 67, 50.0, 0.039, kAbsent, 0.096, 0.28, 0.42, 100, R"(
gravity: [0, 0, -1.0e-3]
rods:
  - centerline: {arc: {start: [1, 0, 0], axis: [0, 0, 1], angle: 6.283185307179586, edges: 66}}
    naturally_straight: true
    initial_twist: 11.5
    cross_section: {radius: 0.02}
    material: {linear_density: 400, stretch_modulus: 1.0e5, bend_modulus: 1, twist_modulus: 1}
    damping: {mass: 0.01}
    stretching: projected
    grasps: {first: {edges: [0]}, last: {edges: [-1]}}
)"},
    {"4.5", "plectoneme", 275, 1.0, 0.13, 0.19, 0.17, 0.42, 0.92, 3000, R"(
rods:
  - centerline: {straight: {from: [0, 0, 0], to: [1, 0, 0], edges: 274}}
    initial: {arc: {center: [0, 0, 1], start: [-0.3183, 0, 1], axis: [0, -1, 0], angle: 3.141592653589793}}
    initial_twist: 50
    cross_section: {radius: 0.003}
    material: {density: 1100, youngs_modulus: 5.0e6, poissons_ratio: 0.45}
    damping: {stiffness: 0.001, drag: 0.05}
    contact: {self: true, friction: 0.1}
    grasps: {left: {edges: [0]}, right: {edges: [-1]}}
)"},
    {"4.7", "link of a chain", 31, 1.0, 0.016, kAbsent, 0.13, 0.13, 0.2, 100, R"(
rods:
  - centerline: {arc: {start: [1, 0, 0], axis: [0, 0, 1], angle: 6.0, edges: 30}}
    cross_section: {radius: 0.1}
    material: {linear_density: 1, stretch_modulus: 1.0e4, bend_modulus: 2, twist_modulus: 2}
    damping: {mass: 1}
    stretching: projected
    grasps: {end: {nodes: [0], hold: position}}
)"},
    {"4.9", "Wilberforce pendulum", 20, 1.0, 0.0036, kAbsent, 0.0043, 0.019, 0.027, 100, R"(
rods:
  - name: spring
    centerline: {helix: {axis: [0, 0, -1], radius: 0.02, pitch: 0.01, turns: 2, edges: 19}}
    cross_section: {radius: 0.0005}
    material: {linear_density: 0.04, youngs_modulus: 3.0e9, poissons_ratio: 0.3}
    stretching: projected
    grasps: {top: {edges: [0]}}
bodies:
  - {name: bob, mass: 0.004, inertia: [1.0e-6, 1.0e-6, 1.0e-6], shape: {sphere: {radius: 0.015}}, pose: {position: [0.02, 0, -0.03]}, contact: false, welds: [{rod: spring, edge: -1}]}
)"},
    {"4.10", "tree in the wind", 2158, 0.1, 0.87, kAbsent, 0.64, 21.0, 22.0, 100, R"(
wind: {velocity: [12, 2, 0]}
generate:
  - tree:
      seed: 3
      vertices: 2158
      levels: 3
      children: 7
      length: 3.0
      radius: 0.05
      stretching: projected
      joint_density: 1.0e4
      material: {density: 700, youngs_modulus: 1.0e6, poissons_ratio: 0.4}
      damping: {drag: 0.1}
)"},
};

/// Seconds, the fastest of several batches.
double timeOf(int repeats, const std::function<void()>& work)
{
  double best = std::numeric_limits<double>::infinity();
  for (int r = 0; r < repeats; ++r)
  {
    const double start = threadSeconds();
    work();
    best = std::min(best, threadSeconds() - start);
  }
  return best;
}

void advanceScene(Simulation& simulation, int steps, const std::string& what)
{
  for (int k = 0; k < steps; ++k)
  {
    const StepReport report = simulation.step(simulation.defaultInputs());
    if (!report.ok)
      throw std::runtime_error(what + ": " + report.message);
  }
}

struct RodTimes
{
  double forces = 0, quasistatic = 0;   ///< [s] of all rods
};

/// Forces and frames of every rod at the state reached.
RodTimes rodTimes(const Simulation& simulation, int repeats)
{
  RodTimes parts;
  for (std::size_t r = 0; r < simulation.state().rods.size(); ++r)
  {
    const RodModel& model = simulation.rodModel(static_cast<int>(r));
    const RodState& state = simulation.state().rods[r];
    RodSystem system(model);
    std::vector<Pose> poses;
    for (const GraspState& g : state.grasps)
      poses.push_back(g.X_WG);
    RodState to = state;
    if (model.isotropic)
    {
      IsotropicRod rod(model, system);
      parts.forces += timeOf(repeats, [&] { rod.evaluate(state); });
      parts.quasistatic += timeOf(repeats, [&] { rod.settle(state, poses, to); });
      continue;
    }
    system.load(state);
    for (int i = 0; i < model.nodes(); ++i)
      system.setInertia(i, 0.0, Eigen::Vector3d::Zero(), Eigen::Vector3d::Zero());
    const double gradient = timeOf(repeats, [&] { system.evaluate(false); });
    parts.forces += timeOf(repeats, [&] { system.load(state); }) + gradient;
    // frames are carried along by one more evaluation at the new positions
    parts.quasistatic += timeOf(repeats, [&] {
      system.evaluate(false);
      system.solveFrames();
      system.storeTurned(to);
    });
  }
  return parts;
}

Simulation make(const RodExample& e, Integrator integrator, bool with_contact)
{
  SceneConfig config = parseScene(e.scene, std::string("table_4_1/") + e.figure);
  config.time.step = 1e-3 * e.step;
  config.time.integrator = integrator;
  if (!with_contact)
    for (RodConfig& rod : config.rods)
      rod.contact.reset();
  return Simulation(config);
}

}   // namespace

void runRodTables(StudyContext& context)
{
  int done = 0;
  const int count = static_cast<int>(std::size(kRodExamples)), batch = context.quick() ? 20 : 200;
  double least = std::numeric_limits<double>::infinity();
  int most_iterations = 0, most_apart = 0;
  for (const RodExample& e : kRodExamples)
  {
    context.progress(done++, count, e.what);
    const bool contact = std::isfinite(e.contact);
    const std::string name = std::string("figure ") + e.figure;
    const auto timeSteps = [&](Simulation& simulation) {
      return timeOf(3, [&] { advanceScene(simulation, batch, name); }) / batch;
    };
    const int settling = context.quick() ? e.settling / 10 : e.settling;

    Simulation simulation = make(e, contact ? Integrator::implicit_euler : Integrator::symplectic_euler, true);
    int vertices = 0;
    for (const RodState& rod : simulation.state().rods)
      vertices += static_cast<int>(rod.x.cols());
    advanceScene(simulation, settling, name);
    StepReport report = simulation.step(simulation.defaultInputs());
    const double total = timeSteps(simulation);
    const RodTimes parts = rodTimes(simulation, 50);
    Row& row = context.row();
    row.set("figure", e.figure)
        .set("example", e.what)
        .set("vertices", vertices)
        .set("thesis_vertices", e.vertices)
        .set("step_ms", e.step);
    row.set("method", contact                            ? "implicit Euler, general, contact"
                      : simulation.rodModel(0).isotropic ? "explicit, isotropic, projected"
                                                         : "explicit, general, projected");
    row.set("forces_ms", 1e3 * parts.forces).set("thesis_forces_ms", e.forces);
    double contact_time = kAbsent, projection = kAbsent, quasistatic = 1e3 * parts.quasistatic;
    if (contact)
    {
      // the same steps from the same state without contact
      Simulation free = make(e, Integrator::implicit_euler, false);
      advanceScene(free, settling, name);
      contact_time = 1e3 * std::max(0.0, total - timeSteps(free));
      quasistatic = kAbsent;   // angles are unknowns of the implicit step
    }
    else
      // and bodies, velocities, copies of the state
      projection = std::max(0.0, 1e3 * (total - parts.forces - parts.quasistatic));
    row.set("contact_ms", contact_time).set("thesis_contact_ms", e.contact);
    row.set("quasistatic_ms", quasistatic).set("thesis_quasistatic_ms", e.quasistatic);
    row.set("projection_ms", projection).set("thesis_projection_ms", e.projection);
    row.set("total_ms", 1e3 * total).set("thesis_total_ms", e.total).set("speedup", e.total / (1e3 * total));
    row.set("projection_iterations", report.projection_iterations).set("newton_iterations", report.iterations);
    if (e.total / (1e3 * total) < 10)
      row.set(
          "why_not_10x",
          contact
              ? "contact takes implicit steps: barriers that nothing passes, friction and all stiffness in one sparse "
                "system, solved by Newton's method"
              : "so few vertices that copying the state and setting up body and projection weigh as much as the rod");
    most_iterations = std::max(most_iterations, report.projection_iterations);
    most_apart = std::max(most_apart, static_cast<int>(std::abs(vertices - e.vertices)));
    least = std::min(least, e.total / (1e3 * total));
  }
  context.metric("speedup_min", least);
  context.metric("projection_iterations_max", most_iterations);
  context.metric("vertices_from_thesis_max", most_apart);
}

const StudyRegistration kRodTablesRegistration{
    "rod_tables", "time per step of the thesis's rod examples, part by part, beside its table 4.1", runRodTables};

}   // namespace slender::study
