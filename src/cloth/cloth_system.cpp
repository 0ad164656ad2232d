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
constexpr int kEnergyWork = 2, kHessianWork = 8;

}   // namespace

void ClothEvaluation::count(TermAccount account, const TermSums& sums)
{
  (account == TermAccount::stretching ? membrane : bending) += sums.energy;
  max_strain = std::max(max_strain, sums.max_strain);
}

ClothSystem::ClothSystem(const ClothModel& model, bool constant_in_blocks)
  : model_(model),
    terms_(clothTerms(model)),
    loads_(clothLoads(model)),
    constant_in_blocks_(constant_in_blocks)
{
  const int n = points();
  usePattern();
  for (PointVector* v : {&start_, &target_, &force_, &gradient_, &load_gradient_})
    v->assign(4 * n, 0.0);
  weight_.assign(n, 0.0);
  held_.assign(n, 0);
  if (model.stiffness_damping > 0)
    for (PointVector* v : {&ahead_, &behind_})
      v->assign(4 * n, 0.0);
}

void ClothSystem::usePattern()
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
  constant_in_blocks_ = constant_in_blocks_ && constant_;
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
  base_tau_ = tau;
  base_ratio_ = ratio;
  base_held_ = held_;
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

ClothEvaluation ClothSystem::evaluate(const PointVector& x)
{
  spend(kEnergyWork);
  std::fill(gradient_.begin(), gradient_.end(), 0.0);
  ClothEvaluation result = addInternal(x, gradient_);
  result.potential = addLoads(x);
  return result;
}

ClothEvaluation ClothSystem::evaluateHessian(const PointVector& x, HessianKind kind, const PointVector* from)
{
  spend(kHessianWork);
  std::copy(base_.begin(), base_.end(), matrix_.values());
  matrix_tau_ = base_tau_;
  std::fill(gradient_.begin(), gradient_.end(), 0.0);
  ClothEvaluation result;
  result.potential = addLoads(x);
  for (const ClothTerm& term : terms_)
    result.count(term.energy->account(), term.energy->addHessian(kind, x.data(), gradient_.data(), matrix_.values(),
                                                                 from ? from->data() : nullptr));
  for (const auto& load : loads_)
    load->addHessian(matrix_.values());
  return result;
}

void ClothSystem::setInertia(double tau)
{
  if (tau == matrix_tau_)
    return;
  shiftMatrix((rate(tau) - rate(matrix_tau_)) / rate(base_tau_));
  matrix_tau_ = tau;
}

void ClothSystem::applyMatrix(const PointVector& p, PointVector& ap) const
{
  std::fill(ap.begin(), ap.end(), 0.0);
  matrix_.addProduct(p.data(), ap.data());
  if (constant_ && !constant_in_blocks_)
    constant_->addProduct(1.0 + ratio_, p.data(), ap.data());
}

double ClothSystem::loadWork(const PointVector& from, const PointVector& to) const
{
  double work = 0.0;
  for (int i = 0; i < points(); ++i)
    if (!held_[i])
      work += point(force_, i).dot(point(to, i) - point(from, i));
  for (const auto& load : loads_)
    work += load->work(from, to, held_);
  return work;
}

void ClothSystem::shiftMatrix(double factor)
{
  for (int i = 0; i < points(); ++i)
    for (int k = 0; k < 3; ++k)
      matrix_.values()[9 * matrix_.starts()[i] + 4 * k] += factor * weight_[i];
}

void ClothSystem::addInertia(double rate)
{
  for (int i = 0; i < points(); ++i)
    for (int k = 0; k < 3; ++k)
      matrix_.values()[9 * matrix_.starts()[i] + 4 * k] += rate * model_.mass[i];
}

}   // namespace slender
