// A warm step takes no memory from the heap: malloc and its kin are counted, so Eigen's and operator new's requests
// both show.
#include <cstddef>
#include <string>
#include <vector>

#include <gtest/gtest.h>

#include "slender_sim/fairing/willmore_flow.h"
#include "slender_sim/geometry/mesh_shapes.h"
#include "slender_sim/linalg/banded_ldlt.h"
#include "slender_sim/scene/reader.h"
#include "slender_sim/scene/simulation.h"
#include "test/support/allocations.h"
#include "test/support/groups.h"
#include "test/support/rods.h"
#include "test/support/sheets.h"
#include "test/support/threads.h"

#ifdef SLENDER_COUNTS_ALLOCATIONS
std::atomic<long> slender::test::allocations{0};
using slender::test::allocations;
extern "C" {
void* __libc_malloc(std::size_t);
void* __libc_calloc(std::size_t, std::size_t);
void* __libc_realloc(void*, std::size_t);
void* __libc_memalign(std::size_t, std::size_t);
void* malloc(std::size_t n)
{
  ++allocations;
  return __libc_malloc(n);
}
void* calloc(std::size_t n, std::size_t size)
{
  ++allocations;
  return __libc_calloc(n, size);
}
void* realloc(void* p, std::size_t n)
{
  ++allocations;
  return __libc_realloc(p, n);
}
void* memalign(std::size_t alignment, std::size_t n)
{
  ++allocations;
  return __libc_memalign(alignment, n);
}
void* aligned_alloc(std::size_t alignment, std::size_t n)
{
  ++allocations;
  return __libc_memalign(alignment, n);
}
int posix_memalign(void** p, std::size_t alignment, std::size_t n)
{
  ++allocations;
  *p = __libc_memalign(alignment, n);
  return *p ? 0 : 12;
}
}
#endif

