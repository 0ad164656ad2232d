#pragma once

#include <vector>

#include "slender_sim/contact/contact_properties.h"
#include "slender_sim/dynamics/chain_system.h"
#include "slender_sim/thread/thread_remesh.h"

namespace slender {

/// Keeps the changes of shape of threads that touch each other and rods from passing through what they touch.
class ThreadGuard : public RemeshGuard
{
public:
  /// `gap`: at which surfaces repel [m].
  explicit ThreadGuard(double gap) : gap_(gap) {}

  /// A thread, or a part that broke off it.
  struct Strand
  {
    const ThreadState* state;
    ContactProperties contact;
    double merging;   ///< as WorldModel::Thread::merging
  };
  /// A rod that threads touch, at its trial configuration.
  struct Tube
  {
    const ChainSystem* chain;
    Eigen::VectorXd radius;   ///< per edge [m]
  };
  void setStrands(const std::vector<Strand>& strands) { strands_ = strands; }
  void setTubes(std::vector<Tube> tubes) { tubes_ = std::move(tubes); }

  bool allows(const ThreadState& state, int first, int last, const Eigen::Vector3d& from,
              const Eigen::Vector3d& to) const override;
  bool mayJoin(const ThreadState& state, int i) const override;

private:
  /// Calls f(p, q, radius, core) for every segment that the edges first to last of `state` may touch; `core` is the
  /// share of both radii that may not be entered. Stops and returns false when f does.
  template <class F>
  bool forOthers(const ThreadState& state, int first, int last, F&& f) const;
  template <class F>
  bool forTubes(F&& f) const;

  double gap_;
  std::vector<Strand> strands_;
  std::vector<Tube> tubes_;
};

}   // namespace slender
