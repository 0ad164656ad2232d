// Static equilibrium of rods with bodies and contact: implicit Euler steps that grow, from rest each time. Each
// minimises the energy with a proximal term whose weight is the mass over the step squared. The weight never becomes
// zero, because contact needs a step. What the steps end at is judged, and saddles are left, by settleStably().
#include <algorithm>
#include <cmath>
#include <limits>

#include "rod_group_impl.h"
#include "slender_sim/dynamics/equilibrium_search.h"
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

/// The rods and bodies in the terms of settleStably().
class GroupEquilibrium
{
public:
  GroupEquilibrium(RodGroup::Impl& group, const RodGroupInputs& targets, RodGroupState state, StepReport& total)
    : group_(group),
      targets_(targets),
      work_(std::move(state)),
      total_(total),
      force_scale_(0.0),
      lever_(std::numeric_limits<double>::max())
  {
    for (const auto& rod : group_.model.rods)
      lever_ = std::min(lever_, rod->rest_length.minCoeff());
  }

  /// Steps from rest, the first of `h` seconds, until nothing is accelerated. Returns false when that does not end;
  /// failure() says why.
  bool settle(double h);
  const RodGroupState& state() const { return work_; }
  StepFailure failure() const { return failure_; }

  // ---- what settleStably() needs
  EquilibriumStability assess(bool spectrum);
  struct Configuration
  {
    RodGroupState state;
    double residual, max_strain;
  };
  Configuration configuration() const { return {work_, total_.residual, total_.max_strain}; }
  void restore(const Configuration& c);
  bool displace(double turn);
  bool settleFrom(double lowest);

private:
  double unbalanced(double h) const;

  RodGroup::Impl& group_;
  const RodGroupInputs& targets_;
  RodGroupState work_, before_;
  StepReport& total_;
  StepFailure failure_ = StepFailure::none;
  double force_scale_, lever_;   ///< lever: turns moments into forces; the shortest edge [m]
};

/// Returns the largest unbalanced force [N]: the one that accelerates rods and bodies in a step of h from rest.
double GroupEquilibrium::unbalanced(double h) const
{
  double sum = 0.0;
  for (std::size_t r = 0; r < work_.rods.size(); ++r)
    for (int i = 0; i < group_.model.rods[r]->nodes(); ++i)
      if (group_.rods[r]->system.isMoving(i))
        sum = std::max(
            sum, group_.model.rods[r]->mass[i] * (work_.rods[r].x.col(i) - before_.rods[r].x.col(i)).norm() / (h * h));
  for (std::size_t b = 0; b < work_.bodies.size(); ++b)
    if (group_.model.bodies[b].simulated)
    {
      const RigidBodyModel& m = group_.model.bodies[b];
      const Pose &from = before_.bodies[b].X_WB, &to = work_.bodies[b].X_WB;
      const Eigen::Vector3d turn = rotationVector(from.orientation.conjugate() * to.orientation);
      sum = std::max(
          {sum, m.mass * (to.position - from.position).norm() / (h * h), (m.inertia * turn).norm() / (lever_ * h * h)});
    }
  return sum;
}

bool GroupEquilibrium::settle(double h)
{
  constexpr int kMaxRounds = 400;
  constexpr double kUnbalanced = 1e-8;   // of the largest force
  for (int round = 0, failures = 0; round < kMaxRounds; ++round)
  {
    standStill(work_);
    before_ = work_;
    const StepReport report = group_.step(work_, targets_, h);
    total_.iterations += report.iterations;
    total_.factorizations += report.factorizations;
    if (!report.ok)
    {
      failure_ = report.failure;
      total_.message = report.failure == StepFailure::input_not_finite ? report.message : "";
      h *= 0.1;
      if (++failures > 12 || failure_ == StepFailure::interrupted)
        return false;
      continue;
    }
    ++total_.substeps;
    force_scale_ = std::max(force_scale_, group_.loop->coupled()->forceScale());
    total_.residual = unbalanced(h) / force_scale_;
    total_.max_strain = report.max_strain;
    if (round > 0 && total_.residual < kUnbalanced)
    {
      standStill(work_);
      return true;
    }
    h = std::min(h * (report.iterations < 10 ? 4.0 : 1.5), 1e6);
  }
  failure_ = StepFailure::newton_diverged;
  total_.message =
      "the equilibrium did not settle: something may be free to drift; hold it, or let it settle by time stepping with "
      "damping "
      "(start: as_given)";
  return false;
}

