#pragma once

#include <array>
#include <vector>

#include "island/chain_part.h"
#include "body_part.h"
#include "rod_work.h"
#include "slender_sim/contact/contact_properties.h"

namespace slender {

/// A rod as a part of an island. Bodies may carry sections and edges of it; the unknowns there are those of the bodies.
class RodPart : public ChainPart
{
public:
  /// averages: the matrix C of AverageConstraints, count x nodes; null: no averages are prescribed.
  RodPart(RodWork& rod, bool touches, const AverageConstraints::Matrix* averages = nullptr)
    : ChainPart(rod.system),
      rod_(rod),
      touches_(touches),
      shortest_edge_(rod.model->rest_length.minCoeff())
  {
    if (averages)
      averages_ = std::make_unique<AverageConstraints>(*averages);
  }

  /// A grasp of the rod follows a simulated body; X_BG: the frame of the grasp in that of the body.
  struct Weld
  {
    int grasp;
    BodyPart* body;
    Pose X_BG;
  };
  void addWeld(const Weld& weld);
  RodWork& rod() const { return rod_; }

  /// Sets what the rod touches, and which solids its points pass through. Without a call the rod touches nothing.
  void setContact(const ContactProperties& contact, const std::vector<IgnoredSolid>& ignored = {})
  {
    contact_ = contact;
    ignored_ = ignored.empty() ? nullptr : std::make_shared<std::vector<IgnoredSolid>>(ignored);
    if (turns())
      rod_.keepSpins();
  }
  int points() const override { return touches_ ? system_.nodes() : 0; }
  void addSurface(ContactSurface& surface) const override;

private:
  /// f(weld, grasp) for each grasp that is active and that a simulated body carries.
  template <class F>
  void forActiveWelds(F&& f) const
  {
    for (const Weld& weld : welds_)
      if (const GraspState& g = rod_.work.grasps[weld.grasp]; g.active)
        f(weld, g);
  }

  bool turns() const { return touches_ && contact_.friction > 0.0; }   ///< Friction turns the rod about its tangents.

  // ---- as Part
  int nodeOf(int point) const override { return point; }
  bool numberUnknowns() override;
  bool joined() const override { return welded_; }
  void placeHeld(double fraction) override;
  bool heldMoves(double from, double to) const override;
  void followJoints() override;
  void gather(Eigen::Matrix3Xd& x) const override;
  void passGradient() override;
  void notePattern(SharedMatrix& matrix) override;
  void addHessian(SharedMatrix& matrix, const HessianShift& shift) override;
  void takeDirection(const double* solution) override;
  void addColumns(int point, int component, double weight, Columns& row) const override;

  // ---- its steps
  StepFailure beginSubstep(const StepPlan& plan, const Substep& substep) override;
  void beginStage(std::size_t stage) override;
  void endStage(std::size_t stage, bool last, StepReport& report) override;
  double lastSubstep() const override { return rod_.work.last_step; }
  double shortestEdge() const override { return shortest_edge_; }
  void addStartLoads() override;
  void takeStartAcceleration() override;
  long surfaceVersion() const override { return surface_version_; }
  BoundingBox surfaceBox(double ahead) const override;
  BarrierRange barrierRange(double gap) const override;
  StepFailure finishSubstep(StepReport& report) override;
  void acceptSubstep(const Substep&) override { rod_.accept(); }
  bool conserves() const override { return !graspsMove(false); }
  double energyAtStart(double& allowance) override;
  double energyAtEnd() const override { return rod_.endEnergy(); }
  Largest unbalancedForce() const override { return rod_.unbalancedForce(); }
  void refuse(StepFailure failure, double length, StepReport& report) const override;

  // ---- its explicit steps, rod_explicit.cpp
  StepFailure predict(const Substep& substep, StepReport& report) override
  {
    return rod_.explicitPredict(substep, report);
  }
  bool addTo(FastProjection& projection) override;
  void giveTo(FastProjection& projection, bool at_start) override;
  StepFailure takeFrom(FastProjection& projection, const ProjectionReport& result, bool at_start) override;
  void takeStart(const FastProjection& projection);

  // ---- its statics, rod_part_statics.cpp
  void loadPresent() override;
  void takeTrial() override;
  std::function<void()> wayBack() override;
  double shift() const override;
  double staticWork() const override { return twist_work_; }
  double moves() const override;
  void setProximal(double weight) override;
  double weightOf(double rate) const override;
  void setPencil(double rate) override;
  StaticScales scales() const override;
  Eigen::Map<Eigen::VectorXd> directions() override { return {system_.direction(), 4 * system_.nodes()}; }
  void weighDirection() override;
  double largestTurn() const override;
  void addRounding(double& stiffness, double& inertia) const override;
  double proximalUnit() const;
  Eigen::Map<const Eigen::Matrix4Xd> columns() const { return {system_.direction(), 4, system_.nodes()}; }

  const RodSystem& system() const { return rod_.system; }
  bool graspsMove(bool to_rest) const;
  const Weld* weldOf(int grasp) const;
  void columnsOf(int unknown, double weight, Columns& row) const;
  void addCarried(SharedMatrix& matrix) const;
  void addClamps(SharedMatrix& matrix) const;
  /// Inertia of the nodes that bodies carry, as points of these, when a stage has begun.
  void setCarriedInertia(const Stage& stage);
  /// After a stage: poses and velocities of the grasps that bodies carry.
  void takeCarriedMotion();

  RodWork& rod_;
  const bool touches_;
  const double shortest_edge_;   ///< at rest [m]
  ContactProperties contact_;
  std::shared_ptr<const std::vector<IgnoredSolid>> ignored_;   ///< null: none
  std::vector<Weld> welds_;
  int chain_ = -1;   ///< its number in the projection; -1: it stretches
  bool welded_ = false;
  double twist_work_ = 0.0;   ///< of torques about tangents, in all searches for equilibria [J]
  long surface_version_ = 0;
  bool dependent_ = false;   ///< the prescribed averages depend on each other on the free nodes
  std::vector<std::array<int, 3>> carried_entries_;   ///< node, column, row of those with a carried unknown
  std::vector<std::array<int, 4>> holds_;             ///< grasps that dof_ was made for: active, first, last, carried
};

}   // namespace slender
