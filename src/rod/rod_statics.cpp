// Static equilibrium by continuation: the grasps are carried to their targets in small moves, and at each the energy is
// minimised with a proximal term 1/2 w |x - x_k|^2 whose weight falls to zero as the iteration settles. What it settles at is stationary. The
// inertia of the Hessian says whether it is a minimum; from a saddle the search goes on along the direction of negative curvature.
#include <algorithm>
#include <cmath>

#include "rod_stability.h"
#include "rod_stepper_impl.h"
#include "slender_sim/geometry/rotation.h"
#include "statics_advice.h"

namespace slender {

/// The search for one equilibrium.
class RodStepper::Impl::EquilibriumSearch
{
public:
  EquilibriumSearch(Impl& rod, const RodInputs& inputs, StepReport& report);
  /// Carries the grasps to their targets. Returns false when the rod cannot follow; failure() says why.
  bool carryGrasps();
  /// Minimises the energy from rod.work on. Returns false when that does not settle.
  bool settle();
  /// Settles again and again until the equilibrium is stable or every way down from a saddle was tried (with leave_saddles). Returns false if
  /// nothing settled at all.
  bool settleStably(bool leave_saddles);
  StepFailure failure() const { return failure_; }

private:
  NewtonResult round(double fraction, double weight);
  void furtherDown();
  bool escape(const RodStability& at);

