#pragma once

#include <vector>

#include "thread_cases.h"

namespace slender::study {

/// Thread whose steady coils are known: thesis 5.5, in its units, without surface tension.
struct CoilFluid
{
  /// of the nozzle, and of the fluid in it
  static constexpr double density = 5e-4, viscosity = 0.2, gravity = 9.81, diameter = 0.09, speed = 0.615;
};

/// A steady coil on a still floor.
struct SteadyCoil
{
  double height;              ///< of the nozzle above the centreline of what lies on the floor
  int branch;                 ///< of solutions, continued in the height
  double frequency, radius;   ///< [rad/s], [length]
  bool stable;                ///< against small disturbances
};

/// coiling_grid.csv: steady coils in the rotating frame [Ribe 2004], with their linear stability; heights ascend.
const std::vector<SteadyCoil>& steadyCoils();

/// The stable coil at this height whose frequency is nearest; nullptr: there is none.
const SteadyCoil* nearestStableCoil(double height, double frequency);

/// A coil as its landing points show it, in polar coordinates about the nozzle's axis, which is that of z.
class CoilTrace
{
public:
  explicit CoilTrace(const Landings& landings);

  /// Slope of the angle by least squares [rad/s], 0 for fewer than three points.
  double frequency() const;
  double radius() const;   ///< mean, 0 without points
  /// Standard deviation of the radius over its mean: zero for a circle about the nozzle's axis.
  double unsteadiness() const;
  double turns() const;
  double perTurn() const;   ///< landing points

private:
  std::vector<double> times_, angles_, radii_;
};

}   // namespace slender::study
