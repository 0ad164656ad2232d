#include "cloth_system.h"

#include <algorithm>
#include <cmath>

#include <Eigen/Geometry>

#include "slender_sim/energy/plate_bending.h"

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

ClothSystem::ClothSystem(const ClothModel& model, const ClothOptions& options)
  : model_(model),
    choose_(options.solver == ClothSolver::automatic && options.one_newton_step),
    solver_(chosen(model, options)),
    linear_tolerance_(options.linear_tolerance),
    membrane_(model.rest, model.membrane, model.warp),
    wind_(model)
{
  const int n = points();
  const bool direct = solver_ == ClothSolver::cholesky;
  const MeshTopology& t = model.topology;
  if (model.bending != BendingModel::none && model.bending_modulus > 0 && t.hingeCount() > 0)
  {
    const auto element = model.bending == BendingModel::isometric_conforming ? IsometricElement::conforming
                                                                             : IsometricElement::nonconforming;
    const double coefficient = model.bending_modulus * bendingCalibration(model.rest, t, element, model.warp);
    constant_bending_ = model.bending != BendingModel::hinge;
    if (!constant_bending_)
      hinges_ =
          std::make_unique<HingeBending>(t.hinges, hingeStiffness(model.rest, t, coefficient, model.clamped_faces),
                                         Eigen::VectorXd::Zero(t.hingeCount()));
    if (hinges_ && std::isfinite(model.plasticity.yield_curvature))
      hinge_stiffness_ = hingeStiffness(model.rest, t, coefficient, model.clamped_faces);
    if (constant_bending_ || solver_ == ClothSolver::conjugate_gradients)
      bending_ =
          model.bending_poissons_ratio
              ? plateBending(model.rest, t, *model.bending_poissons_ratio, model.bending_modulus, model.clamped_faces)
              : isometricBending(model.rest, t, element, coefficient, model.clamped_faces);
  }
  std::vector<Eigen::MatrixXi> elements{model.rest.triangles};
  if (hinges_)
    elements.emplace_back(t.hinges);
  bending_in_blocks_ = constant_bending_ && direct;
  if (bending_in_blocks_)
    elements.push_back(pairsOf(bending_));
  matrix_ = BlockMatrix(n, elements);
  membrane_slots_ = membrane_.slotsIn(matrix_);
  if (hinges_)
    hinge_slots_ = hinges_->slotsIn(matrix_);
  if (bending_in_blocks_)
    bending_map_ = matrix_.mapOf(bending_);
  if (direct)
    factor_.setPattern(matrix_);
  else if (solver_ == ClothSolver::gauss_seidel)
    sweeps_ = SymmetricSweeps(matrix_, constant_bending_ ? &bending_ : nullptr);
  else
  {
    preconditioner_ = std::make_unique<ClothPreconditioner>(model, bending_, matrix_, !constant_bending_);
    cg_.resize(n);
    average_sets_.resize(model.averages.size());
    for (std::size_t s = 0; s < average_sets_.size(); ++s)
    {
      average_sets_[s].prescribed = &model.averages[s];
      average_sets_[s].solver.setConstraints(*model.averages[s].weights, model.averages[s].bounds.size() > 0);
      average_sets_[s].swept = sweepsSuit(model.averages[s]);
    }
    if (std::any_of(average_sets_.begin(), average_sets_.end(), [](const AverageSet& set) { return set.swept; }))
      sweeps_ = SymmetricSweeps(matrix_, constant_bending_ ? &bending_ : nullptr);
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
  for (PointVector* v : {&start_, &target_, &force_, &gradient_, &product_, &right_, &correction_})
    v->assign(4 * n, 0.0);
  weight_.assign(n, 0.0);
  held_.assign(n, 0);
  if (model.stiffness_damping > 0)
  {
    viscous_start_.assign(4 * n, 0.0);
    shifted_.assign(4 * n, 0.0);
    for (int k = 0; k < 3; ++k)
      for (auto* s : {&strains_[k], &other_strains_[k]})
        s->assign(membrane_.paddedCount(), 0.0);
    if (hinges_)
      for (auto* a : {&angles_, &other_angles_, &start_angles_})
        a->assign(hinges_->paddedCount(), 0.0);
  }
}

void ClothSystem::setHinges(const ClothState& state)
{
  if (hinges_)
    for (int h = 0; h < hinges_->count(); ++h)
      hinges_->setRestAngle(h, state.rest_angles[h]);
  for (Eigen::Index h = 0; h < hinge_stiffness_.size(); ++h)
    hinges_->setStiffness(static_cast<int>(h), state.stiffening[h] * hinge_stiffness_[h]);
}

void ClothSystem::setViscosity(double ratio, const PointVector& x) { setViscosity(ratio, x, nullptr, 0.0, nullptr); }

void ClothSystem::setViscosity(double ratio, const PointVector& x, const PointVector* move, double share,
                               const PointVector* other)
{
  if (ratio == 0.0 && ratio_ == 0.0)
    return;
  double* strains[3] = {strains_[0].data(), strains_[1].data(), strains_[2].data()};
  double* others[3] = {other_strains_[0].data(), other_strains_[1].data(), other_strains_[2].data()};
  const auto add = [&](const PointVector& there, double part) {
    membrane_.strains(there.data(), others);
    for (int k = 0; k < 3; ++k)
      for (std::size_t i = 0; i < strains_[k].size(); ++i)
        strains[k][i] += part * others[k][i];
    if (!hinges_)
      return;
    hinges_->angles(there.data(), other_angles_.data());
    for (std::size_t i = 0; i < angles_.size(); ++i)   // the shorter way round
      angles_[i] += part * std::remainder(other_angles_[i] - start_angles_[i], 2 * M_PI);
  };
  if (ratio > 0)
  {
    viscous_start_ = x;
    membrane_.strains(x.data(), strains);
    if (hinges_)
    {
      hinges_->angles(x.data(), angles_.data());
      start_angles_ = angles_;
    }
    if (share != 0.0)
    {
      for (auto& array : strains_)
        for (double& value : array)
          value *= 1.0 - share;
      add(*other, share);
    }
    for (const double side : {0.5, -0.5})
      if (move)
      {
        for (std::size_t i = 0; i < x.size(); ++i)
          shifted_[i] = x[i] + 2.0 * side * (*move)[i];
        add(shifted_, side);
      }
    for (std::size_t i = 0; i < x.size(); ++i)
      viscous_start_[i] += (move ? (*move)[i] : 0.0) + (share != 0.0 ? share * ((*other)[i] - x[i]) : 0.0);
    if (constant_bending_)
      viscous_form_ = bending_.multiply(viscous_start_.data(), product_.data());
  }
  respond(ratio);
}

void ClothSystem::respond(double ratio)
{
  ratio_ = ratio;
  const double* strains[3] = {strains_[0].data(), strains_[1].data(), strains_[2].data()};
  membrane_.setResponse(ratio, strains);
  if (hinges_)
    hinges_->setResponse(ratio, angles_.data());
}

double ClothSystem::elasticEnergy(const PointVector& x)
{
  const double ratio = ratio_;
  respond(0.0);
  double result = membrane_.energy(x.data()).energy;
  if (hinges_)
    result += hinges_->energy(x.data());
  else if (constant_bending_)
    result += 0.5 * bending_.multiply(x.data(), product_.data());
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
  if (bending_in_blocks_)
    matrix_.add(1.0 + ratio, bending_, bending_map_);
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
  setHinges(state);
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
  if (wind_.active())
    wind_.begin(*stage.wind_at, *stage.q_tilde, *stage.velocity, inputs.wind, stage.tau, force_);
}

ClothEvaluation ClothSystem::addLoads(const PointVector& x, bool with_gradient)
{
  ClothEvaluation result;
  for (int i = 0; i < points(); ++i)
  {
    const Eigen::Vector3d away = point(x, i) - point(target_, i);
    Eigen::Vector3d slope = weight_[i] * away - point(force_, i);
    result.potential += 0.5 * weight_[i] * away.squaredNorm() - point(force_, i).dot(point(x, i) - point(start_, i));
    if (wind_.active())
      result.potential += wind_.addGradient(i, point(x, i), slope);
    if (with_gradient)
      point(gradient_, i) += slope;
  }
  return result;
}

ClothEvaluation ClothSystem::addInternal(const PointVector& x, PointVector& gradient, bool with_bending)
{
  ClothEvaluation result;
  const MembraneSums sums = membrane_.addGradient(x.data(), gradient.data());
  result.membrane = sums.energy;
  result.max_strain = std::max(sums.max_strain, -sums.min_strain);
  if (!with_bending)
    return result;
  if (hinges_)
    result.bending = hinges_->addGradient(x.data(), gradient.data());
  else if (constant_bending_)
    result.bending = addIsometric(x, gradient);
  return result;
}

/// Viscous response: (1 + ratio) K about the mean of zero and the start of the step, weighted 1 : ratio.
double ClothSystem::addIsometric(const PointVector& x, PointVector& gradient)
{
  double energy = 0.5 * (1.0 + ratio_) * bending_.addProduct(1.0 + ratio_, x.data(), gradient.data());
  if (ratio_ > 0)
  {
    bending_.multiply(viscous_start_.data(), product_.data());
    energy += ratio_ *
              (0.5 * ratio_ / (1.0 + ratio_) * viscous_form_ - pointKernels().dot(points(), x.data(), product_.data()));
    for (std::size_t i = 0; i < gradient.size(); ++i)
      gradient[i] -= ratio_ * product_[i];
  }
  return energy;
}

ClothEvaluation ClothSystem::energy(const PointVector& x)
{
  spend(kEnergyWork);
  ClothEvaluation result = addLoads(x, false);
  const MembraneSums sums = membrane_.energy(x.data());
  result.membrane = sums.energy;
  result.max_strain = std::max(sums.max_strain, -sums.min_strain);
  if (hinges_)
    result.bending = hinges_->energy(x.data());
  else if (constant_bending_)
  {
    const double form = bending_.multiply(x.data(), product_.data());
    result.bending = 0.5 * (1.0 + ratio_) * form;
    if (ratio_ > 0)
      result.bending += ratio_ * (0.5 * ratio_ / (1.0 + ratio_) * viscous_form_ -
                                  pointKernels().dot(points(), viscous_start_.data(), product_.data()));
  }
  return result;
}

ClothEvaluation ClothSystem::evaluate(const PointVector& x)
{
  spend(kEnergyWork);
  std::fill(gradient_.begin(), gradient_.end(), 0.0);
  ClothEvaluation result = addInternal(x, gradient_);
  result.potential = addLoads(x, true).potential;
  return result;
}

ClothEvaluation ClothSystem::evaluateHessian(const PointVector& x, HessianKind kind)
{
  spend(kHessianWork);
  std::copy(base_.begin(), base_.end(), matrix_.values());
  matrix_tau_ = base_tau_;
  std::fill(gradient_.begin(), gradient_.end(), 0.0);
  ClothEvaluation result = addLoads(x, true);
  const MembraneSums sums = membrane_.addHessian(kind, x.data(), membrane_slots_, gradient_.data(), matrix_.values());
  result.membrane = sums.energy;
  result.max_strain = std::max(sums.max_strain, -sums.min_strain);
  if (hinges_)
    result.bending = hinges_->addHessian(kind, x.data(), hinge_slots_, gradient_.data(), matrix_.values());
  else if (constant_bending_)
    result.bending = addIsometric(x, gradient_);
  if (wind_.active())
    wind_.addHessian(matrix_);
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
  if (constant_bending_ && !bending_in_blocks_)
    bending_.addProduct(1.0 + ratio_, p.data(), ap.data());
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
