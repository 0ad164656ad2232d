#include "slender_sim/cloth/plastic_flow.h"

#include <gtest/gtest.h>

#include "test/support/cloths.h"
#include "test/support/groups.h"

namespace slender::test {
namespace {

constexpr double kYield = 2.0;   // [1/m]

/// Equilateral triangles with edges along x.
ClothModel plasticStrip(const Plasticity& plasticity, int cells = 4)
{
  ClothModel model = buildCloth("strip", gridMesh(0.1, 0.3, cells, 0, GridPattern::equilateral), 0.2,
                                isotropicMembrane(1e6, 0.3, 1e-3));
  model.bending = BendingModel::hinge;
  model.bending_modulus = 1e-3;
  model.plasticity = plasticity;
  return model;
}

/// Rolled about x onto a cylinder.
Matrix3Xd rolled(const ClothModel& model, double radius)
{
  Matrix3Xd x = model.rest.vertices;
  for (Eigen::Index i = 0; i < x.cols(); ++i)
  {
    const double angle = x(1, i) / radius;
    x.col(i) << x(0, i), radius * std::sin(angle), radius * (1 - std::cos(angle));
  }
  return x;
}

VectorXd anglesOf(const ClothModel& model, const Matrix3Xd& x)
{
  const VectorXd none = VectorXd::Zero(model.topology.hingeCount());
  const HingeTerm hinges(model.topology.hinges, none, none);
  VectorXd angles(hinges.paddedCount());
  hinges.angles(pointsOf(x).data(), angles.data());
  return angles.head(hinges.count());
}

/// 2A / e of the thesis.
VectorXd widthsOf(const ClothModel& model)
{
  VectorXd widths(model.topology.hingeCount());
  const VectorXd areas = faceAreas(model.rest);
  for (int h = 0; h < widths.size(); ++h)
  {
    const int edge = model.topology.hinge_edges[h];
    widths[h] = 2 * (areas[model.topology.edge_faces(0, edge)] + areas[model.topology.edge_faces(1, edge)]) /
                (model.rest.vertices.col(model.topology.edges(0, edge)) -
                 model.rest.vertices.col(model.topology.edges(1, edge)))
                    .norm();
  }
  return widths;
}

/// Hinges across which a cylinder about x bends.
std::vector<int> creases(const ClothModel& model)
{
  std::vector<int> found;
  for (int h = 0; h < model.topology.hingeCount(); ++h)
    if (std::abs(model.rest.vertices(1, model.topology.hinges(0, h)) -
                 model.rest.vertices(1, model.topology.hinges(1, h))) < 1e-9)
      found.push_back(h);
  return found;
}

/// Holds the whole strip on cylinders of rising curvature, then once more.
void roll(ClothStepper& stepper, ClothState& state, double curvature, int steps, double h = 0.01)
{
  std::vector<int> all(state.x.cols());
  for (std::size_t i = 0; i < all.size(); ++i)
    all[i] = static_cast<int>(i);
  pinVertices(state, all);
  ClothInputs inputs;
  for (int k = 1; k <= steps + 1; ++k)
  {
    inputs.pins = rolled(stepper.model(), 1.0 / (curvature * std::min(k, steps) / steps));
    const StepReport report = stepper.step(state, inputs, h);
    ASSERT_TRUE(report.ok) << report.message;
  }
  state.pins.clear();
}

TEST(ClothPlasticity, AReleasedStripKeepsTheResidualCurvature)
{
  for (const int cells : {3, 6})
  {
    auto model = std::make_shared<ClothModel>(plasticStrip({kYield, 0.0, 0.0}, cells));
    model->stiffness_damping = 0.3;   // it creeps back: waves would bend it beyond the yield again
    ClothState state = makeClothState(*model, model->rest.vertices);
    ClothOptions exact;
    exact.linear_tolerance = 1e-9;
    ClothStepper stepper(model, exact);
    const double curvature = 1.0 / 0.08;
    roll(stepper, state, curvature, 10);
    const VectorXd bent = anglesOf(*model, state.x), width = widthsOf(*model);
    for (const int h : creases(*model))
      EXPECT_NEAR(state.rest_angles[h], bent[h] - std::copysign(kYield * width[h], bent[h]), 1e-12);
    ClothInputs free;
    free.gravity.setZero();
    for (int k = 0; k < 300; ++k)
    {
      const StepReport report = stepper.step(state, free, 0.02);
      ASSERT_TRUE(report.ok) << report.message;
    }
    // Mean curvature 1/(2R) springs back by the yield curvature. Between creases lies a height A/e of the mesh.
    const VectorXd released = anglesOf(*model, state.x);
    double worst = 0.0;
    for (const int h : creases(*model))
      worst = std::max(worst, std::abs(std::abs(released[h]) / (0.5 * width[h]) - (curvature - 2 * kYield)));
    EXPECT_LT(worst, 1e-6 * curvature) << cells;
    EXPECT_LT(stepper.energies(state, Vector3d::Zero()).total(), 1e-15);
  }
}

TEST(ClothPlasticity, BelowTheYieldNothingFlows)
{
  const auto run = [](const Plasticity& plasticity) {
    auto model = std::make_shared<ClothModel>(plasticStrip(plasticity));
    ClothState state = makeClothState(*model, model->rest.vertices);
    ClothStepper stepper(model, {});
    roll(stepper, state, 0.8 * kYield, 5);   // mean curvature 0.4 of the yield, and waves when it is let go
    ClothInputs free;
    for (int k = 0; k < 10; ++k)
      EXPECT_TRUE(stepper.step(state, free, 0.01).ok);
    return state;
  };
  const ClothState elastic = run({}), plastic = run({kYield, 0.1, 0.0});
  EXPECT_EQ(elastic.x, plastic.x);
  EXPECT_EQ(elastic.v, plastic.v);
  EXPECT_EQ(elastic.rest_angles, plastic.rest_angles);
  EXPECT_EQ(plastic.stiffening, VectorXd::Ones(plastic.rest_angles.size()));
  EXPECT_EQ(elastic.stiffening.size(), 0);
}

/// Stiffness grows with the curvature that flowed, in however many steps.
TEST(ClothPlasticity, HardensAndSoftens)
{
  for (const double hardening : {0.3, -0.3})
    for (const int steps : {5, 40})
    {
      auto model = std::make_shared<ClothModel>(plasticStrip({kYield, hardening, 0.0}));
      ClothState state = makeClothState(*model, model->rest.vertices);
      ClothStepper stepper(model, {});
      roll(stepper, state, 12.0, steps);
      const VectorXd bent = anglesOf(*model, state.x), width = widthsOf(*model);
      double work = 0.0;
      for (const int h : creases(*model))
      {
        const double flowed = std::abs(bent[h]) / width[h] - kYield;
        EXPECT_NEAR(state.stiffening[h], std::exp(hardening * flowed), 1e-9);
        work += 0.5 *
                hingeStiffness(
                    model->rest, model->topology,
                    model->bending_modulus * bendingCalibration(model->rest, model->topology,
                                                                IsometricElement::nonconforming, model->warp))[h] *
                state.stiffening[h] * std::pow(kYield * width[h], 2);
      }
      // energies know the stiffening
      EXPECT_NEAR(stepper.energies(state, Vector3d::Zero()).bending, work, 1e-6 * work);
    }
}

/// Mean curvature yields where edges lie along the axis; across them hinges carry two thirds of that, for small
/// triangles.
TEST(ClothPlasticity, YieldDependsOnTheMeshsDirection)
{
  const ClothModel model = plasticStrip({kYield, 0.0, 0.0}, 24);
  PlasticFlow plastic(model);
  const auto flows = [&](bool along_x, double mean_curvature) {
    ClothState state = makeClothState(model, model.rest.vertices);
    const double radius = 0.5 / mean_curvature;
    const int axis = along_x ? 1 : 0;
    for (Eigen::Index i = 0; i < state.x.cols(); ++i)
    {
      const double angle = state.x(axis, i) / radius;
      state.x(axis, i) = radius * std::sin(angle);
      state.x(2, i) = radius * (1 - std::cos(angle));
    }
    plastic.flow(state, 0.01);
    return state.rest_angles.cwiseAbs().maxCoeff() > 0;
  };
  EXPECT_FALSE(flows(true, 0.99 * kYield));
  EXPECT_TRUE(flows(true, 1.01 * kYield));
  EXPECT_FALSE(flows(false, 0.98 * 1.5 * kYield));
  EXPECT_TRUE(flows(false, 1.02 * 1.5 * kYield));
}

TEST(ClothPlasticity, CreepsAtItsRateWhateverTheSteps)
{
  const Plasticity law{kYield, 0.1, 0.4};
  const ClothModel model = plasticStrip(law);
  PlasticFlow plastic(model);
  const Matrix3Xd x = rolled(model, 0.08);
  const VectorXd bent = anglesOf(model, x), width = widthsOf(model);
  for (const int steps : {1, 7, 200})
  {
    ClothState state = makeClothState(model, model.rest.vertices);
    state.x = x;
    for (int k = 0; k < steps; ++k)
      plastic.flow(state, 0.3 / steps);
    for (const int h : creases(model))
    {
      const double flowed = (1 - std::exp(-0.3 / law.creep_time)) * (std::abs(bent[h]) / width[h] - kYield);
      EXPECT_NEAR(state.rest_angles[h], std::copysign(flowed * width[h], bent[h]), 1e-12);
      EXPECT_NEAR(state.stiffening[h], std::exp(law.hardening * flowed), 1e-12);
    }
  }
}

/// Whatever the shape and the law, flow takes energy out, and stays within bounds.
TEST(ClothPlasticity, FlowOnlyTakesEnergy)
{
  Random random(3);
  for (const double hardening : {-5.0, 0.0, 0.5, 100.0})
    for (const double yield : {0.0, kYield})
      for (const double creep_time : {0.0, 0.05})
      {
        auto model = std::make_shared<ClothModel>(plasticStrip({yield, hardening, creep_time}));
        ClothState state = makeClothState(*model, model->rest.vertices);
        ClothStepper stepper(model, {});
        PlasticFlow plastic(*model);
        for (int k = 0; k < 10; ++k)
        {
          for (Eigen::Index i = 0; i < state.x.cols(); ++i)
            state.x.col(i) = model->rest.vertices.col(i) + random.vector(0.02);
          const double before = stepper.energies(state, Vector3d::Zero()).bending;
          const VectorXd rest = state.rest_angles;
          plastic.flow(state, 0.01);
          EXPECT_LT(stepper.energies(state, Vector3d::Zero()).bending, before * (1 + 1e-12)) << hardening;
          EXPECT_NE(state.rest_angles, rest);
          EXPECT_TRUE(state.stiffening.allFinite() && state.stiffening.minCoeff() >= 1e-3 &&
                      state.stiffening.maxCoeff() <= 1e3);
        }
      }
}

/// A crumpled sheet moving freely loses energy in every step.
TEST(ClothPlasticity, FreeMotionLosesEnergy)
{
  auto model = std::make_shared<ClothModel>(plasticStrip({1.0, 0.2, 0.02}));
  ClothState state = makeClothState(*model, model->rest.vertices), elastic_state;
  Random random(8);
  for (Eigen::Index i = 0; i < state.x.cols(); ++i)
    state.x.col(i) += random.vector(2e-3);
  ClothStepper stepper(model, {});
  ClothInputs inputs;
  inputs.gravity.setZero();
  double energy = stepper.energies(state, Vector3d::Zero()).total();
  for (int k = 0; k < 40; ++k)
  {
    ASSERT_TRUE(stepper.step(state, inputs, 2e-3).ok);
    const double next = stepper.energies(state, Vector3d::Zero()).total();
    EXPECT_LE(next, energy * (1 + 1e-12));
    energy = next;
  }
  EXPECT_GT(state.rest_angles.cwiseAbs().maxCoeff(), 0.01);
}

/// With collisions the flow of a step is that of the shape that collisions left.
TEST(ClothPlasticity, FlowsFromWhatCollisionsLeave)
{
  Group g;
  auto model = std::make_shared<ClothModel>(plasticStrip({0.5, 0.2, 0.0}));
  g.addCloth(model, makeClothState(*model, model->rest.vertices), {}, impulseContact(4e-3));
  g.addObstacle(Capsule{0.02, 0.3},
                {{0.05, 0.15, -0.03}, Eigen::Quaterniond(Eigen::AngleAxisd(M_PI / 2, Vector3d::UnitY()))}, 0.3);
  World world = g.world({}, 5e-3);
  PlasticFlow plastic(*model);
  int touched = 0;
  for (int k = 0; k < 40; ++k)
  {
    ClothState expected = g.state.cloths[0];
    plastic.flow(expected, 5e-3);
    const StepReport report = world.step(g.state, g.inputs);
    ASSERT_TRUE(report.ok) << report.message;
    if (report.cut_steps > 0)
      continue;
    EXPECT_EQ(g.state.cloths[0].rest_angles, expected.rest_angles);
    touched += report.repulsions + report.impulses > 0;
  }
  EXPECT_GT(touched, 5);
  EXPECT_GT(g.state.cloths[0].rest_angles.cwiseAbs().maxCoeff(), 0.01);
}

TEST(ClothPlasticity, RefusesWhatIsNotValid)
{
  ClothModel flat = plasticStrip({kYield, 0, 0});
  flat.bending = BendingModel::isometric_nonconforming;
  EXPECT_THROW(PlasticFlow{flat}, std::invalid_argument);
  for (const Plasticity& bad :
       {Plasticity{-1, 0, 0}, Plasticity{NAN, 0, 0}, Plasticity{1, INFINITY, 0}, Plasticity{1, 0, -1}})
    EXPECT_THROW(PlasticFlow(plasticStrip(bad)), std::invalid_argument);
  auto model = std::make_shared<ClothModel>(plasticStrip({kYield, 0, 0}));
  ClothState state = makeClothState(*model, model->rest.vertices);
  state.stiffening[3] = 0;
  ClothStepper stepper(model, {});
  EXPECT_NE(stepper.step(state, {}, 0.01).message.find("stiffening"), std::string::npos);
  ClothModel wrong = plasticStrip({});
  wrong.undeformed = Matrix3Xd::Zero(3, 5);
  EXPECT_THROW(makeClothState(wrong, wrong.rest.vertices), std::invalid_argument);
}

}   // namespace
}   // namespace slender::test
