#include "coil_cases.h"

#include <algorithm>
#include <cmath>

namespace slender::study {

namespace {

double mean(const std::vector<double>& v)
{
  double sum = 0.0;
  for (const double x : v)
    sum += x;
  return sum / static_cast<double>(v.size());
}

}   // namespace

const std::vector<SteadyCoil>& steadyCoils()
{
  static const std::vector<SteadyCoil> coils = {
      {0.507201, 1, 4.4687, 0.122618, true},  {0.634002, 1, 3.70373, 0.154652, true},
      {0.760802, 1, 3.15657, 0.185737, true}, {1.0144, 1, 2.46022, 0.243917, true},
      {1.268, 1, 2.06063, 0.294633, true},    {1.5216, 1, 1.81762, 0.336554, true},
      {2.02881, 1, 1.56845, 0.394542, true},  {2.53601, 1, 1.48099, 0.422962, true},
      {3.04321, 1, 1.45244, 0.438006, true},  {3.80401, 1, 1.40789, 0.464735, true},
      {5.07201, 1, 1.33828, 0.518066, true},  {6.34002, 1, 1.27864, 0.580908, true},
      {7.60802, 1, 1.22327, 0.655217, true},  {8.87602, 1, 1.17056, 0.741917, true},
      {8.87602, 2, 1.58332, 0.523988, false}, {8.87602, 3, 2.17242, 0.391109, false},
      {10.144, 1, 1.12071, 0.841106, true},   {10.144, 2, 1.36547, 0.658683, false},
      {10.144, 3, 2.21377, 0.419419, true},   {11.412, 1, 1.07457, 0.951969, true},
      {11.412, 2, 1.22319, 0.802343, false},  {11.412, 3, 2.19268, 0.461707, true},
      {12.68, 1, 1.03395, 1.07127, true},     {12.68, 2, 1.1125, 0.966766, false},
      {12.68, 3, 2.14709, 0.513016, true},    {13.4408, 1, 1.01584, 1.13984, true},
      {13.4408, 2, 1.05135, 1.08437, false},  {13.4408, 3, 2.11474, 0.547196, true},
      {14.2016, 3, 2.08222, 0.583099, true},  {14.2016, 4, 2.62635, 0.452274, false},
      {14.2016, 5, 2.80935, 0.425179, false}, {15.216, 3, 2.04708, 0.630478, true},
      {15.216, 4, 2.28625, 0.553847, false},  {15.216, 5, 2.91952, 0.439561, false},
      {15.7232, 3, 2.04718, 0.648086, true},  {15.7232, 4, 2.15389, 0.609701, false},
      {15.7232, 5, 2.92266, 0.453934, false}, {16.484, 5, 2.91164, 0.478118, false},
      {17.752, 5, 2.88916, 0.519696, false},  {19.02, 7, 3.58178, 0.450486, false},
      {20.2881, 7, 3.62038, 0.479742, false}, {21.5561, 7, 4.19514, 0.443383, true},
      {22.8241, 7, 4.32729, 0.460894, true},  {25.3601, 7, 5.18498, 0.438022, true},
      {27.8961, 7, 6.16143, 0.417628, true},  {30.4321, 7, 7.20815, 0.401075, true},
      {34.2361, 7, 9.05614, 0.375635, true},  {38.0401, 7, 11.2567, 0.35079, true},
      {44.3801, 7, 15.7612, 0.312942, true},  {50.7201, 7, 21.3624, 0.280522, true}};
  return coils;
}

const SteadyCoil* nearestStableCoil(double height, double frequency)
{
  const SteadyCoil* best = nullptr;
  for (const SteadyCoil& c : steadyCoils())
    if (c.stable && std::abs(c.height / height - 1) < 1e-4 &&
        (!best || std::abs(c.frequency - frequency) < std::abs(best->frequency - frequency)))
      best = &c;
  return best;
}

CoilTrace::CoilTrace(const Landings& landings)
{
  for (const Landings::Point& p : landings.points())
  {
    const double angle = std::atan2(p.y, p.x);
    angles_.push_back(angles_.empty() ? angle
                                      : angle + 2 * M_PI * std::nearbyint((angles_.back() - angle) / (2 * M_PI)));
    times_.push_back(p.time);
    radii_.push_back(std::hypot(p.x, p.y));
  }
}

double CoilTrace::frequency() const
{
  if (times_.size() < 3)
    return 0.0;
  const double t = mean(times_), a = mean(angles_);
  double ta = 0, tt = 0;
  for (std::size_t k = 0; k < times_.size(); ++k)
  {
    ta += (times_[k] - t) * (angles_[k] - a);
    tt += (times_[k] - t) * (times_[k] - t);
  }
  return std::abs(ta / tt);
}

double CoilTrace::radius() const { return radii_.empty() ? 0.0 : mean(radii_); }

double CoilTrace::unsteadiness() const
{
  if (radii_.empty())
    return 0.0;
  const double r = radius();
  double sum = 0.0;
  for (const double each : radii_)
    sum += (each - r) * (each - r);
  return std::sqrt(sum / static_cast<double>(radii_.size())) / r;
}

double CoilTrace::turns() const
{
  return angles_.empty() ? 0.0 : std::abs(angles_.back() - angles_.front()) / (2 * M_PI);
}

double CoilTrace::perTurn() const { return angles_.empty() ? 0.0 : static_cast<double>(angles_.size() - 1) / turns(); }

}   // namespace slender::study