namespace slender::test {
namespace {

#ifdef SLENDER_COUNTS_ALLOCATIONS

TEST(Allocations, AreCounted)
{
  const long before = allocations;
  ::operator delete(::operator new(8));
  Eigen::VectorXd v(100);
  v.setZero();
  AlignedVector<double> aligned(8, v[0]);
  EXPECT_EQ(allocations - before, 3);
}

class Allocations : public ::testing::TestWithParam<Integrator>
{};

TEST_P(Allocations, AWarmStepMakesNone)
{
  for (bool closed : {false, true})
    for (bool viscous : {false, true})
      for (double tolerance : {0.0, 1e-5})
      {
        const int n = 30;
        const Matrix3Xd nodes = closed ? ringNodes(n, 0.2) : straightNodes(n, 1.0);
        RodModel model =
            buildRod("r", nodes, closed, uniformSections(roundSection(0.005, 1e6, 1000), closed ? n : n - 1),
                     Vector3d::Zero(), false);
        model.stiffness_damping = viscous ? 1e-4 : 0.0;
        model.mass_damping = 0.1;
        Rod rod(model, nodes);
        rod.hold(0, 1);
        rod.hold(15, 15, false);
        TimeConfig time = withIntegrator(GetParam());
        time.error_tolerance = tolerance;
        RodStepper stepper(rod.model, time);
        const double h = GetParam() == Integrator::symplectic_euler ? 1e-5 : 2e-3;
        const auto advance = [&] {
          rod.inputs.grasps[0].X_WG.position.z() += 0.1 * h;
          return stepper.step(rod.state, rod.inputs, h).ok;
        };
        for (int k = 0; k < 20; ++k)
          ASSERT_TRUE(advance());
        const long before = allocations;
        bool ok = true;
        for (int k = 0; k < 20; ++k)
          ok = advance() && ok;
        EXPECT_EQ(allocations - before, 0)
            << (closed ? "closed" : "open") << (viscous ? " viscous" : "") << " tolerance " << tolerance;
        EXPECT_TRUE(ok);
      }
}

TEST(Allocations, WarmProjectedStepsMakeNone)
{
  for (int kind = 0; kind < 3; ++kind)
  {
    const bool isotropic = kind > 0, framed = kind < 2;
    const int n = 40;
    Rod rod = straightRod(n, 1.0, roundSection(0.005, 1e6, 1000));
    rod.model->isotropic = isotropic;
    rod.model->inextensible = true;
    rod.inputs.gravity << 0, 0, -9.81;
    if (!framed)
      rod.state = makeRodState(*rod.model, straightNodes(n, 1.0), Vector3d::Zero());
    rod.hold(0, framed ? 1 : 0, framed);
    RodStepper stepper(rod.model, withIntegrator(Integrator::symplectic_euler));
    const auto advance = [&] {
      rod.inputs.grasps[0].X_WG.position.x() += 1e-5;
      return stepper.step(rod.state, rod.inputs, 1e-4).ok;
    };
    for (int k = 0; k < 20; ++k)
      ASSERT_TRUE(advance());
    const long before = allocations;
    bool ok = true;
    for (int k = 0; k < 20; ++k)
      ok = advance() && ok;
    EXPECT_EQ(allocations - before, 0) << kind;
    EXPECT_TRUE(ok);
    EXPECT_EQ(rod.state.framed(), framed);
  }
}

TEST(Allocations, WarmStepsOfABodyMakeNone)
{
  for (const Integrator integrator : {Integrator::implicit_euler, Integrator::tr_bdf2})
  {
    Group g;
    g.addBody(bodyOf(1.0, {1, 2, 3}), {}, {{0, 0, 1}, {1, 20, 3}});
    g.setGravity(Vector3d::Zero());
    World world = g.world(withIntegrator(integrator), 2e-3);
    const auto advance = [&] { return world.step(g.state, g.inputs).ok; };
    for (int k = 0; k < 20; ++k)
      ASSERT_TRUE(advance());
    const long before = allocations;
    bool ok = true;
    for (int k = 0; k < 20; ++k)
      ok = advance() && ok;
    EXPECT_EQ(allocations - before, 0) << toString(integrator);
    EXPECT_TRUE(ok);
  }
}

TEST(Allocations, WarmProjectedStepsWithBodiesMakeNone)
{
  Group g = tee();
  for (WorldModel::Rod& rod : g.model.rods)
  {
    auto changed = std::make_shared<RodModel>(*rod.model);
    changed->isotropic = changed->inextensible = true;
    rod.model = changed;
  }
  World world = g.world(withIntegrator(Integrator::symplectic_euler), 2e-5);
  const auto advance = [&] { return world.step(g.state, g.inputs).ok; };
  for (int k = 0; k < 20; ++k)
    ASSERT_TRUE(advance());
  const long before = allocations;
  bool ok = true;
  for (int k = 0; k < 20; ++k)
    ok = advance() && ok;
  EXPECT_EQ(allocations - before, 0);
  EXPECT_TRUE(ok);
}

/// A scene's rod that tracks a guide.
TEST(TrackedRodAllocations, AWarmStepMakesNone)
{
  for (const char* functions : {"{basis: hats}", "{segments: 4}"})
  {
    Simulation simulation(
        parseScene(std::string("time: {step: 0.005}\nrods: [{centerline: {straight: {edges: 60}}, damping: {stiffness: "
                               "0.001}, grasps: {end: {edges: [0]}}, "
                               "track: {guide: {nodes: 8, motion: {topic: points}}, test_functions: ") +
                       functions + "}}]",
                   "t"));
    SceneInputs inputs;
    bool ok = true;
    const auto advance = [&] {
      simulation.defaultInputs(inputs);
      inputs.guides[0].row(1).array() += 1e-3;
      ok = simulation.step(inputs).ok && ok;
    };
    for (int k = 0; k < 20; ++k)
      advance();
    const long before = allocations;
    for (int k = 0; k < 20; ++k)
      advance();
    EXPECT_EQ(allocations - before, 0) << functions;
    EXPECT_TRUE(ok);
  }
}

/// Of several islands the state is kept until all have made their step.
TEST(SceneAllocations, AWarmStepOfSeveralIslandsMakesNone)
{
  Simulation simulation(parseScene(R"(
rods: [{name: a, grasps: {end: {edges: [0]}}}, {name: b, centerline: {straight: {from: [0, 1, 0], to: [1, 1, 0]}}}]
cloths:
  - grid: {corner: [0, 3, 0], sides: [[0.2, 0, 0], [0, 0.2, 0]], cells: [4, 4]}
    material: {density: 500, thickness: 0.0004, youngs_modulus: 2.0e5}
    grasps: {held: {vertices: [0, 4]}}
)",
                                   "t"));
  SceneInputs inputs;
  long before = 0;
  for (int k = 0; k < 40; ++k)
  {
    before = k == 20 ? allocations.load() : before;
    simulation.defaultInputs(inputs);
    ASSERT_TRUE(simulation.step(inputs).ok);
  }
  EXPECT_EQ(allocations - before, 0);
}

TEST(ThreadAllocations, AWarmStepMakesNone)
{
  ThreadModel model = honey();
  model.viscosity = 100;
  model.surface_tension = 0.05;
  model.floor.present = true;
  model.feed_length = 0.004;
  model.limits.max_edge_length = 0.008;
  model.limits.min_edge_length = 0.001;
  model.limits.max_deposited = 30;
  Thread t = Thread::fromNozzle(model, {0, 0, 0.1}, 0.1);
  t.state.x[0].x() += 2e-4;
  ThreadStepper stepper = t.stepper();
  // edges are fed, divided and dropped all the time
  for (int k = 0; k < 1000; ++k)
    ASSERT_TRUE(stepper.step(t.state, t.inputs, 0.004).ok);
  const std::uint64_t fed = t.state.next_id;
  const long before = allocations;
  bool ok = true;
  for (int k = 0; k < 200; ++k)
    ok = stepper.step(t.state, t.inputs, 0.004).ok && ok;
  EXPECT_EQ(allocations - before, 0);
  EXPECT_TRUE(ok);
  EXPECT_GT(t.state.next_id, fed + 10);
}

struct ClothCase
{
  BendingModel bending;
  Integrator integrator;
  ClothSolver solver;
  bool one_newton_step;
  double error_tolerance;   // [m]

