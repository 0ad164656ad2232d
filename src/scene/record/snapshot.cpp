#include "slender_sim/scene/snapshot.h"

namespace slender {

Eigen::Quaterniond edgeFrame(const ThreadState& state, int edge)
{
  Eigen::Matrix3d axes;
  axes.col(0) = state.edge(edge).normalized();
  axes.col(1) = state.d1[edge];
  axes.col(2) = axes.col(0).cross(axes.col(1));
  return Eigen::Quaterniond(axes).normalized();
}

RodSnapshot snapshotOf(const RodModel& model, const RodState& state)
{
  RodSnapshot out{model.name,     model.closed,  state.x, state.v, {}, Eigen::VectorXd(model.nodes()),
                  model.radius_a, model.radius_b};
  for (int i = 0; i < model.nodes(); ++i)
    out.twist[i] = state.twistAt(i);
  forEachFrame(model, state,
               [&](int, const Eigen::Matrix3d& axes) { out.frames.push_back(Eigen::Quaterniond(axes).normalized()); });
  return out;
}

ThreadSnapshot snapshotOf(const std::string& name, const ThreadState& state)
{
  ThreadSnapshot out;
  out.name = name;
  out.thread_id = state.thread_id;
  out.ids.assign(state.id.begin(), state.id.end());
  out.x.resize(3, state.nodes());
  out.v.resize(3, state.nodes());
  for (int i = 0; i < state.nodes(); ++i)
  {
    out.x.col(i) = state.x[i];
    out.v.col(i) = state.v[i];
    out.deposited.push_back(state.deposited[i] ? 1 : 0);
  }
  out.radius.resize(state.edges());
  for (int j = 0; j < state.edges(); ++j)
  {
    out.frames.push_back(edgeFrame(state, j));
    out.radius[j] = state.radius(j);
  }
  return out;
}

void appendFunctions(const std::string& object, const FunctionSet& set, const Eigen::Matrix3Xd& guide,
                     const Eigen::Matrix3Xd& forces, std::vector<FunctionSnapshot>& out)
{
  const std::string prefix = set.name.empty() ? "" : set.name + "/";
  const Eigen::Matrix3Xd averages = set.constraints->averages(guide);
  for (int i = 0; i < set.constraints->count(); ++i)
    out.push_back({object, prefix + set.constraints->name(i), averages.col(i), forces.col(i)});
}

bool appendFunctions(const SceneConfig& scene, const std::string& object, const std::string& set,
                     const Eigen::Matrix3Xd& guide, const Eigen::Matrix3Xd& forces, std::vector<FunctionSnapshot>& out)
{
  const TrackingConfig* tracking = nullptr;
  const auto look = [&](const auto& objects) {
    for (const auto& candidate : objects)
      if (candidate.tracking && candidate.name == object)
        tracking = candidate.tracking.get();
  };
  look(scene.rods);
  look(scene.cloths);
  if (!tracking || tracking->guide.mesh.vertices.cols() != guide.cols())
    return false;
  for (const FunctionSet& functions : tracking->sets)
    if (functions.name == set && functions.constraints->count() == forces.cols())
    {
      appendFunctions(object, functions, guide, forces, out);
      return true;
    }
  return false;
}

SceneSnapshot snapshotOf(const Simulation& simulation)
{
  const SceneState& state = simulation.state();
  const SceneConfig& scene = simulation.config();
  SceneSnapshot out;
  out.time = state.time;
  for (std::size_t r = 0; r < state.rods.size(); ++r)
    out.rods.push_back(snapshotOf(simulation.rodModel(static_cast<int>(r)), state.rods[r]));
  for (std::size_t k = 0; k < state.threads.size(); ++k)
    for (const ThreadState& thread : state.threads[k].threads)
      out.threads.push_back(snapshotOf(simulation.threadModel(static_cast<int>(k)).name, thread));
  for (std::size_t k = 0; k < state.cloths.size(); ++k)
  {
    const ClothState& cloth = state.cloths[k];
    const ClothModel& model = simulation.clothModel(static_cast<int>(k));
    out.cloths.push_back({model.name, cloth.x, cloth.v, model.rest.triangles});
  }
  for (const bool of_cloths : {false, true})   // tables have the rods first
    for (const auto& [object, name, tracking] : simulation.guides())
      if (object.isCloth() == of_cloths)
        appendFunctions(name, simulation.functions(object), state.guide(object).points, state.guide(object).forces,
                        out.functions);
  for (std::size_t g = 0; g < simulation.grasps().size(); ++g)
  {
    const int grasp = static_cast<int>(g);
    const bool active = simulation.grasps().isActive(grasp);
    out.grasps.push_back(
        {simulation.grasps()[g].config->name,
         GraspSnapshot::Held{simulation.grasps().heldObject(grasp), active, simulation.grasps().pose(grasp)},
         active ? simulation.grasps().wrench(grasp) : Wrench{}});
  }
  for (std::size_t b = 0; b < state.bodies.size(); ++b)
    out.bodies.push_back({scene.bodies[b].name, state.bodies[b].X_WB, state.bodies[b].velocity});
  for (std::size_t k = 0; k < state.obstacles.size(); ++k)
    out.obstacles.push_back({scene.obstacles[k].name, state.obstacles[k], state.obstacle_velocities[k]});
  out.fields = fieldTablesOf(simulation);
  return out;
}

}   // namespace slender
