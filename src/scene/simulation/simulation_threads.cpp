// Viscous threads of a scene.
#include <algorithm>
#include <stdexcept>

#include "slender_sim/geometry/rotation.h"
#include "slender_sim/scene/reader.h"
#include "slender_sim/scene/shapes.h"
#include "slender_sim/scene/simulation.h"

namespace slender {

namespace {

/// Edges grow by this share of their height above the floor. It is small enough for an edge to be divided several times
/// on its way down.
constexpr double kEdgeGrading = 0.1;

ThreadModel modelOf(const ThreadConfig& config)
{
  ThreadModel model;
  model.name = config.name;
  model.density = config.density;
  model.viscosity = config.viscosity;
  model.surface_tension = config.surface_tension;
  if (config.nozzle)
  {
    model.nozzle_diameter = config.nozzle->diameter;
    model.feed_length = config.feed_length > 0 ? config.feed_length : config.nozzle->diameter;
  }
  if (config.floor)
  {
    model.floor.present = true;
    model.floor.height = config.floor->height;
    model.floor.touches_at_radius = !config.floor->on_surface;
    model.floor.friction = config.floor->friction.value_or(-1.0);
  }
  if (config.longest_edge > 0)
    model.limits.max_edge_length = config.longest_edge;
  if (config.highest_edge > 0)
  {
    model.limits.edge_grading = kEdgeGrading;
    model.limits.highest_edge_length = config.highest_edge;
  }
  if (config.longest_step > 0)
    model.limits.max_step = config.longest_step;
  model.limits.min_edge_length = config.shortest_edge;
  model.limits.min_radius = config.breakup_radius;
  if (config.most_deposited > 0)
    model.limits.max_deposited = config.most_deposited;
  if (config.region)
    model.limits.scene = Eigen::AlignedBox3d((*config.region)[0], (*config.region)[1]);
  return model;
}

ThreadState stateOf(const ThreadConfig& config, const ThreadModel& model, const Eigen::Vector3d& gravity)
{
  if (config.nozzle)
  {
    ThreadState state =
        makeNozzleThread(model, config.nozzle->pose, config.nozzle->flow.table.at(0.0) / model.nozzleArea());
    // A thread without a fault would stand on its floor as a column. A displacement and a velocity at right angles to
    // it leave no plane of symmetry either, in which the thread might fold for ever.
    constexpr double kAside = 0.05;
    const Eigen::Matrix3d section = config.nozzle->pose.orientation.toRotationMatrix();
    state.x[0] += kAside * std::min(0.5 * model.nozzle_diameter, 0.5 * model.feed_length) * section.col(1);
    state.v[0] += kAside * state.v[0].norm() * section.col(2);
    return state;
  }
  const Eigen::Matrix3Xd nodes = curveNodes(*config.centerline, gravity);
  const int edges = static_cast<int>(nodes.cols()) - 1;
  const std::vector<double> radii = perEdge(config.radius, edges, "radius");
  ThreadState state = makeThread(nodes, Eigen::Map<const Eigen::VectorXd>(radii.data(), edges));
  for (int end = 0; end < 2; ++end)
  {
    const int edge = end ? edges - 1 : 0;
    const Eigen::Vector3d t = (end ? -1.0 : 1.0) * state.edge(edge).normalized();   // into the thread
    Eigen::Matrix3d frame;
    frame << t, state.d1[edge], t.cross(state.d1[edge]);
    state.ends[end] = {config.held[end],
                       {end ? state.x.back() : state.x.front(), Eigen::Quaterniond(frame).normalized()}};
  }
  return state;
}

}   // namespace

void Simulation::buildThreads()
{
  for (std::size_t k = 0; k < config_.threads.size(); ++k)
  {
    try
    {
      thread_models_.push_back(std::make_shared<const ThreadModel>(modelOf(config_.threads[k])));
      thread_steppers_.emplace_back();
      if (!config_.threads[k].contact)
        thread_steppers_.back().emplace(thread_models_.back(), config_.time.newton);
      else
        checkThreadModel(*thread_models_.back());
      state_.threads.emplace_back();
      state_.end_loads.emplace_back();
      state_.threads.back().threads.push_back(stateOf(config_.threads[k], *thread_models_.back(), config_.gravity));
      state_.threads.back().start_volume = state_.threads.back().volumeBalance();
    }
    catch (const std::invalid_argument& error)
    {
      throw SceneError("scene " + config_.name + ": threads." + std::to_string(k) + ": " + error.what());
    }
  }
}

/// Those with contact.
void Simulation::buildTouchingThreads()
{
  if (std::none_of(config_.threads.begin(), config_.threads.end(),
                   [](const ThreadConfig& thread) { return thread.contact.has_value(); }))
    return;
  TouchingModel model;
  touching_index_.assign(config_.threads.size(), -1);
  for (std::size_t k = 0; k < config_.threads.size(); ++k)
  {
    if (const auto& contact = config_.threads[k].contact)
    {
      touching_index_[k] = static_cast<int>(model.threads.size());
      model.threads.push_back(thread_models_[k]);
      model.touches.push_back(
          {contact->self, contact->threads, contact->obstacles, contact->friction, config_.threads[k].merging});
    }
  }
  for (const ObstacleConfig& obstacle : config_.obstacles)
    model.obstacles.push_back({obstacle.shape, obstacle.friction.value_or(-1.0), obstacle.name});
  model.options.gap = config_.contact.gap;
  model.options.slip_speed = config_.contact.slip_speed;
  try
  {
    touching_.emplace(std::move(model), config_.time.newton);
    exchangeTouching();
    touching_->checkClearance(touching_state_);
    exchangeTouching();
  }
  catch (const std::invalid_argument& error)
  {
    throw SceneError((config_.file.empty() ? "scene " + config_.name : config_.file) + ": " + error.what());
  }
}

/// Hands the part of the state over that threads with contact need, or back. Obstacles are given back by those that
/// move them.
void Simulation::exchangeTouching()
{
  touching_state_.threads.resize(touching_->model().threads.size());
  for (std::size_t k = 0; k < touching_index_.size(); ++k)
    if (touching_index_[k] >= 0)
      std::swap(touching_state_.threads[touching_index_[k]], state_.threads[k]);
  touching_state_.obstacles = state_.obstacles;
  std::swap(touching_state_.contact_stiffness, state_.thread_contact_stiffness);
}

void Simulation::addThreadInputs(SceneInputs& inputs, double time) const
{
  inputs.threads.clear();
  for (std::size_t k = 0; k < config_.threads.size(); ++k)
  {
    const ThreadConfig& thread = config_.threads[k];
    ThreadDrive drive;
    if (thread.nozzle)
    {
      const auto* table = std::get_if<TableMotion>(&thread.nozzle->motion);
      drive.nozzle = table ? table->poses.evaluate(time) : state_.threads[k].threads.front().ends[1].X_WE;
      drive.flow_rate = thread.nozzle->flow.table.mean(time - config_.time.step, time);
    }
    if (thread.floor)
    {
      const double start = time - config_.time.step;
      drive.belt_velocity << thread.floor->belt_x.table.mean(start, time), thread.floor->belt_y.table.mean(start, time),
          0.0;
    }
    inputs.threads.push_back(drive);
  }
}

ThreadInputs Simulation::threadInputs(std::size_t k, const SceneInputs& inputs) const
{
  ThreadInputs in;
  in.gravity = config_.gravity;
  for (int end = 0; end < 2; ++end)
  {
    in.ends[end] = initial_.threads.empty() ? state_.threads[k].threads.front().ends[end].X_WE
                                            : initial_.threads[k].threads.front().ends[end].X_WE;
  }
  if (config_.threads[k].nozzle)
  {
    in.ends[1] = inputs.threads[k].nozzle;
    in.flow_rate = inputs.threads[k].flow_rate;
  }
  in.belt_velocity = inputs.threads[k].belt_velocity;
  return in;
}

StepReport Simulation::stepThreads(const SceneInputs& inputs)
{
  StepReport total;
  for (std::size_t k = 0; k < thread_steppers_.size() && total.ok; ++k)
    if (thread_steppers_[k])
      total.merge(thread_steppers_[k]->step(state_.threads[k], threadInputs(k, inputs), config_.time.step));
  if (!touching_ || !total.ok)
    return total;
  touching_inputs_.threads.resize(touching_->model().threads.size());
  for (std::size_t k = 0; k < touching_index_.size(); ++k)
    if (touching_index_[k] >= 0)
      touching_inputs_.threads[touching_index_[k]] = threadInputs(k, inputs);
  touching_inputs_.obstacles.clear();
  for (const GraspTarget& obstacle : inputs.obstacles)
    touching_inputs_.obstacles.push_back({obstacle.X_WG.position, obstacle.X_WG.orientation.normalized()});
  exchangeTouching();
  total.merge(touching_->step(touching_state_, touching_inputs_, config_.time.step));
  exchangeTouching();
  return total;
}

}   // namespace slender
