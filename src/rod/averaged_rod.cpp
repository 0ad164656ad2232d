#include "slender_sim/rod/averaged_rod.h"

#include <algorithm>
#include <cmath>
#include <stdexcept>

#include <Eigen/Cholesky>

#include "island/island.h"
#include "rod_part.h"
#include "slender_sim/rod/average_projection.h"

namespace slender {

/// A rod under constraints C x = targets. Directions go along them, by a Schur complement of the rod's matrix.
class AveragedPart : public RodPart
{
public:
  AveragedPart(RodStepper::Impl& rod, const AveragedRod::Averages& c)
    : RodPart(rod, false),
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

  /// The averages move uniformly in the step from where they are in the loaded state to `targets` (3 x count [m]).
  void setTargets(const Eigen::Matrix3Xd& targets)
  {
    targets_ = &targets;
    start_.setZero(3, targets.cols());   // entry by entry: Eigen's product takes memory
    for (Eigen::Index i = 0; i < targets.cols(); ++i)
      for (AveragedRod::Averages::InnerIterator entry(c_, i); entry; ++entry)
        start_.col(i) += entry.value() * rod().work.x.col(entry.col());
  }

  Eigen::Matrix3Xd forces;   ///< with which the averages act at the end of the last substep (3 x count [N])

private:
  // ---- its steps
  StepFailure beginSubstep(const StepPlan& plan, const Substep& substep) override
  {
    if (const StepFailure failure = RodPart::beginSubstep(plan, substep); failure != StepFailure::none)
      return failure;
    at_ = start_ + (substep.from + substep.length) / duration() * (*targets_ - start_);
    return projection_.prepare(rod().model->mass, [this](int node) { return system_.isFree(node); })
               ? StepFailure::none
               : StepFailure::singular_matrix;   // averages depend on each other
  }
  void beginStage(std::size_t stage) override
  {
    RodPart::beginStage(stage);
    meet();
  }
  void endStage(std::size_t stage, bool last, StepReport& report) override
  {
    RodPart::endStage(stage, last, report);
    forces = -Eigen::Map<const Eigen::Matrix3Xd>(multipliers_.data(), 3, c_.rows());
    bearShares();
  }
  void refuse(StepFailure failure, double length, StepReport& report) const override
  {
    const char* dependent =
        "prescribed averages depend on each other on the nodes that are not held: leave some out, or hold fewer nodes";
    rod().refuseUnsolved(report, failure, length, false, failure == StepFailure::singular_matrix ? dependent : "",
                         true);
  }

  // ---- as Part
  void solve() override;
  /// With the forces of the averages, which are in the gradient only here.
  double residual() const override
  {
    addMultipliers(1.0);
    const double residual = system_.residual();
    addMultipliers(-1.0);
    return residual;
  }
  double forceScale() const override
  {
    return std::max(system_.forceScale(),
                    multipliers_.cwiseAbs().maxCoeff() / std::max<Eigen::Index>(1, c_.cols() / c_.rows()));
  }

  void meet();
  void bearShares();
  double average(Eigen::Index i, const double* x) const
  {
    double sum = 0.0;
    for (AveragedRod::Averages::InnerIterator entry(c_, i); entry; ++entry)
      sum += entry.value() * x[entry.col()];
    return sum;
  }
  void addMultipliers(double factor) const
  {
    for (Eigen::Index i = 0; i < c_.rows(); ++i)
      for (AveragedRod::Averages::InnerIterator entry(c_, i); entry; ++entry)
        if (system_.isFree(static_cast<int>(entry.col())))
          for (int k = 0; k < 3; ++k)
            system_.gradient()[4 * entry.col() + k] += factor * entry.value() * multipliers_[3 * i + k];
  }

