#pragma once

#include <memory>
#include <string>
#include <vector>

#include <Eigen/Cholesky>

#include "slender_sim/cloth/cloth_stepper.h"
#include "slender_sim/contact/contact_potential.h"
#include "slender_sim/contact/impulses/surface_collider.h"
#include "slender_sim/dynamics/substep_controller.h"

namespace slender {

/// Cloths that touch themselves, each other and solids.
struct ClothGroupModel
{
  std::vector<std::shared_ptr<const ClothModel>> cloths;
  std::vector<ContactProperties> contact;   ///< of each cloth
  std::vector<ClothOptions> options;        ///< of each cloth; empty: those of the group
  std::vector<Obstacle> solids;
  std::vector<std::vector<int>> ignored;   ///< per solid: the cloths that pass through it; empty: no cloth does
};

struct ClothGroupState
{
  std::vector<ClothState> cloths;
  std::vector<Pose> solids;
};

struct ClothGroupInputs
{
  std::vector<ClothInputs> cloths;
  /// at the end of the step; origins go along lines, solids turn uniformly by the smaller angle
  std::vector<Pose> solids;
};

/// Steps cloths on their own, then corrects the end of the step so that nothing passes through anything
/// (SurfaceCollider). Where that fails, or a cloth's step does, the step is halved.
///
/// Cloths that touch something in a step by tr_bdf2, or in one that error control may divide, do that step by implicit
/// Euler, undivided. A contact holds stiff cloth away from its balance by some d, and the next solve, which does not
/// know it, lets go: implicit Euler with a velocity -d / h, which contact takes back exactly, tr_bdf2 with 4.8 d / h
/// (its stability function goes as that over z), a step in m parts with up to m d / h, so that contacts would pump
/// energy into the cloth.
class ClothGroup : SubstepEquations
{
public:
  /// Throws std::invalid_argument for models or options that are not valid.
  ClothGroup(ClothGroupModel model, const ClothOptions& options);

  /// Advances all by `duration` [s]. On failure the state is untouched and the report says why.
  StepReport step(ClothGroupState& state, const ClothGroupInputs& inputs, double duration);

  /// Intersections of a state, by a check of all pairs (see intersection.h).
  std::size_t intersections(const ClothGroupState& state) const;
  /// Throws std::invalid_argument where a state has any, naming cloth, vertex and what it meets: collisions keep what
  /// is apart apart, no more.
  void checkIntersections(const ClothGroupState& state) const;

  /// Force of a cloth on each of its pins [N], 3 x pins, mean over the last successful step: that of its elements and
  /// inertia, and what contacts exert on the held vertices. The sum of all forces changes the cloths' momentum; how a
  /// contact's load comes to the pins within a step is the solver's, so that single steps scatter where cloth rubs or
  /// falls onto something.
  const Eigen::Matrix3Xd& pinForces(int cloth) const { return pin_forces_.at(cloth); }

  /// Force [N] with which each prescribed average of a cloth acts on it, mean over the last successful step, as
  /// pinForces().
  const Eigen::Matrix3Xd& averageForces(int cloth) const { return average_forces_.at(cloth); }

  /// What contacts exert on each vertex of a cloth [N], 3 x vertices, mean over the last successful step, friction
  /// included; on held ones as far as SurfaceCollider::heldImpulses() knows it.
  auto contactForces(int cloth) const
  {
    return contact_forces_.middleCols(first_.at(cloth), first_.at(cloth + 1) - first_.at(cloth));
  }
  /// contactForces() are zero until the next step.
  void forgetContacts() { contact_forces_.setZero(); }

  /// Sums and maxima over the last step.
  const CollisionReport& collisions() const { return collisions_; }
  std::size_t size() const { return model_.cloths.size(); }   ///< cloths
  const ClothStepper& stepper(int cloth) const { return steppers_.at(cloth); }

private:
  bool stepCloths(const ClothGroupInputs& inputs, double to, double h, bool all, StepReport& report);
  CollisionReport collide(double h);
  StepReport tryStep(const ClothGroupInputs& inputs, double from, double to, double h);
  StepFailure attempt(const Substep& substep, StepReport& report) override;
  void accept(const Substep& substep) override;
  bool shorterMayHelp(StepFailure failure) const override;
  void refuse(const Substep& substep, StepFailure failure, StepReport& report) override;
  bool lowerOrder();
  bool shareLoads(const CollisionStep& step, bool again);
  void blameExplicit(double duration, StepReport& report) const;
  void addForces(double share, double h);
  CollisionReport resolveContacts(const CollisionStep& step);
  CollisionReport resolve(const CollisionStep& step);
  double meetAverages(double h);
  void prepareCorrection(std::size_t cloth);
  double balancedWork(std::size_t cloth, double h);
  double boundAverages(std::size_t cloth, double h, double gap);
  /// Those that act on a cloth in the present step; null: none.
  const PrescribedAverages* averagesOf(std::size_t cloth) const
  {
    return model_.cloths[cloth]->averagesOf(work_.cloths[cloth]);
  }
  Eigen::Matrix3Xd positions(const ClothGroupState& state) const;
  int clothOf(int point) const;
  std::string placeOf(int point) const;
  std::string whereIs(const CollisionReport& failure) const;
  std::string blameAverages(const CollisionReport& failure) const;
  std::string solidName(int solid) const;
  void blameWork(double h, StepReport& report) const;

  ClothGroupModel model_;
  ClothOptions options_;
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
  std::shared_ptr<WorkBudget> budget_;   ///< of a step, of all that is done in it but by cloths with error control
  const ClothGroupInputs* inputs_ = nullptr;   ///< of the present step
  double duration_ = 0;                        ///< of the present step [s]
  StepReport sub_report_;                      ///< of the last substep
  bool hopeless_ = false;                      ///< the failure of the last substep is one of its start

  ClothGroupState work_, next_;
  ClothGroupInputs sub_;
  std::vector<Eigen::Matrix3Xd> pins_start_, pin_forces_, pin_sums_, shared_pins_, pin_answers_, averages_start_;
  std::vector<Eigen::Matrix3Xd> average_forces_, average_sums_, shared_averages_, average_answers_;

  /// How a cloth with prescribed averages moves so that it has them again.
  struct AverageCorrection
  {
    double tolerance = 0.0;                                 ///< [m]
    std::vector<int> pins;                                  ///< that `gram` is for, and
    int set = 0;                                            ///< of averages
    Eigen::SparseMatrix<double, Eigen::RowMajor> weights;   ///< averages over masses
    Eigen::LDLT<Eigen::MatrixXd> gram;
    Eigen::Matrix3Xd gap, multipliers;
    Eigen::SparseMatrix<double, Eigen::RowMajor> gram_rows;   ///< with bounds only, as
    Eigen::Matrix3Xd forces;                                  ///< [N]
    Eigen::MatrixXd columns;                                  ///< count x 3
    bool ready = false;
  };
  std::vector<AverageCorrection> corrections_;
  Eigen::Matrix3Xd held_impulses_;
  /// 3 x points: of the last step, of the present one, of its substep
  Eigen::Matrix3Xd contact_forces_, contact_sums_, contact_now_;
  Eigen::Matrix3Xd x_start_, x_, v_, v_before_;
  Eigen::Matrix3Xd corrected_, push_, answer_, own_push_, own_answer_;
  Eigen::VectorXd inverse_mass_;
};

}   // namespace slender
