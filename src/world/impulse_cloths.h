#pragma once

#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "slender_sim/cloth/cloth_stepper.h"
#include "contact/impulses/surface_collider.h"
#include "linalg/average_projection.h"
#include "slender_sim/dynamics/substep_controller.h"
#include "world_object.h"

namespace slender {

/// Returns true if a cloth collides by impulses.
inline bool byImpulses(const WorldModel::Cloth& cloth)
{
  return cloth.contact && cloth.contact->method == ContactMethod::impulses;
}

/// All cloths of an IslandScheduler whose contact is by impulses, tracked or not, and the obstacles and driven bodies
/// that they meet. They are one object, which meets no other one.
///
/// Each cloth makes its step on its own. Then SurfaceCollider corrects the end of the step so that nothing passes
/// through anything. If this fails, or if the step of a cloth fails, the step is halved.
///
/// Some cloths step by tr_bdf2, or by steps that error control may divide. If such a cloth touches something in a step,
/// it makes this step by implicit Euler, undivided. The reason: a contact holds stiff cloth away from its balance by
/// some d, and the next solution, which does not know the contact, lets go. Implicit Euler lets go with a velocity of
/// -d / h, which contact takes back exactly, and tr_bdf2 with 4.8 d / h (its stability function goes as that over z). A
/// step in m parts lets go with up to m d / h. Contacts would so pump energy into the cloth.
class ImpulseCloths final : public WorldObject, SubstepEquations
{
public:
  /// `cloths`: numbers in the world, at least one. The model of the world outlives the object. Throws
  /// std::invalid_argument for models that are not valid.
  ImpulseCloths(const WorldModel& world, std::vector<int> cloths);
  std::string name() const override { return "cloths"; }
  bool load(const WorldState& state, const WorldInputs& inputs, StepReport& report) override;
  void addParts(std::vector<Part*>&) override {}
  IslandFinder::Reach reach() const override { return {}; }
  std::optional<StepReport> stepAlone() override;
  void finish(WorldState& state) override;
  void finishGuide(const WorldInputs& inputs, WorldState& state, StepReport& report) const override;
  ContactMemory& contact(WorldState& state) const override { return state.contact.cloths[cloths_.front()]; }
  void addTo(Meeting&, const WorldState&) override {}

  /// Intersections of a state, by a check of all pairs (see intersection.h).
  std::size_t intersections(const WorldState& state) const;
  /// Throws std::invalid_argument if a state has intersections. The message names cloth, vertex and what it meets.
  /// Collisions only keep separated surfaces separated.
  void check(const WorldState& state) const;
  int vertices() const { return first_.back(); }   ///< of all of them
  /// Sums and maxima over the last step.
  const CollisionReport& collisions() const { return collisions_; }

