#include "slender_sim/thread/thread_flow.h"

#include <algorithm>
#include <cmath>
#include <limits>

namespace slender {

namespace {

/// What resolves a fall and its coil.
struct Resolution
{
  double per_turn;     ///< edges per turn of the coil
  double over_fall;    ///< smallest number of edges over the fall
  double step_angle;   ///< [rad] turn of the coil per step
};

// The frequencies and radii of study `thread_defaults` then err by at most 2.1 %, mostly by the steps.
constexpr Resolution kUsual = {20.0, 25.0, 0.06};
// The reference coil at a height of 15.72, 1 % below a fold, then errs by 1.1 %. It is lost with edges of 0.7, and with
// steps of 0.35 of the usual length.
constexpr Resolution kSeveralCoils = {40.0, 50.0, 0.012};
// smallest ratio of the frequency of gravitational coiling to sqrt(g / H) with several coils, see estimateLanding()
constexpr double kLowestPendulum = 1.5;

double areaOf(double diameter) { return 0.25 * M_PI * diameter * diameter; }

/// Logarithm of the speed at the nozzle for a speed `landing` at the floor, by integration from the floor upwards,
/// where the equation is stable: with u = log U and p = u' it is p' = (exp(u) p - g exp(-u)) / (3 nu). Returns
/// -infinity when the speed would fall below `least` on the way.
double logSpeedAtNozzle(const ThreadFall& fall, double landing, double least)
{
  constexpr int kSteps = 400;
  const double nu3 = 3.0 * fall.viscosity / fall.density, ds = fall.height / kSteps, bound = std::log(least);
  double u = std::log(landing), p = 0.0;
  for (int k = 0; k < kSteps; ++k)
  {
    const double rate = std::exp(u) / nu3, balance = fall.gravity * std::exp(-2.0 * u), gone = -std::expm1(-rate * ds);
    u -= balance * ds + (p - balance) * gone / rate;
    p += (balance - p) * gone;
    if (!(u > bound - 1e-9) && k + 1 < kSteps)
      return -std::numeric_limits<double>::infinity();
  }
  return u;
}

double speedAtFloor(const ThreadFall& fall, double start)
{
  double low = start, high = std::sqrt(start * start + 2.0 * fall.gravity * fall.height);
  for (int k = 0; k < 60 && high > low * (1.0 + 1e-9); ++k)
  {
    const double middle = std::sqrt(low * high);
    (logSpeedAtNozzle(fall, middle, start) > std::log(start) ? high : low) = middle;
  }
  return low;
}

}   // namespace

Landing estimateLanding(const ThreadFall& fall)
{
  constexpr double kViscous = 0.24, kGravitational = 0.4, kInertial = 0.22;   // fitted to stable coils, see the header
  Landing landing;
  landing.speed = speedAtFloor(fall, fall.flow / areaOf(fall.diameter));
  landing.radius = std::sqrt(fall.flow / (M_PI * landing.speed));
  const double nu = fall.viscosity / fall.density, q = fall.flow, a = landing.radius;
  const double gravitational = kGravitational * std::pow(fall.gravity * q * q * q / nu, 0.25) / (a * a);
  const double inertial = kInertial * std::cbrt(q * q * q * q / (nu * a)) / (a * a * a);
  const double viscous = landing.speed / (kViscous * fall.height);
  landing.frequency = std::sqrt(viscous * viscous + gravitational * gravitational + inertial * inertial);
  landing.coil_radius = landing.speed / landing.frequency;
  landing.several_coils =
      gravitational > std::max(viscous, inertial) &&
      gravitational * gravitational * fall.height > kLowestPendulum * kLowestPendulum * fall.gravity;
  return landing;
}

double leastJettingSpeed(const ThreadFall& fall, double surface_tension)
{
  if (fall.viscosity > std::sqrt(0.5 * fall.density * surface_tension * fall.diameter))
    return 0.0;
  constexpr double kWater = 0.37;   // for water in air, by the authors
  const double bond = 0.5 * fall.density * fall.gravity * fall.diameter * fall.diameter / surface_tension,
               x = 1.0 + kWater * bond;
  const double y = x - std::sqrt(x * x - 1.0);
  return 2.0 * y * std::sqrt(surface_tension / (fall.density * fall.diameter));
}

EdgeChoice chooseEdges(const ThreadFall& fall, const Landing& landing)
{
  const Resolution& resolution = landing.several_coils ? kSeveralCoils : kUsual;
  EdgeChoice edges;
  edges.highest = fall.height / resolution.over_fall;
  edges.longest = 2.0 * M_PI * landing.coil_radius / resolution.per_turn;
  edges.longest_step = resolution.step_angle / landing.frequency;
  if (!landing.slender())
  {
    edges.longest = 0.5 * fall.diameter;
    edges.longest_step = std::numeric_limits<double>::infinity();
  }
  edges.longest = std::min(edges.longest, edges.highest);
  edges.feed = edges.highest;
  edges.shortest = 0.2 * edges.longest;
  return edges;
}

double edgesPerTurn(const Landing& landing, double edge_length)
{
  return 2.0 * M_PI * landing.coil_radius / edge_length;
}

}   // namespace slender
