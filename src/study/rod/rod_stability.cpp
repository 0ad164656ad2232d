#include <cmath>
#include <functional>
#include <limits>
#include <stdexcept>
#include <string>
#include <vector>

#include "rod_cases.h"
#include "study/framework/stability.h"
#include "slender_sim/scene/state_bytes.h"
#include "study/framework/cpu_clock.h"
#include "slender_sim/study/study.h"

namespace slender::study {
namespace {

struct StabilityRun
{
  StabilityCell cell;
  Path path;
};

using Motion = std::function<void(int step, RodSetup& rod)>;

/// Runs up to `steps` steps; `motion` sets the inputs of each. Energy may not grow once the inputs stand still
/// (from step `quiet` on).
/// `turned` [rad], if not zero: how far a straight rod must be twisted at the end, told by its energy beta turned^2/(2
/// L).
StabilityRun run(RodSetup rod, const TimeConfig& time, int steps, const Motion& motion, int quiet, double turned = 0.0)
{
  StabilityRun r{{}, Path(rod.state.x)};
  StabilityCell& cell = r.cell;
  cell.linear_steps = time.integrator == Integrator::symplectic_euler;
  RodStepper stepper(rod.model, time);
  double before = 0, scale = 0;
  const double begin = threadSeconds();
  for (int i = 0; i < steps; ++i)
  {
    motion(i, rod);
    const RodState saved = rod.state;
    if (i == quiet)
    {
      const RodEnergies e = stepper.energies(rod.state, rod.inputs.gravity);
      before = e.total();
      // What there is to give: all elastic and kinetic energy, and the fall of the whole rod over its length.
      scale = e.stretch + e.bend + e.twist + e.kinetic +
              rod.model->totalMass() * rod.inputs.gravity.norm() * rod.model->rest_length.sum();
    }
    const StepReport report = stepper.step(rod.state, rod.inputs, time.step);
    if (!cell.took(report, isFinite(rod.state), stateBytes(saved) == stateBytes(rod.state)))
      break;
    r.path.x.push_back(rod.state.x);
    if (i < quiet)
      continue;
    const double growth = (stepper.energies(rod.state, rod.inputs.gravity).total() - before) / scale;
    if (!cell.energyIs(growth, energyGrowth(time.integrator)))
      break;
  }
  cell.cpu_seconds = threadSeconds() - begin;
  if (turned > 0 && !cell.refused && cell.complaint.empty())
  {
    const double found = std::sqrt(2 * stepper.energies(rod.state, rod.inputs.gravity).twist *
                                   rod.model->rest_length.sum() / rod.model->twist_modulus[1]);
    if (!(std::abs(found - turned) < 0.01 * turned))
      cell.complaint = "twisted by " + std::to_string(found / (2 * M_PI)) + " turns instead of " +
                       std::to_string(turned / (2 * M_PI));
  }
  return r;
}

RodSetup heldRod(double radius, double youngs_modulus, int nodes)
{
  RodSetup rod = straightRod(circularRod(1.0, radius, youngs_modulus, 0.3, 1000, nodes - 1));
  rod.inputs.gravity = {0, 0, -9.81};
  rod.hold(0, 0, true);
  return rod;
}

void still(int, RodSetup&) {}

/// Both ends held; the far one turns by `turns` in `steps` steps.
Motion twisting(double turns, int steps)
{
  return [=](int i, RodSetup& rod) {
    if (i >= steps)
      return;
    Pose& pose = rod.inputs.grasps[1].X_WG;
    pose.orientation =
        (Eigen::Quaterniond(Eigen::AngleAxisd(2 * M_PI * turns / steps, Eigen::Vector3d::UnitX())) * pose.orientation)
            .normalized();
  };
}

RodSetup heldAtBothEnds(double radius, double youngs_modulus, int nodes)
{
  RodSetup rod = heldRod(radius, youngs_modulus, nodes);
  rod.hold(nodes - 1, nodes - 1, true);
  return rod;
}

/// Naturally straight, folded back on itself over `joints` joints in its middle; bent by `fold` [rad] in all.
RodSetup foldedRod(double fold, int joints)
{
  const int edges = 199;
  const double h = 1.0 / edges;
  Eigen::Matrix3Xd nodes(3, edges + 1);
  nodes.col(0).setZero();
  double angle = 0;
  for (int i = 0; i < edges; ++i)
  {
    if (i >= (edges - joints) / 2 && i < (edges - joints) / 2 + joints)
      angle += fold / joints;
    nodes.col(i + 1) = nodes.col(i) + h * Eigen::Vector3d(std::cos(angle), 0, std::sin(angle));
  }
  RodSetup rod = straightRod(circularRod(1.0, 0.001, 1e7, 0.3, 1000, edges));
  const RodState bent = makeRodState(*rod.model, nodes, Eigen::Vector3d::UnitY());
  rod.hold(0, 0, true);
  rod.state.x = bent.x;
  rod.state.d1 = bent.d1;
  rod.state.twist = bent.twist;
  rod.inputs.gravity = {0, 0, -9.81};
  return rod;
}

/// The free end starts at 100 m/s across the rod, the velocity falling off to nothing towards the clamp.
RodSetup whippedRod(double radius, double youngs_modulus)
{
  RodSetup rod = heldRod(radius, youngs_modulus, 200);
  for (int i = 0; i < 200; ++i)
    rod.state.v.col(i) = Eigen::Vector3d(0, 0, 100 * std::pow(i / 199.0, 4));
  return rod;
}

}   // namespace

void runRodStability(StudyContext& context)
{
  StabilityTally tally(context);

  // The map: held horizontally and released.
  const std::vector<double> decades =
      context.quick() ? std::vector<double>{3, 6, 9, 13} : std::vector<double>{3, 4, 5, 6, 7, 8, 9, 10, 11, 12, 13};
  const std::vector<double> radii =
      context.quick() ? std::vector<double>{1e-5, 1e-3, 0.1} : std::vector<double>{1e-5, 1e-4, 1e-3, 1e-2, 0.1};
  const std::vector<double> steps = context.quick() ? std::vector<double>{1e-5, 1e-3, 1.0 / 30}
                                                    : std::vector<double>{1e-5, 1e-4, 1e-3, 1e-2, 1.0 / 30};
  const std::vector<Integrator> integrators =
      context.quick() ? std::vector<Integrator>{Integrator::implicit_euler, Integrator::tr_bdf2}
                      : implicitIntegrators();
  const int total = static_cast<int>(integrators.size() * decades.size() * radii.size() * steps.size());
  int done = 0;
  Plot& plot = context.plot("rod_stability", "Stability map, implicit Euler and others: outcome of each cell",
                            "Young's modulus [Pa]", "step [s] (shifted by radius)");
  plot.lines = false;
  for (const Integrator integrator : integrators)
    for (const double decade : decades)
      for (const double radius : radii)
        for (const double step : steps)
        {
          const double modulus = std::pow(10.0, decade);
          context.progress(done++, total, toString(integrator));
          Row& row = context.row();
          row.set("case", "released")
              .set("integrator", toString(integrator))
              .set("E_Pa", modulus)
              .set("radius_over_length", radius)
              .set("step_s", step);
          const RodSetup rod = heldRod(radius, modulus, 50);
          StabilityRun r = run(rod, timeConfig(integrator, step), 30, still, 0);
          if (r.cell.complaint.empty() && !r.cell.refused)
          {
            const StabilityRun fine = run(rod, timeConfig(integrator, step / 4), 120, still, 0);
            if (fine.cell.complaint.empty() && !fine.cell.refused)
              r.cell.compare(r.path, fine.path);
          }
          tally.record(row, r.cell);
          Series& s = plot.at(toString(r.cell.outcome()));
          s.x.push_back(modulus);
          s.y.push_back(step * (1 + 0.12 * (std::log10(radius) + 5)));
        }

  // Special cases.
  using Setup = std::function<RodSetup()>;
  const auto special = [&](const std::string& name, Integrator integrator, double step, const Setup& setup, int count,
                           const Motion& motion, int quiet, double turned = 0.0) {
    context.progress(done++, total, name);
    Row& row = context.row();
    row.set("case", name).set("integrator", toString(integrator)).set("step_s", step);
    StabilityCell cell;
    try
    {
      cell = run(setup(), timeConfig(integrator, step), count, motion, quiet, turned).cell;
    }
    catch (const std::invalid_argument& e)   // what cannot even be set up is refused there
    {
      cell.refuseAtOnce(e.what());
    }
    catch (const std::exception& e)
    {
      cell.complaint = std::string("threw: ") + e.what();
      cell.explained = false;
    }
    tally.record(row, cell);
  };
  const int never = std::numeric_limits<int>::max();
  const auto teleport = [](const Eigen::Vector3d& by, double angle) {
    return [=](int i, RodSetup& rod) {
      if (i != 5)
        return;
      Pose& pose = rod.inputs.grasps.back().X_WG;
      pose.position += by;
      pose.orientation =
          (Eigen::Quaterniond(Eigen::AngleAxisd(angle, Eigen::Vector3d(1, 2, 3).normalized())) * pose.orientation)
              .normalized();
    };
  };
  const Setup rope = [] { return heldAtBothEnds(0.002, 1e7, 100); };
  const double nan = std::numeric_limits<double>::quiet_NaN();
  for (const Integrator integrator : integrators)
  {
    for (const double step : {0.01, 1.0 / 30})
    {
      special(
          "r 1 mm E 1e6", integrator, step, [] { return heldRod(0.001, 1e6, 200); }, 100, still, 0);
      special(
          "r 0.2 mm E 2e11", integrator, step, [] { return heldRod(0.0002, 2e11, 200); }, 100, still, 0);
    }
    // less than half a turn each, or the direction would be lost
    const int turn_steps = context.quick() ? 4000 : 10000;
    special(
        "1000 turns, stiff and short of buckling", integrator, 1e-3,
        [] {
          RodSetup rod = straightRod([] {
            RodCase c = circularRod(1.0, 0.01, 1e7, 0.3, 1000, 49);
            c.twist = c.bend / 2000;   // so soft in twist that 1000 turns do not buckle it
            return c;
          }());
          rod.hold(0, 0, true);
          rod.hold(49, 49, true);
          return rod;
        },
        turn_steps + 20, twisting(1000, turn_steps), turn_steps, 2 * M_PI * 1000);
    const int rope_turns = context.quick() ? 100 : 1000;
    special(
        std::to_string(rope_turns) + " turns, rope", integrator, 5e-3, [] { return heldAtBothEnds(0.002, 1e7, 100); },
        10 * rope_turns, twisting(rope_turns, 10 * rope_turns), never);
    for (const double step : {1e-3, 0.01, 1.0 / 30})
    {
      special(
          "folded back on itself", integrator, step, [] { return foldedRod(M_PI, 8); }, 50, still, 0);
      special(
          "folded by 179.9 degrees in one joint", integrator, step, [] { return foldedRod(M_PI * 179.9 / 180, 1); }, 50,
          still, 0);
      special(
          "folded by 180 degrees in one joint", integrator, step, [] { return foldedRod(M_PI, 1); }, 50, still, 0);
      special(
          "free end at 100 m/s, rope", integrator, step, [] { return whippedRod(0.002, 1e7); }, 50, still, 0);
      special(
          "free end at 100 m/s, steel wire", integrator, step, [] { return whippedRod(0.0005, 2e11); }, 50, still, 0);
      special("grasp teleports by 0.3 m", integrator, step, rope, 30, teleport({-0.3, 0.1, 0.1}, 0), never);
      special("grasp teleports by 10 m", integrator, step, rope, 30, teleport({10, 0, 0}, 0), never);
      special("grasp turns by 180 degrees at once", integrator, step, rope, 30, teleport({0, 0, 0}, M_PI), never);
      special("grasp teleports onto the other", integrator, step, rope, 30, teleport({-1, 0, 0}, 0), never);
      special("grasp pose is not a number", integrator, step, rope, 30, teleport({nan, 0, 0}, 0), never);
    }
  }
  special(
      "beyond the explicit limit", Integrator::symplectic_euler, 1e-3, [] { return heldRod(0.002, 1e9, 50); }, 2000,
      still, never);
  special(
      "within the explicit limit", Integrator::symplectic_euler, 1e-5, [] { return heldRod(0.002, 1e9, 50); }, 2000,
      still, 0);
}

const StudyRegistration kRodStabilityRegistration{
    "rod_stability", "extreme stiffness, thickness, steps, twist and grasps: done, cut or refused with reason",
    runRodStability};

}   // namespace slender::study
