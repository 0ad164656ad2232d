#include "cloth_system.h"

#include <algorithm>
#include <cmath>
#include <stdexcept>

#include <Eigen/Geometry>

namespace slender {

namespace {

Eigen::MatrixXi pairsOf(const PointMatrix& matrix)
{
  std::vector<int> pairs;
  for (int i = 0; i < matrix.size(); ++i)
    for (int k = matrix.starts()[i]; k < matrix.starts()[i + 1]; ++k)
      if (matrix.column(k) < i)
        pairs.insert(pairs.end(), {i, matrix.column(k)});
  return Eigen::Map<const Eigen::MatrixXi>(pairs.data(), 2, static_cast<Eigen::Index>(pairs.size() / 2));
}

// of a WorkBudget, per vertex; an iteration of conjugate gradients: 1
constexpr int kEnergyWork = 2, kHessianWork = 8, kFactorWork = 60;
constexpr double kBesideLoad = 1e-2;

ClothSolver chosen(const ClothModel& model, const ClothOptions& options)
{
  if (options.solver != ClothSolver::automatic)
    return options.solver;
  return !model.averages.empty() || model.vertices() > ClothSystem::kMostSwept ? ClothSolver::conjugate_gradients
                                                                               : ClothSolver::gauss_seidel;
}

}   // namespace

double ClothEvaluation::magnitude() const { return std::abs(membrane) + std::abs(bending) + std::abs(potential); }

void ClothEvaluation::count(TermAccount account, const TermSums& sums)
{
  (account == TermAccount::stretching ? membrane : bending) += sums.energy;
  max_strain = std::max(max_strain, sums.max_strain);
}

ClothSystem::ClothSystem(const ClothModel& model, const ClothOptions& options)
  : model_(model),
    choose_(options.solver == ClothSolver::automatic && options.one_newton_step),
    solver_(chosen(model, options)),
    linear_tolerance_(options.linear_tolerance),
    terms_(clothTerms(model)),
    loads_(clothLoads(model))
{
  const int n = points();
  const bool direct = solver_ == ClothSolver::cholesky;
  usePattern(direct);
  if (direct)
    factor_.setPattern(matrix_);
  else if (solver_ == ClothSolver::gauss_seidel)
    sweeps_ = SymmetricSweeps(matrix_, constant_);
  else
  {
    preconditioner_ = std::make_unique<ClothPreconditioner>(model, terms_, matrix_);
    cg_.resize(n);
    average_sets_.resize(model.averages.size());
    for (std::size_t s = 0; s < average_sets_.size(); ++s)
    {
      average_sets_[s].prescribed = &model.averages[s];
      average_sets_[s].solver.setConstraints(*model.averages[s].weights, model.averages[s].bounds.size() > 0);
      average_sets_[s].swept = sweepsSuit(model.averages[s]);
    }
    if (std::any_of(average_sets_.begin(), average_sets_.end(), [](const AverageSet& set) { return set.swept; }))
      sweeps_ = SymmetricSweeps(matrix_, constant_);
    if (!average_sets_.empty())
    {
      if (model.averages[0].bounds.size() > 0)
      {
        bounds_ = std::make_unique<AverageBounds>();
        bounds_->first_guess = bounds_->before = bounds_->image = bounds_->image_before = PointVector(4 * n, 0.0);
      }
      use(average_sets_[0]);
    }
  }
  for (PointVector* v : {&start_, &target_, &force_, &gradient_, &load_gradient_, &product_, &right_, &correction_})
    v->assign(4 * n, 0.0);
  weight_.assign(n, 0.0);
  held_.assign(n, 0);
  if (model.stiffness_damping > 0)
    for (PointVector* v : {&ahead_, &behind_})
      v->assign(4 * n, 0.0);
}

void ClothSystem::usePattern(bool direct)
{
  std::vector<Eigen::MatrixXi> elements;
  for (const ClothTerm& term : terms_)
  {
    elements.push_back(term.energy->elements());
    if (!term.energy->constantMatrix())
      continue;
    if (constant_)
      throw std::logic_error("a cloth can have one term with a constant matrix: add the matrices");
    constant_ = term.energy->constantMatrix();
  }
  constant_in_blocks_ = constant_ && direct;
  if (constant_in_blocks_)
    elements.push_back(pairsOf(*constant_));
  matrix_ = BlockMatrix(points(), elements);
  for (const ClothTerm& term : terms_)
    term.energy->setPattern(matrix_);
  for (const auto& load : loads_)
    load->setPattern(matrix_);
  if (constant_in_blocks_)
    constant_map_ = matrix_.mapOf(*constant_);
}

void ClothSystem::usePlasticState(const ClothState& state)
{
  for (const ClothTerm& term : terms_)
    term.energy->setPlasticState({state.rest_angles, state.stiffening});
}

void ClothSystem::setViscosity(double ratio, const PointVector& x) { setViscosity(ratio, x, nullptr, 0.0, nullptr); }

void ClothSystem::setViscosity(double ratio, const PointVector& x, const PointVector* move, double share,
                               const PointVector* other)
{
  if (ratio == 0.0 && ratio_ == 0.0)
    return;
  if (ratio > 0)
  {
    StrainReference at;
    at.x = &x;
    at.move = move;
    at.ahead = &ahead_;
    at.behind = &behind_;
    at.share = share;
    at.other = other;
    for (std::size_t i = 0; move && i < x.size(); ++i)
    {
      ahead_[i] = x[i] + (*move)[i];
      behind_[i] = x[i] - (*move)[i];
    }
    for (const ClothTerm& term : terms_)
      term.energy->takeStrains(at);
  }
  respond(ratio);
}

void ClothSystem::respond(double ratio)
{
  ratio_ = ratio;
  for (const ClothTerm& term : terms_)
    term.energy->setResponse(ratio);
}

double ClothSystem::elasticEnergy(const PointVector& x)
{
  const double ratio = ratio_;
  respond(0.0);
  double result = 0.0;
  for (const ClothTerm& term : terms_)
    result += term.energy->value(x.data()).energy;
  respond(ratio);
  return result;
}

void ClothSystem::setWeights(double tau, double ratio)
{
  if (tau == base_tau_ && ratio == base_ratio_ && held_ == base_held_)
    return;
  const int n = points();
  for (int i = 0; i < n; ++i)
    weight_[i] = rate(tau) * model_.mass[i];
  matrix_.setZero();
  if (constant_in_blocks_)
    matrix_.add(1.0 + ratio, *constant_, constant_map_);
  for (int i = 0; i < n; ++i)
    for (int k = 0; k < 3; ++k)
      matrix_.values()[9 * matrix_.starts()[i] + 4 * k] += weight_[i];
  base_.assign(matrix_.values(), matrix_.values() + 9 * matrix_.blocks());
  preconditioned_ = !preconditioner_ || preconditioner_->setConstant(weight_, 1.0 + ratio, held_);
  limp_ = !used_ || bendsLittle(ratio);
  for (AverageSet& set : average_sets_)
    set.ready = false;
  base_tau_ = tau;
  base_ratio_ = ratio;
  base_held_ = held_;
}

void ClothSystem::use(AverageSet& set)
{
  used_ = &set;
  averages_ = &set.solver;
  gap_.assign(4 * static_cast<std::size_t>(set.prescribed->count()), 0.0);
  multipliers_ = gap_;
  if (bounds_)
  {
    bounds_->at.clear();
    bounds_->taken = bounds_->pulls = bounds_->wanted = bounds_->bounded = bounds_->response = gap_;
    bounds_->stiffness = bounds_->weights = set.prescribed->bounds;
    bounds_->at.reserve(static_cast<std::size_t>(set.prescribed->count()));
    bounds_->forces.setZero(3, set.prescribed->count());
  }
}

void ClothSystem::useAverages(const ClothState& state)
{
  if (used_ && used_ != &average_sets_[static_cast<std::size_t>(state.average_set)])
    use(average_sets_[static_cast<std::size_t>(state.average_set)]);
}

void ClothSystem::hold(const ClothState& state)
{
  std::fill(held_.begin(), held_.end(), 0);
  for (const int p : state.pins)
    held_[p] = 1;
  usePlasticState(state);
}

void ClothSystem::beginStage(const ClothStage& stage, const ClothInputs& inputs)
{
  const int n = points();
  start_ = *stage.start;
  setWeights(stage.tau, ratio_);
  if (used_ && preconditioned_ && !used_->ready)
  {
    const ShiftedMatrix& p = preconditioner_->constant();
    used_->independent = averages_->factor(p.pattern(), p.values(), p.factorization(), held_.data());
    used_->ready = true;
  }
  const bool extra = inputs.forces.cols() > 0;
  const double damping = model_.mass_damping * stage.tau;
  for (int i = 0; i < n; ++i)
  {
    point(target_, i) = (point(*stage.q_hat, i) + damping * point(*stage.q_tilde, i)) / (1.0 + damping);
    point(force_, i) = model_.mass[i] * inputs.gravity;
    if (extra)
      point(force_, i) += inputs.forces.col(i);
  }
  for (const auto& load : loads_)
    load->begin(*stage.wind_at, *stage.q_tilde, *stage.velocity, inputs.wind, stage.tau, force_);
}

double ClothSystem::loadPotential(const PointVector& x) const
{
  double potential = 0.0;
  for (int i = 0; i < points(); ++i)
    potential += 0.5 * weight_[i] * (point(x, i) - point(target_, i)).squaredNorm() -
                 point(force_, i).dot(point(x, i) - point(start_, i));
  for (const auto& load : loads_)
    potential += load->value(x.data());
  return potential;
}

double ClothSystem::addLoads(const PointVector& x)
{
  double potential = 0.0;
  for (int i = 0; i < points(); ++i)
  {
    const Eigen::Vector3d away = point(x, i) - point(target_, i);
    point(load_gradient_, i) = weight_[i] * away - point(force_, i);
    potential += 0.5 * weight_[i] * away.squaredNorm() - point(force_, i).dot(point(x, i) - point(start_, i));
  }
  for (const auto& load : loads_)
    potential += load->addGradient(x.data(), load_gradient_.data());
  for (std::size_t i = 0; i < gradient_.size(); ++i)
    gradient_[i] += load_gradient_[i];
  return potential;
}

ClothEvaluation ClothSystem::addInternal(const PointVector& x, PointVector& gradient, bool with_constant)
{
  ClothEvaluation result;
  for (const ClothTerm& term : terms_)
    if (with_constant || !term.energy->constantMatrix())
      result.count(term.energy->account(), term.energy->addGradient(x.data(), gradient.data()));
  return result;
}

ClothEvaluation ClothSystem::energy(const PointVector& x)
{
  spend(kEnergyWork);
  ClothEvaluation result;
  result.potential = loadPotential(x);
  for (const ClothTerm& term : terms_)
    result.count(term.energy->account(), term.energy->value(x.data()));
  return result;
}

ClothEvaluation ClothSystem::evaluate(const PointVector& x)
{
  spend(kEnergyWork);
  std::fill(gradient_.begin(), gradient_.end(), 0.0);
  ClothEvaluation result = addInternal(x, gradient_);
  result.potential = addLoads(x);
  return result;
}

ClothEvaluation ClothSystem::evaluateHessian(const PointVector& x, HessianKind kind)
{
  spend(kHessianWork);
  std::copy(base_.begin(), base_.end(), matrix_.values());
  matrix_tau_ = base_tau_;
  std::fill(gradient_.begin(), gradient_.end(), 0.0);
  ClothEvaluation result;
  result.potential = addLoads(x);
  for (const ClothTerm& term : terms_)
    result.count(term.energy->account(), term.energy->addHessian(kind, x.data(), gradient_.data(), matrix_.values()));
  for (const auto& load : loads_)
    load->addHessian(matrix_.values());
  return result;
}

bool ClothSystem::factor()
{
  spend(kFactorWork);
  return factor_.factor(matrix_, held_.data());
}

void ClothSystem::setInertia(double tau)
{
  if (tau == matrix_tau_)
    return;
  shiftMatrix((rate(tau) - rate(matrix_tau_)) / rate(base_tau_));
  matrix_tau_ = tau;
}

void ClothSystem::clearHeld(PointVector& v) const
{
  for (int i = 0; i < points(); ++i)
    if (held_[i])
      point(v, i).setZero();
}

void ClothSystem::applyMatrix(const PointVector& p, PointVector& ap)
{
  std::fill(ap.begin(), ap.end(), 0.0);
  matrix_.addProduct(p.data(), ap.data());
  if (constant_ && !constant_in_blocks_)
    constant_->addProduct(1.0 + ratio_, p.data(), ap.data());
}

void ClothSystem::setRight(const PointVector& d)
{
  for (std::size_t i = 0; i < right_.size(); ++i)
    right_[i] = -gradient_[i];
  if (std::any_of(d.begin(), d.end(), [](double x) { return x != 0.0; }))
  {
    applyMatrix(d, product_);
    for (std::size_t i = 0; i < right_.size(); ++i)
      right_[i] -= product_[i];
  }
  clearHeld(right_);
}

LinearOutcome ClothSystem::solve(PointVector& d, const PointVector* at, int& linear_iterations, int& factorizations,
                                 double tolerance, const Eigen::Matrix3Xd* averages)
{
  if (!averagesIndependent())
    return LinearOutcome::not_definite;
  // what is held moves as given, and so does the rest in the first guess; the right-hand side sees that
  for (int i = 0; i < points() && solver_ == ClothSolver::cholesky; ++i)
    if (!held_[i])
      point(d, i).setZero();
  setRight(d);
  if (solver_ == ClothSolver::cholesky)
  {
    for (int i = 0; i < points(); ++i)
      if (held_[i])
        point(right_, i) = point(d, i);
    ++factorizations;
    if (!factor())
      return LinearOutcome::not_definite;
    factor_.solvePoints(right_.data(), d.data());
    return LinearOutcome::solved;
  }
  if (!preconditioned_)
    return LinearOutcome::not_definite;
  load_ = 0.0;
  const double allowed = tolerance > 0 ? tolerance : linear_tolerance_;
  if (solver_ == ClothSolver::gauss_seidel)
  {
    sweeps_.set(1.0 + ratio_, held_);
    return correct(d, sweeps_.solve(right_, correction_, allowed, iterationsWithin(kMostIterations)), allowed,
                   linear_iterations);
  }
  if (averages && used_->swept && limp_)
  {
    if (sweepWithAverages(d, *averages, allowed, linear_iterations) == LinearOutcome::solved)
      return LinearOutcome::solved;
    setRight(d);
  }
  if (at && !averages_)   // averages are met with the constant matrix
    preconditioner_->align(*at, matrix_, held_);
  else
    preconditioner_->useConstant();
  const double reference = averages_ ? takeFirstStep(d, averages, allowed) : 0.0;
  const LinearResult result = cg_.solve(
      right_, correction_, allowed, iterationsWithin(kMostIterations),
      [&](const PointVector& p, PointVector& ap) {
        applyMatrix(p, ap);
        clearHeld(ap);
      },
      [&](PointVector& r, PointVector& z) {
        if (averages_)
          preconditionWithin(r, z);
        else
          preconditioner_->apply(r, z);
      },
      reference);
  return correct(d, result, allowed, linear_iterations);
}

LinearOutcome ClothSystem::correct(PointVector& d, const LinearResult& result, double tolerance, int& linear_iterations)
{
  linear_iterations += result.iterations;
  spend(result.iterations + 1);
  for (std::size_t i = 0; i < d.size(); ++i)
    d[i] += correction_[i];
  if (!result.definite)
    return LinearOutcome::not_definite;
  // of what is strained so much that little is left beside its load: far less of that than others are asked for
  const bool beside_load = result.residual * result.scale <= kBesideLoad * tolerance * load_;
  return result.residual <= tolerance || beside_load ? LinearOutcome::solved : LinearOutcome::not_converged;
}

}   // namespace slender
