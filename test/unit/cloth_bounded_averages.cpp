// Bounds of the forces by which a cloth gets its prescribed averages.
#include <gtest/gtest.h>

#include "slender_sim/cloth/cloth_stepper.h"
#include "slender_sim/tracking/weak_constraints.h"
#include "test/support/cloths.h"
#include "test/support/groups.h"
#include "world/impulse_cloths.h"

namespace slender::test {
namespace {

/// A stiff sheet of 0.5 m that follows 4 x 4 cells of a guide.
struct Bounded
{
  TriangleMesh coarse = gridMesh(0.5, 0.5, 4, 4, GridPattern::alternating);
  Subdivision fine = subdivide(coarse, 2);
  WeakConstraints constraints{subdivisionBasis(fine), hatMassMatrix(coarse), hatMassMatrix(fine.mesh)};
  std::shared_ptr<ClothModel> model;
  ClothOptions options;
  ClothState state;
  ClothInputs inputs;

  explicit Bounded(double traction, double youngs_modulus = 2e5)
  {
    model = std::make_shared<ClothModel>(
        buildCloth("bounded", fine.mesh, 0.2, isotropicMembrane(youngs_modulus, 0.3, 5e-4)));
    model->bending = BendingModel::hinge;
    model->bending_modulus = 1e-4;
    model->stiffness_damping = 1e-3;
    model->averages = {{std::make_shared<Eigen::SparseMatrix<double, Eigen::RowMajor>>(constraints.matrix()), {}}};
    if (traction > 0)
      model->averages[0].bounds = traction * constraints.measures();
    options.one_newton_step = true;
    state = makeClothState(*model, fine.mesh.vertices);
    inputs.pins.resize(3, 0);
  }

  /// Returns a world in which the cloth follows its guide and meets a solid.
  Group beside(const Shape& solid, const Vector3d& at) const
  {
    Group g;
    g.addCloth(model, state, options, impulseContact(), inputs);
    auto sets = std::make_shared<std::vector<FunctionSet>>(1);
    sets->front().constraints = std::make_shared<WeakConstraints>(constraints);
    g.model.cloths[0].tracked.sets = sets;
    g.state.cloth_guides.resize(1);
    g.inputs.guides.resize(1);
    g.addObstacle(solid, {at, Eigen::Quaterniond::Identity()});
    return g;
  }

  Matrix3Xd stretched(double factor) const
  {
    Matrix3Xd q = coarse.vertices;
    q.row(0) *= factor;
    return q;
  }

  StepReport step(ClothStepper& stepper, const Matrix3Xd& q, double h = 0.01)
  {
    inputs.averages = constraints.averages(q);
    return stepper.step(state, inputs, h);
  }

  double greatestForce(const ClothStepper& stepper) const   // over its bound
  {
    return (stepper.averageForces().colwise().norm().transpose().array() / model->averages[0].bounds.array())
        .maxCoeff();
  }

