// Guides that do what no cloth can follow: steps end within a budget of work, whatever they do, and the run goes on.
#include <random>

#include <gtest/gtest.h>

#include "slender_sim/dynamics/work_budget.h"
#include "slender_sim/scene/reader.h"
#include "slender_sim/scene/simulation.h"

namespace slender {
namespace {

using Eigen::Matrix3Xd;
using Eigen::Vector3d;

const char* const kGuidedSheet = R"(
name: sheet
time: {step: 0.01, duration: 1}
tracked:
  - name: sheet
    guide:
      grid: {corner: [0, 0, 0], sides: [[0.4, 0, 0], [0, 0.4, 0]], cells: [4, 4], pattern: alternating}
      motion: fixed
    mesh: {subdivide: 2}
    material: {area_density: 0.2, thickness: 0.001, youngs_modulus: 1.0e5}
    bending: {model: hinge}
    damping: {stiffness: 0.001}
    contact: {thickness: 0.002}
    solver: {one_newton_step: true}
)";

class WildGuides : public testing::Test
{
protected:
  StepReport step(const Matrix3Xd& guide)
  {
    SceneInputs inputs = simulation.defaultInputs();
    inputs.guides[0] = guide;
    return simulation.step(inputs);
  }
  /// Each coordinate by up to `reach` [m].
  Matrix3Xd scattered(double reach) const
  {
    std::mt19937 random(5);
    Matrix3Xd x = rest;
    for (Eigen::Index i = 0; i < x.size(); ++i)
      x.data()[i] += 2.0 * reach * (random() * 0x1p-32 - 0.5);
    return x;
  }

  Simulation simulation{parseScene(kGuidedSheet, "sheet.yaml", {})};
  const Matrix3Xd rest = simulation.config().cloths[0].tracking->guide.mesh.vertices;
  const ClothState& cloth = simulation.state().cloths[0];
  const long most = WorkBudget::ofStep(cloth.x.cols());
};

TEST_F(WildGuides, AreRefusedWithinTheBudgetAndTheRunGoesOn)
{
  for (int k = 0; k < 3; ++k)
  {
    const StepReport report = step(rest);
    ASSERT_TRUE(report.ok) << report.message;
    EXPECT_GT(report.work, 0);
    EXPECT_LT(report.work, most / 50);   // a sheet that hangs from its guide has hardly anything to do
  }
  const ClothState before = cloth;
  const Matrix3Xd wild = scattered(2.0);   // five times the sheet's side
  long work = 0;
  for (int k = 0; k < 2; ++k)
  {
    const StepReport report = step(wild);
    ASSERT_FALSE(report.ok);
    EXPECT_EQ(report.failure, StepFailure::work_exceeded) << report.message;
    EXPECT_NE(report.message.find("cloth 'sheet'"), std::string::npos) << report.message;
    EXPECT_NE(report.message.find("use a shorter step, or a guide that moves by less at once"), std::string::npos)
        << report.message;
    EXPECT_GT(report.work, most);
    EXPECT_LT(report.work, most + most / 20);   // beyond it by what is counted at once: a sweep, or a solve
    EXPECT_TRUE(k == 0 || report.work == work) << "not reproducible";
    work = report.work;
    EXPECT_TRUE(cloth.x == before.x && cloth.v == before.v && cloth.rest_angles == before.rest_angles);
    EXPECT_EQ(simulation.state().steps, 3);
  }
  for (int k = 0; k < 5; ++k)   // the guide is back
  {
    const StepReport report = step(rest);
    ASSERT_TRUE(report.ok) << report.message;
    EXPECT_LT(report.work, most / 50);
  }
  EXPECT_TRUE(cloth.x.allFinite() && cloth.v.allFinite());
  EXPECT_LT(simulation.trackingError({ObjectRef::cloth, 0}).met, 1e-9);

  // steps that were refused leave nothing behind
  Simulation calm(parseScene(kGuidedSheet, "sheet.yaml", {}));
  for (int k = 0; k < 8; ++k)
    ASSERT_TRUE(calm.step(calm.defaultInputs()).ok);
  EXPECT_TRUE(calm.state().cloths[0].x == cloth.x && calm.state().cloths[0].v == cloth.v);
}

TEST(WorkBudget, IsSpentByCounts)
{
  WorkBudget budget;
  EXPECT_TRUE(budget.spend(1000000000000L));   // without bound until it is started
  budget.start(100);
  EXPECT_EQ(budget.done(), 0);
  EXPECT_TRUE(budget.spend(30));
  EXPECT_EQ(budget.left(), 70);
  EXPECT_TRUE(budget.spend(70));
  EXPECT_FALSE(budget.spend(1));
  EXPECT_TRUE(budget.spent());
  EXPECT_EQ(budget.left(), 0);
  EXPECT_EQ(WorkBudget::ofStep(10), WorkBudget::ofStep(1500));
  EXPECT_EQ(WorkBudget::ofStep(3000), 2 * WorkBudget::ofStep(1500));
}

}   // namespace
}   // namespace slender
