// Static equilibrium of rods with bodies and contact: implicit Euler steps that grow, from rest each time. Each minimises the energy with a
// proximal term whose weight is the mass over the step squared. The inertia of the Hessian says whether the end is a minimum; from a saddle the
// search goes on along the direction of negative curvature.
#include <algorithm>
#include <cmath>
#include <limits>

#include "rod_group_impl.h"
#include "slender_sim/dynamics/lowest_eigenvalue.h"
#include "slender_sim/geometry/rotation.h"
#include "statics_advice.h"

namespace slender {

namespace {

void standStill(RodGroupState& state)
{
  for (RodState& rod : state.rods)
  {
    rod.forgetHistory();
    rod.v.setZero();
    for (GraspState& g : rod.grasps)
      g.velocity = {};
  }
  for (RigidBodyState& body : state.bodies)
  {
    body.velocity = {};
    body.has_history = false;
  }
  for (Twist& v : state.obstacle_velocities)
    v = {};
}

class GroupEquilibriumSearch
{
public:
  GroupEquilibriumSearch(RodGroup::Impl& group, const RodGroupInputs& targets, RodGroupState state, StepReport& total)
    : group_(group), targets_(targets), work(std::move(state)), total_(total), force_scale_(0.0), lever_(std::numeric_limits<double>::max())
  {
    for (const auto& rod : group_.model.rods)
      lever_ = std::min(lever_, rod->rest_length.minCoeff());
  }

  bool settle(double first_step);
  bool settleStably(bool leave_saddles);
  StepFailure failure() const { return failure_; }

private:
  double unbalanced(double h) const;
  bool escape(double lowest, double energy, double noise);

