#include "slender_sim/rod/rod_stepper.h"

#include <algorithm>
#include <cmath>
#include <stdexcept>

#include "dynamics/statics_advice.h"
#include "island/island.h"
#include "island/statics.h"
#include "rod_part.h"
#include "slender_sim/geometry/rotation.h"

namespace slender {

/// What steps a rod that nothing else meets, and finds its equilibria.
struct RodStepper::Alone
{
  explicit Alone(RodWork& own) : rod(own), part(rod, false), island(rod.time, false)
  {
    island.equations().tolerances.angles_may_keep_shift = RodSystem::anglesMayKeepShift();
    island.setParts({&part});
    statics.setParts(island.equations(), {&part}, rod.time.newton);
  }

  /// Searches for an equilibrium from `state`. Without `search` it only tells whether `state` is stable.
  StepReport equilibrium(RodState& state, const RodInputs& inputs, bool search, bool leave_saddles);

  RodWork& rod;
  RodPart part;
  Island island;
  Statics statics;
};

StepReport RodStepper::Alone::equilibrium(RodState& state, const RodInputs& inputs, bool search, bool leave_saddles)
{
  RodInputs loads = inputs;
  RodState start = state;
  start.forgetHistory();
  start.v.setZero();
  for (GraspTarget& g : loads.grasps)
    g.velocity.reset();
  for (GraspState& g : start.grasps)
    g.velocity = Twist{};
  rod.begin(start, loads, 1.0);
  addFrames(*rod.model, rod.work);
  rod.system.load(rod.work);
  rod.system.setTwistLoads(loads.torques);
  const StepFailure failure = statics.solve(search, leave_saddles);
  StepReport report = statics.report();
  if (failure == StepFailure::newton_diverged && !(report.residual < kMostUnbalanced))
    return rod.refuse(report, failure,
                      "no equilibrium was found: nothing balances the loads, so that the rod drifts: hold it by a "
                      "grasp, or let it move by time stepping (start: as_given)");
  if (failure != StepFailure::none)
    return rod.refuse(report, failure, explainStatics(failure));
  rod.computeWrenches(0.0);
  for (std::size_t k = 0; k < start.grasps.size(); ++k)
    if (rod.work.grasps[k].active)
      rod.work.grasps[k].X_WG = {loads.grasps[k].X_WG.position, loads.grasps[k].X_WG.orientation.normalized()};
  if (search)
    state = rod.work;
  return report;
}

RodStepper::RodStepper(std::shared_ptr<const RodModel> model, const TimeConfig& time)
  : work_(std::make_unique<RodWork>(std::move(model), time))
{
}
RodStepper::~RodStepper() = default;
RodStepper::RodStepper(RodStepper&&) noexcept = default;

/// Returns whether a step or a search from this state can begin, and prepares it. If not, the report says why.
bool RodStepper::accepts(const RodState& state, const RodInputs& inputs, StepReport& report)
{
  std::string what;
  const bool valid = work_->inputsFinite(state, inputs, what);
  if (!valid)
    work_->refuse(report, StepFailure::input_not_finite, what + " is not finite or not valid; correct this input");
  else if (!alone_)
    alone_ = std::make_unique<Alone>(*work_);
  return valid;
}

StepReport RodStepper::step(RodState& state, const RodInputs& inputs, double duration)
{
  StepReport report;
  if (!(duration > 0) || !std::isfinite(duration))
    return work_->refuse(report, StepFailure::input_not_finite,
                         "step length must be positive and finite, got " + std::to_string(duration));
  if (!accepts(state, inputs, report))
    return report;
  work_->begin(state, inputs, duration);
  report = alone_->island.step(duration, work_->work.next_step);
  if (report.ok)
    state = work_->work;
  return report;
}
StepReport RodStepper::solveEquilibrium(RodState& state, const RodInputs& inputs, bool leave_saddles)
{
  StepReport report;
  return accepts(state, inputs, report) ? alone_->equilibrium(state, inputs, true, leave_saddles) : report;
}
StepReport RodStepper::assessEquilibrium(const RodState& state, const RodInputs& inputs)
{
  StepReport report;
  RodState copy = state;
  return accepts(state, inputs, report) ? alone_->equilibrium(copy, inputs, false, false) : report;
}
Eigen::Map<const Eigen::Matrix4Xd> RodStepper::lowestMode() const
{
  if (!alone_)
    return {nullptr, 4, 0};
  const Eigen::VectorXd& mode = alone_->statics.mode();
  return {mode.data(), 4, mode.size() / 4};
}
const std::vector<Wrench>& RodStepper::wrenches() const { return work_->wrenches; }
const RodModel& RodStepper::model() const { return *work_->model; }

RodWork::RodWork(std::shared_ptr<const RodModel> m, const TimeConfig& t)
  : model(std::move(m)),
    time(t),
    system(*model),
    without_frames(doesWithoutFrames(*model))
{
  if (time.integrator == Integrator::imex)
    throw std::invalid_argument("rod '" + model->name + "': imex is for cloth only");
  if (model->isotropic && time.integrator == Integrator::symplectic_euler)
    isotropic = std::make_unique<IsotropicRod>(*model, system);
}

void RodWork::begin(const RodState& state, const RodInputs& step_inputs, double step_duration)
{
  inputs = &step_inputs;
  duration = step_duration;
  const std::size_t grasps = state.grasps.size();
  stage_poses.resize(grasps);
  carried_velocity.resize(grasps);
  wrenches.resize(grasps);
  for (std::size_t k = 0; k < grasps; ++k)
    stage_poses[k] = state.grasps[k].X_WG;
  origin = &state.grasps;
  work = state;
  const bool holds_frame = std::any_of(work.grasps.begin(), work.grasps.end(),
                                       [](const GraspState& g) { return g.active && g.holds_frame; });
  if (!isotropic || holds_frame)
    addFrames(*model, work);
}

void RodWork::accept()
{
  for (std::size_t k = 0; k < next.grasps.size(); ++k)
  {
    GraspState& g = next.grasps[k];
    if (!g.active)
      continue;
    if (g.body >= 0)
    {
      g.X_WG = stage_poses[k];
      g.velocity = carried_velocity[k];
    }
    else
      g.X_WG = graspPose(k, substep.to / duration, &g.velocity);
  }
  std::swap(work, next);
}

bool RodWork::inputsFinite(const RodState& state, const RodInputs& inputs, std::string& what) const
{
  const int nodes = model->nodes();
  // names are built only when they are needed: a good step takes no memory
  const auto check = [&](bool good, const char* name, std::size_t number = std::string::npos) {
    if (!good && what.empty())
      what = number == std::string::npos ? std::string(name) : name + std::to_string(number);
    return good;
  };
  const auto refuse_count = [&](const char* name, std::size_t count, std::size_t expected) {
    what = std::string("number of ") + name + " (" + std::to_string(count) + " for " + std::to_string(expected) + ")";
    return false;
  };
  bool good = check(inputs.gravity.allFinite(), "gravity") && check(inputs.wind.allFinite(), "wind") &&
              check(inputs.forces.allFinite(), "a nodal force") && check(inputs.torques.allFinite(), "a torque");
  if (state.x.cols() != nodes || state.v.cols() != nodes)
    return refuse_count("nodes of the state", state.x.cols(), nodes);
  if (inputs.grasps.size() != state.grasps.size())
    return refuse_count("grasp targets", inputs.grasps.size(), state.grasps.size());
  if (inputs.forces.cols() != 0 && inputs.forces.cols() != state.x.cols())
    return refuse_count("nodal forces", inputs.forces.cols(), state.x.cols());
  if (inputs.torques.size() != 0 && inputs.torques.size() != model->edges())
    return refuse_count("torques", inputs.torques.size(), model->edges());
  if (inputs.torques.size() != 0 && (isotropic || time.integrator == Integrator::implicit_midpoint ||
                                     time.integrator == Integrator::generalized_alpha))
  {
    what =
        isotropic
            ? "a torque about the tangent, which the isotropic formulation does not have (formulation: general has it),"
            : "a torque about the tangent, whose work the energy check of this integrator does not know (tr_bdf2 has "
              "none),";
    return false;
  }
  for (std::size_t k = 0; k < inputs.grasps.size(); ++k)
  {
    const GraspTarget& g = inputs.grasps[k];
    if (!state.grasps[k].active || state.grasps[k].body >= 0)
      continue;
    const double norm = g.X_WG.orientation.norm();
    good =
        good &&
        check(g.X_WG.position.allFinite() && std::isfinite(norm) && std::abs(norm - 1.0) < 1e-3, "pose of grasp ", k) &&
        check(!g.velocity || (g.velocity->linear.allFinite() && g.velocity->angular.allFinite()), "velocity of grasp ",
              k);
  }
  bool sound = state.x.allFinite() && state.v.allFinite() && state.d1.allFinite() && state.twist.allFinite() &&
               state.a.allFinite() && state.x_previous.allFinite() && state.v_previous.allFinite() &&
               state.strain_rate.allFinite() && state.strain_rate_previous.allFinite() &&
               state.strain_previous.allFinite();
  for (const Eigen::VectorXd* spin : {&state.spin, &state.spin_rate, &state.spin_previous, &state.turn_previous})
  {
    if (spin->size() != 0 && spin->size() != model->edges())
      return refuse_count("spins", spin->size(), model->edges());
    sound = sound && spin->allFinite();
  }
  for (const GraspState& g : state.grasps)
    sound = sound && (!g.active || (g.X_WG.position.allFinite() && g.X_WG.orientation.coeffs().allFinite() &&
                                    g.velocity.linear.allFinite() && g.velocity.angular.allFinite() &&
                                    std::isfinite(g.section_twist[0]) && std::isfinite(g.section_twist[1])));
  return good && check(sound, "the state") &&
         check(framesFit(*model, state) && (state.framed() || without_frames), "the set of material frames");
}

double RodWork::startEnergy(double* allowance)
{
  system.load(work);
  system.setResponse(0.0, nullptr);
  return mechanicalEnergy(work, system.evaluate(false), allowance);
}

/// Elastic (as evaluated) plus kinetic energy and the loads' potential. `allowance`: growth that errors of a sound step
/// may show.
double RodWork::mechanicalEnergy(const RodState& s, const RodEvaluation& e, double* allowance) const
{
  double kinetic = 0.0, potential = 0.0, weight = 0.0;
  for (int i = 0; i < model->nodes(); ++i)
  {
    const Eigen::Vector3d f = load(i);
    kinetic += 0.5 * model->mass[i] * s.v.col(i).squaredNorm();
    potential -= f.dot(s.x.col(i));
    weight += f.norm();
  }
  kinetic += spinEnergy(s);
  if (allowance)
    *allowance = 0.05 * (kinetic + e.stretch + e.bend_twist + weight * model->rest_length.sum()) +
                 1e-12 * model->stretch_modulus.dot(model->rest_length);   // a rod at rest: strains of a millionth
  return e.stretch + e.bend_twist + potential + kinetic;
}

StepReport RodWork::refuse(StepReport& report, StepFailure failure, const std::string& message)
{
  return report.refuse(failure, "rod '" + model->name + "': " + message);
}

std::string RodWork::explainFailure(StepFailure failure, double length) const
{
  const bool explicit_step = isExplicit(time.integrator);
  const std::string at = " at a step of " + milliseconds(length);
  switch (failure)
  {
    case StepFailure::folded_back:
      return "two consecutive edges point (nearly) opposite ways" + at +
             ": use more edges, a stiffer rod or a slower motion" +
             (explicit_step
                  ? "; if the motion is slow, the explicit step blew up: use a shorter step or an implicit integrator"
                  : "");
    case StepFailure::singular_matrix:
      return "the stiffness matrix could not be made definite" + at +
             ": moduli or masses differ by too many orders of magnitude, or a grasp or force is too fast or too large "
             "by as many";
    case StepFailure::state_not_finite:
      return explicit_step ? "the explicit step blew up" + at + ": use a shorter step or an implicit integrator"
                           : "the configuration overflowed" + at + ": use a shorter step or check the inputs for jumps";
    case StepFailure::squeezed:
      return "contact: grasps, driven bodies or obstacles press on the rods and leave them no room" + at +
             ": slow these motions down, or use a shorter step";
    case StepFailure::overstretched:
      return overstretched[0] >= 0
                 ? "nodes " + std::to_string(overstretched[0]) + " and " + std::to_string(overstretched[1]) +
                       " are held as far apart as the rod between them is long, or further" + at +
                       ": bring the grasps closer together (projection needs some slack), or let the rod stretch "
                       "(stretching: stiff)"
                 : "the projection found no configuration in which all edges keep their lengths" + at +
                       ": use a shorter step, give a taut rod some slack, or let it stretch (stretching: stiff)";
    case StepFailure::turned_too_far:
      return "the twist changed by about half a turn" + at +
             ": use a shorter step or slower grasps, or formulation: general, which counts turns by the edge";
    case StepFailure::energy_grew:
      return "the energy grew out of nothing" + at +
             ": use a shorter step, or tr_bdf2, bdf2 or implicit_euler, which damp what the step cannot resolve";
    default:
      return "Newton's method did not converge" + at +
             ": use a shorter step, more time.newton.max_iterations or max_cuts, or slow the grasps down";
  }
}

Largest RodWork::unbalancedForce() const
{
  Largest force;
  for (int i = 0; i < system.arrays().nodes; ++i)   // none before the first load()
    if (system.isFree(i))
      force.add(i, system.nodeGradient(i).norm());
  return force;
}

void RodWork::refuseUnsolved(StepReport& report, StepFailure failure, double length, const std::string& why)
{
  const bool explicit_step = isExplicit(time.integrator);
  // explicit steps end in a state that says nothing; that at their start shows what is about to blow up
  Largest strain, node;
  const bool implicit = !explicit_step && system.arrays().nodes == model->nodes();
  for (int j = 0; j < model->edges(); ++j)
    strain.add(
        j, implicit
               ? std::abs(system.arrays().strain[j])
               : std::abs((work.x.col((j + 1) % model->nodes()) - work.x.col(j)).norm() / model->rest_length[j] - 1.0));
  if (implicit)
    node = unbalancedForce();
  else
    for (int i = 0; i < model->nodes() && explicit_step; ++i)
      node.add(i, work.v.col(i).norm());
  const int at = node.any() ? node.index() : strain.index();
  report.place = {FailurePlace::Kind::rod, model->name, at, work.x.col(at)};
  std::string text =
      ". The largest stretch strain is " + strain.text("") + ", in edge " + std::to_string(strain.index());
  if (node.any())
    text += explicit_step
                ? "; node " + std::to_string(at) + " is the fastest, with " + node.text("m/s") + "; it"
                : "; the largest unbalanced force is " + node.text("N") + ", on node " + std::to_string(at) + ", which";
  else
    text += ", whose first node";
  text += " was at " + metres(report.place.position) + " as the step began";
  refuse(report, failure, (why.empty() ? explainFailure(failure, length) : why) + text);
}

void RodWork::placeAt(double fraction)
{
  for (std::size_t k = 0; k < stage_poses.size(); ++k)
    if (work.grasps[k].active && work.grasps[k].body < 0)
      stage_poses[k] = graspPose(k, fraction, nullptr);
  system.placeGrasps(stage_poses);
}

/// load per node that does not depend on the configuration: weight, wind drag, extra forces
Eigen::Vector3d RodWork::load(int i) const
{
  Eigen::Vector3d f = model->mass[i] * inputs->gravity;
  if (model->drag.size() > 0)
    f += model->drag[i] * inputs->wind;
  if (inputs->forces.cols() > 0)
    f += inputs->forces.col(i);
  return f;
}

RodEnergies RodStepper::energies(const RodState& state, const Eigen::Vector3d& gravity) const
{
  return work_->energies(state, gravity);
}

RodEnergies RodWork::energies(const RodState& state, const Eigen::Vector3d& gravity)
{
  const RodModel& m = *model;
  RodEnergies result;
  for (int i = 0; i < m.nodes(); ++i)
  {
    result.kinetic += 0.5 * m.mass[i] * state.v.col(i).squaredNorm();
    result.gravity -= m.mass[i] * gravity.dot(state.x.col(i));
  }
  result.kinetic += spinEnergy(state);
  if (isotropic)
  {
    const RodEvaluation e = isotropic->evaluate(state);
    result.stretch = e.stretch;
    result.twist = isotropic->twistEnergy();
    result.bend = e.bend_twist - result.twist;
    return result;
  }
  if (!state.framed())
  {
    RodState framed = state;
    addFrames(m, framed);
    return energies(framed, gravity);
  }
  system.leaveOutStretching(false);
  system.load(state);
  system.setResponse(0.0, nullptr);
  system.setTwistLoads({});
  for (int i = 0; i < m.nodes(); ++i)
    system.setInertia(i, 0.0, Eigen::Vector3d::Zero(), Eigen::Vector3d::Zero());
  const RodEvaluation e = system.evaluate(false);
  result.stretch = e.stretch;
  const RodArrays& a = system.arrays();
  for (int i = 0; i < m.nodes(); ++i)
  {
    const double q = a.twist[i] - a.rest_twist[i];
    result.twist += 0.5 * a.beta[i] * q * q;
  }
  for (const ClampJoint& c : system.clamps())
    result.twist += 0.5 * c.beta * (c.twist - c.rest_twist) * (c.twist - c.rest_twist);
  result.bend = e.bend_twist - result.twist;
  return result;
}

}   // namespace slender
