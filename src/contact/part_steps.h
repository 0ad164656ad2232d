#pragma once

#include <limits>

#include "slender_sim/contact/contact_potential.h"
#include "slender_sim/dynamics/failure_place.h"
#include "slender_sim/dynamics/integrator.h"
#include "slender_sim/dynamics/substep_controller.h"

namespace slender {

/// The range in which a part wants the stiffness of the barrier [N]. The island takes the largest `least` and the
/// largest `most` of its parts.
struct BarrierRange
{
  double least = 0.0, most = std::numeric_limits<double>::infinity();
};

/// What a part of an island does in a step, substep by substep. IslandStepper calls these functions; IslandSystem
/// solves the equations in between. Bodies come first in every loop over parts, because rods follow them.
class PartSteps
{
public:
  virtual ~PartSteps() = default;

  // ---- a substep
  /// No substep may be longer than this [s].
  virtual double longestSubstep(double duration) const { return duration; }
  /// Length of the last substep [s], from which a multistep method goes on; 0: the part has no history. Infinite: the
  /// part does not depend on it.
  virtual double lastSubstep() const { return std::numeric_limits<double>::infinity(); }
  /// Loads the state at the start of a substep.
  virtual StepFailure beginSubstep(const StepPlan& plan, const Substep& substep) = 0;
  /// Whether the part is a body at the start of a run, whose acceleration is not known yet.
  virtual bool startsFresh() const { return false; }
  /// Adds what acts on bodies at the start of a run to the accelerations of these. Then they are solved for, and what
  /// bodies carry takes them over. Only for methods that need them.
  virtual void addStartLoads() {}
  virtual void solveStartAcceleration() {}
  virtual void takeStartAcceleration() {}

  /// Its shortest edge at rest [m]; infinite: it has none.
  virtual double shortestEdge() const { return std::numeric_limits<double>::infinity(); }

  // ---- its surface
  /// Appends its objects, segments and triangles; their points begin at surface.points, which grows by the number of
  /// its points.
  virtual void addSurface(ContactSurface& surface) const = 0;
  /// Counts the changes of what addSurface() says, as when other points of a cloth are held. In one substep there is
  /// none.
  virtual long surfaceVersion() const { return 0; }
  /// Whether the surface consists of other pieces in each substep, which something else than motion may bring together.
  virtual bool surfaceChanges() const { return false; }
  /// `gap`: at which surfaces repel [m].
  virtual BarrierRange barrierRange(double gap) const = 0;

  /// Box that the surface fills now, or would fill `ahead` seconds later without forces, radii included [m].
  virtual BoundingBox surfaceBox(double) const { return BoundingBox::empty(); }

  // ---- a stage of a substep
  virtual void beginStage(std::size_t stage) = 0;
  /// After a solution. Returns whether the part holds more than before, so that the stage has to be solved again.
  virtual bool meetsMore() { return false; }
  /// Holds what meetsMore() found. Is called after IslandSystem has accepted the solution.
  virtual void holdMore() {}
  /// Takes over the solution of a stage, the last one of a substep included.
  virtual void endStage(std::size_t stage, bool last, StepReport& report) = 0;
  /// After the last stage of all parts. What a part changes here is not taken back.
  virtual StepFailure finishSubstep(StepReport&) { return StepFailure::none; }
  /// Takes the end of the substep as the present state.
  virtual void acceptSubstep(const Substep& substep) = 0;

  // ---- energies, for methods that must not add to them
  /// Whether nothing but the method can change the energy of the part in this step.
  virtual bool conserves() const { return false; }
  /// [J] `allowance` grows by what a sound step may add.
  virtual double energyAtStart(double&) { return 0.0; }
  virtual double energyAtEnd() const { return 0.0; }

  // ---- failures
  /// Whether a shorter substep may succeed where the last one failed.
  virtual bool shorterMayHelp(StepFailure) const { return true; }
  /// Changes the present state so that longer substeps may succeed, if the part can.
  virtual bool mend() { return false; }
  /// Largest unbalanced force in the last evaluation [N].
  virtual Largest unbalancedForce() const { return {}; }
  /// Completes the report of a step that is refused because of this part.
  virtual void refuse(StepFailure failure, double length, StepReport& report) const = 0;
};

}   // namespace slender
