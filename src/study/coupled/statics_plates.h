#pragma once

#include "slender_sim/study/study.h"

namespace slender::study {

/// Ratio of distance to length. A state that left its branch is farther away, and one that stayed is within 1e-9.
constexpr double kAwayFromBranch = 1e-5;

/// What all cases of the study of statics came to.
struct StaticsTally
{
  int cases = 0, wrong = 0, called_stable = 0, refused = 0, unstable_ends = 0;
  double worst_residual = 0;
};

/// Plates that start exactly flat, below and above the loads at which they buckle: a cantilevered one that stands
/// upright, and one that is compressed in its plane. Thresholds of the meshes are checked against plate theory.
void addPlates(StudyContext& context, StaticsTally& tally);

}   // namespace slender::study
