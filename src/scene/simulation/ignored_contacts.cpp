#include <algorithm>
#include <cmath>
#include <map>

#include "scene_parts.h"
#include "slender_sim/contact/solids.h"

namespace slender {

namespace {

/// Returns true if a point is inside of a closed mesh. The test adds up the solid angles of the faces seen from the
/// point.
bool isInside(const TriangleMesh& mesh, const Eigen::Vector3d& p)
{
  double angle = 0.0;
  for (Eigen::Index t = 0; t < mesh.triangles.cols(); ++t)
  {
    Eigen::Vector3d r[3];
    double length[3];
    for (int k = 0; k < 3; ++k)
    {
      r[k] = mesh.vertices.col(mesh.triangles(k, t)) - p;
      length[k] = r[k].norm();
    }
    angle += 2 * std::atan2(r[0].dot(r[1].cross(r[2])), length[0] * length[1] * length[2] + r[0].dot(r[1]) * length[2] +
                                                            r[1].dot(r[2]) * length[0] + r[2].dot(r[0]) * length[1]);
  }
  return std::abs(angle) > 2 * M_PI;
}

/// Returns true if a segment is within a distance of an obstacle, or begins inside of it.
bool isNear(const ObstacleConfig& obstacle, const Eigen::Vector3d& from, const Eigen::Vector3d& to, double distance)
{
  const Eigen::Vector3d p = obstacle.pose.inverse() * from;
  if (p.norm() > boundingRadius(obstacle.shape) + distance + (to - from).norm())
    return false;
  const auto* mesh = std::get_if<std::shared_ptr<const TriangleMesh>>(&obstacle.shape);
  return distanceToShape(obstacle.shape, obstacle.pose, from, to) <= distance || (mesh && isInside(**mesh, p));
}

/// The points of a rod or cloth at the start, and their neighbours.
struct HeldObject
{
  std::string name;   ///< "rod cable"
  const Eigen::Matrix3Xd& x;
  std::vector<std::vector<int>> neighbours;
  double reach;   ///< distance from a point of the object within which surfaces touch [m]
  bool whole;     ///< true if only the whole object can ignore contact
  std::vector<IgnoredSolid>& ignored;
};

/// Obstacles of each link, in the order of the scene.
using Links = std::map<std::string, std::vector<int>>;

/// Returns the held points, and the connected points around them that lie within a distance of a link. A point of a
/// cloth also belongs to them if one of its edges, opposite to such a point, lies within this distance.
std::vector<char> pointsNear(const HeldObject& object, const std::vector<int>& held, const SceneConfig& scene,
                             const std::vector<int>& obstacles, double distance)
{
  std::vector<char> near(static_cast<std::size_t>(object.x.cols()), 0);
  std::vector<int> border = held;
  for (const int point : held)
    near[point] = 1;
  const auto touch = [&](int a, int b) {
    return std::any_of(obstacles.begin(), obstacles.end(),
                       [&](int k) { return isNear(scene.obstacles[k], object.x.col(a), object.x.col(b), distance); });
  };
  while (!border.empty())
  {
    const std::vector<int>& around = object.neighbours[border.back()];
    border.pop_back();
    for (const int point : around)
    {
      const std::vector<int>& others = object.neighbours[point];
      if (near[point] || !(touch(point, point) || std::any_of(others.begin(), others.end(), [&](int other) {
                             return std::count(around.begin(), around.end(), other) > 0 && touch(point, other);
                           })))
        continue;
      near[point] = 1;
      border.push_back(point);
    }
  }
  return near;
}

void ignoreNamed(const GraspConfig& grasp, const HeldObject& object, SceneConfig& scene)
{
  for (const std::string& name : *grasp.ignored_contacts)
  {
    for (std::size_t k = 0; k < scene.obstacles.size(); ++k)
      if (scene.obstacles[k].name == name || scene.obstacles[k].link == name)
        object.ignored.push_back({static_cast<int>(k), {}});
    scene.notes.push_back("no contact between " + object.name + " and " + name + ": grasp " + grasp.name +
                          " has contact: {ignore: [...]}");
  }
}

/// Lets the object ignore, near the grasp, the links that its held points touch at the start.
void ignoreTouched(const GraspConfig& grasp, const std::vector<int>& held, const HeldObject& object, const Links& links,
                   SceneConfig& scene)
{
  for (const auto& [link, obstacles] : links)
  {
    const bool touches = std::any_of(obstacles.begin(), obstacles.end(), [&, &shapes = scene.obstacles](int k) {
      return std::any_of(held.begin(), held.end(), [&](int point) {
        return isNear(shapes[k], object.x.col(point), object.x.col(point), object.reach);
      });
    });
    if (!touches)
      continue;
    std::vector<char> points;
    if (!object.whole)
      points = pointsNear(object, held, scene, obstacles, 2 * object.reach);
    for (const int k : obstacles)
      object.ignored.push_back({k, points});
    scene.notes.push_back("no contact between " + object.name +
                          (object.whole ? std::string()
                                        : ", " + std::to_string(std::count(points.begin(), points.end(), 1)) +
                                              " points near grasp " + grasp.name + ",") +
                          " and link " + link + ", which the part held by " + grasp.name +
                          " touches at the start (contact: {ignore: []} of the grasp keeps this contact)");
  }
}

void ignoreOf(const std::vector<GraspConfig>& grasps, const HeldObject& object, const Links& links, SceneConfig& scene)
{
  for (const GraspConfig& grasp : grasps)
  {
    std::vector<int> held = grasp.vertices;
    for (int node = grasp.first_node; grasp.vertices.empty() && node <= grasp.last_node; ++node)
      held.push_back(node);
    if (grasp.ignored_contacts)
      ignoreNamed(grasp, object, scene);
    else
      ignoreTouched(grasp, held, object, links, scene);
  }
  // Two grasps may ignore the same obstacle. The points of both pass through it.
  std::map<int, IgnoredSolid> merged;
  for (IgnoredSolid& solid : object.ignored)
  {
    const auto [entry, is_new] = merged.emplace(solid.number, solid);
    std::vector<char>& points = entry->second.points;
    if (is_new || points.empty())
      continue;
    if (solid.points.empty())
      points.clear();
    for (std::size_t i = 0; i < points.size(); ++i)
      points[i] = points[i] || solid.points[i];
  }
  object.ignored.clear();
  for (auto& [number, solid] : merged)
    object.ignored.push_back(std::move(solid));
}

/// Returns the neighbours of points that edges join. ends(edge) returns the two points of an edge.
template <class Ends>
std::vector<std::vector<int>> neighboursOf(int points, int edges, const Ends& ends)
{
  std::vector<std::vector<int>> neighbours(static_cast<std::size_t>(points));
  for (int e = 0; e < edges; ++e)
  {
    const auto [a, b] = ends(e);
    neighbours[a].push_back(b);
    neighbours[b].push_back(a);
  }
  return neighbours;
}

}   // namespace

void ignoreHeldContacts(SceneConfig& scene, SceneParts& parts)
{
  Links links;
  for (std::size_t k = 0; k < scene.obstacles.size(); ++k)
    if (!scene.obstacles[k].link.empty())
      links[scene.obstacles[k].link].push_back(static_cast<int>(k));
  const auto matters = [](const auto& object) {
    return object.contact && object.contact->solids && !object.grasps.empty();
  };
  for (std::size_t r = 0; r < scene.rods.size(); ++r)
  {
    const RodConfig& rod = scene.rods[r];
    if (!matters(rod))
      continue;
    const RodModel& model = *parts.model.rods[r].model;
    const double radius = std::max(model.radius_a.maxCoeff(), model.radius_b.maxCoeff());
    const auto ends = [&model](int j) { return std::make_pair(j, (j + 1) % model.nodes()); };
    const HeldObject object{"rod " + rod.name,
                            parts.state.rods[r].x,
                            neighboursOf(model.nodes(), model.edges(), ends),
                            radius + scene.contact.gap,
                            false,
                            parts.model.rods[r].ignored};
    ignoreOf(rod.grasps, object, links, scene);
  }
  for (std::size_t c = 0; c < scene.cloths.size(); ++c)
  {
    const ClothConfig& cloth = scene.cloths[c];
    if (!matters(cloth))
      continue;
    const MeshTopology& topology = parts.model.cloths[c].model->topology;
    const auto ends = [&topology](int e) { return std::make_pair(topology.edges(0, e), topology.edges(1, e)); };
    const HeldObject object{"cloth " + cloth.name,
                            parts.state.cloths[c].x,
                            neighboursOf(static_cast<int>(cloth.mesh.vertices.cols()), topology.edgeCount(), ends),
                            0.5 * cloth.contact->thickness + scene.contact.gap,
                            cloth.contact->method == ContactMethod::impulses,
                            parts.model.cloths[c].ignored};
    ignoreOf(cloth.grasps, object, links, scene);
  }
}

}   // namespace slender
