// A warm step of a cloth in an island takes no memory from the heap.
#include <cmath>

#include <gtest/gtest.h>

#include "cloth/cloth_part.h"
#include "test/support/allocations.h"
#include "test/support/cloths.h"
#include "test/support/part_driver.h"

namespace slender::test {
namespace {

#ifdef SLENDER_COUNTS_ALLOCATIONS

/// A sheet as a part of an island, with a contact of its own.
class ClothPartAllocations : public ::testing::TestWithParam<std::tuple<BendingModel, ClothSolver>>
{
protected:
  static constexpr double kStep = 0.01;   // [s]

  ClothPartAllocations()
    : model(std::make_shared<ClothModel>(buildCloth("sheet", gridMesh(0.5, 0.4, 8, 0, GridPattern::alternating), 0.2,
                                                    isotropicMembrane(1e6, 0.3, 1e-3))))
  {
    model->bending = std::get<0>(GetParam());
    model->bending_modulus = 1e-4;
    model->stiffness_damping = 2e-4;
    model->wind_coefficient = 0.4;
    state = makeClothState(*model, model->rest.vertices);
    pinVertices(state, {0, 8});
    inputs.wind << 1, 0.3, 4;
    inputs.pins.resize(3, 2);
    options.solver = std::get<1>(GetParam());
    for (int p = 0; p < 3; ++p)
    {
      term.point[p] = model->rest.triangles(p, 10);
      term.weight[p] = 1.0 / 3.0;
    }
    term.solid = 0;
    term.force << 0, 0, 0.01;
    term.stiffness.setIdentity();
    planStep(Integrator::implicit_euler, 1.0, kStep, 0.0, plan);
  }

  /// Returns how much memory warm steps ask for. `solve` ends at a configuration that was evaluated.
  template <class Solve>
  long warmSteps(ClothPart& part, const Solve& solve)
  {
    StepReport report;
    const auto advance = [&] {
      for (int p = 0; p < 2; ++p)
        inputs.pins.col(p) = state.x.col(state.pins[p]) + Vector3d(1e-4 * p, 0, 0);
      part.begin(state, inputs, kStep);
      part.beginSubstep(plan, {0.0, kStep, kStep});
      part.own_terms.assign({&term});
      part.beginStage(0);
      solve();
      part.endStage(0, true, report);
      part.acceptSubstep({0.0, kStep, kStep});
      part.end(state);
    };
    for (int k = 0; k < 10; ++k)
      advance();
    const long before = allocations;
    for (int k = 0; k < 10; ++k)
      advance();
    return allocations - before;
  }

  std::shared_ptr<ClothModel> model;
  ClothState state;
  ClothInputs inputs;
  ClothOptions options;
  ContactTerm term;
  StepPlan plan;
};

TEST_P(ClothPartAllocations, AWarmStepWithItsOwnMatrixMakesNone)
{
  ClothPart part(model, options);
  PartDriver driver(part, false);
  bool ok = true;
  EXPECT_EQ(warmSteps(part, [&] { ok = driver.solve(options.newton).ok() && ok; }), 0);
  EXPECT_TRUE(ok);
}

/// Solving with the matrix of an island takes memory (CHOLMOD's). Here only what the part itself does is counted: the
/// solution is replaced by a small step along the forces.
TEST_P(ClothPartAllocations, AWarmStepInTheMatrixOfAnIslandMakesNone)
{
  ClothPart cloth(model, options);
  Part& part = cloth;
  PartDriver driver(part, true);
  double sum = 0.0;
  const auto solve = [&] {
    driver.begin();
    part.evaluate(true, {});
    driver.matrix.clear();
    part.addHessian(driver.matrix, {});
    part.takeGradient(driver.matrix.solution());
    for (int u = 0; u < part.unknowns(); ++u)
      driver.matrix.solution()[u] *= 1e-7;   // [m/N]
    part.takeDirection(driver.matrix.solution());
    sum += part.stepLimit() + part.incrementSize(1.0) + part.slope() + part.residual() + part.forceScale() +
           part.noiseLevel();
    part.saveBase();
    part.moveAlong(1.0);
    part.evaluate(false, {});
    part.closeGradient();
  };
  EXPECT_EQ(warmSteps(cloth, solve), 0);
  EXPECT_TRUE(std::isfinite(sum));
}

INSTANTIATE_TEST_SUITE_P(Cases, ClothPartAllocations,
                         ::testing::Combine(::testing::Values(BendingModel::hinge,
                                                              BendingModel::isometric_nonconforming),
                                            ::testing::Values(ClothSolver::cholesky, ClothSolver::gauss_seidel)));

#endif

}   // namespace
}   // namespace slender::test
