// Viscous threads of a scene.
#include <stdexcept>

#include "slender_sim/geometry/rotation.h"
#include "slender_sim/scene/reader.h"
#include "slender_sim/scene/shapes.h"
#include "slender_sim/scene/simulation.h"

namespace slender {

namespace {

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
  }
  if (config.longest_edge > 0)
  {
    model.limits.max_edge_length = config.longest_edge;
  }
  model.limits.min_edge_length = config.shortest_edge;
  model.limits.min_radius = config.breakup_radius;
  if (config.most_deposited > 0)
  {
    model.limits.max_deposited = config.most_deposited;
  }
  if (config.region)
  {
    model.limits.scene = Eigen::AlignedBox3d((*config.region)[0], (*config.region)[1]);
  }
  return model;
}

ThreadState stateOf(const ThreadConfig& config, const ThreadModel& model, const Eigen::Vector3d& gravity)
{
  if (config.nozzle)
  {
    return makeNozzleThread(model, config.nozzle->pose, config.nozzle->flow.table.at(0.0) / model.nozzleArea());
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
    state.ends[end] = {config.held[end], {end ? state.x.back() : state.x.front(), Eigen::Quaterniond(frame).normalized()}};
  }
  return state;
}

}  // namespace

void Simulation::buildThreads()
{
  for (std::size_t k = 0; k < config_.threads.size(); ++k)
  {
    try
    {
      thread_models_.push_back(std::make_shared<const ThreadModel>(modelOf(config_.threads[k])));
      thread_steppers_.emplace_back(thread_models_.back(), config_.time.newton);
      state_.threads.emplace_back();
      state_.end_loads.emplace_back();
      state_.threads.back().threads.push_back(stateOf(config_.threads[k], *thread_models_.back(), config_.gravity));
    }
    catch (const std::invalid_argument& error)
    {
      throw SceneError("scene " + config_.name + ": threads." + std::to_string(k) + ": " + error.what());
    }
  }
}

void Simulation::addThreadInputs(SceneInputs& inputs, double time) const
{
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
      drive.belt_velocity << thread.floor->belt_x.table.mean(start, time), thread.floor->belt_y.table.mean(start, time), 0.0;
    }
    inputs.threads.push_back(drive);
  }
}

StepReport Simulation::stepThreads(const SceneInputs& inputs)
{
  StepReport total;
  for (std::size_t k = 0; k < thread_steppers_.size() && total.ok; ++k)
  {
    ThreadInputs in;
    in.gravity = config_.gravity;
    for (int end = 0; end < 2; ++end)
    {
      in.ends[end] = initial_.threads.empty() ? state_.threads[k].threads.front().ends[end].X_WE : initial_.threads[k].threads.front().ends[end].X_WE;
    }
    if (config_.threads[k].nozzle)
    {
      in.ends[1] = inputs.threads[k].nozzle;
      in.flow_rate = inputs.threads[k].flow_rate;
    }
    in.belt_velocity = inputs.threads[k].belt_velocity;
    total.merge(thread_steppers_[k].step(state_.threads[k], in, config_.time.step));
  }
  return total;
}

}  // namespace slender
