// A trefoil knot on a clamped wire, turned slowly at one end both ways: a smooth change, then a jump (thesis 4.7.2,
// Fig. 4.1).
#include <algorithm>
#include <cmath>
#include <stdexcept>
#include <string>
#include <vector>

#include "knot_twist.h"
#include "study/framework/scene_cases.h"
#include "slender_sim/geometry/rotation.h"

namespace slender::study {
namespace {

using Eigen::Vector3d;

constexpr double kDegree = M_PI / 180;

/// Writhe [turns] of a rod that goes on straight beyond its clamps, exact for a polyline: every pair of edges seen from
/// each other [Klenin & Langowski, Biopolymers 54, 2000, method 1a].
double writhe(const RodState& rod)
{
  constexpr double kFar = 1e4;   // [m]
  const int n = static_cast<int>(rod.x.cols()) + 2;
  Eigen::Matrix3Xd x(3, n);
  x << rod.x.col(0) - kFar * (rod.grasps[0].X_WG.orientation * Vector3d::UnitX()), rod.x,
      rod.x.col(n - 3) + kFar * (rod.grasps[1].X_WG.orientation * Vector3d::UnitX());
  double sum = 0;
  for (int i = 0; i + 1 < n; ++i)
    for (int j = i + 2; j + 1 < n; ++j)
    {
      const Vector3d r13 = x.col(j) - x.col(i), r14 = x.col(j + 1) - x.col(i), r23 = x.col(j) - x.col(i + 1),
                     r24 = x.col(j + 1) - x.col(i + 1);
      const Vector3d sides[4] = {r13.cross(r14), r14.cross(r24), r24.cross(r23), r23.cross(r13)};
      double angle = 0;
      for (int k = 0; k < 4; ++k)
      {
        const double size = sides[k].norm() * sides[(k + 1) % 4].norm();
        angle += size > 0 ? std::asin(std::clamp(sides[k].dot(sides[(k + 1) % 4]) / size, -1.0, 1.0)) : 0.0;
      }
      const double handed = (x.col(j + 1) - x.col(j)).cross(x.col(i + 1) - x.col(i)).dot(r13);
      sum += handed > 0 ? angle : handed < 0 ? -angle : 0.0;
    }
  return sum / (2 * M_PI);
}

/// Twist [turns] between the clamps.
double totalTwist(const RodState& rod)
{
  double sum = rod.twist.sum();
  for (const GraspState& g : rod.grasps)
    sum += g.section_twist[0] + g.section_twist[1];
  return sum / (2 * M_PI);
}

/// The wire of scene knot_twist, without friction, always in equilibrium.
class TurnedKnot
{
public:
  TurnedKnot(int edges, bool left_handed)
    : setup_(groupOf(packageScene(
          "knot_twist", {"rods.0.contact.friction=0", "rods.0.centerline.straight.edges=" + std::to_string(edges),
                         std::string("rods.0.initial.trefoil.left_handed=") + (left_handed ? "true" : "false")}))),
      world_(setup_.world(timeConfig(Integrator::implicit_euler, 0.004))),
      start_(target().orientation)
  {
    // twist-free: turn until the clamp's torque is gone (frames along the tied curve are not those of the rod at rest)
    const RodModel& m = *setup_.model.rods[0].model;
    const double compliance = m.rest_length.sum() / m.twist_modulus[0];
    do
    {
      turn(0.0);
      start_ = fromRotationVector(Vector3d(std::clamp(torque() * compliance, -1.0, 1.0), 0, 0)) * start_;
    }
    while (std::abs(torque() * compliance) > 1e-4);
    turn(0.0);
  }

  /// To `angle` [rad] from the twist-free state, less than half a turn at a time. Throws std::runtime_error.
  void turn(double angle)
  {
    target().orientation = fromRotationVector(Vector3d(angle, 0, 0)) * start_;
    require(world_.solveEquilibrium(setup_.state, setup_.inputs),
            "knot turned by " + std::to_string(angle / kDegree) + " degrees");
  }

  const RodState& rod() const { return setup_.state.rods[0]; }
  double torque() const { return world_.rodWrenches(0)[1].torque.x(); }   ///< of the rod on the clamp that turns [N m]
  double tension() const { return -world_.rodWrenches(0)[1].force.x(); }
  double energy() { return world_.rodEnergies(0, rod(), Vector3d::Zero()).total(); }
  const GroupSetup& setup() const { return setup_; }

private:
  Pose& target() { return setup_.inputs.rods[0].grasps[1].X_WG; }

