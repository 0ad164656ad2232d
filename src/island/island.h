#pragma once

#include <memory>
#include <vector>

#include "island/equations.h"
#include "slender_sim/dynamics/fast_projection.h"
#include "slender_sim/dynamics/time_config.h"

namespace slender {

/// A potential of surface points that is made anew in each substep, for example the merging of threads.
class SubstepPotential : public SurfacePotential
{
public:
  /// A substep of h seconds begins: `pairs` of segments are near each other.
  virtual void begin(const Eigen::Matrix3Xd& x, const ContactSurface& surface,
                     const std::vector<GridPairs::Pair>& pairs, double gap, double h) = 0;
  virtual double largestForce() const = 0;   ///< that it exerts at the start of the substep [N]
};

/// Advances the parts of an island together, in substeps common to all. An implicit substep minimises their energy. An
/// explicit one takes the forces at its start, and projects inextensible rods to their lengths.
class Island : SubstepEquations
{
public:
  explicit Island(const TimeConfig& time, bool simplicial) : time_(time), equations_(simplicial) {}

  Equations& equations() { return equations_; }
  const Equations& equations() const { return equations_; }

  /// The parts, bodies first. They must outlive the island, or the next call.
  void setParts(const std::vector<Part*>& parts);
  /// Makes contact for the surfaces of the parts and these solids. `ignores` of a solid are numbers of objects.
  void setContact(const std::vector<ContactSolid>& solids, const ContactOptions& options);
  /// Acts besides contact; null: nothing does.
  void setAttraction(SubstepPotential* attraction);

  /// Advances by `duration` [s], from what the parts have loaded. `first`: length of the first substep [s], 0: the
  /// longest; becomes that of the next step's first one. On failure the report says why.
  StepReport step(double duration, double& first);
  /// Box of the surface of a part during the last step, see Part::surfaceBox().
  const BoundingBox& sweptBox(std::size_t part) const { return swept_[part]; }
  /// The barrier about a part, which belongs to the state.
  const BarrierLaw& barrier(std::size_t part) const { return barrier_[part]; }
  void setBarrier(std::size_t part, const BarrierLaw& barrier) { barrier_[part] = barrier; }
  /// Gives contact the barriers of all parts. They are no softer than `least` [N] about parts whose surfaces change.
  void loadBarriers(double least);
  /// From now on a step leaves the forces of barriers as they are, so that an equilibrium keeps its contact forces.
  void keepBarriers() { keeps_barriers_ = true; }
  /// Springs of friction of what sticks, see ContactPotential::springs(); part of the state.
  std::vector<FrictionSpring> springs;

private:
  bool conserves() const;
  double energyAtStart(double& allowance);
  double energyAtEnd() const;
  void startAccelerations();
  bool loadContact(double h);
  void takeSurface();
  bool surfaceIsStale() const;
  NewtonResult solveStage(std::size_t stage, const Substep& substep);
  StepFailure solveSubstep(const Substep& substep, StepReport& report);
  StepFailure project(double h, bool at_start, StepReport& report);
  StepFailure stepExplicitly(const Substep& substep, StepReport& report);
  std::size_t farthestFromBalance() const;

  StepFailure attempt(const Substep& substep, StepReport& report) override;
  void accept(const Substep& substep) override;
  bool shorterMayHelp(StepFailure failure) const override;
  bool mend(StepReport& report) override;
  void refuse(const Substep& substep, StepFailure failure, StepReport& report) override;

  const TimeConfig time_;
  Equations equations_;
  std::vector<Part*> parts_;
  std::vector<BoundingBox> swept_;               ///< per part
  std::unique_ptr<FastProjection> projection_;   ///< of `inextensible_`; null: there are no such parts
  std::vector<Part*> inextensible_;              ///< parts whose lengths explicit steps keep
  SubstepPotential* attraction_ = nullptr;
  ContactSurface surface_;            ///< of the parts, without solids
  std::vector<long> versions_;        ///< of the parts' surfaces
  std::vector<int> object_;           ///< of the surface, per part; -1: the part has none
  std::vector<BarrierLaw> barrier_;   ///< per part
  bool surface_changes_ = false, keeps_barriers_ = false;
  StepPlan plan_;
  double duration_ = 0.0, gap_ = 0.0;
  bool conserving_ = false;                        ///< the present step may not add to the energy
  double most_energy_ = 0.0;                       ///< of a step that conserves [J]
  std::size_t failed_ = 0;                         ///< part that the last failure is about
  std::vector<std::pair<double, Part*>> folded_;   ///< parts with a fold, see Part::sharpestFold()
};

}   // namespace slender
