#include "region_cases.h"

#include <algorithm>
#include <set>

namespace slender::study {

Eigen::VectorXi huesOf(const Eigen::Matrix3Xi& triangles, const std::vector<int>& region_of_face)
{
  const int regions = 1 + *std::max_element(region_of_face.begin(), region_of_face.end());
  std::vector<std::set<int>> at_vertex(static_cast<std::size_t>(triangles.maxCoeff() + 1)),
      beside(static_cast<std::size_t>(regions));
  for (Eigen::Index f = 0; f < triangles.cols(); ++f)
    for (const int v : triangles.col(f))
      at_vertex[v].insert(region_of_face[f]);
  for (const std::set<int>& met : at_vertex)
    for (const int r : met)
      beside[r].insert(met.begin(), met.end());
  std::vector<int> hue(static_cast<std::size_t>(regions), -1);
  for (int r = 0; r < regions; ++r)
  {
    std::vector<int> taken(SurfacePicture::kHues, 0);
    for (const int other : beside[r])
      if (hue[other] >= 0)
        ++taken[hue[other]];
    // the least used one, beginning elsewhere for each region
    int best = r % SurfacePicture::kHues;
    for (int k = 1; k < SurfacePicture::kHues; ++k)
    {
      const int next = (r + k) % SurfacePicture::kHues;
      if (taken[next] < taken[best])
        best = next;
    }
    hue[r] = best;
  }
  Eigen::VectorXi hues(triangles.cols());
  for (Eigen::Index f = 0; f < triangles.cols(); ++f)
    hues[f] = hue[region_of_face[f]];
  return hues;
}

}   // namespace slender::study
