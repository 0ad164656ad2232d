// Open overhand knots: end force against the size of the loop (Audoly, Clauvelin & Neukirch 2007; thesis 4.7.1,
// Fig. 4.1).
#include <algorithm>
#include <cmath>
#include <string>

#include "contact_cases.h"
#include "knot_twist.h"
#include "slender_sim/geometry/curves.h"
#include "slender_sim/study/study.h"

namespace slender::study {
namespace {

struct Loop
{
  double epsilon = 0, force = 0;
};   ///< sqrt(h / R), F h^2 / B

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

/// Knots of a wire of B = 1 with its ends held farther and farther apart, each in equilibrium.
std::vector<Loop> pullKnot(StudyContext& context, double radius, const std::vector<double>& pulls)
{
  const double length = 1.2;
  const int edges = context.quick() ? 300 : 500;
  const double edge = length / edges;
  // naturally straight, tied loosely
  RodSetup rod = rodThrough(trefoilCurve({0, 0, 0}, {1, 0, 0}, {0, 0, 1}, 0.11, 4 * radius, length, false, edges),
                            false, radius, 1.0, 1.0, edges);
  auto model = std::make_shared<RodModel>(*rod.model);
  model->bend_modulus.colwise() = Eigen::Vector3d(1, 0, 1);
  model->twist_modulus.setConstant(1 / 1.3);
  model->stretch_modulus.setConstant(1e6);
  model->mass.setConstant(1.0 * edge);   // heavy enough that short steps help
  rod.model = model;
  rod.hold(0, 0, true);
  rod.hold(edges, edges, true);
  GroupSetup g;
  addTouching(g, rod, 0.0);
  g.setGravity(Eigen::Vector3d::Zero());
  g.model.contact.gap = 0.05 * radius;
  TimeConfig time = timeConfig(Integrator::implicit_euler, 0.05, 1e-7);
  World world = g.world(time);
  const Pose start = rod.inputs.grasps[1].X_WG;
  std::vector<Loop> sums(pulls.size());
  double at = 0.0;
  int done = 0;
  const auto visit = [&](std::size_t k) {
    context.progress(done++, 2 * static_cast<int>(pulls.size()),
                     "h = " + std::to_string(radius) + ", pulled by " + std::to_string(pulls[k]));
    // no more than an edge or two at a time
    const int steps = std::max(20, static_cast<int>(400 * std::abs(pulls[k] - at)));
    for (int i = 1; i <= steps; ++i)
    {
      g.inputs.rods[0].grasps[1].X_WG = start;
      g.inputs.rods[0].grasps[1].X_WG.position.x() += at + (pulls[k] - at) * i / steps;
      require(world.step(g.state, g.inputs), "knot");
    }
    at = pulls[k];
    require(world.solveEquilibrium(g.state, g.inputs), "knot at rest");
    const double force = -world.rodWrenches(0)[1].force.x(), size = loopRadius(g.state.rods[0], edge);
    context.row().set("n", edges).set("h", radius).set("pulled", at).set("R", size).set("F", force);
    sums[k].epsilon += std::sqrt(radius / size);
    sums[k].force += force * radius * radius;
  };
  // Nodes make contact a little bumpy: slopes of 0.08 gap over half an edge, 0.002, are as much friction. The mean of
  // both ways is without it.
  for (std::size_t k = 0; k < pulls.size(); ++k)
    visit(k);
  if (context.quick())
    return sums;
  for (std::size_t k = pulls.size(); k-- > 0;)
    visit(k);
  for (Loop& loop : sums)
    loop = {0.5 * loop.epsilon, 0.5 * loop.force};
  return sums;
}

void forceLaw(StudyContext& context)
{
  Plot& plot = context.plot("knot", "Overhand knot without friction: end force against loop size", "eps = sqrt(h / R)",
                            "F h^2 / B");
  std::vector<double> xs, ys;
  // loops so small that the clamps are several times sqrt(B / F) away
  const std::vector<double> pulls = context.quick() ? std::vector<double>{0.25} : std::vector<double>{0.25, 0.3, 0.35};
  for (const double radius : context.quick() ? std::vector<double>{6e-4} : std::vector<double>{6e-4, 4e-4, 2.5e-4})
    for (const Loop& loop : pullKnot(context, radius, pulls))
    {
      const double law = 0.5 * std::pow(loop.epsilon, 4);
      context.row()
          .set("h", radius)
          .set("eps", loop.epsilon)
          .set("F_h2_over_B", loop.force)
          .set("ratio", loop.force / law);
      plot.at("measured").points = true;
      plot.at("measured").x.push_back(loop.epsilon);
      plot.at("measured").y.push_back(loop.force);
      plot.at("eps^4 / 2").x.push_back(loop.epsilon);
      plot.at("eps^4 / 2").y.push_back(law);
      if (loop.epsilon <= 0.1)
      {
        xs.push_back(loop.epsilon);
        ys.push_back(loop.force);
      }
    }
  if (context.quick())
    return;
  const double exponent = logSlope(xs, ys);
  context.metric("exponent", exponent);
  context.row()
      .set("quantity", "slope of log F over log eps, eps <= 0.1")
      .check(exponent, 4.0, 0.6, "F h^2/B = eps^4/2 (knot.csv, no friction), 15 %");
  // the law is the leading order: the coefficient is that which the ratio tends to
  double n = 0, x = 0, y = 0, xx = 0, xy = 0;
  for (std::size_t k = 0; k < xs.size(); ++k)
  {
    const double ratio = ys[k] / (0.5 * std::pow(xs[k], 4));
    n += 1;
    x += xs[k];
    y += ratio;
    xx += xs[k] * xs[k];
    xy += xs[k] * ratio;
  }
  const double limit = (y * xx - x * xy) / (n * xx - x * x);
  context.row().set("quantity", "F h^2/B over eps^4/2 for eps to 0").check(limit, 1.0, 0.15, "the same");
}

}   // namespace

void runKnot(StudyContext& context)
{
  forceLaw(context);
  twistKnot(context);
}

const StudyRegistration kKnotRegistration{"knot", "open overhand knots: end force against the size of the loop",
                                          runKnot};

}   // namespace slender::study
