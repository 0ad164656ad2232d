#pragma once

#include <string>
#include <vector>

#include "thread_cases.h"

namespace slender::study {

/// What the trace of a thread's landing points on a moving belt shows. Frequencies count crossings of the middle,
/// across (y) and along (x).
struct BeltTrace
{
  double amplitude = 0;                      ///< half the extent across [m]
  double frequency_y = 0, frequency_x = 0;   ///< [rad/s]
  /// of the tangent of what lies on the belt: net turns, and extent [turns]
  double windings = 0, swing = 0;
  std::string pattern;   ///< none, straight, meanders, alternating loops, translated coiling, W or mixed
};

/// Of landing points in time, on a belt that moves along x with `belt` [m/s]. A trace less than `straight_below` [m] to
/// either side is straight.
BeltTrace classifyBeltTrace(const std::vector<Landings::Point>& points, double belt, double straight_below);

}   // namespace slender::study
