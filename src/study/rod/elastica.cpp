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

struct Bound
{
  double load, deflection;   ///< relative
};

/// The issue gives 40 and 80 edges for the load and 40 for the deflection; the rest follows second order.
Bound bucklingBound(int edges)
{
  const double finer = 40.0 / edges;
  return {edges == 80 ? 0.004 : 0.015 * finer * finer, 0.003 * finer * finer};
}

void buckle(StudyContext& context, bool clamped, int edges, const std::vector<double>& compressions, Plot& plot)
{
  RodCase c;   // EI = L = 1; the largest load strains it by 5e-6
  c.edges = edges;
  c.stretch = 1e7;
  RodSetup rod = straightRod(c);
  rod.hold(0, 0, clamped);
  const int far = rod.hold(edges, edges, clamped);

  // Start buckled, with the first mode's angles (amplitude 0.2 rad: 1 % shorter) and edges of rest length.
  const double h = 1.0 / edges;
  Eigen::Matrix3Xd nodes = rod.state.x;
  for (int i = 0; i < edges; ++i)
  {
    const double s = (i + 0.5) * h, angle = 0.2 * (clamped ? std::sin(2 * M_PI * s) : std::cos(M_PI * s));
    nodes.col(i + 1) = nodes.col(i) + h * Eigen::Vector3d(std::cos(angle), 0, std::sin(angle));
  }
  const RodState bent = makeRodState(*rod.model, nodes, Eigen::Vector3d::UnitY());
  rod.state.x = bent.x;
  rod.state.d1 = bent.d1;
  rod.state.twist = bent.twist;
  rod.state.grasps[far].X_WG.position = rod.inputs.grasps[far].X_WG.position = nodes.col(edges);
  RodStepper stepper(rod.model, timeConfig(Integrator::implicit_euler, 1.0, 1e-9));
  std::string refused;

  const std::string ends = clamped ? "clamped" : "pinned";
  double from = 1 - nodes(0, edges);
  for (const double compression : compressions)
  {
    const double begin = threadSeconds();
    const int steps = std::max(1, static_cast<int>(std::ceil((compression - from) / (0.5 * h))));
    for (int k = 1; k <= steps && refused.empty(); ++k)
    {
      const double at = from + (compression - from) * k / steps;
      rod.inputs.grasps[far].X_WG.position = {1 - at, 0, 0};
      refused = stepper.solveEquilibrium(rod.state, rod.inputs).message;
    }
    from = compression;
    const double seconds = threadSeconds() - begin;
    const ElasticaShape exact = bucklingElastica(compression, clamped);
    const Bound bound = bucklingBound(edges);
    const double nan = std::numeric_limits<double>::quiet_NaN();
    const double load = refused.empty() ? stepper.wrenches()[far].force.x() : nan;
    const double deflection = !refused.empty() ? nan : rod.state.x.bottomRows(2).colwise().norm().maxCoeff();
    const auto add = [&](const char* quantity, double measured, double expected, double relative) {
      Row& row = context.row();
      row.set("case", ends + " " + quantity).set("edges", edges).set("parameter", compression);
      row.check(measured, expected, relative * expected, "elliptic integrals");
      row.set("relative_error", measured / expected - 1).set("cpu_seconds", seconds);
      if (!refused.empty())
        row.set("refused", refused);
    };
    add("load", load, exact.load, bound.load);
    add("deflection", deflection, exact.deflection, bound.deflection);
    Series& s = plot.at(ends + " load at " + std::to_string(compression).substr(0, 4));
    s.x.push_back(edges);
    s.y.push_back(std::abs(load / exact.load - 1));
  }
}

void loadTheEnd(StudyContext& context, int edges, const std::vector<double>& loads, Plot& plot)
{
  for (const double load : loads)
  {
    RodCase c;
    c.edges = edges;
    RodSetup rod = straightRod(c);
    rod.hold(0, 0, true);
    rod.inputs.forces = Eigen::Matrix3Xd::Zero(3, edges + 1);
    rod.inputs.forces(2, edges) = -load;
    RodStepper stepper(rod.model, timeConfig(Integrator::implicit_euler, 1.0, 1e-9));
    const double begin = threadSeconds();
    const std::string refused = stepper.solveEquilibrium(rod.state, rod.inputs).message;
    const double seconds = threadSeconds() - begin;
    const CantileverTip exact = endLoadedCantilever(load);
    const double finer = 40.0 / edges;
    const auto add = [&](const char* quantity, double measured, double expected, double scale) {
      Row& row = context.row();
      row.set("case", std::string("end load, ") + quantity).set("edges", edges).set("parameter", load);
      row.check(measured, expected, 0.005 * finer * finer * scale, "Bisshopp and Drucker 1945");
      row.set("relative_error", measured / expected - 1).set("cpu_seconds", seconds);
      if (!refused.empty())
        row.set("refused", refused);
    };
    const double nan = std::numeric_limits<double>::quiet_NaN();
    add("tip deflection", refused.empty() ? -rod.tip().z() : nan, exact.drop, exact.drop);
    add("tip x", refused.empty() ? rod.tip().x() : nan, exact.extent, 1.0);   // a position: in parts of the length
    Series& s = plot.at("end load " + std::to_string(load).substr(0, 4));
    s.x.push_back(edges);
    s.y.push_back(std::abs(-rod.tip().z() / exact.drop - 1));
  }
}

}   // namespace

void runElastica(StudyContext& context)
{
  const std::vector<int> meshes = context.quick() ? std::vector<int>{40} : std::vector<int>{40, 80, 160};
  const std::vector<double> compressions =
      context.quick() ? std::vector<double>{0.05, 0.3, 0.5} : std::vector<double>{0.02, 0.05, 0.1, 0.2, 0.3, 0.4, 0.5};
  const std::vector<double> loads =
      context.quick() ? std::vector<double>{1, 10} : std::vector<double>{0.1, 0.25, 0.5, 1, 2, 5, 10, 20, 50, 100};
  Plot& plot = context.plot("elastica_error", "Elastica: error against resolution", "edges", "relative error");
  int done = 0;
  const int total = 3 * static_cast<int>(meshes.size());
  for (const int edges : meshes)
  {
    for (const bool clamped : {false, true})
    {
      context.progress(done++, total, clamped ? "clamped ends" : "pinned ends");
      buckle(context, clamped, edges, compressions, plot);
    }
    context.progress(done++, total, "end load");
    loadTheEnd(context, edges, loads, plot);
  }
  context.note("end load: the deflection within 0.5 % of itself, the tip's x within 0.5 % of the length.");
  context.note(
      "parameter: end shortening over length, or end load P L^2/(E I). Bounds between the issue's follow second "
      "order.");
}

const StudyRegistration kElasticaRegistration{
    "elastica", "buckled and end-loaded planar rods against elliptic integrals", runElastica};

}   // namespace slender::study
