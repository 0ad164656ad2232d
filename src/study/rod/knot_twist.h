#pragma once

#include "slender_sim/study/study.h"

namespace slender::study {

/// The part of study knot that turns a clamped trefoil knot until it jumps, both ways.
void twistKnot(StudyContext& context);

}   // namespace slender::study
