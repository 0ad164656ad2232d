// Wilberforce's pendulum (thesis Fig. 4.9): a body on a helical spring trades its bobbing for turning, and back.
#include <algorithm>
#include <cmath>
#include <limits>
#include <string>
#include <vector>

#include "study/rod/group_cases.h"
#include "study/framework/shape_cases.h"
#include "slender_sim/geometry/curves.h"
#include "slender_sim/geometry/rotation.h"
#include "study/framework/cpu_clock.h"
#include "slender_sim/study/oscillation.h"
#include "slender_sim/study/study.h"

namespace slender::study {
namespace {

/// Cases of wilberforce.csv: the wire is clamped above, the body welded to its lower end with its centre of mass on the
/// helix's axis at the height of that end; its moments, all equal, bring bobbing and turning into resonance.
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
constexpr int kStepsPerPeriod = 60;

/// What a run recorded, every step.
struct Record
{
  double interval;
  std::vector<double> height, angle;      ///< of the body, from its equilibrium [m], [rad]
  std::vector<double> bobbing, turning;   ///< kinetic energies [J]
  std::vector<double> sway;               ///< horizontal distance from the axis [m]
};

/// How the coil's joints are made. Errors are of second order each time, but of different size.
struct Joints
{
  const char* name;
  JointOptions options;
};
constexpr Joints kJoints[] = {{"plain", {Curvature::tangent, false}},
                              {"compensated", {Curvature::compensated, false}},
                              {"matched", {Curvature::tangent, true}},
                              {"compensated, matched", {Curvature::compensated, true}}};

/// Nodes on the coil.
GroupSetup hang(const Spring& s, int edges_per_turn, const JointOptions& joints)
{
  const int edges = s.turns * edges_per_turn;
  Eigen::Matrix3Xd nodes = helixCurve({0, 0, 0}, Eigen::Vector3d::UnitZ(), s.radius, s.pitch, s.turns, edges);
  nodes.row(2) *= -1;
  const RodCase wire = circularRod(1.0, s.wire_radius, s.youngs_modulus, s.poissons_ratio, 1.0, 1);
  RodSection section = sectionOf(wire.stretch, wire.bend, wire.bend, wire.twist);
  section.linear_density = kWireMass * s.mass / edgeLengths(nodes, false).sum();
  RodSetup rod = naturalRod(section, nodes, Eigen::Vector3d::UnitZ(), joints);
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
  g.model.bodies[0].body.simulated = simulated;
  g.state.rods[0].grasps[1].body = simulated ? 0 : -1;
  g.inputs.bodies[0].X_WG = g.state.bodies[0].X_WB;
}

Record swing(const Spring& s, int edges_per_turn, const JointOptions& joints, double beats, StudyContext& context)
{
  GroupSetup g = hang(s, edges_per_turn, joints);
  const double h = 1 / s.f2 / kStepsPerPeriod;
  const TimeConfig time = timeConfig(Integrator::tr_bdf2, h, 1e-7);
  require(g.world(time).solveEquilibrium(g.state, g.inputs), std::string(s.name) + ", equilibrium");
  const Pose rest = g.state.bodies[0].X_WB;

  setSimulated(g, false);
  g.inputs.bodies[0].X_WG.position.z() += kDisplacement;
  require(g.world(time).solveEquilibrium(g.state, g.inputs), std::string(s.name) + ", displaced");
  setSimulated(g, true);

  World world = g.world(time);
  Record r;
  r.interval = h;
  double angle = 0;
  const int steps = static_cast<int>(beats / (s.f2 - s.f1) / h);
  for (int k = 0; k <= steps; ++k)
  {
    if (k % 200 == 0)
      context.progress(k, steps, std::string(s.name) + ", " + std::to_string(edges_per_turn) + " edges a turn");
    const RigidBodyState& body = g.state.bodies[0];
    const Eigen::Vector3d at = body.X_WB.position - rest.position;
    angle = unwrapNear(rotationVector(body.X_WB.orientation * rest.orientation.conjugate()).z(), angle);
    r.height.push_back(at.z());
    r.angle.push_back(angle);
    r.sway.push_back(at.head<2>().norm());
    r.bobbing.push_back(0.5 * s.mass * std::pow(body.velocity.linear.z(), 2));
    r.turning.push_back(0.5 * s.inertia * std::pow(body.velocity.angular.z(), 2));
    require(world.step(g.state, g.inputs), s.name);
  }
  return r;
}

/// Fig. 4.9.
void plotExchange(StudyContext& context, const Spring& s, const Record& r)
{
  const std::string title = std::string("Wilberforce pendulum ") + s.name;
  Plot& energy = context.plot(std::string("wilberforce_energy_") + s.name, title + ": exchange of energy", "time [s]",
                              "kinetic energy [J]");
  Plot& motion =
      context.plot(std::string("wilberforce_motion_") + s.name, title + ": motion of the bob", "time [s]", "");
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
    put(motion.at("angle [1/100 rad]"), 1e2 * r.angle[k]);
  }
}

}   // namespace