  Impl& rod_;
  const RodInputs& inputs_;
  StepReport& report_;
  RodInputs targets_;
  NewtonConfig newton_;
  StepFailure failure_ = StepFailure::none;
  double length_, base_weight_, move_ = 0.0;
  double twist_work_ = 0.0;   ///< of torques about tangents since the search began [J]
  double relative_ = 1.0;   ///< proximal weight over base_weight_
};

RodStepper::Impl::EquilibriumSearch::EquilibriumSearch(Impl& rod, const RodInputs& inputs, StepReport& report)
  : rod_(rod), inputs_(inputs), report_(report), targets_(inputs), newton_(rod.time.newton), length_(rod.model->rest_length.sum())
{
  for (std::size_t k = 0; k < rod_.work.grasps.size(); ++k)
    if (rod_.work.grasps[k].active)
    {
      const Pose &a = rod_.work.grasps[k].X_WG, &b = inputs.grasps[k].X_WG;
      move_ = std::max({move_, (b.position - a.position).norm() / (0.02 * length_), rotationVector(a.orientation.conjugate() * b.orientation).norm() / 0.2});
    }
  for (GraspTarget& g : targets_.grasps)
    g.velocity.reset();
  // scale of the proximal weight: the stiffness of the whole rod against bending, or against its weight if that is larger
  const RodModel& model = *rod_.model;
  const double bend = std::max(model.bend_modulus.row(0).maxCoeff(), model.bend_modulus.row(2).maxCoeff());
  double load_total = 0.0;
  for (int i = 0; i < model.nodes(); ++i)
    load_total += rod_.load(inputs, i).norm();
  base_weight_ = std::max(bend / std::pow(length_, 3), load_total / length_) * 100.0 / model.nodes();
  rod_.system.setTwistLoads(inputs.torques);
  newton_.tolerance = std::min(newton_.tolerance, 1e-8);
  newton_.max_iterations = std::max(60, newton_.max_iterations);
}

/// Minimises with the grasps at a fraction of their way and this proximal weight. The trial is the result.
NewtonResult RodStepper::Impl::EquilibriumSearch::round(double fraction, double weight)
{
  rod_.system.load(rod_.work);
  rod_.placeAt(targets_, 1.0, fraction);
  rod_.carryFreeNodes(inputs_, weight);
  const NewtonResult result = minimize(rod_.system, newton_);
  report_.iterations += result.iterations;
  report_.factorizations += result.factorizations;
  failure_ = result.failure;
  if (!result.ok())
    return result;
  ++report_.substeps;
  twist_work_ += rod_.system.twistWork();
  rod_.next = rod_.work;
  rod_.system.store(rod_.next);
  for (std::size_t k = 0; k < rod_.next.grasps.size(); ++k)
    if (rod_.next.grasps[k].active)
      rod_.next.grasps[k].X_WG = rod_.stage_poses[k];   // frames and twists belong to these
  std::swap(rod_.work, rod_.next);
  return result;
}

bool RodStepper::Impl::EquilibriumSearch::carryGrasps()
{
  double done = move_ > 0 ? 0.0 : 1.0, advance = move_ > 1 ? 1.0 / move_ : 1.0;
  for (int failures = 0; done < 1.0;)
  {
    const double fraction = std::min(1.0, done + advance);
    if (round(fraction, relative_ * base_weight_).ok())
    {
      done = fraction;
      failures = 0;
      relative_ = std::max(0.2 * relative_, 1.0);
      advance = std::min(1.5 * advance, move_ > 1 ? 1.0 / move_ : 1.0);
      continue;
    }
    relative_ = std::min(10.0 * relative_, 1e8);
    advance *= 0.5;
    if (++failures > 40 || advance < 1e-6)
      return false;
  }
  return true;
}

/// Newton did not arrive but came further down: the next round begins there.
void RodStepper::Impl::EquilibriumSearch::furtherDown()
{
  rod_.system.moveAlong(0.0);
  rod_.system.evaluate(false);
  twist_work_ += rod_.system.twistWork();
  rod_.system.store(rod_.work);
}

bool RodStepper::Impl::EquilibriumSearch::settle()
{
  constexpr int kMaxRounds = 1000;
  double ease = 0.01;   // smallest factor by which the weight falls from round to round
  for (int k = 0, failures = 0; k < kMaxRounds; ++k)
  {
    const double weight = relative_ < 1e-9 ? 0.0 : relative_ * base_weight_;
    const NewtonResult result = round(1.0, weight);
    if (!result.ok())
    {
      if (result.failure == StepFailure::newton_diverged && weight > 0)
        furtherDown();
      relative_ = std::max(10.0 * relative_, 1e-6);
      ease = std::sqrt(ease);   // let go more slowly, so as not to come back here at once
      if (++failures > 40)
        return false;
      continue;
    }
    if (weight == 0.0)
      return true;
    failures = 0;
    const double shift = (rod_.next.x - rod_.work.x).colwise().norm().maxCoeff() / length_;   // next is what the round began with
    relative_ *= std::max(ease, shift < 1e-3 ? 0.01 : shift < 0.05 ? 0.2 : 0.7);
    ease = std::max(0.01, 0.7 * ease);
  }
  failure_ = StepFailure::newton_diverged;
  return false;
}

/// Leaves a saddle, at which the rod is, along its mode of negative curvature: to both sides, and less and less far, until the minimisation ends
/// at a stationary point of lower energy. The side that the mode's sign gives comes first; by symmetry both are usually equal.
bool RodStepper::Impl::EquilibriumSearch::escape(const RodStability& at)
{
  const RodState saddle = rod_.work;
  const Eigen::VectorXd mode = at.mode;
  const double work_before = twist_work_;
  for (const double turn : {0.1, -0.1, 0.01, -0.01, 1e-3, -1e-3})
  {
    rod_.work = saddle;
    twist_work_ = work_before;
    rod_.system.load(rod_.work);
    rod_.placeAt(targets_, 1.0, 1.0);
    Eigen::Map<Eigen::VectorXd>(rod_.system.direction(), mode.size()) = mode;
    rod_.system.moveAlong(turn);
    if (rod_.system.evaluate(false).min_chi <= kFoldedChi)
      continue;
    twist_work_ += rod_.system.twistWork();
    rod_.system.store(rod_.work);
    // A weight above the negative eigenvalue makes the first rounds convex, so that they slide down instead of jumping.
    relative_ = std::max(1e-6, 2.0 * std::abs(at.lowest) * rod_.model->mass.maxCoeff() / base_weight_);
    if (!std::isfinite(relative_))
      relative_ = 1e-2;
    if (settle() && assessStability(rod_, inputs_, false).energy - (twist_work_ - work_before) < at.energy - at.energy_noise)
      return true;
  }
  rod_.work = saddle;
  twist_work_ = work_before;
  return false;
}

bool RodStepper::Impl::EquilibriumSearch::settleStably(bool leave_saddles)
{
  constexpr int kMostEscapes = 50;
  if (!settle())
    return false;
  for (int k = 0;; ++k)
  {
    RodStability at = assessStability(rod_, inputs_, true);
    report_.stable = at.stable;
    report_.lowest_eigenvalue = at.lowest;
    report_.energy = at.energy;
    if (at.stable || !leave_saddles || k == kMostEscapes || !escape(at))
    {
      rod_.lowest_mode = std::move(at.mode);
      return true;
    }
    ++report_.escapes;
  }
}

StepReport RodStepper::Impl::solveEquilibrium(RodState& state, const RodInputs& inputs, bool leave_saddles)
{
  StepReport report;
  std::string what;
  if (!inputsFinite(state, inputs, what))
    return refuse(report, StepFailure::input_not_finite, what + " is not finite or not valid; correct this input");
  begin(state);
  addFrames(*model, work);
  work.forgetHistory();
  work.v.setZero();
  for (GraspState& g : work.grasps)
    g.velocity = Twist{};
  const std::vector<GraspState> start = work.grasps;
  origin = &start;
  system.leaveOutStretching(false);
  system.load(work);
  system.setResponse(0.0, nullptr);

  EquilibriumSearch search(*this, inputs, report);
  if (!search.carryGrasps() || !search.settleStably(leave_saddles))
    return refuse(report, search.failure(), explainStatics(search.failure()));
  evaluateEquilibrium(inputs, report);
  // Newton's increments of 1e-8 of an edge leave 1e-7 of the largest force. Where nothing balances a load, as much as the load is left.
  constexpr double kUnbalanced = 1e-4;
  if (!(report.residual < kUnbalanced))
    return refuse(report, StepFailure::newton_diverged, "no equilibrium was found: nothing balances the loads, so that the rod drifts: hold it by a "
                                                        "grasp, or let it move by time stepping (start: as_given)");
  for (std::size_t k = 0; k < work.grasps.size(); ++k)
    if (work.grasps[k].active)
      work.grasps[k].X_WG = {inputs.grasps[k].X_WG.position, inputs.grasps[k].X_WG.orientation.normalized()};
  state = work;
  return report;
}

StepReport RodStepper::Impl::assessEquilibrium(const RodState& state, const RodInputs& inputs)
{
  StepReport report;
  std::string what;
  if (!inputsFinite(state, inputs, what))
    return refuse(report, StepFailure::input_not_finite, what + " is not finite or not valid; correct this input");
  begin(state);
  addFrames(*model, work);
  system.leaveOutStretching(false);
  system.load(work);
  system.setResponse(0.0, nullptr);
  RodStability at = assessStability(*this, inputs, true);
  report.energy = at.energy;
  report.lowest_eigenvalue = at.lowest;
  report.stable = at.stable;
  lowest_mode = std::move(at.mode);
  evaluateEquilibrium(inputs, report);
  return report;
}

/// Trial of a round: free nodes, and what the proximal term holds them to, go along with the grasps, by the displacements of the held
/// nodes before and after them. Otherwise a move longer than an edge would fold the rod next to the grasp.
void RodStepper::Impl::carryFreeNodes(const RodInputs& inputs, double weight)
{
  const int n = model->nodes();
  const auto moved = [&](int i) { return Eigen::Vector3d(system.position(i % n) - work.x.col(i % n)); };
  const auto place = [&](int i, const Eigen::Vector3d& by) {
    const Eigen::Vector3d x = work.x.col(i % n) + by;
    system.setPosition(i % n, x);
    system.setInertia(i % n, weight, x, load(inputs, i % n));
  };
  int first = 0;
  while (first < n && system.isFree(first))
    ++first;
  if (first == n)
  {
    for (int i = 0; i < n; ++i)
      place(i, Eigen::Vector3d::Zero());
    return;
  }
  if (!model->closed)
    for (int i = 0; i < first; ++i)
      place(i, moved(first));
  const int end = model->closed ? first + n : n;   // a loop ends at its first held node again
  for (int left = first; left < end;)
  {
    system.setInertia(left % n, 0.0, Eigen::Vector3d::Zero(), load(inputs, left % n));
    int right = left + 1;
    while (right < end && system.isFree(right % n))
      ++right;
    const Eigen::Vector3d a = moved(left), b = right < end || model->closed ? moved(right) : a;
    for (int i = left + 1; i < right; ++i)
      place(i, a + (b - a) * (static_cast<double>(i - left) / (right - left)));
    left = right;
  }
}

/// Residual, strain and wrenches of the equilibrium `work`.
void RodStepper::Impl::evaluateEquilibrium(const RodInputs& inputs, StepReport& report)
{
  system.load(work);
  RodInputs targets = inputs;
  for (GraspTarget& g : targets.grasps)
    g.velocity.reset();
  placeAt(targets, 1.0, 1.0);
  for (int i = 0; i < model->nodes(); ++i)
    system.setInertia(i, 0.0, Eigen::Vector3d::Zero(), load(inputs, i));
  system.evaluate(false);
  report.residual = system.residual() / system.forceScale();
  for (int j = 0; j < model->edges(); ++j)
    report.max_strain = std::max(report.max_strain, std::abs(system.arrays().strain[j]));
  computeWrenches(inputs, 0.0);
}

}  // namespace slender
