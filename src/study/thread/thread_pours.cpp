// A hundred pours of fluids from water to pitch, whose scenes give neither edges nor break-up. Each works, is warned of
// or is refused. What is simulated is judged by balances of energy and momentum, which the stepper does not know.
#include "thread_pours.h"

#include <algorithm>
#include <cmath>
#include <cstdarg>
#include <cstdio>

#include "coil_cases.h"
#include "slender_sim/scene/reader.h"
#include "slender_sim/scene/simulation.h"
#include "study/framework/cpu_clock.h"
#include "slender_sim/thread/thread_group.h"
#include "slender_sim/thread/thread_surface.h"

namespace slender::study {

std::string formatted(const char* format, ...)
{
  char buffer[1000];
  va_list arguments;
  va_start(arguments, format);
  std::vsnprintf(buffer, sizeof buffer, format, arguments);
  va_end(arguments);
  return buffer;
}

std::string pouredScene(const Fluid& fluid, const Outlet& outlet, double step, const std::string& more_nozzle,
                        const std::string& more_floor)
{
  return formatted(
      "time: {step: %.9g, duration: 1}\ngravity: [0, 0, %g]\nthreads:\n  - name: poured\n"
      "    fluid: {density: %.9g, viscosity: %.9g, surface_tension: %.9g}\n"
      "    nozzle: {position: [0, 0, %.9g], diameter: %.9g, flow: %.9g%s}\n    floor: {height: 0%s}\n",
      step, -kPourGravity, fluid.density, fluid.viscosity, fluid.surface_tension, outlet.height, outlet.diameter,
      outlet.flow(), more_nozzle.c_str(), more_floor.c_str());
}

Landing landingOf(const Fluid& fluid, const Outlet& outlet)
{
  return estimateLanding({fluid.density, fluid.viscosity, kPourGravity, outlet.diameter, outlet.flow(), outlet.height});
}

double edgesPerTurn(const ThreadState& thread, double radius)
{
  constexpr int kYoungest = 40;
  double length = 0.0;
  int count = 0;
  for (int j = thread.edges() - 1; j >= 0 && count < kYoungest; --j)
    if (thread.deposited[j] && thread.deposited[j + 1])
    {
      length += thread.edge(j).norm();
      ++count;
    }
  return length > 0 ? 2.0 * M_PI * radius * count / length : 0.0;
}

namespace {

constexpr double kFewPerTurn = 10.0;   // edges: the readers' warning begins there

/// Round values of handbooks. They differ by the kind of the fluid and by its temperature.
const std::vector<Fluid> kFluids = {
    {"water", 1000, 1e-3, 0.072},      {"milk", 1030, 2e-3, 0.047},     {"blood", 1060, 4e-3, 0.056},
    {"olive oil", 912, 0.08, 0.032},   {"motor oil", 880, 0.25, 0.031}, {"castor oil", 960, 0.99, 0.039},
    {"glycerin", 1260, 1.4, 0.063},    {"warm honey", 1400, 2, 0.05},   {"shampoo", 1020, 4, 0.03},
    {"chocolate", 1300, 3, 0.04},      {"corn syrup", 1380, 5, 0.08},   {"honey", 1400, 10, 0.05},
    {"glue", 1100, 20, 0.04},          {"molasses", 1420, 50, 0.07},    {"caramel", 1400, 100, 0.05},
    {"silicone oil", 970, 1e3, 0.021}, {"glass melt", 2500, 1e3, 0.3},  {"stiff glass", 2500, 1e5, 0.3},
    {"tar", 1200, 3e4, 0.03},          {"pitch", 1100, 2e8, 0.03}};

const std::vector<Outlet> kOutlets = {
    {0.001, 0.03, 0.2}, {0.003, 0.1, 0.05}, {0.005, 0.2, 0.02}, {0.01, 0.1, 0.1}, {0.02, 0.5, 0.3}};

/// What a pour can be by mechanics alone. The rules share nothing with those by which the stepper refuses a step.
class PourPhysics
{
public:
  PourPhysics(const Fluid& fluid, const Outlet& outlet, const ThreadGroupState& start)
    : fluid_(fluid),
      outlet_(outlet),
      energy_(energyOf(start))
  {
  }

