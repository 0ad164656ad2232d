// Here the edges of a rod get inertia about their tangents in implicit substeps. Rods that friction does not turn have
// no such inertia: their frames are in equilibrium at every instant (thesis 4.3).
#include "rod_work.h"

namespace slender {

void RodWork::keepSpins()
{
  spins = true;
  system.keepSpins();
}

/// Does what combine() does for positions, for the turn of an edge since the substep began.
double RodWork::combineTurn(const Combination& c, int j) const
{
  double sum = c[kV] * work.spin[j];
  if (c[kA] != 0)
    sum += c[kA] * work.spin_rate[j];
  if (c[kQPrevious] != 0)
    sum += c[kVPrevious] * work.spin_previous[j] - c[kQPrevious] * work.turn_previous[j];
  if (c[kQStage] != 0)
    sum += c[kQStage] * stage_turn[j] + c[kVStage] * stage_spin[j];
  return sum;
}

/// Completes the state: spins and memory of spins that it does not have yet are zero.
void RodWork::beginSpins()
{
  const bool multistep = work.x_previous.cols() > 0, accelerated = work.a.cols() > 0;
  const auto complete = [&](Eigen::VectorXd& v) {
    if (v.size() == 0)
      v.setZero(model->edges());
  };
  complete(work.spin);
  if (accelerated)
    complete(work.spin_rate);
  if (multistep)
  {
    complete(work.spin_previous);
    complete(work.turn_previous);
  }
  stage_turn.resize(model->edges());
  stage_spin.resize(model->edges());
}

void RodWork::beginSpinStage(std::size_t s, double h)
{
  const Stage& stage = plan->stages[s];
  const double inertia = 1.0 / (stage.tau_a * stage.tau_a), damping = model->mass_damping / stage.tau_v;
  for (int j = 0; j < model->edges(); ++j)
  {
    const double target =
        (inertia * combineTurn(stage.q_hat, j) + damping * combineTurn(stage.q_tilde, j)) / (inertia + damping);
    system.setSpin(j, model->spin_inertia[j] * (inertia + damping), target);
    system.setTurn(j, s == 0 ? stage.time * h * work.spin[j] : (1 - plan->stages[0].time) * h * stage_spin[j]);
  }
}

void RodWork::endSpinStage(std::size_t s)
{
  const Stage& stage = plan->stages[s];
  for (int j = 0; j < model->edges(); ++j)
  {
    stage_turn[j] = system.turn(j);
    stage_spin[j] = (stage_turn[j] - combineTurn(stage.q_tilde, j)) / stage.tau_v;
  }
}

void RodWork::finishSpins()
{
  const Stage& stage = plan->stages.back();
  for (int j = 0; j < model->edges(); ++j)
  {
    const double turn = system.turn(j);
    next.spin[j] = (turn - combineTurn(stage.q_tilde, j)) / stage.tau_v;
    if (next.spin_rate.size() > 0)
    {
      const double rate = (turn - combineTurn(stage.q_hat, j)) / (stage.tau_a * stage.tau_a);
      next.spin_rate[j] = work.spin_rate[j] + (rate - work.spin_rate[j]) / plan->a_fraction;
    }
    if (time.integrator == Integrator::bdf2)
    {
      next.turn_previous.resize(model->edges());
      next.turn_previous[j] = turn;
    }
  }
  if (time.integrator == Integrator::bdf2)
    next.spin_previous = work.spin;
}

}   // namespace slender
