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

/// Whether the pieces touch at a time in [from, to]. The interval is divided until, in each part, either a fixed
/// direction separates all corners at both ends by more than the rounding errors of long doubles, or the pieces touch.
/// A direction that separates at both ends separates in between, because offsets are linear in time. The result is
/// undecided if the pieces are nearer than rounding errors (1e-15 of the extent), or after 2^40 divisions.
Contact referenceContact(const MovingPair& pair, double from, double to);

/// The usual test: roots of the cubic of coplanarity in doubles, then the distance there against a tolerance (1e-6 of
/// the extent). Returns whether it reports a collision.
bool cubicContact(const MovingPair& pair);

/// Part one of the study cloth_collision_safety: `count` pairs of both kinds, random and degenerate.
void runCollisionPairs(StudyContext& context, int count);

}   // namespace slender::study
