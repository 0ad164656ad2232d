#pragma once

#include <utility>

#include "island/part.h"
#include "linalg/cholesky6.h"
#include "body_surface.h"
#include "body_system.h"
#include "rod_work.h"
#include "slender_sim/dynamics/fast_projection.h"

namespace slender {

/// A simulated rigid body as a part of an island. Its unknowns are its displacement and its turn (world axes).
class BodyPart : public RigidPart
{
public:
  explicit BodyPart(const RigidBodyModel& model) : system(model) {}

  BodySystem system;
  Eigen::Vector3d gravity{0, 0, 0};   ///< of the present step [m/s^2]
  BodySystem::Vector6 direction = BodySystem::Vector6::Zero();

  /// A grasp of a rod that follows a body; X_BG: its frame in that of the body.
  struct Carried
  {
    const RodWork* rod;
    int grasp;
    Pose X_BG;
  };
  void carry(const Carried& carried) { carried_.push_back(carried); }
  /// Tells the projection that a node of a chain is fixed to the body at the place r_B, in body axes [m].
  void weldTo(FastProjection& projection, int chain, int node, const Eigen::Vector3d& r_B) const
  {
    projection.weld(chain, node, number_, r_B - centre_);
  }
  /// Begins a step from this state; gravity [m/s^2].
  void begin(const RigidBodyState& state, const Eigen::Vector3d& step_gravity);
  const RigidBodyState& state() const { return now_; }   ///< where the last accepted substep ended
  /// What a rod at the start of a run exerts on the body, and the inertia that it adds.
  void addStartLoad(const BodySystem::Vector6& wrench, const BodySystem::Matrix6& inertia);
  const BodySystem::Vector6& startAcceleration() const { return start_acceleration_; }
  /// No point of the shape is farther from the origin of the body [m]. Without a call the body has no shape.
  void setReach(double reach) { reach_ = reach; }
  /// The body touches solids with this surface. Without a call solids pass through it.
  void setSurface(BodySurface surface, double friction)
  {
    surface_ = std::move(surface);
    friction_ = friction;
  }
  /// Points of the surface [m] where the body has this pose.
  Eigen::Matrix3Xd surfaceAt(const Pose& pose) const;
  /// Number of the body's solid in the contact that addSurface() is for.
  void setCarrier(int solid) { carrier_ = solid; }
  bool hasSurface() const { return !surface_.empty(); }
  const Pose& pose() const override { return system.pose; }
  void addColumnsAt(const Eigen::Vector3d& position, int component, double weight, Columns& row) const override;
  void addForceAt(const Eigen::Vector3d& position, const Eigen::Vector3d& force) override;

private:
  // ---- as RigidPart
  void addTriples(std::vector<double>& masses) const override
  {
    masses.insert(masses.end(), {system.model().mass, 0.0});
  }
  bool numberUnknowns() override { return true; }   // they never change
  int unknowns() const override { return 6; }
  bool joined() const override { return !carried_.empty(); }

  void moveAlong(double alpha) override { system.moveAlong(direction, alpha); }
  void accept() override { system.accept(); }
  void saveBase() override { system.saveBase(); }
  void restoreBase() override { system.restoreBase(); }
  void retreat(double share) override;

  int points() const override { return static_cast<int>(surface_.points.cols()); }
  void gather(Eigen::Matrix3Xd& x) const override;

  void evaluate(bool with_hessian, const HessianShift& shift) override;
  void solve() override
  {
    direction = -system.gradient;
    factor_.solveInPlace(direction);
  }

  void notePattern(SharedMatrix& matrix) override;
  void addHessian(SharedMatrix& matrix, const HessianShift& shift) override;
  void takeGradient(double* right) const override;
  void takeDirection(const double* solution) override;

  int base(int) const override { return kPrescribed - 1; }
  void addColumns(int point, int component, double weight, Columns& row) const override
  {
    addColumnsAt(position(point), component, weight, row);
  }
  void addForce(int point, const Eigen::Vector3d& force) override { addForceAt(position(point), force); }
  Eigen::Vector3d move(int point) const override { return moveAt(position(point)); }
  Eigen::Vector3d moveAt(const Eigen::Vector3d& position) const override;

  double stepLimit() const override;
  double incrementSize(double length) const override;
  double slope() const override { return system.gradient.dot(direction); }
  double residual() const override;
  double forceScale() const override;

  // ---- its steps
  double longestSubstep(double duration) const override;
  StepFailure beginSubstep(const StepPlan& plan, const Substep& substep) override;
  double lastSubstep() const override { return now_.last_step; }
  bool startsFresh() const override { return now_.last_step == 0.0; }
  void solveStartAcceleration() override;
  void addSurface(ContactSurface& surface) const override;
  BoundingBox surfaceBox(double ahead) const override;
  BarrierRange barrierRange(double) const override;
  void beginStage(std::size_t stage) override;
  void endStage(std::size_t stage, bool last, StepReport& report) override;
  void acceptSubstep(const Substep&) override { std::swap(now_, next_); }
  bool conserves() const override { return system.model().torque.isZero(0.0); }
  Largest unbalancedForce() const override;
  double energyAtStart(double& allowance) override;
  double energyAtEnd() const override { return energyOf(next_); }
  void refuse(StepFailure failure, double length, StepReport& report) const override;

  // ---- its explicit steps, body_explicit.cpp
  StepFailure predict(const Substep& substep, StepReport& report) override;
  bool addTo(FastProjection& projection) override;
  void giveTo(FastProjection& projection, bool at_start) override;
  StepFailure takeFrom(FastProjection& projection, const ProjectionReport& result, bool at_start) override;

  // ---- its statics
  void loadPresent() override { system.load(now_); }
  void takeTrial() override { now_.X_WB = system.pose; }
  void setPencil(double rate) override { system.hold(rate, gravity); }
  StaticScales scales() const override;
  Eigen::Map<Eigen::VectorXd> directions() override { return {direction.data(), direction.size()}; }
  void weighDirection() override;
  double largestTurn() const override { return direction.tail<3>().norm(); }

  template <class Do>
  void forCarried(const Do& apply) const;
  void compose();
  void addForces(Eigen::Vector3d& force, Eigen::Vector3d& torque) const;
  double gyration() const;   ///< radius of gyration [m]
  void damp(double h, Eigen::Vector3d& momentum);
  StepFailure place(const ProjectedBody& whole);

  double energyOf(const RigidBodyState& state) const;
  Eigen::Vector3d position(int point) const { return system.pose * Eigen::Vector3d(surface_.points.col(point)); }
  void addOwnContacts(bool with_hessian);

  Cholesky6 factor_;
  RigidBodyState now_, next_;
  const StepPlan* plan_ = nullptr;
  double length_ = 0.0;   ///< of the substep [s]
  double reach_ = -1.0;   ///< negative: no shape
  BodySurface surface_;
  double friction_ = 0.0;
  int carrier_ = -1;
  std::vector<Carried> carried_;
  /// The body together with the nodes that it carries, in an explicit substep. `pose` is its end without constraints.
  ProjectedBody whole_;
  Eigen::Vector3d centre_{0, 0, 0};   ///< its centre of mass, body axes [m]
  int number_ = -1;                   ///< in the projection
  BodySystem::Vector6 start_wrench_, start_acceleration_;
  BodySystem::Matrix6 start_inertia_;
};

}   // namespace slender
