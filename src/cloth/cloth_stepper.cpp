#include "slender_sim/cloth/cloth_stepper.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <stdexcept>

#include "cloth_system.h"
#include "slender_sim/cloth/plastic_flow.h"

namespace slender {

class ClothStepper::Impl
{
public:
  Impl(std::shared_ptr<const ClothModel> m, const ClothOptions& o);

  StepReport step(ClothState& state, const ClothInputs& inputs, double duration);

  bool respond(const Eigen::Matrix3Xd& forces, Eigen::Matrix3Xd& displacement, Eigen::Matrix3Xd& pin_forces_change);

  std::shared_ptr<const ClothModel> model;
  ClothOptions options;
  ClothSystem system;
  Eigen::Matrix3Xd pin_forces, average_forces;

private:
  bool inputsFine(const ClothState& state, const ClothInputs& inputs, double duration, std::string& what) const;
  StepReport refuse(StepReport& report, StepFailure failure, const std::string& message) const;
  std::string explain(StepFailure failure, double length) const;
  StepFailure implicitStep(const ClothInputs& inputs, double from, double to, double duration, StepReport& report);
  StepFailure explicitStep(const ClothInputs& inputs, double from, double to, double duration, StepReport& report);
  StepFailure minimize(StepReport& report);
  StepFailure linearized(StepReport& report);
  StepFailure finish(double h, StepReport& report);
  Eigen::Vector3d pinAt(const ClothInputs& inputs, std::size_t pin, double fraction) const;
  double largest(const PointVector& d) const;

  PlasticFlow plastic_;
  ClothState work_;
  Eigen::Matrix3Xd pins_start_, averages_start_, averages_;
  PointVector x_, best_, trial_, d_, pin_motion_, v_, force_;
  double shortest_edge_ = 0;
};

ClothStepper::Impl::Impl(std::shared_ptr<const ClothModel> m, const ClothOptions& o)
  : model(std::move(m)), options(o), system(*model, o), plastic_(*model)
{
  const std::string who = "cloth '" + model->name + "': ";
  if (o.integrator != Integrator::implicit_euler && o.integrator != Integrator::symplectic_euler)
    throw std::invalid_argument(who + "integrator must be implicit_euler or symplectic_euler");
  if (!(o.linear_tolerance > 0 && o.linear_tolerance < 1))
    throw std::invalid_argument(who + "linear_tolerance must be in (0, 1)");
  for (const double value : {model->bending_modulus, model->mass_damping, model->stiffness_damping, model->wind_coefficient})
    if (!(value >= 0) || !std::isfinite(value))
      throw std::invalid_argument(who + "bending modulus, damping and wind coefficient must be zero or more");
  if (model->mass.size() != model->vertices() || !(model->mass.minCoeff() > 0))
    throw std::invalid_argument(who + "every vertex needs a mass");
  if (model->averages)
  {
    if (model->averages->cols() != model->vertices())
      throw std::invalid_argument(who + "averages of " + std::to_string(model->averages->cols()) + " vertices do not fit");
    if (o.integrator == Integrator::symplectic_euler)
      throw std::invalid_argument(who + "prescribed averages need implicit steps: use implicit_euler");
    if (o.solver == ClothSolver::cholesky)
      throw std::invalid_argument(who + "prescribed averages need solver: conjugate_gradients (or auto)");
  }
  shortest_edge_ = std::numeric_limits<double>::infinity();
  for (Eigen::Index e = 0; e < model->topology.edges.cols(); ++e)
    shortest_edge_ = std::min(shortest_edge_, (model->rest.vertices.col(model->topology.edges(0, e)) -
                                               model->rest.vertices.col(model->topology.edges(1, e))).norm());
  for (PointVector* v : {&x_, &best_, &trial_, &d_, &pin_motion_, &v_, &force_})
    v->assign(4 * model->vertices(), 0.0);
}

bool ClothStepper::Impl::inputsFine(const ClothState& s, const ClothInputs& inputs, double duration, std::string& what) const
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
  check(inputs.pins.cols() == static_cast<Eigen::Index>(s.pins.size()), "number of pin positions (one per pin of the state)");
  check(inputs.pins.allFinite(), "pin positions");
  check(inputs.averages.cols() == model->averageCount(), "number of averages (one per average of the model)");
  check(inputs.averages.allFinite(), "averages");
  check(s.x.cols() == n && s.v.cols() == n, "number of vertices of the state");
  check(s.x.allFinite() && s.v.allFinite(), "the state");
  check(model->bending != BendingModel::hinge || (s.rest_angles.size() == model->topology.hingeCount() && s.rest_angles.allFinite()),
        "rest angles of the state (one per hinge)");
  check(!plastic_.active() || (s.stiffening.size() == model->topology.hingeCount() && s.stiffening.allFinite() && (s.stiffening.array() > 0).all()),
        "stiffening of the state (positive, one per hinge)");
  bool sound = true;
  for (std::size_t k = 0; k < s.pins.size(); ++k)
    sound = sound && s.pins[k] >= 0 && s.pins[k] < n && (k == 0 || s.pins[k] > s.pins[k - 1]);
  check(sound, "pins of the state (vertices, ascending)");
  return what.empty();
}