void runWilberforce(StudyContext& context)
{
  Plot& errors = context.plot("wilberforce_error", "Wilberforce pendulum: error of the upper frequency",
                              "edges per turn", "relative error of f2");
  for (const Spring& s : kSprings)
    for (const int per_turn : {12, 24, 48})
      for (const Joints& joints : kJoints)
      {
        const bool checked = joints.options.matched_to_arcs && joints.options.curvature == Curvature::tangent;
        const bool long_run = s.turns > 10;   // a hundred periods of 480 edges
        if (per_turn != 24 && (long_run || context.quick()))
          continue;
        if (context.quick() && (long_run || !checked))
          continue;
        const double begin = threadSeconds();
        const Record r = swing(s, per_turn, joints.options, 2.2, context);
        const TwoTones tones = fitTwoTones({r.height, r.angle}, r.interval);
        const double seconds = threadSeconds() - begin, exact_beat = 1 / (s.f2 - s.f1);
        const auto newRow = [&](const char* quantity) -> Row& {
          return context.row()
              .set("case", s.name)
              .set("quantity", quantity)
              .set("joints", joints.name)
              .set("edges_per_turn", per_turn);
        };
        const auto add = [&](const char* quantity, double measured, double expected, double relative) {
          Row& row = newRow(quantity);
          if (checked && per_turn >= 24)
            row.check(measured, expected, relative * expected, "linear modes of the clamped massless wire");
          else
            row.set("measured", measured).set("expected", expected);
          row.set("relative_error", measured / expected - 1).set("misfit", tones.misfit).set("cpu_seconds", seconds);
        };
        add("f1 [Hz]", tones.f1, s.f1, 0.01);
        add("f2 [Hz]", tones.f2, s.f2, 0.01);
        add("beat period [s]", 1 / (tones.f2 - tones.f1), exact_beat, 0.05);
        Series& line = errors.at(std::string(s.name) + ", " + joints.name);
        line.x.push_back(per_turn);
        line.y.push_back(std::abs(tones.f2 / s.f2 - 1));

        // largest kinetic energy within the half period about the middle of the first beat, and in all
        const std::size_t middle = static_cast<std::size_t>(0.5 / (tones.f2 - tones.f1) / r.interval),
                          reach = kStepsPerPeriod / 2;
        const auto peak = [](const std::vector<double>& e, std::size_t from, std::size_t to) {
          return *std::max_element(e.begin() + static_cast<std::ptrdiff_t>(from),
                                   e.begin() + static_cast<std::ptrdiff_t>(to));
        };
        const double all = peak(r.bobbing, 0, r.bobbing.size());
        newRow("left in bobbing at half a beat").set("measured", peak(r.bobbing, middle - reach, middle + reach) / all);
        newRow("passed to turning").set("measured", peak(r.turning, 0, r.turning.size()) / all);
        newRow("largest sway [m]").set("measured", *std::max_element(r.sway.begin(), r.sway.end()));
        if (per_turn == 24 && checked)
          plotExchange(context, s, r);
      }
  context.note(
      "Nodes on the coil; joints as of the scene keys matched_to_arcs and curvature. Compensated joints do not replace "
      "matching: their rows are shown, not checked, since beats amplify errors of the frequencies by f / (f2 - f1). "
      "Start: 3 mm upwards, everything else at rest. Frequencies: two tones fitted to height and angle of 2.2 beats; "
      "tr_bdf2, 60 steps a period.");
}

const StudyRegistration kWilberforceRegistration{
    "wilberforce", "a body on a helical spring: frequencies, beat, exchange of energy", runWilberforce};

}   // namespace slender::study
