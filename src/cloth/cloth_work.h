#pragma once

#include <memory>
#include <string>

#include "averaged_cloth_solver.h"
#include "slender_sim/cloth/plastic_flow.h"
#include "slender_sim/dynamics/integrator.h"
#include "slender_sim/dynamics/substep_controller.h"

namespace slender {

inline constexpr char kDependentAverages[] =
    "prescribed averages depend on each other on the vertices that are not held: hold fewer vertices, or leave out the "
    "averages there";

/// The working copy of a cloth: its part in a step, which an island advances, see ClothPart: in explicit substeps, or
/// in implicit stages whose equations the island solves.
///
/// A step is begin(), substeps, end(). A substep is beginSubstep(); for each stage beginStage(), the solution of its
/// equations in `x`, and endStage(), after the last one finish() instead; then accept(), or the next attempt. An
/// explicit substep is stepExplicitly() and accept().
class ClothWork
{
public:
  /// Throws std::invalid_argument for a model or options that are not valid. with_averages: the working copy keeps
  /// prescribed averages; otherwise its owner does.
  ClothWork(std::shared_ptr<const ClothModel> m, const ClothOptions& o, bool with_averages = true);
  virtual ~ClothWork() = default;

  /// Steps spend this from now on, which others start; null: one of their own.
  void useBudget(std::shared_ptr<WorkBudget> budget);
  /// Returns whether a step from this state with these inputs can begin. If not, the report says why.
  bool accepts(const ClothState& state, const ClothInputs& inputs, double duration, StepReport& report) const;
  /// Refuses a step of `length` seconds that could not be solved. The message says why and where the cloth was farthest
  /// from a solution. `why`: the reason, if it is not one of those that the failure has.
  StepReport refuseUnsolved(StepReport& report, StepFailure failure, double length, const char* why = "");
  /// Lets the clamped faces act that `state` holds, and no others. Comes before each use of the system with another
  /// state.
  void followClamps(const ClothState& state);

  /// Takes a step of `duration` [s] from a state. The inputs must live until the end().
  void begin(const ClothState& state, const ClothInputs& inputs, double duration);
  void end(ClothState& state) { std::swap(state, work_); }
  /// Begins an implicit substep. The plan must live until its end.
  void beginSubstep(const StepPlan& plan, const Substep& substep);
  /// Sets inertia, loads, viscous response and what is held.
  void beginStage(std::size_t stage);
  /// x := the motion carried on; what is held stands where it is at the end of the stage. Averages are met.
  void placeGuess();
  /// Prepares one step of Newton's method. x := where the step is linearised; held vertices are not moved yet.
  /// motion := from there to the end of the stage as placeGuess() has it.
  void placeLinearized(PointVector& motion);
  /// Solves the Newton equations of the last evaluation with a Hessian. Before the call, `d` holds a first guess for
  /// free vertices and the given motion of held vertices. `linearized` is true if placeLinearized() began the stage.
  /// The solution then ends at the prescribed averages; otherwise it leaves the averages as they are.
  LinearOutcome solveNewton(PointVector& d, bool linearized, StepReport& counts);
  /// Moves the free vertices of x so that x has the prescribed averages of the substep, up to rounding. Without
  /// averages it does nothing.
  void meetAverages();
  /// Keeps the elastic and viscous energy [J] of an evaluation at the start of a linearised stage, for createsEnergy().
  void takeStartEnergy(double energy);
  /// Completes an evaluation at x without contact: counts the work of pins and averages, and takes the part out of the
  /// gradient that the averages balance. Returns the largest elastic and viscous force on a vertex [N].
  double closeGradient();
  /// Takes x as the end of a stage that is not the last.
  void endStage(std::size_t stage);
  /// After finish() of a linearised substep. Returns whether its end has more energy than the start and the work of
  /// loads, pins and averages can give. `energy`: elastic and viscous energy at the end [J].
  bool createsEnergy(double energy) const;
  /// Takes x as the end of the substep. The gradient of the system must be that at x, with all that acts there.
  /// `internal`: the largest force that closeGradient() returned, or of contact [N].
  void finish(double internal, double max_strain, StepReport& report);
  void accept() { std::swap(work_, next_); }
  StepFailure stepExplicitly(const Substep& substep, StepReport& report);
  /// Longest stable explicit step of the cloth at rest [s]; infinite for implicit integrators.
  double stableStep() const;
  bool isExplicit() const { return slender::isExplicit(options.integrator); }

