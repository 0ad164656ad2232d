// Two free objects of all kinds meet in empty space. Contact may neither change their momentum nor add energy.
#include <algorithm>
#include <cmath>
#include <sstream>
#include <stdexcept>
#include <string>
#include <vector>

#include "slender_sim/scene/reader.h"
#include "slender_sim/scene/simulation.h"
#include "slender_sim/study/study.h"

namespace slender::study {
namespace {

using Eigen::Vector3d;

enum class Thrown
{
  rod,
  thread,
  cloth,
  ball,
  box
};
constexpr Thrown kThrown[] = {Thrown::rod, Thrown::thread, Thrown::cloth, Thrown::ball, Thrown::box};
const char* const kThrownNames[] = {"rod", "thread", "cloth", "ball", "box"};
const char* nameOf(Thrown kind) { return kThrownNames[static_cast<int>(kind)]; }

struct ThrownScene
{
  std::ostringstream rods, threads, cloths, bodies;

  /// A rod or a thread lies along x, or along y if it is the `second` object.
  void add(Thrown kind, double height, bool second, double friction)
  {
    const char* const name = second ? "second" : "first";
    std::ostringstream contact, line;
    contact << ", contact: {friction: " << friction;
    line << ", centerline: {straight: {from: " << (second ? "[0.004, -0.05, " : "[-0.05, 0, ") << height
         << "], to: " << (second ? "[0.004, 0.05, " : "[0.05, 0, ") << height << "], edges: 10}}";
    if (kind == Thrown::rod)
      rods << "  - {name: " << name << line.str() << ", cross_section: {radius: 0.004}, material: {density: 1000, "
           << "youngs_modulus: 1e7, poissons_ratio: 0.45}" << contact.str() << "}}\n";
    else if (kind == Thrown::thread)
      threads << "  - {name: " << name << line.str() << ", radius: 0.004, fluid: {density: 1000, viscosity: 500}"
              << contact.str() << "}}\n";
    else if (kind == Thrown::cloth)
      cloths << "  - {name: " << name << ", grid: {corner: [-0.05, -0.05, " << height
             << "], sides: [[0.1, 0, 0], [0, 0.1, 0]], cells: 6}, material: {area_density: 0.3, youngs_modulus: 1e6, "
             << "thickness: 0.001}" << contact.str() << ", method: barrier, thickness: 0.002}}\n";
    else
      bodies << "  - {name: " << name << ", mass: 0.01, friction: " << friction << ", shape: {"
             << (kind == Thrown::ball ? "sphere: {radius: 0.01}" : "box: {size: [0.03, 0.02, 0.01]}")
             << "}, pose: {position: [" << (second ? 0.004 : 0.0) << ", 0.003, " << height << "]}}\n";
  }
  SceneConfig config(double step) const
  {
    std::ostringstream text;
    text.precision(17);
    text << "gravity: [0, 0, 0]\ntime: {step: " << step << ", duration: 10}\ncontact: {gap: 0.0004}\n";
    const auto put = [&](const char* key, const std::ostringstream& list) {
      if (!list.str().empty())
        text << key << ":\n" << list.str();
    };
    put("rods", rods);
    put("threads", threads);
    put("cloths", cloths);
    put("bodies", bodies);
    return parseScene(text.str());
  }
};

/// Momenta about the origin and mechanical energy.
struct Balance
{
  Vector3d linear = Vector3d::Zero(), angular = Vector3d::Zero();
  double energy = 0.0;   ///< [J]

