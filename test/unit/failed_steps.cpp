// A step or substep that fails leaves nothing behind in its stepper. After the failure the stepper computes the same
// states, bit by bit, as a new stepper that starts from the same state.
#include <cmath>
#include <functional>
#include <memory>
#include <string>

#include <gtest/gtest.h>

#include "slender_sim/geometry/mesh_shapes.h"
#include "slender_sim/scene/state_bytes.h"
#include "slender_sim/tracking/weak_constraints.h"
#include "test/support/groups.h"
#include "test/support/thread_world.h"
#include "test/support/threads.h"

namespace slender::test {
namespace {

constexpr double kPart = 1.0 / 64;   // [s] a power of two, so that sums of halves of steps are exact

std::string bytesOf(const RodState& s) { return stateBytes(s); }
std::string bytesOf(const ClothState& s) { return stateBytes(s); }
std::string bytesOf(const ThreadState& s)
{
  ThreadGroupState group;
  group.threads.push_back(s);
  return stateBytes(group);
}
std::string bytesOf(const WorldState& s)
{
  std::string bytes;
  for (const ThreadGroupState& thread : s.threads)
    bytes += stateBytes(thread);
  for (const slender::ContactMemory& memory : s.contact.threads)
    for (const BarrierLayer& layer : memory.barrier.layers)
      bytes += std::to_string(layer.share) + std::to_string(layer.stiffness);
  for (const ClothState& cloth : s.cloths)
    bytes += stateBytes(cloth);
  if (s.rods.empty())
    return bytes;
  SceneState scene;   // stateBytes() takes the state of a scene; that of a world counts its steps
  scene.rods = s.rods;
  scene.bodies = s.bodies;
  scene.obstacles = s.obstacles;
  scene.obstacle_velocities = s.obstacle_velocities;
  scene.contact = s.contact;
  return bytes + stateBytes(scene);
}
/// A world with the function of the steppers; its step has the length of its model.
struct WorldStepper
{
  std::unique_ptr<World> world;
  StepReport step(WorldState& state, const WorldInputs& inputs, double) { return world->step(state, inputs); }
};
/// Expects that a step whose first substep fails, and whose two halves succeed, ends like two steps of half its length
/// of a new stepper. The step length (at most `longest` [s]) and the limit of Newton iterations are varied until such a
/// step is found. `make(newton, h)` returns a stepper for steps of h, and `step(stepper, state, h)` takes one step with
/// it.
template <class State, class Make, class Step>
void expectHalvesLikeFresh(const std::string& what, const State& start, double longest, const Make& make,
                           const Step& step)
{
  constexpr int kMost = 24;   // iterations
  int found = 0;
  for (int k = 0; k < 16 * kMost && found < 2; ++k)
  {
    const double h = longest * std::exp2(-0.25 * (k / kMost));
    NewtonConfig newton;
    newton.max_iterations = 1 + k % kMost;
    auto halved = make(newton, h);
    State state = start;
    const StepReport report = step(halved, state, h);
    if (!report.ok || report.cut_steps != 1 || report.substeps != 2)
      continue;
    ++found;
    auto fresh = make(newton, 0.5 * h);
    State expected = start;
    for (int half = 0; half < 2; ++half)
    {
      const StepReport own = step(fresh, expected, 0.5 * h);
      EXPECT_TRUE(own.ok && own.cut_steps == 0)
          << what << ", at most " << newton.max_iterations << " iterations: " << own.message;
    }
    EXPECT_TRUE(bytesOf(state) == bytesOf(expected)) << what << ", at most " << newton.max_iterations << " iterations";
  }
  EXPECT_GT(found, 0) << what << ": no first substep failed whose halves succeeded";
}

/// Expects that the step with the inputs `spoilt` is refused and does not change the state, and that the next three
/// steps equal those of a new stepper.
template <class State, class Inputs, class Stepper>
void expectRefusalLeavesNothing(const std::string& what, const State& start, const Inputs& inputs, const Inputs& spoilt,
                                double h, const std::function<Stepper()>& make)
{
  Stepper refused = make(), fresh = make();
  State state = start, expected = start;
  const StepReport report = refused.step(state, spoilt, h);
  EXPECT_FALSE(report.ok) << what << ": the spoilt step was done";
  EXPECT_FALSE(report.message.empty()) << what;
  EXPECT_TRUE(bytesOf(state) == bytesOf(start)) << what << ": " << report.message;
  for (int k = 0; k < 3; ++k)
  {
    const StepReport a = refused.step(state, inputs, h), b = fresh.step(expected, inputs, h);
    EXPECT_TRUE(a.ok && b.ok) << what << ", step " << k << ": " << a.message << b.message;
    EXPECT_EQ(a.iterations, b.iterations) << what << ", step " << k;
    EXPECT_TRUE(bytesOf(state) == bytesOf(expected)) << what << ", step " << k << " after: " << report.message;
  }
}

std::string named(const char* what, Integrator integrator) { return std::string(what) + ", " + toString(integrator); }

/// Returns a rod that is held at one end while its other end moves fast.
Rod whip(bool damped)
{
  const Matrix3Xd nodes = straightNodes(20, 0.5);
  RodModel model = openRod(nodes, roundSection(0.003, 5e6, 1100));
  model.mass_damping = damped ? 0.3 : 0.0;
  model.stiffness_damping = damped ? 1e-3 : 0.0;
  Rod rod(model, nodes, 0.5);
  rod.hold(0, 0);
  for (int i = 0; i < 20; ++i)
    rod.state.v.col(i) = Vector3d(0, 2, 6) * std::pow(i / 19.0, 2);
  return rod;
}

/// Returns three rods, with or without damping, that are welded to a fast tumbling body.
Group tumbling(bool damped)
{
  Group g = tee();
  for (WorldModel::Rod& rod : g.model.rods)
  {
    RodModel model = *rod.model;
    model.stiffness_damping = damped ? 2e-3 : 0.0;
    rod.model = std::make_shared<RodModel>(model);
  }
  g.state.bodies[0].velocity.angular *= 8.0;
  g.setGravity({0, 0, -9.81});
  return g;
}

/// Returns a rod with a weight at its end that falls onto a ball without friction.
Group landing(double speed)
{
  Group g;
  const Matrix3Xd nodes = straightNodes(15, 0.3, Vector3d(-0.15, 0, 0.0));
  RodModel model = openRod(nodes, roundSection(0.004, 2e6, 1100));
  model.stiffness_damping = 2e-3;
  g.addRod(Rod(model, nodes));
  const int body = g.addBody(bodyOf(0.01, {2e-6, 3e-6, 4e-6}), {Vector3d(0.16, 0, 0), Eigen::Quaterniond::Identity()});
  g.weld(0, 14, 14, body);
  g.addObstacle(Sphere{0.05}, {Vector3d(0, 0.004, -0.0565), Eigen::Quaterniond::Identity()});
  g.model.rods[0].contact.emplace();
  g.model.rods[0].contact->friction = 0.0;
  g.model.contact.gap = 2e-3;
  g.model.contact.least_stiffness = 3.0;   // more than follows from steps of 1 ms and longer: the same for all
  g.state.rods[0].v.colwise() = Vector3d(0, 0, -speed);
  g.state.bodies[0].velocity.linear = {0, 0, -speed};
  g.setGravity({0, 0, -9.81});
  return g;
}

TEST(FailedSteps, HalvesOfARodAreThoseOfAFreshOne)
{
  for (const bool damped : {false, true})
    for (const Integrator integrator : implicitIntegrators())
    {
      const Rod rod = whip(damped);
      const auto make = [&](const NewtonConfig& newton, double) {
        TimeConfig time = withIntegrator(integrator);
        time.newton = newton;
        return RodStepper(rod.model, time);
      };
      expectHalvesLikeFresh(
          named(damped ? "damped rod" : "rod", integrator), rod.state, 2 * kPart, make,
          [&](RodStepper& stepper, RodState& state, double h) { return stepper.step(state, rod.inputs, h); });
    }
}

WorldStepper stepperOf(Group& g, const TimeConfig& time, double step)
{
  return {std::unique_ptr<World>(new World(g.world(time, step)))};
}

void expectGroupHalves(const std::string& what, Group g, Integrator integrator, double h)
{
  TimeConfig time = withIntegrator(integrator);
  g.world(time, h);   // the state gets the grasps of the welds
  const auto make = [&](const NewtonConfig& newton, double length) {
    time.newton = newton;
    return stepperOf(g, time, length);
  };
  expectHalvesLikeFresh(what, g.state, h, make, [&](WorldStepper& world, WorldState& state, double length) {
    return world.step(state, g.inputs, length);
  });
}

TEST(FailedSteps, HalvesOfRodsWithBodiesAreThoseOfFreshOnes)
{
  for (const bool damped : {false, true})
    for (const Integrator integrator : implicitIntegrators())
      expectGroupHalves(named(damped ? "damped, tumbling" : "tumbling", integrator), tumbling(damped), integrator,
                        kPart);
}

TEST(FailedSteps, HalvesOfRodsInContactAreThoseOfFreshOnes)
{
  expectGroupHalves("landing", landing(1.5), Integrator::tr_bdf2, kPart);
}

// A step of 10 ms was refused after ten halvings, while one of 1 ms passed at once.
TEST(FailedSteps, AFirstStepWithADampedRodAndABodyCanBeHalved)
{
  for (const Integrator integrator :
       {Integrator::tr_bdf2, Integrator::generalized_alpha, Integrator::implicit_midpoint})
  {
    Group g = tumbling(true);
    TimeConfig time = withIntegrator(integrator);
    time.newton.max_iterations = 4;   // the whole step needs more, a part of it does not
    World world = g.world(time, 0.02);
    const StepReport report = world.step(g.state, g.inputs);
    EXPECT_TRUE(report.ok) << named("", integrator) << ": " << report.message;
    EXPECT_GT(report.cut_steps, 0) << named("", integrator);
  }
}

TEST(FailedSteps, HalvesOfAClothAreThoseOfAFreshOne)
{
  for (const BendingModel bending : {BendingModel::hinge, BendingModel::isometric_nonconforming})
    for (const Integrator integrator : {Integrator::implicit_euler, Integrator::tr_bdf2})
    {
      ClothModel model = buildCloth("sheet", gridMesh(0.5, 0.4, 8, 0, GridPattern::alternating), 0.2,
                                    isotropicMembrane(1e5, 0.3, 1e-3));
      model.bending = bending;
      model.bending_modulus = 1e-4;
      model.stiffness_damping = 1e-3;
      const auto shared = std::make_shared<ClothModel>(model);
      ClothState start = makeClothState(model, model.rest.vertices);
      Random random(11);
      for (Eigen::Index i = 0; i < start.x.cols(); ++i)
        start.v.col(i) = random.vector(3.0);
      pinVertices(start, {0, 8});
      ClothInputs inputs;
      inputs.pins.resize(3, 2);
      inputs.pins << start.x.col(0), start.x.col(8);
      const auto make = [&](const NewtonConfig& newton, double) {
        ClothOptions options;
        options.integrator = integrator;
        options.newton = newton;
        options.linear_tolerance = 1e-6;
        return ClothStepper(shared, options);
      };
      expectHalvesLikeFresh(
          named(bending == BendingModel::hinge ? "cloth with hinges" : "isometric cloth", integrator), start, kPart,
          make, [&](ClothStepper& stepper, ClothState& state, double h) { return stepper.step(state, inputs, h); });
    }
}

TEST(FailedSteps, HalvesOfAThreadAreThoseOfAFreshOne)
{
  Random random(3);
  ThreadModel model = honey();
  model.nozzle_diameter = 0;
  model.viscosity = 2000;
  model.limits.min_edge_length = 1e-3;
  model.limits.max_edge_length = 10;
  const ThreadState start = wigglyThread(14, random);
  const auto shared = std::make_shared<ThreadModel>(model);
  const ThreadInputs inputs;
  expectHalvesLikeFresh(
      "thread", start, 16 * kPart, [&](const NewtonConfig& newton, double) { return ThreadStepper(shared, newton); },
      [&](ThreadStepper& stepper, ThreadState& state, double h) { return stepper.step(state, inputs, h); });
}

TEST(FailedSteps, RefusalsOfRodsLeaveNothing)
{
  for (const bool damped : {false, true})
    for (const Integrator integrator : allIntegrators())
    {
      const Rod rod = whip(damped);
      RodInputs spoilt = rod.inputs;
      spoilt.forces.setZero(3, 20);
      spoilt.forces.col(10) << 0, 1e300, -1e300;   // this is finite, but the accelerations overflow
      TimeConfig time = withIntegrator(integrator);
      const double h = integrator == Integrator::symplectic_euler ? 1e-5 : 2e-3;
      expectRefusalLeavesNothing<RodState, RodInputs, RodStepper>(named(damped ? "damped rod" : "rod", integrator),
                                                                  rod.state, rod.inputs, spoilt, h,
                                                                  [&] { return RodStepper(rod.model, time); });
    }
}

TEST(FailedSteps, RefusalsOfRodsWithBodiesLeaveNothing)
{
  for (const bool damped : {false, true})
    for (const Integrator integrator : allIntegrators())
    {
      Group g = tumbling(damped);
      WorldInputs spoilt = g.inputs;
      spoilt.rods[1].forces.setZero(3, 9);
      spoilt.rods[1].forces.col(5) << 0, 1e300, -1e300;
      TimeConfig time = withIntegrator(integrator);
      const double h = integrator == Integrator::symplectic_euler ? 1e-5 : 2e-3;
      g.world(time, h);   // the state gets the grasps of the welds
      expectRefusalLeavesNothing<WorldState, WorldInputs, WorldStepper>(
          named(damped ? "damped, tumbling" : "tumbling", integrator), g.state, g.inputs, spoilt, h,
          [&] { return stepperOf(g, time, h); });
    }
}

TEST(FailedSteps, RefusalsOfRodsInContactLeaveNothing)
{
  for (const Integrator integrator : {Integrator::implicit_euler, Integrator::bdf2, Integrator::tr_bdf2})
  {
    Group g = landing(1.5);
    TimeConfig time = withIntegrator(integrator);
    time.step = 2e-3;
    WorldInputs spoilt = g.inputs;
    spoilt.rods[0].forces.setZero(3, 15);
    World first = g.world(time, time.step);
    for (int k = 0; k < 4; ++k)   // the first steps end before contact begins
    {
      for (const double force : {1e9, 1e300})
      {
        spoilt.rods[0].forces.col(7) << 0, force, -force;
        expectRefusalLeavesNothing<WorldState, WorldInputs, WorldStepper>(
            named("landing", integrator), g.state, g.inputs, spoilt, time.step,
            [&] { return stepperOf(g, time, time.step); });
      }
      ASSERT_TRUE(first.step(g.state, g.inputs).ok);
    }
  }
}

TEST(FailedSteps, RefusalsOfThreadsLeaveNothing)
{
  ThreadModel model = honey();
  model.floor.present = true;
  Thread t = Thread::fromNozzle(model, {0, 0, 0.1}, 0.1);
  for (const Integrator integrator : {Integrator::implicit_euler, Integrator::symplectic_euler})
  {
    ThreadInputs spoilt = t.inputs;
    spoilt.ends[1].position.x() += 1e160;   // this is finite, but its square overflows
    const double h = integrator == Integrator::symplectic_euler ? 1e-6 : 0.01;
    const auto shared = std::make_shared<ThreadModel>(t.model);
    expectRefusalLeavesNothing<ThreadState, ThreadInputs, ThreadStepper>(
        named("thread", integrator), t.state, t.inputs, spoilt, h,
        [&] { return ThreadStepper(shared, NewtonConfig{}, integrator); });
  }
}

TEST(FailedSteps, RefusalsOfThreadsInContactLeaveNothing)
{
  ThreadWorld cross(5e-5, 2e-3);
  ThreadModel syrup = honey();
  syrup.nozzle_diameter = 0;
  syrup.surface_tension = 0.05;
  for (int k = 0; k < 2; ++k)
  {
    Eigen::Matrix3Xd x(3, 13);
    for (int i = 0; i < 13; ++i)
      x.col(i) = Eigen::Vector3d(k == 0 ? 1e-3 * (i - 6) : 0, k == 1 ? 1e-3 * (i - 6) : 0, 2.02e-3 * k);
    ThreadState thread = makeThread(x, Eigen::VectorXd::Constant(12, 1e-3));
    for (Eigen::Vector3d& v : thread.v)
      v.z() = k == 1 ? -0.02 : 0.0;
    cross.add(syrup, thread, ThreadInputs{});
  }
  WorldInputs spoilt = cross.inputs;
  spoilt.threads[1].gravity = {1e200, 0, -1e300};
  expectRefusalLeavesNothing<WorldState, WorldInputs, WorldStepper>(
      "threads in contact", cross.state, cross.inputs, spoilt, 2e-3,
      [&] { return WorldStepper{std::make_unique<World>(cross.model, cross.state)}; });
}

TEST(FailedSteps, RefusalsOfClothsLeaveNothing)
{
  for (const BendingModel bending : {BendingModel::hinge, BendingModel::isometric_nonconforming})
    for (const Integrator integrator :
         {Integrator::implicit_euler, Integrator::tr_bdf2, Integrator::imex, Integrator::symplectic_euler})
      for (const ClothSolver solver : {ClothSolver::cholesky, ClothSolver::gauss_seidel})
        for (const bool one_newton_step : {false, true})
          for (const bool touching : {false, true})
          {
            if (integrator == Integrator::imex && bending == BendingModel::hinge)
              continue;
            ClothModel model = buildCloth("sheet", gridMesh(0.3, 0.3, 6, 0, GridPattern::alternating), 0.2,
                                          isotropicMembrane(1e4, 0.3, 1e-3));
            model.bending = bending;
            model.bending_modulus = 1e-5;
            model.stiffness_damping = 1e-4;
            const auto shared = std::make_shared<ClothModel>(model);
            ClothState state = makeClothState(model, model.rest.vertices);
            pinVertices(state, {0, 6});
            ClothInputs inputs;
            inputs.pins.resize(3, 2);
            inputs.pins << state.x.col(0), state.x.col(6);
            ClothInputs spoilt = inputs;
            spoilt.pins.col(1) += Vector3d(1e155, -1e155, 1e155);   // this is finite, but its square overflows
            ClothOptions options;
            options.integrator = integrator;
            options.one_newton_step = one_newton_step;
            options.solver = solver;
            const bool is_explicit = integrator == Integrator::imex || integrator == Integrator::symplectic_euler;
            const double h = is_explicit ? 1e-4 : 5e-3;
            const std::string what =
                named(bending == BendingModel::hinge ? "cloth with hinges" : "isometric cloth", integrator) +
                ", solver " + std::to_string(static_cast<int>(solver)) + (one_newton_step ? ", one Newton step" : "") +
                (touching ? ", with contact" : "");
            if (!touching)
            {
              expectRefusalLeavesNothing<ClothState, ClothInputs, ClothStepper>(
                  what, state, inputs, spoilt, h, [&] { return ClothStepper(shared, options); });
              continue;
            }
            Group g;
            g.addCloth(shared, state, options, impulseContact(4e-3), inputs);
            g.addObstacle(Sphere{0.1}, {Vector3d(0.15, 0.15, -0.1045), Eigen::Quaterniond::Identity()});
            g.model.time.step = h;
            WorldInputs world_spoilt = g.inputs;
            world_spoilt.cloths[0] = spoilt;
            expectRefusalLeavesNothing<WorldState, WorldInputs, WorldStepper>(
                what, g.state, g.inputs, world_spoilt, h,
                [&] { return WorldStepper{std::make_unique<World>(g.model, g.state)}; });
          }
}

TEST(FailedSteps, RefusalsOfRodsWithAveragesLeaveNothing)
{
  const int n = 25;
  const Matrix3Xd nodes = straightNodes(n, 1.0);
  RodModel model = openRod(nodes, modulusSection(1e-3, 1e-3, 200.0, 0.1), true);
  model.stiffness_damping = 1e-3;
  const auto shared = std::make_shared<const RodModel>(model);
  TestFunctions functions;
  functions.names = {"first", "last"};
  functions.tracked.resize(2, n);
  for (int i = 0; i < 12; ++i)
  {
    functions.tracked.insert(0, i) = 1.0;
    functions.tracked.insert(1, 13 + i) = 1.0;
  }
  functions.guide = functions.tracked;
  const MassMatrix mass = hatMassMatrix(nodes, false);
  FunctionSet set;
  set.constraints = std::make_shared<const WeakConstraints>(functions, mass, mass);
  RodState start = makeRodState(model, nodes, Vector3d::UnitZ());
  for (int i = 0; i < n; ++i)
    start.v.col(i) = Vector3d(0, 2 * std::sin(9.0 * i), 6 * std::sin(0.5 * i));
  WorldModel world;
  world.time = withIntegrator(Integrator::implicit_euler);
  world.time.step = 5e-3;
  world.rods.emplace_back().model = shared;
  world.rods[0].tracked.sets = std::make_shared<const std::vector<FunctionSet>>(1, set);
  WorldState state;
  state.rods.push_back(start);
  state.rod_guides.resize(1);
  WorldInputs inputs;
  inputs.rods.resize(1);
  inputs.guides = {start.x};
  WorldInputs spoilt = inputs;
  spoilt.rods[0].forces.setZero(3, n);
  spoilt.rods[0].forces.col(7) << 0, 1e300, -1e300;
  expectRefusalLeavesNothing<WorldState, WorldInputs, WorldStepper>(
      "tracked rod", state, inputs, spoilt, world.time.step,
      [&] { return WorldStepper{std::make_unique<World>(world, state)}; });
}

}   // namespace
}   // namespace slender::test
