#include "slender_sim/rod/averaged_rod.h"

#include <cmath>
#include <stdexcept>

#include "averaged_part.h"
#include "island/island.h"

namespace slender {

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
