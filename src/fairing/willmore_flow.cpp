#include "slender_sim/fairing/willmore_flow.h"

#include <cmath>
#include <stdexcept>

#include "slender_sim/energy/isometric_bending.h"
#include "slender_sim/linalg/interruption.h"

namespace slender {

namespace {

constexpr int kCuts = 30;
/// Share of the promised decrease that a step must bring (Armijo).
constexpr double kSufficient = 1e-4;
/// Below these parts of the energy, and of the vertices' coordinates, a step is round-off; below the second ones it may
/// be.
constexpr double kEnergyResolved = 1e-12, kMoveResolved = 1e-14;
constexpr double kEnergyDoubtful = 1e-9, kMoveDoubtful = 1e-10;
/// Iterations end where they promise this part of what the first one promised.
constexpr double kConverged = 1e-3;

}   // namespace

/// What the moving vertices depend on, with numbers of its own: the moving vertices and their neighbours, whose
/// curvatures count, and the neighbours of these.
struct WillmoreFlow::Part
{
  Eigen::Index mesh_vertices;
  std::vector<int> moving, vertices;
  std::vector<char> held, counted;
  TriangleMesh mesh;
  MeshTopology topology;   ///< only what isometricBending() reads
  double time_step;
  int iterations;

  Part(const TriangleMesh& whole, const MeshTopology& t, double step, int count, const std::vector<char>& selected)
    : mesh_vertices(whole.vertices.cols()),
      time_step(step),
      iterations(count)
  {
    if (iterations < 1)
      throw std::invalid_argument("Willmore flow: a step needs at least one iteration");
    const std::size_t n = static_cast<std::size_t>(mesh_vertices);
    if (!(time_step > 0))
      throw std::invalid_argument("Willmore flow: the time step must be positive [m^4]");
    if ((!selected.empty() && selected.size() != n) || t.on_boundary.size() != n)
      throw std::invalid_argument("Willmore flow: the selection and the topology must be those of the mesh's vertices");
    std::vector<char> moves(n, 0), counts(n, 0), needed(n, 0);
    for (Eigen::Index f = 0; f < whole.triangles.cols(); ++f)
      for (int k = 0; k < 3; ++k)
        moves[whole.triangles(k, f)] = selected.empty() || selected[whole.triangles(k, f)];
    for (Eigen::Index e = 0; e < t.edges.cols(); ++e)
      for (int s = 0; s < 2; ++s)
        if (t.on_boundary[t.edges(s, e)])
          moves[t.edges(0, e)] = moves[t.edges(1, e)] = 0;
    for (Eigen::Index e = 0; e < t.edges.cols(); ++e)
      if (moves[t.edges(0, e)] || moves[t.edges(1, e)])
        for (int s = 0; s < 2; ++s)
          counts[t.edges(s, e)] = !t.on_boundary[t.edges(s, e)];
    std::vector<int> faces;
    for (Eigen::Index f = 0; f < whole.triangles.cols(); ++f)
    {
      const auto corners = whole.triangles.col(f);
      if (!counts[corners[0]] && !counts[corners[1]] && !counts[corners[2]])
        continue;
      faces.push_back(static_cast<int>(f));
      for (int k = 0; k < 3; ++k)
        needed[corners[k]] = 1;
    }
    std::vector<int> local(n, -1);
    for (std::size_t v = 0; v < n; ++v)
      if (needed[v])
      {
        local[v] = static_cast<int>(vertices.size());
        vertices.push_back(static_cast<int>(v));
        held.push_back(!moves[v]);
        counted.push_back(counts[v]);
        if (moves[v])
          moving.push_back(static_cast<int>(v));
      }
    if (moving.empty())
      throw std::invalid_argument(
          "Willmore flow: no vertex may move: the mesh's boundary and its neighbours are held, and all that is not "
          "selected");
    mesh.vertices.resize(3, static_cast<Eigen::Index>(vertices.size()));
    for (std::size_t i = 0; i < vertices.size(); ++i)
      mesh.vertices.col(static_cast<Eigen::Index>(i)) = whole.vertices.col(vertices[i]);
    mesh.triangles.resize(3, static_cast<Eigen::Index>(faces.size()));
    for (std::size_t f = 0; f < faces.size(); ++f)
      for (int k = 0; k < 3; ++k)
        mesh.triangles(k, static_cast<Eigen::Index>(f)) = local[whole.triangles(k, faces[f])];
    std::vector<int> edges;
    for (int e = 0; e < t.edgeCount(); ++e)
      if (counts[t.edges(0, e)] || counts[t.edges(1, e)])
        edges.push_back(e);
    topology.edges.resize(2, static_cast<Eigen::Index>(edges.size()));
    topology.edge_opposites.resizeLike(topology.edges);
    for (std::size_t e = 0; e < edges.size(); ++e)
      for (int s = 0; s < 2; ++s)
      {
        const int opposite = t.edge_opposites(s, edges[e]);
        topology.edges(s, static_cast<Eigen::Index>(e)) = local[t.edges(s, edges[e])];
        topology.edge_opposites(s, static_cast<Eigen::Index>(e)) = opposite < 0 ? -1 : local[opposite];
      }
    for (char c : counted)
      topology.on_boundary.push_back(!c);
  }
};

WillmoreFlow::WillmoreFlow(const TriangleMesh& mesh, const MeshTopology& topology, double time_step, int iterations,
                           const std::vector<char>& selected)
  : WillmoreFlow(Part(mesh, topology, time_step, iterations, selected))
{
}

WillmoreFlow::WillmoreFlow(Part part)
  : mesh_vertices_(part.mesh_vertices),
    iterations_(part.iterations),
    moving_(std::move(part.moving)),
    vertices_(std::move(part.vertices)),
    held_(std::move(part.held)),
    willmore_(part.mesh.triangles, part.counted)
{
  toPoints(part.mesh.vertices, x_);
  start_ = gradient_ = direction_ = trial_ = x_;
  if (!std::isfinite(willmore_.energy(x_.data())))
    throw std::invalid_argument("Willmore flow: a face has no area, or a vertex is not finite; mend the mesh first");
  const int n = part.mesh.vertices.cols();
  const PointMatrix bending = isometricBending(part.mesh, part.topology, IsometricElement::conforming, 1.0);
  std::vector<Eigen::Triplet<double>> entries;
  entries.reserve(bending.values().size() + n);
  for (int i = 0; i < n; ++i)
    for (int k = bending.starts()[i]; k < bending.starts()[i + 1]; ++k)
      entries.emplace_back(i, bending.column(k), bending.values()[k]);
  const Eigen::VectorXd areas = vertexAreas(part.mesh);
  for (int i = 0; i < n; ++i)
  {
    mass_rate_.push_back(areas[i] / part.time_step);
    entries.emplace_back(i, i, mass_rate_.back());
  }
  const PointMatrix matrix(n, entries);
  cholesky_.setPattern(matrix);
  if (!cholesky_.factor(matrix, held_.data()))
    throw std::invalid_argument(
        "Willmore flow: the matrix is singular: faces are nearly without area, or nothing is held and the time step is "
        "too long");
}

void WillmoreFlow::load(const Eigen::Matrix3Xd& vertices)
{
  if (vertices.cols() != mesh_vertices_)
    throw std::invalid_argument("Willmore flow: there must be " + std::to_string(mesh_vertices_) + " vertices, got " +
                                std::to_string(vertices.cols()));
  for (std::size_t i = 0; i < vertices_.size(); ++i)
    point(x_, static_cast<Eigen::Index>(i)) = vertices.col(vertices_[i]);
}

double WillmoreFlow::energy(const Eigen::Matrix3Xd& vertices)
{
  load(vertices);
  return willmore_.energy(x_.data());
}

/// direction_ := the step of the flow from x_, as far as it is linear. Returns why that cannot be; empty: it can.
std::string WillmoreFlow::findDirection(Reach& reach)
{
  std::fill(gradient_.begin(), gradient_.end(), 0.0);
  if (!std::isfinite(willmore_.addGradient(x_.data(), gradient_.data())))
    return "a face has no area, or a vertex is not finite; mend the mesh first";
  for (std::size_t i = 0; i < held_.size(); ++i)
    for (int k = 0; k < 4; ++k)
    {
      double& g = gradient_[4 * i + k];
      g = held_[i] || k == 3 ? 0.0 : -g - mass_rate_[i] * (x_[4 * i + k] - start_[4 * i + k]);
    }
  cholesky_.solvePoints(gradient_.data(), direction_.data());
  reach = {};
  for (std::size_t k = 0; k < gradient_.size(); ++k)
  {
    reach.decrement += gradient_[k] * direction_[k];
    reach.move = std::max(reach.move, std::abs(direction_[k]));
    reach.size = std::max(reach.size, std::abs(x_[k]));
  }
  return std::isfinite(reach.decrement)
             ? ""
             : "the gradient is too large for finite numbers; mend the mesh's thinnest faces first";
}

/// Goes along direction_ as far as `merit` falls enough, and counts how often the way was halved. Returns false if it
/// falls nowhere.
bool WillmoreFlow::search(double decrement, double& merit, double& energy, int& cuts)
{
  cuts = 0;
  for (double scale = 1.0; cuts <= kCuts; scale *= 0.5, ++cuts)
  {
    double distance = 0.0;
    for (std::size_t i = 0; i < held_.size(); ++i)
      for (int k = 0; k < 4; ++k)
      {
        trial_[4 * i + k] = x_[4 * i + k] + scale * direction_[4 * i + k];
        distance += mass_rate_[i] * std::pow(trial_[4 * i + k] - start_[4 * i + k], 2);
      }
    const double there = willmore_.foldsOver(x_.data(), trial_.data()) ? INFINITY : willmore_.energy(trial_.data());
    if (there + 0.5 * distance <= merit - kSufficient * scale * decrement)
    {
      merit = there + 0.5 * distance;
      energy = there;
      return true;
    }
  }
  return false;
}

FairingReport WillmoreFlow::step(Eigen::Matrix3Xd& vertices)
{
  FairingReport report;
  const auto refuse = [&](const std::string& reason) {
    report.ok = false;
    report.energy = report.energy_before;
    report.message = reason;
    return report;
  };
  load(vertices);
  start_ = x_;
  report.energy_before = report.energy = willmore_.energy(x_.data());
  double merit = report.energy;   // E + |x - start|^2_M / (2 h), whose minimum is the step's end
  for (int iteration = 0; iteration < iterations_; ++iteration)
  {
    if (stepsInterrupted())
      return refuse(kStepInterrupted);
    Reach reach;
    if (const std::string why = findDirection(reach); !why.empty())
      return refuse(why);
    if (iteration == 0)
      report.decrement = reach.decrement;
    const bool resolved = reach.decrement > kEnergyResolved * report.energy && reach.move > kMoveResolved * reach.size;
    if (!resolved || reach.decrement <= kConverged * report.decrement * (iteration > 0))
    {
      report.stationary = iteration == 0;
      break;
    }
    int cuts = 0;
    if (!search(reach.decrement, merit, report.energy, cuts))
    {
      if (iteration > 0)
        break;   // the iterations so far are a step
      report.stationary =
          reach.decrement <= kEnergyDoubtful * report.energy_before || reach.move <= kMoveDoubtful * reach.size;
      if (report.stationary)
        return report;
      return refuse(
          "no step in the flow's direction lowers the energy; remesh the thinnest faces, or take a shorter time step");
    }
    report.cuts += cuts;
    ++report.iterations;
    x_.swap(trial_);
  }
  for (std::size_t i = 0; i < held_.size(); ++i)
    if (!held_[i])
    {
      const auto at = point(x_, static_cast<Eigen::Index>(i));
      report.largest_move = std::max(report.largest_move, (at - point(start_, static_cast<Eigen::Index>(i))).norm());
      vertices.col(vertices_[i]) = at;
    }
  return report;
}

}   // namespace slender
