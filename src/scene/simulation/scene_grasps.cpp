#include "slender_sim/scene/scene_grasps.h"

#include <algorithm>
#include <numeric>
#include <stdexcept>
#include <utility>

#include "cloth_grasps.h"

namespace slender {

namespace {

bool isIdentity(const Pose& X)
{
  return X.position == Eigen::Vector3d::Zero() && X.orientation.coeffs() == Eigen::Quaterniond::Identity().coeffs();
}

}   // namespace

SceneGrasps::SceneGrasps(const SceneConfig& config, const WorldModel& model, SceneState& state,
                         std::vector<GraspRef> refs)
  : config_(config),
    model_(model),
    state_(state),
    refs_(std::move(refs)),
    cloth_targets_(refs_.size())
{
}

GraspFrame& SceneGrasps::frameOf(const GraspRef& ref) const
{
  if (ref.object.isCloth())
    return state_.cloth_grasps[ref.object.index][ref.index];
  return state_.rods[ref.object.index].grasps[ref.index];
}

bool SceneGrasps::isActive(int grasp) const { return frameOf(checked(grasp)).active; }

const Pose& SceneGrasps::pose(int grasp) const { return frameOf(checked(grasp)).X_WG; }

const std::string& SceneGrasps::heldObject(int grasp) const
{
  const ObjectRef& object = checked(grasp).object;
  return object.isCloth() ? config_.cloths[object.index].name : config_.rods[object.index].name;
}

const Wrench& SceneGrasps::wrench(int grasp) const
{
  checked(grasp);
  return state_.wrenches[grasp];
}

void SceneGrasps::inputsAt(double time, SceneInputs& inputs) const
{
  inputs.grasps.clear();
  inputs.grasps.reserve(refs_.size());
  for (int g = 0; g < static_cast<int>(refs_.size()); ++g)
  {
    const auto* table = std::get_if<TableMotion>(&refs_[g].config->motion);
    if (table && isActive(g))
    {
      Twist velocity;
      const Pose driving = table->poses.evaluate(time, &velocity);
      inputs.grasps.push_back(targetOf(g, driving, velocity));
    }
    else
    {
      inputs.grasps.push_back({pose(g), Twist{}});
    }
  }
}

GraspTarget SceneGrasps::targetOf(int grasp, const Pose& X_WM, const std::optional<Twist>& velocity) const
{
  checked(grasp);
  const Pose& offset = state_.grasp_offsets[grasp];
  if (isIdentity(offset))
    return {X_WM, velocity};   // not multiplied by an identity, which would round
  GraspTarget target{X_WM * offset, velocity};
  if (velocity)
    target.velocity->linear += velocity->angular.cross(X_WM.orientation * offset.position);
  return target;
}

void SceneGrasps::setOffset(int grasp, const Pose& X_WM)
{
  checked(grasp);
  state_.grasp_offsets[grasp] = X_WM.inverse() * pose(grasp);
}

GraspTarget SceneGrasps::drivenTarget(int grasp, const SceneInputs& inputs) const
{
  const auto* body = std::get_if<BodyMotion>(&refs_[grasp].config->motion);
  const GraspTarget* frame = body && isActive(grasp) ? followed(*body, inputs) : nullptr;
  return frame ? targetOf(grasp, frame->X_WG, frame->velocity) : inputs.grasps[grasp];
}

const GraspTarget* SceneGrasps::followed(const BodyMotion& motion, const SceneInputs& inputs) const
{
  for (std::size_t b = 0; b < config_.bodies.size(); ++b)
    if (config_.bodies[b].name == motion.body)
      return &inputs.bodies[b];
  for (std::size_t k = 0; k < config_.obstacles.size(); ++k)
    if (config_.obstacles[k].name == motion.body)
      return &inputs.obstacles[k];
  return nullptr;
}

void SceneGrasps::takeTargets(const SceneInputs& inputs, WorldInputs& world)
{
  for (std::size_t r = 0; r < world.rods.size(); ++r)
    world.rods[r].grasps.resize(state_.rods[r].grasps.size());   // welds last: nothing drives them
  for (std::size_t k = 0; k < world.cloths.size(); ++k)
    world.cloths[k].pins.resize(3, static_cast<Eigen::Index>(state_.cloths[k].pins.size()));
  for (int g = 0; g < static_cast<int>(refs_.size()); ++g)
  {
    const auto& [object, index, config] = refs_[g];
    if (!object.isCloth())
      world.rods[object.index].grasps[index] = drivenTarget(g, inputs);
    if (!object.isCloth() || !isActive(g))
      continue;
    Pose& X_WG = cloth_targets_[g];
    X_WG = drivenTarget(g, inputs).X_WG;
    X_WG.orientation.normalize();
    const std::vector<int>& pins = state_.cloths[object.index].pins;
    const ClothGrasp& grasp = state_.cloth_grasps[object.index][index];
    for (std::size_t p = 0; p < grasp.vertices.size(); ++p)
    {
      const auto pin = std::lower_bound(pins.begin(), pins.end(), grasp.vertices[p]) - pins.begin();
      world.cloths[object.index].pins.col(pin) = X_WG * grasp.points_G.col(static_cast<Eigen::Index>(p));
    }
  }
}

void SceneGrasps::takeWrenches(const World& world)
{
  for (int g = 0; g < static_cast<int>(refs_.size()); ++g)
  {
    const auto& [object, index, config] = refs_[g];
    if (!object.isCloth())
      state_.wrenches[g] = world.rodWrenches(object.index)[index];
    if (!object.isCloth() || !isActive(g))
      continue;
    const ClothState& cloth = state_.cloths[object.index];
    ClothGrasp& grasp = state_.cloth_grasps[object.index][index];
    grasp.X_WG = cloth_targets_[g];
    const Eigen::Matrix3Xd& forces = world.pinForces(object.index);
    Wrench wrench;
    for (const int vertex : grasp.vertices)
    {
      const auto pin = std::lower_bound(cloth.pins.begin(), cloth.pins.end(), vertex) - cloth.pins.begin();
      const Eigen::Vector3d force = forces.col(pin);
      wrench.force += force;
      wrench.torque += (cloth.x.col(vertex) - grasp.X_WG.position).cross(force);
    }
    state_.wrenches[g] = wrench;
  }
}

const GraspRef& SceneGrasps::checked(int grasp) const
{
  if (grasp < 0 || grasp >= static_cast<int>(refs_.size()))
  {
    throw std::invalid_argument("grasp = " + std::to_string(grasp) + "; must be in [0, " +
                                std::to_string(refs_.size()) + ")");
  }
  return refs_[grasp];
}

void SceneGrasps::attach(int grasp, int first_node, int last_node, Hold hold)
{
  const GraspRef& ref = checked(grasp);
  if (ref.object.isCloth())
  {
    std::vector<int> vertices(static_cast<std::size_t>(std::max(0, last_node - first_node + 1)));
    std::iota(vertices.begin(), vertices.end(), first_node);
    return attachVertices(grasp, std::move(vertices));
  }
  RodState& rod = state_.rods[ref.object.index];
  const RodModel& model = *model_.rods[ref.object.index].model;
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
      const auto& grasps = config_.rods[ref.object.index].grasps;
      throw std::invalid_argument("grasp " + ref.config->name + ": " + nodes + " overlap " +
                                  (other < grasps.size() ? "grasp " + grasps[other].name : std::string("a weld")) +
                                  ", which holds " + std::to_string(held.first_node) + " to " +
                                  std::to_string(held.last_node));
    }
  }
  checkHeld(ref.object.index, ref.index, first_node, last_node);
  rod.forgetHistory();   // the integrator's past was that of another set of constraints
  rod.grasps[ref.index] = makeGrasp(model, rod, first_node, last_node, hold == Hold::frame);
  takeOffset(grasp, state_.time);
}

