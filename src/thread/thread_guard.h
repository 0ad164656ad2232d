#pragma once

#include <vector>

#include "slender_sim/contact/contact_properties.h"
#include "island/equations.h"
#include "slender_sim/thread/thread_remesh.h"

namespace slender {

/// Keeps threads from passing through what they touch when their meshes change.
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
  void setStrands(const std::vector<Strand>& strands) { strands_ = strands; }
  /// Sets the equations of the island. Their contact has the surfaces of everything but the strands. Meshes change
  /// after the solution of a substep, so that these surfaces are taken where the substep ends.
  void setIsland(const Equations* equations) { equations_ = equations; }

  bool allows(const ThreadState& state, int first, int last, const Eigen::Vector3d& from,
              const Eigen::Vector3d& to) const override;
  bool hasRoom(const ThreadState& state, const Edge& edge, const Room& room) const override;

private:
  const Strand* strandOf(const ThreadState& state) const;
  /// Calls f(p, q, radius, core) for every segment that the edges first to last of `state` may touch; `core` is the
  /// share of both radii that may not be entered. Stops and returns false when f does.
  template <class F>
  bool forOthers(const ThreadState& state, int first, int last, F&& f) const;
  template <class F>
  bool forRods(F&& f) const;
  /// Calls f(piece, pose, reach, thickness) for every triangle of a cloth, and every convex piece of a solid, that a
  /// strand may touch; `reach`: of the piece around the pose's origin [m]. Stops and returns false when f does.
  template <class F>
  bool forFaces(const ContactProperties& own, F&& f) const;
  template <class F>
  bool forSolids(F&& f) const;

  double gap_;
  std::vector<Strand> strands_;
  const Equations* equations_ = nullptr;
};

}   // namespace slender
