#include "cloth_work.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <stdexcept>

namespace slender {

ClothWork::ClothWork(std::shared_ptr<const ClothModel> m, const ClothOptions& o, bool with_averages)
  : model(std::move(m)),
    options(o),
    plastic_(*model),
    with_averages_(with_averages)
{
  buildSystem(*model);
  const std::string who = "cloth '" + model->name + "': ";
  if (o.integrator != Integrator::implicit_euler && o.integrator != Integrator::tr_bdf2 && !isExplicit())
    throw std::invalid_argument(who + "integrator must be implicit_euler, tr_bdf2, imex or symplectic_euler");
  if (o.integrator == Integrator::imex && model->bending == BendingModel::hinge)
    throw std::invalid_argument(who +
                                "imex needs a constant matrix, which only isometric bending of a flat rest shape has: "
                                "use implicit_euler or tr_bdf2, "
                                "or bending: {model: none}");
  if (!(o.error_tolerance >= 0) || !std::isfinite(o.error_tolerance) || !(o.min_step > 0))
    throw std::invalid_argument(who + "error_tolerance must be zero or more, min_step positive");
  if (o.error_tolerance > 0 && isExplicit())
    throw std::invalid_argument(who +
                                "error_tolerance is for implicit_euler and tr_bdf2; leave it out, or use one of these");
  if (!(o.linear_tolerance > 0 && o.linear_tolerance < 1))
    throw std::invalid_argument(who + "linear_tolerance must be in (0, 1)");
  checkBending(*model);
  for (const double value :
       {model->bending_modulus, model->mass_damping, model->stiffness_damping, model->wind_coefficient})
    if (!(value >= 0) || !std::isfinite(value))
      throw std::invalid_argument(who + "bending modulus, damping and wind coefficient must be zero or more");
  if (model->mass.size() != model->vertices() || !(model->mass.minCoeff() > 0))
    throw std::invalid_argument(who + "every vertex needs a mass");
  for (const PrescribedAverages& set : model->averages)
  {
    if (set.weights->cols() != model->vertices())
      throw std::invalid_argument(who + "averages of " + std::to_string(set.weights->cols()) + " vertices do not fit");
    if (set.count() == 0)
      throw std::invalid_argument(who + "a set of averages is empty: leave it out");
    if (o.integrator != Integrator::implicit_euler)
      throw std::invalid_argument(who + "prescribed averages need time.integrator: implicit_euler");
    if (o.solver == ClothSolver::cholesky)
      throw std::invalid_argument(who + "prescribed averages need solver.linear: gauss_seidel (or auto)");
    if ((set.bounds.size() > 0) != (model->averages[0].bounds.size() > 0))
      throw std::invalid_argument(who +
                                  "bounds of forces are for all sets of averages or for none (infinite: without)");
    if (set.bounds.size() == 0)
      continue;
    if (set.bounds.size() != set.count() || !(set.bounds.array() > 0).all())
      throw std::invalid_argument(who + "bounds of forces must be positive, one per average");
    if (!o.one_newton_step)
      throw std::invalid_argument(
          who + "bounded forces of averages need solver: {one_newton_step: true}; set it, or leave out the bounds");
  }
  shortest_edge_ = std::numeric_limits<double>::infinity();
  for (Eigen::Index e = 0; e < model->topology.edges.cols(); ++e)
    shortest_edge_ = std::min(shortest_edge_, (model->rest.vertices.col(model->topology.edges(0, e)) -
                                               model->rest.vertices.col(model->topology.edges(1, e)))
                                                  .norm());
  for (PointVector* v : {&x, &trial_, &d_, &pin_motion_, &v_, &force_, &x_start_, &v_start_, &a_start_, &x_stage_,
                         &v_stage_, &q_hat_, &q_tilde_, &guess_})
    v->assign(4 * model->vertices(), 0.0);
  useBudget(nullptr);
}

void ClothWork::buildSystem(const ClothModel& of)
{
  linear.reset();
  system = std::make_unique<ClothSystem>(of, options.solver == ClothSolver::cholesky);
  averages = nullptr;
  if (of.averages.empty() || !with_averages_)
    linear = std::make_unique<ClothLinearSolver>(options, *system);
  else
  {
    auto averaged = std::make_unique<AveragedClothSolver>(of, options, *system);
    averages = averaged.get();
    linear = std::move(averaged);
  }
  useConstantMatrix();
}

void ClothWork::useBudget(std::shared_ptr<WorkBudget> budget)
{
  own_budget_ = budget == nullptr;
  budget_ = own_budget_ ? std::make_shared<WorkBudget>() : std::move(budget);
  system->useBudget(*budget_);
  linear->useBudget(*budget_);
}

void ClothWork::begin(const ClothState& state, const ClothInputs& inputs, double duration)
{
  followClamps(state);
  work_ = state;
  plastic_.flow(work_, duration);   // at the start, which sees what collisions made of the last step (thesis 6.4.4)
  pins_start_.resize(3, static_cast<Eigen::Index>(state.pins.size()));
  for (std::size_t k = 0; k < state.pins.size(); ++k)
    pins_start_.col(static_cast<Eigen::Index>(k)) = state.x.col(state.pins[k]);
  if (averages)
  {
    averages->use(state);
    toPoints(state.x, x);
    averages->averagesOf(x, averages_start_);
  }
  inputs_ = &inputs;
  duration_ = duration;
}

void ClothWork::combine(const Combination& c, PointVector& result) const
{
  for (std::size_t i = 0; i < result.size(); ++i)
    result[i] = c[kQ] * x_start_[i] + c[kV] * v_start_[i] + c[kA] * a_start_[i] + c[kQStage] * x_stage_[i] +
                c[kVStage] * v_stage_[i];
}

Eigen::Vector3d ClothWork::pinAt(std::size_t pin, double fraction) const
{
  const auto k = static_cast<Eigen::Index>(pin);
  const auto end = inputs_->pins.col(k);
  return fraction >= 1.0 ? Eigen::Vector3d(end)
                         : Eigen::Vector3d(pins_start_.col(k) + fraction * (end - pins_start_.col(k)));
}

void ClothWork::beginSubstep(const StepPlan& plan, const Substep& substep)
{
  plan_ = &plan;
  substep_ = substep;
  toPoints(work_.x, x_start_);
  toPoints(work_.v, v_start_);
  system->hold(work_);
  at_bound_ = work_.at_bound;
  if (averages)
    averages_ = averages_start_ + substep.to / duration_ * (inputs_->averages - averages_start_);
  if (order(options.integrator) == 2)
  {
    const ClothEvaluation here = acceleration(plan.stages[0].tau_v);
    energy_start_ = elastic_start_ =
        model->stiffness_damping > 0 ? system->elasticEnergy(x_start_) : here.membrane + here.bending;
  }
}

void ClothWork::beginStage(std::size_t s)
{
  const Stage& stage = plan_->stages[s];
  const int n = model->vertices();
  const double h = substep_.length, reached = s == 0 ? 0.0 : plan_->stages[s - 1].time;
  const bool second_order = order(options.integrator) == 2;
  const PointVector& start = s == 0 ? x_start_ : x_stage_;
  const PointVector& velocity = s == 0 ? v_start_ : v_stage_;
  combine(stage.q_hat, q_hat_);
  combine(stage.q_tilde, q_tilde_);
  for (int i = 0; i < n; ++i)
    point(guess_, i) = point(start, i) + (stage.time - reached) * h * point(velocity, i);
  std::fill(pin_motion_.begin(), pin_motion_.end(), 0.0);
  for (std::size_t k = 0; k < work_.pins.size(); ++k)
    point(pin_motion_, work_.pins[k]) =
        pinAt(k, (stage.time == 1.0 ? substep_.to : substep_.from + stage.time * h) / duration_) -
        point(start, work_.pins[k]);
  if (model->stiffness_damping > 0)
  {
    for (std::size_t i = 0; i < trial_.size(); ++i)
      trial_[i] = stage.q_tilde[kV] * v_start_[i];
    system->setViscosity(model->stiffness_damping / stage.tau_v, x_start_, stage.q_tilde[kV] != 0 ? &trial_ : nullptr,
                         stage.q_tilde[kQStage], &x_stage_);
  }
  if (!system->loads().empty())
  {
    wind_v_ = work_.v;
    for (int i = 0; i < n && second_order; ++i)
      wind_v_.col(i) += stage.time * h * point(a_start_, i);
  }
  system->beginStage({stage.tau_v, &q_hat_, &q_tilde_, &start, second_order ? &guess_ : &start, &wind_v_}, *inputs_);
  linear->beginStage();
}

void ClothWork::placeGuess()
{
  for (int i = 0; i < model->vertices(); ++i)
    point(x, i) = system->held()[i] ? Eigen::Vector3d(point(system->start(), i) + point(pin_motion_, i))
                                    : Eigen::Vector3d(point(guess_, i));
  meetAverages();
}

void ClothWork::meetAverages()
{
  if (averages)
    averages->meetAverages(averages_, x);
}

void ClothWork::endStage(std::size_t s)
{
  const Stage& stage = plan_->stages[s];
  for (int i = 0; i < model->vertices(); ++i)
  {
    const Eigen::Vector3d q = point(x, i);
    point(v_stage_, i) = system->held()[i] ? Eigen::Vector3d((q - point(x_start_, i)) / (stage.time * substep_.length))
                                           : Eigen::Vector3d((q - point(q_tilde_, i)) / stage.tau_v);
  }
  x_stage_ = x;
}

double ClothWork::largestInternal() const
{
  double largest = 0.0;
  for (int i = 0; i < model->vertices(); ++i)
    largest = std::max(largest, system->internalGradient(i).norm());
  return largest;
}

double ClothWork::resolvedForce() const
{
  return options.newton.tolerance * (model->membrane.c11 + model->membrane.c22) * shortest_edge_;
}

void ClothWork::finish(double internal, double max_strain, StepReport& report)
{
  const Stage& stage = plan_->stages.back();
  const double h = substep_.length;
  next_ = work_;
  next_.at_bound = at_bound_;
  const bool second_order = order(options.integrator) == 2;
  double unbalanced = 0.0, force = std::max(resolvedForce(), internal), jump = 0.0;
  for (int i = 0; i < model->vertices(); ++i)
  {
    const bool held = system->held()[i];
    const double size = point(system->gradient(), i).norm();
    (held ? force : unbalanced) = std::max(held ? force : unbalanced, size);
    const Eigen::Vector3d q = point(x, i), a = (q - point(q_hat_, i)) / (stage.tau_a * stage.tau_a);
    force = std::max({force, model->mass[i] * a.norm(), model->mass[i] * inputs_->gravity.norm()});
    if (!held)
      jump = std::max(jump, second_order ? (a - point(a_start_, i)).norm() : a.norm());
    next_.v.col(i) =
        held ? Eigen::Vector3d((q - point(x_start_, i)) / h) : Eigen::Vector3d((q - point(q_tilde_, i)) / stage.tau_v);
    next_.x.col(i) = q;
  }
  report.residual = std::max(report.residual, unbalanced / force);
  report.max_strain = std::max(report.max_strain, max_strain);
  if (options.error_tolerance > 0)
    report.error_estimate = std::max(report.error_estimate, errorConstant(options.integrator) * h * h * jump);
  pin_forces.resize(3, static_cast<Eigen::Index>(work_.pins.size()));
  for (std::size_t k = 0; k < work_.pins.size(); ++k)
  {
    next_.x.col(work_.pins[k]) = pinAt(k, substep_.to / duration_);
    // a pin's speed changes at the start of the step: its inertia over the whole step counts, not that at the end,
    // which the last stage guesses from both
    const int p = work_.pins[k];
    const Eigen::Vector3d inertia =
        (point(x, p) - point(q_hat_, p)) / (stage.tau_a * stage.tau_a) - (next_.v.col(p) - work_.v.col(p)) / h;
    pin_forces.col(static_cast<Eigen::Index>(k)) = model->mass[p] * inertia - point(system->gradient(), p);
  }
}

ClothEnergies ClothWork::energies(const ClothState& state, const Eigen::Vector3d& gravity)
{
  ClothEnergies result;
  followClamps(state);
  PointVector at;
  toPoints(state.x, at);
  PointVector unused(at.size(), 0.0);
  system->usePlasticState(state);
  system->setViscosity(0.0, at);
  const ClothEvaluation e = system->addInternal(at, unused);
  result.membrane = e.membrane;
  result.bending = e.bending;
  for (int i = 0; i < model->vertices(); ++i)
  {
    result.kinetic += 0.5 * model->mass[i] * state.v.col(i).squaredNorm();
    result.gravity -= model->mass[i] * gravity.dot(state.x.col(i));
  }
  return result;
}

/// Elastic and viscous forces at (x, v_), wind, gravity and extra forces into force_. Mass damping is left out.
ClothEvaluation ClothWork::addForces(bool with_constant)
{
  std::fill(d_.begin(), d_.end(), 0.0);
  const ClothEvaluation here = system->addInternal(x, d_, with_constant);
  std::fill(force_.begin(), force_.end(), 0.0);
  for (const auto& load : system->loads())
    load->addForces(x, v_, inputs_->wind, force_);
  for (int i = 0; i < model->vertices(); ++i)
  {
    point(force_, i) += model->mass[i] * inputs_->gravity - point(d_, i);
    if (inputs_->forces.cols() > 0)
      point(force_, i) += inputs_->forces.col(i);
  }
  return here;
}

/// a_start_ = F(x, v) / m at the start of a step; `delta`: a time over which strain rates are found to second order
/// [s].
ClothEvaluation ClothWork::acceleration(double delta)
{
  x = x_start_;
  v_ = v_start_;
  if (model->stiffness_damping > 0)
  {
    for (std::size_t i = 0; i < trial_.size(); ++i)
      trial_[i] = -delta * v_[i];
    system->setViscosity(model->stiffness_damping / delta, x, &trial_, 0.0, nullptr);
  }
  const ClothEvaluation here = addForces(true);
  for (int i = 0; i < model->vertices(); ++i)
    point(a_start_, i) = system->held()[i]
                             ? Eigen::Vector3d(0, 0, 0)
                             : Eigen::Vector3d(point(force_, i) / model->mass[i] - model->mass_damping * point(v_, i));
  return here;
}

}   // namespace slender
