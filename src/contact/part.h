#pragma once

#include <vector>

#include <Eigen/Core>

#include "coupling_matrix.h"
#include "slender_sim/dynamics/hessian_shift.h"
#include "slender_sim/energy/rod_kernel.h"
#include "slender_sim/geometry/pose.h"

namespace slender {

/// What IslandSystem writes into a part.
struct PartInIsland
{
  const void* island = nullptr;                ///< in which the part was stepped last
  bool coupled = false;                        ///< the matrix of the island has its unknowns
  int offset = 0;                              ///< number of its first unknown in that matrix
  int block = 0;                               ///< number of its block of that matrix
  int first_point = 0;                         ///< number of its first surface point among those of the island
  std::vector<const ContactTerm*> own_terms;   ///< present contacts that the part's own matrix has room for
  std::vector<const ContactRow*> own_rows;     ///< likewise
  RodEvaluation evaluation;                    ///< result of the last evaluate()
};

/// The surface points of a part: what it shows to contact. `point` counts from 0 in each part.
class PartSurface
{
public:
  using Columns = CouplingMatrix::Columns;
  /// Number of an unknown, or of a point, that has none in the matrix because its motion is prescribed.
  static constexpr int kPrescribed = -1;

  virtual ~PartSurface() = default;

  virtual int points() const = 0;   ///< number of its surface points
  /// Writes the positions of its surface points at the trial into the columns of x from first_point on.
  virtual void gather(Eigen::Matrix3Xd& x) const = 0;
  /// The same for where they are when a substep begins.
  virtual void gatherStart(Eigen::Matrix3Xd& x) const { gather(x); }
  /// Number of the first of a point's three unknowns in the matrix, or kPrescribed. Less than kPrescribed: its
  /// displacement depends on other unknowns, see addColumns().
  virtual int base(int point) const = 0;
  /// Adds a weighted component of the displacement of a point to a row of unknowns.
  virtual void addColumns(int point, int component, double weight, Columns& row) const = 0;
  virtual void addForce(int point, const Eigen::Vector3d& force) = 0;   ///< gradient -= force
  virtual Eigen::Vector3d move(int point) const = 0;                    ///< displacement by the direction [m]
};

/// A part of an island: something with unknowns of its own. A rod, a thread, a cloth, and a rigid body are parts.
/// IslandSystem minimises the energy of several parts together, and knows them by this class alone.
///
/// A part has a base configuration and a trial configuration. moveAlong() makes the trial from the base and the
/// direction; evaluate() computes everything at the trial; accept() makes the trial the new base.
///
/// A part that contacts or joints connect to another part is coupled: its unknowns are in the matrix of the island. A
/// part that is not coupled solves with its own matrix. It stays so while it touches only what moves as prescribed,
/// because such contacts couple no more than neighbouring points of the part; they are its own contacts.
class Part : public PartInIsland, public PartSurface
{
public:
  // ---- unknowns
  /// Numbers the unknowns that are not prescribed. Returns false if the numbers differ from those of the last call.
  virtual bool numberUnknowns() = 0;
  virtual int unknowns() const = 0;   ///< how many are not prescribed
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
  virtual void placeHeld(double fraction) = 0;
  /// Whether anything that is prescribed moves between these fractions of the time step. If they are equal: whether the
  /// trial has it elsewhere than the base.
  virtual bool heldMoves(double from, double to) const = 0;
  /// Trial := base + share (trial - base) for what is held in the trial elsewhere than in the base, at one instant.
  virtual void retreatHeld(double) {}
  /// Puts into the trial what joints make the part follow, after all parts have moved.
  virtual void followJoints() {}

  // ---- equations
  /// Computes energy, gradient and, on request, the Hessian at the trial, and keeps the sums in `evaluation`. A part
  /// that is not coupled includes its own contacts, and factors its matrix plus the shift.
  virtual void evaluate(bool with_hessian, const HessianShift& shift) = 0;
  /// Adds the part's forces on what other parts carry to the gradients of these parts.
  virtual void passGradient() {}
  /// Of a coupled part, when its gradient is complete: takes the prescribed unknowns out of it.
  virtual void closeGradient() = 0;
  /// direction := -(matrix)^-1 gradient of the last evaluate(true), of a part that is not coupled.
  virtual void solve() = 0;

  // ---- the matrix of the island, of a coupled part
  virtual void notePattern(CouplingMatrix& matrix) = 0;         ///< Notes what the part itself couples.
  virtual void findEntries(const CouplingMatrix& matrix) = 0;   ///< Is called when the pattern is finished.
  virtual void addHessian(CouplingMatrix& matrix, const HessianShift& shift) = 0;
  virtual void takeGradient(double* right) const = 0;       ///< right-hand side := minus its gradient
  virtual void takeDirection(const double* solution) = 0;   ///< direction := its part of the solution

  // ---- measures for Newton's method, see newton.h
  virtual double stepLimit() const = 0;
  /// Largest displacement of the direction, over `length` for parts that have no length of their own [-].
  virtual double incrementSize(double length) const = 0;
  virtual double slope() const = 0;        ///< gradient . direction [J]
  virtual double residual() const = 0;     ///< largest unbalanced force [N]
  virtual double forceScale() const = 0;   ///< largest force [N]
  virtual double noiseLevel() const = 0;   ///< unbalanced force that round-off alone can cause [N]
};

/// A part that moves rigidly and carries solids: a simulated rigid body.
class RigidPart : public Part
{
public:
  virtual const Pose& pose() const = 0;   ///< of the trial
  /// The same as addColumns() and addForce(), for the body's material point at `position` (world axes).
  virtual void addColumnsAt(const Eigen::Vector3d& position, int component, double weight, Columns& row) const = 0;
  virtual void addForceAt(const Eigen::Vector3d& position, const Eigen::Vector3d& force) = 0;
};

}   // namespace slender
