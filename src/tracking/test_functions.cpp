#include "slender_sim/tracking/test_functions.h"

#include <algorithm>
#include <stdexcept>

namespace slender {

namespace {

using Triplets = std::vector<Eigen::Triplet<double>>;

TestFunctions::Values valuesOf(const Triplets& entries, std::size_t functions, Eigen::Index vertices)
{
  TestFunctions::Values values(static_cast<Eigen::Index>(functions), vertices);
  values.setFromTriplets(entries.begin(), entries.end(), [](double a, double b) { return std::max(a, b); });
  return values;
}

void paint(const PaintedRegion& region, const std::vector<int>& vertices, int count, const char* mesh, int row,
           Triplets& entries)
{
  const std::string who = "region '" + region.name + "': ";
  if (vertices.empty())
    throw std::invalid_argument(who + "has no vertices on the " + mesh + " mesh: paint some, or leave the region out");
  for (const int v : vertices)
  {
    if (v < 0 || v >= count)
      throw std::invalid_argument(who + "vertex " + std::to_string(v) + " is not on the " + mesh +
                                  " mesh, which has vertices 0 to " + std::to_string(count - 1));
    entries.emplace_back(row, v, 1.0);
  }
}

}   // namespace

TestFunctions paintedRegions(const std::vector<PaintedRegion>& regions, int guide_vertices, int tracked_vertices)
{
  TestFunctions functions;
  Triplets guide, tracked;
  for (std::size_t r = 0; r < regions.size(); ++r)
  {
    paint(regions[r], regions[r].guide, guide_vertices, "guide", static_cast<int>(r), guide);
    paint(regions[r], regions[r].tracked, tracked_vertices, "tracked", static_cast<int>(r), tracked);
    functions.names.push_back(regions[r].name);
  }
  functions.guide = valuesOf(guide, regions.size(), guide_vertices);
  functions.tracked = valuesOf(tracked, regions.size(), tracked_vertices);
  return functions;
}

TestFunctions paintedRegions(const std::vector<PaintedRegion>& regions, const Subdivision& subdivision)
{
  TestFunctions functions;
  Triplets guide, painted;
  const auto coarse = subdivision.weights.cols(), fine = subdivision.weights.rows();
  for (std::size_t r = 0; r < regions.size(); ++r)
  {
    paint(regions[r], regions[r].guide, static_cast<int>(coarse), "guide", static_cast<int>(r), guide);
    if (!regions[r].tracked.empty())
      paint(regions[r], regions[r].tracked, static_cast<int>(fine), "tracked", static_cast<int>(r), painted);
    functions.names.push_back(regions[r].name);
  }
  functions.guide = valuesOf(guide, regions.size(), coarse);
  const TestFunctions::Values prolonged = functions.guide * subdivision.weights.transpose();
  for (std::size_t r = 0; r < regions.size(); ++r)
    for (TestFunctions::Values::InnerIterator entry(prolonged, static_cast<Eigen::Index>(r));
         entry && regions[r].tracked.empty(); ++entry)
      painted.emplace_back(static_cast<int>(r), static_cast<int>(entry.col()), entry.value());
  functions.tracked = valuesOf(painted, regions.size(), fine);
  return functions;
}

TestFunctions subdivisionBasis(const Subdivision& subdivision, const std::vector<int>& vertices)
{
  const auto coarse = subdivision.weights.cols();
  std::vector<int> chosen = vertices;
  if (chosen.empty())
    for (int v = 0; v < coarse; ++v)
      chosen.push_back(v);
  TestFunctions functions;
  Triplets guide, tracked;
  const Eigen::SparseMatrix<double> columns = subdivision.weights;
  for (std::size_t k = 0; k < chosen.size(); ++k)
  {
    if (chosen[k] < 0 || chosen[k] >= coarse)
      throw std::invalid_argument("test functions: vertex " + std::to_string(chosen[k]) +
                                  " is not on the guide mesh, which has vertices 0 to " + std::to_string(coarse - 1));
    functions.names.push_back("vertex " + std::to_string(chosen[k]));
    guide.emplace_back(static_cast<int>(k), chosen[k], 1.0);
    for (Eigen::SparseMatrix<double>::InnerIterator entry(columns, chosen[k]); entry; ++entry)
      tracked.emplace_back(static_cast<int>(k), static_cast<int>(entry.row()), entry.value());
  }
  functions.guide = valuesOf(guide, chosen.size(), coarse);
  functions.tracked = valuesOf(tracked, chosen.size(), subdivision.weights.rows());
  return functions;
}

TestFunctions regionBasis(const TriangleMesh& mesh, const std::vector<int>& region_of_face)
{
  if (static_cast<Eigen::Index>(region_of_face.size()) != mesh.triangles.cols())
    throw std::invalid_argument("regions: one per face expected, " + std::to_string(mesh.triangles.cols()) +
                                " of them");
  const int regions = region_of_face.empty() ? 0 : 1 + *std::max_element(region_of_face.begin(), region_of_face.end());
  std::vector<int> faces(regions, 0);
  const Eigen::VectorXd areas = faceAreas(mesh), around = vertexAreas(mesh);
  Triplets entries;
  for (Eigen::Index f = 0; f < mesh.triangles.cols(); ++f)
  {
    const int region = region_of_face[f];
    if (region < 0)
      throw std::invalid_argument("regions: face " + std::to_string(f) + " has none");
    ++faces[region];
    for (const int v : mesh.triangles.col(f))
      entries.emplace_back(region, v, areas[f] / (3.0 * around[v]));
  }
  TestFunctions functions;
  for (int r = 0; r < regions; ++r)
  {
    if (faces[r] == 0)
      throw std::invalid_argument("region " + std::to_string(r) + " has no faces");
    functions.names.push_back("region " + std::to_string(r));
  }
  functions.tracked.resize(regions, mesh.vertices.cols());
  functions.tracked.setFromTriplets(entries.begin(), entries.end());
  functions.guide = functions.tracked;
  return functions;
}

}   // namespace slender
