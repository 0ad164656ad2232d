// A tracked cloth whose guide has stopped.
#include <algorithm>
#include <string>

#include <gtest/gtest.h>

#include "slender_sim/scene/reader.h"
#include "slender_sim/scene/simulation.h"

namespace slender::test {
namespace {

using Eigen::Matrix3Xd;

/// Errors of conjugate gradients, which count from a load that the guide holds for ever, must not keep a shell in
/// motion.
class TrackedRest : public testing::TestWithParam<const char*>
{};

TEST_P(TrackedRest, ClothsComeToRestWithTheirGuides)
{
  Simulation simulation(parseScene(std::string(GetParam()) + R"(
time: {step: 0.01, duration: 8}
tracked:
  - guide: {grid: {corner: [-0.2, -0.2, 1], sides: [[0.4, 0, 0], [0, 0.4, 0]], cells: 5}, motion: {topic: points}}
    mesh: {subdivide: 2}
    material: {area_density: 0.12, thickness: 0.0003, youngs_modulus: 2.0e4, poissons_ratio: 0.3}
    bending: {model: hinge}
    damping: {mass: 2, stiffness: 0.002}
    solver: {one_newton_step: true}
)"));
  SceneInputs inputs = simulation.defaultInputs();
  const Matrix3Xd rest = inputs.guides[0];
  double residual = 0;
  for (int k = 1; k <= 600; ++k)
  {
    const double bend = std::min(0.01 * k, 0.5);   // within half a second
    inputs.guides[0] = rest;
    inputs.guides[0].row(0) *= 1 - 0.2 * bend;
    for (Eigen::Index i = 0; i < rest.cols(); ++i)
      inputs.guides[0](2, i) += 4 * bend * rest(0, i) * rest(0, i) - bend * rest(0, i) * rest(1, i);
    const StepReport report = simulation.step(inputs);
    ASSERT_TRUE(report.ok) << report.message;
    residual = report.residual;
  }
  EXPECT_LT(residual, 1e-3);
  // [m/s]; 2e-3 where the tolerance counts from the load alone
  EXPECT_LT(simulation.state().cloths[0].v.colwise().norm().maxCoeff(), 1e-5);
}

INSTANTIATE_TEST_SUITE_P(Loads, TrackedRest, testing::Values("", "gravity: [0, 0, 0]\n"),
                         [](const auto& info) { return info.index == 0 ? "Weight" : "NoWeight"; });

}   // namespace
}   // namespace slender::test