  RodGroup::Impl& group_;
  const RodGroupInputs& targets_;

public:
  RodGroupState work;

private:
  RodGroupState before_;
  StepReport& total_;
  StepFailure failure_ = StepFailure::none;
  double force_scale_, lever_;   ///< lever: for moments beside forces, the shortest edge
};

/// What is left of the forces is what accelerates rods and bodies in a step of h from rest.
double GroupEquilibriumSearch::unbalanced(double h) const
{
  double sum = 0.0;
  for (std::size_t r = 0; r < work.rods.size(); ++r)
    for (int i = 0; i < group_.model.rods[r]->nodes(); ++i)
      if (group_.rods[r]->system.isMoving(i))
        sum = std::max(sum, group_.model.rods[r]->mass[i] * (work.rods[r].x.col(i) - before_.rods[r].x.col(i)).norm() / (h * h));
  for (std::size_t b = 0; b < work.bodies.size(); ++b)
    if (group_.model.bodies[b].simulated)
    {
      const RigidBodyModel& m = group_.model.bodies[b];
      const Pose &from = before_.bodies[b].X_WB, &to = work.bodies[b].X_WB;
      const Eigen::Vector3d turn = rotationVector(from.orientation.conjugate() * to.orientation);
      sum = std::max({sum, m.mass * (to.position - from.position).norm() / (h * h), (m.inertia * turn).norm() / (lever_ * h * h)});
    }
  return sum;
}

bool GroupEquilibriumSearch::settle(double h)
{
  constexpr int kMaxRounds = 400;
  constexpr double kUnbalanced = 1e-8;   // of the largest force
  for (int round = 0, failures = 0; round < kMaxRounds; ++round)
  {
    standStill(work);
    before_ = work;
    const StepReport report = group_.step(work, targets_, h);
    total_.iterations += report.iterations;
    total_.factorizations += report.factorizations;
    if (!report.ok)
    {
      failure_ = report.failure;
      total_.message = report.failure == StepFailure::input_not_finite ? report.message : "";
      h *= 0.1;
      if (++failures > 12)
        return false;
      continue;
    }
    ++total_.substeps;
    force_scale_ = std::max(force_scale_, group_.loop->coupled()->forceScale());
    total_.residual = unbalanced(h) / force_scale_;
    total_.max_strain = report.max_strain;
    if (round > 0 && total_.residual < kUnbalanced)
    {
      standStill(work);
      return true;
    }
    h = std::min(h * (report.iterations < 10 ? 4.0 : 1.5), 1e6);
  }
  failure_ = StepFailure::newton_diverged;
  total_.message = "the equilibrium did not settle: something may be free to drift; hold it, or let it settle by time stepping with damping "
                   "(start: as_given)";
  return false;
}

/// Leaves the saddle `work` along its mode: to both sides, and less and less far, until the steps end at a state of lower energy.
bool GroupEquilibriumSearch::escape(double lowest, double energy, double noise)
{
  const RodGroupState saddle = work;
  // Inertia above the negative eigenvalue makes the first steps convex, so that they slide down instead of jumping.
  const double h = std::isfinite(lowest) ? 0.7 / std::sqrt(-lowest) : 1e-3 * group_.time.step;
  CoupledSystem& system = *group_.loop->coupled();
  for (const double turn : {0.1, -0.1, 0.01, -0.01, 1e-3, -1e-3})
  {
    work = saddle;
    system.beginStability(saddle, group_.inputs);
    const auto definite = [&](double s) { return system.definite(s); };
    lowestEigenvalue(definite, system.neutralBand());
    system.findLowestMode();
    if (!system.displaceAlongMode(turn, work) || !settle(h))
      continue;
    system.beginStability(work, group_.inputs);
    if (system.energyAt(0.0).energy() < energy - noise)
      return true;
  }
  work = saddle;
  return false;
}

bool GroupEquilibriumSearch::settleStably(bool leave_saddles)
{
  constexpr int kMostEscapes = 50;
  if (!settle(group_.time.step))
    return false;
  CoupledSystem& system = *group_.loop->coupled();
  for (int k = 0;; ++k)
  {
    system.beginStability(work, group_.inputs);
    const RodEvaluation at = system.energyAt(0.0);
    const LowestEigenvalue lowest = lowestEigenvalue([&](double s) { return system.definite(s); }, system.neutralBand());
    total_.energy = at.energy();
    total_.lowest_eigenvalue = lowest.value;
    total_.stable = lowest.value >= 0;
    const StepReport here = total_;
    const double noise = 1e-13 * (std::abs(at.stretch) + std::abs(at.bend_twist) + std::abs(at.potential));
    if (total_.stable || !leave_saddles || k == kMostEscapes)
      return true;
    if (!escape(lowest.value, at.energy(), noise))
    {
      total_.residual = here.residual;
      total_.max_strain = here.max_strain;
      total_.message.clear();
      return true;
    }
    ++total_.escapes;
  }
}

}  // namespace

StepReport RodGroup::solveEquilibrium(RodGroupState& state, const RodGroupInputs& inputs, bool leave_saddles)
{
  if (std::any_of(inputs.rods.begin(), inputs.rods.end(), [](const RodInputs& rod) { return rod.torques.size() > 0; }))
  {
    StepReport refused;
    refused.ok = false;
    refused.failure = StepFailure::input_not_finite;
    refused.message = "statics of rods with contact or bodies does not know torques about the tangent: weld a body with this torque, or let the scene "
                      "settle by time stepping with damping (start: as_given)";
    return refused;
  }
  TimeConfig time = impl_->time;
  time.integrator = Integrator::implicit_euler;
  time.error_tolerance = 0;
  time.newton.max_iterations = std::max(60, time.newton.max_iterations);
  time.newton.tolerance = std::min(1e-7, time.newton.tolerance);
  Impl settling(impl_->model, time);
  settling.loop->coupled()->threads = impl_->threads;
  const StepReport report = settling.solveEquilibrium(state, inputs, leave_saddles);
  for (std::size_t r = 0; r < impl_->rods.size(); ++r)
    impl_->rods[r]->wrenches = settling.rods[r]->wrenches;
  return report;
}

StepReport RodGroup::Impl::solveEquilibrium(RodGroupState& state, const RodGroupInputs& targets, bool leave_saddles)
{
  StepReport total;
  GroupEquilibriumSearch search(*this, targets, state, total);
  if (search.settleStably(leave_saddles))
  {
    total.message.clear();
    state = search.work;
    return total;
  }
  total.ok = false;
  total.failure = search.failure();
  if (total.message.empty())
    total.message = explainStatics(total.failure);
  return total;
}

}  // namespace slender
