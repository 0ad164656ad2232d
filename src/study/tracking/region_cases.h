#pragma once

#include <vector>

#include <Eigen/Core>

#include "slender_sim/study/study.h"

namespace slender::study {

/// A hue for each face, so that regions beside each other differ wherever kHues are enough.
Eigen::VectorXi huesOf(const Eigen::Matrix3Xi& triangles, const std::vector<int>& region_of_face);

}   // namespace slender::study
