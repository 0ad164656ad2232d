#include "slender_sim/rod/averaged_rod.h"

#include <algorithm>
#include <cmath>
#include <stdexcept>

#include <Eigen/Cholesky>

#include "rod_stepper_impl.h"
#include "slender_sim/dynamics/substep_controller.h"
#include "slender_sim/rod/average_projection.h"
#include "slender_sim/linalg/interruption.h"

namespace slender {

/// A rod's equations under constraints C x = targets, as minimize() wants them.
class ConstrainedRod
{
public:
  ConstrainedRod(RodSystem& rod, const AveragedRod::Averages& c)
    : rod_(rod),
      c_(c),
      rows_(3 * c.rows()),
      columns_(4 * c.cols(), rows_),
      schur_(rows_, rows_),
      factor_(rows_),
      gap_(rows_),
      multipliers_(rows_),
      projection_(c)
  {
    multipliers_.setZero();
  }

  /// Trial positions of free nodes, moved by the least sum of mass times distance squared so that they have the
  /// averages. False: averages depend on each other.
  bool meet(const Eigen::VectorXd& mass, const Eigen::Matrix3Xd& targets)
  {
    targets_ = &targets;
    if (!projection_.prepare(mass, [this](int node) { return rod_.isFree(node); }))
      return false;
    for (int k = 0; k < 3; ++k)
    {
      for (Eigen::Index i = 0; i < c_.rows(); ++i)
        gap_[i] = targets(k, i) - average(i, rod_.arrays().x[k]);
      const Eigen::VectorXd& moved = projection_.displacements(gap_.head(c_.rows()));
      for (int j = 0; j < static_cast<int>(c_.cols()); ++j)
        if (rod_.isFree(j))
        {
          Eigen::Vector3d x = rod_.position(j);
          x[k] += moved[j];
          rod_.setPosition(j, x);
        }
    }
    return true;
  }

  /// Of averages, in the rod's axes: three per average [N].
  const Eigen::VectorXd& multipliers() const { return multipliers_; }

  RodEvaluation evaluate(bool with_hessian, const HessianShift& shift = {})
  {
    return rod_.evaluate(with_hessian, shift);
  }
  void solve()
  {
    rod_.solve();
    columns_.setZero();
    for (Eigen::Index i = 0; i < c_.rows(); ++i)
      for (AveragedRod::Averages::InnerIterator entry(c_, i); entry; ++entry)
        if (rod_.isFree(static_cast<int>(entry.col())))
          for (int k = 0; k < 3; ++k)
            columns_(4 * entry.col() + k, 3 * i + k) = entry.value();
    for (Eigen::Index r = 0; r < rows_; ++r)
      rod_.solveFor(columns_.col(r).data());
    Eigen::Map<Eigen::VectorXd> direction(rod_.direction(), columns_.rows());
    for (Eigen::Index i = 0; i < c_.rows(); ++i)
      for (int k = 0; k < 3; ++k)
      {
        const Eigen::Index row = 3 * i + k;
        schur_.row(row).setZero();
        gap_[row] = -(*targets_)(k, i);
        for (AveragedRod::Averages::InnerIterator entry(c_, i); entry; ++entry)
        {
          const Eigen::Index at = 4 * entry.col() + k;
          schur_.row(row) += entry.value() * columns_.row(at);
          gap_[row] += entry.value() * (rod_.basePosition(static_cast<int>(entry.col()))[k] + direction[at]);
        }
      }
    factor_.compute(schur_);
    multipliers_ = gap_;
    factor_.solveInPlace(multipliers_);
    direction.noalias() -= columns_ * multipliers_;
  }
  void moveAlong(double alpha) { rod_.moveAlong(alpha); }
  void accept() { rod_.accept(); }
  void saveBase() { rod_.saveBase(); }
  void restoreBase() { rod_.restoreBase(); }
  double stepLimit() const { return rod_.stepLimit(); }
  double incrementSize() const { return rod_.incrementSize(); }
  static constexpr bool anglesMayKeepShift() { return RodSystem::anglesMayKeepShift(); }
  static constexpr double mostUnbalanced() { return RodSystem::mostUnbalanced(); }
  double slope() const { return rod_.slope(); }
  double residual()
  {
    addMultipliers(1.0);
    const double residual = rod_.residual();
    addMultipliers(-1.0);
    return residual;
  }
  double forceScale() const
  {
    return std::max(rod_.forceScale(),
                    multipliers_.cwiseAbs().maxCoeff() / std::max<Eigen::Index>(1, c_.cols() / c_.rows()));
  }
  double noiseLevel() const { return rod_.noiseLevel(); }

private:
  double average(Eigen::Index i, const double* x) const
  {
    double sum = 0.0;
    for (AveragedRod::Averages::InnerIterator entry(c_, i); entry; ++entry)
      sum += entry.value() * x[entry.col()];
    return sum;
  }

