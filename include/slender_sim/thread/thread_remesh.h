#pragma once

#include "slender_sim/thread/thread_state.h"

namespace slender {

/// Says whether a thread may change its shape: whether the edges at an inner node may sweep over what lies between
/// `from` and `to` [m]. `first` and `last` are the edges that move with it.
class RemeshGuard
{
public:
  virtual ~RemeshGuard() = default;
  virtual bool allows(const ThreadState& state, int first, int last, const Eigen::Vector3d& from,
                      const Eigen::Vector3d& to) const = 0;
  /// Whether the edges at inner node i may become one for the sake of their length: the joined edge, whose radius is
  /// that of both volumes, does not come nearer to others than it may while the two edges are farther from them.
  virtual bool mayJoin(const ThreadState& state, int i) const = 0;
};

/// Divides edge j where `fraction` of its length lies on the older side (thesis 5.4.4): the new node by a cubic through
/// the four nodes around it (the direction of a held end takes the place of a missing one), the ratio of the radii by a
/// quadratic through those of three edges. Volume, mass and momentum are conserved.
void splitEdge(ThreadState& state, int j, double fraction);
/// Where that node would lie; and the same with the node at a given place.
Eigen::Vector3d splitPoint(const ThreadState& state, int j, double fraction);
void splitEdge(ThreadState& state, int j, double fraction, const Eigen::Vector3d& x);

/// Joins edges i-1 and i by taking node i away (0 < i < nodes - 1). Volume, mass and momentum are conserved.
void removeNode(ThreadState& state, int i);

/// Takes out the fold at an inner node. The node is removed, because the fluid on both sides has flowed together. Where
/// a free edge folds back on one that lies on the floor, the node is held there as it is. Returns false if nothing can
/// be done, or if the guard (may be null) forbids it.
bool mendFold(ThreadState& state, int node, const RemeshGuard* guard = nullptr);
/// Where a node lies after its removal: on the joined edge, which its two edges become. Whether a guard (may be null)
/// allows it.
bool mayRemove(const ThreadState& state, int i, const RemeshGuard* guard);

/// Breaks the thread at its thinnest free edge if that is thinner than `min_radius` [m] (thesis 5.4.4): `state` keeps
/// the newer part, `older` becomes the other. The fluid of the edge goes to its neighbours, half to either side, with
/// its momentum. The edges at the ends do not break. Returns false if no edge is so thin.
bool breakThread(ThreadState& state, double min_radius, ThreadState& older);

/// Takes the `count` oldest nodes and the edges after them away. Their volume is added to `account`,
/// state.dropped_volume or state.left_volume. At least two nodes stay.
void dropOldest(ThreadState& state, int count, double& account);

}   // namespace slender
