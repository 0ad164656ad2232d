// Static equilibria of one cloth (see EquilibriumSearch): the energy that its rounds minimise, and its eigenvalues.
#include "cloth_statics.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "dynamics/statics_advice.h"
#include "slender_sim/dynamics/lowest_eigenvalue.h"

namespace slender {

namespace {

/// Without inertia: the square of this is still a finite number.
constexpr double kNoInertia = 1e150;

std::shared_ptr<const ClothModel> elasticPart(const ClothModel& model)
{
  auto elastic = std::make_shared<ClothModel>(model);
  elastic->mass_damping = elastic->stiffness_damping = elastic->wind_coefficient = 0.0;
  elastic->aerodynamics = Aerodynamics{};
  return elastic;
}

ClothOptions directOptions()
{
  ClothOptions options;
  options.solver = ClothSolver::cholesky;
  return options;
}

}   // namespace

ClothStatics::ClothStatics(const ClothModel& model, const NewtonConfig& newton)
  : work_(elasticPart(model), directOptions()),
    part_(work_),
    equations_(false),
    model_(*work_.model),
    system_(*work_.system),
    linear_(*work_.linear),
    newton_(newton)
{
  equations_.setParts({&part_});
  size_ = (model_.rest.vertices.rowwise().maxCoeff() - model_.rest.vertices.rowwise().minCoeff()).norm();
  for (PointVector* v : {&x_, &d_, &force_})
    v->assign(4 * static_cast<std::size_t>(model_.vertices()), 0.0);
  newton_.tolerance = std::min(newton_.tolerance, 1e-8);
  newton_.max_iterations = std::max(60, newton_.max_iterations);
}

void ClothStatics::begin(const ClothState& state, const ClothInputs& inputs)
{
  state_ = state;
  inputs_ = inputs;
  inputs_.wind.setZero();
  work_.begin(state_, inputs_, 1.0);
  toPoints(state.x, x_);
  system_.hold(state_);
  double load = 0.0;
  for (int i = 0; i < model_.vertices(); ++i)
  {
    point(force_, i) = model_.mass[i] * inputs.gravity;
    if (inputs.forces.cols() > 0)
      point(force_, i) += inputs.forces.col(i);
    load += point(force_, i).norm();
  }
  pins_from_.resize(3, static_cast<Eigen::Index>(state.pins.size()));
  for (std::size_t k = 0; k < state.pins.size(); ++k)
    pins_from_.col(static_cast<Eigen::Index>(k)) = state.x.col(state.pins[k]);
  // The stiffness of the whole cloth against bending, or against its loads where that is larger, over its mass. A cloth
  // without either is held by its membrane.
  const double stiffness = std::max(model_.bending_modulus / (size_ * size_), load / size_);
  unit_rate_ =
      100.0 * (stiffness > 0 ? stiffness : 1e-6 * (model_.membrane.c11 + model_.membrane.c22)) / model_.totalMass();
  part_.minimiseWithoutInertia(unit_rate_);
  factorizations_ = 0;
}

/// Energy with a proximal term of this weight [1/s^2] about x_.
void ClothStatics::setRound(double weight)
{
  const ClothStage stage{weight > 0 ? 1.0 / std::sqrt(weight) : kNoInertia, &x_, &x_, &x_, &x_, &state_.v};
  system_.beginStage(stage, inputs_);
}

/// Largest turn or stretch of an edge by a displacement, over its length at rest.
double ClothStatics::turnOf(const PointVector& d) const
{
  double worst = 0.0;
  for (Eigen::Index e = 0; e < model_.topology.edges.cols(); ++e)
  {
    const int a = model_.topology.edges(0, e), b = model_.topology.edges(1, e);
    worst = std::max(
        worst, (point(d, b) - point(d, a)).norm() / (model_.rest.vertices.col(b) - model_.rest.vertices.col(a)).norm());
  }
  return worst;
}

double ClothStatics::residual() const
{
  const PointVector& gradient = system_.gradient();
  double square = 0.0;
  for (int i = 0; i < model_.vertices(); ++i)
    if (!system_.held()[i])
      square = std::max(square, point(gradient, i).squaredNorm());
  return std::sqrt(square);
}

/// Largest load or reaction. A cloth at rest has neither to compare with, only their round-off.
double ClothStatics::forceScale() const
{
  const PointVector& gradient = system_.gradient();
  double largest = 1e-9 * (model_.membrane.c11 + model_.membrane.c22) * work_.shortestEdge();
  for (int i = 0; i < model_.vertices(); ++i)
    largest = std::max({largest, point(force_, i).norm(), system_.held()[i] ? point(gradient, i).norm() : 0.0});
  return largest;
}

NewtonResult ClothStatics::round(double fraction, double weight)
{
  setRound(weight * unit_rate_);
  PointVector& trial = work_.x;
  trial = x_;
  for (std::size_t k = 0; k < state_.pins.size(); ++k)
  {
    const Eigen::Index pin = static_cast<Eigen::Index>(k);
    point(trial, state_.pins[k]) = pins_from_.col(pin) + fraction * (inputs_.pins.col(pin) - pins_from_.col(pin));
  }
  equations_.beginSubstep(0.0);
  const NewtonResult result = equations_.solve(fraction, fraction, newton_);
  factorizations_ += result.factorizations;
  if (result.ok())
    std::swap(x_, trial);   // the trial is where the round began
  return result;
}

double ClothStatics::shift() const
{
  double square = 0.0;
  for (int i = 0; i < model_.vertices(); ++i)
    square = std::max(square, (point(x_, i) - point(work_.x, i)).squaredNorm());
  return std::sqrt(square) / size_;
}

void ClothStatics::takeBase()
{
  static_cast<Part&>(part_).moveAlong(0.0);
  x_ = work_.x;
}

/// Returns the number of moves in which the pins can be carried to their targets: each at most a fifth of an edge. 0:
/// all are there.
double ClothStatics::pinMoves() const
{
  return state_.pins.empty() ? 0.0
                             : (inputs_.pins - pins_from_).colwise().norm().maxCoeff() / (0.2 * work_.shortestEdge());
}

bool ClothStatics::definite(double rate)
{
  system_.evaluateHessian(x_, HessianKind::exact);
  system_.addInertia(rate);
  ++factorizations_;
  return linear_.factor();
}

/// Half width of the band of eigenvalues that count as zero [1/s^2].
double ClothStatics::neutralBand() const
{
  const double mass = model_.totalMass();
  // Rounding errors of the n entries of the largest eigenvalue, which is that of one vertex on its edges, add up like a
  // random walk.
  const double largest = 8.0 * (model_.membrane.c11 + model_.membrane.c22) / model_.mass.minCoeff();
  const double rounding =
      std::numeric_limits<double>::epsilon() * largest / std::sqrt(static_cast<double>(model_.vertices()));
  return kNeutralShare * model_.bending_modulus / (mass * size_ * size_) + 4.0 * rounding;
}

/// By inverse iteration with the matrix last factored.
void ClothStatics::findMode()
{
  const int n = model_.vertices();
  for (int i = 0; i < n; ++i)
    for (int k = 0; k < 3; ++k)
      point(d_, i)[k] = startOfMode(3 * i + k);
  for (int round = 0; round < 12; ++round)
  {
    double square = 0.0;
    for (int i = 0; i < n; ++i)
    {
      point(d_, i) *= system_.held()[i] ? 0.0 : model_.mass[i];
      square += point(d_, i).squaredNorm();
    }
    for (double& value : d_)
      value /= std::max(std::sqrt(square), 1e-300);
    linear_.solveFactored(d_);
  }
  for (int i = 0; i < n; ++i)
    if (system_.held()[i])
      point(d_, i).setZero();
  // A mode that moves the cloth as a whole turns nothing.
  double largest = 0.0, at = 0.0;
  for (const double value : d_)
    if (std::abs(value) > largest)
    {
      largest = std::abs(value);
      at = value;
    }
  const double scale = (at < 0 ? -1.0 : 1.0) / std::max({turnOf(d_), largest / size_, 1e-300});
  for (double& value : d_)
    value *= std::isfinite(scale * value) ? scale : 0.0;
  fromPoints(d_, mode_);
}

/// Judges x_ with the pins where it has them.
EquilibriumStability ClothStatics::assess(bool spectrum)
{
  EquilibriumStability result;
  setRound(0.0);
  const ClothEvaluation e = system_.evaluate(x_);
  // Within a round the loads' energy counts from x_. Here it counts from the origin, so that states can be compared.
  double potential = 0.0, size = 0.0;
  for (int i = 0; i < model_.vertices(); ++i)
  {
    potential -= point(force_, i).dot(point(x_, i));
    size += std::abs(point(force_, i).dot(point(x_, i)));
  }
  result.energy = e.membrane + e.bending + potential;
  result.energy_noise = 1e-13 * (e.membrane + e.bending + size);
  if (!spectrum)
    return result;
  const double neutral = neutralBand();
  const LowestEigenvalue lowest = lowestEigenvalue([this](double rate) { return definite(rate); }, neutral);
  result.lowest = std::abs(lowest.value) <= neutral ? 0.0 : lowest.value;
  result.stable = result.lowest >= 0;
  if (std::isfinite(lowest.value))
    findMode();
  else
    mode_.setZero(3, model_.vertices());
  return result;
}

bool ClothStatics::displace(double turn)
{
  toPoints(mode_, d_);
  for (std::size_t i = 0; i < x_.size(); ++i)
    x_[i] += turn * d_[i];
  return true;
}

/// Residual, strain and forces on the pins of x_.
void ClothStatics::finish(StepReport& report)
{
  setRound(0.0);
  const ClothEvaluation e = system_.evaluate(x_);
  report.residual = residual() / forceScale();
  report.max_strain = std::max(report.max_strain, e.max_strain);
  report.factorizations += factorizations_;
  pin_forces_.resize(3, static_cast<Eigen::Index>(state_.pins.size()));
  for (std::size_t k = 0; k < state_.pins.size(); ++k)
    pin_forces_.col(static_cast<Eigen::Index>(k)) = -point(system_.gradient(), state_.pins[k]);
}

StepFailure ClothStatics::solve(ClothState& state, const ClothInputs& inputs, bool leave_saddles, StepReport& report)
{
  begin(state, inputs);
  Eigen::Vector3d total(0, 0, 0);
  double sizes = 0.0;
  for (int i = 0; i < model_.vertices(); ++i)
  {
    total += point(force_, i);
    sizes += point(force_, i).norm();
  }
  // Nothing but pins can balance a resultant load. Below 1e-9 of the loads it is round-off of their sum.
  if (state.pins.empty() && total.norm() > 1e-9 * sizes)
    return StepFailure::newton_diverged;
  EquilibriumSearch<ClothStatics> search(*this, report);
  if (!search.carry(pinMoves()) || !search.settleStably(leave_saddles))
    return search.failure();
  finish(report);
  if (!(report.residual < kMostUnbalanced))
    return StepFailure::newton_diverged;
  fromPoints(x_, state.x);
  state.v.setZero();
  state.next_step = 0.0;
  for (std::size_t k = 0; k < state.pins.size(); ++k)
    state.x.col(state.pins[k]) = inputs.pins.col(static_cast<Eigen::Index>(k));
  return StepFailure::none;
}

void ClothStatics::assess(const ClothState& state, const ClothInputs& inputs, StepReport& report)
{
  begin(state, inputs);
  const EquilibriumStability at = assess(true);
  report.stable = at.stable;
  report.lowest_eigenvalue = at.lowest;
  report.energy = at.energy;
  finish(report);
}

}   // namespace slender