  const AveragedRod::Averages& c_;
  const Eigen::Matrix3Xd* targets_ = nullptr;
  Eigen::Matrix3Xd start_, at_;   ///< averages where the step begins, and where the substep ends [m]
  Eigen::Index rows_;
  Eigen::MatrixXd columns_;   ///< K^-1 C^T, 4 nodes x 3 averages
  Eigen::MatrixXd schur_;     ///< C K^-1 C^T
  Eigen::LDLT<Eigen::MatrixXd> factor_;
  Eigen::VectorXd gap_, multipliers_;   ///< multipliers_: three per average [N]
  AverageProjection projection_;
};

/// Moves the trial positions of free nodes by the least sum of mass times distance squared, so that they have the
/// averages.
void AveragedPart::meet()
{
  for (int k = 0; k < 3; ++k)
  {
    for (Eigen::Index i = 0; i < c_.rows(); ++i)
      gap_[i] = at_(k, i) - average(i, system_.arrays().x[k]);
    const Eigen::VectorXd& moved = projection_.displacements(gap_.head(c_.rows()));
    for (int j = 0; j < static_cast<int>(c_.cols()); ++j)
      if (system_.isFree(j))
      {
        Eigen::Vector3d x = system_.position(j);
        x[k] += moved[j];
        system_.setPosition(j, x);
      }
  }
}

void AveragedPart::solve()
{
  system_.solve();
  columns_.setZero();
  for (Eigen::Index i = 0; i < c_.rows(); ++i)
    for (AveragedRod::Averages::InnerIterator entry(c_, i); entry; ++entry)
      if (system_.isFree(static_cast<int>(entry.col())))
        for (int k = 0; k < 3; ++k)
          columns_(4 * entry.col() + k, 3 * i + k) = entry.value();
  for (Eigen::Index r = 0; r < rows_; ++r)
    system_.solveFor(columns_.col(r).data());
  Eigen::Map<Eigen::VectorXd> direction(system_.direction(), columns_.rows());
  for (Eigen::Index i = 0; i < c_.rows(); ++i)
    for (int k = 0; k < 3; ++k)
    {
      const Eigen::Index row = 3 * i + k;
      schur_.row(row).setZero();
      gap_[row] = -at_(k, i);
      for (AveragedRod::Averages::InnerIterator entry(c_, i); entry; ++entry)
      {
        const Eigen::Index at = 4 * entry.col() + k;
        schur_.row(row) += entry.value() * columns_.row(at);
        gap_[row] += entry.value() * (system_.basePosition(static_cast<int>(entry.col()))[k] + direction[at]);
      }
    }
  factor_.compute(schur_);
  multipliers_ = gap_;
  factor_.solveInPlace(multipliers_);
  direction.noalias() -= columns_ * multipliers_;
}

/// Averages pull at held nodes, too, which hand that on to what holds them.
void AveragedPart::bearShares()
{
  RodStepper::Impl& rod = this->rod();
  for (Eigen::Index i = 0; i < c_.rows(); ++i)
    for (AveragedRod::Averages::InnerIterator entry(c_, i); entry; ++entry)
    {
      const int node = static_cast<int>(entry.col());
      for (std::size_t k = 0; k < rod.wrenches.size() && !system_.isFree(node); ++k)
      {
        const GraspState& grasp = rod.work.grasps[k];
        if (!grasp.active || node < grasp.first_node || node > grasp.last_node)
          continue;
        const Eigen::Vector3d force = entry.value() * forces.col(i);
        rod.wrenches[k].force += force;
        rod.wrenches[k].torque += (system_.position(node) - rod.stage_poses[k].position).cross(force);
      }
    }
}

class AveragedRod::Impl
{
public:
  Impl(std::shared_ptr<const RodModel> model, std::shared_ptr<const Averages> a, const TimeConfig& time)
    : rod(std::move(model), time),
      averages(std::move(a)),
      part(rod, *averages),
      island(time, false)
  {
    island.equations().tolerances.angles_may_keep_shift = RodSystem::anglesMayKeepShift();
    island.setParts({&part});
  }

  RodStepper::Impl rod;
  std::shared_ptr<const Averages> averages;
  AveragedPart part;
  Island island;
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
  impl_->part.setTargets(targets);
  impl_->part.begin(inputs, duration);
  double first = 0.0;
  report = impl_->island.step(duration, first);
  if (report.ok)
    state = rod.work;
  return report;
}

const Eigen::Matrix3Xd& AveragedRod::averageForces() const { return impl_->part.forces; }
const std::vector<Wrench>& AveragedRod::wrenches() const { return impl_->rod.wrenches; }
RodEnergies AveragedRod::energies(const RodState& state, const Eigen::Vector3d& gravity) const
{
  return impl_->rod.energies(state, gravity);
}

}   // namespace slender
