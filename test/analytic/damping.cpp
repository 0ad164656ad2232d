// Rayleigh damping of a vibrating cantilever: damping ratio alpha / (2 omega) + beta omega / 2 for mass and stiffness
// damping alpha, beta.
#include <Eigen/Eigenvalues>
#include <gtest/gtest.h>

#include "test/support/trial.h"

namespace slender::test {
namespace {

struct Mode
{
  double omega;            ///< [rad/s]
  Eigen::VectorXd shape;   ///< transverse, unit in the mass
};

/// Transverse modes of the discrete cantilever, from differences of its gradient (exact: where it is straight no angle
/// has a torque).
Mode transverseMode(const Rod& rod, int number)
{
  const int n = rod.model->nodes(), free = n - 1;
  RodSystem system(*rod.model);
  system.load(rod.state);
  const double step = 1e-6;
  Eigen::MatrixXd k(free, free);
  for (int j = 0; j < free; ++j)
  {
    Eigen::VectorXd q = Eigen::VectorXd::Zero(4 * n);
    q[4 * (j + 1) + 2] = step;
    evaluateAt(system, rod.state, q);
    const Eigen::VectorXd up = gradientOf(system);
    evaluateAt(system, rod.state, -q);
    const Eigen::VectorXd down = gradientOf(system);
    for (int i = 0; i < free; ++i)
      k(i, j) = (up[4 * (i + 1) + 2] - down[4 * (i + 1) + 2]) / (2 * step);
  }
  const Eigen::VectorXd mass = rod.model->mass.tail(free);
  const Eigen::GeneralizedSelfAdjointEigenSolver<Eigen::MatrixXd> modes(0.5 * (k + k.transpose()),
                                                                        mass.asDiagonal().toDenseMatrix());
  return {std::sqrt(modes.eigenvalues()[number]), modes.eigenvectors().col(number)};
}

struct Case
{
  Integrator integrator;
  double mass_damping, stiffness_damping;
  int mode;
};

class RayleighDamping : public ::testing::TestWithParam<Case>
{};

TEST_P(RayleighDamping, RatioOfAMode)
{
  const Case& c = GetParam();
  const int n = 15;
  Rod rod = straightRod(n, 0.5, roundSection(0.004, 1e7, 1100));
  rod.hold(0, 0);
  rod.model->mass_damping = c.mass_damping;
  rod.model->stiffness_damping = c.stiffness_damping;
  const Mode mode = transverseMode(rod, c.mode);
  const double ratio = c.mass_damping / (2 * mode.omega) + 0.5 * c.stiffness_damping * mode.omega;
  ASSERT_GT(ratio, 0.005);
  ASSERT_LT(ratio, 0.3);

  const double amplitude = 1e-6 / mode.shape.cwiseAbs().maxCoeff();   // [m], nothing nonlinear at 2e-6 of the length
  for (int i = 1; i < n; ++i)
    rod.state.x(2, i) = amplitude * mode.shape[i - 1];
  const double damped = mode.omega * std::sqrt(1 - ratio * ratio);
  const int per_period = c.integrator == Integrator::symplectic_euler ? 20000 : 400;
  const double h = 2 * M_PI / damped / per_period;
  TimeConfig time = withIntegrator(c.integrator);
  time.newton.tolerance = 1e-13;
  RodStepper stepper(rod.model, time);
  const int periods = c.integrator == Integrator::symplectic_euler ? 1 : 2;
  for (int k = 0; k < periods * per_period; ++k)
    ASSERT_TRUE(stepper.step(rod.state, rod.inputs, h).ok);
  // q'' + 2 ratio omega q' + omega^2 q = 0 from rest: after whole periods q = q0 exp(-ratio omega t)
  const double q =
      mode.shape.dot(rod.model->mass.tail(n - 1).cwiseProduct(rod.state.x.row(2).tail(n - 1).transpose())) / amplitude;
  const double expected = std::exp(-ratio * mode.omega * periods * per_period * h);
  // time error: (omega h)^2 / 12 of a phase of 4 pi, met at a maximum; symplectic Euler omega h / 2
  EXPECT_NEAR(q / expected, 1.0, 2e-3) << "ratio " << ratio << " omega " << mode.omega;
}

INSTANTIATE_TEST_SUITE_P(
    Cases, RayleighDamping,
    ::testing::Values(Case{Integrator::implicit_midpoint, 0.0, 5e-3, 0},
                      Case{Integrator::implicit_midpoint, 1.0, 0.0, 0}, Case{Integrator::tr_bdf2, 1.0, 3e-3, 0},
                      Case{Integrator::tr_bdf2, 2.0, 1e-3, 1}, Case{Integrator::bdf2, 1.0, 3e-3, 0},
                      Case{Integrator::generalized_alpha, 1.0, 3e-3, 1},
                      Case{Integrator::symplectic_euler, 1.0, 1e-3, 1}),
    [](const auto& info) { return std::string(toString(info.param.integrator)) + "_" + std::to_string(info.index); });

}   // namespace
}   // namespace slender::test
