#include "slender_sim/scene/snapshot_meshes.h"

#include <algorithm>
#include <cmath>
#include <map>
#include <stdexcept>

#include "slender_sim/geometry/mesh_shapes.h"

namespace slender {

using Eigen::Vector3d;

namespace {

constexpr int kSides = 24, kRings = 8;   // around a capsule, from its equator to a pole

struct Surface
{
  TriangleMesh operator()(const Plane&) const { return {Eigen::Matrix3Xd(3, 0), Eigen::Matrix3Xi(3, 0)}; }
  TriangleMesh operator()(const Sphere& s) const { return icosphere(s.radius, 4); }
  TriangleMesh operator()(const std::shared_ptr<const TriangleMesh>& mesh) const { return *mesh; }

  TriangleMesh operator()(const Box& b) const
  {
    TriangleMesh mesh{Eigen::Matrix3Xd(3, 8), Eigen::Matrix3Xi(3, 12)};
    for (int k = 0; k < 8; ++k)
      mesh.vertices.col(k) = 0.5 * b.size.cwiseProduct(Vector3d(k & 1 ? 1 : -1, k & 2 ? 1 : -1, k & 4 ? 1 : -1));
    mesh.triangles << 0, 0, 4, 4, 0, 0, 2, 2, 0, 0, 1, 1,   //
        2, 3, 5, 7, 1, 5, 6, 7, 4, 6, 3, 7,                 //
        3, 1, 7, 6, 5, 4, 7, 3, 6, 2, 7, 5;
    return mesh;
  }

  TriangleMesh operator()(const Cylinder& c) const
  {
    return turned({{c.radius, -0.5 * c.length}, {c.radius, 0.5 * c.length}});
  }

  TriangleMesh operator()(const Capsule& c) const
  {
    std::vector<Eigen::Vector2d> profile;
    for (int ring = -kRings + 1; ring < kRings; ++ring)
    {
      const double latitude = 0.5 * M_PI * ring / kRings;
      for (const double half : {-0.5, 0.5})   // two rings at the equator
        if (half * ring > 0 || ring == 0)
          profile.emplace_back(c.radius * std::cos(latitude), c.radius * std::sin(latitude) + half * c.length);
    }
    TriangleMesh mesh = turned(profile);
    mesh.vertices(2, mesh.vertices.cols() - 2) = -c.radius - 0.5 * c.length;   // the caps' middles are the poles
    mesh.vertices(2, mesh.vertices.cols() - 1) = c.radius + 0.5 * c.length;
    return mesh;
  }

  /// Radii and heights of rings about z.
  static TriangleMesh turned(const std::vector<Eigen::Vector2d>& profile)
  {
    std::vector<TubeSection> sections;
    for (const Eigen::Vector2d& p : profile)
      sections.push_back({{0, 0, p.y()}, {p.x(), 0, 0}, {0, p.x(), 0}});
    return tubeMesh(sections, kSides, false);
  }
};

void moveBy(const Pose& X, TriangleMesh& mesh)
{
  mesh.vertices = (X.orientation.toRotationMatrix() * mesh.vertices).colwise() + X.position;
}

}   // namespace

FramedLine lineOf(const RodSnapshot& rod)
{
  FramedLine line{rod.closed, rod.x, Eigen::Matrix3Xd(3, rod.frames.size()), Eigen::Matrix2Xd(2, rod.frames.size())};
  for (std::size_t j = 0; j < rod.frames.size(); ++j)
    line.d1.col(static_cast<Eigen::Index>(j)) = rod.frames[j] * Vector3d::UnitY();
  line.semi_axes.row(0) = rod.radius_a.transpose();
  line.semi_axes.row(1) = rod.radius_b.transpose();
  return line;
}

FramedLine lineOf(const ThreadSnapshot& thread, const std::vector<double>& values)
{
  Eigen::Index first = 0, last = thread.radius.size();
  while (last - first > 1 && !(thread.radius[first] > 0))
    ++first;
  while (last - first > 1 && !(thread.radius[last - 1] > 0))
    --last;
  const Eigen::Index edges = last - first;
  FramedLine line{false, thread.x.middleCols(first, edges + 1), Eigen::Matrix3Xd(3, edges), Eigen::Matrix2Xd(2, edges)};
  for (Eigen::Index j = 0; j < edges; ++j)
    line.d1.col(j) = thread.frames[static_cast<std::size_t>(first + j)] * Vector3d::UnitY();
  line.semi_axes = thread.radius.segment(first, edges).transpose().replicate(2, 1);
  if (!values.empty())
    line.values.assign(values.begin() + first, values.begin() + first + edges + 1);
  return line;
}

TriangleMesh shapeMesh(const Shape& shape) { return std::visit(Surface{}, shape); }

std::vector<ObjectMesh> objectMeshes(const SceneSnapshot& instant, const SceneConfig* scene,
                                     const TubeResolution& resolution)
{
  std::vector<ObjectMesh> out;
  const auto tube = [&](const FramedLine& line) {
    const int most = std::max<int>(resolution.sections, static_cast<int>(line.d1.cols()));   // no node is passed over
    return tubeMesh(tubeSections(line, most), resolution.sides, line.closed);
  };
  for (const RodSnapshot& rod : instant.rods)
    out.push_back({ObjectKind::rod,
                   rod.name,
                   static_cast<int>(&rod - instant.rods.data()),
                   tube(lineOf(rod)),
                   {std::uint64_t(rod.x.cols())}});
  std::map<std::string, int> threads;
  for (const ThreadSnapshot& thread : instant.threads)
  {
    const int index = threads.emplace(thread.name, static_cast<int>(threads.size())).first->second;
    ObjectMesh object{ObjectKind::thread, thread.name, index, tube(lineOf(thread)), thread.ids};
    if (thread.thread_id > 0)
      object.name += "_" + std::to_string(thread.thread_id);
    object.key.push_back(static_cast<std::uint64_t>(object.mesh.vertices.cols()));   // edges at the ends come and go
    out.push_back(std::move(object));
  }
  for (const ClothSnapshot& cloth : instant.cloths)
  {
    if (cloth.triangles.cols() == 0)
      throw std::invalid_argument("cloth " + cloth.name +
                                  ": its triangles are not there; the bag needs the topic `mesh`");
    out.push_back({ObjectKind::cloth,
                   cloth.name,
                   static_cast<int>(&cloth - instant.cloths.data()),
                   {cloth.x, cloth.triangles},
                   {std::uint64_t(cloth.x.cols())}});
  }
  const auto solid = [&](ObjectKind kind, const SolidSnapshot& recorded, int index, const Shape& shape,
                         const Pose& X_BS) {
    ObjectMesh object{kind, recorded.name, index, shapeMesh(shape), {}};
    if (object.mesh.vertices.cols() == 0)
      return;
    moveBy(recorded.pose * X_BS, object.mesh);
    out.push_back(std::move(object));
  };
  if (!scene)
    return out;
  for (std::size_t b = 0; b < std::min(scene->bodies.size(), instant.bodies.size()); ++b)
    if (scene->bodies[b].shape)
      solid(ObjectKind::body, instant.bodies[b], static_cast<int>(b), *scene->bodies[b].shape, scene->bodies[b].X_BS);
  for (std::size_t k = 0; k < std::min(scene->obstacles.size(), instant.obstacles.size()); ++k)
    solid(ObjectKind::obstacle, instant.obstacles[k], static_cast<int>(k), scene->obstacles[k].shape, Pose());
  return out;
}

}   // namespace slender
