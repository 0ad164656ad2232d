#include "slender_sim/geometry/mesh_subdivision.h"

#include <algorithm>
#include <map>
#include <stdexcept>
#include <string>
#include <vector>

namespace slender {

namespace {

using Weights = Eigen::SparseMatrix<double, Eigen::RowMajor>;

/// Faces once divided, and how the new vertices follow from the old ones.
Weights divideFaces(Eigen::Matrix3Xi& triangles, int vertices)
{
  std::vector<Eigen::Triplet<double>> entries;
  for (int v = 0; v < vertices; ++v)
    entries.emplace_back(v, v, 1.0);
  int count = vertices;
  std::map<std::pair<int, int>, int> middles;
  const auto middle = [&](int a, int b) {
    const auto [at, fresh] = middles.try_emplace({std::min(a, b), std::max(a, b)}, count);
    if (fresh)
    {
      entries.emplace_back(count, a, 0.5);
      entries.emplace_back(count, b, 0.5);
      ++count;
    }
    return at->second;
  };
  Eigen::Matrix3Xi finer(3, 4 * triangles.cols());
  for (Eigen::Index f = 0; f < triangles.cols(); ++f)
  {
    const Eigen::Vector3i t = triangles.col(f);
    const int a = middle(t[0], t[1]), b = middle(t[1], t[2]), c = middle(t[2], t[0]);
    finer.col(4 * f) << t[0], a, c;
    finer.col(4 * f + 1) << t[1], b, a;
    finer.col(4 * f + 2) << t[2], c, b;
    finer.col(4 * f + 3) << a, b, c;
  }
  triangles.swap(finer);
  Weights weights(count, vertices);
  weights.setFromTriplets(entries.begin(), entries.end());
  return weights;
}

}   // namespace

Subdivision subdivide(const TriangleMesh& mesh, int levels)
{
  if (levels < 0 || levels > 10)
    throw std::invalid_argument("subdivision: levels must be from 0 to 10, got " + std::to_string(levels));
  Subdivision result;
  result.mesh = mesh;
  result.weights.resize(mesh.vertices.cols(), mesh.vertices.cols());
  result.weights.setIdentity();
  for (int level = 0; level < levels; ++level)
  {
    const Weights once = divideFaces(result.mesh.triangles, static_cast<int>(result.mesh.vertices.cols()));
    result.mesh.vertices = result.mesh.vertices * once.transpose();
    result.weights = Weights(once * result.weights);
  }
  return result;
}

}   // namespace slender
