#include "mesh_cases.h"

#include <set>

#include <Eigen/Geometry>

namespace slender::study {

using Eigen::Vector3d;

TriangleMesh cutAway(const TriangleMesh& mesh, const std::function<bool(const Vector3d&)>& keep)
{
  std::vector<int> number(mesh.vertices.cols(), -1), vertices;
  std::vector<Eigen::Vector3i> faces;
  for (Eigen::Index f = 0; f < mesh.triangles.cols(); ++f)
  {
    const Eigen::Vector3i corners = mesh.triangles.col(f);
    if (!keep((mesh.vertices.col(corners[0]) + mesh.vertices.col(corners[1]) + mesh.vertices.col(corners[2])) / 3.0))
      continue;
    Eigen::Vector3i face;
    for (int k = 0; k < 3; ++k)
    {
      int& v = number[corners[k]];
      if (v < 0)
      {
        v = static_cast<int>(vertices.size());
        vertices.push_back(corners[k]);
      }
      face[k] = v;
    }
    faces.push_back(face);
  }
  TriangleMesh kept;
  kept.vertices.resize(3, static_cast<Eigen::Index>(vertices.size()));
  kept.triangles.resize(3, static_cast<Eigen::Index>(faces.size()));
  for (std::size_t v = 0; v < vertices.size(); ++v)
    kept.vertices.col(static_cast<Eigen::Index>(v)) = mesh.vertices.col(vertices[v]);
  for (std::size_t f = 0; f < faces.size(); ++f)
    kept.triangles.col(static_cast<Eigen::Index>(f)) = faces[f];
  return kept;
}

TriangleMesh closedGrid(int along, int around, const std::function<Vector3d(double, double)>& at)
{
  TriangleMesh mesh;
  mesh.vertices.resize(3, along * around);
  mesh.triangles.resize(3, 2 * along * around);
  for (int i = 0; i < along; ++i)
    for (int j = 0; j < around; ++j)
    {
      mesh.vertices.col(i * around + j) = at(2 * M_PI * i / along, 2 * M_PI * j / around);
      const int next = (i + 1) % along * around, other = (j + 1) % around;
      mesh.triangles.col(2 * (i * around + j)) << i * around + j, next + j, next + other;
      mesh.triangles.col(2 * (i * around + j) + 1) << i * around + j, next + other, i * around + other;
    }
  return mesh;
}

void drawFaces(Plot& picture, const std::string& label, const TriangleMesh& mesh, const Camera& camera,
               Eigen::Index first_face, const Vector3d& shift)
{
  std::set<std::pair<int, int>> drawn;
  for (Eigen::Index f = first_face; f < mesh.triangles.cols(); ++f)
  {
    const Eigen::Vector3i t = mesh.triangles.col(f);
    const Vector3d normal = Vector3d(mesh.vertices.col(t[1]) - mesh.vertices.col(t[0]))
                                .cross(mesh.vertices.col(t[2]) - mesh.vertices.col(t[0]));
    if (normal.dot(camera.view) > 0)
      continue;
    for (int k = 0; k < 3; ++k)
    {
      const int a = t[k], b = t[(k + 1) % 3];
      if (!drawn.insert({std::min(a, b), std::max(a, b)}).second)
        continue;
      Eigen::Matrix3Xd edge(3, 2);
      edge << mesh.vertices.col(a), mesh.vertices.col(b);
      draw(picture, label, edge, false, camera, shift);
    }
  }
}

}   // namespace slender::study
