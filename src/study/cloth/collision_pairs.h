#pragma once

#include "slender_sim/contact/ccd.h"
#include "slender_sim/study/study.h"

namespace slender::study {

/// A vertex against a triangle (points 1, 2, 3), or two edges (0, 1 and 2, 3), along straight lines.
struct MovingPair
{
  MovingPoint point[4];
  bool edges;
};

enum class Contact
{
  none,
  some,
  undecided
};

/// Whether the pieces touch at a time in [from, to]. Times are divided until over a piece of time a fixed direction
/// separates all corners at both ends, hence between them (their offsets are linear in time), by more than the rounding
/// of long doubles; or the pieces are seen to touch. Undecided: closer than rounding (1e-15 of the extent) lets see, or
/// not decided after 2^40.
Contact referenceContact(const MovingPair& pair, double from, double to);

/// The usual test: roots of the cubic of coplanarity in doubles, then the distance there against a tolerance (1e-6 of
/// the extent). Returns whether it reports a collision.
bool cubicContact(const MovingPair& pair);

/// Part one of the study cloth_collision_safety: `count` pairs of both kinds, random and degenerate.
void runCollisionPairs(StudyContext& context, int count);

}   // namespace slender::study
