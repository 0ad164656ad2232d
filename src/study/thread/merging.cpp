// Two parallel threads in touch that flow together (thesis 5.4.3), against the rate of the model.
#include <algorithm>
#include <cmath>
#include <cstdio>

#include "slender_sim/scene/reader.h"
#include "slender_sim/scene/simulation.h"
#include "slender_sim/world/world.h"
#include "study/rod/rod_cases.h"
#include "thread_cases.h"

namespace slender::study {
namespace {

/// SI units. Lengths of the edges and a shift along the threads are in radii.
struct MergingCase
{
  const char* name;
  double viscosity, surface_tension, radius;
  double edge = 1.0, shift = 0.0, ratio = 1.0;   ///< ratio of the radii
};

constexpr double kUntil = 0.3;    // of the sum of the radii: below what is compared
constexpr double kEdges = 24.0;   // radii long

/// [s]
double timeScale(const MergingCase& c) { return c.viscosity * c.radius / c.surface_tension; }

/// The model: surface tension 2 pi gamma r draws two balls of radius r = (r1 + r2)/2 together, mu (4 pi/3) rho |d'|
/// resists, so
///   d' = -(3/2) gamma r / (mu rho),  rho^2 = r^2 - d^2/4,
/// for d = 2 r cos(a) of constant radius a - sin(a) cos(a) = 3 gamma t / (2 mu r). Free threads also thicken, r' =
/// gamma/(6 mu). By Runge-Kutta's method for a^3, which begins smoothly.
double modelDistance(const MergingCase& c, double time)
{
  const double growth = c.surface_tension / (6 * c.viscosity);
  const auto rate = [&](double t, double cube) {
    const double a = std::cbrt(cube), r = c.radius + growth * t, sine = a > 0 ? std::sin(a) / a : 1.0;
    return 2.25 * c.surface_tension / (c.viscosity * r * sine * sine) + 3 * a * growth * std::cos(a) / (r * sine);
  };
  const int steps = 1000;
  const double h = time / steps;
  double u = 0.0;
  for (int k = 0; k < steps; ++k)
  {
    const double t = k * h, k1 = rate(t, u), k2 = rate(t + 0.5 * h, u + 0.5 * h * k1),
                 k3 = rate(t + 0.5 * h, u + 0.5 * h * k2), k4 = rate(t + h, u + h * k3);
    u += h / 6 * (k1 + 2 * k2 + 2 * k3 + k4);
  }
  return 2 * (c.radius + growth * time) * std::cos(std::cbrt(u));
}

struct Seen
{
  std::vector<double> time, distance;   ///< distance of the axes in the middle [m]
  double radius = 0.0, volume_drift = 0.0;
};

Seen mergePair(const MergingCase& c, int steps, double duration, double until)
{
  WorldModel model;
  WorldState state;
  WorldInputs inputs;
  const double radii[2] = {2 * c.radius / (1 + c.ratio), 2 * c.radius * c.ratio / (1 + c.ratio)};
  for (int k = 0; k < 2; ++k)
  {
    ThreadSetup t = straightThread(kEdges * c.radius,
                                   Eigen::VectorXd::Constant(static_cast<int>(std::lround(kEdges / c.edge)), radii[k]));
    t.model.viscosity = c.viscosity;
    t.model.surface_tension = c.surface_tension;
    t.model.density = 1e-4 * c.viscosity * c.viscosity / (c.surface_tension * c.radius);   // inertia is no matter
    for (Eigen::Vector3d& x : t.state.x)
      x += Eigen::Vector3d(k * c.shift, 0, 2.0 * k) * c.radius;
    model.threads.push_back({std::make_shared<ThreadModel>(t.model), ContactProperties{}, until});
    state.threads.emplace_back();
    state.end_loads.emplace_back();
    state.threads.back().threads.push_back(t.state);
    inputs.threads.push_back(t.inputs);
  }
  model.contact.gap = 0.01 * c.radius;
  model.contact.least_stiffness = 1e-6 * c.surface_tension * c.radius;
  model.time.newton.tolerance = 1e-7;
  model.time.step = duration / steps;
  World threads(model, state);
  const double before = state.threads[0].volumeBalance() + state.threads[1].volumeBalance();
  Seen seen;
  for (int k = 0; k < steps; ++k)
  {
    const StepReport report = threads.step(state, inputs);
    if (!report.ok)
      throw std::runtime_error(std::string("merging, ") + c.name + ": " + report.message);
    const ThreadState &a = state.threads[0].threads[0], &b = state.threads[1].threads[0];
    const Eigen::Vector3d apart = b.x[b.nodes() / 2] - a.x[a.nodes() / 2];
    seen.time.push_back((k + 1) * duration / steps);
    seen.distance.push_back(std::hypot(apart.y(), apart.z()));
  }
  seen.radius = state.threads[0].threads[0].radius(state.threads[0].threads[0].edges() / 2);
  seen.volume_drift = (state.threads[0].volumeBalance() + state.threads[1].volumeBalance()) / before - 1;
  return seen;
}

/// Two threads that overlap in a scene without contact go on as if each were alone, bit by bit.
double largestInfluence()
{
  const auto scene = [](bool first, bool second) {
    std::string text = "name: off\ntime: {step: 0.002, duration: 1}\nthreads:\n";
    for (int k = 0; k < 2; ++k)
      if (k ? second : first)
        text += "  - {name: t" + std::to_string(k) +
                ", fluid: {density: 1400, viscosity: 20, surface_tension: 0.05}, radius: 0.001,\n" +
                "     centerline: {straight: {from: [0, 0, " + (k ? "0.0015" : "0") +
                "], to: [0.03, 0, 0.002], edges: 20}}, ends: {oldest: held}}\n";
    return parseScene(text, "merging");
  };
  Simulation both(scene(true, true)), first(scene(true, false)), second(scene(false, true));
  double largest = 0.0;
  for (int k = 0; k < 100; ++k)
    for (Simulation* s : {&both, &first, &second})
      if (const StepReport report = s->step(s->defaultInputs()); !report.ok)
        throw std::runtime_error("merging, off: " + report.message);
  for (int k = 0; k < 2; ++k)
  {
    const ThreadState &a = both.state().threads[k].threads[0], &b = (k ? second : first).state().threads[0].threads[0];
    for (int i = 0; i < a.nodes(); ++i)
      largest = std::max({largest, (a.x[i] - b.x[i]).norm(), (a.v[i] - b.v[i]).norm()});
  }
  return largest;
}

/// Honey that coils: side views of the pile, and the height of its older half, without merging and with it.
void pile(StudyContext& context)
{
  const double duration = context.quick() ? 2.4 : 3.2;
  Plot& plot = context.plot("merging_pile", "honey that coils onto itself: centrelines", "x [mm]", "z [mm]");
  plot.log_x = plot.log_y = false;
  plot.equal_axes = true;
  plot.markers = false;
  for (const bool merging : {false, true})
  {
    Simulation s(parseScene(
        std::string(
            "name: pile\ntime: {step: 0.002, duration: 4}\nthreads:\n"
            "  - {name: honey, fluid: {density: 1400, viscosity: 100, surface_tension: 0.3}, floor: {height: 0},\n"
            "     nozzle: {position: [0, 0, 0.06], direction: [0.01, 0.02, -1], diameter: 0.01, flow: 4.0e-6},\n"
            "     edges: {feed: 0.004, longest: 0.005, shortest: 0.0015}, contact: {self: true}, merging: ") +
            (merging ? "true" : "false") + "}\n",
        "merging"));
    const int steps = static_cast<int>(std::lround(duration / 0.002));
    for (int k = 0; k < steps; ++k)
    {
      if (k % 100 == 0)
        context.progress(k, steps, merging ? "a pile that merges" : "a pile");
      if (const StepReport report = s.step(s.defaultInputs()); !report.ok)
        throw std::runtime_error("merging, pile: " + report.message);
    }
    const ThreadState& t = s.state().threads[0].threads[0];
    Series& series = plot.at(merging ? "merging" : "contact only");
    double highest = 0.0;
    for (int i = 0; i < t.nodes(); ++i)
    {
      series.x.push_back(1e3 * t.x[i].x());
      series.y.push_back(1e3 * t.x[i].z());
      if (i < t.nodes() / 2)
        highest = std::max(highest, t.x[i].z());
    }
    context.metric(merging ? "pile_height_merging_mm" : "pile_height_contact_mm", 1e3 * highest);
  }
}

}   // namespace

void runMerging(StudyContext& context)
{
  const int steps = context.quick() ? 200 : 800;
  const MergingCase cases[] = {{"honey", 10, 0.05, 1e-3},
                               {"pitch", 1e6, 0.03, 1e-2},
                               {"thin", 0.1, 0.07, 1e-4},
                               {"short edges", 10, 0.05, 1e-3, 0.5},
                               {"long edges", 10, 0.05, 1e-3, 3.0},
                               {"nodes between nodes", 10, 0.05, 1e-3, 1.0, 0.4},
                               {"unequal radii", 10, 0.05, 1e-3, 1.0, 0.0, 1.5}};
  Plot& plot = context.plot("merging", "two parallel threads in touch", "gamma t / (mu r) [-]",
                            "distance of the axes / 2 r [-]");
  plot.log_x = plot.log_y = false;
  plot.markers = false;
  const char* source = "2 pi gamma r = mu (4 pi/3) rho |d'|, rho^2 = r^2 - d^2/4, r' = gamma/(6 mu)";
  double drift = 0.0;
  int done = 0;
  for (const MergingCase& c : cases)
  {
    context.progress(done++, static_cast<int>(std::size(cases)), c.name);
    const double unit = timeScale(c), duration = 0.5 * unit;
    const Seen seen = mergePair(c, steps, duration, kUntil);
    drift = std::max(drift, std::abs(seen.volume_drift));
    for (const double share : {0.1, 0.3, 0.5})
    {
      const int k = static_cast<int>(std::lround(share * unit / duration * steps)) - 1;
      Row& row = context.row();
      row.set("test", c.name).set("quantity", "distance of the axes").set("t", seen.time[k]);
      const double expected = modelDistance(c, seen.time[k]);
      row.check(seen.distance[k], expected, 0.01 * expected, source)
          .set("relative_error", seen.distance[k] / expected - 1);
    }
    Series& series = plot.at(c.name);
    for (int k = 0; k < steps; k += steps / 50)
    {
      series.x.push_back(seen.time[k] / unit);
      series.y.push_back(seen.distance[k] / (2 * c.radius));
    }
  }
  Series& model = plot.at("model");
  for (int k = 1; k <= 50; ++k)
  {
    model.x.push_back(0.01 * k);
    model.y.push_back(modelDistance(cases[0], 0.01 * k * timeScale(cases[0])) / (2 * cases[0].radius));
  }
  // they stop where they are told to
  const Seen whole = mergePair(cases[0], steps, 0.6 * timeScale(cases[0]), 0.6);
  Row& row = context.row();
  row.set("test", "honey, until 0.6").set("quantity", "final distance of the axes").set("t", whole.time.back());
  row.check(whole.distance.back(), 0.6 * 2 * whole.radius + 0.5 * 0.01 * cases[0].radius, 0.5 * 0.01 * cases[0].radius,
            "0.6 (r1 + r2), and the contact's gap above");
  Row& off = context.row();
  off.set("test", "off").set("quantity", "influence on each other of threads without contact");
  off.check(largestInfluence(), 0.0, 1e-300, "bit-equal to each thread alone");
  const auto error = [&](int count) {
    const double t = 0.3 * timeScale(cases[0]);
    return mergePair(cases[0], count, t, kUntil).distance.back() / modelDistance(cases[0], t) - 1;
  };
  context.metric("observed_order_time", observedOrder(error(200), error(400)));
  context.metric("volume_drift", drift);
  pile(context);
}

const StudyRegistration kMergingRegistration{
    "merging", "two parallel viscous threads in touch flow together at the rate of the model; a pile of honey",
    runMerging};

}   // namespace slender::study
