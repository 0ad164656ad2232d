#pragma once

#include <memory>
#include <optional>
#include <vector>

#include "island/part.h"
#include "cloth_work.h"
#include "slender_sim/contact/contact_properties.h"

namespace slender {

/// A cloth as a part of an island. Its unknowns are three for each vertex that is not pinned, one vertex after the
/// other; its surface points are its vertices. Its own matrix has 3 x 3 blocks, and the solver of its options solves
/// with it.
///
/// Far from the minimum the Hessian is the one that is never indefinite, near it the exact one, as for a cloth on its
/// own. There a shift of angles, which cloth does not have, adds a share of its inertia. With a shift of positions the
/// Hessian is the semidefinite one again.
class ClothPart final : public Part
{
public:
  /// Throws std::invalid_argument for other integrators than implicit_euler, for averages whose forces have bounds, and
  /// for a model or options that are not valid. The island minimises wholly, whether the options ask for one Newton
  /// step or not.
  ClothPart(std::shared_ptr<const ClothModel> model, const ClothOptions& options);
  /// A cloth that is alone in its island. It takes all integrators of cloth, bounds of the forces of averages, and
  /// `one_newton_step` of the options. The working copy must outlive the part. Its owner starts the budget
  /// of work of each step.
  explicit ClothPart(ClothWork& work);

  /// State, inputs, forces on pins, and messages.
  ClothWork& work() const { return work_; }
  /// Whether a step from this state with these inputs can begin. If not, the report says why.
  bool accepts(const ClothState& state, const ClothInputs& inputs, double duration, StepReport& report) const
  {
    return work_.accepts(state, inputs, duration, report);
  }

  /// Sets what the cloth touches, and which solids its points pass through. `step` is the length of a step [s]. Without
  /// a call the cloth touches nothing.
  void setContact(const ContactProperties& contact, double step, const std::vector<IgnoredSolid>& ignored = {});
  /// These vertices are driven corners of the surface from now on. begin() takes them from the state.
  void setPins(const std::vector<int>& pins);
  /// From now on the part is for statics: its Hessian is always the exact one. begin() comes before. Returns false if
  /// nothing can balance the loads.
  bool beginStatics();
  int points() const override { return work_.model->vertices(); }
  void addSurface(ContactSurface& surface) const override;

  // ---- a step
  /// Takes a step of `duration` [s] from a state. The inputs must live until the end().
  void begin(const ClothState& state, const ClothInputs& inputs, double duration);
  void end(ClothState& state) { work_.end(state); }
  StepFailure beginSubstep(const StepPlan& plan, const Substep& substep) override;
  void beginStage(std::size_t stage) override;
  void endStage(std::size_t stage, bool last, StepReport& report) override;
  StepFailure finishSubstep(StepReport&) override;
  StepFailure predict(const Substep& substep, StepReport& report) override
  {
    return work_.stepExplicitly(substep, report);
  }
  void acceptSubstep(const Substep&) override { work_.accept(); }
  Largest unbalancedForce() const override;
  void refuse(StepFailure failure, double length, StepReport& report) const override;

  bool shorterMayHelp(StepFailure) const override { return !work_.workExceeded(); }
  StepFailure givesUp() const override;

private:
  // ---- its steps
  double shortestEdge() const override { return work_.shortestEdge(); }
  long surfaceVersion() const override { return surface_version_; }
  BarrierRange barrierRange(double gap) const override;
  BoundingBox surfaceBox(double ahead) const override;

  // ---- as Part
  AverageConstraints* averages() override { return averages_; }
  void meetAverages() override;
  void addTriples(std::vector<double>& masses) const override;
  bool numberUnknowns() override;
  int unknowns() const override { return unknowns_; }
  void moveAlong(double alpha) override;
  void accept() override;
  void saveBase() override { saved_ = base_; }
  void restoreBase() override { base_before_ = base_ = saved_; }
  void retreat(double share) override;
  void placeHeld(double fraction) override;
  bool heldMoves(double from, double to) const override;
  void retreatHeld(double share) override;
  void aimHeld(const Eigen::Matrix3Xd* x_end) override { held_end_ = x_end; }
  void gather(Eigen::Matrix3Xd& x) const override;
  void gatherStart(Eigen::Matrix3Xd& x) const override;
  void evaluate(bool with_hessian, const HessianShift& shift) override;
  /// Prescribed unknowns stay in the gradient, as the forces of the pins. Nothing else looks at them.
  void closeGradient() override {}
  void solve() override;
  void notePattern(SharedMatrix& matrix) override;
  void findEntries(const SharedMatrix& matrix) override;
  void addHessian(SharedMatrix& matrix, const HessianShift& shift) override;
  void takeGradient(double* right) const override;
  void takeDirection(const double* solution) override;
  int base(int point) const override { return number_[point] < 0 ? kPrescribed : offset + number_[point]; }
  void addColumns(int point, int component, double weight, Columns& row) const override;
  void addForce(int point, const Eigen::Vector3d& force) override;
  Eigen::Vector3d move(int point) const override { return vertex(direction_, point); }
  double stepLimit() const override;
  double incrementSize(double length) const override;
  double slope() const override;
  double residual() const override;
  double forceScale() const override;
  double noiseLevel() const override;