  GroupSetup setup_;
  World world_;
  Eigen::Quaterniond start_;
};

struct Jump
{
  double turns = 0;              ///< where it happens; 0: nowhere
  double smooth = 0, size = 0;   ///< largest displacement of a node in a step before it; in the jump [m]
};

/// Turns until the knot jumps, in steps: a node moves by a twentieth of the wire's length at once.
Jump turnUntilJump(StudyContext& context, int edges, int direction, double step, double last, Plot& torques,
                   Plot* picture)
{
  TurnedKnot knot(edges, false);
  const RodModel& m = *knot.setup().model.rods[0].model;
  const double length = m.rest_length.sum(), link = totalTwist(knot.rod()) + writhe(knot.rod());
  Series& series = torques.at(std::string(direction > 0 ? "+" : "-") + ", n = " + std::to_string(edges));
  const auto show = [&](const std::string& what, const Eigen::Matrix3Xd& nodes, double right) {
    if (picture)
      draw(*picture, what, nodes, false, {}, {right, 0, right < 0 ? 0.0 : direction > 0 ? 0.05 : -0.1});
  };
  Jump jump;
  double unlike = 0, clearance = bruteForceClearance(knot.setup()), energy = knot.energy(), tension = knot.tension(),
         released = 0;
  Eigen::Matrix3Xd before = knot.rod().x;
  if (direction > 0)
    show("no twist", before, -0.4);
  for (double turned = step; turned <= last && jump.turns == 0; turned += step)
  {
    context.progress(static_cast<int>(turned), static_cast<int>(last),
                     "knot of " + std::to_string(edges) + " edges, degrees turned");
    before = knot.rod().x;
    const double energy_before = knot.energy();
    knot.turn(direction * turned * kDegree);
    const double change = (knot.rod().x - before).colwise().norm().maxCoeff();
    unlike = std::max(unlike, std::abs(totalTwist(knot.rod()) + writhe(knot.rod()) - link - direction * turned / 360));
    clearance = std::min(clearance, bruteForceClearance(knot.setup()));
    series.x.push_back(direction * turned / 360);
    series.y.push_back(-knot.torque());
    if (change > 0.05 * length)
    {
      jump.turns = turned / 360;
      jump.size = change;
      released = energy_before - knot.energy();
    }
    else
      jump.smooth = std::max(jump.smooth, change);
  }
  if (jump.turns == 0)
    throw std::runtime_error("knot of " + std::to_string(edges) + " edges: no jump within " +
                             std::to_string(static_cast<int>(last)) + " degrees");
  show(std::string(direction > 0 ? "+" : "-") + ", before the jump", before, 0);
  show(std::string(direction > 0 ? "+" : "-") + ", after the jump", knot.rod().x, 0.4);
  const auto row = [&](const char* quantity) -> Row& {
    return context.row().set("n", edges).set("direction", direction > 0 ? "+" : "-").set("quantity", quantity);
  };
  row("jump")
      .set("turns", jump.turns)
      .set("smooth_change_mm", 1e3 * jump.smooth)
      .set("jump_mm", 1e3 * jump.size)
      .set("released_uJ", 1e6 * released)
      .set("tension_at_rest_N", tension)
      .set("energy_at_rest_J", energy)
      .set("clearance_um", 1e6 * clearance);
  row("end turn less twist and writhe [turns]")
      .check(unlike, 0, 1e-5, "Calugareanu: constant unless the wire passes through itself");
  return jump;
}

}   // namespace

void twistKnot(StudyContext& context)
{
  Plot& torques = context.plot("knot_torque", "Clamped trefoil knot turned at one end until it jumps",
                               "turns from the twist-free knot", "torque on the wire [N m]");
  torques.log_x = torques.log_y = torques.lines = false;
  Plot& picture = addPicture(context, "knot_shapes", "Clamped trefoil knot, from the side", "x [m]", "z [m]");
  const std::vector<int> meshes = context.quick() ? std::vector<int>{60} : std::vector<int>{240, 120};
  const double step = context.quick() ? 20 : 10;   // degrees
  for (const int direction : {1, -1})
  {
    const std::string name = direction > 0 ? "positive" : "negative";
    double fine = 0;
    for (const int edges : meshes)
    {
      const Jump jump = turnUntilJump(context, edges, direction, step, direction > 0 ? 1500 : 2700, torques,
                                      edges == meshes.front() ? &picture : nullptr);
      if (edges != meshes.front())
        context.row()
            .set("n", edges)
            .set("direction", direction > 0 ? "+" : "-")
            .set("quantity", "turns at the jump")
            .check(jump.turns, fine, 0.05 * fine, std::to_string(meshes.front()) + " edges");
      else
      {
        fine = jump.turns;
        context.metric("jump_turns_" + name, jump.turns);
        context.metric("jump_over_smooth_" + name, jump.size / jump.smooth);
      }
    }
  }
  // in a mirror the knot is left-handed and turns the other way
  double energies[2];
  for (const bool left_handed : {false, true})
  {
    TurnedKnot knot(meshes.back(), left_handed);
    for (int k = 1; k <= 4; ++k)
      knot.turn((left_handed ? -1 : 1) * k * 90 * kDegree);
    energies[left_handed] = knot.energy();
  }
  context.row()
      .set("n", meshes.back())
      .set("direction", "mirrored")
      .set("quantity", "energy after a turn [J]")
      .check(energies[1], energies[0], 1e-4 * energies[0], "the knot itself, turned the other way");
}

}   // namespace slender::study