  // ---- of a cloth, by its number in the world
  /// Force of a cloth on each of its pins [N], 3 x pins, mean over the last successful step: that of its elements and
  /// inertia, and what contacts exert on the held vertices. The sum of all forces changes the cloths' momentum; how a
  /// contact's load comes to the pins within a step is the solver's, so that single steps scatter where cloth rubs or
  /// falls onto something.
  const Eigen::Matrix3Xd& pinForces(int cloth) const { return pin_forces_[indexOf(cloth)]; }
  /// What contacts exert on each vertex of a cloth [N], 3 x vertices, mean over the last successful step, friction
  /// included; on held ones as far as SurfaceCollider::heldImpulses() knows it.
  Eigen::Matrix3Xd contactForces(int cloth) const;
  /// contactForces() are zero until the next step.
  void forgetContacts() { contact_forces_.setZero(); }
  ClothEnergies energies(int cloth, const ClothState& state, const Eigen::Vector3d& gravity) const
  {
    return steppers_[indexOf(cloth)].energies(state, gravity);
  }

private:
  /// States of the cloths and poses of the solids.
  struct Ends
  {
    std::vector<ClothState> cloths;
    std::vector<Pose> solids;
  };
  const WorldModel::Cloth& cloth(std::size_t k) const { return world_.cloths[cloths_[k]]; }
  std::size_t indexOf(int cloth) const;   ///< in cloths_
  void take(const WorldState& state, Ends& to) const;
  bool stepCloths(double to, double h, bool all, StepReport& report);
  CollisionReport collide(double h);
  StepReport tryStep(double from, double to, double h);
  StepFailure attempt(const Substep& substep, StepReport& report) override;
  void accept(const Substep& substep) override;
  bool shorterMayHelp(StepFailure failure) const override;
  void refuse(const Substep& substep, StepFailure failure, StepReport& report) override;
  bool lowerOrder();
  bool shareLoads(const CollisionStep& step, bool again);
  void blameExplicit(StepReport& report) const;
  void addForces(double share, double h);
  CollisionReport resolveContacts(const CollisionStep& step);
  CollisionReport resolve(const CollisionStep& step);
  double meetAverages(double h);
  struct AverageCorrection;
  AverageCorrection& prepareCorrection(std::size_t cloth);
  double balancedWork(std::size_t cloth, double h);
  double boundAverages(std::size_t cloth, double h, double gap);
  /// Those that act on a cloth in the present step; null: none.
  const PrescribedAverages* averagesOf(std::size_t cloth) const
  {
    return steppers_[cloth].model().averagesOf(work_.cloths[cloth]);
  }
  Eigen::Matrix3Xd positions(const Ends& state) const;
  int clothOf(int point) const;
  std::string placeOf(int point) const;
  std::string whereIs(const CollisionReport& failure) const;
  std::string blameAverages(const CollisionReport& failure) const;
  std::string solidName(int solid) const;
  void blameWork(double h, StepReport& report) const;

  const WorldModel& world_;
  const std::vector<int> cloths_;   ///< numbers in the world, ascending
  std::vector<int> bodies_;         ///< of the world, likewise: those that they meet
  std::vector<ClothStepper> steppers_;
  CollisionSurface surface_;
  std::unique_ptr<SurfaceCollider> collider_;
  enum class Order : char
  {
    own,
    lowered,
    first
  };
  /// of what was done of each cloth in the present substep; lowered: to be done again
  std::vector<Order> order_;
  std::vector<int> first_;   ///< point of each cloth; one more at the end
  CollisionReport collisions_;
  /// Of a step, for all that is done in it but by cloths with error control.
  std::shared_ptr<WorkBudget> budget_ = std::make_shared<WorkBudget>();
  StepReport sub_report_;   ///< of the last substep
  bool hopeless_ = false;   ///< the failure of the last substep is one of its start

  Ends work_, next_;
  std::vector<ClothInputs> inputs_, sub_inputs_;   ///< of the present step, and of its substep
  std::vector<Pose> solid_ends_;                   ///< at the end of the step
  std::vector<Eigen::Matrix3Xd> pins_start_, pin_forces_, pin_sums_, shared_pins_, pin_answers_, averages_start_;
  std::vector<Eigen::Matrix3Xd> average_forces_, average_sums_, shared_averages_, average_answers_;

  /// How a cloth with prescribed averages moves so that it has them again.
  struct AverageCorrection
  {
    double tolerance = 0.0;   ///< [m]
    int set = -1;             ///< of averages, that `projection` is for
    std::unique_ptr<AverageProjection> projection;
    PointVector gap, multipliers;
    Eigen::Matrix3Xd forces;   ///< [N]
  };
  std::vector<AverageCorrection> corrections_;
  Eigen::Matrix3Xd held_impulses_;
  /// 3 x points: of the last step, of the present one, of its substep
  Eigen::Matrix3Xd contact_forces_, contact_sums_, contact_now_;
  Eigen::Matrix3Xd x_start_, x_, v_, v_before_;
  Eigen::Matrix3Xd corrected_, push_, answer_, own_push_, own_answer_;
  /// Per point [kg], see ClothStepper::Impl::inertia(); inverse: 0 where held.
  Eigen::VectorXd inertia_, inverse_mass_;
};

}   // namespace slender
