#pragma once

#include "cloth_cases.h"

namespace slender::study {

/// Load of a plate in cylindrical bending with the H/W of a strip half as wide as long, nu = -1/3, whose sides give way
/// (cantilever_strip_poisson.csv).
constexpr double kNarrowStrip = 1.0485;

/// A strip of length 1 and about the given width, D = 1, clamped in the middle of its first cells, under gravity until
/// it stands still. Returns H/W at mid-width; NaN if a step was refused.
double cantileverStrip(GridPattern pattern, BendingModel bending, double gamma, double stiffness, double width,
                       int cells, double& seconds);

}   // namespace slender::study
