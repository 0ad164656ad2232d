// The end of minimize(): at an error within the tolerance, and no later.
#include <cmath>
#include <limits>

#include <gtest/gtest.h>

#include "slender_sim/dynamics/newton.h"

namespace slender::test {
namespace {

/// Sums of an evaluation, as minimize() needs them.
struct Sums
{
  double stretch = 0.0, bend_twist = 0.0, potential = 0.0, min_chi = 2.0, max_strain = 0.0;
  struct
  {
    bool positiveDefinite() const { return true; }
  } inertia;
  double energy() const { return potential; }
};

/// The energy x^2 / 2 of one unknown. A Hessian that is too large leaves a given share of the error in each iteration.
struct Parabola
{
  double rate;
  bool sticks = true;   ///< what sticksAfter() returns
  double force_scale = 1.0, most_unbalanced = 1.0;
  double x = 1.0, base = 1.0, saved = 1.0, direction = 0.0;

  Sums evaluate(bool, const HessianShift& = {}) const
  {
    Sums sums;
    sums.potential = 0.5 * x * x;
    return sums;
  }
  void solve() { direction = -(1.0 - rate) * base; }
  void moveAlong(double alpha) { x = base + alpha * direction; }
  void accept() { base = x; }
  void saveBase() { saved = base; }
  void restoreBase() { base = saved; }
  double stepLimit() const { return 1.0; }
  double incrementSize() const { return std::abs(direction); }
  double slope() const { return base * direction; }
  double residual() const { return std::abs(x); }
  double forceScale() const { return force_scale; }
  double noiseLevel() const { return 0.0; }
  double mostUnbalanced() const { return most_unbalanced; }
  bool anglesMayKeepShift() const { return false; }
  bool sticksAfter(double) const { return sticks; }
  StepFailure givesUp() const { return StepFailure::none; }
};

TEST(Newton, EndsAtAnErrorWithinTheTolerance)
{
  NewtonConfig config;
  config.tolerance = 1e-5;
  for (const double rate : {1e-4, 0.01, 0.05, 0.2, 0.29, 0.4})
  {
    Parabola parabola{rate};
    const NewtonResult result = minimize(parabola, config);
    ASSERT_TRUE(result.ok()) << rate;
    EXPECT_LE(std::abs(parabola.x), config.tolerance) << rate;
    // One iteration fewer would not do. From a rate of 0.3 on, increments tell nothing of the next one.
    if (rate < 0.3)
    {
      EXPECT_GT(std::abs(parabola.x), 0.5 * rate * config.tolerance) << rate;
    }
  }
}

TEST(Newton, GoesOnWhereWhatSticksWouldMove)
{
  Parabola sticking{0.03}, moving{0.03, false};
  NewtonConfig config;
  config.tolerance = 1e-5;
  const NewtonResult early = minimize(sticking, config), late = minimize(moving, config);
  ASSERT_TRUE(early.ok() && late.ok());
  EXPECT_EQ(late.iterations, early.iterations + 1);
}

/// Increments may be within the tolerance where forces are small, and what is left of the error be a large force.
TEST(Newton, GoesOnForBalanceAndGivesItUpAfterSomeIterations)
{
  NewtonConfig config;
  config.tolerance = 1e-5;
  Parabola plain{0.01}, scaled{0.01}, without_balance{0.01};
  scaled.force_scale = 1e-7;
  without_balance.force_scale = 1e-30;
  scaled.most_unbalanced = without_balance.most_unbalanced = std::numeric_limits<double>::infinity();
  const NewtonResult before = minimize(plain, config), balanced = minimize(scaled, config);
  ASSERT_TRUE(before.ok() && balanced.ok());
  EXPECT_GT(before.residual, 0.05 * scaled.force_scale);
  EXPECT_LE(balanced.residual, 0.05);
  EXPECT_GT(balanced.iterations, before.iterations);
  const NewtonResult tried = minimize(without_balance, config);
  ASSERT_TRUE(tried.ok());
  EXPECT_EQ(tried.iterations, before.iterations + 3);
}

}   // namespace
}   // namespace slender::test
