#pragma once

#include <limits>

namespace slender::test {

constexpr double kNan = std::numeric_limits<double>::quiet_NaN(), kInfinity = std::numeric_limits<double>::infinity();

}   // namespace slender::test
