#pragma once

#include <limits>
#include <vector>

#include <Eigen/Core>

#include "island/average_constraints.h"
#include "island/part_statics.h"
#include "island/shared_matrix.h"
#include "slender_sim/contact/contact_surface.h"
#include "slender_sim/dynamics/failure_place.h"
#include "slender_sim/dynamics/hessian_shift.h"
#include "slender_sim/dynamics/integrator.h"
#include "slender_sim/dynamics/substep_controller.h"
#include "slender_sim/energy/rod_kernel.h"
#include "slender_sim/geometry/pose.h"

namespace slender {

/// What Equations writes into a part.
struct PartInIsland
{
  const void* island = nullptr;   ///< in which the part was stepped last
  bool coupled = false;           ///< the matrix of the island has its unknowns
  int offset = 0;                 ///< number of its first unknown in that matrix
  /// Newton's method has converged for the part and for all parts that contacts or joints connect to it. It is neither
  /// evaluated nor moved until its friction changes, another part meets it, or what is prescribed moves.
  bool settled = false;
  bool has_direction = true;   ///< of the present iteration; none: it was settled when directions were computed
  double increment = 0.0;      ///< incrementSize() of the present direction
  /// Largest relative motion of surfaces that touch the part, by the present direction: of all contacts [m], and of
  /// contacts that stick, as a fraction of the stretch at which they slip [-]. Each contact counts for one part.
  double moved_at_contact = 0.0, moved_sticking = 0.0;
  int number = 0;                              ///< among the parts of the island
  int first_point = 0;                         ///< number of its first surface point among those of the island
  std::vector<const ContactTerm*> own_terms;   ///< present contacts that the part's own matrix has room for
  std::vector<const ContactRow*> own_rows;     ///< likewise
  RodEvaluation evaluation;                    ///< result of the last evaluate()
};

class FastProjection;
struct ProjectionReport;

/// The surface points of a part: what it shows to contact. `point` counts from 0 in each part.
class PartSurface
{
public:
  using Columns = SharedMatrix::Columns;
  /// Number of an unknown, or of a point, that has none in the matrix because its motion is prescribed.
  static constexpr int kPrescribed = -1;

  virtual ~PartSurface() = default;

  virtual int points() const { return 0; }   ///< number of its surface points
  /// Writes the positions of its surface points at the trial into the columns of x from first_point on.
  virtual void gather(Eigen::Matrix3Xd&) const {}
  /// The same for where they are when a substep begins.
  virtual void gatherStart(Eigen::Matrix3Xd& x) const { gather(x); }
  /// Number of the first of a point's three unknowns in the matrix, or kPrescribed. Less than kPrescribed: its
  /// displacement depends on other unknowns, see addColumns().
  virtual int base(int) const { return kPrescribed; }
  /// Writes for each surface point by how much the segment that begins there has turned about its tangent, from the
  /// start of the substep to the trial [rad]. The entries of the part begin at first_point. Without segments that turn
  /// nothing is written.
  virtual void gatherTurns(Eigen::VectorXd&) const {}
  /// Adds a weighted component of the displacement of a point to a row of unknowns. Component 3 of a curve is the turn
  /// of the segment that begins there.
  virtual void addColumns(int point, int component, double weight, Columns& row) const
  {
    if (const int first = base(point); first >= 0)
      row.push(first + component, weight);
  }
  virtual void addForce(int, const Eigen::Vector3d&) {}   ///< gradient -= force
  virtual void addTorque(int, double) {}                  ///< gradient -= torque, of a segment [N m]
  /// Displacement of a point by the direction [m].
  virtual Eigen::Vector3d move(int) const { return Eigen::Vector3d::Zero(); }
  virtual double moveTurn(int) const { return 0.0; }   ///< Turn of a segment by the direction [rad].
};

/// A part of an island: something with unknowns of its own. A rod, a thread, a cloth, and a rigid body are parts.
/// Equations minimises the energy of several parts together, and Island advances them by substeps. Both know the parts
/// by this class alone. A part without a surface needs none of the functions of PartSurface, and a part without statics
/// none of PartStatics. Bodies come first in every loop over parts, because rods follow them.
///
/// A part has a base configuration and a trial configuration. moveAlong() makes the trial from the base and the
/// direction; evaluate() computes everything at the trial; accept() makes the trial the new base.
///
/// A part that contacts or joints connect to another part is coupled: its unknowns are in the matrix of the island. A
/// part that is not coupled solves with its own matrix. It stays so while it touches only what moves as prescribed,
/// because such contacts couple no more than neighbouring points of the part; they are its own contacts.
///
/// The averages of a part may be prescribed. Such a part is always coupled, and Equations solves for directions that do
/// not change the averages. The gradient of the part contains the forces of its averages.
class Part : public PartInIsland, public PartSurface, public PartStatics
{
public:
  // ---- unknowns
  /// Numbers the unknowns that are not prescribed. Returns false if the numbers differ from those of the last call.
  virtual bool numberUnknowns() = 0;
  virtual int unknowns() const = 0;   ///< how many are not prescribed
  /// Appends one entry for each three consecutive unknowns: the mass [kg] if they are the coordinates of a point, 0 if
  /// they are a rotation vector. A part whose unknowns do not come in threes appends nothing.
  virtual void addTriples(std::vector<double>&) const {}
  /// Whether joints connect the part to other parts. Then it is coupled whatever it touches.
  virtual bool joined() const { return false; }