StepReport ClothStepper::Impl::refuse(StepReport& report, StepFailure failure, const std::string& message) const
{
  report.ok = false;
  report.failure = failure;
  report.message = "cloth '" + model->name + "': " + message;
  return report;
}

std::string ClothStepper::Impl::explain(StepFailure failure, double length) const
{
  const std::string at = " at a step of " + std::to_string(1e3 * length) + " ms";
  if (options.integrator == Integrator::symplectic_euler)
    return "the explicit step blew up" + at + ": use a shorter step or implicit_euler";
  if (failure == StepFailure::singular_matrix)
    return "the matrix is not positive definite" + at + ": sizes or moduli differ by too many orders of magnitude";
  if (failure == StepFailure::state_not_finite)
    return "the configuration overflowed" + at + ": use a shorter step or check the inputs for jumps";
  return "Newton's method did not converge" + at + ": use a shorter step, more time.newton.max_iterations or max_cuts, or move the pins slowly";
}

Eigen::Vector3d ClothStepper::Impl::pinAt(const ClothInputs& inputs, std::size_t pin, double fraction) const
{
  const auto k = static_cast<Eigen::Index>(pin);
  return fraction >= 1.0 ? Eigen::Vector3d(inputs.pins.col(k)) : Eigen::Vector3d(pins_start_.col(k) + fraction * (inputs.pins.col(k) - pins_start_.col(k)));
}

StepReport ClothStepper::Impl::step(ClothState& state, const ClothInputs& inputs, double duration)
{
  StepReport report;
  std::string what;
  if (!inputsFine(state, inputs, duration, what))
    return refuse(report, StepFailure::input_not_finite, what + " is not finite or not valid; correct this input");
  work_ = state;
  plastic_.flow(work_, duration);   // at the start, which sees what collisions made of the last step (thesis 6.4.4)
  pins_start_.resize(3, static_cast<Eigen::Index>(state.pins.size()));
  for (std::size_t k = 0; k < state.pins.size(); ++k)
    pins_start_.col(static_cast<Eigen::Index>(k)) = state.x.col(state.pins[k]);
  if (model->averages)
  {
    toPoints(state.x, x_);
    system.averagesOf(x_, averages_start_);
  }
  const bool explicit_step = options.integrator == Integrator::symplectic_euler;
  double t = 0.0, h = duration;
  while (t < duration)
  {
    const bool last = t + h > duration * (1 - 1e-9);
    const double to = last ? duration : t + h;
    StepReport sub;
    const StepFailure failure = explicit_step ? explicitStep(inputs, t, to, duration, sub) : implicitStep(inputs, t, to, duration, sub);
    report.merge(sub);
    if (failure != StepFailure::none)
    {
      if (explicit_step || 0.5 * (to - t) < duration * std::ldexp(1 - 1e-9, -options.newton.max_cuts))
        return refuse(report, failure, explain(failure, to - t));
      ++report.cut_steps;
      h = 0.5 * (to - t);
      continue;
    }
    ++report.substeps;
    h = std::min(2.0 * (to - t), duration);
    t = to;
  }
  std::swap(state, work_);
  return report;
}

