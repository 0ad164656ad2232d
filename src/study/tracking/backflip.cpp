// Five looks of one motion (thesis 6.5.3, figure 6.9): a bag of 1297 vertices tracks one of 88 through a backflip.
#include <algorithm>
#include <cmath>
#include <limits>
#include <stdexcept>

#include <Eigen/Geometry>

#include "study/cloth/cloth_cases.h"
#include "study/framework/scene_cases.h"
#include "slender_sim/geometry/mesh_subdivision.h"
#include "slender_sim/geometry/mesh_topology.h"
#include "study/framework/cpu_clock.h"
#include "world/impulse_cloths.h"

namespace slender::study {

using Eigen::Matrix3Xd;
using Eigen::Vector3d;

namespace {

struct Look
{
  std::string name;
  std::vector<std::string> overrides;   ///< of the scene backflip; docs/tracking.md lists them, too
};

const std::vector<Look>& looks()
{
  static const std::vector<Look> all{
      {"vinyl", {}},
      {"silk", {"tracked.0.damping.stiffness=0", "time.step=0.0025"}},
      {"ribbed",
       {"tracked.0.undeformed={ridges: {axis: [0, 0, 1], count: 5, height: 0.02}, lengths: true}",
        "tracked.0.bending.modulus=3e-4"}},
      {"cellophane",
       {"tracked.0.undeformed={crinkles: {height: 0.015}, lengths: true}", "tracked.0.bending.modulus=3e-4"}},
      {"wind",
       {"tracked.0.damping.stiffness=0", "tracked.0.aerodynamics={drag: 1.2, lift: 0.8}", "wind.velocity=[-25, 8, 0]"}},
  };
  return all;
}

struct Course
{
  std::vector<Matrix3Xd> frames;   ///< kept
  double seconds = 0;
};

/// Root mean square of the angles between faces at inner edges, by the lengths of these [rad].
double bending(const MeshTopology& topology, const TriangleMesh& mesh, const Matrix3Xd& x)
{
  double sum = 0, length = 0;
  const auto normal = [&](int face) {
    const Eigen::Vector3i t = mesh.triangles.col(face);
    const Vector3d a = x.col(t[0]), b = x.col(t[1]), c = x.col(t[2]);
    return Vector3d((b - a).cross(c - a).normalized());
  };
  for (Eigen::Index e = 0; e < topology.edges.cols(); ++e)
  {
    if (topology.edge_faces(1, e) < 0)
      continue;
    const double l = (x.col(topology.edges(0, e)) - x.col(topology.edges(1, e))).norm();
    const double angle =
        std::acos(std::clamp(normal(topology.edge_faces(0, e)).dot(normal(topology.edge_faces(1, e))), -1.0, 1.0));
    sum += l * angle * angle;
    length += l;
  }
  return std::sqrt(sum / length);
}

/// Root mean square strain of the edges.
double strain(const MeshTopology& topology, const Matrix3Xd& rest, const Matrix3Xd& x)
{
  double sum = 0;
  for (Eigen::Index e = 0; e < topology.edges.cols(); ++e)
  {
    const int a = topology.edges(0, e), b = topology.edges(1, e);
    const double ratio = (x.col(a) - x.col(b)).norm() / (rest.col(a) - rest.col(b)).norm() - 1;
    sum += ratio * ratio;
  }
  return std::sqrt(sum / static_cast<double>(topology.edges.cols()));
}

}   // namespace

void runBackflip(StudyContext& context)
{
  useOneBlasThread();
  SurfacePicture& picture =
      context.picture("backflip", "Five looks of a backflip at the landing, and their guide (thesis figure 6.9)");
  picture.view = {0.35, 1.0, -0.2};
  picture.columns = 6;
  Plot& plot =
      context.plot("backflip_folds", "Looks of a backflip: angles between faces", "time [s]", "root mean square [rad]");
  plot.log_x = plot.log_y = plot.markers = false;
  constexpr double kShown = 1.4;   // [s] landed
  const double duration = context.quick() ? 0.5 : 2.0;
  std::vector<Course> courses;
  std::size_t meetings = 0;
  double worst = 0;
  for (const Look& look : looks())
  {
    Simulation scene = packageScene("backflip", look.overrides);
    const SceneConfig& config = scene.config();
    const ClothConfig& cloth = config.cloths.front();
    const TriangleMesh& mesh = cloth.mesh;
    const MeshTopology topology = meshTopology(mesh);
    WorldModel alone;   // to check the output by all pairs
    alone.cloths.push_back({std::make_shared<const ClothModel>(scene.clothModel(0)), {}, cloth.contact, {}, {}});
    const ImpulseCloths checker(alone, {0});
    WorldState now;
    now.cloths.resize(1);

    Course course;
    const double step = config.time.step;
    const int steps = static_cast<int>(std::lround(duration / step)), every = static_cast<int>(std::lround(0.1 / step)),
              shown = static_cast<int>(std::lround(std::min(kShown, duration) / step));
    double folds = 0, stretch = 0, away = 0, error = 0;
    std::size_t guide_meetings = 0, own = 0;
    int kept = 0, cuts = 0;
    for (int k = 1; k <= steps; ++k)
    {
      context.progress(k, steps, look.name);
      const double start = threadSeconds();
      const StepReport report = scene.step(scene.defaultInputs());
      course.seconds += threadSeconds() - start;
      if (!report.ok)
        throw std::runtime_error("backflip, " + look.name + ", step " + std::to_string(k) + ": " + report.message);
      error = std::max(error, report.tracking_error);
      cuts += report.cut_steps;
      const ClothState& held = scene.state().cloths.front();
      const Matrix3Xd& guide = scene.state().cloth_guides.front().points;
      if (k == shown)
      {
        if (picture.panels.empty())
          picture.panels.push_back({"guide", {{{guide, cloth.tracking->guide.mesh.triangles}}}});
        picture.panels.push_back({look.name, {{{held.x, mesh.triangles}}}});
      }
      if (k % every != 0)
        continue;
      now.cloths[0] = held;
      own += checker.intersections(now);
      const Matrix3Xd smooth = guide * subdivide(cloth.tracking->guide.mesh, 2).weights.transpose();
      now.cloths[0].x = smooth;
      guide_meetings += checker.intersections(now);
      const double bent = bending(topology, mesh, held.x);
      folds += bent;
      stretch += strain(topology, mesh.vertices, held.x);
      away += rmsDistance(held.x, smooth);
      course.frames.push_back(held.x);
      plot.at(look.name).x.push_back(k * step);
      plot.at(look.name).y.push_back(bent);
      ++kept;
    }
    meetings += own;
    worst = std::max(worst, error);
    context.row()
        .set("look", look.name)
        .set("folds_rad", folds / kept)
        .set("strain_rms", stretch / kept)
        .set("from_guide_m", away / kept)
        .set("average_error_over_size", error)
        .set("intersections", static_cast<double>(own))
        .set("intersections_of_guide", static_cast<double>(guide_meetings))
        .set("cut_steps", cuts)
        .set("ms_per_step", 1e3 * course.seconds / steps);
    courses.push_back(std::move(course));
  }
  double least = std::numeric_limits<double>::infinity();
  for (std::size_t a = 0; a < courses.size(); ++a)
    for (std::size_t b = 0; b < a; ++b)
    {
      double sum = 0;
      for (std::size_t k = 0; k < courses[a].frames.size(); ++k)
        sum += rmsDistance(courses[a].frames[k], courses[b].frames[k]) / static_cast<double>(courses[a].frames.size());
      least = std::min(least, sum);
    }
  context.metric("intersections", static_cast<double>(meetings));
  context.metric("worst_average_error_over_size", worst);
  context.metric("least_difference_m", least);
  context.note(
      "folds: root mean square of the angles between faces; from_guide: root mean square distance from the subdivided "
      "guide; both, like strain_rms (of "
      "edges), means over frames of 0.1 s. least_difference: of the two looks that differ least, root mean square "
      "distance of their vertices. "
      "intersections: of all frames, by a check of all pairs; intersections_of_guide: of the subdivided guide.");
}

const StudyRegistration kBackflipRegistration{
    "backflip", "five looks of a bag of 1,297 vertices that tracks one of 88 through a backflip (thesis figure 6.9)",
    runBackflip};

}   // namespace slender::study
