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
  /// A straight edge that is to take the place of the edges first to last.
  struct Edge
  {
    int first, last;
    Eigen::Vector3d from, to;
    double radius;   ///< [m]
  };
  /// How much distance an edge needs, as shares of the thickness: from other threads and rods, and from solids and
  /// faces of cloths.
  struct Room
  {
    double others, solids;
  };
  /// Whether there is room for an edge: it leaves these shares of the thickness between its centreline and what it
  /// touches, or as much as the edges whose place it takes.
  virtual bool hasRoom(const ThreadState& state, const Edge& edge, const Room& room) const = 0;
};

/// The share of the thickness that a change of shape leaves to solids, and with a fold to all else. Contact presses
/// apart what overlaps. The centreline must stay outside.
constexpr double kFirmShare = 0.6;

/// Divides edge j where `fraction` of its length lies on the older side (thesis 5.4.4): the new node by a cubic through
/// the four nodes around it (the direction of a held end takes the place of a missing one), the ratio of the radii by a
/// quadratic through those of three edges. Volume, mass and momentum are conserved.
void splitEdge(ThreadState& state, int j, double fraction);
/// Where that node would lie; and the same with the node at a given place.
Eigen::Vector3d splitPoint(const ThreadState& state, int j, double fraction);
void splitEdge(ThreadState& state, int j, double fraction, const Eigen::Vector3d& x);

/// Joins edges i-1 and i by taking node i away (0 < i < nodes - 1). Volume, mass and momentum are conserved.
void removeNode(ThreadState& state, int i);

/// Takes an end node away (0: the oldest, 1: the newest), which must be free. The fluid of its edge comes to the next
/// edge. Volume, mass and momentum are conserved. At least three nodes must be there.
void removeEnd(ThreadState& state, int end);

/// Lets fluid flow from edge j into its neighbours, as far as they are thinner: from a joined edge that is short and
/// wide. Edges between deposited nodes take none. Volume, mass and momentum are conserved.
void spreadFluid(ThreadState& state, int j);

/// Takes out the fold at an inner node. A node there, or a free end beside it, is removed, because the fluid on both
/// sides has flowed together. If several removals take out the fold, the one that leaves the thinnest edge is chosen.
/// Where a free edge folds back on one that lies on the floor, the node is held there as it is. Returns false if
/// nothing can be done, or if the guard (may be null) forbids it.
bool mendFold(ThreadState& state, int node, const RemeshGuard* guard = nullptr);
/// Where a node lies after its removal: on the joined edge, which its two edges become. Whether a guard (may be null)
/// allows it.
bool mayRemove(const ThreadState& state, int i, const RemeshGuard* guard);
/// Whether the edges at inner node i may become one for the sake of their length: whether there is room for the joined
/// edge, whose radius is that of both volumes.
bool mayJoin(const ThreadState& state, int i, const RemeshGuard* guard);

/// Breaks the thread at its thinnest free edge if that is thinner than `min_radius` [m] (thesis 5.4.4): `state` keeps
/// the newer part, `older` becomes the other. The fluid of the edge goes to its neighbours, half to either side, with
/// its momentum. The edges at the ends do not break. Returns false if no edge is so thin.
bool breakThread(ThreadState& state, double min_radius, ThreadState& older);

/// Takes the `count` oldest nodes and the edges after them away. Their volume is added to `account`,
/// state.dropped_volume or state.left_volume. At least two nodes stay.
void dropOldest(ThreadState& state, int count, double& account);

}   // namespace slender
