#include <algorithm>

#include "scene_parts.h"
#include "slender_sim/scene/shapes.h"

namespace slender {

namespace {

/// Edges grow by this share of their height above the floor. It is small enough for an edge to be divided several times
/// on its way down.
constexpr double kEdgeGrading = 0.1;

ThreadModel modelOf(const ThreadConfig& config)
{
  ThreadModel model;
  model.name = config.name;
  static_cast<Fluid&>(model) = config;
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

void buildThreads(const SceneConfig& scene, SceneParts& parts)
{
  buildEach(scene, FailurePlace::Kind::thread, scene.threads.size(), [&](int k) {
    const ThreadConfig& config = scene.threads[k];
    WorldModel::Thread thread;
    thread.model = std::make_shared<const ThreadModel>(modelOf(config));
    checkThreadModel(*thread.model);   // before its state is made
    thread.contact = config.contact;
    thread.merging = config.merging;
    ThreadGroupState state;
    state.threads.push_back(stateOf(config, *thread.model, scene.gravity));
    state.start_volume = state.volumeBalance();
    parts.model.threads.push_back(std::move(thread));
    parts.state.threads.push_back(std::move(state));
    parts.state.end_loads.emplace_back();
  });
  parts.inputs.threads.resize(scene.threads.size());
}

}   // namespace slender