double ClothStepper::Impl::largest(const PointVector& d) const
{
  double square = 0.0;
  for (int i = 0; i < model->vertices(); ++i)
    square = std::max(square, point(d, i).squaredNorm());
  return std::sqrt(square);
}

StepFailure ClothStepper::Impl::implicitStep(const ClothInputs& inputs, double from, double to, double duration, StepReport& report)
{
  const double h = to - from;
  system.beginStep(work_, inputs, h);
  std::fill(pin_motion_.begin(), pin_motion_.end(), 0.0);
  for (std::size_t k = 0; k < work_.pins.size(); ++k)
    point(pin_motion_, work_.pins[k]) = pinAt(inputs, k, to / duration) - work_.x.col(work_.pins[k]);
  if (model->averages)
    averages_ = averages_start_ + to / duration * (inputs.averages - averages_start_);
  const StepFailure failure = options.one_newton_step ? linearized(report) : minimize(report);
  return failure != StepFailure::none ? failure : finish(h, report);
}

/// One Newton step from the start, what is held moving as prescribed.
StepFailure ClothStepper::Impl::linearized(StepReport& report)
{
  system.evaluateHessian(system.start(), HessianKind::semidefinite);
  for (int i = 0; i < model->vertices(); ++i)
    point(d_, i) = system.held()[i] ? Eigen::Vector3d(point(pin_motion_, i)) : Eigen::Vector3d(point(system.target(), i) - point(system.start(), i));
  if (model->averages)   // conjugate gradients keep what the first guess meets
  {
    for (std::size_t i = 0; i < x_.size(); ++i)
      x_[i] = system.start()[i] + d_[i];
    system.meetAverages(averages_, x_);
    for (std::size_t i = 0; i < x_.size(); ++i)
      d_[i] = x_[i] - system.start()[i];
  }
  if (!system.solve(d_, report.linear_iterations, report.factorizations))
    return StepFailure::singular_matrix;
  ++report.iterations;
  for (std::size_t i = 0; i < x_.size(); ++i)
    x_[i] = system.start()[i] + d_[i];
  return StepFailure::none;
}

