#include "cloth_linear_solver.h"

namespace slender {

namespace {

constexpr int kFactorWork = 60;   // of a WorkBudget, per vertex; an iteration of conjugate gradients: 1
constexpr double kBesideLoad = 1e-2;

}   // namespace

ClothSolver solverOf(const ClothOptions& options)
{
  return options.solver == ClothSolver::automatic ? ClothSolver::gauss_seidel : options.solver;
}

ClothLinearSolver::ClothLinearSolver(const ClothModel& model, const ClothOptions& options, ClothSystem& system)
  : ClothLinearSolver(options, system)
{
  if (kind_ == ClothSolver::cholesky)
    factor_.setPattern(system.matrix());
  else if (kind_ == ClothSolver::gauss_seidel)
    sweeps_.setPattern(system.matrix(), system.constantMatrix());
  else
    usePreconditioner(model);
}

ClothLinearSolver::ClothLinearSolver(const ClothOptions& options, ClothSystem& system)
  : system_(system),
    linear_tolerance_(options.linear_tolerance),
    kind_(solverOf(options))
{
  for (PointVector* v : {&right_, &product_, &correction_})
    v->assign(4 * static_cast<std::size_t>(points()), 0.0);
}

void ClothLinearSolver::usePreconditioner(const ClothModel& model)
{
  preconditioner_ = std::make_unique<ClothPreconditioner>(model, system_.terms(), system_.matrix());
  cg_.resize(4 * static_cast<std::size_t>(points()));
}

bool ClothLinearSolver::updatePreconditioner()
{
  if (!preconditioner_ || (system_.viscosity() == ratio_ && system_.weights() == weights_ && system_.held() == held_))
    return false;
  weights_ = system_.weights();
  held_ = system_.held();
  ratio_ = system_.viscosity();
  preconditioned_ = preconditioner_->setConstant(weights_, 1.0 + ratio_, held_);
  return true;
}

void ClothLinearSolver::beginStage() { updatePreconditioner(); }

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

LinearOutcome ClothLinearSolver::solve(PointVector& d, const PointVector* at, long& linear_iterations,
                                       long& factorizations, double tolerance)
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
  if (kind_ == ClothSolver::gauss_seidel)
  {
    sweeps_.set(1.0 + system_.viscosity(), held);
    return correct(d, sweeps_.solve(right_, correction_, allowed, iterationsWithin(kMostLinearIterations)), allowed,
                   0.0, linear_iterations);
  }
  if (!preconditioned_)
    return LinearOutcome::not_definite;
  if (at)
    preconditioner_->align(*at, system_.matrix(), held);
  else
    preconditioner_->useConstant();
  const auto apply = [this](const PointVector& p, PointVector& ap) {
    system_.applyMatrix(p, ap);
    clearHeld(ap);
  };
  const LinearResult result = cg_.solve(right_, correction_, allowed, iterationsWithin(kMostLinearIterations), apply,
                                        [&](PointVector& r, PointVector& z) { preconditioner_->apply(r, z); });
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