  // ---- its statics, cloth_part_statics.cpp
  void loadPresent() override;
  void takeTrial() override { std::swap(still_, work_.x); }   // afterwards the trial is where the round began
  std::function<void()> wayBack() override;
  double shift() const override;
  double moves() const override;
  void setProximal(double weight) override;
  double weightOf(double rate) const override { return rate / statics_rate_; }
  void setPencil(double rate) override;
  StaticScales scales() const override;
  Eigen::Map<Eigen::VectorXd> directions() override
  {
    return {direction_.data(), static_cast<Eigen::Index>(direction_.size())};
  }
  void weighDirection() override;
  double largestTurn() const override;
  Eigen::Vector3d load(int i) const;
  double turnOfEdges() const;
  double staticForceScale() const;

  static Eigen::Map<Eigen::Vector3d> vertex(PointVector& v, int i) { return point(v, i); }
  static Eigen::Map<const Eigen::Vector3d> vertex(const PointVector& v, int i) { return point(v, i); }
  ClothSystem& system() const { return *work_.system; }
  bool isFree(int i) const { return number_[i] >= 0; }
  double inertiaShift(const HessianShift& shift) const;
  template <class Block>
  void addToBlocks(const int (&point)[4], Block&& block);
  void addOwnContacts(bool with_hessian);
  void addHeldMotion();
  void factor(const HessianShift& shift);
  void allocate();
  bool solvesByFactors() const { return work_.linear->kind() == ClothSolver::cholesky && !linearized_; }

  std::unique_ptr<ClothWork> own_;   ///< null: the working copy belongs to another object
  ClothWork& work_;                  ///< whose x is the trial
  std::vector<std::unique_ptr<AverageConstraints>> average_sets_;   ///< of a cloth with a working copy of its own
  AverageConstraints* averages_ =
      nullptr;                ///< the set of the present step; null: the working copy has it, or there is none
  bool dependent_ = false;    ///< the averages depend on each other on the free vertices
  bool linearized_ = false;   ///< steps are one step of Newton's method
  /// Of statics: the eigenvalue of a proximal term of weight 1 and the rate of setPencil() [1/s^2]; 0: steps.
  double statics_rate_ = 0, pencil_rate_ = 0;
  double size_ = 0;     ///< of the cloth at rest, for statics [m]
  PointVector still_;   ///< the present configuration of statics
  std::optional<ContactProperties> contact_;
  std::shared_ptr<const std::vector<IgnoredSolid>> ignored_;   ///< null: none
  double contact_step_ = 0.0;                                  ///< [s]
  double duration_ = 1.0;                                      ///< of the present step [s]
  std::shared_ptr<const Eigen::Matrix3Xd> rest_;
  std::vector<int> surface_pins_;   ///< that the surface has as driven corners
  long surface_version_ = 0;
  std::vector<double> inverse_length_;   ///< of edges at rest [1/m]
  PointVector base_, saved_, direction_, solution_;
  PointVector base_before_;                         ///< base_ before the last accept()
  const Eigen::Matrix3Xd* held_end_ = nullptr;      ///< see aimHeld()
  bool moved_ = false;                              ///< the trial is a move from base_, and not base_ itself
  LinearOutcome outcome_ = LinearOutcome::solved;   ///< of the last solution with the own matrix
  StepReport counts_;                               ///< of linear equations that no report has yet
  double largest_contact_ = 0.0;                    ///< force on a vertex in the last evaluation [N]
  double largest_internal_ = 0.0;                   ///< in the last evaluation without Hessian, likewise
  int unknowns_ = 0;
  std::vector<int> number_;   ///< per vertex: of the first of its unknowns in the part, or kPrescribed
  std::vector<char> held_;    ///< for which the vertices were numbered
  const AverageConstraints* numbered_with_ = nullptr;   ///< the averages that acted then
  /// Where the entries go in the matrix of the island: for each block, and for each entry of the constant matrix on or
  /// below the diagonal, the indices of the values where its three columns begin. -1: it has none.
  std::vector<int> block_entries_, constant_entries_;
  bool near_ = false;         ///< the last increment was small
  bool exact_ = false;        ///< the last Hessian is the exact one
  bool indefinite_ = false;   ///< The last exact Hessian without a shift was not definite.
};

}   // namespace slender
