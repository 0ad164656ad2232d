#include "slender_sim/fairing/hole_filling.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <optional>
#include <stdexcept>

#include <Eigen/Geometry>

#include "slender_sim/fairing/willmore_flow.h"
#include "patch_mesh.h"

namespace slender {

namespace {

constexpr int kSteps = 20;          ///< of the flow in a round
constexpr int kSweeps = 3;          ///< of evening out after a round
constexpr double kSettled = 1e-4;   ///< change of the energy in a round, relative
constexpr double kFlat = 1e-6;      ///< an energy that counts as none: the energy of a sphere is 8 pi

/// Mesh around a loop: third vertices of the faces at its edges, lengths at its vertices, edges between its vertices.
struct Rim
{
  std::vector<int> loop, beyond;   ///< the patch is left of the loop
  std::vector<double> lengths;
  std::set<std::pair<int, int>> taken;
};

Rim rimOf(const TriangleMesh& mesh, const MeshTopology& t, const std::vector<int>& boundary, double edge_length)
{
  Rim rim;
  rim.loop.assign(boundary.rbegin(), boundary.rend());
  const std::size_t n = rim.loop.size();
  std::map<int, std::size_t> place;
  for (std::size_t i = 0; i < n; ++i)
    place[rim.loop[i]] = i;
  rim.beyond.assign(n, -1);
  rim.lengths.assign(n, 0.0);
  std::vector<int> counts(n, 0);
  for (int e = 0; e < t.edgeCount(); ++e)
  {
    const auto tail = place.find(t.edges(0, e)), head = place.find(t.edges(1, e));
    const double length = (mesh.vertices.col(t.edges(0, e)) - mesh.vertices.col(t.edges(1, e))).norm();
    for (const auto& end : {tail, head})
      if (end != place.end())
      {
        rim.lengths[end->second] += length;
        ++counts[end->second];
      }
    if (tail == place.end() || head == place.end())
      continue;
    rim.taken.insert({std::min(tail->first, head->first), std::max(tail->first, head->first)});
    if (t.edge_faces(1, e) < 0 && (head->second + 1) % n == tail->second)
      rim.beyond[head->second] = t.edge_opposites(0, e);
  }
  for (std::size_t i = 0; i < n; ++i)
  {
    if (rim.beyond[i] < 0)
      throw std::invalid_argument("fillHole: the loop is not a boundary of the mesh");
    rim.lengths[i] = edge_length > 0 ? edge_length : rim.lengths[i] / counts[i];
  }
  return rim;
}

/// Edges of a patch must at least be so long that it has kMostFaces [m].
double shortestEdges(const TriangleMesh& mesh, const std::vector<Eigen::Vector3i>& faces)
{
  double twice = 0.0;
  for (const Eigen::Vector3i& f : faces)
    twice += (mesh.vertices.col(f[1]) - mesh.vertices.col(f[0]))
                 .cross(mesh.vertices.col(f[2]) - mesh.vertices.col(f[0]))
                 .norm();
  return std::sqrt(2.0 * twice / (std::sqrt(3.0) * kMostFaces));
}

HoleReport refused(const std::string& message)
{
  HoleReport report;
  report.ok = report.stationary = false;
  report.message = message;
  return report;
}

}   // namespace

HoleReport fillHole(TriangleMesh& mesh, const std::vector<int>& loop, const HoleOptions& options)
{
  if (!(options.edge_length >= 0) || !std::isfinite(options.edge_length) || options.max_rounds < 1)
    throw std::invalid_argument("fillHole: edge_length must not be negative [m], max_rounds at least 1");
  if (loop.size() < 3 || loop.size() > kLongestHole)
    return refused("a hole of " + std::to_string(loop.size()) + " edges cannot be closed: there may be 3 to " +
                   std::to_string(kLongestHole) + "; divide it by a strip of faces");
  const Rim rim = rimOf(mesh, meshTopology(mesh), loop, options.edge_length);
  if (loop.size() == 3 && rim.beyond[0] == rim.loop[2])
    return refused("a face without neighbours cannot be closed: its back would have the same vertices; remove it");
  std::vector<Eigen::Vector3i> faces = triangulateLoop(mesh.vertices, rim.loop, rim.beyond, rim.taken);
  if (faces.empty())
    return refused("the hole cannot be closed: each way needs an edge that the mesh already has");
  const double shortest = shortestEdges(mesh, faces);
  if (options.edge_length > 0 && options.edge_length < shortest)
    return refused("the patch would have more than " + std::to_string(kMostFaces) +
                   " faces: its edges must be longer than " + std::to_string(1e3 * shortest) + " mm");
  PatchMesh patch(mesh, rim.loop, rim.lengths, std::move(faces), rim.taken);
  patch.flip();
  HoleReport report;
  report.first_vertex = static_cast<int>(mesh.vertices.cols());
  report.first_face = static_cast<int>(mesh.triangles.cols());
  patch.refine();
  for (int k = 0; k < 5; ++k)
  {
    patch.even(kSweeps);
    patch.flip();
  }
  TriangleMesh whole = patch.joined(mesh);
  double last = std::numeric_limits<double>::infinity();
  FairingReport step;
  report.stationary = patch.vertices() == 0;
  while (!report.stationary && report.rounds < options.max_rounds)
  {
    if (report.rounds > 0)
    {
      patch.refine();
      patch.even(kSweeps);
      patch.flip();
      whole = patch.joined(mesh);
    }
    std::vector<char> selected(whole.vertices.cols(), 0);
    std::fill(selected.begin() + report.first_vertex, selected.end(), 1);
    std::optional<WillmoreFlow> flow;
    try
    {
      flow.emplace(whole, meshTopology(whole), std::numeric_limits<double>::infinity(), 1, selected);
    }
    catch (const std::invalid_argument& error)
    {
      return refused(std::string("the patch cannot be faired: ") + error.what());
    }
    for (int k = 0; k < kSteps; ++k)
    {
      step = flow->step(whole.vertices);
      ++report.steps;
      if (!step.ok || step.stationary || step.decrement < 0.1 * kSettled * (step.energy + kFlat))
        break;
    }
    ++report.rounds;
    patch.take(whole.vertices);
    report.energy = step.energy;
    report.stationary = step.ok && std::abs(step.energy - last) <= kSettled * (step.energy + kFlat);
    last = step.energy;
  }
  if (!step.ok)
    return refused("the patch cannot be faired: " + step.message);
  report.vertices = patch.vertices();
  report.faces = static_cast<int>(whole.triangles.cols()) - report.first_face;
  mesh = std::move(whole);
  return report;
}

}   // namespace slender
