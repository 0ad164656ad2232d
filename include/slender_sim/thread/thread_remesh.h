#pragma once

#include "slender_sim/thread/thread_state.h"

namespace slender {

/// Divides edge j where `fraction` of its length lies on the older side (thesis 5.4.4): the new node by a cubic through the four nodes
/// around it (the direction of a held end takes the place of a missing one), the ratio of the radii by a quadratic through those of
/// three edges. Volume, mass and momentum are conserved.
void splitEdge(ThreadState& state, int j, double fraction);

/// Joins edges i-1 and i by taking node i away (0 < i < nodes - 1). Volume, mass and momentum are conserved.
void removeNode(ThreadState& state, int i);

/// Takes out the fold at an inner node: removes it (the fluid on both sides has flowed together), or where a free edge folds back on one
/// that lies on the floor, holds it there as it is. No: nothing can be done.
bool mendFold(ThreadState& state, int node);

/// Breaks the thread at its thinnest free edge if that is thinner than `min_radius` [m] (thesis 5.4.4): `state` keeps the newer part, `older`
/// becomes the other. The fluid of the edge goes to its neighbours, half to either side, with its momentum. The edges at the ends do not
/// break. No: nothing is so thin.
bool breakThread(ThreadState& state, double min_radius, ThreadState& older);

/// Takes the `count` oldest nodes and the edges after them away; their volume goes to dropped_volume. At least two nodes stay.
void dropOldest(ThreadState& state, int count);

}  // namespace slender