/// Newton's method on the energy of the step, with a watchdog as in minimize() of rods: nearly inextensible cloth gains a little membrane
/// energy in every full step that turns it, and a strict line search would creep. Where full steps do not get below the best energy
/// for a while, it returns there and becomes strict.
StepFailure ClothStepper::Impl::minimize(StepReport& report)
{
  constexpr double kArmijo = 1e-4;
  constexpr double kMostShift = 10.0;   // of the weight of inertia
  constexpr int kPatience = 5;
  for (int i = 0; i < model->vertices(); ++i)
    point(x_, i) = system.held()[i] ? Eigen::Vector3d(point(system.start(), i) + point(pin_motion_, i)) : Eigen::Vector3d(point(system.target(), i));
  if (model->averages)
    system.meetAverages(averages_, x_);
  bool near = false, strict = false;
  double best = std::numeric_limits<double>::infinity(), shift = 0.0;
  int misses = 0;
  for (int iteration = 0; iteration < options.newton.max_iterations; ++iteration)
  {
    // far away the matrix that is never indefinite; near by the exact one, shifted where wrinkles are about to grow
    HessianKind kind = near ? HessianKind::exact : HessianKind::semidefinite;
    ClothEvaluation here = system.evaluateHessian(x_, kind);
    if (!std::isfinite(here.energy()))
      return StepFailure::state_not_finite;
    if (!strict && here.energy() > best + 1e-13 * here.magnitude())
    {
      strict = ++misses > kPatience;
      if (strict)
      {
        std::copy(best_.begin(), best_.end(), x_.begin());
        kind = HessianKind::semidefinite;
        here = system.evaluateHessian(x_, kind);
      }
    }
    else if (!strict)
    {
      best = here.energy();
      misses = 0;
      std::copy(x_.begin(), x_.end(), best_.begin());
    }
    bool solved = false;
    for (double added = 0.0; !solved;)
    {
      if (kind == HessianKind::exact && shift > added)
      {
        system.shiftMatrix(shift - added);
        added = shift;
      }
      std::fill(d_.begin(), d_.end(), 0.0);
      solved = system.solve(d_, report.linear_iterations, report.factorizations);
      if (solved || kind == HessianKind::semidefinite)
        break;
      shift = std::max(0.2, 4.0 * shift);
      if (shift > kMostShift)
      {
        shift = 0.0;
        kind = HessianKind::semidefinite;
        system.evaluateHessian(x_, kind);
      }
    }
    if (!solved)
      return StepFailure::singular_matrix;
    ++report.iterations;
    const double increment = largest(d_) / shortest_edge_;
    if (!std::isfinite(increment))
      return StepFailure::state_not_finite;
    const double slope = pointKernels().dot(model->vertices(), system.gradient().data(), d_.data());
    const double noise = 1e-13 * here.magnitude();
    double alpha = 1.0;
    for (;; alpha *= 0.5)
    {
      for (std::size_t i = 0; i < x_.size(); ++i)
        trial_[i] = x_[i] + alpha * d_[i];
      if (!strict || increment <= options.newton.tolerance || system.energy(trial_).energy() <= here.energy() + kArmijo * alpha * slope + noise)
        break;
      if (alpha < 1e-8)
        return StepFailure::newton_diverged;
    }
    std::swap(x_, trial_);
    if (alpha == 1.0 && increment <= options.newton.tolerance)
      return StepFailure::none;
    near = increment < 0.1;
    shift = shift > 0.1 ? 0.25 * shift : 0.0;
  }
  return StepFailure::newton_diverged;
}

/// Takes x_ as the end of the step.
StepFailure ClothStepper::Impl::finish(double h, StepReport& report)
{
  if (model->averages)   // to rounding
    system.meetAverages(averages_, x_);
  const ClothEvaluation end = system.evaluate(x_);
  if (!std::isfinite(end.energy()))
    return StepFailure::state_not_finite;
  pin_forces.resize(3, static_cast<Eigen::Index>(work_.pins.size()));
  if (model->averages)
    system.balanceAverages(average_forces);
  double unbalanced = 0.0, force = 1e-300;
  for (int i = 0; i < model->vertices(); ++i)
  {
    const double size = point(system.gradient(), i).norm();
    (system.held()[i] ? force : unbalanced) = std::max(system.held()[i] ? force : unbalanced, size);
    force = std::max(force, model->mass[i] * (point(x_, i) - point(system.target(), i)).norm() / (h * h));
    work_.v.col(i) = (point(x_, i) - point(system.start(), i)) / h;
    work_.x.col(i) = point(x_, i);
  }
  report.residual = std::max(report.residual, unbalanced / force);
  report.max_strain = std::max(report.max_strain, end.max_strain);
  for (std::size_t k = 0; k < work_.pins.size(); ++k)
    pin_forces.col(static_cast<Eigen::Index>(k)) = -point(system.gradient(), work_.pins[k]);
  return StepFailure::none;
}

bool ClothStepper::Impl::respond(const Eigen::Matrix3Xd& forces, Eigen::Matrix3Xd& displacement, Eigen::Matrix3Xd& pin_forces_change)
{
  if (options.integrator == Integrator::symplectic_euler)
    return false;
  for (int i = 0; i < model->vertices(); ++i)
    point(system.gradient(), i) = -forces.col(i);
  std::fill(d_.begin(), d_.end(), 0.0);
  int iterations = 0, factorizations = 0;
  constexpr double kTolerance = 0.05;
  if (!system.solve(d_, iterations, factorizations, kTolerance))
    return false;
  for (int i = 0; i < model->vertices(); ++i)
    displacement.col(i) = point(d_, i);
  pin_forces_change.resize(3, pin_forces.cols());
  if (pin_forces.cols() == 0)
    return true;
  system.applyMatrix(d_, trial_);
  Eigen::Index pin = 0;
  for (int i = 0; i < model->vertices(); ++i)
    if (system.held()[i])
      pin_forces_change.col(pin++) = -point(trial_, i);
  return true;
}

