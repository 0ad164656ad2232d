#pragma once

#include <array>
#include <limits>
#include <memory>
#include <vector>

#include "../contact/confined_newton.h"
#include "../contact/coupled_chains.h"
#include "body_system.h"
#include "rod_stepper_impl.h"
#include "slender_sim/rod/rod_group.h"

namespace slender {

/// Equations of rods, the simulated bodies they are welded to, and contact, for minimize(). Rods that nothing touches
/// and no body carries keep their own band matrices; the others share one sparse matrix, in which the unknowns of
/// welded sections are replaced by those of their bodies. Contact with what moves as prescribed couples only
/// neighbouring nodes, so that a rod that touches nothing else keeps its band matrix, too.
class CoupledSystem
{
public:
  CoupledSystem(const RodGroupModel& model, const std::vector<RodStepper::Impl*>& rods);

  // ---- a substep, see StepLoop (coupled_step.cpp)
  void begin(const RodGroupState& state, const RodGroupInputs& inputs, double duration);
  void beginStep(const StepPlan& plan, double t);
  /// Solves a stage; the rods' beginStage() has been called.
  NewtonResult solveStage(const StepPlan& plan, std::size_t stage, double t, double h, const NewtonConfig& newton);
  /// Velocities of the bodies at the end of a stage, or (last) of the step. The rods' endStage() or finishStep() come
  /// after.
  void endStage(const StepPlan& plan, std::size_t stage, bool last);
  void commitStep();
  void end(RodGroupState& state);
  double bodyEnergy(bool next) const;   ///< kinetic and of loads [J]
  double clearance(const RodGroupState& state);
  const std::vector<ContactTerm>& contacts() const;

  // ---- stability of an equilibrium (coupled_stability.cpp)
  /// Loads an equilibrium, at which everything stands still. The calls below are about it.
  void beginStability(const RodGroupState& state, const RodGroupInputs& inputs);
  /// Factors K + s M, with the exact second derivative of contact and without friction; returns whether it is positive
  /// definite.
  bool definite(double s);
  RodEvaluation energyAt(double s);
  /// Half width of the band of eigenvalues that count as zero.
  double neutralBand() const;
  /// The direction becomes the mode of the lowest eigenvalue, by inverse iteration with the matrix last factored;
  /// nothing turns by more than 1 rad.
  void findLowestMode();
  /// Writes into the state what is `alpha` times the mode away from the equilibrium. Returns false when something is in
  /// the way.
  bool displaceAlongMode(double alpha, RodGroupState& state);
  bool hasContact() const { return contact_ != nullptr; }
  int threads = 0;

  // ---- the system of a stage, as minimize() needs it (coupled_system.cpp)
  RodEvaluation evaluate(bool with_hessian, const HessianShift& shift = {});
  void solve();
  void moveAlong(double alpha);
  void accept();
  void saveBase();
  void restoreBase();
  double stepLimit();
  double incrementSize() const;
  /// A stage may end at a saddle of kinked joints' angles, when positions have arrived.
  static constexpr bool anglesMayKeepShift() { return true; }
  static constexpr double mostUnbalanced() { return RodSystem::mostUnbalanced(); }
  double slope() const;
  double residual() const;
  double forceScale() const;
  double noiseLevel() const;

  // ---- and minimizeConfined()
  Approach approach(double from, double to, double& reached);
  void placeHeld(double to);
  void resolve(double tolerance, double gap_tolerance) { tolerance_ = tolerance, gap_tolerance_ = gap_tolerance; }
  ContactPotential& contact() { return *contact_; }

private:
  using Columns = CouplingMatrix::Columns;
  static constexpr int kPrescribed = CoupledChains::kPrescribed;
  /// One rod; an unknown that grasp k carries has the number -2 - k.
  struct RodPart : CoupledChains::Chain
  {
    RodStepper::Impl* rod = nullptr;
    int index = 0;    ///< in the group
    int point = -1;   ///< its first contact point, -1: it touches nothing
    bool welded = false;
    std::vector<std::array<int, 3>> carried_entries;   ///< node, column, row of those with a carried unknown
    std::vector<std::array<int, 4>> holds;             ///< grasps that dof was made for: active, first, last, body
  };

  // coupled_matrix.cpp
  void buildPattern();
  void noteCarried(RodPart& part);
  void assemble(const HessianShift& shift, bool whole);
  void mapDof(const RodPart& part, int dof, double weight, Columns& out) const;
  bool isCarried(const CouplingMatrix::Bases& bases, int solid) const;
  void addCarried(const RodPart& part);
  void addClamps(const RodPart& part);
  void contactColumns(const ContactTerm& term, std::array<Columns, 3>& rows) const;
  void contactColumns(const ContactRow& contact, bool whole, Columns& row) const;

  void spread();
  Eigen::Map<BodySystem::Vector6> bodySolution(std::size_t body)
  {
    return Eigen::Map<BodySystem::Vector6>(coupled_.matrix.solution() + coupled_.others() + 6 * body);
  }
  void mapUnknowns(RodPart& part);
  void reduceGradient();
  void placeWelds();
  void placeDriven(double fraction);
  void gather(Eigen::Matrix3Xd& x, std::vector<Pose>& solids) const;
  void startAccelerations();
  void setCarriedInertia(const Stage& stage);
  const RodPart& partOf(int point) const { return static_cast<const RodPart&>(*coupled_.points[point].chain); }
  int bodyUnknown(int body) const { return coupled_.others() + 6 * simulated_[body]; }
  template <class F>
  void forRods(F&& f);

  const RodGroupModel& model_;
  std::vector<RodPart> parts_;
  bool parallel_ = false;            ///< enough rods for the threads to be worth their synchronisation
  std::vector<BodySystem> bodies_;   ///< simulated ones
  std::vector<int> simulated_;       ///< per body of the model: index into bodies_, -1: driven
  std::vector<RigidBodyState> bodies_now_, bodies_next_;   ///< all
  /// driven bodies (a slot per body) and obstacles at the instant being solved for
  std::vector<Pose> driven_, obstacles_;
  const RodGroupState* origin_ = nullptr;
  const RodGroupInputs* inputs_ = nullptr;
  double duration_ = 0, least_edge_ = std::numeric_limits<double>::infinity();

  std::unique_ptr<ContactPotential> contact_;
  double first_stiffness_ = 0;   ///< of the barrier in a state that has none yet
  double stiffness_now_ = 0;     ///< of the barrier as the substep begins
  /// of increments: over the shortest edge, and at contacts over the smallest gap
  double tolerance_ = 0, gap_tolerance_ = 0;
  Eigen::Matrix3Xd points_, points_base_, points_end_;
  std::vector<Pose> solids_, solids_base_, solids_end_;

  CoupledChains coupled_{false};
  std::vector<BodySystem::Vector6> body_direction_;
};

}   // namespace slender
