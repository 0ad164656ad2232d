// A rope is drawn over a fixed drum. The study compares the ratio of the tensions on both sides with e^(mu angle), the
// formula of Euler and Eytelwein.
#include <cmath>
#include <stdexcept>
#include <string>
#include <vector>

#include "contact_cases.h"
#include "study/framework/shape_cases.h"
#include "slender_sim/study/study.h"

namespace slender::study {
namespace {

constexpr double kDrumRadius = 0.1, kRopeRadius = 0.002, kRopeGap = 0.0002, kTension = 1.0;   // [m], [N]

/// A rope wound by `angle` around a drum about z, with straight ends.
struct WoundRope
{
  /// The nodes lie at `radius` [m] from the axis, and rise by `climb` [m/rad] while they go around by `angle` [rad].
  double angle, radius, climb;
  double lead = 0.03;   ///< of each end [m]

  double perAngle() const { return std::hypot(radius, climb); }
  double length() const { return angle * perAngle() + 2 * lead; }
  Eigen::Vector3d tangent(double at) const
  {
    return Eigen::Vector3d(-radius * std::sin(at), radius * std::cos(at), climb) / perAngle();
  }
  Eigen::Vector3d place(double at) const
  {
    return {radius * std::cos(at), radius * std::sin(at), climb * (at - 0.5 * angle)};
  }
  Eigen::Vector3d point(double s) const
  {
    const double at = (s - lead) / perAngle();
    if (at < 0)
      return place(0) + (s - lead) * tangent(0);
    if (at > angle)
      return place(angle) + (at - angle) * perAngle() * tangent(angle);
    return place(at);
  }
};

/// The middles of edges lie within the gap of the drum.
WoundRope woundRope(double angle, int edges)
{
  const double line = kDrumRadius + kRopeRadius + 0.5 * kRopeGap;
  WoundRope rope{angle, line, 2.5 * kRopeRadius / M_PI};   // turns do not touch each other
  const double edge = rope.length() / edges;
  rope.radius += edge * edge / (8 * line);
  return rope;
}

/// Tension at the end that is drawn, over that at the end with a constant force; mean over a second of steady slip.
double tensionRatio(double friction, double angle, int edges)
{
  const WoundRope shape = woundRope(angle, edges);
  Eigen::Matrix3Xd nodes(3, edges + 1);
  for (int i = 0; i <= edges; ++i)
    nodes.col(i) = shape.point(shape.length() * i / edges);
  RodSection section = sectionOf(1e6, 1e-7, 1e-7, 1e-7);
  section.a = section.b = kRopeRadius;
  section.linear_density = 1e-2;
  RodSetup rod = naturalRod(section, nodes, Eigen::Vector3d::UnitZ());
  auto model = std::make_shared<RodModel>(*rod.model);
  model->mass_damping = 10.0;
  rod.model = model;
  const int end = rod.hold(edges, edges, false);
  rod.inputs.gravity.setZero();
  rod.inputs.forces.setZero(3, edges + 1);
  rod.inputs.forces.col(0) = -kTension * shape.tangent(0);
  GroupSetup g;
  g.add(rod);
  g.setGravity(Eigen::Vector3d::Zero());
  g.model.rods[0].contact = ContactProperties{false, false, true, friction};
  addObstacle(g, Cylinder{kDrumRadius, 1.0}, {}, friction);
  g.model.contact.gap = kRopeGap;
  constexpr double kStep = 0.01, kSpeed = 2e-3;   // [s], [m/s]
  World world = g.world(timeConfig(Integrator::implicit_euler, kStep, 1e-8));
  // A barrier that was chosen presses the rope from the start. Without it the rope would settle on the drum first, and
  // slip a little across the drum for as long as it slides by R / mu.
  g.state.contact.rods.resize(1);
  g.state.contact.rods[0].barrier.layers[0].stiffness = 1e-6;   // [N]; the least one is larger
  const Eigen::Vector3d way = shape.tangent(angle);
  double sum = 0.0;
  constexpr int kSteps = 300, kMean = 100;
  for (int k = 0; k < kSteps; ++k)
  {
    g.inputs.rods[0].grasps[end].X_WG.position += kStep * kSpeed * way;
    if (const StepReport report = world.step(g.state, g.inputs); !report.ok)
      throw std::runtime_error("capstan: " + report.message);
    if (k >= kSteps - kMean)
      sum -= world.rodWrenches(0)[end].force.dot(way) / kMean;
  }
  return sum / kTension;
}

/// The normal force per length is the tension times the curvature, and slip goes along the rope.
double exactRatio(double friction, const WoundRope& rope)
{
  return std::exp(friction * rope.angle * rope.radius / rope.perAngle());
}

}   // namespace

void runCapstan(StudyContext& context)
{
  const std::vector<double> frictions = context.quick() ? std::vector<double>{0.3} : std::vector<double>{0.1, 0.3, 0.5},
                            angles = context.quick() ? std::vector<double>{M_PI / 2, 2 * M_PI}
                                                     : std::vector<double>{M_PI / 2, M_PI, 2 * M_PI, 4 * M_PI};
  constexpr int kEdges = 200;
  const int total = static_cast<int>(frictions.size() * angles.size()) + 3;
  int done = 0;
  for (const double friction : frictions)
    for (const double angle : angles)
    {
      context.progress(done++, total, "mu = " + std::to_string(friction));
      const double expected = exactRatio(friction, woundRope(angle, kEdges));
      context.row()
          .set("friction", friction)
          .set("angle_over_pi", angle / M_PI)
          .set("n", kEdges)
          .check(tensionRatio(friction, angle, kEdges), expected, 0.01 * expected, "e^(mu angle)");
    }
  Plot& plot =
      context.plot("capstan", "Rope over a drum, mu = 0.3, one turn: error of T2 / T1", "edges", "relative error");
  Series& series = plot.at("T2 / T1");
  for (const int edges : {25, 50, 100})
  {
    context.progress(done++, total, std::to_string(edges) + " edges");
    const double expected = exactRatio(0.3, woundRope(2 * M_PI, edges));
    series.x.push_back(edges);
    series.y.push_back(std::abs(tensionRatio(0.3, 2 * M_PI, edges) / expected - 1.0));
  }
  context.metric("order", -logSlope(series.x, series.y));
}

const StudyRegistration kCapstanRegistration{
    "capstan", "tensions of a rope that is drawn over a drum, against e^(mu angle)", runCapstan};

}   // namespace slender::study
