#pragma once

#include <string>

#include "slender_sim/scene/config.h"

namespace slender {

/// Returns a text about the largest unbalanced force of a run, for summaries: "3e-09 of the largest force". With
/// `one_newton_step` the text adds that forces are not balanced by design, because a value near one is then no failure.
std::string residualText(const SceneConfig& scene, double residual);

}   // namespace slender