void SceneGrasps::attachVertices(int grasp, std::vector<int> vertices)
{
  const GraspRef& ref = checked(grasp);
  if (!ref.object.isCloth())
    throw std::invalid_argument("grasp " + ref.config->name + " holds a rod, which has nodes");
  std::sort(vertices.begin(), vertices.end());
  vertices.erase(std::unique(vertices.begin(), vertices.end()), vertices.end());
  ClothState& cloth = state_.cloths[ref.object.index];
  std::vector<ClothGrasp>& grasps = state_.cloth_grasps[ref.object.index];
  checkVertices(vertices, config_.cloths[ref.object.index], cloth, grasps, static_cast<std::size_t>(ref.index));
  grasps[ref.index] = clothGraspOf(cloth, std::move(vertices));
  gatherPins(grasps, cloth);
  takeOffset(grasp, state_.time);
}

void SceneGrasps::release(int grasp)
{
  const GraspRef& ref = checked(grasp);
  frameOf(ref).active = false;
  if (ref.object.isCloth())
    gatherPins(state_.cloth_grasps[ref.object.index], state_.cloths[ref.object.index]);
  else
    state_.rods[ref.object.index].forgetHistory();
  state_.wrenches[grasp] = {};
}

/// Before a grasp takes hold: throws std::invalid_argument when that leaves too little for the averages.
void SceneGrasps::checkHeld(int rod, int grasp, int first_node, int last_node) const
{
  const TrackedGuide& tracked = model_.rods[rod].tracked;
  if (!tracked.sets)
    return;
  std::vector<char> held(static_cast<std::size_t>(model_.rods[rod].model->nodes()), 0);
  const auto hold = [&held](int first, int last) { std::fill(held.begin() + first, held.begin() + last + 1, 1); };
  hold(first_node, last_node);
  const std::vector<GraspState>& grasps = state_.rods[rod].grasps;
  for (std::size_t g = 0; g < grasps.size(); ++g)
    if (grasps[g].active && static_cast<int>(g) != grasp)
      hold(grasps[g].first_node, grasps[g].last_node);
  tracked.sets->front().constraints->requireIndependent(held);
}

void SceneGrasps::takeOffset(int grasp, double time)
{
  const Motion& motion = refs_[grasp].config->motion;
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

}   // namespace slender
