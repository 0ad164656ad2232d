#include "slender_sim/rod/rod_group.h"

#include <algorithm>
#include <limits>
#include <stdexcept>

#include "slender_sim/geometry/rotation.h"
#include "step_loop.h"

namespace slender {

class RodGroup::Impl
{
public:
  Impl(RodGroupModel m, const TimeConfig& t) : model(std::move(m)), time(t)
  {
    std::vector<RodStepper::Impl*> parts;
    for (const auto& rod : model.rods)
    {
      rods.push_back(std::make_unique<RodStepper::Impl>(rod, time));
      parts.push_back(rods.back().get());
    }
    loop = std::make_unique<StepLoop>(time, parts, &model);
  }

  StepReport step(RodGroupState& state, const RodGroupInputs& inputs, double duration);
  StepReport solveEquilibrium(RodGroupState& state, const RodGroupInputs& inputs);

  RodGroupModel model;
  TimeConfig time;
  std::vector<std::unique_ptr<RodStepper::Impl>> rods;
  std::unique_ptr<StepLoop> loop;
  int threads = 0;
  RodGroupInputs inputs;   ///< with the targets of grasps that driven bodies carry
};

namespace {

void check(const RodGroupModel& model, Integrator integrator)
{
  const auto need = [](bool good, const std::string& what) {
    if (!good)
      throw std::invalid_argument(what);
  };
  need(integrator != Integrator::symplectic_euler || model.contact.rods.empty(),
       "symplectic_euler takes no contact, whose forces are too stiff for explicit steps: take implicit_euler, bdf2 or tr_bdf2 (time.integrator)");
  for (const RigidBodyModel& body : model.bodies)
    checkBody(body);
  const int rods = static_cast<int>(model.rods.size()), bodies = static_cast<int>(model.bodies.size());
  for (const Weld& w : model.welds)
    need(w.rod >= 0 && w.rod < rods && w.body >= 0 && w.body < bodies, "a weld names rod " + std::to_string(w.rod) + " and body " +
         std::to_string(w.body) + "; there are " + std::to_string(rods) + " rods and " + std::to_string(bodies) + " bodies");
  for (const GroupContact::Rod& r : model.contact.rods)
    need(r.rod >= 0 && r.rod < rods, "contact names rod " + std::to_string(r.rod) + "; there are " + std::to_string(rods));
  for (const GroupContact::Body& b : model.contact.bodies)
    need(b.body >= 0 && b.body < bodies, "contact names body " + std::to_string(b.body) + "; there are " + std::to_string(bodies));
}

}  // namespace

Weld makeWeld(RodGroupModel& model, RodGroupState& state, int rod, int first_node, int last_node, int body)
{
  GraspState grasp = makeGrasp(*model.rods.at(rod), state.rods.at(rod), first_node, last_node, true);
  grasp.body = model.bodies.at(body).simulated ? body : -1;
  Weld weld{rod, static_cast<int>(state.rods[rod].grasps.size()), body, state.bodies.at(body).X_WB.inverse() * grasp.X_WG};
  state.rods[rod].grasps.push_back(grasp);
  model.welds.push_back(weld);
  return weld;
}

RodGroup::RodGroup(RodGroupModel model, const TimeConfig& time)
{
  check(model, time.integrator);
  impl_ = std::make_unique<Impl>(std::move(model), time);
}
RodGroup::~RodGroup() = default;
RodGroup::RodGroup(RodGroup&&) noexcept = default;

StepReport RodGroup::step(RodGroupState& state, const RodGroupInputs& inputs, double duration) { return impl_->step(state, inputs, duration); }

StepReport RodGroup::solveEquilibrium(RodGroupState& state, const RodGroupInputs& inputs)
{
  TimeConfig time = impl_->time;
  time.integrator = Integrator::implicit_euler;
  time.error_tolerance = 0;
  time.newton.max_iterations = std::max(60, time.newton.max_iterations);
  time.newton.tolerance = std::min(1e-7, time.newton.tolerance);
  Impl settling(impl_->model, time);
  settling.loop->coupled()->threads = impl_->threads;
  const StepReport report = settling.solveEquilibrium(state, inputs);
  for (std::size_t r = 0; r < impl_->rods.size(); ++r)
    impl_->rods[r]->wrenches = settling.rods[r]->wrenches;
  return report;
}

/// What is left of the forces is what accelerates the rods in the last step.
StepReport RodGroup::Impl::solveEquilibrium(RodGroupState& state, const RodGroupInputs& targets)
{
  constexpr int kMaxRounds = 400;
  constexpr double kUnbalanced = 1e-8;   // of the largest force
  StepReport total;
  RodGroupState work = state, before;
  double h = time.step, force_scale = 0.0, lever = std::numeric_limits<double>::max();   // for moments beside forces: the shortest edge
  for (const auto& rod : model.rods)
    lever = std::min(lever, rod->rest_length.minCoeff());
  for (int round = 0, failures = 0; round < kMaxRounds; ++round)
  {
    for (RodState& rod : work.rods)
    {
      rod.forgetHistory();
      rod.v.setZero();
      for (GraspState& g : rod.grasps)
        g.velocity = {};
    }
    for (RigidBodyState& body : work.bodies)
    {
      body.velocity = {};
      body.has_history = false;
    }
    for (Twist& v : work.obstacle_velocities)
      v = {};
    before = work;
    StepReport report = step(work, targets, h);
    total.iterations += report.iterations;
    total.factorizations += report.factorizations;
    if (!report.ok)
    {
      h *= 0.1;
      if (++failures > 12)
      {
        report.message = "no equilibrium was found: " + report.message;
        report.iterations = total.iterations;
        return report;
      }
      continue;
    }
    ++total.substeps;
    double unbalanced = 0.0;
    for (std::size_t r = 0; r < work.rods.size(); ++r)
      for (int i = 0; i < model.rods[r]->nodes(); ++i)
        if (rods[r]->system.isMoving(i))
          unbalanced = std::max(unbalanced, model.rods[r]->mass[i] * (work.rods[r].x.col(i) - before.rods[r].x.col(i)).norm() / (h * h));
    for (std::size_t b = 0; b < work.bodies.size(); ++b)
      if (model.bodies[b].simulated)
      {
        const RigidBodyModel& m = model.bodies[b];
        const Pose &from = before.bodies[b].X_WB, &to = work.bodies[b].X_WB;
        const Eigen::Vector3d turn = rotationVector(from.orientation.conjugate() * to.orientation);
        unbalanced = std::max({unbalanced, m.mass * (to.position - from.position).norm() / (h * h), (m.inertia * turn).norm() / (lever * h * h)});
      }
    force_scale = std::max(force_scale, loop->coupled()->forceScale());
    total.residual = unbalanced / force_scale;
    total.max_strain = report.max_strain;
    if (round > 0 && total.residual < kUnbalanced)
    {
      for (RodState& rod : work.rods)
      {
        rod.forgetHistory();
        rod.v.setZero();
      }
      for (RigidBodyState& body : work.bodies)
      {
        body.velocity = {};
        body.has_history = false;
      }
      state = work;
      return total;
    }
    h = std::min(h * (report.iterations < 10 ? 4.0 : 1.5), 1e6);
  }
  total.ok = false;
  total.failure = StepFailure::newton_diverged;
  total.message = "the equilibrium did not settle: something may be free to drift; hold it, or let it settle by time stepping with damping";
  return total;
}

StepReport RodGroup::Impl::step(RodGroupState& state, const RodGroupInputs& step_inputs, double duration)
{
  Impl& m = *this;
  const RodGroupInputs& inputs = step_inputs;
  StepReport report;
  const auto sound = [](const GraspTarget& t) {
    return t.X_WG.position.allFinite() && std::abs(t.X_WG.orientation.norm() - 1.0) < 1e-3 &&
           (!t.velocity || (t.velocity->linear.allFinite() && t.velocity->angular.allFinite()));
  };
  std::string bad;
  if (state.rods.size() != m.model.rods.size() || inputs.rods.size() != state.rods.size())
    bad = "number of rods";
  if (state.bodies.size() != m.model.bodies.size() || inputs.bodies.size() != state.bodies.size())
    bad = "number of bodies";
  if (state.obstacles.size() != m.model.contact.obstacles.size() || inputs.obstacles.size() != state.obstacles.size() ||
      state.obstacle_velocities.size() != state.obstacles.size())
    bad = "number of obstacles";
  for (std::size_t b = 0; bad.empty() && b < inputs.bodies.size(); ++b)
    if (!m.model.bodies[b].simulated && !sound(inputs.bodies[b]))
      bad = "pose of body " + m.model.bodies[b].name;
  for (std::size_t k = 0; bad.empty() && k < inputs.obstacles.size(); ++k)
    if (!sound(inputs.obstacles[k]))
      bad = "pose of obstacle " + std::to_string(k);
  if (!inputs.gravity.allFinite())
    bad = "gravity";
  if (!bad.empty())
  {
    report.ok = false;
    report.failure = StepFailure::input_not_finite;
    report.message = bad + " is not finite or not valid; correct this input";
    return report;
  }
  m.inputs = step_inputs;
  for (const Weld& weld : m.model.welds)
    if (!m.model.bodies[weld.body].simulated)
    {
      const GraspTarget& body = inputs.bodies[weld.body];
      GraspTarget& grasp = m.inputs.rods[weld.rod].grasps[weld.grasp];
      grasp.X_WG = body.X_WG * weld.X_BG;
      grasp.velocity = body.velocity;
      if (grasp.velocity)
        grasp.velocity->linear += grasp.velocity->angular.cross(body.X_WG.orientation * weld.X_BG.position);
    }
  return m.loop->step(state.rods.data(), m.inputs.rods.data(), duration, &state, &m.inputs);
}

double RodGroup::clearance(const RodGroupState& state)
{
  CoupledSystem* coupled = impl_->loop->coupled();
  return coupled ? coupled->clearance(state) : std::numeric_limits<double>::infinity();
}

void RodGroup::checkClearance(const RodGroupState& state)
{
  const double room = clearance(state);
  if (!(room > 0))
    throw std::invalid_argument("rods, bodies or obstacles with contact touch or cross by " + std::to_string(-1e3 * room) +
                                " mm as the scene starts: move them apart, or take thinner rods");
}

const std::vector<Wrench>& RodGroup::wrenches(int rod) const { return impl_->rods.at(rod)->wrenches; }

RodEnergies RodGroup::energies(int rod, const RodState& state, const Eigen::Vector3d& gravity) const
{
  return impl_->rods.at(rod)->energies(state, gravity);
}

const RodGroupModel& RodGroup::model() const { return impl_->model; }
const std::vector<ContactTerm>& RodGroup::contacts() const
{
  static const std::vector<ContactTerm> none;
  const CoupledSystem* coupled = impl_->loop->coupled();
  return coupled ? coupled->contacts() : none;
}
void RodGroup::setThreads(int threads)
{
  impl_->threads = threads;
  if (CoupledSystem* coupled = impl_->loop->coupled())
    coupled->threads = threads;
}

}  // namespace slender
