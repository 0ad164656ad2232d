#include "slender_sim/geometry/mesh_topology.h"

#include <algorithm>
#include <array>
#include <stdexcept>
#include <string>

#include "slender_sim/geometry/mesh_defects.h"
#include "half_edges.h"

namespace slender {

namespace {

/// Inner edges' two sides must follow each other in `sides`.
MeshTopology numberEdges(const TriangleMesh& mesh, const std::vector<HalfEdge>& sides)
{
  const auto faces = mesh.triangles.cols();
  std::vector<std::array<int, 2>> pairs;   // sides of each edge, 3 face + corner; -1: none
  for (std::size_t k = 0; k < sides.size();)
  {
    const bool inner = k + 1 < sides.size() && sides[k].low == sides[k + 1].low && sides[k].high == sides[k + 1].high;
    pairs.push_back({sides[k].side, inner ? sides[k + 1].side : -1});
    k += inner ? 2 : 1;
  }
  std::sort(pairs.begin(), pairs.end());   // the side of the lower face comes first
  MeshTopology t;
  const auto count = static_cast<Eigen::Index>(pairs.size());
  t.edges.resize(2, count);
  t.edge_faces.resize(2, count);
  t.edge_opposites.resize(2, count);
  t.face_edges.resize(3, faces);
  for (Eigen::Index e = 0; e < count; ++e)
    for (int s = 0; s < 2; ++s)
    {
      const int side = pairs[e][s], face = side / 3, corner = side % 3;
      if (side < 0)
      {
        t.edge_faces(1, e) = t.edge_opposites(1, e) = -1;
        continue;
      }
      if (s == 0)
        t.edges.col(e) << mesh.triangles(corner, face), mesh.triangles((corner + 1) % 3, face);
      t.edge_faces(s, e) = face;
      t.edge_opposites(s, e) = mesh.triangles((corner + 2) % 3, face);
      t.face_edges(corner, face) = static_cast<int>(e);
    }
  return t;
}

void findBoundaries(Eigen::Index vertices, MeshTopology& t)
{
  t.on_boundary.assign(vertices, 0);
  std::vector<int> next(vertices, -1);
  for (Eigen::Index e = 0; e < t.edges.cols(); ++e)
    if (t.edge_faces(1, e) < 0)
    {
      next[t.edges(0, e)] = t.edges(1, e);
      t.on_boundary[t.edges(0, e)] = 1;
    }
  for (int start = 0; start < vertices; ++start)
  {
    if (next[start] < 0)
      continue;
    t.boundaries.emplace_back();
    for (int v = start; next[v] >= 0;)
    {
      t.boundaries.back().push_back(v);
      const int to = next[v];
      next[v] = -1;
      v = to;
    }
  }
}

}   // namespace

MeshTopology meshTopology(const TriangleMesh& mesh)
{
  for (const MeshDefect& defect : topologyDefects(mesh))
    throw std::invalid_argument(defect.message);
  MeshTopology t = numberEdges(mesh, sortedHalfEdges(mesh));
  findBoundaries(mesh.vertices.cols(), t);
  for (int e = 0; e < t.edgeCount(); ++e)
    if (t.edge_faces(1, e) >= 0)
      t.hinge_edges.push_back(e);
  t.hinges.resize(4, static_cast<Eigen::Index>(t.hinge_edges.size()));
  for (Eigen::Index h = 0; h < t.hinges.cols(); ++h)
    t.hinges.col(h) << t.edges.col(t.hinge_edges[h]), t.edge_opposites.col(t.hinge_edges[h]);
  return t;
}

}   // namespace slender
