#include <limits>

#include <Eigen/Geometry>

#include "patch_mesh.h"

namespace slender {

namespace {

using Eigen::Vector3d;

struct Weight
{
  double angle = 0.0;   ///< largest between neighbours' normals, as 1 - cosine
  double area = 0.0;

  bool operator<(const Weight& other) const { return angle != other.angle ? angle < other.angle : area < other.area; }
};

constexpr double kNone = std::numeric_limits<double>::infinity();

double bend(const Vector3d& n, const Vector3d& m)
{
  const double scale = n.norm() * m.norm();
  return scale > 0 ? 1.0 - n.dot(m) / scale : 3.0;   // a face without area is worse than a fold
}

}   // namespace

std::vector<Eigen::Vector3i> triangulateLoop(const Eigen::Matrix3Xd& vertices, const std::vector<int>& loop,
                                             const std::vector<int>& beyond, const std::set<std::pair<int, int>>& taken)
{
  const int n = static_cast<int>(loop.size());
  const auto p = [&](int i) -> Vector3d { return vertices.col(loop[i]); };
  std::vector<Weight> best(static_cast<std::size_t>(n) * n);
  std::vector<int> apex(static_cast<std::size_t>(n) * n, -1);
  const auto index = [&](int i, int k) { return static_cast<std::size_t>(i) * n + k; };
  // normal of the face left of the chord from i to k: in the mesh, or in the part of the patch already chosen
  const auto normalBeyond = [&](int i, int k) -> Vector3d {
    if (k == i + 1)
      return (p(i) - p(k)).cross(Vector3d(vertices.col(beyond[i])) - p(k));
    const int m = apex[index(i, k)];
    return (p(m) - p(i)).cross(p(k) - p(i));
  };
  for (int span = 2; span < n; ++span)
    for (int i = 0; i + span < n; ++i)
    {
      const int k = i + span;
      Weight& least = best[index(i, k)];
      least = {kNone, kNone};
      const bool closing = span == n - 1;
      if (!closing && taken.count({std::min(loop[i], loop[k]), std::max(loop[i], loop[k])}))
        continue;
      for (int m = i + 1; m < k; ++m)
      {
        const Weight &left = best[index(i, m)], &right = best[index(m, k)];
        Weight w{std::max(left.angle, right.angle), left.area + right.area};
        if (!(w.area < kNone) || w.angle > least.angle)
          continue;
        const Vector3d normal = (p(m) - p(i)).cross(p(k) - p(i));
        w.area += 0.5 * normal.norm();
        w.angle = std::max({w.angle, bend(normal, normalBeyond(i, m)), bend(normal, normalBeyond(m, k))});
        if (closing)
          w.angle = std::max(w.angle, bend(normal, (p(k) - p(i)).cross(Vector3d(vertices.col(beyond[k])) - p(i))));
        if (w < least)
        {
          least = w;
          apex[index(i, k)] = m;
        }
      }
    }
  std::vector<Eigen::Vector3i> faces;
  std::vector<std::pair<int, int>> open{{0, n - 1}};
  while (!open.empty())
  {
    const auto [i, k] = open.back();
    open.pop_back();
    if (k - i < 2)
      continue;
    const int m = apex[index(i, k)];
    if (m < 0)
      return {};
    faces.emplace_back(loop[i], loop[m], loop[k]);
    open.emplace_back(i, m);
    open.emplace_back(m, k);
  }
  return faces;
}

}   // namespace slender
