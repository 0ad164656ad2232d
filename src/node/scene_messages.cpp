#include "slender_sim/node/scene_messages.h"

#include <algorithm>

#include "slender_sim/node/converters.h"
#include "slender_sim/scene/field_tables.h"

namespace slender {
namespace {

/// Empties lists, whose memory is used again.
template <class... Lists>
void clear(Lists&... lists)
{
  (lists.clear(), ...);
}

void append(const std::string& name, const Pose& X, const Twist& velocity, slender_sim::BodyStates& out)
{
  out.name.push_back(name);
  out.pose.push_back(toMessage(X));
  out.twist.push_back(toMessage(velocity));
}

}   // namespace

slender_sim::MeshStamped clothMesh(const Simulation& simulation, const ros::Time& stamp, const std::string& frame_id)
{
  slender_sim::MeshStamped mesh;
  mesh.header = makeHeader(stamp, frame_id);
  for (std::size_t k = 0; k < simulation.config().cloths.size(); ++k)
    append(simulation.clothModel(static_cast<int>(k)), mesh);
  return mesh;
}

void SceneMessages::fill(const Simulation& simulation, const ros::Time& stamp, const std::string& frame_id,
                         std::uint32_t epoch)
{
  header = makeHeader(stamp, frame_id);
  epoch_ = epoch;
  fillRods(simulation);
  fillThreads(simulation);
  fillCloths(simulation);
  fillGrasps(simulation);
  fillSolids(simulation);
}

void SceneMessages::fillRods(const Simulation& simulation)
{
  geometry_msgs::PoseArray& poses = rod_poses.renew();
  poses.header = header;
  poses.poses.clear();
  const SceneState& scene = simulation.state();
  states.resize(scene.rods.size());
  for (std::size_t r = 0; r < scene.rods.size(); ++r)
  {
    slender_sim::RodState& message = states[r].renew();
    toMessage(simulation.rodModel(static_cast<int>(r)), scene.rods[r], message);
    if (const RodConfig& rod = simulation.config().rods[r]; rod.tracking)
      toTracking(rod, scene.rod_guides[r], scene.rods[r], message);
    message.header = header;
    message.epoch = epoch_;
    message.step = scene.steps;
    appendPoses(message, poses.poses);
  }
}

void SceneMessages::fillThreads(const Simulation& simulation)
{
  geometry_msgs::PoseArray& poses = thread_poses.renew();
  poses.header = header;
  poses.poses.clear();
  const SceneState& scene = simulation.state();
  std::size_t piece = 0;
  nozzles.resize(scene.threads.size());
  for (std::size_t k = 0; k < scene.threads.size(); ++k)
  {
    for (const ThreadState& thread : scene.threads[k].threads)
    {
      threads.resize(std::max(threads.size(), piece + 1));
      slender_sim::ThreadState& message = threads[piece++].renew();
      toMessage(thread, message);
      message.header = header;
      message.epoch = epoch_;
      message.step = scene.steps;
      message.name = simulation.threadModel(static_cast<int>(k)).name;
      appendPoses(message, poses.poses);
    }
    nozzles[k].header = header;
    nozzles[k].wrench = toMessage(scene.end_loads[k][1]);
  }
  threads.resize(piece);
}

void SceneMessages::fillCloths(const Simulation& simulation)
{
  const SceneState& scene = simulation.state();
  slender_sim::ClothState& cloths = cloth_state.renew();
  cloths.header = header;
  cloths.epoch = epoch_;
  cloths.step = scene.steps;
  clear(cloths.names, cloths.offsets, cloths.vertices, cloths.velocities, cloths.constraint_errors,
        cloths.guide_offsets, cloths.guide_vertices, cloths.function_offsets, cloths.guide_forces,
        cloths.forces_at_bound, cloths.bound_distances, cloths.function_sets, cloths.blend_distances);
  static const GuideState no_guide;
  for (std::size_t k = 0; k < scene.cloths.size(); ++k)
  {
    append(simulation.config().cloths[k].name, scene.cloths[k], cloths);
    const ObjectRef cloth{ObjectRef::cloth, static_cast<int>(k)};
    const TrackingError error = simulation.trackingError(cloth);
    const GuideState& guide = scene.cloth_guides.empty() ? no_guide : scene.guide(cloth);
    appendTracking(error.met, guide.points, guide.forces, cloths);
    cloths.forces_at_bound.push_back(static_cast<std::uint32_t>(scene.cloths[k].at_bound.size()));
    cloths.bound_distances.push_back(error.at_bound);
    cloths.function_sets.push_back(simulation.config().cloths[k].tracking ? simulation.functions(cloth).name
                                                                          : std::string());
    cloths.blend_distances.push_back(error.blend);
  }
}

void SceneMessages::fillGrasps(const Simulation& simulation)
{
  wrenches.resize(simulation.grasps().size());
  grasps.header = header;
  grasps.name.resize(wrenches.size());
  grasps.object.resize(wrenches.size());
  grasps.active.resize(wrenches.size());
  grasps.pose.resize(wrenches.size());
  for (std::size_t g = 0; g < wrenches.size(); ++g)
  {
    const int grasp = static_cast<int>(g);
    wrenches[g].header = header;
    wrenches[g].wrench =
        simulation.grasps().isActive(grasp) ? toMessage(simulation.grasps().wrench(grasp)) : geometry_msgs::Wrench();
    grasps.name[g] = simulation.grasps()[g].config->name;
    grasps.object[g] = simulation.grasps().heldObject(grasp);
    grasps.active[g] = simulation.grasps().isActive(grasp);
    grasps.pose[g] = toMessage(simulation.grasps().pose(grasp));
  }
}

void SceneMessages::fillSolids(const Simulation& simulation)
{
  const SceneState& scene = simulation.state();
  const std::vector<BodyConfig>& configs = simulation.config().bodies;
  bodies.header = obstacles.header = header;
  clear(bodies.name, bodies.pose, bodies.twist, obstacles.name, obstacles.pose, obstacles.twist);
  for (std::size_t b = 0; b < configs.size(); ++b)
    append(configs[b].name, scene.bodies[b].X_WB, scene.bodies[b].velocity, bodies);
  for (std::size_t k = 0; k < scene.obstacles.size(); ++k)
    append(simulation.config().obstacles[k].name, scene.obstacles[k], scene.obstacle_velocities[k], obstacles);
}

void SceneMessages::fillFields(const Simulation& simulation)
{
  fields.header = header;
  fields.epoch = epoch_;
  fields.step = simulation.state().steps;
  fields.tables.clear();
  for (const FieldTable& table : fieldTablesOf(simulation))
  {
    slender_sim::FieldTable& message = fields.tables.emplace_back();
    message.table = table.table;
    message.object = table.object;
    message.columns = table.columns;
    for (Eigen::Index i = 0; i < table.values.rows(); ++i)
      for (Eigen::Index k = 0; k < table.values.cols(); ++k)
        message.values.push_back(table.values(i, k));
  }
}

}   // namespace slender
