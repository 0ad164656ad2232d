#include "patch_mesh.h"

#include <algorithm>
#include <cmath>

#include <Eigen/Geometry>

#include "geometry/edge_flips.h"

namespace slender {

namespace {

using Eigen::Vector3d;
using Eigen::Vector3i;

constexpr int kPasses = 60;   ///< of refinement: each at least halves what is too long

double cotangent(const Vector3d& u, const Vector3d& v) { return u.dot(v) / std::max(u.cross(v).norm(), 1e-300); }

}   // namespace

PatchMesh::PatchMesh(const TriangleMesh& mesh, const std::vector<int>& loop, const std::vector<double>& edge_lengths,
                     std::vector<Vector3i> faces, std::set<std::pair<int, int>> taken)
  : outer_(mesh.vertices),
    first_(static_cast<int>(mesh.vertices.cols())),
    faces_(std::move(faces)),
    taken_(std::move(taken))
{
  for (std::size_t i = 0; i < loop.size(); ++i)
    loop_length_[loop[i]] = edge_lengths[i];
}

Vector3d PatchMesh::at(int v) const { return v < first_ ? Vector3d(outer_.col(v)) : points_[v - first_]; }
double PatchMesh::wanted(int v) const { return v < first_ ? loop_length_.at(v) : length_[v - first_]; }

/// Edge a-b with the face c left of it and d right of it.
bool PatchMesh::canFlip(int a, int b, int c, int d) const
{
  const Vector3d pa = at(a), pb = at(b), pc = at(c), pd = at(d);
  if (!(cotangent(pa - pc, pb - pc) + cotangent(pa - pd, pb - pd) < -1e-9))
    return false;
  // neither new face may turn over
  const Vector3d left = (pb - pa).cross(pc - pa), right = (pd - pa).cross(pb - pa), mean = left + right;
  const Vector3d first = (pd - pa).cross(pc - pa), second = (pc - pb).cross(pd - pb);
  return first.dot(mean) > 0 && second.dot(mean) > 0;
}

void PatchMesh::flip()
{
  flipEdges(faces_, [this](int a, int b, int c, int d) {
    return !taken_.count({std::min(c, d), std::max(c, d)}) && canFlip(a, b, c, d);
  });
}

int PatchMesh::refine()
{
  const int before = vertices();
  for (int pass = 0; pass < kPasses; ++pass)
  {
    bool any = false;
    for (std::size_t f = 0, count = faces_.size(); f < count; ++f)
    {
      const Vector3i corners = faces_[f];
      const Vector3d middle = (at(corners[0]) + at(corners[1]) + at(corners[2])) / 3.0;
      const double length = (wanted(corners[0]) + wanted(corners[1]) + wanted(corners[2])) / 3.0;
      bool far = true;
      for (int k = 0; k < 3; ++k)
        far = far && M_SQRT2 * (middle - at(corners[k])).norm() > std::max(length, wanted(corners[k]));
      if (!far)
        continue;
      const int v = first_ + vertices();
      points_.push_back(middle);
      length_.push_back(length);
      faces_[f] = {corners[0], corners[1], v};
      faces_.emplace_back(corners[1], corners[2], v);
      faces_.emplace_back(corners[2], corners[0], v);
      any = true;
    }
    flip();
    if (!any)
      break;
  }
  return vertices() - before;
}

void PatchMesh::even(int sweeps)
{
  const std::size_t n = points_.size();
  for (int sweep = 0; sweep < sweeps; ++sweep)
  {
    std::vector<Vector3d> sums(n, Vector3d::Zero()), normals(n, Vector3d::Zero());
    std::vector<int> counts(n, 0);
    for (const Vector3i& face : faces_)
    {
      const Vector3d normal = (at(face[1]) - at(face[0])).cross(at(face[2]) - at(face[0]));
      for (int k = 0; k < 3; ++k)
        if (const int v = face[k] - first_; v >= 0)
        {
          sums[v] += at(face[(k + 1) % 3]);   // every neighbour of an inner vertex once
          normals[v] += normal;
          ++counts[v];
        }
    }
    for (std::size_t v = 0; v < n; ++v)
    {
      const Vector3d away = sums[v] / counts[v] - points_[v], normal = normals[v].normalized();
      points_[v] += 0.5 * (away - normal * normal.dot(away));
    }
  }
}

TriangleMesh PatchMesh::joined(const TriangleMesh& mesh) const
{
  TriangleMesh whole;
  const auto faces = mesh.triangles.cols();
  whole.vertices.resize(3, first_ + vertices());
  whole.vertices.leftCols(first_) = outer_;
  for (int v = 0; v < vertices(); ++v)
    whole.vertices.col(first_ + v) = points_[v];
  whole.triangles.resize(3, faces + static_cast<Eigen::Index>(faces_.size()));
  whole.triangles.leftCols(faces) = mesh.triangles;
  for (std::size_t f = 0; f < faces_.size(); ++f)
    whole.triangles.col(faces + static_cast<Eigen::Index>(f)) = faces_[f];
  return whole;
}

void PatchMesh::take(const Eigen::Matrix3Xd& vertices)
{
  for (std::size_t v = 0; v < points_.size(); ++v)
    points_[v] = vertices.col(first_ + static_cast<Eigen::Index>(v));
}

}   // namespace slender
