#include "cloth_part.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <stdexcept>

#include "slender_sim/linalg/interruption.h"

namespace slender {

namespace {

constexpr double kNear = 0.1;             ///< increment, over the shortest edge, below which the exact Hessian is taken
constexpr double kSemidefinite = 5e-3;    ///< least shift of positions with a semidefinite Hessian
constexpr double kShiftOfAngle = 0.2;     ///< of the weight of inertia, per unit of a shift of angles
constexpr double kFirstShift = 1e-3;      ///< of all vertices in statics, per unit of a shift of angles
constexpr int kTimesWork = 5;             ///< of a step in an island, over that of a cloth alone
constexpr long kSharedFactorWork = 100;   ///< counts of a WorkBudget per vertex
constexpr double kMostTurn = 0.7;         ///< of an edge in an iteration [rad], as for edges of rods

}   // namespace

ClothPart::ClothPart(std::shared_ptr<const ClothModel> model, const ClothOptions& options)
  : own_(std::make_unique<ClothWork>(std::move(model), options, false)),
    work_(*own_)
{
  const ClothModel& m = *work_.model;
  if (options.integrator != Integrator::implicit_euler)
    throw std::invalid_argument("cloth '" + m.name +
                                "': contact and joints with other objects need time.integrator: implicit_euler");
  for (const PrescribedAverages& set : m.averages)
  {
    if (set.bounds.size() > 0)
      throw std::invalid_argument("cloth '" + m.name +
                                  "': bounds of the forces of averages (max_traction) need contact by impulses, or no "
                                  "contact");
    average_sets_.push_back(std::make_unique<AverageConstraints>(*set.weights));
  }
  allocate();
}

ClothPart::ClothPart(ClothWork& work) : work_(work), linearized_(work.options.one_newton_step && !work.isExplicit())
{
  if (!work.isExplicit())
    allocate();
}

void ClothPart::allocate()
{
  const ClothModel& m = *work_.model;
  inverse_length_.resize(static_cast<std::size_t>(m.topology.edges.cols()));
  for (std::size_t e = 0; e < inverse_length_.size(); ++e)
  {
    const auto edge = m.topology.edges.col(static_cast<Eigen::Index>(e));
    inverse_length_[e] = 1.0 / (m.rest.vertices.col(edge[1]) - m.rest.vertices.col(edge[0])).norm();
  }
  for (PointVector* v : {&base_, &base_before_, &saved_, &direction_, &solution_})
    v->assign(work_.x.size(), 0.0);
}

// ---- a step

void ClothPart::begin(const ClothState& state, const ClothInputs& inputs, double duration)
{
  counts_ = {};
  work_.begin(state, inputs, duration);
  setPins(state.pins);
  duration_ = duration;
  averages_ = average_sets_.empty() ? nullptr : average_sets_[static_cast<std::size_t>(state.average_set)].get();
  if (!averages_)
    return;
  averages_->begin(state.x, inputs.averages);
  work_.startBudget(kTimesWork);
}

StepFailure ClothPart::beginSubstep(const StepPlan& plan, const Substep& substep)
{
  work_.beginSubstep(plan, substep);
  dependent_ = averages_ && !averages_->prepare(work_.model->mass, [this](int i) { return !system().held()[i]; });
  if (averages_)
    averages_->place(substep.to / duration_);
  return dependent_ ? StepFailure::singular_matrix : StepFailure::none;
}

void ClothPart::beginStage(std::size_t stage)
{
  work_.beginStage(stage);
  if (linearized_)
    work_.placeLinearized(direction_);
  else
    work_.placeGuess();
  if (averages_)
    averages_->forces.setZero();
  meetAverages();
  base_before_ = base_ = system().start();
  moved_ = false;
  near_ = indefinite_ = false;
}

void ClothPart::endStage(std::size_t stage, bool last, StepReport& report)
{
  if (!last)
  {
    work_.endStage(stage);
    return;
  }
  work_.finish(std::max(largest_internal_, largest_contact_), evaluation.max_strain, report);
  if (averages_)
    work_.average_forces = averages_->forces;
  report.linear_iterations += counts_.linear_iterations;
  counts_ = {};
}

StepFailure ClothPart::finishSubstep(StepReport&)
{
  return linearized_ && work_.createsEnergy(evaluation.stretch + evaluation.bend_twist) ? StepFailure::energy_grew
                                                                                        : StepFailure::none;
}

/// The semidefinite Hessian is positive definite with inertia. What its solver cannot solve, a cloth alone solves in a
/// shorter step, which has more inertia. In islands of several parts shifts come first.
StepFailure ClothPart::givesUp() const
{
  if (work_.workExceeded())
    return StepFailure::work_exceeded;
  if (own_ || exact_ || coupled || outcome_ == LinearOutcome::solved)
    return StepFailure::none;
  return outcome_ == LinearOutcome::not_converged ? StepFailure::linear_unconverged : StepFailure::singular_matrix;
}

void ClothPart::refuse(StepFailure failure, double length, StepReport& report) const
{
  report.linear_iterations += counts_.linear_iterations;
  const char* why = "";
  if (dependent_)
    why = kDependentAverages;
  else if (averages_ && (failure == StepFailure::squeezed || largest_contact_ > 0.0))
    why =
        "what the cloth touches may not let it have the averages of its guide: keep the guide clear of that, or let "
        "it move by less at once";
  work_.refuseUnsolved(report, work_.workExceeded() ? StepFailure::work_exceeded : failure, length, why);
}

Largest ClothPart::unbalancedForce() const
{
  Largest largest;
  for (int i = 0; i < points(); ++i)
    if (isFree(i))
      largest.add(i, vertex(system().gradient(), i).norm());
  return largest;
}

// ---- unknowns and configurations

bool ClothPart::numberUnknowns()
{
  if (!number_.empty() && system().held() == held_ && averages_ == numbered_with_)
    return true;
  held_ = system().held();
  numbered_with_ = averages_;
  number_.resize(held_.size());
  unknowns_ = 0;
  for (std::size_t i = 0; i < held_.size(); ++i)
  {
    number_[i] = held_[i] ? kPrescribed : unknowns_;
    unknowns_ += held_[i] ? 0 : 3;
  }
  return false;
}

void ClothPart::addTriples(std::vector<double>& masses) const
{
  for (std::size_t i = 0; i < number_.size(); ++i)
    if (number_[i] >= 0)
      masses.push_back(work_.model->mass[static_cast<Eigen::Index>(i)]);
}

void ClothPart::moveAlong(double alpha)
{
  PointVector& x = work_.x;
  if (alpha == 0.0)   // whatever the direction is, which may be that of an attempt that overflowed
  {
    std::copy(base_.begin(), base_.end(), x.begin());
    moved_ = false;
    return;
  }
  for (std::size_t i = 0; i < x.size(); ++i)
    x[i] = base_[i] + alpha * direction_[i];
  moved_ = true;
  work_.meetAverages();
}

void ClothPart::accept()
{
  base_before_.swap(base_);
  base_ = work_.x;
  moved_ = false;
}

void ClothPart::retreat(double share)
{
  for (int i = 0; i < points(); ++i)
    if (isFree(i))
      vertex(work_.x, i) = vertex(base_, i) + share * (vertex(work_.x, i) - vertex(base_, i));
}

void ClothPart::placeHeld(double fraction)
{
  const std::vector<int>& pins = work_.present().pins;
  for (std::size_t k = 0; k < pins.size(); ++k)
    vertex(work_.x, pins[k]) = work_.pinAt(k, fraction);
  if (averages_)
    averages_->place(fraction);
}

void ClothPart::meetAverages()
{
  if (averages_)
    averages_->meet([this](int i) { return vertex(work_.x, i); },
                    [this](int i, int component, double length) { vertex(work_.x, i)[component] += length; });
}

bool ClothPart::heldMoves(double from, double to) const
{
  if (from != to && averages_ && averages_->move())
    return true;
  const std::vector<int>& pins = work_.present().pins;
  for (std::size_t k = 0; k < pins.size(); ++k)
    if (from == to ? vertex(work_.x, pins[k]) != vertex(base_, pins[k]) : work_.pinAt(k, from) != work_.pinAt(k, to))
      return true;
  return false;
}

void ClothPart::retreatHeld(double share)
{
  for (const int p : work_.present().pins)
    vertex(work_.x, p) = vertex(base_, p) + share * (vertex(work_.x, p) - vertex(base_, p));
}

void ClothPart::gather(Eigen::Matrix3Xd& x) const
{
  for (int i = 0; i < points(); ++i)
    x.col(first_point + i) = vertex(work_.x, i);
}

void ClothPart::gatherStart(Eigen::Matrix3Xd& x) const { x.middleCols(first_point, points()) = work_.present().x; }

// ---- equations

void ClothPart::evaluate(bool with_hessian, const HessianShift& shift)
{
  const bool statics = statics_rate_ > 0.0;
  exact_ = statics || (near_ && shift.position < kSemidefinite && !linearized_);
  const HessianKind kind = exact_ ? HessianKind::exact : HessianKind::semidefinite;
  const PointVector* const from = linearized_ || statics ? nullptr : moved_ ? &base_ : &base_before_;
  const ClothEvaluation e = with_hessian ? system().evaluateHessian(work_.x, kind, from) : system().evaluate(work_.x);
  largest_contact_ = 0.0;
  evaluation = {};
  evaluation.stretch = e.membrane;
  evaluation.bend_twist = e.bending;
  evaluation.potential = e.potential;
  evaluation.max_strain = e.max_strain;
  if (!with_hessian)
    largest_internal_ = work_.closeGradient();
  if (averages_)
    averages_->forEntries([&](Eigen::Index i, int point, double weight) {
      vertex(system().gradient(), point) -= weight * averages_->forces.col(i);
    });
  if (with_hessian && held_end_)
    addHeldMotion();
  if (coupled)
    return;
  addOwnContacts(with_hessian);
  if (with_hessian && std::isfinite(evaluation.energy()))
    factor(shift);
}

void ClothPart::addForce(int point, const Eigen::Vector3d& force)
{
  vertex(system().gradient(), point) -= force;
  largest_contact_ = std::max(largest_contact_, force.norm());
}

/// In units of the weight of inertia. An island shifts all its parts; a cloth that is definite by itself, so far as
/// that is known, does not need what edge angles of rods need.
double ClothPart::inertiaShift(const HessianShift& shift) const
{
  return exact_ ? (coupled || indefinite_ ? kShiftOfAngle * shift.angle : 0.0) : shift.position;
}

/// A stiffness between points of one triangle. The blocks of the membrane, in which rows belong to the later point,
/// have room for it.
template <class Block>
void ClothPart::addToBlocks(const int (&point)[4], Block&& block)
{
  BlockMatrix& matrix = system().matrix();
  for (int p = 0; p < 4; ++p)
    for (int q = 0; q <= p; ++q)
      if (point[p] >= 0 && point[q] >= 0)
        Eigen::Map<Eigen::Matrix3d>(matrix.values() + 9 * static_cast<std::size_t>(matrix.block(
                                                              point[p] - first_point, point[q] - first_point))) +=
            point[p] < point[q] ? block(q, p) : block(p, q);
}

/// Contacts with solids have no indefinite second derivatives, so that the whole of them goes into the blocks.
void ClothPart::addOwnContacts(bool with_hessian)
{
  for (const ContactTerm* term : own_terms)
  {
    for (int p = 0; p < 4; ++p)
      if (term->point[p] >= 0)
        addForce(term->point[p] - first_point, term->share(p, term->force));
    if (with_hessian)
      addToBlocks(term->point, [&](int i, int j) { return term->block(i, j, term->stiffness); });
  }
  for (const ContactRow* row : own_rows)
    if (with_hessian)
      addToBlocks(row->point, [&](int i, int j) { return row->block(i, j); });
}

/// Conjugate gradients find out only while they solve whether a matrix is definite, so that they solve here. A
/// linearised step is solved here as well, because its solution depends on the motion of held vertices.
void ClothPart::factor(const HessianShift& shift)
{
  const double added = inertiaShift(shift);
  if (statics_rate_ > 0.0)
    system().addInertia((shift.position + kFirstShift * shift.angle) * statics_rate_ + pencil_rate_);
  else if (added > 0.0)
    system().shiftMatrix(added);
  if (solvesByFactors())
    outcome_ = work_.linear->factor() ? LinearOutcome::solved : LinearOutcome::not_definite;
  else
  {
    if (linearized_)
    {
      work_.takeStartEnergy(evaluation.stretch + evaluation.bend_twist);
      std::copy(direction_.begin(), direction_.end(), solution_.begin());
    }
    else
      std::fill(solution_.begin(), solution_.end(), 0.0);
    outcome_ = work_.solveNewton(solution_, linearized_, counts_);
  }
  const bool definite = outcome_ == LinearOutcome::solved;
  if (exact_ && added == 0.0)
    indefinite_ = !definite;
  evaluation.inertia.negative = !definite && !stepsInterrupted();   // minimize() ends when it is interrupted
}

void ClothPart::solve()
{
  if (solvesByFactors())
  {
    for (int i = 0; i < points(); ++i)
      vertex(direction_, i) = isFree(i) ? Eigen::Vector3d(-vertex(system().gradient(), i)) : Eigen::Vector3d::Zero();
    work_.linear->solveFactored(direction_);
  }
  else
    std::swap(direction_, solution_);
  near_ = incrementSize(0.0) < kNear;
}

void ClothPart::takeGradient(double* right) const
{
  for (int i = 0; i < points(); ++i)
    if (isFree(i))
      Eigen::Map<Eigen::Vector3d>(right + base(i)) = -vertex(system().gradient(), i);
}

void ClothPart::takeDirection(const double* solution)
{
  for (int i = 0; i < points(); ++i)
    if (isFree(i))
      vertex(direction_, i) = Eigen::Map<const Eigen::Vector3d>(solution + base(i));
    else
      vertex(direction_, i).setZero();
  near_ = incrementSize(0.0) < kNear;
  if (averages_)
    work_.spend(points() * kSharedFactorWork);
}

// ---- measures

double ClothPart::stepLimit() const
{
  if (!contact_ && !(statics_rate_ > 0.0))   // with inertia the energy alone bears turns of any size
    return 1.0;
  const double turn = turnOfEdges();
  return turn > kMostTurn ? kMostTurn / turn : 1.0;
}

double ClothPart::incrementSize(double) const
{
  double square = 0.0;
  for (int i = 0; i < points(); ++i)
    square = std::max(square, vertex(direction_, i).squaredNorm());
  return std::sqrt(square) / work_.shortestEdge();
}

double ClothPart::slope() const
{
  double sum = 0.0;
  for (int i = 0; i < points(); ++i)
    sum += vertex(system().gradient(), i).dot(vertex(direction_, i));
  return sum;
}

double ClothPart::residual() const
{
  double square = 0.0;
  for (int i = 0; i < points(); ++i)
    if (isFree(i))
      square = std::max(square, vertex(system().gradient(), i).squaredNorm());
  return std::sqrt(square);
}

/// Largest force of elasticity and viscosity, gravity, or a pin. A cloth at rest has none of them to compare with, only
/// what Newton's tolerance leaves.
double ClothPart::forceScale() const
{
  if (statics_rate_ > 0.0)
    return staticForceScale();
  const ClothModel& m = *work_.model;
  // alone: with IslandTolerances::most_unbalanced a tenth of this may be unbalanced
  const double resolved = own_ ? work_.resolvedForce() : 10.0 * work_.resolvedForce();
  double largest = std::max(resolved, work_.largestInternal());
  largest = std::max(largest, m.mass.maxCoeff() * work_.inputs().gravity.norm());
  for (const int p : work_.present().pins)
    largest = std::max(largest, vertex(system().gradient(), p).norm());
  if (averages_)   // each spreads its force over vertices
    largest = std::max(largest, averages_->forces.cwiseAbs().maxCoeff() * averages_->count() / points());
  return largest;
}

/// Positions round to eps of the extent, so that forces round to this times what holds a vertex: the membrane, and
/// inertia in short steps.
double ClothPart::noiseLevel() const
{
  const ClothModel& m = *work_.model;
  double extent = 0.0;
  for (const double x : work_.x)
    extent = std::max(extent, std::abs(x));
  const std::vector<double>& weights = system().weights();
  const double stiffness = m.membrane.c11 + m.membrane.c22 + *std::max_element(weights.begin(), weights.end());
  return 4.0 * std::numeric_limits<double>::epsilon() * stiffness * extent;
}

}   // namespace slender
