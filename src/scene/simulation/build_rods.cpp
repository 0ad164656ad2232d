// Rods of a scene.
#include <algorithm>
#include <cmath>
#include <stdexcept>

#include "linalg/average_projection.h"
#include "scene_parts.h"
#include "scene_rod.h"
#include "slender_sim/scene/shapes.h"

namespace slender {

namespace {

/// Puts the grasp's direction and director into its motion. A section that turns to them within the first step is worth
/// a warning.
void turnGrasp(GraspConfig& grasp, const Pose& section, SceneConfig& scene)
{
  constexpr double kNoticeable = 0.05;   // [rad]
  const double turn = orientGrasp(grasp, section);
  if (turn > kNoticeable && !scene.start.equilibrium)
  {
    scene.warnings.push_back(
        (scene.file.empty() ? "scene " + scene.name : scene.file) + ": grasp " + grasp.name +
        ": direction or director turns the section by " + std::to_string(std::lround(turn * 180 / M_PI)) +
        " degrees within the first step; start: equilibrium turns it slowly, before the first step");
  }
}

/// Where the tangent may turn, statics does not know the whole effect of a torque.
bool holdsTangent(const RodConfig& rod, const RodModel& model, int edge)
{
  const auto held = [&rod](int node) {
    return std::any_of(rod.grasps.begin(), rod.grasps.end(),
                       [node](const GraspConfig& g) { return g.first_node <= node && node <= g.last_node; });
  };
  return held(edge) && held((edge + 1) % model.nodes());
}

/// The loads that act all the time.
RodInputs loadsOf(SceneConfig& scene, int r, const RodModel& model)
{
  const RodConfig& rod = scene.rods[r];
  RodInputs loads = rodLoads(rod, model, scene.time.integrator);
  loads.gravity = scene.gravity;
  const auto carries = [r](const BodyConfig& body) { return body.isWeldedTo(r); };
  const auto clamps = [](const GraspConfig& grasp) { return grasp.hold == Hold::frame; };
  if (loads.torques.size() > 0 && std::none_of(rod.grasps.begin(), rod.grasps.end(), clamps) &&
      std::none_of(scene.bodies.begin(), scene.bodies.end(), carries))
  {
    throw std::invalid_argument(
        "loads: nothing balances the torque, since no grasp holds a frame of the rod (hold: frame) and no body is "
        "welded to it: its material frames, which have no inertia, would spin without end");
  }
  for (int j = 0; j < static_cast<int>(loads.torques.size()); ++j)
  {
    if (loads.torques[j] != 0 && !holdsTangent(rod, model, j))
    {
      scene.warnings.push_back((rod.place.empty() ? "rod " + rod.name : rod.place) +
                               ": a torque of loads goes along with the tangent of edge " + std::to_string(j) +
                               ", which may turn. Such a torque has no potential: statics finds its equilibria, but "
                               "stability and the lowest eigenvalue leave out that it turns, and a rod that they call "
                               "stable may flutter. Hold the nodes of this edge by hold: position to guide it");
      break;
    }
  }
  return loads;
}

/// Where the scene starts the averages are the guide's, and their velocities: by the least change of the nodes that no
/// grasp or body holds.
void placeOnGuide(const SceneConfig& scene, int r, const RodModel& model, GuideState& guide, Eigen::Matrix3Xd& nodes,
                  Eigen::Matrix3Xd& velocities)
{
  const RodConfig& config = scene.rods[r];
  const WeakConstraints& constraints = *config.tracking->sets.front().constraints;
  Eigen::Matrix3Xd guide_velocities;
  config.tracking->guide.evaluate(0.0, guide.points, &guide_velocities);
  guide.forces.setZero(3, constraints.count());

  const auto isFree = [&](int node) {
    const auto holds = [node](const auto& held) { return held.first_node <= node && node <= held.last_node; };
    return std::none_of(config.grasps.begin(), config.grasps.end(), holds) &&
           std::none_of(scene.bodies.begin(), scene.bodies.end(), [&](const BodyConfig& body) {
             return std::any_of(body.welds.begin(), body.welds.end(),
                                [&](const WeldConfig& weld) { return weld.rod == r && holds(weld); });
           });
  };
  AverageProjection projection(constraints.matrix());
  if (!projection.prepare(model.mass, isFree))
  {
    throw std::invalid_argument(
        "test functions of track depend on each other on the nodes that no grasp holds; leave some out, or hold fewer "
        "nodes");
  }
  const Eigen::Matrix3Xd away = constraints.averages(guide.points) - nodes * constraints.matrix().transpose(),
                         speeds = constraints.averages(guide_velocities);
  Eigen::Matrix3Xd moved;
  fromPoints(projection.displacements(away), moved);
  nodes += moved;
  fromPoints(projection.displacements(speeds), velocities);
}

void addGrasps(SceneConfig& scene, int r, const RodModel& model, RodState& state, std::vector<GraspRef>& grasps)
{
  RodConfig& rod = scene.rods[r];
  for (std::size_t g = 0; g < rod.grasps.size(); ++g)
  {
    GraspConfig& grasp = rod.grasps[g];
    if (grasp.first_node < 0 || grasp.last_node >= model.nodes() || grasp.first_node > grasp.last_node)
    {
      throw std::invalid_argument("grasp " + grasp.name + " holds nodes " + std::to_string(grasp.first_node) + " to " +
                                  std::to_string(grasp.last_node) + "; must be in [0, " +
                                  std::to_string(model.nodes() - 1) + "]");
    }
    state.grasps.push_back(makeGrasp(model, state, grasp.first_node, grasp.last_node, grasp.hold == Hold::frame));
    turnGrasp(grasp, state.grasps.back().X_WG, scene);
    grasps.push_back({{ObjectRef::rod, r}, static_cast<int>(g), &grasp});
  }
}

void addRod(SceneConfig& scene, int r, SceneParts& parts)
{
  RodConfig& rod = scene.rods[r];
  const Eigen::Matrix3Xd rest = restNodes(rod, scene.gravity);
  Eigen::Matrix3Xd initial = initialNodes(rod, rest, scene.gravity);
  SceneRod built = buildSceneRod(rod, rest, scene.gravity, scene.time.integrator);
  Eigen::Matrix3Xd velocities;
  if (rod.tracking)
  {
    parts.state.rod_guides.resize(scene.rods.size());
    placeOnGuide(scene, r, built.model, parts.state.rod_guides[r], initial, velocities);
  }
  RodState state;
  try
  {
    state = startSceneRod(rod, built, initial);
  }
  catch (const std::invalid_argument& e)
  {
    if (!rod.tracking)
      throw;
    throw std::invalid_argument(std::string(e.what()) +
                                " after `track` has moved it to the guide: give a centerline near the guide and about "
                                "as long as it, or fewer test functions");
  }
  if (velocities.cols() > 0)
    state.v = velocities;
  addGrasps(scene, r, built.model, state, parts.grasps);
  parts.inputs.rods.push_back(loadsOf(scene, r, built.model));
  WorldModel::Rod part;
  part.model = std::make_shared<const RodModel>(std::move(built.model));
  part.contact = rod.contact;
  parts.model.rods.push_back(std::move(part));
  parts.state.rods.push_back(std::move(state));
}

}   // namespace

void buildRods(SceneConfig& scene, SceneParts& parts)
{
  buildEach(scene, FailurePlace::Kind::rod, scene.rods.size(), [&](int r) { addRod(scene, r, parts); });
}

}   // namespace slender