  void addPoint(double mass, const Vector3d& x, const Vector3d& v)
  {
    linear += mass * v;
    angular += mass * x.cross(v);
    energy += 0.5 * mass * v.squaredNorm();
  }
};

Balance balanceOf(const World& world, const WorldState& state)
{
  Balance sum;
  const WorldModel& model = world.model();
  for (std::size_t k = 0; k < state.rods.size(); ++k)
  {
    const RodState& rod = state.rods[k];
    const RodModel& m = *model.rods[k].model;
    for (int i = 0; i < m.nodes(); ++i)
      sum.addPoint(m.mass[i], rod.x.col(i), rod.v.col(i));
    for (int j = 0; j < rod.spin.size(); ++j)
      sum.angular += m.spin_inertia[j] * rod.spin[j] * (rod.x.col(j + 1) - rod.x.col(j)).normalized();
    const RodEnergies e = world.rodEnergies(static_cast<int>(k), rod, Vector3d::Zero());
    for (int j = 0; j < rod.spin.size(); ++j)
      sum.energy += 0.5 * m.spin_inertia[j] * rod.spin[j] * rod.spin[j];
    sum.energy += e.stretch + e.bend + e.twist;
  }
  for (std::size_t k = 0; k < state.threads.size(); ++k)
    for (const ThreadState& thread : state.threads[k].threads)
      for (int j = 0; j < thread.edges(); ++j)
      {
        const double mass = model.threads[k].model->density * thread.volume[j], r = thread.radius(j);
        sum.addPoint(0.5 * mass, thread.x[j], thread.v[j]);
        sum.addPoint(0.5 * mass, thread.x[j + 1], thread.v[j + 1]);
        sum.angular += 0.5 * mass * r * r * thread.spin[j] * thread.edge(j).normalized();
        sum.energy += 0.25 * mass * r * r * thread.spin[j] * thread.spin[j];
      }
  for (std::size_t k = 0; k < state.cloths.size(); ++k)
  {
    const ClothState& cloth = state.cloths[k];
    for (Eigen::Index i = 0; i < cloth.x.cols(); ++i)
      sum.addPoint(model.cloths[k].model->mass[i], cloth.x.col(i), cloth.v.col(i));
    const ClothEnergies e = world.clothEnergies(static_cast<int>(k), cloth, Vector3d::Zero());
    sum.energy += e.membrane + e.bending;
  }
  for (std::size_t k = 0; k < state.bodies.size(); ++k)
  {
    const RigidBodyState& body = state.bodies[k];
    const Eigen::Matrix3d turn = body.X_WB.orientation.toRotationMatrix();
    const Vector3d spin = turn * model.bodies[k].body.inertia * turn.transpose() * body.velocity.angular;
    sum.addPoint(model.bodies[k].body.mass, body.X_WB.position, body.velocity.linear);
    sum.angular += spin;
    sum.energy += 0.5 * spin.dot(body.velocity.angular);
  }
  return sum;
}

/// Moments of all forces about the origin in a step of implicit Euler, times its length [kg m^2/s]. What it leaves of
/// the forces of contact is not an error of the integrator, whose own change of angular momentum is of first order.
Vector3d momentsOf(const World& world, const WorldState& before, const WorldState& now)
{
  const WorldModel& model = world.model();
  Vector3d sum = Vector3d::Zero();
  const auto add = [&](double mass, const Vector3d& x, const Vector3d& change) { sum += mass * x.cross(change); };
  for (std::size_t k = 0; k < now.rods.size(); ++k)
  {
    const RodState &rod = now.rods[k], &old = before.rods[k];
    const RodModel& m = *model.rods[k].model;
    for (int i = 0; i < m.nodes(); ++i)
      add(m.mass[i], rod.x.col(i), rod.v.col(i) - old.v.col(i));
    for (int j = 0; j < rod.spin.size(); ++j)
      sum += m.spin_inertia[j] * (rod.spin[j] - (old.spin.size() > 0 ? old.spin[j] : 0.0)) *
             (rod.x.col(j + 1) - rod.x.col(j)).normalized();
  }
  for (std::size_t k = 0; k < now.threads.size(); ++k)
    for (std::size_t piece = 0; piece < now.threads[k].threads.size(); ++piece)
    {
      const ThreadState &thread = now.threads[k].threads[piece], &old = before.threads[k].threads[piece];
      for (int j = 0; j < thread.edges(); ++j)
      {
        const double mass = model.threads[k].model->density * thread.volume[j], r = thread.radius(j);
        for (const int i : {j, j + 1})
          add(0.5 * mass, thread.x[i], thread.v[i] - old.v[i]);
        sum += 0.5 * mass * r * r * (thread.spin[j] - old.spin[j]) * thread.edge(j).normalized();
      }
    }
  for (std::size_t k = 0; k < now.cloths.size(); ++k)
    for (Eigen::Index i = 0; i < now.cloths[k].x.cols(); ++i)
      add(model.cloths[k].model->mass[i], now.cloths[k].x.col(i), now.cloths[k].v.col(i) - before.cloths[k].v.col(i));
  for (std::size_t k = 0; k < now.bodies.size(); ++k)
  {
    const RigidBodyModel& body = model.bodies[k].body;
    const RigidBodyState &to = now.bodies[k], &from = before.bodies[k];
    add(body.mass, to.X_WB.position, to.velocity.linear - from.velocity.linear);
    const auto spin = [&](const RigidBodyState& state) -> Vector3d {
      return state.X_WB.orientation * (body.inertia * (state.X_WB.orientation.conjugate() * state.velocity.angular));
    };
    sum += spin(to) - spin(from);
  }
  return sum;
}

/// Everything above z = 0.01 m gets this velocity.
void throwSecond(WorldState& state, const Vector3d& velocity)
{
  constexpr double kAbove = 0.01;
  for (RodState& rod : state.rods)
    if (rod.x(2, 0) > kAbove)
      rod.v.colwise() = velocity;
  for (ThreadGroupState& group : state.threads)
    for (ThreadState& thread : group.threads)
      if (thread.x[0].z() > kAbove)
        std::fill(thread.v.begin(), thread.v.end(), velocity);
  for (ClothState& cloth : state.cloths)
    if (cloth.x(2, 0) > kAbove)
      cloth.v.colwise() = velocity;
  for (RigidBodyState& body : state.bodies)
    if (body.X_WB.position.z() > kAbove)
      body.velocity.linear = velocity;
}

WorldInputs weightless(const WorldState& state)
{
  WorldInputs inputs;
  inputs.gravity.setZero();
  inputs.rods.resize(state.rods.size());
  inputs.threads.resize(state.threads.size());
  inputs.cloths.resize(state.cloths.size());
  inputs.bodies.resize(state.bodies.size());
  for (RodInputs& rod : inputs.rods)
    rod.gravity.setZero();
  for (ThreadInputs& thread : inputs.threads)
    thread.gravity.setZero();
  for (ClothInputs& cloth : inputs.cloths)
    cloth.gravity.setZero();
  return inputs;
}

/// Largest changes of momenta over what the objects give each other, and largest gain of energy over that at the start.
struct Losses
{
  double linear = 0.0, angular = 0.0, moments = 0.0, energy_gain = 0.0;
};

Losses collide(Thrown first, Thrown second, double friction, double step)
{
  constexpr double kHeight = 0.03, kDuration = 0.08;   // [m], [s]
  const Vector3d velocity(0.4, 0.2, -1.0);
  ThrownScene scene;
  scene.add(first, 0.0, false, friction);
  scene.add(second, kHeight, true, friction);
  const Simulation built(scene.config(step));
  WorldState state = built.state();
  throwSecond(state, velocity);
  World world(built.world().model(), state);
  const WorldInputs inputs = weightless(state);
  const Balance before = balanceOf(world, state);
  Losses losses;
  double exchanged = 0.0;
  Vector3d moments = Vector3d::Zero();
  for (int k = 0; k < static_cast<int>(std::round(kDuration / step)); ++k)
  {
    const WorldState old = state;
    if (const StepReport report = world.step(state, inputs); !report.ok)
      throw std::runtime_error(std::string(nameOf(first)) + " and " + nameOf(second) + ": " + report.message);
    const Balance now = balanceOf(world, state);
    moments += momentsOf(world, old, state);
    double pushed = 0.0;   // impulse on all pairs so far
    for (const ContactForce& contact : world.contacts())
      pushed += step * contact.force.norm();
    exchanged += pushed;
    losses.linear = std::max(losses.linear, (now.linear - before.linear).norm());
    losses.angular = std::max(losses.angular, (now.angular - before.angular).norm());
    losses.moments = std::max(losses.moments, moments.norm());
    losses.energy_gain = std::max(losses.energy_gain, now.energy / before.energy - 1.0);
  }
  if (!(exchanged > 0.0))
    throw std::runtime_error(std::string(nameOf(first)) + " and " + nameOf(second) + " do not meet");
  losses.linear /= exchanged;
  losses.angular /= exchanged * kHeight;
  losses.moments /= exchanged * kHeight;
  return losses;
}

void runCoupledMomentum(StudyContext& context)
{
  Losses worst;
  const std::vector<double> frictions = context.quick() ? std::vector<double>{0.3} : std::vector<double>{0.0, 0.3, 1.0};
  const double step = context.quick() ? 2e-3 : 1e-3;
  for (const Thrown first : kThrown)
    for (const Thrown second : kThrown)
      for (const double friction : frictions)
      {
        if (second < first)
          continue;
        const Losses losses = collide(first, second, friction, step);
        worst.linear = std::max(worst.linear, losses.linear);
        worst.angular = std::max(worst.angular, losses.angular);
        worst.moments = std::max(worst.moments, losses.moments);
        worst.energy_gain = std::max(worst.energy_gain, losses.energy_gain);
        context.row()
            .set("objects", std::string(nameOf(first)) + " and " + nameOf(second))
            .set("friction", friction)
            .set("linear_loss", losses.linear)
            .set("angular_loss", losses.angular)
            .set("moment_of_contact", losses.moments)
            .set("energy_gain", losses.energy_gain);
      }
  context.metric("linear_loss", worst.linear);
  context.metric("angular_loss", worst.angular);
  context.metric("moment_of_contact", worst.moments);
  context.metric("energy_gain", worst.energy_gain);
}

const StudyRegistration kCoupledMomentumRegistration{
    "coupled_momentum", "momentum, angular momentum and energy of two free objects of all kinds that meet",
    runCoupledMomentum};

}   // namespace
}   // namespace slender::study
