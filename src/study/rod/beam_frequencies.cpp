#include <cmath>
#include <stdexcept>
#include <string>
#include <vector>

#include "rod_cases.h"
#include "study/framework/cpu_clock.h"
#include "slender_sim/study/reference.h"
#include "slender_sim/study/study.h"

namespace slender::study {
namespace {

struct Oscillation
{
  double omega;   ///< [rad/s]
  double decay;   ///< part of the amplitude lost per period
  double cpu_seconds;
};

/// Fits q_{k+1} - 2 rho cos(d) q_k + rho^2 q_{k-1} = 0 by least squares: d the phase and rho the factor between
/// samples.
Oscillation fit(const std::vector<double>& q, double interval)
{
  double a11 = 0, a12 = 0, a22 = 0, r1 = 0, r2 = 0;
  for (std::size_t k = 1; k + 1 < q.size(); ++k)
  {
    a11 += q[k] * q[k];
    a12 -= q[k] * q[k - 1];
    a22 += q[k - 1] * q[k - 1];
    r1 += q[k] * q[k + 1];
    r2 -= q[k - 1] * q[k + 1];
  }
  const double determinant = a11 * a22 - a12 * a12;
  const double b = (r1 * a22 - a12 * r2) / determinant, c = (a11 * r2 - a12 * r1) / determinant;
  const double rho = std::sqrt(c), phase = std::acos(b / (2 * rho));
  return {phase / interval, 1 - std::pow(rho, 2 * M_PI / phase), 0};
}

/// Lets the rod go in the shape of its k-th mode, 1e-4 L at the tip, and follows that mode for six periods.
Oscillation vibrate(int mode, int edges, Integrator integrator, int steps_per_period)
{
  RodCase c;   // EI = rho A = L = 1
  c.edges = edges;
  c.stretch = 4e4;   // slenderness L/r = 100
  RodSetup rod = straightRod(c);
  rod.hold(0, 0, true);

  // Bent without stretching: every edge keeps its length and takes the slope of the mode at its middle.
  const double amplitude = 1e-4, h = 1.0 / edges;
  Eigen::Matrix3Xd nodes = rod.state.x;
  for (int i = 0; i < edges; ++i)
  {
    const double sine = amplitude / 2 * cantileverModeSlope(mode, (i + 0.5) * h);
    nodes.col(i + 1) = nodes.col(i) + h * Eigen::Vector3d(std::sqrt(1 - sine * sine), 0, sine);
  }
  const RodState bent = makeRodState(*rod.model, nodes, Eigen::Vector3d::UnitY());
  rod.state.x = bent.x;
  rod.state.d1 = bent.d1;
  rod.state.twist = bent.twist;

  Eigen::VectorXd weights(edges + 1);
  for (int i = 0; i <= edges; ++i)
    weights[i] = rod.model->mass[i] * cantileverMode(mode, i * h);

  const double root = cantileverRoot(mode), period = 2 * M_PI / (root * root), step = period / steps_per_period;
  const int stride = std::max(1, steps_per_period / 12);
  RodStepper stepper(rod.model, timeConfig(integrator, step, 1e-11));
  std::vector<double> samples;
  const double start = threadSeconds();
  for (int i = 1; i <= 6 * steps_per_period; ++i)
  {
    require(stepper.step(rod.state, rod.inputs, step), "vibrating beam");
    if (i % stride == 0 && i >= steps_per_period / 4)   // multistep methods have started by then
      samples.push_back(rod.state.x.row(2).dot(weights));
  }
  Oscillation o = fit(samples, stride * step);
  o.cpu_seconds = threadSeconds() - start;
  return o;
}

}   // namespace

void runBeamFrequencies(StudyContext& context)
{
  // Relative bounds at 40 edges: the for modes 1 and 4; modes 2 and 3 in the ratio of the discrete rod's own
  // errors.
  const double bounds[] = {0.001, 0.0033, 0.0070, 0.012};
  const std::vector<int> meshes = context.quick() ? std::vector<int>{40} : std::vector<int>{20, 40, 80, 160};
  const int fine_steps = context.quick() ? 400 : 1000;
  Plot& plot = context.plot("beam_frequencies", "Clamped-free rod: frequency error against resolution", "edges",
                            "relative error of the frequency");
  Plot& damping = context.plot("beam_damping", "Numerical damping of the first mode", "steps per period",
                               "amplitude lost per period");
  int done = 0;
  const int total = 4 * static_cast<int>(meshes.size()) + 20;
  for (const int edges : meshes)
    for (int mode = 1; mode <= 4; ++mode)
    {
      context.progress(done++, total, std::to_string(edges) + " edges, mode " + std::to_string(mode));
      const double expected = std::pow(cantileverRoot(mode), 2);
      const Oscillation o = vibrate(mode, edges, Integrator::implicit_midpoint, fine_steps);
      const double finer = 40.0 / edges;
      Row& row = context.row();
      row.set("quantity", "frequency")
          .set("integrator", toString(Integrator::implicit_midpoint))
          .set("mode", mode)
          .set("edges", edges);
      row.set("steps_per_period", fine_steps);
      row.check(o.omega, expected, expected * bounds[mode - 1] * finer * finer, "cos(x) cosh(x) = -1");
      row.set("relative_error", o.omega / expected - 1)
          .set("loss_per_period", o.decay)
          .set("cpu_seconds", o.cpu_seconds);
      Series& s = plot.at("mode " + std::to_string(mode));
      s.x.push_back(edges);
      s.y.push_back(std::abs(o.omega / expected - 1));
    }

  // Time error alone: against the same mesh with short steps.
  const int edges = 40;
  const Oscillation exact = vibrate(1, edges, Integrator::implicit_midpoint, 2000);
  for (const Integrator integrator : implicitIntegrators())
    for (const int steps : context.quick() ? std::vector<int>{24, 96} : std::vector<int>{24, 48, 96, 192})
    {
      context.progress(done++, total, std::string("damping of ") + toString(integrator));
      const Oscillation o = vibrate(1, edges, integrator, steps);
      context.row()
          .set("quantity", "time error")
          .set("integrator", toString(integrator))
          .set("mode", 1)
          .set("edges", edges)
          .set("steps_per_period", steps)
          .set("relative_error", o.omega / exact.omega - 1)
          .set("loss_per_period", o.decay)
          .set("cpu_seconds", o.cpu_seconds);
      Series& s = damping.at(toString(integrator));
      s.x.push_back(steps);
      s.y.push_back(std::abs(o.decay));
    }
  context.note(
      "loss_per_period: numerical damping, 1 - amplitude ratio over one period. Frequencies in sqrt(E I/(rho A L^4)).");
}

const StudyRegistration kBeamFrequenciesRegistration{
    "beam_frequencies", "natural frequencies of the clamped-free rod, and each integrator's numerical damping",
    runBeamFrequencies};

}   // namespace slender::study