  /// Takes the state after a step of h seconds, `pull` being the force of the thread on the nozzle [N]. Returns what is
  /// wrong, or an empty string: numbers that are not finite; fluid above the nozzle, below the floor or farther aside
  /// than the fall is high; an edge 1.5 times as wide as the puddle into which all the fluid would spread; energy that
  /// grows by more than what the nozzle brings in; what is in the air carrying more downward momentum than a free fall
  /// over the whole height gives.
  std::string look(const ThreadGroupState& group, const Eigen::Vector3d& pull, double h)
  {
    std::string absurd = placesAndWidths(group);
    if (absurd.empty())
      absurd = growth(group, pull, h);
    return absurd.empty() ? momentum(group) : absurd;
  }
  /// Largest growth of the energy in a step beyond what came in, over the energy of all that is in the air [-].
  double worstGrowth() const { return worst_growth_; }

private:
  /// Depth of a puddle of any size on a surface that it does not wet [m].
  double puddleDepth() const { return 2.0 * std::sqrt(fluid_.surface_tension / (fluid_.density * kPourGravity)); }
  double freeFall() const { return std::sqrt(outlet_.speed * outlet_.speed + 2.0 * kPourGravity * outlet_.height); }

  static double nodeVolume(const ThreadState& t, int i)
  {
    return 0.5 * ((i > 0 ? t.volume[i - 1] : 0.0) + (i < t.edges() ? t.volume[i] : 0.0));
  }

  std::string placesAndWidths(const ThreadGroupState& group) const
  {
    const double around = 2.0 * (puddleDepth() + outlet_.diameter), aside = outlet_.height + around;
    double all = 0.0;
    for (const ThreadState& t : group.threads)
      all += t.totalVolume();
    const double puddle = std::sqrt(all / (M_PI * puddleDepth())), drop = std::cbrt(0.75 * all / M_PI);
    // What lands spreads a little farther than a puddle at rest.
    constexpr double kSpread = 1.5;
    const double widest = kSpread * std::max({puddle, drop, 0.5 * outlet_.diameter});
    for (const ThreadState& t : group.threads)
    {
      for (int i = 0; i < t.nodes(); ++i)
      {
        if (!t.x[i].allFinite() || !t.v[i].allFinite())
          return "a number that is not finite";
        if (t.x[i].z() > outlet_.height + around || t.x[i].z() < -around || t.x[i].head<2>().norm() > aside)
          return formatted("a node %g m aside and %g m above the floor", t.x[i].head<2>().norm(), t.x[i].z());
      }
      for (int j = 0; j < t.edges(); ++j)
      {
        if (!(t.volume[j] > 0) || !std::isfinite(t.radius(j)))
          return "an edge without a radius";
        if (t.radius(j) > widest && t.radius(j) > t.edge(j).norm())
          return formatted("an edge of %g m in radius, where all the fluid makes a puddle of %g m", t.radius(j),
                           puddle);
      }
    }
    return "";
  }

  /// Kinetic (of the nodes and of the edges' spin) and potential energy, and that of the surface [J].
  double energyOf(const ThreadGroupState& group) const
  {
    double energy = 0.0;
    for (const ThreadState& t : group.threads)
    {
      for (int i = 0; i < t.nodes(); ++i)
        energy += fluid_.density * nodeVolume(t, i) * (0.5 * t.v[i].squaredNorm() + kPourGravity * t.x[i].z());
      for (int j = 0; j < t.edges(); ++j)
        energy += 0.25 * fluid_.density * t.volume[j] * std::pow(t.radius(j) * t.spin[j], 2);
      energy += fluid_.surface_tension * surfaceArea(t);
    }
    return energy;
  }

  std::string growth(const ThreadGroupState& group, const Eigen::Vector3d& pull, double h)
  {
    // Edges are divided, joined and broken between steps. That moves the nodes of a few edges by a part of their
    // length, which is at most 1/25 of the fall.
    constexpr double kMost = 0.05;
    const double before = energy_, brought = fluid_.density * outlet_.flow() *
                                             (0.5 * outlet_.speed * outlet_.speed + kPourGravity * outlet_.height);
    const double surface = fluid_.surface_tension * M_PI * outlet_.diameter * outlet_.speed,
                 pushed = std::max(0.0, pull.z()) * outlet_.speed;
    energy_ = energyOf(group);
    double mass = 0.0;
    for (const ThreadState& t : group.threads)
      for (int i = 0; i < t.nodes(); ++i)
        mass += t.deposited[i] ? 0.0 : fluid_.density * nodeVolume(t, i);
    const double scale = mass * 0.5 * freeFall() * freeFall();
    const double beyond = energy_ - before - h * (brought + surface + pushed);
    worst_growth_ = std::max(worst_growth_, beyond / scale);
    return beyond > kMost * scale
               ? formatted("energy that grows by %g J in a step without cause, of %g J in the air", beyond, scale)
               : "";
  }

