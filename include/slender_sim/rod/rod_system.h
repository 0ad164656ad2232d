#pragma once

#include <limits>
#include <vector>

#include "slender_sim/dynamics/chain_system.h"
#include "slender_sim/energy/spin_inertia.h"
#include "slender_sim/energy/twist_loads.h"
#include "slender_sim/rod/clamp_joint.h"
#include "slender_sim/rod/rod_model.h"

namespace slender {

/// Equations of one rod: a chain with the response of a rod's material, grasps, and clamps where these hold frames.
class RodSystem : public ChainSystem
{
public:
  /// Takes memory for what compose() finds only; load() takes the rest when it is first called, and comes before
  /// anything else.
  explicit RodSystem(const RodModel& model);

  const RodModel& model() const { return model_; }

  /// Base and trial := state. Rebuilds the clamps when the state's grasps changed.
  void load(const RodState& state);
  /// Held parts, clamps and stiffnesses for the state's grasps, without its configuration; load() does it, too.
  void compose(const RodState& state);
  /// Counts the times that compose() found other grasps than before.
  unsigned long composition() const { return composition_; }
  /// Without stretching energy, for edges whose lengths are constraints; from the next setResponse() on.
  void leaveOutStretching(bool leave_out) { no_stretching_ = leave_out; }
  /// Positions, frames, twists, grasp sections.
  void store(RodState& state) const;

  /// Trial positions and frames of everything held, for the given grasp frames (one per grasp of the state). It
  /// overrides setPosition() of held nodes.
  void placeGrasps(const std::vector<Pose>& X_WG);

  /// Torques about the tangents of the edges [N m], one per edge, or empty: none. They stay until they are set again,
  /// beyond load(). The potential is -sum M_j theta_j, where theta_j is the turn of edge j since load(). At fixed
  /// tangents that is exact. Where a tangent turns as well, such a torque has no potential: its force field is M_j on
  /// theta_j and nothing on positions, and the matrix leaves out its skew part.
  void setTwistLoads(const Eigen::VectorXd& torques);
  /// From now on edges may have inertia about their tangents. load() sets it to zero, and setSpin() sets it for an
  /// edge, see SpinInertia.
  void keepSpins();
  void setSpin(int edge, double weight, double target) { spin_inertia_.set(edge, weight, target); }
  /// Sets by how much an edge turns from the base to the trial [rad]. If the turn is prescribed, it stays as it is.
  void setTurn(int edge, double turn);
  /// Adds an inertia about the tangents to the diagonal of the matrix [N m], until the next load(). Rods whose frames
  /// nobody holds, which can spin without energy, also get a share of the twist stiffness.
  void stiffenAngles(double share, double inertia)
  {
    spin_ = (clamps_.joints.empty() && holds_.turns().empty() ? share * shift_theta_ : 0.0) + inertia;
  }
  /// Work of these torques on the way from the state of load() to the trial [J].
  double twistWork() const;

  /// Elastic response; with viscous_ratio > 0 every stiffness acts as k (1 + ratio) about the mean of its rest strain
  /// and `viscous_strain` with weights 1 : ratio, which is the elastic force plus k ratio (strain - viscous_strain).
  void setResponse(double viscous_ratio, const Eigen::Matrix4Xd* viscous_strain);

  /// without forces there is no scale
  static constexpr double mostUnbalanced() { return std::numeric_limits<double>::infinity(); }
  /// Has inertia here: free, or carried by a simulated body.
  bool isMoving(int node) const { return isFree(node) || carried_[node]; }

  /// Strains at the trial configuration, columns as in RodState::strain_rate.
  void strains(Eigen::Matrix4Xd& out) const;

  /// One Newton step of the material frames towards equilibrium at fixed positions (thesis 4.3), from the last
  /// evaluate(false). Returns the largest turn [rad]; turnFrames(), after accept(), makes these turns the next trial's.
  double solveFrames();
  void turnFrames();
  /// store() with those turns applied, which are exact for twists, without evaluating there.
  void storeTurned(RodState& state) const;
  /// Evaluates the trial and repeats this until its frames are in equilibrium. Returns the last evaluation.
  RodEvaluation relaxFrames();

  /// Torque [N m] of the clamps of a grasp and of its held edges on the gripper (without the forces' levers).
  Eigen::Vector3d clampTorque(int grasp) const;
  const std::vector<ClampJoint>& clamps() const { return clamps_.joints; }

  /// Elastic stiffness of the joints as composed, over their lengths, and their twist at rest; per node.
  const double* bendStiffness() const { return b11_.data(); }
  const double* twistStiffness() const { return beta_.data(); }
  const double* restTwist() const { return rest_m_.data(); }

private:
  std::vector<char> holdNodes();
  void addClamps(const std::vector<char>& jointless, std::vector<double>& length);
  void setClamp(ClampJoint& c, double length) const;
  void composeJoints(const std::vector<double>& length);
  void listTerms();
  int before(int node) const { return node > 0 ? node - 1 : model_.edges() - 1; }

  const RodModel& model_;
  unsigned long composition_ = 0;
  bool no_stretching_ = false;
  double bend_modulus_ = 0;   ///< largest one of the joints [N m^2]
  /// elastic response as composed
  AlignedVector<double> stretch_, b11_, b12_, b22_, beta_, rest_k1_, rest_k2_, rest_m_, coupling_;
  std::vector<GraspState> grasps_;
  ClampJoints clamps_;
  TwistLoads twist_loads_;
  SpinInertia spin_inertia_;
  bool spins_ = false;
  std::vector<char> carried_;   ///< per node: held by a simulated body
};

/// Share of a joint's turn and twist that falls on the half joint between its node and the edge before (side 0) or
/// after it (side 1).
double shareOfEdge(const RodModel& model, int node, int side);

/// Frame (t, d1, d2) of the section at a node: between the two edges' frames, or at the end of an open rod the end
/// edge's frame bent back by the rest curvature of half an edge.
Eigen::Matrix3d sectionFrame(const RodModel& model, const RodState& state, int node);

/// Pose of the section at a node: the axes of sectionFrame(), x along the tangent and y along d1, at the node [m].
Pose sectionPose(const RodModel& model, const RodState& state, int node);

}   // namespace slender