  void addMultipliers(double factor)
  {
    for (Eigen::Index i = 0; i < c_.rows(); ++i)
      for (AveragedRod::Averages::InnerIterator entry(c_, i); entry; ++entry)
        if (rod_.isFree(static_cast<int>(entry.col())))
          for (int k = 0; k < 3; ++k)
            rod_.gradient()[4 * entry.col() + k] += factor * entry.value() * multipliers_[3 * i + k];
  }

  RodSystem& rod_;
  const AveragedRod::Averages& c_;
  const Eigen::Matrix3Xd* targets_ = nullptr;
  Eigen::Index rows_;
  Eigen::MatrixXd columns_;   ///< K^-1 C^T, 4 nodes x 3 averages
  Eigen::MatrixXd schur_;     ///< C K^-1 C^T
  Eigen::LDLT<Eigen::MatrixXd> factor_;
  Eigen::VectorXd gap_, multipliers_;
  AverageProjection projection_;
};

class AveragedRod::Impl : public SubstepEquations
{
public:
  Impl(std::shared_ptr<const RodModel> model, std::shared_ptr<const Averages> a, const TimeConfig& time)
    : rod(std::move(model), time),
      averages(std::move(a)),
      equations(rod.system, *averages)
  {
    plan.stages.reserve(2);
  }

  StepFailure attempt(const Substep& substep, StepReport& report) override
  {
    const double t = substep.from, h = substep.length;
    planStep(Integrator::implicit_euler, rod.time.spectral_radius, h, rod.work.last_step, plan);
    if (const StepFailure failure = rod.beginStep(plan, *inputs, duration, t, h); failure != StepFailure::none)
      return failure;
    rod.beginStage(0, *inputs, duration, t, h);
    at = start + (t + h) / duration * (*targets - start);
    if (!equations.meet(rod.model->mass, at))
      return StepFailure::singular_matrix;
    const NewtonResult newton = minimize(equations, rod.time.newton);
    report.iterations += newton.iterations;
    report.factorizations += newton.factorizations;
    if (!newton.ok())
      return newton.failure;
    report.residual = std::max(report.residual, newton.residual);
    report.max_strain = std::max(report.max_strain, newton.max_strain);
    rod.finishStep(*inputs, duration, t, h, report);
    forces = -Eigen::Map<const Eigen::Matrix3Xd>(equations.multipliers().data(), 3, averages->rows());
    bearShares();
    return StepFailure::none;
  }

  void accept(const Substep& substep) override
  {
    rod.moveGrasps(*inputs, duration, substep.to);
    std::swap(rod.work, rod.next);
  }

  void refuse(const Substep& substep, StepFailure failure, StepReport& report) override
  {
    if (failure == StepFailure::interrupted)
    {
      rod.refuse(report, failure, kStepInterrupted);
      return;
    }
    const char* dependent =
        "prescribed averages depend on each other on the nodes that are not held: leave some out, or hold fewer nodes";
    rod.refuseUnsolved(report, failure, substep.length, false, failure == StepFailure::singular_matrix ? dependent : "",
                       true);
  }