/// Symplectic Euler: velocities by the forces at the start, then positions. Viscous forces from the strains one step ago.
StepFailure ClothStepper::Impl::explicitStep(const ClothInputs& inputs, double from, double to, double duration, StepReport& report)
{
  const double h = to - from;
  const int n = model->vertices();
  toPoints(work_.x, x_);
  toPoints(work_.v, v_);
  system.setHinges(work_);
  if (model->stiffness_damping > 0)
  {
    for (std::size_t i = 0; i < x_.size(); ++i)
      trial_[i] = x_[i] - h * v_[i];
    system.setViscosity(model->stiffness_damping / h, trial_);
  }
  std::fill(d_.begin(), d_.end(), 0.0);
  const ClothEvaluation here = system.addInternal(x_, d_);
  std::fill(force_.begin(), force_.end(), 0.0);
  if (system.wind().active())
    system.wind().addForces(x_, v_, inputs.wind, force_);
  for (int i = 0; i < n; ++i)
  {
    Eigen::Vector3d f = point(force_, i) - point(d_, i) + model->mass[i] * (inputs.gravity - model->mass_damping * point(v_, i));
    if (inputs.forces.cols() > 0)
      f += inputs.forces.col(i);
    point(force_, i) = f;
    point(v_, i) += h / model->mass[i] * f;
  }
  pin_forces.resize(3, static_cast<Eigen::Index>(work_.pins.size()));
  for (std::size_t k = 0; k < work_.pins.size(); ++k)
  {
    const int p = work_.pins[k];
    const Eigen::Vector3d v = (pinAt(inputs, k, to / duration) - work_.x.col(p)) / h;
    pin_forces.col(static_cast<Eigen::Index>(k)) = point(force_, p) - model->mass[p] * (v - work_.v.col(p)) / h;
    point(v_, p) = v;
  }
  double fastest = 0.0;
  for (int i = 0; i < n; ++i)
  {
    work_.v.col(i) = point(v_, i);
    work_.x.col(i) += h * point(v_, i);
    fastest = std::max(fastest, work_.v.col(i).cwiseAbs().maxCoeff());
  }
  report.max_strain = std::max(report.max_strain, here.max_strain);
  return std::isfinite(here.energy()) && work_.x.allFinite() && fastest < 1e8 ? StepFailure::none : StepFailure::state_not_finite;
}

ClothStepper::ClothStepper(std::shared_ptr<const ClothModel> model, const ClothOptions& options) : impl_(std::make_unique<Impl>(std::move(model), options)) {}
ClothStepper::~ClothStepper() = default;
ClothStepper::ClothStepper(ClothStepper&&) noexcept = default;

StepReport ClothStepper::step(ClothState& state, const ClothInputs& inputs, double duration) { return impl_->step(state, inputs, duration); }
bool ClothStepper::respond(const Eigen::Matrix3Xd& forces, Eigen::Matrix3Xd& displacement, Eigen::Matrix3Xd& pin_forces_change)
{
  return impl_->respond(forces, displacement, pin_forces_change);
}
const Eigen::Matrix3Xd& ClothStepper::pinForces() const { return impl_->pin_forces; }
const Eigen::Matrix3Xd& ClothStepper::averageForces() const { return impl_->average_forces; }
ClothSolver ClothStepper::solver() const { return impl_->system.solver(); }
const ClothModel& ClothStepper::model() const { return *impl_->model; }

ClothEnergies ClothStepper::energies(const ClothState& state, const Eigen::Vector3d& gravity) const
{
  ClothEnergies result;
  ClothSystem& system = impl_->system;
  PointVector x;
  toPoints(state.x, x);
  PointVector unused(x.size(), 0.0);
  system.setHinges(state);
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

}  // namespace slender
