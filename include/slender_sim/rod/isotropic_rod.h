#pragma once

#include <array>
#include <optional>
#include <vector>

#include "slender_sim/dynamics/step_report.h"
#include "slender_sim/energy/isotropic_kernel.h"
#include "slender_sim/rod/rod_system.h"

namespace slender {

/// The thesis's special case (4.2 to 4.4.2): a naturally straight rod that bends alike in all directions. Its energy
/// depends on the centreline and on one twisting moment per span between sections whose frames are held (4.3); its
/// frames are read off a space-parallel frame (3.4.3) instead of being unknowns. For explicit steps: there is a
/// gradient and no Hessian.
class IsotropicRod
{
public:
  /// `system` says which parts are held, and how stiff joints and clamps are.
  IsotropicRod(const RodModel& model, RodSystem& system);

  /// Elastic energy and gradient() at a state.
  RodEvaluation evaluate(const RodState& state);
  /// Of the state last evaluated [J].
  double twistEnergy() const { return twist_energy_; }
  /// Twists and frames of `to`, whose nodes have moved and whose grasps are at `poses`, from those of the state last
  /// evaluated.
  StepFailure settle(const RodState& from, const std::vector<Pose>& poses, RodState& to);

  Eigen::Vector3d nodeGradient(int node) const
  {
    return Eigen::Map<const Eigen::Vector3d>(gradient_.data() + 3 * node);
  }
  /// Torque of a grasp's clamps on the gripper [N m], without the forces' levers.
  Eigen::Vector3d clampTorque(int grasp) const;

private:
  /// Consecutive edges between held sections, or from one to a free end, or a whole loop.
  struct Span
  {
    int first = 0, count = 0;          ///< edges
    int before = -1, after = -1;       ///< clamps at its ends, -1: free
    bool loop = false;                 ///< closed, and no section is held
    double rest = 0, compliance = 0;   ///< sums over its joints of rest twists [rad] and l / beta [1/(N m)]
    int pieces = 0, piece_first[4], piece_count[4];   ///< transported side by side
    bool held() const { return loop || (before >= 0 && after >= 0); }
  };

  /// A held section's frame, and how far it has turned in the step.
  struct Section
  {
    Eigen::Vector3d t = Eigen::Vector3d::UnitX(), d1 = Eigen::Vector3d::UnitY();
    double turn = 0.0;   ///< [rad]
  };
  using Ahead = std::array<double, 4>;   ///< per piece: its frame's angle from the one parallel along the span [rad]

  void compose();
  double totalTwist(const Span& span, const RodState& state) const;
  double evaluateClamp(int clamp, const RodState& state, double& min_chi);
  Section sectionOf(int clamp, const RodState& from, const std::vector<Pose>& poses) const;
  bool transportFrames(const Span& span, const RodState& from, const Section& start);
  Ahead anglesAhead(const Span& span) const;
  std::optional<double> angleToEnd(const Span& span, const Section& end, double behind) const;
  double setSectionTwist(int clamp, double moment, RodState& to) const;
  void shareTwist(const Span& span, double moment, RodState& to) const;
  void turnFrames(const Span& span, double phi, const Ahead& ahead, const RodState& to);
  StepFailure settleSpan(const Span& span, const RodState& from, const std::vector<Pose>& poses, RodState& to);
  void releaseTwists(const GraspState& before, RodState& to, const GraspState& now) const;
  template <class F>
  void forJoints(const Span& span, F&& f) const;
  Eigen::Vector3d tangent(int edge) const { return {a_.t[0][edge], a_.t[1][edge], a_.t[2][edge]}; }
  Eigen::Vector3d director(int edge) const { return {a_.u[0][edge], a_.u[1][edge], a_.u[2][edge]}; }
  void setDirector(int edge, const Eigen::Vector3d& d)
  {
    for (int k = 0; k < 3; ++k)
      a_.u[k][edge] = d[k];
  }

  const RodModel& model_;
  RodSystem& system_;
  IsotropicArrays a_;
  std::vector<AlignedVector<double>> storage_;
  AlignedVector<double> gradient_;
  unsigned long composition_ = 0;
  double twist_energy_ = 0;
  std::vector<Span> spans_;
  std::vector<double> clamp_moment_;                           ///< twisting moment of each clamp's span [N m]
  std::vector<Eigen::Vector3d> clamp_torque_;                  ///< on the gripper
  std::vector<std::array<Eigen::Vector3d, 4>> old_tangents_;   ///< per span, where its pieces begin
};

}   // namespace slender
