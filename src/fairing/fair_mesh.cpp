#include "slender_sim/fairing/fair_mesh.h"

#include <algorithm>
#include <cmath>
#include <sstream>
#include <stdexcept>

#include "slender_sim/fairing/willmore_flow.h"
#include "slender_sim/geometry/mesh_defects.h"

namespace slender {

namespace {

/// Newton-like, of a step at most: enough for the implicit Euler method to the eye.
constexpr int kIterations = 10;

/// Of smoothing lengths in mean edges: the time step is the length's fourth power, and beyond this either it or the
/// mass is lost in rounding.
constexpr double kSmoothingRange = 1000.0;

void checkOptions(const FairingOptions& o)
{
  const auto length = [](double value) { return value >= 0 && std::isfinite(value); };
  if (o.steps < 0 || o.steps > 1000000)
    throw std::invalid_argument("steps must be from 0 to 1000000, got " + std::to_string(o.steps));
  if (o.largest_hole < 3 || o.largest_hole > kLongestHole)
    throw std::invalid_argument("the largest hole must have from 3 to " + std::to_string(kLongestHole) +
                                " edges, got " + std::to_string(o.largest_hole));
  if (!length(o.edge_length) || !length(o.smoothing))
    throw std::invalid_argument("edge length and smoothing length must be positive [m], or zero for the default");
  for (const FairingOptions::Ball& ball : o.region)
    if (!ball.middle.allFinite() || !(ball.radius > 0) || !length(ball.radius))
      throw std::invalid_argument("balls of the region must have a finite middle and a positive radius [m]");
}

double meanEdge(const TriangleMesh& mesh, const MeshTopology& topology)
{
  double sum = 0.0;
  for (Eigen::Index e = 0; e < topology.edges.cols(); ++e)
    sum += (mesh.vertices.col(topology.edges(0, e)) - mesh.vertices.col(topology.edges(1, e))).norm();
  return sum / static_cast<double>(topology.edges.cols());
}

void checkSmoothing(double length, const TriangleMesh& mesh)
{
  const double mean = meanEdge(mesh, meshTopology(mesh));
  if (length >= mean / kSmoothingRange && length <= mean * kSmoothingRange)
    return;
  std::ostringstream why;
  why << "the smoothing length is " << length << " m; must be from " << mean / kSmoothingRange << " m to "
      << mean * kSmoothingRange
      << " m (a thousandth of the mean edge length to a thousand times it), or zero for the default";
  throw std::invalid_argument(why.str());
}

bool fillHoles(TriangleMesh& mesh, const FairingOptions& options, const FairingProgress& progress,
               FairingSummary& summary)
{
  const auto loops = meshTopology(mesh).boundaries;   // later vertices are added behind: these stay valid
  HoleOptions hole;
  hole.edge_length = options.edge_length;
  for (std::size_t k = 0; k < loops.size(); ++k)
  {
    if (progress)
      progress("hole", k, loops.size());
    if (static_cast<int>(loops[k].size()) > options.largest_hole)
    {
      ++summary.open_holes;
      continue;
    }
    const HoleReport report = fillHole(mesh, loops[k], hole);
    if (!report.ok)
    {
      summary.message = "the hole of " + std::to_string(loops[k].size()) + " edges at vertex " +
                        std::to_string(loops[k].front()) + " (from 0) failed: " + report.message +
                        "; a lower limit for the largest hole leaves long ones open";
      return false;
    }
    ++summary.holes;
    summary.patch_vertices += report.vertices;
  }
  return true;
}

bool smooth(TriangleMesh& mesh, const FairingOptions& options, const FairingProgress& progress, FairingSummary& summary)
{
  const MeshTopology topology = meshTopology(mesh);
  std::vector<char> selected;
  for (Eigen::Index v = 0; !options.region.empty() && v < mesh.vertices.cols(); ++v)
    selected.push_back(std::any_of(options.region.begin(), options.region.end(), [&](const FairingOptions::Ball& ball) {
      return (mesh.vertices.col(v) - ball.middle).norm() <= ball.radius;
    }));
  const double length = options.smoothing > 0 ? options.smoothing : meanEdge(mesh, topology);
  WillmoreFlow flow(mesh, topology, std::pow(length, 4), kIterations, selected);
  summary.energy_before = summary.energy = flow.energy(mesh.vertices);
  for (int k = 0; k < options.steps && !summary.stationary; ++k)
  {
    if (progress)
      progress("step", static_cast<std::size_t>(k), static_cast<std::size_t>(options.steps));
    const FairingReport report = flow.step(mesh.vertices);
    if (!report.ok)
    {
      summary.message =
          "step " + std::to_string(k + 1) + " of " + std::to_string(options.steps) + " failed: " + report.message;
      return false;
    }
    summary.steps += !report.stationary;
    summary.cuts += report.cuts;
    summary.energy = report.energy;
    summary.stationary = report.stationary;
  }
  return true;
}

}   // namespace

FairingSummary fairMesh(TriangleMesh& mesh, const std::string& name, const FairingOptions& options,
                        const FairingProgress& progress)
{
  checkOptions(options);
  requireSoundMesh(mesh, name);
  if (options.smoothing > 0)
    checkSmoothing(options.smoothing, mesh);
  FairingSummary summary;
  TriangleMesh faired = mesh;
  summary.ok = (!options.fill_holes || fillHoles(faired, options, progress, summary)) &&
               (options.steps == 0 || smooth(faired, options, progress, summary));
  if (summary.ok)
    mesh = std::move(faired);
  return summary;
}

}   // namespace slender
