#include "slender_sim/cloth/cloth_stepper.h"

#include "cloth_stepper_impl.h"

namespace slender {

ClothStepper::Impl::Impl(std::shared_ptr<const ClothModel> m, const ClothOptions& o)
  : ClothWork(std::move(m), o),
    part_(*this)
{
}

/// The island of the cloth alone that steps as the options say now.
Island& ClothStepper::Impl::island()
{
  constexpr double kUnbalanced = 0.1;   // of the largest force: not a solution
  std::unique_ptr<Island>& island = undivided ? undivided_ : island_;
  if (!island)
  {
    TimeConfig time = options;
    time.newton.one_step = options.one_newton_step;
    island = std::make_unique<Island>(time, false);
    island->equations().tolerances.most_unbalanced = kUnbalanced;
    island->setParts({&part_});
  }
  return *island;
}

bool ClothStepper::Impl::load(const ClothState& state, const ClothInputs& inputs, double duration, StepReport& report)
{
  if (own_budget_)   // error control takes as many substeps as accuracy asks for
    budget_->start(options.error_tolerance > 0 ? WorkBudget::kUnbounded : WorkBudget::ofStep(model->vertices()));
  if (!accepts(state, inputs, duration, report))
    return false;
  part_.begin(state, inputs, duration);
  return true;
}

StepReport ClothStepper::Impl::advance()
{
  double next = work_.next_step;
  StepReport report = island().step(duration_, next);
  if (!report.ok)
    return report;
  report.work = ownWork();
  work_.next_step = next;
  return report;
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
  StepReport report;
  if (!impl_->load(state, inputs, duration, report))
    return report;
  report = impl_->advance();
  if (report.ok)
    impl_->end(state);
  return report;
}
StepReport ClothStepper::stepUndivided(ClothState& state, const ClothInputs& inputs, double duration)
{
  const ClothOptions own = impl_->options;
  const double next_step = state.next_step;
  impl_->options.error_tolerance = 0.0;
  if (own.integrator == Integrator::tr_bdf2)
    impl_->options.integrator = Integrator::implicit_euler;
  impl_->undivided = own.error_tolerance > 0.0 || own.integrator == Integrator::tr_bdf2;
  const StepReport report = step(state, inputs, duration);
  impl_->undivided = false;
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
const ClothModel& ClothStepper::model() const { return *impl_->model; }

ClothEnergies ClothStepper::energies(const ClothState& state, const Eigen::Vector3d& gravity) const
{
  return impl_->energies(state, gravity);
}

}   // namespace slender