  /// Averages pull at held nodes, too, which hand that on to what holds them.
  void bearShares()
  {
    for (Eigen::Index i = 0; i < averages->rows(); ++i)
      for (Averages::InnerIterator entry(*averages, i); entry; ++entry)
      {
        const int node = static_cast<int>(entry.col());
        for (std::size_t k = 0; k < rod.wrenches.size() && !rod.system.isFree(node); ++k)
        {
          const GraspState& grasp = rod.work.grasps[k];
          if (!grasp.active || node < grasp.first_node || node > grasp.last_node)
            continue;
          const Eigen::Vector3d force = entry.value() * forces.col(i);
          rod.wrenches[k].force += force;
          rod.wrenches[k].torque += (rod.system.position(node) - rod.stage_poses[k].position).cross(force);
        }
      }
  }

  RodStepper::Impl rod;
  std::shared_ptr<const Averages> averages;
  ConstrainedRod equations;
  StepPlan plan;
  Eigen::Matrix3Xd start, at, forces;
  const Eigen::Matrix3Xd* targets = nullptr;
  const RodInputs* inputs = nullptr;   ///< of the present step
  double duration = 0.0;               ///< of the present step [s]
};

AveragedRod::AveragedRod(std::shared_ptr<const RodModel> model, std::shared_ptr<const Averages> averages,
                         const TimeConfig& time)
{
  const std::string who = "rod '" + model->name + "': ";
  if (!averages || averages->rows() == 0 || averages->cols() != model->nodes())
    throw std::invalid_argument(who + "averages of its " + std::to_string(model->nodes()) +
                                " nodes expected, at least one");
  if (time.integrator != Integrator::implicit_euler || time.error_tolerance > 0)
    throw std::invalid_argument(who + "prescribed averages need time.integrator: implicit_euler, with fixed steps");
  const Eigen::VectorXd weights = *averages * Eigen::VectorXd::Ones(averages->cols());
  for (Eigen::Index i = 0; i < weights.size(); ++i)
    if (!(std::abs(weights[i] - 1.0) < 1e-9))
      throw std::invalid_argument(who + "the weights of average " + std::to_string(i) + " sum to " +
                                  std::to_string(weights[i]) + "; must be 1");
  impl_ = std::make_unique<Impl>(std::move(model), std::move(averages), time);
}
AveragedRod::~AveragedRod() = default;
AveragedRod::AveragedRod(AveragedRod&&) noexcept = default;

StepReport AveragedRod::step(RodState& state, const RodInputs& inputs, const Eigen::Matrix3Xd& targets, double duration)
{
  RodStepper::Impl& rod = impl_->rod;
  StepReport report;
  std::string what;
  if (!(duration > 0) || !std::isfinite(duration))
    what = "step length";
  else if (targets.cols() != impl_->averages->rows())
    what = "number of averages (" + std::to_string(targets.cols()) + " for " + std::to_string(impl_->averages->rows()) +
           ")";
  else if (!targets.allFinite())
    what = "averages";
  if (!what.empty() || !rod.inputsFinite(state, inputs, what))
    return rod.refuse(report, StepFailure::input_not_finite, what + " is not finite or not valid; correct this input");
  rod.begin(state);
  impl_->start.setZero(3, targets.cols());   // entry by entry: Eigen's product takes memory
  for (Eigen::Index i = 0; i < targets.cols(); ++i)
    for (Averages::InnerIterator entry(*impl_->averages, i); entry; ++entry)
      impl_->start.col(i) += entry.value() * state.x.col(entry.col());
  impl_->targets = &targets;
  impl_->inputs = &inputs;
  impl_->duration = duration;
  const SubstepRule rule{duration, 0.0, 0.0, rod.time.min_step, 1, rod.time.newton.max_cuts};
  SubstepController(rule).run(*impl_, duration, report);
  if (!report.ok)
    return report;
  state = rod.work;
  return report;
}

const Eigen::Matrix3Xd& AveragedRod::averageForces() const { return impl_->forces; }
const std::vector<Wrench>& AveragedRod::wrenches() const { return impl_->rod.wrenches; }
RodEnergies AveragedRod::energies(const RodState& state, const Eigen::Vector3d& gravity) const
{
  return impl_->rod.energies(state, gravity);
}

}   // namespace slender
