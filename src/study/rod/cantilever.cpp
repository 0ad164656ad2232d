#include <algorithm>
#include <cmath>
#include <limits>
#include <string>

#include "rod_cases.h"
#include "study/framework/cpu_clock.h"
#include "slender_sim/study/reference.h"
#include "slender_sim/study/study.h"

namespace slender::study {
namespace {

/// EI = L = rho A = 1, so g = Gamma. The reference is inextensible: EA is so large that the rod's own weight strains it
/// by no more than 1e-5.
double stretchModulus(double gamma) { return std::max(1e7, 1e5 * gamma); }

/// The rod bends in a boundary layer at the clamp whose length is L / sqrt(Gamma). With fewer edges in it than this a
/// mesh does not show its shape: at a fifth of an edge H/W is off by 15 %, at a sixteenth by 230 %.
constexpr double kLayerEdges = 5;

double layerEdges(double gamma, int edges) { return edges / std::sqrt(std::max(gamma, 1.0)); }

/// Nodes along x in [0, 1] whose first edge is at most a fifth of the boundary layer; the others grow in a constant
/// ratio.
Eigen::Matrix3Xd gradedNodes(double gamma, int edges)
{
  const double first = 1 / (kLayerEdges * std::sqrt(std::max(gamma, 1.0)));
  double low = 1, high = 10;   // the ratio of successive edges
  for (int k = 0; k < 100; ++k)
  {
    const double ratio = 0.5 * (low + high);
    (first * (std::pow(ratio, edges) - 1) / (ratio - 1) < 1 ? low : high) = ratio;
  }
  Eigen::Matrix3Xd nodes = Eigen::Matrix3Xd::Zero(3, edges + 1);
  for (int i = 0; i <= edges; ++i)
    nodes(0, i) = (std::pow(low, i) - 1) / (std::pow(low, edges) - 1);
  return nodes;
}

Eigen::Matrix3Xd evenNodes(int edges)
{
  Eigen::Matrix3Xd nodes = Eigen::Matrix3Xd::Zero(3, edges + 1);
  nodes.row(0).setLinSpaced(edges + 1, 0.0, 1.0);
  return nodes;
}

RodSetup heavyRod(double gamma, const Eigen::Matrix3Xd& nodes, double mass_damping)
{
  RodCase c;
  c.edges = static_cast<int>(nodes.cols()) - 1;
  c.stretch = stretchModulus(gamma);
  c.mass_damping = mass_damping;
  RodSetup rod = shapedRod(c, nodes);
  rod.inputs.gravity = {0, 0, -gamma};
  rod.hold(0, 0, true);
  return rod;
}

double aspectRatio(const RodSetup& rod) { return -rod.tip().z() / rod.tip().x(); }

/// Lowest frequency, roughly: a beam for small loads, a heavy chain for large ones.
double slowestRate(double gamma) { return std::sqrt(3.5 * 3.5 + 1.45 * gamma); }

struct CantileverShape
{
  double ratio, seconds;   ///< ratio: NaN when refused
  std::string refused;
};

CantileverShape runStatic(double gamma, const Eigen::Matrix3Xd& nodes)
{
  RodSetup rod = heavyRod(gamma, nodes, 0.0);
  RodStepper stepper(rod.model, timeConfig(Integrator::implicit_euler, 1.0, 1e-9));
  const double start = threadSeconds();
  const StepReport report = stepper.solveEquilibrium(rod.state, rod.inputs);
  return {report.ok ? aspectRatio(rod) : std::numeric_limits<double>::quiet_NaN(), threadSeconds() - start,
          report.message};
}

/// Released horizontally and damped (critically in its slowest mode) until it stands still.
CantileverShape runSettled(double gamma, int edges)
{
  const double rate = slowestRate(gamma);
  RodSetup rod = heavyRod(gamma, evenNodes(edges), 2 * rate);
  RodStepper stepper(rod.model, timeConfig(Integrator::implicit_euler, 0.2 / rate, 1e-9));
  const double start = threadSeconds();
  const std::string problem = settle(stepper, rod, 0.2 / rate, 1e-9 * rate, 2000);
  return {problem.empty() ? aspectRatio(rod) : std::numeric_limits<double>::quiet_NaN(), threadSeconds() - start,
          problem};
}

enum class How
{
  uniform,
  graded,
  settled
};

/// Relative. Five edges in the boundary layer or more make the second term at most 1 %.
double boundOf(double gamma, int edges, bool graded)
{
  return graded ? 0.01 : 0.003 + 0.25 * std::pow(1 / layerEdges(gamma, edges), 2);
}

}   // namespace

void runCantilever(StudyContext& context)
{
  const std::vector<int> edges =
      context.quick() ? std::vector<int>{20, 40, 80} : std::vector<int>{20, 40, 80, 160, 320};
  std::vector<double> gammas;
  for (int k = 0; k <= 7 * (context.quick() ? 1 : 4); ++k)
    gammas.push_back(std::pow(10.0, -2 + (context.quick() ? 1.0 : 0.25) * k));
  const int total = static_cast<int>(gammas.size() * edges.size());

  Plot& errors = context.plot("cantilever_error", "Heavy cantilever, static: error of H/W against resolution",
                              "free edges n", "relative error of H/W");
  Plot& cost = context.plot("cantilever_cost", "Heavy cantilever, static: error against run time", "CPU time [s]",
                            "relative error of H/W");
  double order = std::numeric_limits<double>::infinity(), worst = 0;
  int done = 0, unresolved = 0, refused = 0;
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
      for (const How how : {How::uniform, How::graded, How::settled})
      {
        // settling repeats the static result at more cost
        if (how != How::uniform && (!whole_decade || (how == How::settled && n > 80)))
          continue;
        if (how == How::graded && layerEdges(gamma, n) >= kLayerEdges)
          continue;   // equal edges are as short
        const CantileverShape o = how == How::settled
                                      ? runSettled(gamma, n)
                                      : runStatic(gamma, how == How::graded ? gradedNodes(gamma, n) : evenNodes(n));
        const double relative = o.ratio / expected - 1;
        const bool resolved = how == How::graded || layerEdges(gamma, n) >= kLayerEdges;
        Row& row = context.row();
        row.set("how", how == How::settled  ? "settled"
                       : how == How::graded ? "static, graded"
                                            : "static")
            .set("Gamma", gamma)
            .set("edges", n);
        if (resolved)
          row.check(o.ratio, expected, expected * boundOf(gamma, n, how == How::graded), "inextensible elastica");
        else
        {
          // such a mesh is not passed, but it must still give an answer
          row.set("resolved", "no: fewer than 5 edges in the boundary layer").set("measured", o.ratio);
          ++unresolved;
          refused += std::isnan(o.ratio);
        }
        row.set("relative_error", relative).set("cpu_seconds", o.seconds);
        if (!o.refused.empty())
          row.set("refused", o.refused);
        if (resolved)
          worst = std::max(worst, std::abs(relative));
        if (how == How::settled || !whole_decade)
          continue;
        const std::string series = how == How::graded ? label + std::string(", graded") : label;
        errors.at(series).x.push_back(n);
        errors.at(series).y.push_back(std::abs(relative));
        cost.at(series).x.push_back(o.seconds);
        cost.at(series).y.push_back(std::abs(relative));
      }
    }
    if (!whole_decade || gamma > (context.quick() ? 2 : 2000))
      continue;
    // The clamp's boundary layer is L/sqrt(Gamma) wide; at 30 edges in it the error follows its leading term. For small
    // loads that term is small and the error soon reaches the round-off of the iteration: the last pair above it
    // counts.
    const CantileverTip stretched = heavyCantilever(gamma, gamma / stretchModulus(gamma));
    double coarse = 0, fine = 0;
    int used = 0;
    for (int n = 40; n <= 1280 || n < 60 * std::sqrt(gamma); n *= 2)
    {
      const double e = runStatic(gamma, evenNodes(n)).ratio / (stretched.drop / stretched.extent) - 1;
      if (std::abs(e) < 1e-8)
        break;
      coarse = fine;
      fine = e;
      used = n;
    }
    const double seen = observedOrder(coarse, fine);
    context.row()
        .set("how", "order")
        .set("Gamma", gamma)
        .set("edges", used)
        .set("observed_order", seen)
        .set("relative_error", fine);
    order = seen >= order ? order : seen;   // keeps NaN
  }
  context.metric("observed_order", order);
  context.metric("worst_resolved_error", worst);
  context.metric("unresolved", unresolved);
  context.row().set("how", "unresolved meshes").check(refused, 0, 0.5, "each gives an answer, though no accurate one");
  context.note(
      "Rows that are not resolved have fewer than five edges in the boundary layer at the clamp, L / sqrt(Gamma) long. "
      "They are named and not passed.");
  context.note("graded: the first edge is a fifth of the boundary layer and the others grow in a constant ratio.");
  context.note("EA is set so that the rod's weight strains it by at most 1e-5: the reference is inextensible.");
  context.note(
      "observed_order: smallest over Gamma = 0.01 to 1000, from two meshes that put 30 and 60 edges or more into the "
      "boundary layer.");
}

const StudyRegistration kCantileverRegistration{
    "cantilever", "heavy rod clamped horizontally: aspect ratio H/W against Gamma, static and settled", runCantilever};

}   // namespace slender::study
