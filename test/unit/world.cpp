// Islands of a world: a part that touches nothing is stepped as on its own, and a step that fails in one island leaves
// all others where they were.
#include "slender_sim/world/world.h"

#include <limits>

#include <gtest/gtest.h>

#include "slender_sim/geometry/mesh_shapes.h"
#include "slender_sim/scene/reader.h"
#include "slender_sim/scene/simulation.h"
#include "slender_sim/scene/state_bytes.h"
#include "test/support/rods.h"

namespace slender::test {
namespace {

constexpr double kWorldStep = 0.005;   // [s]

/// A rod that is held at one end and, unless `alone`, a cloth that falls beside it.
WorldModel model(const Rod& rod, bool alone)
{
  WorldModel world;
  world.time.step = kWorldStep;
  world.rods.push_back({rod.model, std::nullopt, {}});
  if (!alone)
  {
    WorldModel::Cloth cloth;
    cloth.model = std::make_shared<ClothModel>(
        buildCloth("c", gridMesh(0.2, 0.2, 4, 4, GridPattern::alternating), 0.2, isotropicMembrane(1e4, 0.3, 1e-3)));
    world.cloths.push_back(cloth);
  }
  return world;
}

struct Course
{
  explicit Course(const Rod& rod, bool alone) : world(model(rod, alone), start(rod, alone))
  {
    inputs.rods = {rod.inputs};
    inputs.cloths.resize(alone ? 0 : 1);
  }
  WorldState& start(const Rod& rod, bool alone)
  {
    state.rods = {rod.state};
    if (!alone)
      state.cloths = {makeClothState(*model(rod, alone).cloths[0].model,
                                     gridMesh(0.2, 0.2, 4, 4, GridPattern::alternating).vertices)};
    return state;
  }
  WorldState state;
  WorldInputs inputs;
  World world;
};

TEST(World, TakesContactWithIntegratorsThatDampStiffForces)
{
  const Rod rod = straightRod(20, 1.0, roundSection(0.005, 1e6, 1000));
  WorldModel world = model(rod, true);
  world.rods[0].contact = ContactProperties{};
  world.contact.gap = 1e-3;
  WorldState state;
  state.rods = {rod.state};
  for (const Integrator taken : {Integrator::implicit_euler, Integrator::bdf2, Integrator::tr_bdf2})
  {
    world.time.integrator = taken;
    EXPECT_NO_THROW(World(world, state));
  }
  for (const Integrator refused :
       {Integrator::symplectic_euler, Integrator::implicit_midpoint, Integrator::generalized_alpha})
  {
    world.time.integrator = refused;
    EXPECT_THROW(World(world, state), std::invalid_argument);
  }
}

TEST(World, ARodOnItsOwnMovesAsWithoutAWorld)
{
  Rod rod = straightRod(20, 1.0, roundSection(0.005, 1e6, 1000));
  rod.hold(0, 1);
  Course alone(rod, true), beside(rod, false);
  TimeConfig time;
  time.step = kWorldStep;
  RodStepper stepper(rod.model, time);
  for (int k = 0; k < 10; ++k)
  {
    ASSERT_TRUE(stepper.step(rod.state, rod.inputs, kWorldStep).ok);
    for (Course* run : {&alone, &beside})
    {
      ASSERT_TRUE(run->world.step(run->state, run->inputs).ok);
      ASSERT_TRUE(run->state.rods[0].x == rod.state.x && run->state.rods[0].v == rod.state.v) << k;
      ASSERT_TRUE(run->world.rodWrenches(0)[0].force == stepper.wrenches()[0].force);
    }
  }
  EXPECT_EQ(alone.state.steps, 10u);
  EXPECT_DOUBLE_EQ(alone.state.time, 10 * kWorldStep);
  EXPECT_LT(beside.state.cloths[0].x.row(2).maxCoeff(), -1e-3);   // it falls
}

TEST(World, NamesThePartThatIsNotValid)
{
  Rod rod = straightRod(20, 1.0, roundSection(0.005, 1e6, 1000));
  WorldModel world = model(rod, false);
  world.cloths[0].options.linear_tolerance = -1;
  WorldState state;
  state.rods = {rod.state};
  state.cloths.resize(1);
  try
  {
    World built(world, state);
    FAIL() << "a negative tolerance was accepted";
  }
  catch (const WorldError& error)
  {
    EXPECT_EQ(error.kind, FailurePlace::Kind::cloth);
    EXPECT_EQ(error.index, 0);
  }
}

/// A thread and a cloth are stepped before the rods, and rods with contact after those without.
constexpr const char* kManyKinds = R"(
time: {step: 0.005}
rods:
  - {name: a, centerline: {straight: {to: [1, 0, 0], edges: 10}}, grasps: {left: {edges: [0]}}}
  - {name: b, centerline: {straight: {from: [0, 1, 0], to: [1, 1, 0], edges: 10}}, grasps: {right: {edges: [0]}}}
  - {name: c, centerline: {straight: {from: [0, 2, 0], to: [1, 2, 0], edges: 10}}, grasps: {last: {edges: [0]}}, contact: {}}
cloths:
  - {name: d, grid: {corner: [0, 3, 0], sides: [[0.2, 0, 0], [0, 0.2, 0]], cells: [4, 4]}, material: {density: 500, thickness: 0.0004, youngs_modulus: 2.0e5}}
)";

TEST(World, AFailureInOneIslandLeavesAllAsTheyWere)
{
  for (const int failing : {1, 2})
  {
    Simulation simulation(parseScene(kManyKinds));
    for (int k = 0; k < 3; ++k)
      ASSERT_TRUE(simulation.step(simulation.defaultInputs()).ok);
    const std::string before = stateBytes(simulation.state());
    SceneInputs inputs = simulation.defaultInputs();
    inputs.grasps[failing].X_WG.position.x() = std::numeric_limits<double>::quiet_NaN();
    EXPECT_FALSE(simulation.step(inputs).ok);
    EXPECT_TRUE(stateBytes(simulation.state()) == before) << failing;
    EXPECT_TRUE(simulation.step(simulation.defaultInputs()).ok);
    EXPECT_FALSE(stateBytes(simulation.state()) == before);
  }
}

}   // namespace
}   // namespace slender::test
