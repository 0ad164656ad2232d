#pragma once

#include <memory>
#include <vector>

#include "../contact/island_system.h"
#include "rod_part.h"
#include "slender_sim/rod/rod_group.h"

namespace slender {

/// Implicit steps of rods, the bodies they are welded to, and contact: the parts of an island, and their stages.
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
  double forceScale() const { return island_.forceScale(); }
  double clearance(const RodGroupState& state);
  const std::vector<ContactTerm>& contacts() const;
  bool hasContact() const { return island_.contact() != nullptr; }
  void setThreads(int threads) { island_.setThreads(threads, parallel_); }

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

private:
  void addContact();
  void startAccelerations();
  void scaleMode();

  const RodGroupModel& model_;
  bool parallel_ = false;   ///< enough rods for the threads to be worth their synchronisation
  std::vector<std::unique_ptr<RodPart>> rods_;
  std::vector<std::unique_ptr<BodyPart>> bodies_;          ///< simulated ones
  std::vector<BodyPart*> simulated_;                       ///< per body of the model; null: driven
  std::vector<RigidBodyState> bodies_now_, bodies_next_;   ///< all
  const RodGroupInputs* inputs_ = nullptr;
  double duration_ = 0;
  double first_stiffness_ = 0;   ///< of the barrier in a state that has none yet
  double stiffness_now_ = 0;     ///< of the barrier as the substep begins
  IslandSystem island_{false};
};

}   // namespace slender
