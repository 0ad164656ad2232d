#include <algorithm>
#include <cmath>
#include <limits>
#include <string>

#include "rod_cases.h"
#include "slender_sim/study/cpu_clock.h"
#include "slender_sim/study/reference.h"
#include "slender_sim/study/study.h"

namespace slender::study {
namespace {

/// EI = L = rho A = 1, so g = Gamma. The reference is inextensible: EA is so large that the rod's own weight strains it by no
/// more than 1e-5.
double stretchModulus(double gamma) { return std::max(1e7, 1e5 * gamma); }

RodSetup heavyRod(double gamma, int edges, double mass_damping)
{
  RodCase c;
  c.edges = edges;
  c.stretch = stretchModulus(gamma);
  c.mass_damping = mass_damping;
  RodSetup rod = straightRod(c);
  rod.inputs.gravity = {0, 0, -gamma};
  rod.hold(0, 0, true);
  return rod;
}

double aspectRatio(const RodSetup& rod) { return -rod.tip().z() / rod.tip().x(); }

/// Lowest frequency, roughly: a beam for small loads, a heavy chain for large ones.
double slowestRate(double gamma) { return std::sqrt(3.5 * 3.5 + 1.45 * gamma); }

struct Outcome
{
  double ratio, seconds;   ///< ratio: NaN when refused
  std::string refused;
};

Outcome runStatic(double gamma, int edges)
{
  RodSetup rod = heavyRod(gamma, edges, 0.0);
  RodStepper stepper(rod.model, timeConfig(Integrator::implicit_euler, 1.0, 1e-9));
  const double start = threadSeconds();
  const StepReport report = stepper.solveEquilibrium(rod.state, rod.inputs);
  return {report.ok ? aspectRatio(rod) : std::numeric_limits<double>::quiet_NaN(), threadSeconds() - start, report.message};
}

/// Released horizontally and damped (critically in its slowest mode) until it stands still.
Outcome runSettled(double gamma, int edges)
{
  const double rate = slowestRate(gamma);
  RodSetup rod = heavyRod(gamma, edges, 2 * rate);
  RodStepper stepper(rod.model, timeConfig(Integrator::implicit_euler, 0.2 / rate, 1e-9));
  const double start = threadSeconds();
  const std::string problem = settle(stepper, rod, 0.2 / rate, 1e-9 * rate, 2000);
  return {problem.empty() ? aspectRatio(rod) : std::numeric_limits<double>::quiet_NaN(), threadSeconds() - start, problem};
}

}  // namespace

void runCantilever(StudyContext& context)
{
  const std::vector<int> edges = context.quick() ? std::vector<int>{20, 40, 80} : std::vector<int>{20, 40, 80, 160, 320};
  std::vector<double> gammas;
  for (int k = 0; k <= 7 * (context.quick() ? 1 : 4); ++k)
    gammas.push_back(std::pow(10.0, -2 + (context.quick() ? 1.0 : 0.25) * k));
  const int total = static_cast<int>(gammas.size() * edges.size());

  Plot& errors = context.plot("cantilever_error", "Heavy cantilever, static: error of H/W against resolution", "free edges n", "relative error of H/W");
  Plot& cost = context.plot("cantilever_cost", "Heavy cantilever, static: error against run time", "CPU time [s]", "relative error of H/W");
  double order = std::numeric_limits<double>::infinity();
  int done = 0;
  for (const double gamma : gammas)
  {
    const CantileverTip exact = heavyCantilever(gamma);
    const double expected = exact.drop / exact.extent;
    const double decade = std::log10(gamma);
    const bool whole_decade = std::abs(decade - std::round(decade)) < 1e-9;
    char label[32];
    std::snprintf(label, sizeof label, "Gamma = %g", gamma);
    for (const int n : edges)
    {
      context.progress(done++, total, label);
      for (const bool dynamic : {false, true})
      {
        if (dynamic && (n > 80 || !whole_decade))   // settling repeats the static result at more cost
          continue;
        const Outcome o = dynamic ? runSettled(gamma, n) : runStatic(gamma, n);
        Row& row = context.row();
        row.set("how", dynamic ? "settled" : "static").set("Gamma", gamma).set("edges", n);
        row.check(o.ratio, expected, expected * (0.003 + 0.25 * gamma / (n * n)), "inextensible elastica, bound 0.3 % + 0.25 Gamma/n^2");
        row.set("relative_error", o.ratio / expected - 1).set("cpu_seconds", o.seconds);
        if (!o.refused.empty())
          row.set("refused", o.refused);
        if (dynamic)
          continue;
        if (whole_decade)
        {
          errors.at(label).x.push_back(n);
          errors.at(label).y.push_back(std::abs(o.ratio / expected - 1));
          cost.at(label).x.push_back(o.seconds);
          cost.at(label).y.push_back(std::abs(o.ratio / expected - 1));
        }
      }
    }
    if (!whole_decade || gamma > (context.quick() ? 2 : 2000))
      continue;
    // The clamp's boundary layer is L/sqrt(Gamma) wide; at 30 edges in it the error follows its leading term. For small loads
    // that term is small and the error soon reaches the round-off of the iteration: the last pair above it counts.
    const CantileverTip stretched = heavyCantilever(gamma, gamma / stretchModulus(gamma));
    double coarse = 0, fine = 0;
    int used = 0;
    for (int n = 40; n <= 1280 || n < 60 * std::sqrt(gamma); n *= 2)
    {
      const double e = runStatic(gamma, n).ratio / (stretched.drop / stretched.extent) - 1;
      if (std::abs(e) < 1e-8)
        break;
      coarse = fine;
      fine = e;
      used = n;
    }
    const double seen = observedOrder(coarse, fine);
    context.row().set("how", "order").set("Gamma", gamma).set("edges", used).set("observed_order", seen).set("relative_error", fine);
    order = seen >= order ? order : seen;   // keeps NaN
  }
  context.metric("observed_order", order);
  context.note("EA is set so that the rod's weight strains it by at most 1e-5: the reference is inextensible.");
  context.note("observed_order: smallest over Gamma = 0.01 to 1000, from two meshes that put 30 and 60 edges or more into the boundary layer.");
}

}  // namespace slender::study
