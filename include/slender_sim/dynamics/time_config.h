#pragma once

namespace slender {

enum class Integrator
{
  implicit_euler,
  bdf2,
  tr_bdf2,
  implicit_midpoint,
  generalized_alpha,
  symplectic_euler,
  imex
};

const char* toString(Integrator integrator);

struct NewtonConfig
{
  double tolerance = 1e-6;   ///< largest error of a solution, as a fraction of the shortest edge (1e-14, 1e-1)
  int max_iterations = 30;   ///< [1, 1000]
  int max_cuts = 10;         ///< how often a failing step is halved [0, 30]
  bool one_step = false;     ///< takes one full step of Newton's method, whose end is not in balance
  bool balances = true;      ///< A few more iterations follow if forces are far from balance.
};

/// How the linear equations of an island of several parts are solved.
enum class IslandSolver
{
  automatic,   ///< by sweeps where they pay, which are for cloth of many vertices, else by Cholesky factorisation
  cholesky
};

struct TimeConfig
{
  double step = 0.005;      ///< [s] (0, 10]
  double duration = 10.0;   ///< [s] (0, 1e7]; used by `simulate`
  Integrator integrator = Integrator::tr_bdf2;
  double spectral_radius = 0.8;   ///< generalised-alpha only: at infinite frequency [0, 1]
  double error_tolerance = 0.0;   ///< [m] local error per step; 0 = fixed step
  double min_step = 1e-7;         ///< [s] adaptive or cut steps never get shorter
  NewtonConfig newton;
  IslandSolver island_solver = IslandSolver::automatic;
};

}   // namespace slender