  /// Of the averages that are met [m]; at the others the force must be that of the bound, and point at the target.
  double check(const ClothStepper& stepper) const
  {
    double met = 0.0;
    for (int i = 0; i < constraints.count(); ++i)
    {
      const double away = constraints.distance(i, inputs.averages, state.x);
      if (!std::binary_search(state.at_bound.begin(), state.at_bound.end(), i))
      {
        met = std::max(met, away);
        continue;
      }
      const Vector3d gap = inputs.averages.col(i) - state.x * Eigen::VectorXd(constraints.matrix().row(i).transpose());
      EXPECT_LT((stepper.averageForces().col(i) - model->averages[0].bounds[i] * gap.normalized()).norm(),
                0.01 * model->averages[0].bounds[i])
          << i;
    }
    return met;
  }
};

TEST(BoundedAverages, MoveAFreeBodyByTheBoundAlone)
{
  // one function over all of a sheet whose guide is far away: it falls towards it with the bound's acceleration, and
  // stays there
  const TriangleMesh coarse = gridMesh(0.5, 0.5, 4, 4, GridPattern::alternating);
  std::vector<int> all(coarse.vertices.cols());
  for (std::size_t i = 0; i < all.size(); ++i)
    all[i] = static_cast<int>(i);
  const Subdivision fine = subdivide(coarse, 1);
  const WeakConstraints one(paintedRegions({{"all", all, {}}}, fine), hatMassMatrix(coarse), hatMassMatrix(fine.mesh));
  EXPECT_NEAR(one.measures()[0], 0.25, 1e-12);
  auto model = std::make_shared<ClothModel>(buildCloth("sheet", fine.mesh, 0.2, isotropicMembrane(2e5, 0.3, 5e-4)));
  model->averages = {{std::make_shared<Eigen::SparseMatrix<double, Eigen::RowMajor>>(one.matrix()), {}}};
  model->averages[0].bounds.setConstant(1, 0.4);
  ClothOptions options;
  options.one_newton_step = true;
  options.linear_tolerance = 1e-6;
  ClothStepper stepper(model, options);
  ClothState state = makeClothState(*model, fine.mesh.vertices);
  ClothInputs inputs;
  inputs.gravity.setZero();
  const Vector3d way(0.06, 0.08, 0.0), a = 0.4 / model->totalMass() * way.normalized();
  inputs.averages = one.averages(coarse.vertices.colwise() + way);
  const double h = 0.01;
  int k = 0;
  for (; k < 8; ++k)
  {
    const StepReport report = stepper.step(state, inputs, h);
    ASSERT_TRUE(report.ok) << report.message;
    EXPECT_EQ(state.at_bound, std::vector<int>{0});
    EXPECT_LT((stepper.averageForces().col(0) - 0.4 * way.normalized()).norm(), 1e-5);
    const Vector3d moved = (state.x - fine.mesh.vertices).rowwise().mean(),
                   expected = 0.5 * h * h * (k + 1) * (k + 2) * a;
    EXPECT_LT((moved - expected).norm(), 1e-5 * expected.norm() + 1e-9) << k;   // implicit Euler's parabola
  }
  // it comes back and forth, less each time, until the force needed to hold it is less than the bound
  for (; k < 400 && !(state.at_bound.empty() && k > 300); ++k)
  {
    const StepReport report = stepper.step(state, inputs, h);
    ASSERT_TRUE(report.ok) << k << " " << report.message;
  }
  EXPECT_TRUE(state.at_bound.empty());
  EXPECT_LT(one.error(inputs.averages, state.x), 1e-14);
}

TEST(BoundedAverages, ChangeNothingWhereTheyAreNotReached)
{
  Bounded free(0.0), bounded(1e9);
  ClothStepper one(free.model, free.options), two(bounded.model, bounded.options);
  for (int k = 1; k <= 20; ++k)
  {
    Matrix3Xd q = free.coarse.vertices;
    for (Eigen::Index i = 0; i < q.cols(); ++i)
      q(2, i) += 0.0005 * k * std::sin(6 * q(0, i));
    ASSERT_TRUE(free.step(one, q).ok);
    ASSERT_TRUE(bounded.step(two, q).ok);
    // rounding errors of another factorisation
    ASSERT_LT((free.state.x - bounded.state.x).norm(), 1e-12 * free.state.x.norm()) << k;
    ASSERT_LT((free.state.v - bounded.state.v).norm(), 1e-9 * free.state.v.norm()) << k;
    EXPECT_TRUE(bounded.state.at_bound.empty());
    // what balances the end of the step, and what its linear equations had: they differ as far as these are not linear
    EXPECT_LT((one.averageForces() - two.averageForces()).norm(), 0.1 * one.averageForces().norm()) << k;
  }
}

TEST(BoundedAverages, LetTheMaterialRefuseToStretch)
{
  // a guide that stretches threefold and comes back; 200 Pa are a hundred times the weight
  double strain[2], acceleration = 0.0;
  for (const bool with : {false, true})
  {
    Bounded t(with ? 200.0 : 0.0);
    ClothStepper stepper(t.model, t.options);
    double refused = 0.0;
    std::size_t most = 0;
    strain[with] = 0.0;
    Matrix3Xd before = t.state.v;
    for (int k = 1; k <= 200; ++k)
    {
      const double s = k < 100 ? 0.5 - 0.5 * std::cos(2 * M_PI * k / 100.0) : 0.0;
      const StepReport report = t.step(stepper, t.stretched(1.0 + 2.0 * s));
      ASSERT_TRUE(report.ok) << report.message;
      ASSERT_TRUE(t.state.x.allFinite());
      strain[with] = std::max(strain[with], report.max_strain);
      most = std::max(most, t.state.at_bound.size());
      if (with)
      {
        EXPECT_LT(t.check(stepper), 1e-14) << k;
        EXPECT_LT(t.greatestForce(stepper), 1.0 + 1e-9) << k;
        acceleration = std::max(acceleration, (t.state.v - before).colwise().norm().maxCoeff() / 0.01);
        refused = std::max(refused, t.constraints.error(t.inputs.averages, t.state.x));
      }
      before = t.state.v;
    }
    EXPECT_TRUE(t.state.at_bound.empty()) << t.state.at_bound.size();
    EXPECT_LT(t.constraints.error(t.inputs.averages, t.state.x), 1e-14);
    EXPECT_EQ(most > 10, with);
    if (with)
      EXPECT_GT(refused, 0.3);   // half of the way
  }
  EXPECT_GT(strain[0], 1.9);
  EXPECT_LT(strain[1], 0.3);
  // coming back is no jolt: where the guide meets what hung behind, forces are bounded, too (200 Pa on 0.2 kg/m^2 are
  // 1000 m/s^2)
  EXPECT_LT(acceleration, 100.0);
}

TEST(BoundedAverages, AreGivenUpWhereCollisionsForbidThem)
{
  // a floor above which no average can be met: a hundred and more rounds of collisions against averages would come to
  // nothing, as sixteen do
  for (const double traction : {0.0, 20.0})
  {
    Bounded t(traction);
    Group g = t.beside(Plane{}, {0, 0, -0.01});
    g.model.time.step = 0.01;
    ImpulseCloths cloths(g.model, {0});
    for (int k = 1; k <= 20; ++k)
    {
      g.inputs.guides[0] = t.coarse.vertices.colwise() - Vector3d(0, 0, 0.002 * k);
      StepReport report;
      ASSERT_TRUE(cloths.load(g.state, g.inputs, report));
      report = *cloths.stepAlone();
      ASSERT_TRUE(report.ok) << report.message;
      cloths.finish(g.state);
      EXPECT_GT(g.state.cloths[0].x.row(2).minCoeff(), -0.01);
      EXPECT_LT(cloths.collisions().rounds, 60) << traction << " step " << k;
    }
    EXPECT_GT(t.constraints.error(t.constraints.averages(g.inputs.guides[0]), g.state.cloths[0].x), 0.029);
    EXPECT_EQ(g.state.cloths[0].at_bound.size(), traction > 0 ? 25u : 0u);
  }
}

TEST(BoundedAverages, ConvergeForStiffCloth)
{
  // as paper: membrane forces of 5e5 N/m against a traction of 500 Pa
  Matrix3Xd ends[3];
  const double tolerances[] = {5e-3, 1e-4, 1e-6};
  for (int r = 0; r < 3; ++r)
  {
    Bounded t(500.0, 1e9);
    t.options.linear_tolerance = tolerances[r];
    ClothStepper stepper(t.model, t.options);
    for (int k = 1; k <= 10; ++k)
    {
      const StepReport report = t.step(stepper, t.stretched(1.0 + 0.01 * k * k));
      ASSERT_TRUE(report.ok) << report.message;
      EXPECT_EQ(report.cut_steps, 0);
      if (r > 0)
        EXPECT_LT(t.check(stepper), 1e-13);
      EXPECT_LT(t.greatestForce(stepper), 1.0 + 1e-9);
      EXPECT_LT(report.max_strain, 1e-3);
      if (r < 2)
        EXPECT_LT(report.linear_iterations, 500) << k;
    }
    EXPECT_GT(t.state.at_bound.size(), 10u);
    ends[r] = t.state.x;
  }
  EXPECT_LT((ends[0] - ends[2]).cwiseAbs().maxCoeff(), 5e-4);   // of a guide that went 1 m
  EXPECT_LT((ends[1] - ends[2]).cwiseAbs().maxCoeff(), 5e-4);
}

TEST(BoundedAverages, RecoverFromStepsThatAreTooLong)
{
  // A step of ten seconds is cut, and what failed in it changes neither its parts nor the next step.
  Bounded t(0.5, 2e12);
  ClothStepper stepper(t.model, t.options);
  StepReport report = t.step(stepper, t.stretched(1.01), 10.0);
  EXPECT_TRUE(report.ok) << report.message;
  EXPECT_GT(report.cut_steps, 0);
  report = t.step(stepper, t.stretched(1.01), 0.01);
  EXPECT_TRUE(report.ok) << report.message;
}

TEST(BoundedAverages, SayWhenTheyDoNotConverge)
{
  Bounded t(500.0, 1e9);
  t.options.linear_tolerance = 1e-15;   // beyond rounding
  t.options.newton.max_cuts = 1;
  ClothStepper stepper(t.model, t.options);
  const StepReport report = t.step(stepper, t.stretched(2.0));
  EXPECT_FALSE(report.ok);
  EXPECT_EQ(report.failure, StepFailure::linear_unconverged);
  EXPECT_EQ(report.cut_steps, 1);
  for (const char* fix : {"shorter step", "solver.tolerance", "max_traction", "softer cloth"})
    EXPECT_NE(report.message.find(fix), std::string::npos) << report.message;
  EXPECT_TRUE(t.state.x == t.fine.mesh.vertices);
}

TEST(BoundedAverages, HoldInContactWhateverTheTolerance)
{
  for (const double tolerance : {5e-3, 0.2})
  {
    Bounded t(20.0);
    t.options.linear_tolerance = tolerance;
    Group g = t.beside(Sphere{0.1}, {0.25, 0.25, -0.11});
    World world = g.world({}, 0.01);
    int contacts = 0;
    double greatest = 0.0;
    for (int k = 1; k <= 40; ++k)
    {
      g.inputs.guides[0] = t.coarse.vertices.colwise() - Vector3d(0, 0, 0.003 * k);
      const StepReport report = world.step(g.state, g.inputs);
      ASSERT_TRUE(report.ok) << report.message;
      contacts += report.repulsions;
      const Matrix3Xd& forces = g.state.cloth_guides[0].forces;
      greatest = std::max(
          greatest, (forces.colwise().norm().transpose().array() / t.model->averages[0].bounds.array()).maxCoeff());
    }
    EXPECT_GT(greatest, 0.99) << tolerance;
    EXPECT_LT(greatest, 1.0011) << tolerance;
  }
}

TEST(BoundedAverages, TellWhatFitsNot)
{
  Bounded t(10.0);
  const auto refused = [&](const ClothOptions& options) -> std::string {
    try
    {
      ClothStepper stepper(t.model, options);
    }
    catch (const std::invalid_argument& error)
    {
      return error.what();
    }
    return "";
  };
  ClothOptions full = t.options;
  full.one_newton_step = false;
  EXPECT_NE(refused(full).find("one_newton_step: true"), std::string::npos);
  t.model->averages[0].bounds[3] = 0.0;
  EXPECT_NE(refused(t.options).find("must be positive"), std::string::npos);
  t.model->averages[0].bounds.setOnes(3);
  EXPECT_NE(refused(t.options).find("one per average"), std::string::npos);
}

TEST(BoundedAverages, DoNotDependOnWhatWasAtItsBoundBefore)
{
  // the state's list decides where to look first, not what is found
  Bounded a(200.0), b(200.0);
  a.options.linear_tolerance = b.options.linear_tolerance = 1e-6;
  ClothStepper one(a.model, a.options), two(b.model, b.options);
  for (int k = 1; k <= 10; ++k)
  {
    b.state.at_bound.clear();
    ASSERT_TRUE(a.step(one, a.stretched(1.0 + 0.02 * k)).ok);
    ASSERT_TRUE(b.step(two, b.stretched(1.0 + 0.02 * k)).ok);
    EXPECT_EQ(a.state.at_bound, b.state.at_bound) << k;
    EXPECT_LT((a.state.x - b.state.x).cwiseAbs().maxCoeff(), 1e-6) << k;
  }
  EXPECT_FALSE(a.state.at_bound.empty());
}

}   // namespace
}   // namespace slender::test