EquilibriumStability GroupEquilibrium::assess(bool spectrum)
{
  CoupledSystem& system = *group_.loop->coupled();
  system.beginStability(work_, group_.inputs);
  const RodEvaluation at = system.energyAt(0.0);
  EquilibriumStability result;
  result.energy = at.energy();
  result.energy_noise = 1e-13 * (std::abs(at.stretch) + std::abs(at.bend_twist) + std::abs(at.potential));
  if (!spectrum)
    return result;
  result.lowest = lowestEigenvalue([&](double s) { return system.definite(s); }, system.neutralBand()).value;
  result.stable = result.lowest >= 0;
  return result;
}

void GroupEquilibrium::restore(const Configuration& c)
{
  work_ = c.state;
  total_.residual = c.residual;
  total_.max_strain = c.max_strain;
  total_.message.clear();
}

bool GroupEquilibrium::displace(double turn)
{
  // The factor of the matrix near its lowest eigenvalue, which inverse iteration needs, belongs to the saddle: other
  // steps came in between.
  CoupledSystem& system = *group_.loop->coupled();
  system.beginStability(work_, group_.inputs);
  lowestEigenvalue([&](double s) { return system.definite(s); }, system.neutralBand());
  system.findLowestMode();
  return system.displaceAlongMode(turn, work_);
}

bool GroupEquilibrium::settleFrom(double lowest)
{
  // Inertia above the negative eigenvalue makes the first steps convex, so that they slide down instead of jumping.
  return settle(std::isfinite(lowest) ? 0.7 / std::sqrt(-lowest) : 1e-3 * group_.time.step);
}

}   // namespace

StepReport RodGroup::solveEquilibrium(RodGroupState& state, const RodGroupInputs& inputs, bool leave_saddles)
{
  if (std::any_of(inputs.rods.begin(), inputs.rods.end(), [](const RodInputs& rod) { return rod.torques.size() > 0; }))
  {
    StepReport refused;
    refused.ok = false;
    refused.failure = StepFailure::input_not_finite;
    refused.message =
        "statics of rods with contact or bodies does not know torques about the tangent: weld a body with this torque, "
        "or let the scene "
        "settle by time stepping with damping (start: as_given)";
    return refused;
  }
  TimeConfig time = impl_->time;
  time.integrator = Integrator::implicit_euler;
  time.error_tolerance = 0;
  time.newton.max_iterations = std::max(60, time.newton.max_iterations);
  time.newton.tolerance = std::min(1e-7, time.newton.tolerance);
  Impl settling(impl_->model, time);
  settling.loop->coupled()->setThreads(impl_->threads);
  const StepReport report = settling.solveEquilibrium(state, inputs, leave_saddles);
  for (std::size_t r = 0; r < impl_->rods.size(); ++r)
    impl_->rods[r]->wrenches = settling.rods[r]->wrenches;
  return report;
}

StepReport RodGroup::Impl::solveEquilibrium(RodGroupState& state, const RodGroupInputs& targets, bool leave_saddles)
{
  StepReport total;
  GroupEquilibrium equilibrium(*this, targets, state, total);
  if (equilibrium.settle(time.step))
  {
    settleStably(equilibrium, leave_saddles, total);
    total.message.clear();
    state = equilibrium.state();
    return total;
  }
  total.ok = false;
  total.failure = equilibrium.failure();
  if (total.message.empty())
    total.message = explainStatics(total.failure);
  return total;
}

}   // namespace slender
