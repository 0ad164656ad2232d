// Surfaces of genus 0 that Willmore flow makes a sphere (thesis 2.5.3, figure 2.5 left).
#include <chrono>
#include <cmath>
#include <random>

#include "mesh_cases.h"
#include "slender_sim/energy/isometric_bending.h"
#include "slender_sim/fairing/willmore_flow.h"
#include "slender_sim/geometry/mesh_shapes.h"
#include "slender_sim/geometry/mesh_subdivision.h"
#include "study/framework/cpu_clock.h"

namespace slender::study {
namespace {

constexpr int kFlowSteps = 10;
constexpr double kSphereEnergy = 16.0 * M_PI;   ///< int H^2

struct Start
{
  std::string name;
  TriangleMesh mesh;
};

Start icosahedron(int levels)
{
  return {"icosahedron, subdivided " + std::to_string(levels) + " times", subdivide(icosphere(1.0, 0), levels).mesh};
}

Start roughSphere(int levels, double roughness)
{
  TriangleMesh mesh = icosphere(1.0, levels);
  std::mt19937 engine(1);
  for (Eigen::Index v = 0; v < mesh.vertices.cols(); ++v)
    mesh.vertices.col(v) *= 1.0 + roughness * (engine() * 0x1p-31 - 1.0);
  return {"sphere with radii +-" + std::to_string(static_cast<int>(100 * roughness + 0.5)) + " %", mesh};
}

/// int H^2 as the conforming isometric model of the mesh itself has it: L and M are those of the mesh, with Voronoi
/// cells.
double independentEnergy(const TriangleMesh& mesh)
{
  PointVector x, y;
  toPoints(mesh.vertices, x);
  y = x;
  return isometricBending(mesh, meshTopology(mesh), IsometricElement::conforming, 1.0).multiply(x.data(), y.data());
}

struct Run
{
  std::vector<double> errors;               ///< of int H^2, relative, from the start on
  double factorization = 0.0, step = 0.0;   ///< [s]
  int cuts = 0;
  TriangleMesh mesh;
};

Run flowFrom(const TriangleMesh& start, double time_step, int iterations)
{
  Run run;
  run.mesh = start;
  const auto begin = std::chrono::steady_clock::now();
  WillmoreFlow flow(start, meshTopology(start), time_step, iterations);
  run.factorization = std::chrono::duration<double>(std::chrono::steady_clock::now() - begin).count();
  run.errors.push_back(2.0 * flow.energy(run.mesh.vertices) / kSphereEnergy - 1.0);
  const double before = threadSeconds();
  for (int k = 0; k < kFlowSteps; ++k)
  {
    const FairingReport report = flow.step(run.mesh.vertices);
    if (!report.ok)
      throw std::runtime_error("willmore_sphere: step " + std::to_string(k + 1) + ": " + report.message);
    run.errors.push_back(2.0 * report.energy / kSphereEnergy - 1.0);
    run.cuts += report.cuts;
  }
  run.step = (threadSeconds() - before) / kFlowSteps;
  return run;
}

}   // namespace

void runWillmoreSphere(StudyContext& context)
{
  Plot& plot = context.plot("willmore_sphere", "Willmore flow to the sphere", "step", "|int H^2 / (16 pi) - 1|");
  plot.log_x = false;
  std::vector<Start> starts{icosahedron(4)};
  if (!context.quick())
    for (Start& start : std::vector<Start>{icosahedron(3), icosahedron(5), roughSphere(4, 0.02), roughSphere(4, 0.1)})
      starts.push_back(start);
  struct Scheme
  {
    double time_step;   // [m^4]
    int iterations;
  };
  constexpr Scheme kSchemes[] = {{0.01, 1}, {0.01, 10}, {1.0, 1}, {1.0, 10}};
  int done = 0;
  for (const Start& start : starts)
    for (const Scheme& scheme : kSchemes)
    {
      context.progress(done++, static_cast<int>(starts.size() * std::size(kSchemes)), start.name);
      const Run r = flowFrom(start.mesh, scheme.time_step, scheme.iterations);
      const double independent = independentEnergy(r.mesh) / kSphereEnergy - 1.0;
      const Eigen::Vector3d middle = r.mesh.vertices.rowwise().mean();
      const Eigen::VectorXd radii = (r.mesh.vertices.colwise() - middle).colwise().norm();
      int within = kFlowSteps + 1;
      for (int k = kFlowSteps; k >= 0 && std::abs(r.errors[k]) <= 0.01; --k)
        within = k;
      Row& row = context.row();
      row.set("start", start.name)
          .set("vertices", static_cast<double>(start.mesh.vertices.cols()))
          .set("h_m4", scheme.time_step)
          .set("iterations", scheme.iterations)
          .set("error_start", r.errors.front())
          .set("error_after_10_steps", r.errors.back())
          .set("error_voronoi", independent)
          .set("steps_to_1_percent", within)
          .set("radius_spread", radii.maxCoeff() / radii.minCoeff() - 1.0)
          .set("halvings", r.cuts)
          .set("factorization_s", r.factorization)
          .set("step_s", r.step);
      const bool main = &start == &starts.front() && &scheme == kSchemes, last = &scheme == std::end(kSchemes) - 1;
      if (main || last)
      {
        row.check(kSphereEnergy * (1.0 + independent), kSphereEnergy, 0.01 * kSphereEnergy,
                  "int H^2 = 16 pi; conforming, Voronoi cells");
        Series& series = plot.at(start.name + (last ? ", iterated" : ", one iteration"));
        for (int k = 0; k <= kFlowSteps; ++k)
        {
          series.x.push_back(k);
          series.y.push_back(std::abs(r.errors[k]));
        }
      }
      if (!main)
        continue;
      context.metric("energy_relative_error", std::max(std::abs(r.errors.back()), std::abs(independent)));
      context.metric("steps_to_1_percent", within);
      context.metric("factorization_s", r.factorization);
      context.metric("step_s", r.step);
      Plot& picture = addPicture(context, "willmore_sphere_meshes",
                                 "icosahedron subdivided 4 times, and after 10 steps", "x [m]", "z [m]");
      const Camera camera{{0.2, 1, -0.1}, {0, 0, 1}};
      drawFaces(picture, "start", start.mesh, camera);
      drawFaces(picture, "10 steps", r.mesh, camera, 0, {2.5, 0, 0});
    }
  context.note(
      "The thesis (2 GHz notebook, 2006): 10 steps of 12 ms, prefactorisation 200 ms, for the icosahedron subdivided 4 "
      "times.");
  context.note(
      "h: time step of the flow; the matrix M/h + K is that of the start, factorised once. factorization_s counts "
      "topology and analysis.");
  context.note(
      "iterations: at most, of each step. Checked: the thesis's case in semi-implicit steps, and all starts in "
      "iterated ones of h = 1 m^4.");
  context.note(
      "error_voronoi: the same integral of the final mesh by isometricBending() with its own Voronoi cells (reference "
      "3c).");
}

const StudyRegistration kWillmoreSphereRegistration{
    "willmore_sphere", "an icosahedron and rough spheres that Willmore flow makes round: int H^2 against 16 pi",
    runWillmoreSphere};

}   // namespace slender::study
