// Static equilibria of one rod: the grasps are what is prescribed (see EquilibriumSearch).
#include <algorithm>
#include <cmath>

#include "rod_stability.h"
#include "rod_work.h"
#include "slender_sim/dynamics/equilibrium_search.h"
#include "slender_sim/geometry/rotation.h"
#include "dynamics/statics_advice.h"

namespace slender {

/// The rod in the terms of EquilibriumSearch. The present configuration is rod.work. A proximal weight of 1 is 100
/// times the stiffness of the whole rod, shared among its nodes.
class RodWork::RodEquilibrium
{
public:
  RodEquilibrium(RodWork& rod, StepReport& report);
  /// Number of moves in which the grasps can be carried to their targets: each at most 2 % of the length and 0.2 rad.
  /// 0: all are there.
  double moves() const;

  // ---- what EquilibriumSearch needs
  NewtonResult round(double fraction, double weight);
  // `next` is what the round began with
  double shift() const { return (rod_.next.x - rod_.work.x).colwise().norm().maxCoeff() / length_; }
  void takeBase();
  double weightOf(double rate) const { return rate * rod_.model->mass.maxCoeff() / unit_weight_; }
  EquilibriumStability assess(bool spectrum);
  struct Configuration
  {
    RodState state;
    double twist_work;
  };
  Configuration configuration() const { return {rod_.work, twist_work_}; }
  void restore(const Configuration& c);
  bool displace(double turn);

private:
  RodWork& rod_;
  StepReport& report_;
  NewtonConfig newton_;
  double length_, unit_weight_;   ///< unit_weight_ [N/m]
  double twist_work_ = 0.0;       ///< of torques about tangents since the search began [J]
};

RodWork::RodEquilibrium::RodEquilibrium(RodWork& rod, StepReport& report)
  : rod_(rod),
    report_(report),
    newton_(rod.time.newton),
    length_(rod.model->rest_length.sum())
{
  // Scale of the proximal weight: the stiffness of the whole rod against bending, or against its loads if that is
  // larger.
  const RodModel& model = *rod_.model;
  const double bend = std::max(model.bend_modulus.row(0).maxCoeff(), model.bend_modulus.row(2).maxCoeff());
  double load_total = 0.0;
  for (int i = 0; i < model.nodes(); ++i)
    load_total += rod_.load(i).norm();
  unit_weight_ = std::max(bend / std::pow(length_, 3), load_total / length_) * 100.0 / model.nodes();
  rod_.system.setTwistLoads(rod_.inputs->torques);
  newton_.tolerance = std::min(newton_.tolerance, 1e-8);
  newton_.max_iterations = std::max(60, newton_.max_iterations);
}

double RodWork::RodEquilibrium::moves() const
{
  double result = 0.0;
  for (std::size_t k = 0; k < rod_.work.grasps.size(); ++k)
    if (rod_.work.grasps[k].active)
    {
      const Pose &a = rod_.work.grasps[k].X_WG, &b = rod_.inputs->grasps[k].X_WG;
      const double turn = rotationVector(a.orientation.conjugate() * b.orientation).norm();
      result = std::max({result, (b.position - a.position).norm() / (0.02 * length_), turn / 0.2});
    }
  return result;
}

NewtonResult RodWork::RodEquilibrium::round(double fraction, double weight)
{
  rod_.system.load(rod_.work);
  rod_.placeAt(fraction);
  rod_.carryFreeNodes(weight * unit_weight_);
  const NewtonResult result = minimize(rod_.system, newton_);
  report_.factorizations += result.factorizations;
  if (!result.ok())
    return result;
  twist_work_ += rod_.system.twistWork();
  rod_.next = rod_.work;
  rod_.system.store(rod_.next);
  for (std::size_t k = 0; k < rod_.next.grasps.size(); ++k)
    if (rod_.next.grasps[k].active)
      rod_.next.grasps[k].X_WG = rod_.stage_poses[k];   // frames and twists belong to these
  std::swap(rod_.work, rod_.next);
  return result;
}

void RodWork::RodEquilibrium::takeBase()
{
  rod_.system.moveAlong(0.0);
  rod_.system.evaluate(false);
  twist_work_ += rod_.system.twistWork();
  rod_.system.store(rod_.work);
}

EquilibriumStability RodWork::RodEquilibrium::assess(bool spectrum)
{
  RodStability at = assessStability(rod_, spectrum);
  if (spectrum)
    rod_.lowest_mode = std::move(at.mode);
  at.work = twist_work_;
  return at;
}

void RodWork::RodEquilibrium::restore(const Configuration& c)
{
  rod_.work = c.state;
  twist_work_ = c.twist_work;
}

bool RodWork::RodEquilibrium::displace(double turn)
{
  rod_.system.load(rod_.work);
  rod_.placeAt(1.0);
  Eigen::Map<Eigen::VectorXd>(rod_.system.direction(), rod_.lowest_mode.size()) = rod_.lowest_mode;
  rod_.system.moveAlong(turn);
  if (rod_.system.evaluate(false).min_chi <= kFoldedChi)
    return false;
  twist_work_ += rod_.system.twistWork();
  rod_.system.store(rod_.work);
  return true;
}

/// Loads `state` for statics. Returns false, with the report refused, when an input is not valid.
bool RodWork::beginStatics(const RodState& state, const RodInputs& loads, StepReport& report)
{
  std::string what;
  if (!inputsFinite(state, loads, what))
  {
    refuse(report, StepFailure::input_not_finite, what + " is not finite or not valid; correct this input");
    return false;
  }
  statics_inputs = loads;
  for (GraspTarget& g : statics_inputs.grasps)
    g.velocity.reset();
  begin(state, statics_inputs, 1.0);
  addFrames(*model, work);
  system.leaveOutStretching(false);
  system.load(work);
  system.setResponse(0.0, nullptr);
  return true;
}

StepReport RodWork::solveEquilibrium(RodState& state, const RodInputs& loads, bool leave_saddles)
{
  StepReport report;
  if (!beginStatics(state, loads, report))
    return report;
  work.forgetHistory();
  work.v.setZero();
  for (GraspState& g : work.grasps)
    g.velocity = Twist{};
  const std::vector<GraspState> start = work.grasps;
  origin = &start;

  RodEquilibrium equilibrium(*this, report);
  EquilibriumSearch<RodEquilibrium> search(equilibrium, report);
  if (!search.carry(equilibrium.moves()) || !search.settleStably(leave_saddles))
    return refuse(report, search.failure(), explainStatics(search.failure()));
  evaluateEquilibrium(report);
  if (!(report.residual < kMostUnbalanced))
    return refuse(report, StepFailure::newton_diverged,
                  "no equilibrium was found: nothing balances the loads, so that the rod drifts: hold it by a "
                  "grasp, or let it move by time stepping (start: as_given)");
  for (std::size_t k = 0; k < work.grasps.size(); ++k)
    if (work.grasps[k].active)
      work.grasps[k].X_WG = {loads.grasps[k].X_WG.position, loads.grasps[k].X_WG.orientation.normalized()};
  state = work;
  return report;
}

StepReport RodWork::assessEquilibrium(const RodState& state, const RodInputs& loads)
{
  StepReport report;
  if (!beginStatics(state, loads, report))
    return report;
  RodStability at = assessStability(*this, true);
  report.energy = at.energy;
  report.lowest_eigenvalue = at.lowest;
  report.stable = at.stable;
  lowest_mode = std::move(at.mode);
  evaluateEquilibrium(report);
  return report;
}

/// Trial of a round: free nodes, and what the proximal term holds them to, go along with the grasps, by the
/// displacements of the held nodes before and after them. Otherwise a move longer than an edge would fold the rod next
/// to the grasp.
void RodWork::carryFreeNodes(double weight)
{
  const int n = model->nodes();
  const auto moved = [&](int i) { return Eigen::Vector3d(system.position(i % n) - work.x.col(i % n)); };
  const auto place = [&](int i, const Eigen::Vector3d& by) {
    const Eigen::Vector3d x = work.x.col(i % n) + by;
    system.setPosition(i % n, x);
    system.setInertia(i % n, weight, x, load(i % n));
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
    system.setInertia(left % n, 0.0, Eigen::Vector3d::Zero(), load(left % n));
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
void RodWork::evaluateEquilibrium(StepReport& report)
{
  system.load(work);
  placeAt(1.0);
  for (int i = 0; i < model->nodes(); ++i)
    system.setInertia(i, 0.0, Eigen::Vector3d::Zero(), load(i));
  system.evaluate(false);
  report.residual = system.residual() / system.forceScale();
  for (int j = 0; j < model->edges(); ++j)
    report.max_strain = std::max(report.max_strain, std::abs(system.arrays().strain[j]));
  computeWrenches(0.0);
}

}   // namespace slender
