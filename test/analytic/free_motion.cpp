// Free rods: free fall, momentum, energy, drag, against what each integrator claims.
#include <gtest/gtest.h>

#include "slender_sim/dynamics/integrator.h"
#include "test/support/rods.h"

namespace slender::test {
namespace {

class FreeMotion : public ::testing::TestWithParam<Integrator>
{
protected:
  TimeConfig time() const
  {
    TimeConfig t = withIntegrator(GetParam());
    t.newton.tolerance = 1e-12;
    return t;
  }
  bool is(Integrator i) const { return GetParam() == i; }
};

Vector3d centre(const Rod& rod) { return rod.state.x * rod.model->mass / rod.model->totalMass(); }

Rod curvedRod(bool closed, double youngs)
{
  const int n = 16;
  const Matrix3Xd nodes = closed ? ringNodes(n, 0.1) : helixNodes(n, 0.1, 0.1, 0.8);
  RodSection section = roundSection(0.005, youngs, 1000);
  section.bend_modulus(0, 0) *= 2.0;   // anisotropic, so that the frames matter
  Rod rod(buildRod("r", nodes, closed, uniformSections(section, closed ? n : n - 1), Vector3d::Zero(), false), nodes);
  rod.inputs.gravity.setZero();
  return rod;
}

/// A smooth motion without net spin symmetry: translation, rotation and shear.
void setInMotion(Rod& rod, double speed)
{
  for (int i = 0; i < rod.model->nodes(); ++i)
  {
    const Vector3d r = (rod.state.x.col(i) - centre(rod)) / 0.1;
    rod.state.v.col(i) = speed * (Vector3d(0.3, -0.2, 0.5) + Vector3d(0.2, 0.5, -0.3).cross(r) +
                                  Vector3d(0.4 * r.z(), 0.3 * r.x() * r.y(), -0.5 * r.x()));
  }
}

TEST_P(FreeMotion, FreeFallIsTheIntegratorsOwnClosedForm)
{
  for (bool closed : {false, true})
  {
    Rod rod = curvedRod(closed, 1e6);
    const Matrix3Xd start = rod.state.x;
    rod.inputs.gravity = Vector3d(1.0, -2.0, -9.81);
    RodStepper stepper(rod.model, time());
    const double h = is(Integrator::symplectic_euler) ? 1e-4 : 4e-3;
    for (int k = 1; k <= 40; ++k)
    {
      const StepReport report = stepper.step(rod.state, rod.inputs, h);
      ASSERT_TRUE(report.ok) << report.message;
      double fall = 0.5 * k * k;   // exact for constant acceleration: tr_bdf2, midpoint, generalised alpha
      if (is(Integrator::implicit_euler) || is(Integrator::symplectic_euler))
        fall = 0.5 * k * (k + 1);
      if (is(Integrator::bdf2))
        fall += 0.75 * (1 - std::pow(3.0, -k));   // starts with one step of Euler, whose error decays to its limit
      // round-off of the forces, 1e-16 EA/h on 5 g, over 40 steps
      const Matrix3Xd expected = start.colwise() + h * h * fall * rod.inputs.gravity;
      EXPECT_LT((rod.state.x - expected).cwiseAbs().maxCoeff(), 2e-13) << "step " << k;
      EXPECT_LT((rod.state.v.colwise() - k * h * rod.inputs.gravity).cwiseAbs().maxCoeff(), 1e-10) << "step " << k;
    }
  }
}

TEST_P(FreeMotion, LinearMomentumIsConserved)
{
  for (bool closed : {false, true})
  {
    Rod rod = curvedRod(closed, 1e6);
    setInMotion(rod, 0.3);
    const Vector3d momentum = rod.momentum();
    const double size = rod.model->totalMass() * 0.3;
    RodStepper stepper(rod.model, time());
    const double h = is(Integrator::symplectic_euler) ? 5e-5 : 2e-3;
    for (int k = 0; k < 200; ++k)
      ASSERT_TRUE(stepper.step(rod.state, rod.inputs, h).ok);
    // internal forces cancel in pairs; what remains is Newton's last residual, 200 times
    EXPECT_LT((rod.momentum() - momentum).norm(), 1e-9 * size);
  }
}

TEST_P(FreeMotion, AngularMomentum)
{
  for (bool closed : {false, true})
  {
    Rod rod = curvedRod(closed, 1e6);
    setInMotion(rod, 0.3);
    const Vector3d start = rod.angularMomentum();
    RodStepper stepper(rod.model, time());
    const double h = is(Integrator::symplectic_euler) ? 5e-5 : 1e-3;
    for (int k = 0; k < 200; ++k)
      ASSERT_TRUE(stepper.step(rod.state, rod.inputs, h).ok);
    const double loss = (rod.angularMomentum() - start).norm() / start.norm();
    double claimed = 0.02;   // second order: 30 rad/s and more of vibration at 1 ms, (omega h)^2 per radian
    if (is(Integrator::implicit_midpoint))
      claimed = 1e-9;   // conserved, being quadratic, to Newton's residual
    if (is(Integrator::symplectic_euler))
      claimed = 2e-3;   // conserved but for the frames, which trail by a Newton step
    if (is(Integrator::implicit_euler))
      claimed = 0.5;   // claims nothing, but must not gain
    EXPECT_LT(loss, claimed);
    EXPECT_LT(rod.angularMomentum().norm(), start.norm() * (is(Integrator::implicit_euler) ? 1.0 : 1.0 + claimed));
  }
}

TEST_P(FreeMotion, EnergyStaysInItsBounds)
{
  for (bool closed : {false, true})
  {
    Rod rod = curvedRod(closed, 1e5);
    setInMotion(rod, 0.2);
    RodStepper stepper(rod.model, time());
    const double start = stepper.energies(rod.state, Vector3d::Zero()).total();
    const double h = is(Integrator::symplectic_euler) ? 1e-4 : 5e-4;
    double last = start, least = start, most = start;
    for (int k = 0; k < 1000; ++k)
    {
      ASSERT_TRUE(stepper.step(rod.state, rod.inputs, h).ok);
      const double now = stepper.energies(rod.state, Vector3d::Zero()).total();
      // 1e-9: Newton's residual
      EXPECT_LE(now, is(Integrator::implicit_euler) ? last + 1e-9 * start : 1.1 * start) << "step " << k;
      last = now;
      least = std::min(least, now);
      most = std::max(most, now);
    }
    switch (GetParam())
    {
      case Integrator::implicit_euler: EXPECT_LT(last, start); break;
      case Integrator::implicit_midpoint:
      case Integrator::symplectic_euler:
        // symplectic: oscillates, no drift. The stretching waves (1500 rad/s) hold little of the energy.
        EXPECT_GT(least, 0.97 * start);
        EXPECT_LT(most, 1.03 * start);
        break;
      default:   // damped at high frequency; the little gain is the start's own error
        EXPECT_GT(least, 0.8 * start);
        EXPECT_LT(most, 1.01 * start);
    }
  }
}

TEST_P(FreeMotion, DragAndMassDampingReachTerminalVelocity)
{
  for (bool by_drag : {false, true})
  {
    Rod rod = curvedRod(false, 1e6);
    const double rate = 5.0;   // 1/s
    if (by_drag)
      rod.model->drag = rate * rod.model->mass;
    else
      rod.model->mass_damping = rate;
    rod.inputs.gravity = Vector3d(0, 0, -9.81);
    rod.inputs.wind = Vector3d(2.0, -1.0, 0.5);   // m/s; mass damping knows no wind
    const Vector3d terminal = rod.inputs.gravity / rate + (by_drag ? rod.inputs.wind : Vector3d::Zero());
    RodStepper stepper(rod.model, time());
    const double h = is(Integrator::symplectic_euler) ? 1e-4 : 1e-2;
    const int steps = static_cast<int>(std::lround(1.0 / h));
    for (int k = 1; k <= steps; ++k)
    {
      ASSERT_TRUE(stepper.step(rod.state, rod.inputs, h).ok);
      if (order(GetParam()) == 1)   // (1 + h rate) v1 = v0 + h rate v_terminal, both Euler methods
      {
        const Vector3d expected = terminal * (1 - std::pow(1 + h * rate, -k));
        EXPECT_LT((rod.state.v.colwise() - expected).cwiseAbs().maxCoeff(), 1e-9) << k;
      }
    }
    // the solution v_t (1 - exp(-rate t)), error (rate h)^2 / 12 of it for second order, rate h / 2 for first
    const Vector3d exact = terminal * (1 - std::exp(-rate));
    const double error = order(GetParam()) == 2 ? rate * h * rate * h : rate * h;
    EXPECT_LT((rod.state.v.colwise() - exact).cwiseAbs().maxCoeff(),
              error * terminal.norm() * rate * std::exp(-rate) + 1e-9);
  }
}

TEST_P(FreeMotion, ARestingLoopStays)
{
  // Naturally curved ring at rest, and a naturally straight one bent to a ring: by symmetry neither moves, but for the
  // second's uniform stretch, B / (R^2 EA) = (r / 2R)^2.
  for (bool straight : {false, true})
  {
    const int n = 24;
    const double radius = 0.1, r = 0.004;
    const Matrix3Xd nodes = ringNodes(n, radius);
    Rod rod(buildRod("ring", nodes, true, uniformSections(roundSection(r, 1e6, 1000), n), Vector3d::Zero(), straight),
            nodes);
    rod.inputs.gravity.setZero();
    RodStepper stepper(rod.model, time());
    const double h = is(Integrator::symplectic_euler) ? 5e-5 : 1e-3;
    for (int k = 0; k < 100; ++k)
      ASSERT_TRUE(stepper.step(rod.state, rod.inputs, h).ok);
    const double moved = (rod.state.x - nodes).colwise().norm().maxCoeff();
    // a straight rod's ring breathes by twice its static stretch at most
    EXPECT_LT(moved, straight ? 2.1 * radius * std::pow(r / (2 * radius), 2) : 1e-13);
    EXPECT_LT(rod.state.x.row(2).cwiseAbs().maxCoeff(), 1e-9);
    EXPECT_LT(rod.state.twist.cwiseAbs().maxCoeff(), 1e-9);
  }
}

INSTANTIATE_TEST_SUITE_P(All, FreeMotion, ::testing::ValuesIn(allIntegrators()),
                         [](const auto& info) { return toString(info.param); });

}   // namespace
}   // namespace slender::test