  bool isExplicit() const { return integrator == Integrator::symplectic_euler || integrator == Integrator::imex; }
  double step() const { return isExplicit() ? 1e-5 : 5e-3; }
  ClothOptions options() const
  {
    ClothOptions options;
    options.integrator = integrator;
    options.one_newton_step = one_newton_step;
    options.solver = solver;
    options.error_tolerance = error_tolerance;
    return options;
  }
  std::shared_ptr<const ClothModel> model() const
  {
    auto model = std::make_shared<ClothModel>(buildCloth("c", gridMesh(0.5, 0.5, 8, 8, GridPattern::alternating), 0.2,
                                                         isotropicMembrane(isExplicit() ? 1e6 : 1e4, 0.3, 1e-3)));
    model->bending = bending;
    model->bending_modulus = 1e-4;
    model->stiffness_damping = 1e-4;
    model->wind_coefficient = 0.5;
    model->aerodynamics = {1.2, 1.0, 0.5};
    if (bending == BendingModel::hinge)
      model->plasticity = {1e-6, 0.1, 0.01};
    return model;
  }
};

std::vector<ClothCase> clothCases()
{
  std::vector<ClothCase> cases;
  for (const BendingModel bending : {BendingModel::hinge, BendingModel::isometric_nonconforming})
  {
    for (const Integrator integrator : {Integrator::implicit_euler, Integrator::tr_bdf2})
      for (const ClothSolver solver : {ClothSolver::gauss_seidel, ClothSolver::cholesky})
        for (const bool one_newton_step : {true, false})
          for (const double tolerance : {0.0, 1e-4})
            cases.push_back({bending, integrator, solver, one_newton_step, tolerance});
    for (const Integrator integrator : {Integrator::imex, Integrator::symplectic_euler})
      if (integrator != Integrator::imex || bending != BendingModel::hinge)
        cases.push_back({bending, integrator, ClothSolver::gauss_seidel, true, 0.0});
  }
  return cases;
}

class ClothAllocations : public ::testing::TestWithParam<ClothCase>
{
protected:
  template <class Advance>
  void expectNone(const Advance& advance, int warm_up)
  {
    for (int k = 0; k < warm_up; ++k)
      ASSERT_TRUE(advance());
    const long before = allocations;
    bool ok = true;
    for (int k = 0; k < 5; ++k)
      ok = advance() && ok;
    EXPECT_EQ(allocations - before, 0);
    EXPECT_TRUE(ok);
  }
};

TEST_P(ClothAllocations, AWarmStepMakesNone)
{
  const auto model = GetParam().model();
  ClothState state = makeClothState(*model, model->rest.vertices);
  pinVertices(state, {0, 8});
  ClothInputs inputs;
  inputs.wind << 1, 2, 3;
  inputs.pins.resize(3, 2);
  inputs.pins.col(0) = state.x.col(0);
  inputs.pins.col(1) = state.x.col(8);
  ClothStepper stepper(model, GetParam().options());
  const double h = GetParam().step();
  const auto advance = [&] {
    inputs.pins(2, 0) += 0.1 * h;
    return stepper.step(state, inputs, h).ok;
  };
  expectNone(advance, 5);
}

/// On a ball: with collisions, and the second solve that touching cloth needs. Lists of contacts grow until they were
/// once as long as they get.
TEST_P(ClothAllocations, AWarmStepInContactMakesNone)
{
  const auto model = GetParam().model();
  ClothState state = makeClothState(*model, model->rest.vertices);
  pinVertices(state, {0, 8});
  if (GetParam().isExplicit())   // whose few short steps would not get there
    state.v.row(2).setConstant(-5.0);
  ClothInputs inputs;
  inputs.pins.resize(3, 2);
  inputs.pins << state.x.col(0), state.x.col(8);
  Group g;
  g.addCloth(model, state, GetParam().options(), impulseContact(), inputs);
  g.addObstacle(Sphere{0.05}, {state.x.rowwise().mean() - Vector3d(0, 0, 0.0506), Eigen::Quaterniond::Identity()});
  World world = g.world({}, GetParam().step());
  StepReport report;
  expectNone(
      [&] {
        report = world.step(g.state, g.inputs);
        return report.ok;
      },
      20);
  EXPECT_GT(report.repulsions + report.impulses, 0);
}

/// Rows of `parts` averages over as many equal runs of the model's vertices.
PrescribedAverages averagesOver(const ClothModel& model, int parts)
{
  auto weights = std::make_shared<Eigen::SparseMatrix<double, Eigen::RowMajor>>(parts, model.vertices());
  const int each = model.vertices() / parts;
  for (int i = 0; i < each * parts; ++i)
    weights->insert(i / each, i) = 1.0 / each;
  return {weights, {}};
}

/// Prescribed averages, with bounds and without, before and after another set of them took over.
TEST(AverageAllocations, AWarmStepMakesNone)
{
  for (const bool one_newton_step : {true, false})
    for (const bool bounded : {true, false})
      for (const bool touching : {true, false})
      {
        if (bounded && !one_newton_step)
          continue;
        auto model = std::make_shared<ClothModel>(
            *ClothCase{BendingModel::hinge, Integrator::implicit_euler, ClothSolver::gauss_seidel, one_newton_step, 0.0}
                 .model());
        model->averages = {averagesOver(*model, 2), averagesOver(*model, 9)};
        for (PrescribedAverages& set : model->averages)
          if (bounded)
            set.bounds.setConstant(set.count(), 0.4 / set.count());   // less than the cloth's weight
        ClothOptions options;
        options.one_newton_step = one_newton_step;
        Group g;
        g.addCloth(model, makeClothState(*model, model->rest.vertices), options);
        World world = g.world({}, 5e-3);
        ClothStepper stepper(model, options);
        ClothInputs& follow = g.inputs.cloths[0];
        ClothState& cloth = g.state.cloths[0];
        for (const int set : {0, 1, 0})
        {
          cloth.average_set = set;
          cloth.at_bound.clear();
          follow.averages = cloth.x * model->averages[static_cast<std::size_t>(set)].weights->transpose();
          bool ok = true;
          const auto advance = [&] {
            follow.averages.row(0).array() += 1e-4;
            ok = (touching ? world.step(g.state, g.inputs).ok : stepper.step(cloth, follow, 5e-3).ok) && ok;
          };
          for (int k = 0; k < 10; ++k)
            advance();
          const long before = allocations;
          for (int k = 0; k < 5; ++k)
            advance();
          EXPECT_EQ(allocations - before, 0) << one_newton_step << bounded << touching << " set " << set;
          EXPECT_TRUE(ok);
          EXPECT_EQ(cloth.at_bound.size() > 0, bounded);
        }
      }
}

INSTANTIATE_TEST_SUITE_P(Cases, ClothAllocations, ::testing::ValuesIn(clothCases()), [](const auto& info) {
  const ClothCase& c = info.param;
  return std::string(toString(c.bending)) + "_" + toString(c.integrator) +
         (c.solver == ClothSolver::cholesky ? "_cholesky" : "_sweeps") + (c.one_newton_step ? "_one" : "_full") +
         (c.error_tolerance > 0 ? "_controlled" : "");
});

/// With what the scene does about guides: inputs, targets, errors.
TEST(SceneAllocations, WarmTrackedScenesMakeNone)
{
  const std::string scene = R"(
time: {step: 0.01, duration: 8}
tracked:
  - guide: {grid: {corner: [-0.2, -0.2, 1], sides: [[0.4, 0, 0], [0, 0.4, 0]], cells: 3}, motion: {topic: points}}
    mesh: {subdivide: 2}
    material: {area_density: 0.12, thickness: 0.0003, youngs_modulus: 2.0e4, poissons_ratio: 0.3}
    solver: {one_newton_step: true}
)";
  for (const char* more :
       {"", "    test_functions: [{name: a, basis: subdivision}, {name: b, regions: {all: {guide: [0..15]}}}]\n",
        "    contact: {friction: 0.2}\n"})
  {
    Simulation simulation(parseScene(scene + more));
    ASSERT_TRUE(simulation.config().cloths[0].tracking);
    SceneInputs inputs;
    bool ok = true;
    const auto advance = [&] {
      simulation.defaultInputs(inputs);
      inputs.guides[0].row(0).array() += 1e-4;
      ok = simulation.step(inputs).ok && ok;
    };
    for (int k = 0; k < 20; ++k)
      advance();
    const long before = allocations;
    for (int k = 0; k < 5; ++k)
      advance();
    EXPECT_EQ(allocations - before, 0) << more;
    EXPECT_TRUE(ok);
  }
}