  // ---- configuration
  virtual void moveAlong(double alpha) = 0;   ///< Trial := base + alpha direction.
  virtual void accept() = 0;                  ///< Base := trial.
  virtual void saveBase() = 0;
  virtual void restoreBase() = 0;
  /// Trial := base + share (trial - base) for all that is not prescribed.
  virtual void retreat(double share) = 0;
  /// Puts into the trial what is prescribed, where it is at this fraction of the time step.
  virtual void placeHeld(double) {}
  /// Whether anything that is prescribed moves between these fractions of the time step. If they are equal: whether the
  /// trial has it elsewhere than the base.
  virtual bool heldMoves(double, double) const { return false; }
  /// The direction after the next evaluate(true) lets the part follow what is held, which goes from the base to x_end.
  /// The columns of the part begin at first_point. nullptr: it stays.
  virtual void aimHeld(const Eigen::Matrix3Xd*) {}
  /// Trial := base + share (trial - base) for what is held in the trial elsewhere than in the base, at one instant.
  virtual void retreatHeld(double) {}
  /// Puts into the trial what joints make the part follow, after all parts have moved.
  virtual void followJoints() {}
  /// The prescribed averages of its points; null: none.
  virtual AverageConstraints* averages() { return nullptr; }
  /// Moves free points of the trial so that they have the prescribed averages. Call it after followJoints().
  virtual void meetAverages() {}

  // ---- equations
  /// Computes energy, gradient and, on request, the Hessian at the trial, and keeps the sums in `evaluation`. A part
  /// that is not coupled includes its own contacts, and factors its matrix plus the shift.
  virtual void evaluate(bool with_hessian, const HessianShift& shift) = 0;
  /// Adds the part's forces on what other parts carry to the gradients of these parts.
  virtual void passGradient() {}
  /// Of a coupled part, when its gradient is complete: takes the prescribed unknowns out of it.
  virtual void closeGradient() {}
  /// direction := -(matrix)^-1 gradient of the last evaluate(true), of a part that is not coupled.
  virtual void solve() = 0;
  /// The same with the matrix last factored, whatever the gradient is now.
  virtual void solveAgain() { solve(); }

  // ---- the matrix of the island, of a coupled part
  virtual void notePattern(SharedMatrix& matrix) = 0;   ///< Notes what the part itself couples.
  /// Is called when the pattern is finished, for several parts at the same time.
  virtual void findEntries(const SharedMatrix&) {}
  /// Is called for several parts at the same time. Unless it is joined(), a part adds to entries of its own unknowns.
  virtual void addHessian(SharedMatrix& matrix, const HessianShift& shift) = 0;
  virtual void takeGradient(double* right) const = 0;       ///< right-hand side := minus its gradient
  virtual void takeDirection(const double* solution) = 0;   ///< direction := its part of the solution

  // ---- measures for Newton's method, see newton.h
  virtual double stepLimit() const { return 1.0; }   ///< share of the direction that keeps the part sound
  /// Largest displacement of the direction, over `length` for parts that have no length of their own [-].
  virtual double incrementSize(double length) const = 0;
  virtual double slope() const = 0;                   ///< gradient . direction [J]
  virtual double residual() const = 0;                ///< largest unbalanced force [N]
  virtual double forceScale() const = 0;              ///< largest force [N]
  virtual double noiseLevel() const { return 0.0; }   ///< unbalanced force that round-off alone can cause [N]

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
  virtual void addSurface(ContactSurface&) const {}
  /// Counts the changes of what addSurface() says, as when other points of a cloth are held. In one substep there is
  /// none.
  virtual long surfaceVersion() const { return 0; }
  /// Whether the surface consists of other pieces in each substep, which something else than motion may bring together.
  virtual bool surfaceChanges() const { return false; }
  /// The range in which the part wants the stiffness of the barrier about it. `gap`: at which surfaces repel [m].
  virtual BarrierRange barrierRange(double) const { return {}; }

