// Wilberforce's pendulum (thesis Fig. 4.9): a body on a helical spring trades its bobbing for turning, and back.
#include <algorithm>
#include <cmath>
#include <limits>
#include <string>
#include <vector>

#include "group_cases.h"
#include "oscillation.h"
#include "shape_cases.h"
#include "slender_sim/geometry/curves.h"
#include "slender_sim/geometry/rotation.h"
#include "slender_sim/study/cpu_clock.h"
#include "slender_sim/study/study.h"

namespace slender::study {
namespace {

/// Cases of wilberforce.csv: the wire is clamped above, the body welded to its lower end with its centre of mass on the helix's axis
/// at the height of that end; its moments, all equal, bring bobbing and turning into resonance.
struct Spring
{
  const char* name;
  int turns;
  double radius, pitch, wire_radius, youngs_modulus, poissons_ratio, mass, inertia;
  double f1, f2;   ///< exact linear modes of the massless wire [Hz]
};
constexpr Spring kSprings[] = {
    {"W1", 8, 0.02, 0.004, 0.0005, 2e11, 0.3, 0.2, 0.0001002787701, 1.524463084, 1.610668239},
    {"W2", 20, 0.02, 0.004, 0.0008, 2e11, 0.3, 0.5, 0.0002575824371, 1.572873248, 1.598198276},
    {"W3", 5, 0.05, 0.01, 0.002, 1e9, 0.4, 0.03, 0.0001020624651, 1.384965457, 1.428410442}};
constexpr double kWireMass = 1e-4;        ///< of the body's: it moves the frequencies by half of a third of that
constexpr double kDisplacement = 0.003;   ///< [m] upwards
constexpr int kStepsPerPeriod = 100;

/// What a run recorded, every step.
struct Record
{
  double interval;
  std::vector<double> height, angle;           ///< of the body, from its equilibrium [m], [rad]
  std::vector<double> bobbing, turning;        ///< kinetic energies [J]
  std::vector<double> sway;                    ///< horizontal distance from the axis [m]
};

GroupSetup hang(const Spring& s, int edges_per_turn)
{
  const int edges = s.turns * edges_per_turn;
  Eigen::Matrix3Xd nodes = helixCurve({0, 0, 0}, Eigen::Vector3d::UnitZ(), s.radius, s.pitch, s.turns, edges);
  nodes.row(2) *= -1;
  const RodCase wire = circularRod(1.0, s.wire_radius, s.youngs_modulus, s.poissons_ratio, 1.0, 1);
  RodSection section = sectionOf(wire.stretch, wire.bend, wire.bend, wire.twist);
  section.linear_density = kWireMass * s.mass / edgeLengths(nodes, false).sum();
  RodSetup rod = naturalRod(section, nodes, Eigen::Vector3d::UnitZ());
  rod.hold(0, 0, true);
  GroupSetup g;
  g.add(rod);
  g.add("bob", s.mass, Eigen::Vector3d::Constant(s.inertia), {{0, 0, nodes(2, edges)}, Eigen::Quaterniond::Identity()});
  g.weld(0, edges, 0);
  g.setGravity({0, 0, -9.81});
  return g;
}

/// The body belongs to the simulation, or is held where the inputs say.
void setSimulated(GroupSetup& g, bool simulated)
{
  g.model.bodies[0].simulated = simulated;
  g.state.rods[0].grasps[1].body = simulated ? 0 : -1;
  g.inputs.bodies[0].X_WG = g.state.bodies[0].X_WB;
}

Record swing(const Spring& s, int edges_per_turn, Integrator integrator, double beats, StudyContext& context)
{
  GroupSetup g = hang(s, edges_per_turn);
  const double h = 1 / s.f2 / kStepsPerPeriod;
  const TimeConfig time = timeConfig(integrator, h, 1e-7);
  require(RodGroup(g.model, time).solveEquilibrium(g.state, g.inputs), std::string(s.name) + ", equilibrium");
  const Pose rest = g.state.bodies[0].X_WB;

  setSimulated(g, false);
  g.inputs.bodies[0].X_WG.position.z() += kDisplacement;
  require(RodGroup(g.model, time).solveEquilibrium(g.state, g.inputs), std::string(s.name) + ", displaced");
  setSimulated(g, true);

  RodGroup group(g.model, time);
  Record r;
  r.interval = h;
  double angle = 0;
  const int steps = static_cast<int>(beats / (s.f2 - s.f1) / h);
  for (int k = 0; k <= steps; ++k)
  {
    if (k % 200 == 0)
      context.progress(k, steps, std::string(s.name) + ", " + std::to_string(edges_per_turn) + " edges a turn, " + toString(integrator));
    const RigidBodyState& body = g.state.bodies[0];
    const Eigen::Vector3d at = body.X_WB.position - rest.position;
    angle = unwrapNear(rotationVector(body.X_WB.orientation * rest.orientation.conjugate()).z(), angle);
    r.height.push_back(at.z());
    r.angle.push_back(angle);
    r.sway.push_back(at.head<2>().norm());
    r.bobbing.push_back(0.5 * s.mass * std::pow(body.velocity.linear.z(), 2));
    r.turning.push_back(0.5 * s.inertia * std::pow(body.velocity.angular.z(), 2));
    require(group.step(g.state, g.inputs, h), s.name);
  }
  return r;
}

}  // namespace

void runWilberforce(StudyContext& context)
{
  const std::vector<int> meshes = context.quick() ? std::vector<int>{24} : std::vector<int>{12, 24, 48};
  for (const Spring& s : kSprings)
    for (const int per_turn : meshes)
    {
      const Integrator integrator = Integrator::tr_bdf2;
      const double begin = threadSeconds();
      const Record r = swing(s, per_turn, integrator, 2.2, context);
      const TwoTones tones = fitTwoTones({r.height, r.angle}, r.interval);
      const double seconds = threadSeconds() - begin;
      const auto add = [&](const char* quantity, double measured, double expected, double relative) {
        Row& row = context.row();
        row.set("case", s.name).set("quantity", quantity).set("edges_per_turn", per_turn).set("integrator", toString(integrator));
        row.check(measured, expected, relative * expected, "wilberforce.csv, massless wire, exact").set("relative_error", measured / expected - 1);
        row.set("misfit", tones.misfit).set("largest_sway", *std::max_element(r.sway.begin(), r.sway.end())).set("cpu_seconds", seconds);
      };
      add("f1 [Hz]", tones.f1, s.f1, 0.01);
      add("f2 [Hz]", tones.f2, s.f2, 0.01);
      add("beat period [s]", 1 / (tones.f2 - tones.f1), 1 / (s.f2 - s.f1), 0.05);
      if (per_turn == 24)
      {
        Plot& energy = context.plot(std::string("wilberforce_energy_") + s.name, std::string("Wilberforce pendulum ") + s.name + ": kinetic energies", "time [s]", "energy [J]");
        Plot& motion = context.plot(std::string("wilberforce_motion_") + s.name, std::string("Wilberforce pendulum ") + s.name + ": motion of the bob", "time [s]",
                                    "height [mm], angle [rad/10]");
        energy.log_x = energy.log_y = energy.markers = motion.log_x = motion.log_y = motion.markers = false;
        for (std::size_t k = 0; k < r.height.size(); ++k)
        {
          const double t = r.interval * static_cast<double>(k);
          const auto put = [t](Series& series, double y) {
            series.x.push_back(t);
            series.y.push_back(y);
          };
          put(energy.at("translation"), r.bobbing[k]);
          put(energy.at("rotation"), r.turning[k]);
          put(motion.at("height [mm]"), 1e3 * r.height[k]);
          put(motion.at("angle [rad/10]"), 10 * r.angle[k]);
        }
      }
    }
}

}  // namespace slender::study