  ClothEnergies energies(const ClothState& state, const Eigen::Vector3d& gravity);

  /// At the start of the substep.
  const ClothState& present() const { return work_; }
  /// Inputs of the step.
  const ClothInputs& inputs() const { return *inputs_; }
  bool workExceeded() const { return budget_->spent(); }
  /// For an island of several parts: a step may do this many times the work of a step of the cloth alone.
  void startBudget(int times) { budget_->start(times * WorkBudget::ofStep(model->vertices())); }
  void spend(long counts) { budget_->spend(counts); }
  /// Where pin k of the state is at a fraction of the step.
  Eigen::Vector3d pinAt(std::size_t k, double fraction) const;
  double shortestEdge() const { return shortest_edge_; }   ///< at rest [m]
  /// Largest elastic and viscous force on a vertex in the last evaluation [N].
  double largestInternal() const;
  /// The force that Newton's tolerance leaves at most [N]: Newton's method stops by its increment, which says little
  /// where stiffness has no bound, in bends of faces without area.
  double resolvedForce() const;

  std::shared_ptr<const ClothModel> model;
  ClothOptions options;
  std::unique_ptr<ClothSystem> system;
  std::unique_ptr<ClothLinearSolver> linear;
  AveragedClothSolver* averages = nullptr;   ///< the same, where the working copy keeps averages; else null
  PointVector x;                             ///< present configuration: a guess, or the solution of a stage
  Eigen::Matrix3Xd pin_forces;               ///< of the cloth on its pins at the end of the substep [N]
  Eigen::Matrix3Xd average_forces;           ///< of prescribed averages at the end of the substep [N]

protected:
  /// Is called when the system is of another model, see followClamps().
  virtual void systemChanged() {}
  StepReport refuse(StepReport& report, StepFailure failure, const std::string& message) const;
  /// Forces at (x, v_) without mass damping into force_.
  ClothEvaluation addForces(bool with_constant);
  ClothEvaluation acceleration(double delta);
  long ownWork() const { return own_budget_ ? budget_->done() : 0; }   ///< others report their budgets themselves

  /// what the system is of, where not all clamped faces of the model act; otherwise null
  std::shared_ptr<const ClothModel> clamped_model_;
  std::shared_ptr<WorkBudget> budget_;
  bool own_budget_ = true;
  PlasticFlow plastic_;
  const ClothInputs* inputs_ = nullptr;   ///< of the present step
  double duration_ = 0;                   ///< of the present step [s]
  ClothState work_, next_;                ///< start of a substep, and its end
  const StepPlan* plan_ = nullptr;        ///< of the present substep
  Substep substep_;
  std::vector<int> at_bound_;
  Eigen::Matrix3Xd averages_;   ///< that are prescribed at the end of the substep
  PointVector trial_, d_, pin_motion_, v_, force_, guess_, x_start_;
  double shortest_edge_ = 0;
  /// At the start of an implicit step, as evaluate() counts it there, and the elastic energy itself [J]. Steps of one
  /// stage count that of the end in the same way; steps of two, whose stages have viscous forces of their own, without
  /// these.
  double energy_start_ = 0, elastic_start_ = 0;
  /// Work of the averages and of the pins from the start of a step to its end [J].
  double average_work_ = 0, pin_work_ = 0;

private:
  std::string explain(StepFailure failure, double length) const;
  void useConstantMatrix();
  void moveByMasses(double h, double fraction);
  bool moveByMatrix(double h, double fraction, StepReport& report);

  const bool with_averages_;
  void buildSystem(const ClothModel& of);
  bool inputsFine(const ClothState& state, const ClothInputs& inputs, double duration, std::string& what) const;
  void combine(const Combination& c, PointVector& result) const;
  double workOnFree(const PointVector& forces) const;

  std::vector<int> clamp_pins_;   ///< of the state whose clamped faces act; with clamped faces only
  bool clamps_known_ = false;
  Eigen::Matrix3Xd pins_start_, averages_start_, wind_v_;
  PointVector v_start_, a_start_, x_stage_, v_stage_, q_hat_, q_tilde_;
  std::unique_ptr<ShiftedMatrix> constant_;   ///< imex only
  double constant_h_ = 0;
  std::vector<char> constant_held_;
  std::vector<double> constant_weight_;
};

}   // namespace slender
