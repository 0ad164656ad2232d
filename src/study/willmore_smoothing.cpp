// Smoothing of rough meshes with as many triangles as the thesis's hand and dinosaur (2.5.3, figure 2.4).
#include <chrono>
#include <cmath>
#include <random>

#include <Eigen/Geometry>

#include "mesh_cases.h"
#include "slender_sim/fairing/willmore_flow.h"
#include "slender_sim/study/cpu_clock.h"

namespace slender::study {
namespace {

using Eigen::Vector3d;

constexpr int kSteps = 16;
constexpr double kTube = 0.45;   ///< radius [m]

/// Centreline of a trefoil on a torus, and the torus's normal there.
Vector3d centreline(double s) { return {(2 + std::cos(3 * s)) * std::cos(2 * s), (2 + std::cos(3 * s)) * std::sin(2 * s), std::sin(3 * s)}; }

Vector3d onTube(double s, double t)
{
  const Vector3d outward(std::cos(3 * s) * std::cos(2 * s), std::cos(3 * s) * std::sin(2 * s), std::sin(3 * s));
  const Vector3d tangent = (centreline(s + 1e-6) - centreline(s - 1e-6)).normalized();
  return centreline(s) + kTube * (std::cos(t) * outward + std::sin(t) * tangent.cross(outward));
}

struct Case
{
  const char* name;
  int along, around;                        ///< 2 along around triangles
  double thesis_factorization, thesis_steps;   ///< [s]
};

constexpr Case kCases[] = {{"hand", 252, 48, 5.31, 4.42}, {"dinosaur", 351, 64, 8.77, 7.47}};

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

}  // namespace

void runWillmoreSmoothing(StudyContext& context)
{
  Plot& plot = context.plot("willmore_smoothing", "A rough trefoil tube smoothed by Willmore flow", "step", "1/2 int H^2");
  plot.log_x = false;
  Eigen::Matrix3Xd line(3, 4000);
  for (Eigen::Index k = 0; k < line.cols(); ++k)
    line.col(k) = centreline(2 * M_PI * static_cast<double>(k) / static_cast<double>(line.cols()));
  const int repeats = context.quick() ? 1 : 3;
  int done = 0;
  for (const Case& c : kCases)
  {
    const TriangleMesh smooth = closedGrid(c.along, c.around, onTube);
    TriangleMesh rough = smooth;
    const double edge = 2 * M_PI * kTube / c.around;
    std::mt19937 engine(1);
    for (Eigen::Index k = 0; k < rough.vertices.size(); ++k)
      rough.vertices.data()[k] += 0.25 * edge * (engine() * 0x1p-31 - 1.0);
    const MeshTopology topology = meshTopology(rough);
    double factorization = INFINITY, stepping = INFINITY;
    TriangleMesh mesh;
    std::vector<double> energies;
    int cuts = 0;
    for (int repeat = 0; repeat < repeats; ++repeat)
    {
      context.progress(done++, repeats * static_cast<int>(std::size(kCases)), std::to_string(smooth.triangles.cols()) + " triangles");
      const auto begin = std::chrono::steady_clock::now();
      WillmoreFlow flow(rough, topology, std::pow(2 * edge, 4));
      factorization = std::min(factorization, std::chrono::duration<double>(std::chrono::steady_clock::now() - begin).count());
      mesh = rough;
      energies.assign(1, flow.energy(mesh.vertices));
      cuts = 0;
      const double before = threadSeconds();
      for (int k = 0; k < kSteps; ++k)
      {
        const FairingReport report = flow.step(mesh.vertices);
        if (!report.ok)
          throw std::runtime_error("willmore_smoothing: step " + std::to_string(k + 1) + ": " + report.message);
        energies.push_back(report.energy);
        cuts += report.cuts;
      }
      stepping = std::min(stepping, threadSeconds() - before);
    }
    const std::string triangles = std::to_string(smooth.triangles.cols());
    WillmoreFlow exact(smooth, topology, 1.0);
    context.row().set("triangles", static_cast<double>(smooth.triangles.cols())).set("thesis_mesh", c.name)
        .set("factorization_s", factorization).set("thesis_factorization_s", c.thesis_factorization)
        .set("sixteen_steps_s", stepping).set("thesis_sixteen_steps_s", c.thesis_steps).set("halvings", cuts)
        .set("energy_start", energies.front()).set("energy", energies.back()).set("energy_smooth_tube", exact.energy(smooth.vertices))
        .set("rms_from_tube_start_m", roughness(rough.vertices, line)).set("rms_from_tube_m", roughness(mesh.vertices, line))
        .set("volume_change", volume(mesh) / volume(smooth) - 1.0);
    context.metric("factorization_s_" + triangles, factorization);
    context.metric("sixteen_steps_s_" + triangles, stepping);
    context.metric("roughness_left_" + triangles, roughness(mesh.vertices, line) / roughness(rough.vertices, line));
    context.metric("volume_change_" + triangles, volume(mesh) / volume(smooth) - 1.0);
    Series& series = plot.at(triangles + " triangles");
    for (int k = 0; k <= kSteps; ++k)
    {
      series.x.push_back(k);
      series.y.push_back(energies[k]);
    }
    if (&c != kCases)
      continue;
    Plot& picture = addPicture(context, "willmore_smoothing_meshes", triangles + " triangles, before and after 16 steps", "x [m]", "y [m]");
    const Camera camera{{0, 0, -1}, {0, 1, 0}};
    drawFaces(picture, "start", rough, camera);
    drawFaces(picture, "16 steps", mesh, camera, 0, {8.0, 0, 0});
  }
  context.note("The thesis's times are a 2 GHz notebook's of 2006 (PARDISO); its meshes are not published, so a tube about a trefoil has as many triangles.");
  context.note("Each coordinate of each vertex is off by up to a quarter of an edge; the time step is that of twice an edge, (2 e)^4.");
  context.note("factorization_s: wall clock, with the analysis; sixteen_steps_s: processor time. The best of " + std::to_string(repeats) + ".");
}

}  // namespace slender::study
