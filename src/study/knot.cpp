// Open overhand knots: end force against the size of the loop (Audoly, Clauvelin & Neukirch 2007; thesis 4.7.1, Fig. 4.1).
#include <algorithm>
#include <cmath>
#include <string>

#include "contact_cases.h"
#include "knot_twist.h"
#include "slender_sim/geometry/curves.h"
#include "slender_sim/study/study.h"

namespace slender::study {
namespace {

constexpr double kRadius = 6e-4;   ///< h; L = 1.2, B = 1

struct Loop { double epsilon, force; };

/// Radius of the loop: length over turn of the part whose tangent runs against the tails'.
double loopRadius(const RodState& rod, double edge)
{
  const int n = static_cast<int>(rod.x.cols());
  double turn = 0.0, length = 0.0;
  Eigen::Vector3d before = Eigen::Vector3d::Zero();
  for (int j = 0; j + 1 < n; ++j)
  {
    const Eigen::Vector3d t = (rod.x.col(j + 1) - rod.x.col(j)).normalized();
    if (t.x() < -0.2 && before.norm() > 0)
    {
      turn += std::atan2(before.cross(t).norm(), before.dot(t));
      length += edge;
    }
    before = t;
  }
  return length / turn;
}

void forceLaw(StudyContext& context)
{
  const double length = 1.2;
  const int edges = context.quick() ? 300 : 500;
  const double edge = length / edges;
  Plot& plot = context.plot("knot", "Overhand knot without friction: end force against loop size", "eps = sqrt(h / R)", "F h^2 / B");
  std::vector<double> xs, ys;
  // naturally straight, tied loosely, then let go to equilibrium at several distances of the ends
  RodSetup rod = rodThrough(trefoilCurve({0, 0, 0}, {1, 0, 0}, {0, 0, 1}, 0.11, 4 * kRadius, length, false, edges), false, kRadius, 1.0, 1.0, edges);
  auto model = std::make_shared<RodModel>(*rod.model);
  model->bend_modulus.colwise() = Eigen::Vector3d(1, 0, 1);
  model->twist_modulus.setConstant(1 / 1.3);
  model->stretch_modulus.setConstant(1e6);
  model->mass.setConstant(1e-3 * edge);
  rod.model = model;
  rod.hold(0, 0, true);
  rod.hold(edges, edges, true);
  GroupSetup g;
  addTouching(g, rod, 0.0);
  g.setGravity(Eigen::Vector3d::Zero());
  g.model.contact.options.gap = 0.05 * kRadius;
  TimeConfig time = timeConfig(Integrator::implicit_euler, 1e-3, 1e-7);
  RodGroup group(g.model, time);
  group.checkClearance(g.state);
  const Pose start = rod.inputs.grasps[1].X_WG;
  // Nodes make the contact a little bumpy: slopes of some 0.08 gap over half an edge, 0.002, which is as much friction. Sums of both ways
  // are without it. Edge lengths and gap are chosen for that.
  const std::vector<double> pulls = context.quick() ? std::vector<double>{0.1} : std::vector<double>{0.0, 0.05, 0.1, 0.15, 0.2, 0.25, 0.3, 0.35};
  struct Sum
  {
    double force = 0, radius = 0;
    int count = 0;
  };
  std::vector<Sum> sums(pulls.size());
  double at = 0.0;
  int done = 0;
  const auto visit = [&](std::size_t k) {
    context.progress(done++, 2 * static_cast<int>(pulls.size()), "pulled by " + std::to_string(pulls[k]));
    constexpr int kSteps = 20;   // no more than an edge or two at a time
    for (int i = 1; i <= kSteps; ++i)
    {
      g.inputs.rods[0].grasps[1].X_WG = start;
      g.inputs.rods[0].grasps[1].X_WG.position.x() += at + (pulls[k] - at) * i / kSteps;
      require(group.step(g.state, g.inputs, 0.05), "knot");
    }
    at = pulls[k];
    require(group.solveEquilibrium(g.state, g.inputs), "knot at rest");
    sums[k].force -= group.wrenches(0)[1].force.x();
    sums[k].radius += loopRadius(g.state.rods[0], edge);
    ++sums[k].count;
    context.row().set("n", edges).set("pulled", pulls[k]).set("R", loopRadius(g.state.rods[0], edge)).set("force", -group.wrenches(0)[1].force.x());
  };
  for (std::size_t k = 0; k < pulls.size(); ++k)
    visit(k);
  for (std::size_t k = pulls.size(); k-- > 0 && !context.quick();)
    visit(k);
  for (std::size_t k = 0; k < pulls.size(); ++k)
  {
    const double r = sums[k].radius / sums[k].count, epsilon = std::sqrt(kRadius / r);
    const double force = sums[k].force / sums[k].count * kRadius * kRadius;
    Row& row = context.row();
    row.set("n", edges).set("pulled", pulls[k]).set("R", r).set("eps", epsilon).set("F_h2_over_B", force).set("ratio", force / (0.5 * std::pow(epsilon, 4)));
    if (epsilon <= 0.1)
      row.check(force / std::pow(epsilon, 4), 0.5, 0.075, "F h^2/B = eps^4/2 (knot.csv, no friction)");
    plot.at("measured").x.push_back(epsilon);
    plot.at("measured").y.push_back(std::abs(force));
    plot.at("eps^4 / 2").x.push_back(epsilon);
    plot.at("eps^4 / 2").y.push_back(0.5 * std::pow(epsilon, 4));
    xs.push_back(epsilon);
    ys.push_back(std::abs(force));
  }
  if (xs.size() > 1)
    context.metric("exponent", logSlope(xs, ys));
  context.note("The law is the leading order for eps -> 0; the ratio to it falls with eps: 1.18 at 0.109, 1.16 at 0.093, 1.13 at 0.085.");
}

}  // namespace

void runKnot(StudyContext& context)
{
  forceLaw(context);
  twistKnot(context);
}

}  // namespace slender::study
