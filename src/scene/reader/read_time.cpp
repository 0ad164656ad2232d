#include <algorithm>

#include "read_parts.h"

namespace slender {

TimeConfig readTime(const YamlCursor& at)
{
  TimeConfig time;
  YamlMap map(at);
  assign(time.step, map.get("step").number(Range::above(0, 10, "s")));
  assign(time.duration, map.get("duration").number(Range::above(0, 1e7, "s")));
  assign(time.integrator, map.get("integrator")
                              .choice<Integrator>({{"implicit_euler", Integrator::implicit_euler},
                                                   {"bdf2", Integrator::bdf2},
                                                   {"tr_bdf2", Integrator::tr_bdf2},
                                                   {"implicit_midpoint", Integrator::implicit_midpoint},
                                                   {"generalized_alpha", Integrator::generalized_alpha},
                                                   {"symplectic_euler", Integrator::symplectic_euler},
                                                   {"imex", Integrator::imex}}));
  assign(time.spectral_radius, map.get("spectral_radius").number(Range::closed(0, 1)));
  const YamlCursor error_tolerance = map.get("error_tolerance");
  assign(time.error_tolerance, error_tolerance.number(Range::closed(0, 1, "m")));
  if (time.error_tolerance > 0 &&
      (time.integrator == Integrator::symplectic_euler || time.integrator == Integrator::imex))
    error_tolerance.problem("is for implicit integrators; steps of symplectic_euler and imex are of fixed length");
  const YamlCursor min_step = map.get("min_step");
  if (const auto value = min_step.number(Range::above(0, 10, "s")))
  {
    time.min_step = *value;
    if (*value > time.step)
      min_step.problem("is longer than time.step; must be in (0, " + shortNumber(time.step) + "] s");
  }
  time.min_step = std::min(time.min_step, time.step);
  YamlMap newton(map.get("newton"));
  assign(time.newton.tolerance, newton.get("tolerance").number(Range::between(1e-14, 1e-1)));
  assign(time.newton.max_iterations, newton.get("max_iterations").integer(1, 1000));
  assign(time.newton.max_cuts, newton.get("max_cuts").integer(0, 30));
  assign(time.island_solver,
         newton.get("linear").choice<IslandSolver>({{"auto", IslandSolver::automatic},
                                                    {"cholesky", IslandSolver::cholesky},
                                                    {"conjugate_gradients", IslandSolver::conjugate_gradients}}));
  newton.finish();
  map.finish();
  return time;
}

}   // namespace slender