  /// Box that the surface fills now, or would fill `ahead` seconds later without forces, radii included [m].
  virtual BoundingBox surfaceBox(double) const { return BoundingBox::empty(); }

  // ---- a stage of a substep
  virtual void beginStage(std::size_t) {}
  /// After a solution. Returns whether the part holds more than before, so that the stage has to be solved again.
  virtual bool meetsMore() { return false; }
  /// Holds what meetsMore() found. Call it after Equations has accepted the solution.
  virtual void holdMore() {}
  /// Takes over the solution of a stage, the last one of a substep included.
  virtual void endStage(std::size_t, bool, StepReport&) {}
  /// After the last stage of all parts. What a part changes here is not taken back.
  virtual StepFailure finishSubstep(StepReport&) { return StepFailure::none; }
  /// After finishSubstep() of all parts: changes its mesh, for which it looks at where the other parts are.
  virtual StepFailure changeMesh() { return StepFailure::none; }
  /// Takes the end of the substep as the present state.
  virtual void acceptSubstep(const Substep& substep) = 0;

  // ---- an explicit substep; finishSubstep() and acceptSubstep() end it as well
  /// Computes velocities and positions at the end of the substep from the forces at its start, without constraints. A
  /// part that bodies carry comes before these bodies and leaves its forces for them. A part without it takes no
  /// explicit steps.
  virtual StepFailure predict(const Substep&, StepReport&) { return StepFailure::state_not_finite; }
  /// Adds its chain or its body to the projection. Returns true if it has lengths that the projection has to keep.
  virtual bool addTo(FastProjection&) { return false; }
  /// Tells the projection what moves and where: after predict(), or with `at_start` as the substep begins.
  virtual void giveTo(FastProjection&, bool) {}
  /// Takes its motion from a projection that succeeded; with `at_start` its positions alone. Of a projection that
  /// failed, the part that the report speaks of returns the failure.
  virtual StepFailure takeFrom(FastProjection&, const ProjectionReport&, bool) { return StepFailure::none; }

  // ---- energies, for methods that must not add to them
  /// Whether nothing but the method can change the energy of the part in this step.
  virtual bool conserves() const { return false; }
  /// [J] `allowance` grows by what a sound step may add.
  virtual double energyAtStart(double&) { return 0.0; }
  virtual double energyAtEnd() const { return 0.0; }

  // ---- failures
  /// Why Newton's method cannot go on after the last evaluation, whatever is added to the Hessian. `none`: it can.
  virtual StepFailure givesUp() const { return StepFailure::none; }
  /// Whether a shorter substep may succeed where the last one failed.
  virtual bool shorterMayHelp(StepFailure) const { return true; }
  /// 1 + cosine of the sharpest turn in the last trial that mend() may take out: 0 at a fold, 1 or more without one.
  virtual double sharpestFold() const { return 1.0; }
  /// Changes the present state so that longer substeps may succeed, if the part can.
  virtual bool mend() { return false; }
  /// Largest unbalanced force in the last evaluation [N].
  virtual Largest unbalancedForce() const { return {}; }
  /// Completes the report of a step that is refused because of this part.
  virtual void refuse(StepFailure failure, double length, StepReport& report) const = 0;
};

/// A part that moves rigidly and carries solids: a simulated rigid body.
class RigidPart : public Part
{
public:
  virtual const Pose& pose() const = 0;   ///< of the trial
  /// The same as addColumns() and addForce(), for the body's material point at `position` (world axes).
  virtual void addColumnsAt(const Eigen::Vector3d& position, int component, double weight, Columns& row) const = 0;
  virtual void addForceAt(const Eigen::Vector3d& position, const Eigen::Vector3d& force) = 0;
  /// Displacement of this point by the direction [m].
  virtual Eigen::Vector3d moveAt(const Eigen::Vector3d& position) const = 0;
};

}   // namespace slender
