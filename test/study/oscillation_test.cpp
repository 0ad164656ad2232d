#include <cmath>
#include <stdexcept>
#include <vector>

#include <gtest/gtest.h>

#include "slender_sim/study/oscillation.h"

using namespace slender::study;

namespace {

/// Two signals of different size, offset and phase that share two tones; `beats` long.
std::vector<std::vector<double>> beating(double f1, double f2, double beats, double interval, double decay = 0.0)
{
  std::vector<std::vector<double>> signals(2);
  const int samples = static_cast<int>(beats / (f2 - f1) / interval);
  for (int k = 0; k < samples; ++k)
  {
    const double t = k * interval, a = 2 * M_PI * f1 * t, b = 2 * M_PI * f2 * t, size = std::exp(-decay * t);
    signals[0].push_back(0.3 + size * (std::cos(a) + 0.9 * std::cos(b)));
    signals[1].push_back(-2.0 + 50 * size * (std::cos(a + 0.2) - std::cos(b)));
  }
  return signals;
}

TEST(TwoTones, AreFoundNearEachOtherAndApart)
{
  for (const double f2 : {1.52, 1.61, 1.8})
    for (const double beats : {1.2, 2.2, 5.0})
    {
      const TwoTones tones = fitTwoTones(beating(1.5, f2, f2 > 1.7 && beats < 2 ? 2.2 : beats, 0.01), 0.01);
      EXPECT_NEAR(tones.f1, 1.5, 1e-8) << f2 << " " << beats;
      EXPECT_NEAR(tones.f2, f2, 1e-8) << f2 << " " << beats;
      EXPECT_LT(tones.misfit, 1e-8);
    }
}

TEST(TwoTones, LittleDampingMovesThemLittle)
{
  // a twentieth of the amplitude lost per beat
  const TwoTones tones = fitTwoTones(beating(1.5, 1.6, 2.2, 0.01, 0.005), 0.01);
  EXPECT_NEAR(tones.f1, 1.5, 2e-4);
  EXPECT_NEAR(tones.f2, 1.6, 2e-4);
  EXPECT_GT(tones.misfit, 1e-3);
}

TEST(TwoTones, NeedAnOscillation)
{
  EXPECT_THROW(fitTwoTones({std::vector<double>(1000, 1.0)}, 0.01), std::runtime_error);
  EXPECT_THROW(fitTwoTones(beating(1.5, 1.6, 0.15, 0.01), 0.01), std::runtime_error);   // two periods
}

}   // namespace
