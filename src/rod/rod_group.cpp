#include "slender_sim/rod/rod_group.h"

#include <algorithm>
#include <limits>
#include <stdexcept>

#include "rod_group_impl.h"

namespace slender {

namespace {

void check(const RodGroupModel& model, Integrator integrator)
{
  const auto need = [](bool good, const std::string& what) {
    if (!good)
      throw std::invalid_argument(what);
  };
  need(integrator != Integrator::symplectic_euler || model.contact.rods.empty(),
       "symplectic_euler takes no contact, whose forces are too stiff for explicit steps: take implicit_euler, bdf2 or "
       "tr_bdf2 (time.integrator)");
  for (const RigidBodyModel& body : model.bodies)
    checkBody(body);
  const int rods = static_cast<int>(model.rods.size()), bodies = static_cast<int>(model.bodies.size());
  for (const Weld& w : model.welds)
    need(w.rod >= 0 && w.rod < rods && w.body >= 0 && w.body < bodies,
         "a weld names rod " + std::to_string(w.rod) + " and body " + std::to_string(w.body) + "; there are " +
             std::to_string(rods) + " rods and " + std::to_string(bodies) + " bodies");
  for (const GroupContact::Rod& r : model.contact.rods)
    need(r.rod >= 0 && r.rod < rods,
         "contact names rod " + std::to_string(r.rod) + "; there are " + std::to_string(rods));
  for (const GroupContact::Body& b : model.contact.bodies)
    need(b.body >= 0 && b.body < bodies,
         "contact names body " + std::to_string(b.body) + "; there are " + std::to_string(bodies));
}

}   // namespace

Weld makeWeld(RodGroupModel& model, RodGroupState& state, int rod, int first_node, int last_node, int body)
{
  GraspState grasp = makeGrasp(*model.rods.at(rod), state.rods.at(rod), first_node, last_node, true);
  grasp.body = model.bodies.at(body).simulated ? body : -1;
  Weld weld{rod, static_cast<int>(state.rods[rod].grasps.size()), body,
            state.bodies.at(body).X_WB.inverse() * grasp.X_WG};
  state.rods[rod].grasps.push_back(grasp);
  model.welds.push_back(weld);
  return weld;
}

RodGroup::RodGroup(RodGroupModel model, const TimeConfig& time)
{
  check(model, time.integrator);
  // the points of contact are those of the rods, in their order
  std::sort(model.contact.rods.begin(), model.contact.rods.end(),
            [](const GroupContact::Rod& a, const GroupContact::Rod& b) { return a.rod < b.rod; });
  impl_ = std::make_unique<Impl>(std::move(model), time);
}
RodGroup::~RodGroup() = default;
RodGroup::RodGroup(RodGroup&&) noexcept = default;

StepReport RodGroup::step(RodGroupState& state, const RodGroupInputs& inputs, double duration)
{
  return impl_->step(state, inputs, duration);
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
    throw std::invalid_argument("rods, bodies or obstacles with contact touch or cross by " +
                                std::to_string(-1e3 * room) +
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
    coupled->setThreads(threads);
}

}   // namespace slender
