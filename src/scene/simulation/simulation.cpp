#include "slender_sim/scene/simulation.h"

#include <algorithm>
#include <numeric>
#include <stdexcept>
#include <utility>

#include "slender_sim/scene/failure_surroundings.h"

namespace slender {

namespace {

Pose sectionOffset(const Pose& X_WM, const Pose& X_WG) { return X_WM.inverse() * X_WG; }

bool isIdentity(const Pose& X)
{
  return X.position == Eigen::Vector3d::Zero() && X.orientation.coeffs() == Eigen::Quaterniond::Identity().coeffs();
}

}   // namespace

Simulation::Simulation(SceneConfig config, bool solve_start) : config_(std::move(config)), gravity_(config_.gravity)
{
  buildRods();
  buildThreads();
  buildCloths();
  buildBodies();
  buildTouchingThreads();
  buildTouchingCloths();
  buildGroup();
  state_.grasp_offsets.resize(grasps_.size());
  state_.wrenches.resize(grasps_.size());
  for (std::size_t g = 0; g < grasps_.size(); ++g)
  {
    const auto* table = std::get_if<TableMotion>(&grasps_[g].config->motion);
    if (grasps_[g].config->attach == Attach::initial)
      takeOffset(static_cast<int>(g), table ? table->poses.firstTime() : 0.0);
  }
  if (config_.start.equilibrium && solve_start)
    findEquilibrium();
  initial_ = state_;
}

void Simulation::inputsAt(double time, SceneInputs& inputs) const
{
  inputs.wind = config_.wind;
  const auto given = [time](const GivenMotion& motion, const Pose& now) {
    GraspTarget target{now, Twist{}};
    if (const auto* table = std::get_if<TableMotion>(&motion))
      target.X_WG = table->poses.evaluate(time, &*target.velocity);
    return target;
  };
  inputs.bodies.clear();
  for (std::size_t b = 0; b < config_.bodies.size(); ++b)
    inputs.bodies.push_back(given(config_.bodies[b].motion.value_or(FixedMotion{}), state_.bodies[b].X_WB));
  inputs.obstacles.clear();
  for (std::size_t k = 0; k < config_.obstacles.size(); ++k)
    inputs.obstacles.push_back(given(config_.obstacles[k].motion, state_.obstacles[k]));
  addThreadInputs(inputs, time);
  addGuideInputs(inputs, time);
  addRodGuides(inputs, time);
  inputs.grasps.clear();
  inputs.grasps.reserve(grasps_.size());
  for (std::size_t g = 0; g < grasps_.size(); ++g)
  {
    const auto* table = std::get_if<TableMotion>(&grasps_[g].config->motion);
    if (table && isActive(static_cast<int>(g)))
    {
      Twist velocity;
      const Pose pose = table->poses.evaluate(time, &velocity);
      inputs.grasps.push_back(targetOf(static_cast<int>(g), pose, velocity));
    }
    else
    {
      inputs.grasps.push_back({graspPose(static_cast<int>(g)), Twist{}});
    }
  }
}

void Simulation::defaultInputs(SceneInputs& inputs) const
{
  inputsAt(static_cast<double>(state_.steps + 1) * config_.time.step, inputs);
}

SceneInputs Simulation::defaultInputs() const
{
  SceneInputs inputs;
  defaultInputs(inputs);
  return inputs;
}

GraspTarget Simulation::targetOf(int grasp, const Pose& X_WM, const std::optional<Twist>& velocity) const
{
  checkGrasp(grasp);
  const Pose& offset = state_.grasp_offsets[grasp];
  if (isIdentity(offset))
    return {X_WM, velocity};   // not multiplied by an identity, which would round
  GraspTarget target{X_WM * offset, velocity};
  if (velocity)
    target.velocity->linear += velocity->angular.cross(X_WM.orientation * offset.position);
  return target;
}

void Simulation::setOffset(int grasp, const Pose& X_WM)
{
  checkGrasp(grasp);
  state_.grasp_offsets[grasp] = sectionOffset(X_WM, graspPose(grasp));
}

void Simulation::checkInputs(const SceneInputs& inputs) const
{
  const auto check = [](const char* name, std::size_t given, std::size_t expected, const char* of) {
    if (given != expected)
      throw std::invalid_argument(std::string("inputs.") + name + " has " + std::to_string(given) +
                                  " targets; must have " + std::to_string(expected) + ", one per " + of +
                                  " of the scene");
  };
  check("grasps", inputs.grasps.size(), grasps_.size(), "grasp");
  check("bodies", inputs.bodies.size(), config_.bodies.size(), "body");
  check("threads", inputs.threads.size(), config_.threads.size(), "thread");
  check("obstacles", inputs.obstacles.size(), config_.obstacles.size(), "obstacle");
  checkGuides(inputs);
  checkRodGuides(inputs);
}

void Simulation::fillRodInputs(const SceneInputs& inputs)
{
  checkInputs(inputs);
  rod_inputs_.resize(models_.size());
  for (std::size_t r = 0; r < models_.size(); ++r)
  {
    rod_inputs_[r].gravity = gravity_;
    rod_inputs_[r].forces = rod_loads_[r].forces;
    rod_inputs_[r].torques = rod_loads_[r].torques;
    rod_inputs_[r].wind = inputs.wind;
    rod_inputs_[r].grasps.resize(state_.rods[r].grasps.size());   // welds last: the group fills them
  }
  for (std::size_t g = 0; g < grasps_.size(); ++g)
    if (grasps_[g].rod >= 0)
      rod_inputs_[grasps_[g].rod].grasps[grasps_[g].index] = drivenTarget(static_cast<int>(g), inputs);
}

GraspTarget Simulation::drivenTarget(int grasp, const SceneInputs& inputs) const
{
  const auto* body = std::get_if<BodyMotion>(&grasps_[grasp].config->motion);
  const GraspTarget* frame = body && isActive(grasp) ? followed(*body, inputs) : nullptr;
  return frame ? targetOf(grasp, frame->X_WG, frame->velocity) : inputs.grasps[grasp];
}

StepReport Simulation::step(const SceneInputs& inputs)
{
  fillRodInputs(inputs);
  // One part's failure must leave the others where they were, too.
  const std::size_t apart =
      models_.size() - group_rods_.size() + (group_ ? 1 : 0) + config_.threads.size() + config_.cloths.size();
  const bool several = apart > 1 || functionsDue();
  const std::vector<RodState> before = several ? state_.rods : std::vector<RodState>();
  const std::vector<ThreadGroupState> threads_before = several ? state_.threads : std::vector<ThreadGroupState>();
  const std::vector<SceneCloth> cloths_before = several ? state_.cloths : std::vector<SceneCloth>();
  const double stiffness_before = state_.thread_contact_stiffness;
  const auto restore = [&] {
    if (several)
    {
      state_.rods = before;
      state_.threads = threads_before;
      state_.cloths = cloths_before;
      state_.thread_contact_stiffness = stiffness_before;
    }
  };
  StepReport total;
  try
  {
    takeOver();
    total = stepThreads(inputs);
    if (total.ok)
      total.merge(stepCloths(inputs));
    if (total.ok)
    {
      takeRodTargets(inputs);
      total.merge(stepAll());
    }
    if (total.ok && group_)
      total.merge(stepGroup(inputs, false));
  }
  catch (...)
  {
    restore();
    throw;
  }
  if (!total.ok)
  {
    restore();
    total.message += surroundingsOf(*this, total.place);
    return total;
  }
  moveGiven(inputs);
  ++state_.steps;
  state_.time = static_cast<double>(state_.steps) * config_.time.step;   // no sum of round-off
  takeWrenches();
  takeClothWrenches();
  takeGuides(inputs, total);
  takeRodGuides(inputs, total);
  return total;
}

void Simulation::setThreads(int threads)
{
  if (threads < 1)
    throw std::invalid_argument("threads = " + std::to_string(threads) + "; must be at least 1");
  threads_ = threads;
  if (group_)
    group_->setThreads(threads);
}

void Simulation::takeWrenches()
{
  for (std::size_t g = 0; g < grasps_.size(); ++g)
  {
    const int rod = grasps_[g].rod;
    if (rod >= 0)
      state_.wrenches[g] = rodWrenches(rod)[grasps_[g].index];
  }
  for (std::size_t k = 0; k < thread_steppers_.size(); ++k)
  {
    state_.end_loads[k] =
        thread_steppers_[k] ? thread_steppers_[k]->endLoads() : touching_->endLoads(touching_index_[k]);
  }
}

void Simulation::reset() { state_ = initial_; }

void Simulation::checkGrasp(int grasp) const
{
  if (grasp < 0 || grasp >= static_cast<int>(grasps_.size()))
  {
    throw std::invalid_argument("grasp = " + std::to_string(grasp) + "; must be in [0, " +
                                std::to_string(grasps_.size()) + ")");
  }
}

void Simulation::attach(int grasp, int first_node, int last_node, Hold hold)
{
  checkGrasp(grasp);
  const GraspRef& ref = grasps_[grasp];
  if (ref.cloth >= 0)
  {
    std::vector<int> vertices(static_cast<std::size_t>(std::max(0, last_node - first_node + 1)));
    std::iota(vertices.begin(), vertices.end(), first_node);
    attachVertices(grasp, std::move(vertices));
    return;
  }
  RodState& rod = state_.rods[ref.rod];
  const RodModel& model = rodModel(ref.rod);
  const std::string nodes = "nodes " + std::to_string(first_node) + " to " + std::to_string(last_node);
  if (first_node < 0 || last_node >= model.nodes() || first_node > last_node)
  {
    throw std::invalid_argument("grasp " + ref.config->name + ": " + nodes + ": must be FIRST <= LAST in [0, " +
                                std::to_string(model.nodes() - 1) + "]");
  }
  if (hold == Hold::position && first_node != last_node)
    throw std::invalid_argument("grasp " + ref.config->name + ": " + nodes + ": a point pin holds one node");
  for (std::size_t other = 0; other < rod.grasps.size(); ++other)
  {
    const GraspState& held = rod.grasps[other];
    if (static_cast<int>(other) != ref.index && held.active && first_node <= held.last_node &&
        held.first_node <= last_node)
    {
      const auto& grasps = config_.rods[ref.rod].grasps;
      throw std::invalid_argument("grasp " + ref.config->name + ": " + nodes + " overlap " +
                                  (other < grasps.size() ? "grasp " + grasps[other].name : std::string("a weld")) +
                                  ", which holds " + std::to_string(held.first_node) + " to " +
                                  std::to_string(held.last_node));
    }
  }
  checkHeld(ref.rod, ref.index, first_node, last_node);
  rod.forgetHistory();   // the integrator's past was that of another set of constraints
  rod.grasps[ref.index] = makeGrasp(model, rod, first_node, last_node, hold == Hold::frame);
  takeOffset(grasp, state_.time);
}

/// The offset from the driving frame as a table has it at `time`, or as a body or obstacle of the scene stands now.
void Simulation::takeOffset(int grasp, double time)
{
  const Motion& motion = grasps_[grasp].config->motion;
  if (const auto* table = std::get_if<TableMotion>(&motion))
  {
    setOffset(grasp, table->poses.evaluate(time));
  }
  else if (const auto* body = std::get_if<BodyMotion>(&motion))
  {
    SceneInputs now;
    for (const RigidBodyState& b : state_.bodies)
      now.bodies.push_back({b.X_WB, {}});
    for (const Pose& pose : state_.obstacles)
      now.obstacles.push_back({pose, {}});
    if (const GraspTarget* frame = followed(*body, now))
      setOffset(grasp, frame->X_WG);
  }
}

const Wrench& Simulation::wrench(int grasp) const
{
  checkGrasp(grasp);
  return state_.wrenches[grasp];
}

}   // namespace slender