TEST(CollisionAllocations, WarmStepsMakeNone)
{
  Sheets s;
  s.gravity = {0, 0, -9.81};
  for (int k = 0; k < 3; ++k)
    s.add(6, 6, {0.01 * k, 0.02 * k, 0.003 + 0.005 * k}, {0.3, 0, 0}, {0, 0.3, 0});
  s.addSolid(Plane{});
  s.addSolid(Capsule{0.01, 0.5}, {{0.1, 0.1, -0.26}, Eigen::Quaterniond::Identity()});
  SurfaceCollider collider(s.surface);
  const CollisionStep step{s.x, s.inverse_mass, s.solids, s.solids, 0.01};
  Matrix3Xd x, v;
  CollisionReport report;
  const auto collide = [&](const Matrix3Xd& candidate) {
    x = candidate;
    v = (x - s.x) / step.h;
    report = collider.resolve(step, x, v);
  };
  Matrix3Xd fast = s.candidate(0.01);
  fast.row(2).array() -= 0.05;
  for (int k = 0; k < 3; ++k)
    collide(fast);
  const long before = allocations;
  collide(fast);
  EXPECT_EQ(allocations - before, 0);
  EXPECT_TRUE(report.ok);
  EXPECT_GT(report.impulses, 20);
}

TEST(WillmoreAllocations, AWarmStepMakesNone)
{
  TriangleMesh mesh = icosphere(1.0, 3);
  for (Eigen::Index v = 0; v < mesh.vertices.cols(); ++v)
    mesh.vertices.col(v) *= 1.0 + 0.01 * (v % 5);
  WillmoreFlow flow(mesh, meshTopology(mesh), 1e-3, 5);
  flow.step(mesh.vertices);
  const long before = allocations;
  const FairingReport report = flow.step(mesh.vertices);
  EXPECT_EQ(allocations - before, 0);
  EXPECT_TRUE(report.ok);
  EXPECT_GT(report.iterations, 1);
}

INSTANTIATE_TEST_SUITE_P(Integrators, Allocations, ::testing::ValuesIn(allIntegrators()),
                         [](const auto& info) { return toString(info.param); });

#endif

}   // namespace
}   // namespace slender::test
