#include <algorithm>

#include "read_parts.h"
#include "slender_sim/dynamics/integrator.h"

namespace slender {

TimeConfig readTime(const YamlCursor& at)
{
  TimeConfig time;
  YamlMap map(at);
  map.get("step", time.step, Range::above(0, 10, "s"), "Length of a time step. Without the key: 0.005 s.");
  map.get("duration", time.duration, Range::above(0, 1e7, "s"),
          "Simulated time after which `simulate` ends; nodes run on. Without the key: 10 s.");
  map.get("integrator", time.integrator, allUpTo(Integrator::imex),
          "Method by which time steps are taken. Without the key: tr_bdf2; implicit_euler in scenes with cloth, with "
          "contact of rods or bodies, and with rods that have `track`. Threads always take implicit_euler; imex is for "
          "cloth alone, and symplectic_euler takes explicit steps. Rods and bodies with contact cannot take "
          "symplectic_euler, implicit_midpoint and generalized_alpha.");
  map.get("spectral_radius", time.spectral_radius, Range::closed(0, 1),
          "Numerical damping of generalized_alpha: the factor by which one step changes the fastest vibrations. 1 "
          "damps nothing, 0 damps most. Without the key: 0.8.");
  const YamlCursor error_tolerance =
      map.get("error_tolerance", time.error_tolerance, Range::closed(0, 1, "m"),
              "Largest error of a position that one step may make; `time.step` is then the longest step, and shorter "
              "ones are taken where they are needed. Without the key, or with 0, steps have a fixed length.");
  if (time.error_tolerance > 0 && isExplicit(time.integrator))
    error_tolerance.problem("is for implicit integrators; steps of symplectic_euler and imex are of fixed length");
  const YamlCursor min_step = map.get("min_step", time.min_step, Range::above(0, 10, "s"),
                                      "Shortest step to which the error control and halving may go. Without the key: "
                                      "1e-7 s, or `time.step` if that is shorter.");
  if (min_step.present() && time.min_step > time.step)
    min_step.problem("is longer than time.step; must be in (0, " + shortNumber(time.step) + "] s");
  time.min_step = std::min(time.min_step, time.step);
  YamlMap newton(map.get("newton", "Settings of the solver of implicit steps (Newton's method)."));
  newton.get("tolerance", time.newton.tolerance, Range::between(1e-14, 1e-1),
             "A step is solved when the change of the positions that is left is smaller than this fraction of the "
             "shortest edge. Without the key: 1e-6.");
  newton.get("max_iterations", time.newton.max_iterations, Range::closed(1, 1000),
             "Number of Newton iterations after which a step counts as failed. Without the key: 30.");
  newton.get("max_cuts", time.newton.max_cuts, Range::closed(0, 30),
             "How often a step that fails is halved before it is refused. Without the key: 10.");
  newton.get("linear", time.island_solver, {{"auto", IslandSolver::automatic}, {"cholesky", IslandSolver::cholesky}},
             "Solver of the linear equations of objects that touch or are joined. Without the key, or with auto, cloth "
             "is solved by sweeps over its vertices, also beside bodies, and everything else by factorisation.");
  return time;
}

}   // namespace slender
