// Bodies, obstacles, and the rods that they or contact join: stepped together as one group.
#include <algorithm>
#include <stdexcept>

#include "slender_sim/scene/reader.h"
#include "slender_sim/scene/simulation.h"

namespace slender {

void Simulation::buildBodies()
{
  for (const BodyConfig& body : config_.bodies)
  {
    RigidBodyState state;
    state.X_WB = body.pose;
    state.velocity = body.velocity;
    state_.bodies.push_back(state);
  }
  for (const ObstacleConfig& obstacle : config_.obstacles)
  {
    state_.obstacles.push_back(obstacle.pose);
    state_.obstacle_velocities.push_back({});
  }
}

void Simulation::buildGroup()
{
  const int rods = static_cast<int>(models_.size()), bodies = static_cast<int>(config_.bodies.size());
  std::vector<char> joined(rods, 0);
  for (int r = 0; r < rods; ++r)
    joined[r] = config_.rods[r].contact.has_value();
  for (int b = 0; b < bodies; ++b)
  {
    const BodyConfig& body = config_.bodies[b];
    for (const WeldConfig& weld : body.welds)
      joined[weld.rod] = 1;
    if (isSimulated(b) || !body.welds.empty() || (body.shape && body.contact))
      group_bodies_.push_back(b);
  }
  RodGroupModel model;
  group_index_.assign(rods, -1);
  steppers_.resize(rods);
  tracked_rods_.resize(rods);
  for (int r = 0; r < rods; ++r)
  {
    if (joined[r])
    {
      group_index_[r] = static_cast<int>(group_rods_.size());
      group_rods_.push_back(r);
      model.rods.push_back(models_[r]);
    }
    if (config_.rods[r].tracking)
      buildTrackedRod(r);
    else if (!joined[r])
      steppers_[r].emplace(models_[r], config_.time);
  }
  const bool simulated =
      std::any_of(group_bodies_.begin(), group_bodies_.end(), [this](int b) { return isSimulated(b); });
  if (group_rods_.empty() && !simulated)
  {
    group_bodies_.clear();
    return;
  }
  try
  {
    for (int b : group_bodies_)
    {
      const BodyConfig& body = config_.bodies[b];
      RigidBodyModel m;
      m.name = body.name;
      m.simulated = isSimulated(b);
      m.mass = body.mass;
      m.inertia = body.inertia;
      m.gravity = body.gravity;
      m.force = body.force;
      m.torque = body.torque;
      m.linear_damping = body.linear_damping;
      m.angular_damping = body.angular_damping;
      model.bodies.push_back(m);
    }
    for (std::size_t k = 0; k < group_rods_.size(); ++k)
    {
      if (const auto& contact = config_.rods[group_rods_[k]].contact)
      {
        model.contact.rods.push_back(
            {static_cast<int>(k), contact->self, contact->rods, contact->obstacles, contact->friction});
      }
    }
    for (const ObstacleConfig& obstacle : config_.obstacles)
      model.contact.obstacles.push_back({obstacle.shape, obstacle.friction.value_or(-1.0)});
    if (!model.contact.rods.empty())
    {
      for (std::size_t k = 0; k < group_bodies_.size(); ++k)
      {
        const BodyConfig& body = config_.bodies[group_bodies_[k]];
        if (body.shape && body.contact)
          model.contact.bodies.push_back({static_cast<int>(k), *body.shape, body.X_BS, body.friction.value_or(-1.0)});
      }
      model.contact.options.gap = config_.contact.gap;
      model.contact.options.slip_speed = config_.contact.slip_speed;
    }
    exchangeGroup();
    for (std::size_t k = 0; k < group_bodies_.size(); ++k)
      for (const WeldConfig& weld : config_.bodies[group_bodies_[k]].welds)
        makeWeld(model, group_state_, group_index_[weld.rod], weld.first_node, weld.last_node, static_cast<int>(k));
    group_.emplace(std::move(model), config_.time);
    group_->checkClearance(group_state_);
    exchangeGroup();
  }
  catch (const std::invalid_argument& error)
  {
    throw SceneError((config_.file.empty() ? "scene " + config_.name : config_.file) + ": " + error.what());
  }
}

/// Hands the group's part of the state over, or back.
void Simulation::exchangeGroup()
{
  group_state_.rods.resize(group_rods_.size());
  group_state_.bodies.resize(group_bodies_.size());
  for (std::size_t k = 0; k < group_rods_.size(); ++k)
    std::swap(group_state_.rods[k], state_.rods[group_rods_[k]]);
  for (std::size_t k = 0; k < group_bodies_.size(); ++k)
    std::swap(group_state_.bodies[k], state_.bodies[group_bodies_[k]]);
  std::swap(group_state_.obstacles, state_.obstacles);
  std::swap(group_state_.obstacle_velocities, state_.obstacle_velocities);
  std::swap(group_state_.contact_stiffness, state_.contact_stiffness);
}

StepReport Simulation::stepGroup(const SceneInputs& inputs, bool to_equilibrium)
{
  group_inputs_.gravity = gravity_;
  group_inputs_.rods.resize(group_rods_.size());
  group_inputs_.bodies.resize(group_bodies_.size());
  for (std::size_t k = 0; k < group_rods_.size(); ++k)
    group_inputs_.rods[k] = rod_inputs_[group_rods_[k]];
  for (std::size_t k = 0; k < group_bodies_.size(); ++k)
    group_inputs_.bodies[k] = inputs.bodies[group_bodies_[k]];
  group_inputs_.obstacles = inputs.obstacles;
  exchangeGroup();
  const StepReport report = to_equilibrium ? group_->solveEquilibrium(group_state_, group_inputs_)
                                           : group_->step(group_state_, group_inputs_, config_.time.step);
  exchangeGroup();
  return report;
}

/// Bodies and obstacles that are driven and that no rod in the group feels.
void Simulation::moveGiven(const SceneInputs& inputs)
{
  const auto move = [](const GraspTarget& target, Pose& pose, Twist& velocity) {
    pose = {target.X_WG.position, target.X_WG.orientation.normalized()};
    velocity = target.velocity.value_or(Twist{});
  };
  for (std::size_t b = 0; b < state_.bodies.size(); ++b)
    if (!isSimulated(static_cast<int>(b)) &&
        std::find(group_bodies_.begin(), group_bodies_.end(), static_cast<int>(b)) == group_bodies_.end())
      move(inputs.bodies[b], state_.bodies[b].X_WB, state_.bodies[b].velocity);
  if (!group_ || group_->model().contact.obstacles.empty())
    for (std::size_t k = 0; k < state_.obstacles.size(); ++k)
      move(inputs.obstacles[k], state_.obstacles[k], state_.obstacle_velocities[k]);
}

const GraspTarget* Simulation::followed(const BodyMotion& motion, const SceneInputs& inputs) const
{
  for (std::size_t b = 0; b < config_.bodies.size(); ++b)
    if (config_.bodies[b].name == motion.body)
      return &inputs.bodies[b];
  for (std::size_t k = 0; k < config_.obstacles.size(); ++k)
    if (config_.obstacles[k].name == motion.body)
      return &inputs.obstacles[k];
  return nullptr;
}

const std::vector<ContactTerm>& Simulation::contacts() const
{
  static const std::vector<ContactTerm> none;
  return group_ ? group_->contacts() : touching_ ? touching_->contacts() : none;
}

}   // namespace slender
