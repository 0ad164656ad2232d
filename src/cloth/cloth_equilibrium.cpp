// Static equilibria of a cloth as the stepper offers them.
#include "cloth_stepper_impl.h"
#include "dynamics/statics_advice.h"

namespace slender {

namespace {

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
    equations_(false)
{
  equations_.setParts({&part_});
  statics_.setParts(equations_, {&part_}, newton);
}

StepFailure ClothStatics::find(ClothState& state, const ClothInputs& inputs, bool search, bool leave_saddles,
                               StepReport& report)
{
  ClothInputs loads = inputs;
  loads.wind.setZero();
  part_.begin(state, loads, 1.0);
  if (!part_.beginStatics() && search)
    return StepFailure::newton_diverged;
  const StepFailure failure = statics_.solve(search, leave_saddles);
  report = statics_.report();
  if (failure != StepFailure::none)
    return failure;
  fromPoints(work_.x, state.x);
  state.v.setZero();
  state.next_step = 0.0;
  work_.pin_forces.resize(3, static_cast<Eigen::Index>(state.pins.size()));
  for (std::size_t k = 0; k < state.pins.size(); ++k)
    work_.pin_forces.col(static_cast<Eigen::Index>(k)) = -point(work_.system->gradient(), state.pins[k]);
  return StepFailure::none;
}

/// Searches for an equilibrium from `state`. Without `search` it only tells whether `state` is stable.
StepReport ClothStepper::Impl::statics(ClothState& state, const ClothInputs& inputs, bool search, bool leave_saddles)
{
  StepReport report;
  if (!accepts(state, inputs, 1.0, report))
    return report;
  const bool blown = !system->loads().empty() && inputs.wind != Eigen::Vector3d::Zero();
  if (!model->averages.empty() || plastic_.active() || blown)
    return refuse(report, StepFailure::input_not_finite,
                  "statics is for elastic cloth under gravity, loads and grasps: leave out " +
                      std::string(plastic_.active() ? "plasticity"
                                  : blown           ? "wind"
                                                    : "what it tracks") +
                      ", or let the cloth settle by time stepping with damping");
  followClamps(state);
  if (!statics_)
    statics_ = std::make_unique<ClothStatics>(clamped_model_ ? *clamped_model_ : *model, options.newton);
  if (const StepFailure failure = statics_->find(state, inputs, search, leave_saddles, report);
      failure != StepFailure::none)
    return refuse(report, failure, explainStatics(failure, "cloth", "start of the cloth"));
  pin_forces = statics_->pinForces();
  const Eigen::VectorXd& mode = statics_->mode();   // four entries per vertex
  lowest_mode = Eigen::Map<const Eigen::Matrix4Xd>(mode.data(), 4, mode.size() / 4).topRows<3>();
  return report;
}

StepReport ClothStepper::solveEquilibrium(ClothState& state, const ClothInputs& inputs, bool leave_saddles)
{
  return impl_->statics(state, inputs, true, leave_saddles);
}
StepReport ClothStepper::assessEquilibrium(const ClothState& state, const ClothInputs& inputs)
{
  ClothState copy = state;
  return impl_->statics(copy, inputs, false, false);
}
const Eigen::Matrix3Xd& ClothStepper::lowestMode() const { return impl_->lowest_mode; }

}   // namespace slender
