#pragma once

#include <vector>

namespace slender::study {

/// Two frequencies that signals share.
struct TwoTones
{
  double f1, f2;   ///< [Hz], f1 < f2
  double misfit;   ///< what the fit leaves, over the signals' own spread [-]
};

/// Fits every signal by a constant and two undamped sinusoids whose frequencies all share (least squares, each signal
/// scaled by its spread). Samples `interval` [s] apart, over four periods or more, at most ten beats. Throws
/// std::runtime_error for fewer periods, or a signal that is constant.
TwoTones fitTwoTones(const std::vector<std::vector<double>>& signals, double interval);

}   // namespace slender::study
