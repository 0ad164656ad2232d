#include "slender_sim/dynamics/integrator.h"

#include <algorithm>
#include <cmath>

namespace slender {

long stepsUntil(double end, double step)
{
  return static_cast<long>(std::clamp(std::ceil(end / step * (1 - 1e-12) - 1e-9), 1.0, 1e15));
}

const char* toString(Integrator integrator)
{
  static const char* const words[] = {"implicit_euler",   "bdf2", "tr_bdf2", "implicit_midpoint", "generalized_alpha",
                                      "symplectic_euler", "imex"};
  return words[static_cast<int>(integrator)];
}

namespace {

/// A stage with v = (q - qTilde) / tau and a = (v - vTilde) / tau, so qHat = qTilde + tau vTilde.
Stage differenceStage(double time, double tau, const Combination& q_tilde, const Combination& v_tilde)
{
  Stage stage{time, tau, tau, {}, q_tilde};
  for (int k = 0; k < kHistoryCount; ++k)
    stage.q_hat[k] = q_tilde[k] + tau * v_tilde[k];
  return stage;
}

Stage trapezoid(double time, double h)
{
  Combination q{}, v{};
  q[kQ] = 1.0;
  q[kV] = 0.5 * h;
  v[kV] = 1.0;
  v[kA] = 0.5 * h;
  return differenceStage(time, 0.5 * h, q, v);
}

Stage backwardDifference(double tau, double newest, double oldest, History q_newest, History v_newest, History q_oldest,
                         History v_oldest)
{
  Combination q{}, v{};
  q[q_newest] = newest;
  q[q_oldest] += oldest;
  v[v_newest] = newest;
  v[v_oldest] += oldest;
  return differenceStage(1.0, tau, q, v);
}

}   // namespace

void planStep(Integrator integrator, double spectral_radius, double h, double previous_step, StepPlan& plan)
{
  plan.integrator = integrator;
  plan.stages.clear();
  plan.fraction = plan.a_fraction = 1.0;
  plan.needs_acceleration = false;
  switch (integrator)
  {
    case Integrator::bdf2:
      if (previous_step > 0)
      {
        const double r = h / previous_step;
        plan.stages.push_back(backwardDifference(h * (1 + r) / (1 + 2 * r), (1 + r) * (1 + r) / (1 + 2 * r),
                                                 -r * r / (1 + 2 * r), kQ, kV, kQPrevious, kVPrevious));
        return;
      }
      break;   // starts with implicit Euler: one first-order step leaves the whole of second order
    case Integrator::tr_bdf2:
    {
      const double g = 2.0 - std::sqrt(2.0);
      plan.needs_acceleration = true;
      plan.stages.push_back(trapezoid(g, g * h));
      plan.stages.push_back(backwardDifference(0.5 * g * h, 1.0 / (g * (2 - g)), -(1 - g) * (1 - g) / (g * (2 - g)),
                                               kQStage, kVStage, kQ, kV));
      return;
    }
    case Integrator::implicit_midpoint:
    {
      Combination q{}, v{};
      q[kQ] = v[kV] = 1.0;
      plan.stages.push_back(differenceStage(0.5, 0.5 * h, q, v));
      plan.fraction = 0.5;
      return;
    }
    case Integrator::generalized_alpha:
    {
      const double rho = spectral_radius;
      const double alpha_m = (2 * rho - 1) / (rho + 1), alpha_f = rho / (rho + 1);
      const double gamma = 0.5 - alpha_m + alpha_f, beta = 0.25 * (1 - alpha_m + alpha_f) * (1 - alpha_m + alpha_f);
      const double c = 1 - alpha_f;
      Stage stage{};
      stage.time = c;
      stage.tau_a = h * std::sqrt(beta * c / (1 - alpha_m));
      stage.tau_v = beta * h / gamma;
      // with the Newmark relations q1 = q + h v + h^2 ((1/2 - beta) a + beta a1), v1 = v + h ((1 - gamma) a + gamma a1)
      stage.q_hat[kQ] = 1.0;
      stage.q_hat[kV] = c * h;
      stage.q_hat[kA] = c * h * h * (0.5 - beta) - stage.tau_a * stage.tau_a * alpha_m;
      stage.q_tilde[kQ] = 1.0;
      stage.q_tilde[kV] = c * h - stage.tau_v;
      stage.q_tilde[kA] = c * h * h * (0.5 - beta) - stage.tau_v * c * h * (1 - gamma);
      plan.stages.push_back(stage);
      plan.fraction = c;
      plan.a_fraction = 1 - alpha_m;
      plan.needs_acceleration = true;
      return;
    }
    default: break;
  }
  Combination q{}, v{};
  q[kQ] = v[kV] = 1.0;
  plan.stages.push_back(differenceStage(1.0, h, q, v));
}

double errorConstant(Integrator integrator)
{
  switch (integrator)
  {
    case Integrator::bdf2: return 2.0 / 9.0;
    case Integrator::tr_bdf2: return 0.0404;   // (3 g^2 - 4 g + 2) / (12 (2 - g))
    case Integrator::implicit_midpoint:
    case Integrator::generalized_alpha: return 1.0 / 12.0;
    default: return 0.5;
  }
}

bool isExplicit(Integrator integrator)
{
  return integrator == Integrator::symplectic_euler || integrator == Integrator::imex;
}

int order(Integrator integrator) { return integrator == Integrator::implicit_euler || isExplicit(integrator) ? 1 : 2; }

}   // namespace slender
