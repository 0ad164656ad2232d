// Order of every integrator on a swinging, curved, anisotropic rod, with all that acts on rods; and the error control.
#include <functional>

#include <gtest/gtest.h>

#include "slender_sim/dynamics/integrator.h"
#include "test/support/rods.h"

namespace slender::test {
namespace {

struct Load
{
  std::string name;
  bool damped, moving, loop;
};
void PrintTo(const Load& l, std::ostream* out) { *out << l.name; }

/// Soft enough that the steps below resolve every wave (fastest 260 rad/s): only then does an order show.
Rod softRod(const Load& load)
{
  const int n = load.loop ? 14 : 12;
  const Matrix3Xd nodes = load.loop ? ringNodes(n, 0.1) : helixNodes(n, 0.15, 0.1, 0.5);
  RodSection section = modulusSection(5e-3, 4e-3, 5.0, 0.3);
  section.bend_modulus << 6e-3, 1e-3, 1e-3, 3e-3;
  RodModel model =
      buildRod("r", nodes, load.loop, uniformSections(section, load.loop ? n : n - 1), Vector3d::Zero(), false);
  if (load.damped)
  {
    model.mass_damping = 0.8;
    model.stiffness_damping = 5e-3;
    model.drag = 1.5 * model.mass;
  }
  Rod rod(model, nodes);
  rod.inputs.gravity = Vector3d(0, 0, -3.0);
  rod.inputs.wind = load.damped ? Vector3d(0.5, 1.0, 0) : Vector3d::Zero();
  rod.hold(0, 0);
  if (load.moving)
    rod.hold(8, 8, false);
  return rod;
}

/// Motion of the grasps: smooth in position and orientation, starting from rest.
GraspTarget poseAt(const GraspState& start, double t)
{
  const double w = 6.0, a = 0.03;
  const Vector3d direction(0.5, -0.3, 0.8), axis = Vector3d(0.3, 0.9, -0.2).normalized();
  const double s = 1 - std::cos(w * t), rate = w * std::sin(w * t);
  return {{start.X_WG.position + a * s * direction,
           (Eigen::AngleAxisd(0.4 * s, axis) * start.X_WG.orientation).normalized()},
          Twist{a * rate * direction, 0.4 * rate * axis}};
}

RodState stateAfter(const Load& load, const TimeConfig& time, double duration, int steps, StepReport* total = nullptr)
{
  Rod rod = softRod(load);
  RodStepper stepper(rod.model, time);
  const std::vector<GraspState> start = rod.state.grasps;
  const double h = duration / steps;
  for (int k = 1; k <= steps; ++k)
  {
    if (load.moving)
      for (std::size_t g = 0; g < start.size(); ++g)
        rod.inputs.grasps[g] = poseAt(start[g], k * h);
    const StepReport report = stepper.step(rod.state, rod.inputs, h);
    EXPECT_TRUE(report.ok) << report.message;
    if (total)
      total->merge(report);
  }
  return rod.state;
}

TimeConfig exactly(Integrator integrator)
{
  TimeConfig time = withIntegrator(integrator);
  time.newton.tolerance = 1e-12;
  return time;
}

class Order : public ::testing::TestWithParam<Load>
{};

TEST_P(Order, OfEveryIntegrator)
{
  const double duration = 0.16;
  const RodState reference = stateAfter(GetParam(), exactly(Integrator::tr_bdf2), duration, 5120);
  ASSERT_GT((reference.x - softRod(GetParam()).state.x).colwise().norm().maxCoeff(), 0.02);   // it did move
  for (Integrator integrator : allIntegrators())
  {
    double x[3], v[3];
    for (int k = 0; k < 3; ++k)
    {
      // first order shows later
      const RodState end =
          stateAfter(GetParam(), exactly(integrator), duration, (order(integrator) == 2 ? 160 : 1280) << k);
      x[k] = (end.x - reference.x).colwise().norm().maxCoeff();
      v[k] = (end.v - reference.v).colwise().norm().maxCoeff();
    }
    const double claimed = order(integrator) == 2 ? 1.9 : 0.9;
    EXPECT_GT(std::log2(x[1] / x[2]), claimed) << toString(integrator) << " x " << x[0] << " " << x[1] << " " << x[2];
    EXPECT_GT(std::log2(v[1] / v[2]), claimed) << toString(integrator) << " v " << v[0] << " " << v[1] << " " << v[2];
    // and towards the same solution
    EXPECT_LT(x[2], order(integrator) == 2 ? 1e-5 : 1e-3) << toString(integrator);
  }
}

INSTANTIATE_TEST_SUITE_P(Loads, Order,
                         ::testing::Values(Load{"plain", false, false, false}, Load{"damped", true, false, false},
                                           Load{"moving", false, true, false},
                                           Load{"damped_and_moving", true, true, false},
                                           Load{"loop", true, true, true}),
                         [](const auto& info) { return info.param.name; });

TEST(ErrorControl, MeetsItsTolerance)
{
  const Load load{"damped_and_moving", true, true, false};
  const double duration = 0.16;
  const RodState reference = stateAfter(load, exactly(Integrator::tr_bdf2), duration, 5120);
  for (Integrator integrator : implicitIntegrators())
  {
    double last_error = 0;
    int last_steps = 0;
    for (double tolerance : {1e-5, 1e-6, 1e-7})
    {
      TimeConfig time = exactly(integrator);
      time.error_tolerance = tolerance;
      StepReport total;
      const RodState end = stateAfter(load, time, duration, 8, &total);   // 20 ms each: far too long for one step
      const double error = (end.x - reference.x).colwise().norm().maxCoeff();
      // local errors add up, and grow at most a few times in a motion as short as this
      EXPECT_LT(error, 3 * tolerance * total.substeps)
          << toString(integrator) << " " << tolerance << " steps " << total.substeps;
      EXPECT_LE(total.error_estimate, tolerance);
      EXPECT_GT(total.substeps, 8);
      if (last_steps > 0)
      {
        EXPECT_LT(error, last_error) << toString(integrator);
        // steps grow with the (p+1)th root of the tolerance
        const double growth = std::pow(10.0, 1.0 / (order(integrator) + 1));
        EXPECT_NEAR(total.substeps / static_cast<double>(last_steps) / growth, 1.0, 0.35) << toString(integrator);
      }
      last_error = error;
      last_steps = total.substeps;
    }
  }
}

}   // namespace
}   // namespace slender::test
