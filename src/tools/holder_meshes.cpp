#include "holder_meshes.h"

#include <algorithm>
#include <cmath>

#include "slender_sim/geometry/mesh_shapes.h"
#include "slender_sim/geometry/rotation.h"

namespace slender {

using Eigen::Vector3d;

namespace {

ObjectMesh placed(ObjectKind kind, const std::string& name, int index, TriangleMesh mesh, const Pose& X)
{
  mesh.vertices = (X.orientation.toRotationMatrix() * mesh.vertices).colwise() + X.position;
  return {kind, name, index, std::move(mesh), {}};
}

ObjectMesh ball(const std::string& name, const Vector3d& at, double diameter)
{
  return placed(ObjectKind::gripper, name, 0, icosphere(0.5 * diameter, 2), Pose{at, Eigen::Quaterniond::Identity()});
}

template <class Objects>
auto named(const Objects& objects, const std::string& name)
{
  const auto found =
      std::find_if(objects.begin(), objects.end(), [&name](const auto& object) { return object.name == name; });
  return found == objects.end() ? nullptr : &*found;
}

void addRodGrasp(const GraspSnapshot& grasp, const RodSnapshot& rod, const GraspConfig* config,
                 std::vector<ObjectMesh>& out)
{
  const Pose& X = grasp.held->X_WG;
  Eigen::Index node = 0;
  (rod.x.colwise() - X.position).colwise().squaredNorm().minCoeff(&node);
  const Eigen::Index edge = std::min(node, rod.radius_a.size() - 1);
  const double width = 3.6 * std::max(rod.radius_a[edge], rod.radius_b[edge]);
  double length = 0.0;
  for (int j = config ? config->first_node : 0; config && j < config->last_node; ++j)
    length += (rod.x.col((j + 1) % rod.x.cols()) - rod.x.col(j % rod.x.cols())).norm();
  if (config && config->hold == Hold::position)
    out.push_back(ball(grasp.name, X.position, width));
  else
    out.push_back(placed(ObjectKind::gripper, grasp.name, 0, shapeMesh(Box{{length + width, width, width}}), X));
}

void addClothGrasp(const GraspSnapshot& grasp, const ClothSnapshot& cloth, const GraspConfig* config,
                   std::vector<ObjectMesh>& out)
{
  const double area = std::max(1e-12, (cloth.x.rowwise().maxCoeff() - cloth.x.rowwise().minCoeff()).squaredNorm());
  const double diameter = 0.6 * std::sqrt(area / static_cast<double>(cloth.x.cols()));
  // the bag holds the grasp's frame, which lies in the middle of its vertices: those of the scene, unless a service let
  // it hold others
  Vector3d middle = Vector3d::Zero();
  if (config)
    for (const int vertex : config->vertices)
      middle += cloth.x.col(vertex) / static_cast<double>(config->vertices.size());
  if (!config || (middle - grasp.held->X_WG.position).norm() > 1e-6 * std::sqrt(area))
    out.push_back(ball(grasp.name, grasp.held->X_WG.position, diameter));
  else
    for (const int vertex : config->vertices)
      out.push_back(ball(grasp.name, cloth.x.col(vertex), diameter));
}

/// Returns the unit vector from the outlet into the nozzle at `time` [s] of the scene. It is opposite to the direction
/// that the scene gives. If messages or tf move the nozzle, its poses are not recorded. The direction of the newest
/// edge of the thread, which points into the nozzle, is used instead.
Vector3d upstream(const NozzleConfig& nozzle, const ThreadSnapshot& thread, double time)
{
  if (comesFromOutside(nozzle.motion))
    return thread.frames.back() * Vector3d::UnitX();
  const auto* table = std::get_if<TableMotion>(&nozzle.motion);
  return -((table ? table->poses.evaluate(time) : nozzle.pose).orientation * Vector3d::UnitX());
}

}   // namespace

std::vector<ObjectMesh> holderMeshes(const SceneSnapshot& instant, const SceneConfig* scene)
{
  std::vector<ObjectMesh> out;
  for (const GraspSnapshot& grasp : instant.grasps)
  {
    if (!grasp.held || !grasp.held->active)
      continue;
    if (const RodSnapshot* rod = named(instant.rods, grasp.held->object))
    {
      const RodConfig* config = scene ? named(scene->rods, rod->name) : nullptr;
      addRodGrasp(grasp, *rod, config ? named(config->grasps, grasp.name) : nullptr, out);
    }
    else if (const ClothSnapshot* cloth = named(instant.cloths, grasp.held->object))
    {
      const ClothConfig* config = scene ? named(scene->cloths, cloth->name) : nullptr;
      addClothGrasp(grasp, *cloth, config ? named(config->grasps, grasp.name) : nullptr, out);
    }
  }
  for (const ThreadSnapshot& thread : instant.threads)
  {
    const ThreadConfig* config = scene && thread.thread_id == 0 ? named(scene->threads, thread.name) : nullptr;
    if (!config || !config->nozzle)
      continue;
    const double diameter = config->nozzle->diameter, length = 4.0 * diameter;
    const Vector3d along = upstream(*config->nozzle, thread, instant.time);
    out.push_back(placed(
        ObjectKind::nozzle, thread.name + "_nozzle", 0, shapeMesh(Cylinder{0.7 * diameter, length}),
        Pose{thread.x.col(thread.x.cols() - 1) + 0.5 * length * along, rotationBetween(Vector3d::UnitZ(), along)}));
  }
  return out;
}

std::vector<ObjectMesh> planeMeshes(const SceneSnapshot& instant, const SceneConfig& scene,
                                    const Eigen::AlignedBox3d& box, const std::optional<double>& ground)
{
  std::vector<ObjectMesh> out;
  const double h = 0.7 * box.diagonal().norm();
  for (std::size_t k = 0; k < std::min(scene.obstacles.size(), instant.obstacles.size()); ++k)
  {
    if (!std::holds_alternative<Plane>(scene.obstacles[k].shape))
      continue;
    Pose X = instant.obstacles[k].pose;
    const Vector3d normal = X.orientation * Vector3d::UnitZ();
    if (ground && normal.z() > 0.9999 && std::abs(X.position.z() - *ground) < 1e-9)
      continue;
    X.position = box.center() - normal.dot(box.center() - X.position) * normal;
    TriangleMesh square{Eigen::Matrix3Xd(3, 4), Eigen::Matrix3Xi(3, 2)};
    square.vertices << -h, h, h, -h, -h, -h, h, h, 0, 0, 0, 0;
    square.triangles << 0, 0, 1, 2, 2, 3;
    out.push_back(placed(ObjectKind::obstacle, instant.obstacles[k].name, static_cast<int>(k), std::move(square), X));
  }
  return out;
}

std::optional<double> groundOf(const SceneConfig* scene)
{
  if (!scene)
    return std::nullopt;
  for (const ThreadConfig& thread : scene->threads)
    if (thread.floor)
      return thread.floor->height;
  for (const ObstacleConfig& obstacle : scene->obstacles)
    if (std::holds_alternative<Plane>(obstacle.shape) && (obstacle.pose.orientation * Vector3d::UnitZ()).z() > 0.9999)
      return obstacle.pose.position.z();
  return std::nullopt;
}

}   // namespace slender
