#include "cloth_linear_solver.h"

namespace slender {

namespace {

constexpr int kFactorWork = 60;   // of a WorkBudget, per vertex; an iteration of conjugate gradients: 1
constexpr double kBesideLoad = 1e-2;

}   // namespace

ClothLinearSolver::ClothLinearSolver(const ClothOptions& options, ClothSystem& system)
  : ClothLinearSolver(system, options.linear_tolerance)
{
  kind_ = options.solver;
  if (kind_ == ClothSolver::cholesky)
    factor_.setPattern(system.matrix());
  else
    sweeps_.setPattern(system.matrix(), system.constantMatrix());
}

ClothLinearSolver::ClothLinearSolver(ClothSystem& system, double tolerance)
  : system_(system),
    linear_tolerance_(tolerance)
{
  for (PointVector* v : {&right_, &product_, &correction_})
    v->assign(4 * static_cast<std::size_t>(points()), 0.0);
}

bool ClothLinearSolver::factor()
{
  spend(kFactorWork);
  return factor_.factor(system_.matrix(), system_.held().data());
}

void ClothLinearSolver::clearHeld(PointVector& v) const
{
  for (int i = 0; i < points(); ++i)
    if (system_.held()[i])
      point(v, i).setZero();
}

void ClothLinearSolver::setRight(const PointVector& d)
{
  for (std::size_t i = 0; i < right_.size(); ++i)
    right_[i] = -system_.gradient()[i];
  if (std::any_of(d.begin(), d.end(), [](double x) { return x != 0.0; }))
  {
    system_.applyMatrix(d, product_);
    for (std::size_t i = 0; i < right_.size(); ++i)
      right_[i] -= product_[i];
  }
  clearHeld(right_);
}

LinearOutcome ClothLinearSolver::solve(PointVector& d, long& linear_iterations, long& factorizations, double tolerance)
{
  const std::vector<char>& held = system_.held();
  // what is held moves as given, and so does the rest in the first guess; the right-hand side sees that
  for (int i = 0; i < points() && kind_ == ClothSolver::cholesky; ++i)
    if (!held[i])
      point(d, i).setZero();
  setRight(d);
  if (kind_ == ClothSolver::cholesky)
  {
    for (int i = 0; i < points(); ++i)
      if (held[i])
        point(right_, i) = point(d, i);
    ++factorizations;
    if (!factor())
      return LinearOutcome::not_definite;
    factor_.solvePoints(right_.data(), d.data());
    return LinearOutcome::solved;
  }
  const double allowed = tolerance > 0 ? tolerance : linear_tolerance_;
  sweeps_.set(1.0 + system_.viscosity(), held);
  const LinearResult result = sweeps_.solve(right_, correction_, allowed, iterationsWithin(kMostLinearIterations));
  return correct(d, result, allowed, 0.0, linear_iterations);
}

LinearOutcome ClothLinearSolver::correct(PointVector& d, const LinearResult& result, double tolerance, double load,
                                         long& linear_iterations)
{
  linear_iterations += result.iterations;
  spend(result.iterations + 1);
  for (std::size_t i = 0; i < d.size(); ++i)
    d[i] += correction_[i];
  if (!result.definite)
    return LinearOutcome::not_definite;
  // of what is strained so much that little is left beside its load: far less of that than others are asked for
  const bool beside_load = result.residual * result.scale <= kBesideLoad * tolerance * load;
  return result.residual <= tolerance || beside_load ? LinearOutcome::solved : LinearOutcome::not_converged;
}

}   // namespace slender
