#pragma once

#include <array>
#include <limits>
#include <memory>
#include <vector>

#include "../contact/confined_newton.h"
#include "body_system.h"
#include "rod_stepper_impl.h"
#include "slender_sim/linalg/sparse_cholesky.h"
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
  /// One rod: how its unknowns (four per node) enter the matrix.
  struct RodPart
  {
    RodStepper::Impl* rod = nullptr;
    int index = 0;    ///< in the group
    int point = -1;   ///< its first contact point, -1: it touches nothing
    bool welded = false, touched = false;
    bool coupled = false;         ///< has its unknowns in the matrix
    std::vector<int> own_terms;   ///< of the present contacts: those that couple nothing, see isOwn()
    std::vector<int> own_rows;    ///< likewise of the contacts' rows
    int offset = 0, unknowns = 0;
    std::vector<int> dof;   ///< own number, kPrescribed, or carried by grasp k: -2 - k
    /// where the entries of its panels go: index of a matrix value, -1: nowhere or not simply
    std::vector<int> slots;
    std::vector<std::array<int, 3>> carried_entries;   ///< node, column, row of those with a carried unknown
    std::vector<std::array<int, 4>> holds;             ///< grasps that dof was made for: active, first, last, body
    RodEvaluation evaluation;
  };
  /// A row of unknowns with weights: what one component of a displacement depends on.
  struct Columns
  {
    int count = 0;
    static constexpr int kMost = 36;   // three for each component of four carried points
    std::array<int, kMost> index;
    std::array<double, kMost> value;
    void push(int i, double v)
    {
      index[count] = i;
      value[count++] = v;
    }
  };

  // coupled_matrix.cpp
  void buildPattern();
  void assemble(const HessianShift& shift, bool whole);
  bool factor(const HessianShift& shift);
  void add(int a, int b, double value);
  void addPair(const Columns& a, const Columns& b, double value);
  void addSquare(const Columns& a, double value);
  void mapDof(const RodPart& part, int dof, double weight, Columns& out) const;
  void addCarried(const RodPart& part);
  void addClamps(const RodPart& part);
  void contactColumns(const ContactTerm& term, std::array<Columns, 3>& rows) const;
  void contactColumns(const ContactRow& contact, bool whole, Columns& row) const;
  bool takeKeys();

  bool isOwn(const ContactTerm& term) const;
  void findOwnTerms();
  RodEvaluation evaluateWithOwn(RodPart& part, bool with_hessian, const HessianShift& shift);
  void spread();   ///< solution of the matrix to the rods' directions
  void mapUnknowns(RodPart& part);
  void reduceGradient();
  void placeWelds();
  void placeDriven(double fraction);
  void gather(Eigen::Matrix3Xd& x, std::vector<Pose>& solids) const;
  void startAccelerations();
  void setCarriedInertia(const Stage& stage);
  const RodPart& partOf(int point) const { return parts_[point_part_[point]]; }
  int bodyUnknown(int body) const { return body_offset_ + 6 * simulated_[body]; }
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
  std::vector<int> point_part_;   ///< per contact point: its rod
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

  // matrix
  SparseCholesky matrix_;
  bool pattern_valid_ = false;
  /// stability: the matrix must not be replaced by a positive definite one
  bool exact_ = false;
  WholeStiffness whole_;
  int unknowns_ = 0, body_offset_ = 0;
  std::vector<std::array<int, 5>> keys_;   ///< contacts (four points, a solid) the pattern has room for, sorted
  std::vector<double> rhs_;
  std::vector<BodySystem::Vector6> body_direction_;
};

}   // namespace slender
