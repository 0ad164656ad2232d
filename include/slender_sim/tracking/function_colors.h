#pragma once

#include "slender_sim/tracking/test_functions.h"

namespace slender {

/// Colours (3 x vertices: red, green, blue in [0, 1]) that show test functions by their values at the vertices: one
/// colour per function, mixed where they overlap; light grey where there is none.
Eigen::Matrix3Xd functionColors(const TestFunctions::Values& values);

}   // namespace slender
