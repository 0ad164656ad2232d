// Static equilibria of cloth against beam and plate theory, and saddles that are left.
#include <cmath>
#include <memory>

#include <gtest/gtest.h>

#include "slender_sim/cloth/cloth_stepper.h"
#include "test/support/cloths.h"

namespace slender::test {
namespace {

/// A flat plate with D = 1 and area density 1. Its bending has Poisson's ratio 0, its membrane none.
struct Plate
{
  std::shared_ptr<ClothModel> model;
  ClothState state;
  ClothInputs inputs;

  Plate(const TriangleMesh& mesh, double thickness, const std::vector<int>& held, bool clamped)
    : model(std::make_shared<ClothModel>(
          buildCloth("plate", mesh, 1.0, isotropicMembrane(12 / (thickness * thickness), 0.0, 1.0))))
  {
    model->bending_modulus = 1.0;
    model->bending_poissons_ratio = 0.0;
    if (clamped)
      clampFaces(*model, held);
    state = makeClothState(*model, mesh.vertices);
    pinVertices(state, held);
    inputs.gravity.setZero();
    hold();
  }
  /// The pins stay where they are now.
  void hold()
  {
    inputs.pins.resize(3, static_cast<Eigen::Index>(state.pins.size()));
    for (std::size_t k = 0; k < state.pins.size(); ++k)
      inputs.pins.col(static_cast<Eigen::Index>(k)) = state.x.col(state.pins[k]);
  }
  double deflection() const { return state.x.row(2).cwiseAbs().maxCoeff(); }
};

/// [0, 0.3] x [0, 1] beyond a row of cells that is held, so that the edge y = 0 is clamped.
Plate cantilever(int rows)
{
  TriangleMesh mesh = gridMesh(0.3, 1.0 + 1.0 / rows, 3, rows + 1, GridPattern::one_diagonal);
  mesh.vertices.row(1).array() -= 1.0 / rows;
  std::vector<int> held;
  for (Eigen::Index i = 0; i < mesh.vertices.cols(); ++i)
    if (mesh.vertices(1, i) < 0.5 / rows)
      held.push_back(static_cast<int>(i));
  return Plate(mesh, 0.01, held, true);
}

/// A square held along its boundary, where it may turn.
Plate supported(int cells)
{
  const TriangleMesh mesh = gridMesh(1.0, 1.0, cells, cells, GridPattern::one_diagonal);
  std::vector<int> held;
  for (Eigen::Index i = 0; i < mesh.vertices.cols(); ++i)
  {
    const Vector3d p = mesh.vertices.col(i);
    if (std::min({p.x(), 1 - p.x(), p.y(), 1 - p.y()}) < 1e-9)
      held.push_back(static_cast<int>(i));
  }
  return Plate(mesh, 0.01, held, false);
}

StepReport solvePlate(Plate& plate, bool leave_saddles = true)
{
  ClothStepper stepper(plate.model, ClothOptions{});
  return stepper.solveEquilibrium(plate.state, plate.inputs, leave_saddles);
}

TEST(ClothStatics, aClampedStripBendsUnderItsWeightLikeABeam)
{
  constexpr double kGravity = 1e-3, kBeam = kGravity / 8;   // q L^4 / (8 D); so small that the next order is 1e-8 of it
  double error[2];
  for (const int k : {0, 1})
  {
    Plate plate = cantilever(k == 0 ? 10 : 20);
    plate.inputs.gravity = Vector3d(0, 0, -kGravity);
    const StepReport report = solvePlate(plate);
    ASSERT_TRUE(report.ok) << report.message;
    EXPECT_TRUE(report.stable);
    EXPECT_LT(report.residual, 1e-6);
    error[k] = plate.deflection() / kBeam - 1;
  }
  EXPECT_LT(std::abs(error[1]), 0.01);
  EXPECT_NEAR(error[0] / error[1], 4.0, 0.4);   // second order; the next term is a hundredth of the first
}

TEST(ClothStatics, theLowestEigenvalueIsTheSquareOfTheLowestFrequency)
{
  Plate plate = cantilever(20);
  ClothStepper stepper(plate.model, ClothOptions{});
  const StepReport report = stepper.assessEquilibrium(plate.state, plate.inputs);
  ASSERT_TRUE(report.ok) << report.message;
  EXPECT_TRUE(report.stable);
  // of a cantilever; order as above
  EXPECT_NEAR(report.lowest_eigenvalue, std::pow(1.875104, 4), 0.01 * std::pow(1.875104, 4));
  EXPECT_GT(stepper.lowestMode().row(2).cwiseAbs().maxCoeff(), 0.1);
  EXPECT_LT(stepper.lowestMode().topRows(2).cwiseAbs().maxCoeff(), 1e-6);
}

TEST(ClothStatics, aPointLoadBendsASupportedPlateAsTheorySays)
{
  // Timoshenko: 0.01160 P a^2 / D for a square, whatever Poisson's ratio
  constexpr double kForce = 1e-4, kExpected = 0.011600 * kForce;
  constexpr int kCells = 32;
  Plate plate = supported(kCells);
  const int centre = kCells / 2 * (kCells + 1) + kCells / 2;
  plate.inputs.forces.setZero(3, plate.model->vertices());
  plate.inputs.forces(2, centre) = kForce;
  const StepReport report = solvePlate(plate);
  ASSERT_TRUE(report.ok) << report.message;
  // the study plate's bound for supported plates, halved
  EXPECT_NEAR(plate.state.x(2, centre), kExpected, (0.02 + 1.0 / kCells) * kExpected);
  ClothStepper stepper(plate.model, ClothOptions{});
  ASSERT_TRUE(stepper.assessEquilibrium(plate.state, plate.inputs).ok);
  EXPECT_NEAR(stepper.pinForces().row(2).sum(), kForce, 1e-6 * kForce);   // the pins bear the load
}

TEST(ClothStatics, aPlateCompressedBeyondItsBucklingLoadLeavesItsPlane)
{
  // strain: N = C eps = 4 pi^2 D / a^2
  constexpr double kThickness = 0.01, kBuckling = 4 * M_PI * M_PI * kThickness * kThickness / 12;
  const auto compressed = [&](double factor) {
    Plate plate = supported(16);
    plate.state.x.row(0) *= 1 - factor * kBuckling;
    plate.hold();
    return plate;
  };
  Plate below = compressed(0.9), kept = compressed(1.2), above = compressed(1.2), again = compressed(1.2);
  const StepReport stable = solvePlate(below);
  ASSERT_TRUE(stable.ok) << stable.message;
  EXPECT_TRUE(stable.stable);
  EXPECT_EQ(stable.escapes, 0);
  EXPECT_LT(below.deflection(), 1e-9);

  const StepReport saddle = solvePlate(kept, false);
  ASSERT_TRUE(saddle.ok) << saddle.message;
  EXPECT_FALSE(saddle.stable);
  EXPECT_LT(saddle.lowest_eigenvalue, 0.0);
  EXPECT_LT(kept.deflection(), 1e-9);

  const StepReport buckled = solvePlate(above);
  ASSERT_TRUE(buckled.ok) << buckled.message;
  EXPECT_TRUE(buckled.stable);
  EXPECT_GE(buckled.escapes, 1);
  EXPECT_GT(buckled.lowest_eigenvalue, 0.0);
  EXPECT_LT(buckled.energy, saddle.energy);
  EXPECT_GT(above.deflection(), 0.1 * kThickness);
  ASSERT_TRUE(solvePlate(again).ok);
  // the side is chosen by the mode, not by chance
  EXPECT_EQ((above.state.x - again.state.x).cwiseAbs().maxCoeff(), 0.0);
}

TEST(ClothStatics, aFlatSheetWhoseEdgesComeTogetherHangsInACatenary)
{
  // An inextensible, limp strip of length 1 between two lines at a distance of 0.6: 2 a sinh(0.3 / a) = 1, sag a
  // (cosh(0.3 / a) - 1) = 0.36.
  constexpr double kSpan = 0.6, kWidth = 0.25;
  double a = 0.2;
  for (int k = 0; k < 50; ++k)   // Newton's method
    a -= (2 * a * std::sinh(kSpan / (2 * a)) - 1) /
         (2 * std::sinh(kSpan / (2 * a)) - kSpan / a * std::cosh(kSpan / (2 * a)));
  const double sag = a * (std::cosh(kSpan / (2 * a)) - 1);
  EXPECT_GT(sag, 0.36);
  for (const int rows : {16, 32})
  {
    // q L^3 / D: bending reaches no farther than sqrt(D / H) = 0.002 of the length
    constexpr double kLoad = 1e6, kThickness = 1e-4;
    const TriangleMesh mesh = gridMesh(kWidth, 1.0, rows / 4, rows, GridPattern::alternating);
    std::vector<int> held;
    for (Eigen::Index i = 0; i < mesh.vertices.cols(); ++i)
      if (mesh.vertices(1, i) < 1e-9 || mesh.vertices(1, i) > 1 - 1e-9)
        held.push_back(static_cast<int>(i));
    Plate sheet(mesh, kThickness, held, false);
    sheet.inputs.gravity = Vector3d(0, 0, -kLoad);
    // the search starts from the flat sheet
    sheet.inputs.pins.row(1).array() = 0.5 + kSpan * (sheet.inputs.pins.row(1).array() - 0.5);
    ClothStepper stepper(sheet.model, ClothOptions{});
    const StepReport report = stepper.solveEquilibrium(sheet.state, sheet.inputs);
    ASSERT_TRUE(report.ok) << report.message;
    EXPECT_TRUE(report.stable);
    // A strain of e makes the sheet longer by at most e, and a sheet that is longer by 1 % sags by 1.2 % more. A chain
    // of n straight links sags by 1.0 / n^2 more than the catenary (measured: 0.9). Bending that pinned edges do not
    // feel changes less than D / (H a^2) = 1e-4.
    const double bound = 1.2 * report.max_strain + 1.0 / (rows * rows) + 1e-4;
    EXPECT_NEAR(sheet.deflection() / sag, 1.0, bound) << rows;
    // The edges bear the weight, and pull inwards by q a per width.
    const Eigen::Matrix3Xd& forces = stepper.pinForces();
    EXPECT_NEAR(forces.row(2).sum(), -kLoad * kWidth, 1e-6 * kLoad * kWidth);
    EXPECT_NEAR(0.5 * forces.row(1).cwiseAbs().sum(), kLoad * a * kWidth, 3 * bound * kLoad * a * kWidth) << rows;
  }
}

TEST(ClothStatics, aFlatSheetOnTwoCornersFallsAndHangsBelowThem)
{
  constexpr int kCells = 12;
  const TriangleMesh mesh = gridMesh(1.0, 1.0, kCells, kCells, GridPattern::alternating);
  Plate sheet(mesh, 1e-3, {kCells * (kCells + 1), (kCells + 1) * (kCells + 1) - 1}, false);
  sheet.inputs.gravity = Vector3d(0, 0, -1e4);
  const StepReport report = solvePlate(sheet);
  ASSERT_TRUE(report.ok) << report.message;
  EXPECT_TRUE(report.stable);
  // It hangs from the corners of one side, and its lower side is one side's length below, but for strain.
  EXPECT_NEAR(sheet.deflection(), 1.0, report.max_strain);
}

TEST(ClothStatics, whatHasNoEquilibriumIsRefused)
{
  Plate plate = cantilever(10);
  Plate loose(gridMesh(1, 1, 4, 4, GridPattern::one_diagonal), 0.01, {}, false);
  loose.inputs.gravity = Vector3d(0, 0, -1);
  const ClothState before = loose.state;
  const StepReport drifts = solvePlate(loose);
  EXPECT_FALSE(drifts.ok);
  EXPECT_NE(drifts.message.find("grasp"), std::string::npos) << drifts.message;
  EXPECT_EQ((loose.state.x - before.x).cwiseAbs().maxCoeff(), 0.0);
  plate.model->wind_coefficient = 1.0;
  plate.inputs.wind = Vector3d(1, 0, 0);
  const StepReport blown = solvePlate(plate);
  EXPECT_FALSE(blown.ok);
  EXPECT_NE(blown.message.find("leave out wind"), std::string::npos) << blown.message;
}

}   // namespace
}   // namespace slender::test