  std::string momentum(const ThreadGroupState& group) const
  {
    double mass = 0.0, downward = 0.0;
    for (const ThreadState& t : group.threads)
      for (int i = 0; i < t.nodes(); ++i)
        if (!t.deposited[i])
        {
          mass += fluid_.density * nodeVolume(t, i);
          downward -= fluid_.density * nodeVolume(t, i) * t.v[i].z();
        }
    constexpr double kRounding = 1.01;
    return downward > kRounding * mass * freeFall()
               ? formatted("what falls moves at %g m/s in the mean, faster than free fall", downward / mass)
               : "";
  }

  const Fluid& fluid_;
  const Outlet& outlet_;
  double energy_, worst_growth_ = 0.0;
};

struct Poured
{
  std::string outcome;   ///< works, warned, refused, stopped
  std::string says;      ///< the first warning, or why it was refused or stopped
  std::string absurd;
  double lost = 0.0;   ///< of the fluid
  double turns = 0.0, per_turn = 0.0;
  double growth = 0.0;   ///< see PourPhysics::worstGrowth()
  double simulated = 0.0, duration = 0.0, seconds = 0.0;
  bool reached = true;   ///< its duration, or an end of its own
};

/// How much may be computed for a pour. The counts do not depend on the computer.
struct Budget
{
  long substeps;
  double factored_nodes;   ///< factorisations times nodes
};

/// Pours until the thread has landed and should have turned some times, or until the budget is spent.
Poured pour(const Fluid& fluid, const Outlet& outlet, double turns, const Budget& budget)
{
  Poured p;
  const double begin = threadSeconds();
  SceneConfig config;
  try
  {
    config = parseScene(pouredScene(fluid, outlet, 0.002), "poured");
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
  p.duration = 1.5 * 2.0 * outlet.height / (outlet.speed + landing.speed) +
               (landing.slender() ? turns * 2.0 * M_PI / landing.frequency : 1.0);
  Simulation simulation(config);
  const ThreadGroupState& group = simulation.state().threads[0];
  Landings landings(group.threads[0]);
  PourPhysics physics(fluid, outlet, group);
  long substeps = 0;
  double factored = 0.0;
  while (simulation.state().time < p.duration)
  {
    p.reached = substeps < budget.substeps && factored < budget.factored_nodes;
    if (!p.reached)
      break;
    const double before = simulation.state().time;
    const StepReport report = simulation.step(simulation.defaultInputs());
    int nodes = 0;
    for (const ThreadState& t : group.threads)
      nodes += t.nodes();
    substeps += report.substeps + report.cut_steps;
    factored += static_cast<double>(report.factorizations) * nodes;
    if (!report.ok)
    {
      p.outcome = "stopped";
      p.says = report.message;
      break;
    }
    p.absurd = physics.look(group, simulation.state().end_loads[0][1].force, simulation.state().time - before);
    if (!p.absurd.empty())
      break;
    landings.look(group.threads[0], simulation.state().time);
    ThreadVolumes volumes;
    volumes.add(group);
    p.lost = std::max(p.lost, std::abs(volumes.missing()));
  }
  const CoilTrace trace(landings);
  p.turns = trace.turns();
  p.per_turn = edgesPerTurn(group.threads[0], trace.radius());
  p.growth = physics.worstGrowth();
  p.simulated = simulation.state().time;
  p.seconds = threadSeconds() - begin;
  return p;
}

/// What all pours add up to.
struct Tally
{
  int scenes = 0, works = 0, warned = 0, refused = 0, stopped = 0, stopped_silently = 0, absurd = 0, unwarned = 0,
      not_reached = 0;
  double lost = 0.0, growth = 0.0, puddle_growth = 0.0;   ///< largest values

  void add(StudyContext& context, const Fluid& fluid, const Outlet& outlet, const Poured& p)
  {
    // A coil is unresolved without a warning when it has few edges per turn.
    const bool unresolved = p.outcome == "works" && p.turns > 2.0 && p.per_turn < kFewPerTurn;
    ++scenes;
    works += p.outcome == "works";
    warned += p.outcome == "warned";
    refused += p.outcome == "refused";
    stopped += p.outcome == "stopped";
    stopped_silently += p.outcome == "stopped" && p.says.find("use ") == std::string::npos &&
                        p.says.find("raise ") == std::string::npos;
    absurd += !p.absurd.empty();
    unwarned += unresolved;
    not_reached += !p.reached;
    lost = std::max(lost, p.lost);
    double& largest = p.outcome == "works" ? growth : puddle_growth;
    largest = std::max(largest, p.growth);
    Row& row = context.row();
    row.set("fluid", fluid.name)
        .set("viscosity", fluid.viscosity)
        .set("nozzle_mm", 1e3 * outlet.diameter)
        .set("height_m", outlet.height);
    row.set("speed_m_s", outlet.speed).set("outcome", p.absurd.empty() ? p.outcome : "ABSURD: " + p.absurd);
    row.set("turns", p.turns).set("edges_per_turn", p.per_turn).set("simulated_s", p.simulated).set("of_s", p.duration);
    row.set("energy_growth", p.growth).set("seconds", p.seconds).set("lost", p.lost).set("says", p.says.substr(0, 200));
  }
};

/// States that are wrong on purpose. Returns how many of them PourPhysics finds, of `count`.
int foundControls(int& count)
{
  const Fluid& honey = kFluids[11];
  const Outlet& outlet = kOutlets[3];
  Simulation simulation(parseScene(pouredScene(honey, outlet, 0.002), "control"));
  while (simulation.state().time < 0.3)
    if (!simulation.step(simulation.defaultInputs()).ok)
      return 0;
  const ThreadGroupState& good = simulation.state().threads[0];
  std::vector<ThreadGroupState> wrong(5, good);
  for (ThreadState& t : wrong[0].threads)   // everything falls three times as fast
    for (Eigen::Vector3d& v : t.v)
      v *= 3.0;
  ThreadState& lifted = wrong[1].threads[0];   // the lowest part is lifted by a third of the fall
  for (int i = 0; i < lifted.nodes() / 2; ++i)
    lifted.x[i].z() += outlet.height / 3;
  wrong[2].threads[0].x[0].x() += 2.0 * outlet.height;   // a node is far aside
  ThreadState& wide = wrong[3].threads[0];               // an edge is a disc
  wide.x[1] = wide.x[0] + 1e-6 * (wide.x[1] - wide.x[0]);
  wrong[4].threads[0].v[1].x() = std::nan("");
  count = static_cast<int>(wrong.size());
  int found = 0;
  for (const ThreadGroupState& state : wrong)
  {
    PourPhysics physics(honey, outlet, good);
    found += !physics.look(state, Eigen::Vector3d::Zero(), 0.002).empty();
  }
  return found;
}

}   // namespace

void pourAll(StudyContext& context)
{
  Tally tally;
  int done = 0, controls = 5;
  const int found = foundControls(controls);
  // The second budget is that of about ten seconds on one core.
  const Budget budget = context.quick() ? Budget{600, 1e6} : Budget{60000, 4e7};
  for (std::size_t f = 0; f < kFluids.size(); ++f)
    for (std::size_t o = 0; o < kOutlets.size(); ++o)
    {
      ++done;
      if (context.quick() && (f % 4 != 0 || o == 2))
        continue;
      context.progress(done, static_cast<int>(kFluids.size() * kOutlets.size()), kFluids[f].name);
      tally.add(context, kFluids[f], kOutlets[o], pour(kFluids[f], kOutlets[o], context.quick() ? 2 : 6, budget));
    }
  context.metric("scenes", tally.scenes);
  context.metric("works", tally.works);
  context.metric("warned", tally.warned);
  context.metric("refused", tally.refused);
  context.metric("stopped", tally.stopped);
  context.metric("stopped_without_advice", tally.stopped_silently);
  context.metric("budget_spent", tally.not_reached);
  context.metric("lost_volume", tally.lost);
  context.metric("unresolved_unwarned", tally.unwarned);
  context.metric("absurd_states", tally.absurd);
  context.metric("worst_energy_growth", tally.growth);
  context.metric("worst_energy_growth_where_warned", tally.puddle_growth);
  context.metric("wrong_states_overlooked", controls - found);
  context.note(
      "works: without a warning. refused: when the scene was read. stopped: in a step, whose message says why.");
  context.note(
      "worst_energy_growth: in a step, over the energy in the air; of pours without a warning, and of those with one.");
  context.note(
      "budget_spent: pours that end before their duration, because so much may be computed for one. Until then they "
      "are judged.");
}

}   // namespace slender::study
