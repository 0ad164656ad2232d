#include "slender_sim/thread/thread_stepper.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <stdexcept>
#include <utility>

#include "island/island.h"
#include "slender_sim/dynamics/failure_place.h"
#include "thread_part.h"

namespace slender {

/// A thread that touches nothing but its floor, and its island.
struct ThreadStepper::Alone : ThreadWork
{
  Alone(std::shared_ptr<const ThreadModel> m, const NewtonConfig& n, Integrator integrator)
    : ThreadWork(std::move(m), n, integrator == Integrator::symplectic_euler),
      part(*this),
      island(timeOf(n, integrator), false)
  {
    island.equations().tolerances.most_unbalanced = ThreadSystem::mostUnbalanced();
    island.setParts({&part});
  }

  static TimeConfig timeOf(const NewtonConfig& newton, Integrator integrator)
  {
    TimeConfig time;
    time.integrator = integrator;
    time.error_tolerance = time.min_step = 0.0;
    time.newton = newton;
    return time;
  }

  ThreadPart part;
  Island island;
};

namespace {

/// "2.5 mm".
std::string millimetres(double length) { return shortNumber(1e3 * length, 3) + " mm"; }

/// The smallest and the largest.
std::pair<double, double> rangeOfRadii(const ThreadState& state)
{
  double least = std::numeric_limits<double>::infinity(), most = 0.0;
  for (int j = 0; j < state.edges(); ++j)
  {
    least = std::min(least, state.radius(j));
    most = std::max(most, state.radius(j));
  }
  return {least, most};
}

}   // namespace

ThreadStepper::ThreadStepper(std::shared_ptr<const ThreadModel> model, const NewtonConfig& newton,
                             Integrator integrator)
{
  checkLoneThread(*model);
  if (integrator != Integrator::implicit_euler && integrator != Integrator::symplectic_euler)
    throw std::invalid_argument("thread '" + model->name + "': integrator is " + toString(integrator) +
                                ", allowed: implicit_euler, symplectic_euler");
  alone_ = std::make_unique<Alone>(std::move(model), newton, integrator);
}
ThreadStepper::~ThreadStepper() = default;
ThreadStepper::ThreadStepper(ThreadStepper&&) noexcept = default;
ThreadStepper& ThreadStepper::operator=(ThreadStepper&&) noexcept = default;

StepReport ThreadStepper::step(ThreadState& state, const ThreadInputs& inputs, double duration)
{
  StepReport report;
  if (!alone_->accepts(state, inputs, duration, report))
    return report;
  alone_->begin(state, inputs, duration);
  double first = 0.0;
  report = alone_->island.step(duration, first);
  if (report.ok)
    std::swap(state, alone_->work);
  return report;
}
const std::array<Wrench, 2>& ThreadStepper::endLoads() const { return alone_->loads; }
const ThreadModel& ThreadStepper::model() const { return *alone_->model; }

bool ThreadWork::inputsFinite(const ThreadState& s, const ThreadInputs& inputs, double duration,
                              std::string& what) const
{
  // names are built only when they are needed: a good step takes no memory
  const auto check = [&](bool good, const char* name) {
    if (!good && what.empty())
      what = name;
    return good;
  };
  check(duration > 0 && std::isfinite(duration), "step length (must be positive)");
  check(inputs.gravity.allFinite(), "gravity");
  check(inputs.belt_velocity.allFinite(), "belt velocity");
  check(inputs.flow_rate >= 0 && std::isfinite(inputs.flow_rate), "flow rate (must be zero or more)");
  check(inputs.flow_rate == 0 || (model->nozzle_diameter > 0 && s.ends[1].held),
        "flow rate (must be zero: the thread hangs on no nozzle)");
  for (int end = 0; end < 2; ++end)
    if (s.ends[end].held)
      for (const Pose* pose : {&inputs.ends[end], &s.ends[end].X_WE})
        check(pose->position.allFinite() && std::abs(pose->orientation.norm() - 1.0) < 1e-3,
              end ? "pose of the newest end" : "pose of the oldest end");
  const std::size_t nodes = s.x.size(), edges = s.volume.size();
  bool sound = nodes >= 2 && edges + 1 == nodes && s.v.size() == nodes && s.twist.size() == nodes &&
               s.id.size() == nodes && s.deposited.size() == nodes && s.d1.size() == edges && s.spin.size() == edges;
  if (!check(sound, "number of nodes or edges of the state"))
    return false;
  for (std::size_t i = 0; i < nodes; ++i)
    sound = sound && s.x[i].allFinite() && s.v[i].allFinite() && std::isfinite(s.twist[i]);
  for (std::size_t j = 0; j < edges; ++j)
    sound = sound && s.d1[j].allFinite() && std::isfinite(s.spin[j]) && std::isfinite(s.volume[j]) && s.volume[j] > 0 &&
            s.x[j] != s.x[j + 1];
  check(sound, "the state");
  return what.empty();
}

std::string ThreadWork::nameOf(const ThreadState& state) const
{
  const std::string piece = state.thread_id > 0 ? ", piece " + std::to_string(state.thread_id) + " that broke off" : "";
  return "thread '" + model->name + "'" + piece + ": ";
}

std::string ThreadWork::explainFailure(StepFailure failure, double length) const
{
  const std::string at = " at a step of " + milliseconds(length);
  if (failure == StepFailure::overstretched)
    return "it is drawn out so far that more than 10000 edges would have to be divided" + at +
           ": check the motion of nozzle and belt, or use a longer max_edge_length";
  if (const int j = overgrownEdge(); j >= 0)
  {
    const bool at_nozzle = j + 1 == work.edges() && work.ends[1].held;
    return "edge " + std::to_string(j) + " of " + std::to_string(work.edges()) + " has grown " +
           millimetres(work.radius(j)) + " wide in radius over a length of " + millimetres(work.edge(j).norm()) +
           (at_nozzle && !work.deposited[j] && model->surface_tension > 0
                ? ": surface tension draws it up into the nozzle faster than it flows out. Use more flow or a finer "
                  "nozzle"
            : at_nozzle ? ", because the nozzle is too near to what the fluid lands on: raise the nozzle"
                        : ", which is a puddle and no thread: use a more viscous fluid, or less flow or height") +
           (j + 1 == work.edges() ? ", or use shorter edges.feed" : ", or shorter edges.longest");
  }
  if (explicit_step)
    return "the explicit step blew up" + at + ": use a shorter step or implicit_euler";
  const auto radii = rangeOfRadii(work);
  switch (failure)
  {
    case StepFailure::folded_back:
      return "two consecutive edges point (nearly) opposite ways" + at + ": use shorter edges or a shorter step" +
             (model->floor.present && work.ends[1].held ? ", and keep the nozzle above the floor" : "");
    case StepFailure::singular_matrix:
      return "the matrix could not be made definite" + at + ": radii (" + millimetres(radii.first) + " to " +
             millimetres(radii.second) +
             ") or edge lengths differ by too many orders of magnitude, or a nozzle is too fast by as many. Use a "
             "larger breakup_radius" +
             (model->limits.min_radius > 0 ? " than " + millimetres(model->limits.min_radius)
                                           : ", which is not set here") +
             ", so that the thread parts before it is so thin";
    case StepFailure::state_not_finite:
      return "the configuration overflowed" + at + ": use a shorter step or check the inputs for jumps";
    case StepFailure::squeezed:
      return "contact leaves no room for what lies between what is held or driven" + at +
             ": give way, or move it more slowly";
    default:
      return "Newton's method did not converge" + at +
             ": use a shorter step, more time.newton.max_iterations or max_cuts, or move the nozzle slowly";
  }
}

/// What is known of a disc, an edge that is wider in radius than long, next to a node: slender theory does not hold
/// there, so a shorter step helps little. Empty: there is none.
std::string ThreadWork::explainDisc(int node) const
{
  constexpr int kNear = 2;   // edges on each side: the whole stencil of the node's equations
  int disc = -1;
  for (int j = std::max(0, node - kNear); j < std::min(work.edges(), node + kNear); ++j)
    if (work.radius(j) > work.edge(j).norm() &&
        (disc < 0 || work.radius(j) / work.edge(j).norm() > work.radius(disc) / work.edge(disc).norm()))
      disc = j;
  if (disc < 0)
    return "";
  const double radius = work.radius(disc), low = std::min(work.x[disc].z(), work.x[disc + 1].z());
  const bool puddle = work.deposited[disc] || work.deposited[disc + 1] ||
                      (model->floor.present && low - model->floor.height < 2.0 * radius);
  return ". Edge " + std::to_string(disc) + " beside it is a disc, " + millimetres(radius) + " wide in radius and " +
         millimetres(work.edge(disc).norm()) + " long, " +
         (puddle ? "in a puddle on the floor, which is no thread: use a more viscous fluid, or less flow or height, or "
                   "a longer edges.shortest, by which short edges are joined"
                 : "which is no thread: use a longer edges.shortest, by which short edges are joined, or a larger "
                   "breakup_radius");
}

Largest ThreadWork::unbalancedForce() const
{
  Largest force;
  for (int i = std::max(first_, 0); i < work.nodes(); ++i)
    if (const int k = inSystem(i); k >= 0 && k < system.nodes() && !isHeld(i))
      force.add(i, system.nodeGradient(k).norm());
  return force;
}

StepReport ThreadWork::refuseUnsolved(StepReport& report, StepFailure failure, double length) const
{
  std::string text = explainFailure(failure, length);
  const int grown = overgrownEdge();
  const Largest force = grown < 0 ? unbalancedForce() : Largest();
  if (grown >= 0 || force.any())
  {
    const int node = grown >= 0 ? grown : force.index();
    report.place = {FailurePlace::Kind::thread, model->name, node, work.x[node]};
    text += grown >= 0 ? ". The edge begins"
                       : ". The largest unbalanced force is " + force.text("N") + ", on node " + std::to_string(node) +
                             " of " + std::to_string(work.nodes()) + ", which was";
    text += " at " + metres(report.place.position) + (grown >= 0 ? "" : " as the step began" + explainDisc(node));
  }
  return report.refuse(failure, nameOf(work) + text);
}

bool ThreadWork::accepts(const ThreadState& state, const ThreadInputs& inputs, double duration,
                         StepReport& report) const
{
  const auto refused = [&](const std::string& message) {
    report.refuse(StepFailure::input_not_finite, nameOf(state) + message);
    return false;
  };
  std::string what;
  if (!inputsFinite(state, inputs, duration, what))
    return refused(what + " is not finite or not valid; correct this input");
  if (model->floor.sticks() && state.ends[1].held && model->nozzle_diameter > 0 &&
      !(inputs.ends[1].position.z() > model->floor.height))
    return refused("the nozzle is at a height of " + millimetres(inputs.ends[1].position.z()) +
                   ", not above its floor at " + millimetres(model->floor.height) + "; keep it above");
  constexpr double kMostFed = 1e4;   // edges in one step
  if (!(flowSpeed(inputs) * duration <= kMostFed * model->feed_length))
    return refused(
        "flow rate feeds more than 10000 edges of feed_length in one step; lower it, or use a shorter step or longer "
        "feed_length");
  return true;
}

void ThreadWork::begin(const ThreadState& state, const ThreadInputs& step_inputs, double step_duration)
{
  inputs = &step_inputs;
  duration = step_duration;
  work = state;
  start_ends = state.ends;
  loads = {};
  flow_speed_ = flowSpeed(step_inputs);
}

int ThreadWork::foldedNode(double& cosine) const
{
  for (int k = system.sharpestJoint(cosine); k >= 0; k = system.sharpestJoint(cosine))
    if (const int node = k - offset_ + first_; node > 0 && node + 1 < work.nodes())
      return node;
  return -1;
}

Pose ThreadWork::endPose(int end, double fraction) const
{
  const Pose &a = start_ends[end].X_WE, &b = inputs->ends[end];
  if (fraction >= 1.0)
    return {b.position, b.orientation.normalized()};
  return {a.position + fraction * (b.position - a.position), a.orientation.slerp(fraction, b.orientation).normalized()};
}

StepFailure ThreadWork::beginSubstep(const Substep& next_substep)
{
  substep = next_substep;
  for (int end = 0; end < 2; ++end)
    if (work.ends[end].held)
      end_poses[end] = endPose(end, substep.to / duration);
  landed.assign(work.nodes(), 0);
  if (!loadSystem())
    return StepFailure::folded_back;
  setResponse();
  setTrial();
  return StepFailure::none;
}

StepFailure ThreadWork::changeMesh(const RemeshGuard* guard)
{
  if (!remesh(guard))
    return StepFailure::overstretched;
  return overgrownEdge() >= 0 ? StepFailure::squeezed : StepFailure::none;
}

}   // namespace slender
