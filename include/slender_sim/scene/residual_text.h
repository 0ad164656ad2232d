#pragma once

#include <string>

#include "slender_sim/scene/config.h"

namespace slender {

/// The largest unbalanced force of a run in words, for summaries: "3e-09 of the largest force". With `one_newton_step`
/// the text adds that the forces of a step are not balanced by design, because a value near one is no failure then.
std::string residualText(const SceneConfig& scene, double residual);

}   // namespace slender
