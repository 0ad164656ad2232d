// Published cases of other codes.
#include <cmath>
#include <string>

#include "study/framework/shape_cases.h"
#include "slender_sim/geometry/curves.h"
#include "slender_sim/study/study.h"

namespace slender::study {
namespace {

RodSetup settled(RodSetup rod, const std::string& what)
{
  RodStepper stepper(rod.model, timeConfig(Integrator::implicit_euler, 1.0, 1e-9));
  require(stepper.solveEquilibrium(rod.state, rod.inputs), what);
  return rod;
}

/// Arc of 45 degrees, R = 1 m, 1 cm square section, E = 1e9 Pa, nu = 0, 6 N out of its plane at the tip [Bathe &
/// Bolourchi 1979 in other units; Simo & Vu-Quoc 1986].
Eigen::Vector3d bentCantilever(int edges)
{
  const double youngs = 1e9, side = 0.01, bend = youngs * std::pow(side, 4) / 12,
               twist = 0.5 * youngs * 0.140577 * std::pow(side, 4);
  RodSection section = sectionOf(youngs * side * side, bend, bend, twist);
  // from the origin along y, towards +x
  const Eigen::Matrix3Xd arc = arcCurve({1, 0, 0}, {0, 0, 0}, {0, 0, -1}, 0.25 * M_PI, edges);
  RodSetup rod = naturalRod(section, arc, Eigen::Vector3d::UnitZ());
  rod.hold(0, 0, true);
  rod.inputs.gravity.setZero();
  rod.inputs.forces.setZero(3, edges + 1);
  rod.inputs.forces(2, edges) = 6.0;
  return settled(rod, "45-degree cantilever").tip();
}

}   // namespace

void runPeerCases(StudyContext& context)
{
  const std::vector<int> meshes = context.quick() ? std::vector<int>{50} : std::vector<int>{25, 50, 100, 200};
  Plot& plot = context.plot("peer_cases", "Published cases: error against resolution", "edges", "tip error / length");
  int done = 0;
  for (const int edges : meshes)
  {
    context.progress(done++, static_cast<int>(meshes.size()), std::to_string(edges) + " edges");
    const bool checked = edges >= 50;
    const Eigen::Vector3d tip = bentCantilever(edges), published(0.1579, 0.4723, 0.5337);
    const char* names[] = {"x", "y", "z"};
    for (int c = 0; c < 3; ++c)
    {
      Row& row = context.row();
      row.set("case", "45-degree arc, 6 N").set("n", edges).set("component", names[c]);
      if (checked)
        row.check(tip[c], published[c], 0.005 * published.norm(), "Simo & Vu-Quoc 1986 (four digits)");
      else
        row.set("tip_m", tip[c]);
    }
    plot.at("45-degree arc").x.push_back(edges);
    plot.at("45-degree arc").y.push_back((tip - published).norm());
    struct Load
    {
      double w, x, y;
    };
    for (const Load& load : {Load{1, 0.99125, -0.12347}, Load{9, 0.68897, -0.67308}, Load{25, 0.38616, -0.85590}})
    {
      RodCase rod_case;
      rod_case.edges = edges;
      RodSetup rod = straightRod(rod_case);
      rod.hold(0, 0, true);
      rod.inputs.gravity = {0, -load.w, 0};
      const Eigen::Vector3d end = settled(rod, "cantilever").tip();
      for (int c = 0; c < 2; ++c)
      {
        Row& row = context.row();
        row.set("case", "cantilever, w L^3/EI = " + std::to_string(static_cast<int>(load.w)))
            .set("n", edges)
            .set("component", names[c]);
        const double exact = c ? load.y : load.x;
        if (checked)
          row.check(end[c], exact, 0.005 * std::abs(exact), "exact elastica under its distributed load");
        else
          row.set("tip_m", end[c]);
      }
      Series& series = plot.at("distributed load " + std::to_string(static_cast<int>(load.w)));
      series.x.push_back(edges);
      series.y.push_back(std::hypot(end.x() - load.x, end.y() - load.y));
    }
  }
}

const StudyRegistration kPeerCasesRegistration{
    "peer_cases", "published cases of other codes: a bent cantilever in space, cantilevers under distributed load",
    runPeerCases};

}   // namespace slender::study
