#include "slender_sim/cloth/cloth_stepper.h"

#include <algorithm>
#include <cmath>
#include <functional>
#include <limits>
#include <stdexcept>

#include "cloth_stepper_impl.h"
#include "slender_sim/linalg/interruption.h"

namespace slender {

ClothStepper::Impl::Impl(std::shared_ptr<const ClothModel> m, const ClothOptions& o)
  : model(std::move(m)),
    options(o),
    system(std::make_unique<ClothSystem>(*model, o)),
    plastic_(*model)
{
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
    if (o.solver == ClothSolver::cholesky || o.solver == ClothSolver::gauss_seidel)
      throw std::invalid_argument(who + "prescribed averages need solver: conjugate_gradients (or auto)");
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
  for (PointVector* v : {&x_, &best_, &trial_, &d_, &pin_motion_, &v_, &force_, &x_start_, &v_start_, &a_start_,
                         &x_stage_, &v_stage_, &q_hat_, &q_tilde_, &guess_})
    v->assign(4 * model->vertices(), 0.0);
  plan_.stages.reserve(2);
  useBudget(nullptr);
  useConstantMatrix();
}

bool ClothStepper::Impl::inputsFine(const ClothState& s, const ClothInputs& inputs, double duration,
                                    std::string& what) const
{
  const int n = model->vertices();
  const auto check = [&](bool good, const char* name) {
    if (!good && what.empty())
      what = name;
    return good;
  };
  check(duration > 0 && std::isfinite(duration), "step length (must be positive)");
  check(inputs.gravity.allFinite(), "gravity");
  check(inputs.wind.allFinite(), "wind");
  check(inputs.forces.cols() == 0 || inputs.forces.cols() == n, "number of forces (one per vertex, or none)");
  check(inputs.forces.allFinite(), "forces");
  check(inputs.pins.cols() == static_cast<Eigen::Index>(s.pins.size()),
        "number of pin positions (one per pin of the state)");
  check(inputs.pins.allFinite(), "pin positions");
  const PrescribedAverages* prescribed = model->averagesOf(s);
  check(prescribed || (model->averages.empty() && s.average_set == 0),
        "set of averages of the state (one of the model's)");
  check(inputs.averages.cols() == (prescribed ? prescribed->count() : 0),
        "number of averages (one per average of the set)");
  check(inputs.averages.allFinite(), "averages");
  check(s.x.cols() == n && s.v.cols() == n, "number of vertices of the state");
  check(s.x.allFinite() && s.v.allFinite() && s.next_step >= 0, "the state");
  check(model->bending != BendingModel::hinge ||
            (s.rest_angles.size() == model->topology.hingeCount() && s.rest_angles.allFinite()),
        "rest angles of the state (one per hinge)");
  check(!plastic_.active() || (s.stiffening.size() == model->topology.hingeCount() && s.stiffening.allFinite() &&
                               (s.stiffening.array() > 0).all()),
        "stiffening of the state (positive, one per hinge)");
  bool sound = true;
  for (std::size_t k = 0; k < s.pins.size(); ++k)
    sound = sound && s.pins[k] >= 0 && s.pins[k] < n && (k == 0 || s.pins[k] > s.pins[k - 1]);
  check(std::all_of(s.at_bound.begin(), s.at_bound.end(),
                    [&](int i) { return i >= 0 && prescribed && i < prescribed->bounds.size(); }) &&
            std::adjacent_find(s.at_bound.begin(), s.at_bound.end(), std::greater_equal<int>()) == s.at_bound.end(),
        "averages of the state that are at their bounds (ascending)");
  check(sound, "pins of the state (vertices, ascending)");
  return what.empty();
}

StepReport ClothStepper::Impl::refuse(StepReport& report, StepFailure failure, const std::string& message) const
{
  report.ok = false;
  report.work = ownWork();
  report.failure = failure;
  report.message = "cloth '" + model->name + "': " + message;
  return report;
}

std::string ClothStepper::Impl::explain(StepFailure failure, double length)
{
  const std::string at = " at a step of " + milliseconds(length);
  if (isExplicit())
    return "the explicit step blew up" + at + ": use a shorter step (stable below " + milliseconds(stableStep()) +
           " at rest) or implicit_euler";
  if (failure == StepFailure::singular_matrix && !system->averagesIndependent())
    return "prescribed averages depend on each other on the vertices that are not held: hold fewer vertices, or leave "
           "out the averages there";
  if (failure == StepFailure::singular_matrix)
    return "the matrix is not positive definite" + at +
           ": sizes or moduli differ by too many orders of magnitude, or a grasp or force is too fast or too large by "
           "as many";
  if (failure == StepFailure::work_exceeded)
    return "the step needs more work than it is given" + at + ": use a shorter step, move what " +
           (model->averages.empty() ? "holds it by less at once"
                                    : "guides it by less at once and without crumpling it") +
           ", or take softer cloth (thickness, moduli)";
  if (failure == StepFailure::linear_unconverged)
    return "the linear equations did not converge" + at + ": use a shorter step, a larger solver.tolerance" +
           (system->bounded() ? ", a larger max_traction" : "") + ", or softer cloth (thickness, moduli)";
  if (failure == StepFailure::energy_grew)
    return "one Newton step brings energy out of nothing" + at +
           ": use a shorter step, more time.newton.max_cuts, or one_newton_step: false";
  if (failure == StepFailure::state_not_finite)
    return "the configuration overflowed" + at + ": use a shorter step or check the inputs for jumps";
  return "Newton's method did not converge" + at +
         ": use a shorter step, more time.newton.max_iterations or max_cuts, move the pins slowly, or start from a "
         "shape whose faces have area";
}

StepReport ClothStepper::Impl::refuseUnsolved(StepReport& report, StepFailure failure, double length)
{
  // explicit steps end in a state that says nothing, and a spent budget may have left none; then the state at the start
  // of the step is looked at
  const bool trial = !isExplicit() && failure != StepFailure::work_exceeded;
  const auto place = [&](int i) { return trial ? Eigen::Vector3d(point(x_, i)) : Eigen::Vector3d(work_.x.col(i)); };
  Largest strain, node;
  const auto& edges = model->topology.edges;
  for (int e = 0; e < static_cast<int>(edges.cols()); ++e)
  {
    const double rest = (model->rest.vertices.col(edges(0, e)) - model->rest.vertices.col(edges(1, e))).norm();
    strain.add(e, std::abs((place(edges(0, e)) - place(edges(1, e))).norm() / rest - 1.0));
  }
  for (int i = 0; i < model->vertices(); ++i)
    if (trial && system->averageCount() == 0 &&
        !system->held()[i])   // averages bear forces that the gradient does not know
      node.add(i, point(system->gradient(), i).norm());
    else if (!trial)
      node.add(i, work_.v.col(i).norm());
  const int a = edges(0, strain.index()), b = edges(1, strain.index());
  const int at = node.any() ? node.index() : a;
  report.place = {FailurePlace::Kind::cloth, model->name, at, work_.x.col(at)};
  std::string text = ". The largest stretch strain is " + strain.text("") + ", between vertices " + std::to_string(a) +
                     " and " + std::to_string(b);
  if (node.any())
    text +=
        trial ? "; the largest unbalanced force is " + node.text("N") + ", on vertex " + std::to_string(at) + ", which"
              : "; vertex " + std::to_string(at) + " is the fastest, with " + node.text("m/s") + "; it";
  else
    text += ", of which the first";
  return refuse(report, failure,
                explain(failure, length) + text + " was at " + metres(report.place.position) + " as the step began");
}

Eigen::Vector3d ClothStepper::Impl::pinAt(const ClothInputs& inputs, std::size_t pin, double fraction) const
{
  const auto k = static_cast<Eigen::Index>(pin);
  return fraction >= 1.0 ? Eigen::Vector3d(inputs.pins.col(k))
                         : Eigen::Vector3d(pins_start_.col(k) + fraction * (inputs.pins.col(k) - pins_start_.col(k)));
}

void ClothStepper::Impl::useBudget(std::shared_ptr<WorkBudget> budget)
{
  own_budget_ = budget == nullptr;
  budget_ = own_budget_ ? std::make_shared<WorkBudget>() : std::move(budget);
  system->useBudget(*budget_);
}

StepReport ClothStepper::Impl::step(ClothState& state, const ClothInputs& inputs, double duration)
{
  StepReport report;
  std::string what;
  if (own_budget_)   // error control takes as many substeps as accuracy asks for
    budget_->start(options.error_tolerance > 0 ? WorkBudget::kUnbounded : WorkBudget::ofStep(model->vertices()));
  if (!inputsFine(state, inputs, duration, what))
    return refuse(report, StepFailure::input_not_finite, what + " is not finite or not valid; correct this input");
  followClamps(state);
  work_ = state;
  plastic_.flow(work_, duration);   // at the start, which sees what collisions made of the last step (thesis 6.4.4)
  pins_start_.resize(3, static_cast<Eigen::Index>(state.pins.size()));
  for (std::size_t k = 0; k < state.pins.size(); ++k)
    pins_start_.col(static_cast<Eigen::Index>(k)) = state.x.col(state.pins[k]);
  system->useAverages(state);
  if (system->averageCount() > 0)
  {
    toPoints(state.x, x_);
    system->averagesOf(x_, averages_start_);
  }
  inputs_ = &inputs;
  duration_ = duration;
  const bool adaptive = options.error_tolerance > 0;
  SubstepController controller({duration, adaptive ? state.next_step : 0.0, options.error_tolerance, options.min_step,
                                order(options.integrator), options.newton.max_cuts});
  controller.run(*this, duration, report);
  if (!report.ok)
    return report;
  report.work = ownWork();
  work_.next_step = controller.nextLength();
  std::swap(state, work_);
  return report;
}

StepFailure ClothStepper::Impl::attempt(const Substep& substep, StepReport& report)
{
  if (budget_->spent())
    return StepFailure::work_exceeded;
  if (options.integrator == Integrator::imex)
    return imexStep(*inputs_, substep.from, substep.to, duration_, report);
  return isExplicit() ? explicitStep(*inputs_, substep.from, substep.to, duration_, report)
                      : implicitStep(*inputs_, substep.from, substep.to, duration_, report);
}

void ClothStepper::Impl::accept(const Substep&) { std::swap(work_, next_); }

bool ClothStepper::Impl::shorterMayHelp(StepFailure) const { return !isExplicit() && !budget_->spent(); }

void ClothStepper::Impl::refuse(const Substep& substep, StepFailure failure, StepReport& report)
{
  if (failure == StepFailure::interrupted)
    refuse(report, failure, kStepInterrupted);
  else
    refuseUnsolved(report, budget_->spent() ? StepFailure::work_exceeded : failure, substep.length);
}

void ClothStepper::Impl::combine(const Combination& c, PointVector& result) const
{
  for (std::size_t i = 0; i < result.size(); ++i)
    result[i] = c[kQ] * x_start_[i] + c[kV] * v_start_[i] + c[kA] * a_start_[i] + c[kQStage] * x_stage_[i] +
                c[kVStage] * v_stage_[i];
}

/// From work_ to next_.
StepFailure ClothStepper::Impl::implicitStep(const ClothInputs& inputs, double from, double to, double duration,
                                             StepReport& report)
{
  const double h = to - from;
  const int n = model->vertices();
  planStep(options.integrator, 1.0, h, 0.0, plan_);
  toPoints(work_.x, x_start_);
  toPoints(work_.v, v_start_);
  system->hold(work_);
  at_bound_ = work_.at_bound;
  if (system->averageCount() > 0)
    averages_ = averages_start_ + to / duration * (inputs.averages - averages_start_);
  const bool second_order = order(options.integrator) == 2, damped = model->stiffness_damping > 0;
  if (second_order)
  {
    const ClothEvaluation here = acceleration(inputs, plan_.stages[0].tau_v);
    energy_start_ = elastic_start_ = damped ? system->elasticEnergy(x_start_) : here.membrane + here.bending;
  }
  double reached = 0.0;
  for (std::size_t s = 0; s < plan_.stages.size(); ++s)
  {
    const Stage& stage = plan_.stages[s];
    const PointVector& start = s == 0 ? x_start_ : x_stage_;
    const PointVector& velocity = s == 0 ? v_start_ : v_stage_;
    combine(stage.q_hat, q_hat_);
    combine(stage.q_tilde, q_tilde_);
    for (int i = 0; i < n; ++i)
      point(guess_, i) = point(start, i) + (stage.time - reached) * h * point(velocity, i);
    std::fill(pin_motion_.begin(), pin_motion_.end(), 0.0);
    for (std::size_t k = 0; k < work_.pins.size(); ++k)
      point(pin_motion_, work_.pins[k]) =
          pinAt(inputs, k, stage.time == 1.0 ? to / duration : (from + stage.time * h) / duration) -
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
    system->beginStage({stage.tau_v, &q_hat_, &q_tilde_, &start, second_order ? &guess_ : &start, &wind_v_}, inputs);
    const StepFailure failure = options.one_newton_step ? linearized(report) : minimize(report);
    if (failure != StepFailure::none)
      return failure;
    reached = stage.time;
    if (s + 1 == plan_.stages.size())
      return finish(stage, inputs, h, to / duration, report);
    for (int i = 0; i < n; ++i)
    {
      const Eigen::Vector3d q = point(x_, i);
      point(v_stage_, i) = system->held()[i] ? Eigen::Vector3d((q - point(x_start_, i)) / (stage.time * h))
                                             : Eigen::Vector3d((q - point(q_tilde_, i)) / stage.tau_v);
    }
    x_stage_ = x_;
  }
  return StepFailure::none;
}

/// Takes x_ as the end of the step.
StepFailure ClothStepper::Impl::finish(const Stage& stage, const ClothInputs& inputs, double h, double fraction,
                                       StepReport& report)
{
  constexpr double kUnbalanced = 0.1;   // of the largest force: not a solution
  if (system->averageCount() > 0)       // to rounding
    system->meetAverages(averages_, x_);
  const ClothEvaluation end = system->evaluate(x_);
  if (!std::isfinite(end.energy()))
    return StepFailure::state_not_finite;
  // before averages take from the gradient what they balance
  double internal = 0.0, pin_work = 0.0, average_work = 0.0;
  for (int i = 0; i < model->vertices(); ++i)
  {
    const Eigen::Vector3d g = system->internalGradient(i);
    internal = std::max(internal, g.norm());
    if (system->held()[i])
      pin_work += g.dot(point(x_, i) - point(x_start_, i));
  }
  if (system->averageCount() > 0)
  {
    average_work = workOnFree(system->gradient());
    system->balanceAverages(average_forces);
    average_work -= workOnFree(system->gradient());
  }
  next_ = work_;
  next_.at_bound = at_bound_;
  const bool second_order = order(options.integrator) == 2;
  // Newton stops by its increment, which says little where stiffness has no bound: bends of faces without area
  const double resolved = options.newton.tolerance * (model->membrane.c11 + model->membrane.c22) * shortest_edge_;
  double unbalanced = 0.0, force = std::max(resolved, internal), jump = 0.0;
  for (int i = 0; i < model->vertices(); ++i)
  {
    const bool held = system->held()[i];
    const double size = point(system->gradient(), i).norm();
    (held ? force : unbalanced) = std::max(held ? force : unbalanced, size);
    const Eigen::Vector3d q = point(x_, i), a = (q - point(q_hat_, i)) / (stage.tau_a * stage.tau_a);
    force = std::max({force, model->mass[i] * a.norm(), model->mass[i] * inputs.gravity.norm()});
    if (!held)
      jump = std::max(jump, second_order ? (a - point(a_start_, i)).norm() : a.norm());
    next_.v.col(i) =
        held ? Eigen::Vector3d((q - point(x_start_, i)) / h) : Eigen::Vector3d((q - point(q_tilde_, i)) / stage.tau_v);
    next_.x.col(i) = q;
  }
  report.residual = std::max(report.residual, unbalanced / force);
  report.max_strain = std::max(report.max_strain, end.max_strain);
  if (options.error_tolerance > 0)
    report.error_estimate = std::max(report.error_estimate, errorConstant(options.integrator) * h * h * jump);
  pin_forces.resize(3, static_cast<Eigen::Index>(work_.pins.size()));
  for (std::size_t k = 0; k < work_.pins.size(); ++k)
  {
    next_.x.col(work_.pins[k]) = pinAt(inputs, k, fraction);
    // a pin's speed changes at the start of the step: its inertia over the whole step counts, not that at the end,
    // which the last stage guesses from both
    const int p = work_.pins[k];
    const Eigen::Vector3d inertia =
        (point(x_, p) - point(q_hat_, p)) / (stage.tau_a * stage.tau_a) - (next_.v.col(p) - work_.v.col(p)) / h;
    pin_forces.col(static_cast<Eigen::Index>(k)) = model->mass[p] * inertia - point(system->gradient(), p);
  }
  if (options.one_newton_step)
    return createsEnergy(
               second_order && model->stiffness_damping > 0 ? system->elasticEnergy(x_) : end.membrane + end.bending,
               average_work, pin_work)
               ? StepFailure::energy_grew
               : StepFailure::none;
  return unbalanced > std::max(kUnbalanced * force, resolved) ? StepFailure::newton_diverged : StepFailure::none;
}

/// Of forces that change from the start of a step to x_ [J].
double ClothStepper::Impl::workOnFree(const PointVector& forces) const
{
  double work = 0.0;
  for (int i = 0; i < model->vertices(); ++i)
    if (!system->held()[i])
      work += point(forces, i).dot(point(x_, i) - point(x_start_, i));
  return work;
}

/// With the stiffness of the last stage.
bool ClothStepper::Impl::respond(const Eigen::Matrix3Xd& forces, double duration, Eigen::Matrix3Xd& displacement,
                                 Eigen::Matrix3Xd& pin_forces_change, Eigen::Matrix3Xd& average_forces_change)
{
  if (isExplicit())   // whose forces do not know the end of the step
  {
    for (int i = 0; i < model->vertices(); ++i)
      displacement.col(i) = duration * duration / model->mass[i] * forces.col(i);
    for (const int p : work_.pins)
      displacement.col(p).setZero();
    pin_forces_change.setZero(3, pin_forces.cols());
    average_forces_change.setZero(3, average_forces.cols());
    return true;
  }
  int iterations = 0, factorizations = 0;
  // what it leaves unbalanced the grasps' wrenches lack: below a thousandth of the load
  constexpr double kTolerance = 5e-4;
  const auto solve = [&] {
    system->setInertia(duration);
    for (int i = 0; i < model->vertices(); ++i)
      point(system->gradient(), i) = -forces.col(i);
    std::fill(d_.begin(), d_.end(), 0.0);
    return system->solve(d_, options.one_newton_step ? nullptr : &x_, iterations, factorizations, kTolerance) ==
           LinearOutcome::solved;
  };
  if (!solve())   // the inertia of a longer step does not hold up what a short stage's does
  {
    system->evaluateHessian(x_, HessianKind::semidefinite);
    if (!solve())
      return false;
  }
  for (int i = 0; i < model->vertices(); ++i)
    displacement.col(i) = point(d_, i);
  pin_forces_change.resize(3, pin_forces.cols());
  average_forces_change.resize(3, system->averageCount());
  if (pin_forces.cols() == 0 && system->averageCount() == 0)
    return true;
  system->applyMatrix(d_, trial_);
  for (std::size_t i = 0; i < trial_.size(); ++i)
    system->gradient()[i] += trial_[i];
  if (system->averageCount() > 0)
    system->balanceAverages(average_forces_change, true);
  Eigen::Index pin = 0;
  for (int i = 0; i < model->vertices(); ++i)
    if (system->held()[i])
      pin_forces_change.col(pin++) = -point(system->gradient(), i);
  return true;
}

ClothStepper::ClothStepper(std::shared_ptr<const ClothModel> model, const ClothOptions& options)
  : impl_(std::make_unique<Impl>(std::move(model), options))
{
}
ClothStepper::~ClothStepper() = default;
ClothStepper::ClothStepper(ClothStepper&&) noexcept = default;

void ClothStepper::useBudget(std::shared_ptr<WorkBudget> budget) { impl_->useBudget(std::move(budget)); }

StepReport ClothStepper::step(ClothState& state, const ClothInputs& inputs, double duration)
{
  return impl_->step(state, inputs, duration);
}
StepReport ClothStepper::stepUndivided(ClothState& state, const ClothInputs& inputs, double duration)
{
  const ClothOptions own = impl_->options;
  const double next_step = state.next_step;
  impl_->options.error_tolerance = 0.0;
  if (own.integrator == Integrator::tr_bdf2)
    impl_->options.integrator = Integrator::implicit_euler;
  const StepReport report = impl_->step(state, inputs, duration);
  if (report.ok)
    state.next_step = next_step;
  impl_->options = own;
  return report;
}

bool ClothStepper::respond(const Eigen::Matrix3Xd& forces, double duration, Eigen::Matrix3Xd& displacement,
                           Eigen::Matrix3Xd& pin_forces_change, Eigen::Matrix3Xd& average_forces_change)
{
  return impl_->respond(forces, duration, displacement, pin_forces_change, average_forces_change);
}
const Eigen::Matrix3Xd& ClothStepper::pinForces() const { return impl_->pin_forces; }
double ClothStepper::stableStep() const { return impl_->stableStep(); }
const Eigen::Matrix3Xd& ClothStepper::averageForces() const { return impl_->average_forces; }
ClothSolver ClothStepper::solver() const { return impl_->system->solver(); }
const ClothModel& ClothStepper::model() const { return *impl_->model; }

ClothEnergies ClothStepper::energies(const ClothState& state, const Eigen::Vector3d& gravity) const
{
  ClothEnergies result;
  impl_->followClamps(state);
  ClothSystem& system = *impl_->system;
  PointVector x;
  toPoints(state.x, x);
  PointVector unused(x.size(), 0.0);
  system.usePlasticState(state);
  system.setViscosity(0.0, x);
  const ClothEvaluation e = system.addInternal(x, unused);
  result.membrane = e.membrane;
  result.bending = e.bending;
  for (int i = 0; i < impl_->model->vertices(); ++i)
  {
    result.kinetic += 0.5 * impl_->model->mass[i] * state.v.col(i).squaredNorm();
    result.gravity -= impl_->model->mass[i] * gravity.dot(state.x.col(i));
  }
  return result;
}

}   // namespace slender
