#include "impulse_cloths.h"

#include <algorithm>
#include <limits>
#include <sstream>
#include <stdexcept>
#include <utility>

#include "cloth/cloth_stepper_impl.h"
#include "slender_sim/contact/ccd.h"
#include "slender_sim/contact/intersection.h"
#include "slender_sim/dynamics/integrator.h"
#include "slender_sim/linalg/interruption.h"
#include "tracked_parts.h"

namespace slender {

namespace {

constexpr double kMeetTolerance = 1e-12;   // of the cloth's size
constexpr int kLoadPasses = 2;
// answers that are so large a part of those of the masses alone need no sharing: steps that resolve the membrane's
// waves
constexpr double kLocalAnswer = 0.4;
constexpr double kBalanced = 1e-6;   // of the work: what averages leave of pushes that they balance, rounding errors
// of the step of steepest descent, which goes too far where cloth lies loosely: it would hop
constexpr double kLoadShare = 0.7;

/// Layers much thicker than edges are long: everything touches what is some edges away, at the price of the square of
/// that, and folds cannot form.
void checkThickness(const ClothModel& cloth, double thickness)
{
  constexpr double kMost = 4.0;   // shortest edges
  const Eigen::Matrix2Xi& edges = cloth.topology.edges;
  double shortest = std::numeric_limits<double>::infinity();
  Eigen::Index at = 0;
  for (Eigen::Index e = 0; e < edges.cols(); ++e)
    if (const double length = (cloth.rest.vertices.col(edges(0, e)) - cloth.rest.vertices.col(edges(1, e))).norm();
        length < shortest)
    {
      shortest = length;
      at = e;
    }
  if (thickness <= kMost * shortest)
    return;
  std::ostringstream text;
  text << "cloth '" << cloth.name << "': contact: thickness " << thickness << " m is more than " << kMost
       << " times its shortest edge (" << shortest << " m, vertices " << edges(0, at) << " and " << edges(1, at)
       << "): use at most " << kMost * shortest << " m, or a mesh with longer edges";
  throw std::invalid_argument(text.str());
}

}   // namespace

ImpulseCloths::ImpulseCloths(const WorldModel& world, std::vector<int> cloths)
  : WorldObject(0),
    world_(world),
    cloths_(std::move(cloths))
{
  for (const Obstacle& obstacle : world.obstacles)
    surface_.solids.push_back({obstacle});
  for (std::size_t b = 0; b < world.bodies.size(); ++b)
    if (const WorldModel::Body& body = world.bodies[b]; body.shape && !body.body.simulated)
    {
      bodies_.push_back(static_cast<int>(b));
      surface_.solids.push_back({body.solid()});
    }
  first_.push_back(0);
  for (std::size_t k = 0; k < cloths_.size(); ++k)
  {
    const ClothModel& model = *cloth(k).model;
    const ContactProperties& contact = *cloth(k).contact;
    steppers_.emplace_back(cloth(k).model, cloth(k).options);
    if (cloth(k).options.error_tolerance == 0)
      steppers_.back().useBudget(budget_);
    surface_.rest.conservativeResize(3, vertices() + model.vertices());
    surface_.rest.rightCols(model.vertices()) = model.rest.vertices;
    surface_.sheets.push_back({contact, model.rest.triangles.array() + vertices()});
    for (const IgnoredSolid& solid : cloth(k).ignored)
      surface_.solids[solid.number].ignores.push_back(static_cast<int>(k));
    checkThickness(model, contact.thickness);
    first_.push_back(vertices() + model.vertices());
    const Eigen::Matrix3Xd& x = model.rest.vertices;
    corrections_.emplace_back().tolerance = kMeetTolerance * (x.rowwise().maxCoeff() - x.rowwise().minCoeff()).norm();
  }
  collider_ = std::make_unique<SurfaceCollider>(surface_);
  for (Eigen::Matrix3Xd* m :
       {&x_start_, &x_, &v_, &v_before_, &push_, &answer_, &contact_forces_, &contact_sums_, &contact_now_})
    m->setZero(3, vertices());
  inertia_.resize(vertices());
  inverse_mass_.resize(vertices());
  order_.resize(cloths_.size());
  inputs_.resize(cloths_.size());
  sub_inputs_.resize(cloths_.size());
  next_.cloths.resize(cloths_.size());
  next_.solids.resize(surface_.solids.size());
  for (auto* pins : {&pins_start_, &pin_forces_, &pin_sums_, &shared_pins_, &pin_answers_, &averages_start_,
                     &average_forces_, &average_sums_, &shared_averages_, &average_answers_})
    pins->resize(cloths_.size());
}

/// Obstacles and bodies are only read: others move them.
void ImpulseCloths::take(const WorldState& state, Ends& to) const
{
  to.cloths.resize(cloths_.size());
  for (std::size_t k = 0; k < cloths_.size(); ++k)
    to.cloths[k] = state.cloths[cloths_[k]];
  to.solids = state.obstacles;
  for (const int b : bodies_)
    to.solids.push_back(state.bodies[b].X_WB * world_.bodies[b].X_BS);
}

bool ImpulseCloths::load(const WorldState& state, const WorldInputs& inputs, StepReport&)
{
  take(state, work_);
  for (std::size_t k = 0; k < cloths_.size(); ++k)
    takeClothInputs(world_, cloths_[k], state, inputs, inputs_[k]);
  solid_ends_.clear();
  for (const GraspTarget& obstacle : inputs.obstacles)
    solid_ends_.push_back(normalized(obstacle.X_WG));
  for (const int b : bodies_)
    solid_ends_.push_back(normalized(inputs.bodies[b].X_WG) * world_.bodies[b].X_BS);
  return true;
}

void ImpulseCloths::finish(WorldState& state)
{
  for (std::size_t k = 0; k < cloths_.size(); ++k)
    std::swap(state.cloths[cloths_[k]], work_.cloths[k]);
}

void ImpulseCloths::finishGuide(const WorldInputs& inputs, WorldState& state, StepReport& report) const
{
  for (std::size_t k = 0; k < cloths_.size(); ++k)
    takeGuide(world_, {ObjectRef::cloth, cloths_[k]}, inputs_[k].averages, average_forces_[k], inputs, state, report);
}

std::size_t ImpulseCloths::indexOf(int cloth) const
{
  return std::lower_bound(cloths_.begin(), cloths_.end(), cloth) - cloths_.begin();
}

Eigen::Matrix3Xd ImpulseCloths::contactForces(int cloth) const
{
  const std::size_t k = indexOf(cloth);
  return contact_forces_.middleCols(first_[k], first_[k + 1] - first_[k]);
}

std::optional<StepReport> ImpulseCloths::stepAlone()
{
  StepReport report;
  collisions_ = CollisionReport();
  contact_sums_.setZero();
  for (std::size_t k = 0; k < cloths_.size(); ++k)
  {
    const Eigen::Matrix3Xd& x = work_.cloths[k].x;
    const std::vector<int>& pins = work_.cloths[k].pins;
    pins_start_[k].resize(3, static_cast<Eigen::Index>(pins.size()));
    pin_sums_[k].setZero(3, static_cast<Eigen::Index>(pins.size()));
    const PrescribedAverages* averages = averagesOf(k);
    average_sums_[k].setZero(3, averages ? averages->count() : 0);
    for (std::size_t p = 0; p < pins.size(); ++p)
      pins_start_[k].col(static_cast<Eigen::Index>(p)) = x.col(pins[p]);
    if (averages)
      averages_start_[k].noalias() = x * averages->weights->transpose();
  }
  hopeless_ = false;
  budget_->start(WorkBudget::ofStep(vertices()));
  SubstepRule rule;
  rule.longest = world_.time.step;
  rule.max_cuts = cloth(0).options.newton.max_cuts;
  SubstepController(rule).run(*this, world_.time.step, report);
  report.work = budget_->done();
  if (!report.ok)
    return report;
  std::swap(pin_forces_, pin_sums_);
  std::swap(contact_forces_, contact_sums_);
  std::swap(average_forces_, average_sums_);
  report.repulsions = collisions_.repulsions;
  report.impulses = collisions_.impulses;
  report.zones = collisions_.zones;
  return report;
}

StepFailure ImpulseCloths::attempt(const Substep& substep, StepReport& report)
{
  sub_report_ = tryStep(substep.from / world_.time.step, substep.to / world_.time.step, substep.length);
  report = sub_report_;
  report.ok = true;   // a failure is told by refuse() when no shorter substep succeeds
  report.message.clear();
  // The controller counts the substep. What remains is how often cloths divided it further.
  report.substeps = std::max(0L, report.substeps - static_cast<long>(steppers_.size()));
  return std::exchange(report.failure, StepFailure::none);
}

void ImpulseCloths::accept(const Substep& substep)
{
  std::swap(work_, next_);
  addForces(substep.length / world_.time.step, substep.length);
}

bool ImpulseCloths::shorterMayHelp(StepFailure failure) const
{
  return failure != StepFailure::input_not_finite && !hopeless_ && !budget_->spent();
}

void ImpulseCloths::refuse(const Substep& substep, StepFailure failure, StepReport& report)
{
  report.ok = false;
  report.failure = failure;
  report.place = sub_report_.place;
  if (failure == StepFailure::interrupted)
  {
    report.message = std::string("cloths: ") + kStepInterrupted;
    return;
  }
  report.message = sub_report_.message;
  if (!hopeless_ && failure != StepFailure::input_not_finite && budget_->spent())
    blameWork(substep.length, report);
  blameExplicit(report);
}

/// Collisions change the velocities of what touches only. Where that is little mass, as under the point of a needle, it
/// would carry little of the load, while the next solve, which knows nothing of contact, relaxes it at the cost of the
/// few that touch. So the forces that stand for the correction act on the whole cloth as well: along its response to
/// them, as far as the energy of the step says (a step of steepest descent on the dual problem of contact). Returns
/// false when there is nothing left to do.
bool ImpulseCloths::shareLoads(const CollisionStep& step, bool again)
{
  const double h = step.h;
  corrected_ = x_;
  if (!collider_->approach(step, corrected_, again))
    return false;
  double work = 0.0, answered = 0.0;
  for (int i = 0; i < vertices(); ++i)
  {
    const bool free = inverse_mass_[i] > 0.0;
    push_.col(i) =
        free ? Eigen::Vector3d((corrected_.col(i) - x_.col(i)) / (inverse_mass_[i] * h * h)) : Eigen::Vector3d(0, 0, 0);
    work += push_.col(i).dot(corrected_.col(i) - x_.col(i));
  }
  const double all = work;
  for (std::size_t k = 0; k < steppers_.size(); ++k)
    if (averagesOf(k))
      work -= balancedWork(k, h);
  if (!(work > kBalanced * all))
    return false;
  for (std::size_t k = 0; k < steppers_.size(); ++k)
  {
    const int first = first_[k], count = first_[k + 1] - first;
    own_push_ = push_.middleCols(first, count);
    own_answer_.resize(3, count);
    if (!steppers_[k].respond(own_push_, h, own_answer_, pin_answers_[k], average_answers_[k]))
      return false;
    answer_.middleCols(first, count) = own_answer_;
    answered += own_push_.cwiseProduct(own_answer_).sum();
  }
  if (!(answered > 0.0) || answered > kLocalAnswer * work)
    return false;
  const double share = kLoadShare * work / answered;
  x_ += share * answer_;
  v_ += share / h * answer_;
  contact_now_ += share * push_;
  for (std::size_t k = 0; k < steppers_.size(); ++k)
  {
    shared_pins_[k] += share * pin_answers_[k];
    shared_averages_[k] += share * average_answers_[k];
  }
  return true;
}

/// Steps that blow up move pieces until no collision can be solved any more, or meet the end of all halving: what is
/// said then is why.
void ImpulseCloths::blameExplicit(StepReport& report) const
{
  if (hopeless_ || (report.failure != StepFailure::squeezed && report.failure != StepFailure::state_not_finite &&
                    report.failure != StepFailure::work_exceeded))
    return;
  for (const ClothStepper& stepper : steppers_)
    if (const double duration = world_.time.step, stable = stepper.stableStep(); duration > stable)
    {
      report.failure = StepFailure::state_not_finite;
      report.message = "cloth '" + stepper.model().name + "': explicit steps of " + milliseconds(duration) +
                       " are too long for its membrane (stable below " + milliseconds(stable) +
                       " at rest): use a shorter time.step or implicit_euler; at last " + report.message;
      return;
    }
}

/// Of a substep that was just done.
void ImpulseCloths::addForces(double share, double h)
{
  contact_sums_ += share * contact_now_;
  for (std::size_t k = 0; k < steppers_.size(); ++k)
  {
    pin_sums_[k] += share * (steppers_[k].pinForces() + shared_pins_[k]);
    if (averagesOf(k))
      average_sums_[k] += share * (steppers_[k].averageForces() + shared_averages_[k]);
    for (std::size_t p = 0; p < work_.cloths[k].pins.size(); ++p)
      pin_sums_[k].col(static_cast<Eigen::Index>(p)) +=
          share / h * held_impulses_.col(first_[k] + work_.cloths[k].pins[p]);
  }
}

/// On their own, from work_ to next_: all, or those whose order was lowered.
bool ImpulseCloths::stepCloths(double to, double h, bool all, StepReport& report)
{
  for (std::size_t k = 0; k < steppers_.size(); ++k)
  {
    if (!all && order_[k] != Order::lowered)
      continue;
    next_.cloths[k] = work_.cloths[k];
    sub_inputs_[k] = inputs_[k];
    if (to < 1.0 && inputs_[k].pins.cols() == pins_start_[k].cols())
      sub_inputs_[k].pins = pins_start_[k] + to * (inputs_[k].pins - pins_start_[k]);
    if (to < 1.0 && inputs_[k].averages.cols() == averages_start_[k].cols())
      sub_inputs_[k].averages = averages_start_[k] + to * (inputs_[k].averages - averages_start_[k]);
    StepReport own = all ? steppers_[k].step(next_.cloths[k], sub_inputs_[k], h)
                         : steppers_[k].stepUndivided(next_.cloths[k], sub_inputs_[k], h);
    if (!all)   // counted already
      own.substeps = 0;
    report.merge(own);
    if (!report.ok)
      return false;
    const ClothOptions& options = cloth(k).options;
    order_[k] = all && (order(options.integrator) == 2 || options.error_tolerance > 0) ? Order::own : Order::first;
  }
  return true;
}

/// Whether the order of any has to be lowered, now that it is known what touches.
bool ImpulseCloths::lowerOrder()
{
  bool any = false;
  for (std::size_t k = 0; k < steppers_.size(); ++k)
    if (order_[k] == Order::own && collider_->touched(first_[k], first_[k + 1] - first_[k]))
    {
      order_[k] = Order::lowered;
      any = true;
    }
  return any;
}

/// Corrects x_ and v_, and counts the forces that this takes.
CollisionReport ImpulseCloths::resolveContacts(const CollisionStep& step)
{
  v_before_ = v_;
  CollisionReport report = collider_->resolve(step, x_, v_, true);
  if (!report.ok)
    return report;
  held_impulses_ += collider_->heldImpulses();
  contact_now_ += collider_->heldImpulses() / step.h;
  for (int i = 0; i < vertices(); ++i)
    if (inverse_mass_[i] > 0.0)
      contact_now_.col(i) += (v_.col(i) - v_before_.col(i)) / (inverse_mass_[i] * step.h);
  return report;
}

/// What contacts make of the cloths' own steps, into x_ and v_.
CollisionReport ImpulseCloths::collide(double h)
{
  for (std::size_t k = 0; k < steppers_.size(); ++k)
  {
    const int first = first_[k], count = first_[k + 1] - first;
    x_start_.middleCols(first, count) = work_.cloths[k].x;
    x_.middleCols(first, count) = next_.cloths[k].x;
    v_.middleCols(first, count) = next_.cloths[k].v;
    for (int i = 0; i < count; ++i)
      inertia_[first + i] = steppers_[k].impl().inertia(i, h);
    inverse_mass_.segment(first, count) = inertia_.segment(first, count).cwiseInverse();
    for (const int pin : work_.cloths[k].pins)
      inverse_mass_[first + pin] = 0.0;
    shared_pins_[k].setZero(3, static_cast<Eigen::Index>(work_.cloths[k].pins.size()));
    shared_averages_[k].setZero(3, averagesOf(k) ? averagesOf(k)->count() : 0);
  }
  contact_now_.setZero();
  const CollisionStep step{x_start_, inverse_mass_, work_.solids, next_.solids, h, budget_.get()};
  int pass = 0;
  while (pass < kLoadPasses && shareLoads(step, pass > 0))
    ++pass;
  return resolve(step);
}

/// From work_ to next_; times as shares of the step.
StepReport ImpulseCloths::tryStep(double from, double to, double h)
{
  StepReport report;
  for (std::size_t s = 0; s < surface_.solids.size(); ++s)   // uniformly from here to the end of the step
    next_.solids[s] =
        to < 1.0 ? RigidMotion(work_.solids[s], solid_ends_[s]).at((to - from) / (1.0 - from)) : solid_ends_[s];
  if (!stepCloths(to, h, true, report))
    return report;
  CollisionReport found = collide(h);
  while (found.ok && lowerOrder())
  {
    if (!stepCloths(to, h, false, report))
      return report;
    found = collide(h);
  }
  if (!found.ok)
  {
    report.refuse(found.spent ? StepFailure::work_exceeded : StepFailure::squeezed,
                  "collisions: " + found.reason + whereIs(found) +
                      (found.at_start ? "; start from a state in which nothing intersects"
                                      : "; use a shorter step, or leave the cloth more room") +
                      blameAverages(found));
    hopeless_ = found.at_start;
    for (const int point : found.points)
      if (point >= 0 && point < vertices() && report.place.kind == FailurePlace::Kind::none)
      {
        const int cloth = clothOf(point);
        report.place = {FailurePlace::Kind::cloth, steppers_[cloth].model().name, point - first_[cloth],
                        x_start_.col(point)};
      }
    return report;
  }
  collisions_.repulsions += found.repulsions;
  collisions_.impulses += found.impulses;
  collisions_.rounds += found.rounds;
  collisions_.zones += found.zones;
  collisions_.zone_points = std::max(collisions_.zone_points, found.zone_points);
  for (std::size_t k = 0; k < steppers_.size(); ++k)
  {
    next_.cloths[k].x = x_.middleCols(first_[k], first_[k + 1] - first_[k]);
    next_.cloths[k].v = v_.middleCols(first_[k], first_[k + 1] - first_[k]);
  }
  return report;
}

Eigen::Matrix3Xd ImpulseCloths::positions(const Ends& state) const
{
  Eigen::Matrix3Xd x(3, vertices());
  for (std::size_t k = 0; k < cloths_.size(); ++k)
    x.middleCols(first_[k], first_[k + 1] - first_[k]) = state.cloths[k].x;
  return x;
}

std::size_t ImpulseCloths::intersections(const WorldState& state) const
{
  Ends now;
  take(state, now);
  return slender::intersections(surface_, positions(now), now.solids).size();
}

int ImpulseCloths::clothOf(int point) const
{
  return static_cast<int>(std::upper_bound(first_.begin(), first_.end(), point) - first_.begin()) - 1;
}

std::string ImpulseCloths::solidName(int solid) const
{
  const std::string& name = surface_.solids[solid].name;
  return name.empty() ? "solid " + std::to_string(solid) : "'" + name + "'";
}

/// A point as the collider counts them.
std::string ImpulseCloths::placeOf(int point) const
{
  if (point >= vertices())
    return solidName(collider_->solidOf(point));
  const int cloth = clothOf(point);
  return "cloth '" + steppers_[cloth].model().name + "' at vertex " + std::to_string(point - first_[cloth]);
}

std::string ImpulseCloths::whereIs(const CollisionReport& failure) const
{
  std::string text;
  for (const int point : failure.points)
    if (point >= 0)
      text += (text.empty() ? " (" : " and ") + placeOf(point);
  return text.empty() ? text : text + ")";
}

void ImpulseCloths::check(const WorldState& state) const
{
  Ends now;
  take(state, now);
  const Eigen::Matrix3Xd x = positions(now);
  const CollisionSurface taken = asTaken(surface_);
  auto found = slender::intersections(surface_, x, now.solids);
  bool prism = false;
  if (found.empty())
  {
    found = slender::intersections(taken, x, now.solids);
    prism = true;
  }
  if (found.empty())
    return;
  // points of solids follow those of the cloths, and edges of a mesh may meet a cloth's face
  const Intersection& first = found[0];
  const auto solidAt = [&](int point) {
    std::size_t solid = 0;
    int end = vertices();
    for (;; ++solid)
    {
      const auto* mesh =
          std::get_if<std::shared_ptr<const TriangleMesh>>(&(prism ? taken : surface_).solids[solid].shape);
      end += mesh ? static_cast<int>((*mesh)->vertices.cols()) : 0;
      if (point < end)
        return static_cast<int>(solid);
    }
  };
  const bool edge = first.edge[0] < vertices();
  const int vertex = edge ? first.edge[0] : first.triangle[0], other = edge ? first.triangle[0] : first.edge[0],
            cloth = clothOf(vertex);
  std::string meets;
  if (other < 0)
    meets = solidName(first.triangle[2]);
  else if (other >= vertices())
    meets = solidName(solidAt(other));
  else if (clothOf(other) == cloth)
    meets = "itself at vertex " + std::to_string(other - first_[cloth]);
  else
    meets = "cloth '" + steppers_[clothOf(other)].model().name + "'";
  throw std::invalid_argument(placeOf(vertex) + " meets " + meets + (prism ? " or the prism that stands for it" : "") +
                              " (" + std::to_string(found.size()) + " places in all): move them apart");
}

}   // namespace slender
