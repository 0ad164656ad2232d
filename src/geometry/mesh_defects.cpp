#include "slender_sim/geometry/mesh_defects.h"

#include <numeric>
#include <stdexcept>

#include <Eigen/Geometry>

#include "half_edges.h"

namespace slender {

namespace {

std::string names(const std::vector<int>& items)
{
  std::string text;
  for (std::size_t k = 0; k < items.size(); ++k)
    text += (k == 0 ? "" : k + 1 == items.size() ? " and " : ", ") + std::to_string(items[k]);
  return text;
}

std::string face(const TriangleMesh& mesh, int f)
{
  return "face " + std::to_string(f) + " (vertices " +
         names({mesh.triangles(0, f), mesh.triangles(1, f), mesh.triangles(2, f)}) + ", from 0)";
}

void findBadIndices(const TriangleMesh& mesh, std::vector<MeshDefect>& defects)
{
  const auto n = mesh.vertices.cols();
  for (int f = 0; f < mesh.triangles.cols(); ++f)
  {
    const Eigen::Vector3i t = mesh.triangles.col(f);
    const std::string fix = "; correct or remove it";
    if (t.minCoeff() < 0 || t.maxCoeff() >= n)
      defects.push_back({MeshDefect::bad_index,
                         {},
                         {f},
                         face(mesh, f) + " names a vertex that is not there: there are " + std::to_string(n) + fix});
    else if (t[0] == t[1] || t[1] == t[2] || t[2] == t[0])
      defects.push_back({MeshDefect::bad_index, {}, {f}, face(mesh, f) + " has a vertex twice" + fix});
  }
}

void findDegenerateFaces(const TriangleMesh& mesh, std::vector<MeshDefect>& defects)
{
  for (int f = 0; f < mesh.triangles.cols(); ++f)
  {
    const auto p = [&](int k) { return mesh.vertices.col(mesh.triangles(k, f)); };
    const double longest =
        std::max({(p(1) - p(0)).squaredNorm(), (p(2) - p(1)).squaredNorm(), (p(0) - p(2)).squaredNorm()});
    if (!((p(1) - p(0)).cross(p(2) - p(0)).norm() > 1e-6 * longest))
      defects.push_back({MeshDefect::degenerate_face,
                         {mesh.triangles(0, f), mesh.triangles(1, f), mesh.triangles(2, f)},
                         {f},
                         face(mesh, f) + " has (nearly) no area; merge its vertices or remove it"});
  }
}

void findBadEdges(const std::vector<HalfEdge>& sides, std::vector<MeshDefect>& defects)
{
  std::vector<MeshDefect> opposed;
  for (std::size_t k = 0, end; k < sides.size(); k = end)
  {
    std::vector<int> faces;
    for (end = k; end < sides.size() && sides[end].low == sides[k].low && sides[end].high == sides[k].high; ++end)
      faces.push_back(sides[end].side / 3);
    const std::vector<int> vertices{sides[k].low, sides[k].high};
    if (faces.size() > 2)
      defects.push_back({MeshDefect::non_manifold_edge, vertices, faces,
                         edgeName(sides[k]) + " has " + std::to_string(faces.size()) + " faces: " + names(faces) +
                             "; at most two may meet there"});
    else if (faces.size() == 2 && sides[k].forward == sides[k + 1].forward)
      opposed.push_back({MeshDefect::opposed_faces, vertices, faces,
                         "faces " + names(faces) + " run along " + edgeName(sides[k]) +
                             " in the same direction; turn one of them over"});
  }
  defects.insert(defects.end(), opposed.begin(), opposed.end());
}

/// Faces around a vertex must hang together by edges.
void findBadVertices(const TriangleMesh& mesh, const std::vector<HalfEdge>& sides, std::vector<MeshDefect>& defects)
{
  // corners joined across edges; a vertex whose corners fall into two classes is a point of touch
  std::vector<int> parent(3 * mesh.triangles.cols());
  std::iota(parent.begin(), parent.end(), 0);
  const auto root = [&](int c) {
    while (parent[c] != c)
      c = parent[c] = parent[parent[c]];
    return c;
  };
  const auto cornerOf = [&](int side, int vertex) {
    const int f = side / 3;
    return 3 * f + (mesh.triangles(0, f) == vertex ? 0 : mesh.triangles(1, f) == vertex ? 1 : 2);
  };
  for (std::size_t k = 0; k + 1 < sides.size(); ++k)
    if (sides[k].low == sides[k + 1].low && sides[k].high == sides[k + 1].high)
      for (int v : {sides[k].low, sides[k].high})
        parent[root(cornerOf(sides[k].side, v))] = root(cornerOf(sides[k + 1].side, v));
  std::vector<int> first(mesh.vertices.cols(), -1);
  std::vector<char> told(mesh.vertices.cols(), 0);
  for (int f = 0; f < mesh.triangles.cols(); ++f)
    for (int k = 0; k < 3; ++k)
    {
      const int v = mesh.triangles(k, f), r = root(3 * f + k);
      if (first[v] < 0)
        first[v] = r;
      else if (first[v] != r && !told[v])
      {
        told[v] = 1;
        defects.push_back({MeshDefect::non_manifold_vertex,
                           {v},
                           {first[v] / 3, f},
                           "faces " + names({first[v] / 3, f}) + " touch in vertex " + std::to_string(v) +
                               " (from 0) only; give each its own vertex"});
      }
    }
}

void findDuplicates(const TriangleMesh& mesh, double tolerance, std::vector<MeshDefect>& defects)
{
  const auto n = mesh.vertices.cols();
  if (n == 0)   // no bounding box
    return;
  const double reach = tolerance * (mesh.vertices.rowwise().maxCoeff() - mesh.vertices.rowwise().minCoeff()).norm();
  // along a direction that no lattice is square to, so that few vertices have neighbours in this order
  const Eigen::VectorXd along = mesh.vertices.transpose() * Eigen::Vector3d(0.5641895, 0.7071068, 0.4263267);
  std::vector<int> order(n);
  std::iota(order.begin(), order.end(), 0);
  std::sort(order.begin(), order.end(),
            [&](int a, int b) { return std::make_pair(along[a], a) < std::make_pair(along[b], b); });
  std::vector<std::pair<int, int>> pairs;
  for (std::size_t i = 0; i < order.size(); ++i)
    for (std::size_t j = i + 1; j < order.size() && along[order[j]] - along[order[i]] <= 1.01 * reach; ++j)
      if ((mesh.vertices.col(order[i]) - mesh.vertices.col(order[j])).norm() <= reach)
      {
        pairs.emplace_back(std::min(order[i], order[j]), std::max(order[i], order[j]));
        break;   // the next one of a heap reports the rest
      }
  std::sort(pairs.begin(), pairs.end());
  for (const auto& [a, b] : pairs)
    defects.push_back({MeshDefect::duplicate_vertices,
                       {a, b},
                       {},
                       "vertices " + names({a, b}) + " (from 0) lie at the same place; merge them or move one"});
}

}   // namespace

std::vector<MeshDefect> topologyDefects(const TriangleMesh& mesh)
{
  std::vector<MeshDefect> defects;
  if (mesh.triangles.cols() == 0)
    defects.push_back({MeshDefect::empty, {}, {}, "the mesh has no faces"});
  findBadIndices(mesh, defects);
  if (!defects.empty())
    return defects;
  const std::vector<HalfEdge> sides = sortedHalfEdges(mesh);
  findBadEdges(sides, defects);
  findBadVertices(mesh, sides, defects);
  return defects;
}

std::vector<MeshDefect> meshDefects(const TriangleMesh& mesh, double tolerance)
{
  std::vector<MeshDefect> defects;
  for (int v = 0; v < mesh.vertices.cols(); ++v)
    if (!mesh.vertices.col(v).allFinite())
      defects.push_back(
          {MeshDefect::not_finite, {v}, {}, "vertex " + std::to_string(v) + " (from 0) is not finite; correct it"});
  std::vector<MeshDefect> connectivity = topologyDefects(mesh);
  const bool unsound =
      !defects.empty() || (!connectivity.empty() && connectivity.front().kind == MeshDefect::bad_index);
  if (!unsound)
    findDegenerateFaces(mesh, defects);
  defects.insert(defects.end(), connectivity.begin(), connectivity.end());
  if (unsound)
    return defects;
  findDuplicates(mesh, tolerance, defects);
  std::vector<char> used(mesh.vertices.cols(), 0);
  for (Eigen::Index f = 0; f < mesh.triangles.cols(); ++f)
    for (int k = 0; k < 3; ++k)
      used[mesh.triangles(k, f)] = 1;
  for (int v = 0; v < mesh.vertices.cols(); ++v)
    if (!used[v])
      defects.push_back({MeshDefect::unreferenced_vertex,
                         {v},
                         {},
                         "vertex " + std::to_string(v) + " (from 0) belongs to no face; remove it"});
  return defects;
}

void requireSoundMesh(const TriangleMesh& mesh, const std::string& name)
{
  const std::vector<MeshDefect> defects = meshDefects(mesh);
  if (defects.empty())
    return;
  std::string message = name + ": ";
  for (std::size_t k = 0; k < defects.size() && k < 5; ++k)
    message += (k ? "\n  " : "") + defects[k].message;
  if (defects.size() > 5)
    message += "\n  and " + std::to_string(defects.size() - 5) + " more";
  throw std::invalid_argument(message);
}

}   // namespace slender
