// Smoothing of rough meshes with as many triangles as the thesis's hand and dinosaur (2.5.3, figure 2.4).
#include <chrono>
#include <cmath>
#include <random>

#include <Eigen/Geometry>

#include "mesh_cases.h"
#include "slender_sim/fairing/willmore_flow.h"
#include "study/framework/cpu_clock.h"

namespace slender::study {
namespace {

using Eigen::Vector3d;

constexpr int kSmoothingSteps = 16;
constexpr double kTube = 0.45;   ///< radius [m]

/// Centreline of a trefoil on a torus, and the torus's normal there.
Vector3d centreline(double s)
{
  return {(2 + std::cos(3 * s)) * std::cos(2 * s), (2 + std::cos(3 * s)) * std::sin(2 * s), std::sin(3 * s)};
}

Vector3d onTube(double s, double t)
{
  const Vector3d outward(std::cos(3 * s) * std::cos(2 * s), std::cos(3 * s) * std::sin(2 * s), std::sin(3 * s));
  const Vector3d tangent = (centreline(s + 1e-6) - centreline(s - 1e-6)).normalized();
  return centreline(s) + kTube * (std::cos(t) * outward + std::sin(t) * tangent.cross(outward));
}

struct SmoothedSurface
{
  const char* name;
  int along, around;                           ///< 2 along around triangles
  double thesis_factorization, thesis_steps;   ///< [s]
};

constexpr SmoothedSurface kSmoothedSurfaces[] = {{"hand", 252, 48, 5.31, 4.42}, {"dinosaur", 351, 64, 8.77, 7.47}};

/// Root mean square of the vertices' distances from the tube's surface [m].
double roughness(const Eigen::Matrix3Xd& vertices, const Eigen::Matrix3Xd& line)
{
  double sum = 0.0;
  for (Eigen::Index v = 0; v < vertices.cols(); ++v)
  {
    const double distance = std::sqrt((line.colwise() - vertices.col(v)).colwise().squaredNorm().minCoeff());
    sum += std::pow(distance - kTube, 2);
  }
  return std::sqrt(sum / static_cast<double>(vertices.cols()));
}

double volume(const TriangleMesh& mesh)
{
  double sum = 0.0;
  for (Eigen::Index f = 0; f < mesh.triangles.cols(); ++f)
  {
    const auto p = [&](int k) -> Vector3d { return mesh.vertices.col(mesh.triangles(k, f)); };
    sum += p(0).dot(p(1).cross(p(2))) / 6.0;
  }
  return sum;
}

struct Smoothed
{
  double factorization = INFINITY, steps = INFINITY;   ///< [s]
  int iterations = 0;
  std::vector<double> energies;
  TriangleMesh mesh;
};

Smoothed flow(const TriangleMesh& start, const MeshTopology& topology, double edge)
{
  Smoothed outcome;
  outcome.mesh = start;
  const auto begin = std::chrono::steady_clock::now();
  WillmoreFlow flow(start, topology, std::pow(edge, 4), 10);
  outcome.factorization = std::chrono::duration<double>(std::chrono::steady_clock::now() - begin).count();
  outcome.energies.push_back(flow.energy(start.vertices));
  const double before = threadSeconds();
  for (int k = 0; k < kSmoothingSteps; ++k)
  {
    const FairingReport report = flow.step(outcome.mesh.vertices);
    if (!report.ok)
      throw std::runtime_error("willmore_smoothing: step " + std::to_string(k + 1) + ": " + report.message);
    outcome.energies.push_back(report.energy);
    outcome.iterations += report.iterations;
  }
  outcome.steps = threadSeconds() - before;
  return outcome;
}

}   // namespace

void runWillmoreSmoothing(StudyContext& context)
{
  Plot& plot =
      context.plot("willmore_smoothing", "A rough trefoil tube smoothed by Willmore flow", "step", "1/2 int H^2");
  plot.log_x = false;
  Eigen::Matrix3Xd line(3, 4000);
  for (Eigen::Index k = 0; k < line.cols(); ++k)
    line.col(k) = centreline(2 * M_PI * static_cast<double>(k) / static_cast<double>(line.cols()));
  const int repeats = context.quick() ? 1 : 3;
  int done = 0;
  for (const SmoothedSurface& c : kSmoothedSurfaces)
  {
    const TriangleMesh smooth = closedGrid(c.along, c.around, onTube);
    TriangleMesh rough = smooth;
    const double edge = 2 * M_PI * kTube / c.around;
    std::mt19937 engine(1);
    for (Eigen::Index k = 0; k < rough.vertices.size(); ++k)
      rough.vertices.data()[k] += 0.25 * edge * (engine() * 0x1p-31 - 1.0);
    const MeshTopology topology = meshTopology(rough);
    const std::string triangles = std::to_string(smooth.triangles.cols());
    Smoothed best;
    for (int repeat = 0; repeat < repeats; ++repeat)
    {
      context.progress(done++, repeats * static_cast<int>(std::size(kSmoothedSurfaces)), triangles + " triangles");
      const Smoothed outcome = flow(rough, topology, edge);
      best.factorization = std::min(best.factorization, outcome.factorization);
      best.steps = std::min(best.steps, outcome.steps);
      best.energies = outcome.energies;
      best.iterations = outcome.iterations;
      best.mesh = outcome.mesh;
    }
    const Smoothed even = flow(smooth, topology, edge);   // what the flow does to the tube itself
    const double before = roughness(rough.vertices, line), after = roughness(best.mesh.vertices, line);
    const double swelling = volume(best.mesh) / volume(smooth) - 1.0;
    context.row()
        .set("triangles", static_cast<double>(smooth.triangles.cols()))
        .set("thesis_mesh", c.name)
        .set("factorization_s", best.factorization)
        .set("thesis_factorization_s", c.thesis_factorization)
        .set("sixteen_steps_s", best.steps)
        .set("thesis_sixteen_steps_s", c.thesis_steps)
        .set("iterations", best.iterations)
        .set("energy_start", best.energies.front())
        .set("energy", best.energies.back())
        .set("energy_smooth_tube", even.energies.front())
        .set("rms_from_tube_start_m", before)
        .set("rms_from_tube_m", after)
        .set("volume_change", swelling)
        .set("volume_change_smooth_tube", volume(even.mesh) / volume(smooth) - 1.0);
    context.metric("factorization_s_" + triangles, best.factorization);
    context.metric("sixteen_steps_s_" + triangles, best.steps);
    context.metric("roughness_left_" + triangles, after / before);
    context.metric("volume_change_" + triangles, swelling);
    Series& series = plot.at(triangles + " triangles");
    for (int k = 0; k <= kSmoothingSteps; ++k)
    {
      series.x.push_back(k);
      series.y.push_back(best.energies[k]);
    }
    if (&c != kSmoothedSurfaces)
      continue;
    Plot& picture = addPicture(context, "willmore_smoothing_meshes",
                               triangles + " triangles, before and after 16 steps", "x [m]", "y [m]");
    const Camera camera{{0, 0, -1}, {0, 1, 0}};
    drawFaces(picture, "start", rough, camera);
    drawFaces(picture, "16 steps", best.mesh, camera, 0, {8.0, 0, 0});
  }
  context.note(
      "The thesis's times are a 2 GHz notebook's of 2006 (PARDISO); its meshes are not published, so a tube about a "
      "trefoil has as many triangles.");
  context.note(
      "Each coordinate of each vertex is off by up to a quarter of an edge; the time step is that of an edge, e^4.");
  context.note(
      "A thin tube swells in Willmore flow, as its energy is that of its length over its radius: "
      "volume_change_smooth_tube shows how much.");
  context.note("factorization_s: wall clock, with the analysis; sixteen_steps_s: processor time. The best of " +
               std::to_string(repeats) + ".");
}

const StudyRegistration kWillmoreSmoothingRegistration{
    "willmore_smoothing", "rough meshes of 24,192 and 44,928 triangles: times of 16 steps and of the factorisation",
    runWillmoreSmoothing};

}   // namespace slender::study
