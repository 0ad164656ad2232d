// A preview that ends where it shall, and what becomes of it in full resolution, free and tracked (thesis 6.5.1,
// figure 6.1).
#include <cmath>
#include <stdexcept>

#include <Eigen/Geometry>

#include "study/cloth/cloth_cases.h"
#include "study/framework/scene_cases.h"
#include "slender_sim/geometry/mesh_shapes.h"
#include "slender_sim/geometry/mesh_subdivision.h"
#include "study/framework/cpu_clock.h"

namespace slender::study {

using Eigen::Matrix3Xd;
using Eigen::Vector3d;

namespace {

TriangleMesh tube(const Capsule& capsule, const Pose& pose)
{
  constexpr int kAround = 16, kRings = 49;
  TriangleMesh mesh = gridMesh(1.0, 1.0, kAround, kRings - 1, GridPattern::alternating);
  const double half = 0.5 * capsule.length + capsule.radius;
  for (Eigen::Index i = 0; i < mesh.vertices.cols(); ++i)
  {
    const double angle = 2 * M_PI * mesh.vertices(0, i), z = half * (2 * mesh.vertices(1, i) - 1),
                 beyond = std::max(0.0, std::abs(z) - 0.5 * capsule.length);
    const double r = std::sqrt(std::max(0.0, capsule.radius * capsule.radius - beyond * beyond));
    mesh.vertices.col(i) = pose * Vector3d(r * std::cos(angle), r * std::sin(angle), z);
  }
  return mesh;
}

/// The vertices in the order of another mesh with the same ones.
std::vector<int> orderAs(const Matrix3Xd& wanted, const Matrix3Xd& given)
{
  std::vector<int> order;
  for (Eigen::Index i = 0; i < wanted.cols(); ++i)
  {
    Eigen::Index nearest;
    if ((given.colwise() - wanted.col(i)).colwise().squaredNorm().minCoeff(&nearest) > 1e-12)
      throw std::logic_error("cloth_on_branch: the free cloth has other vertices than the tracked one");
    order.push_back(static_cast<int>(nearest));
  }
  return order;
}

}   // namespace

void runClothOnBranch(StudyContext& context)
{
  useOneBlasThread();
  // in the quick form a quarter of the vertices
  Simulation scene =
      context.quick() ? packageScene("cloth_on_branch", {"cloths.1.grid.cells=[24, 16]", "tracked.0.mesh.subdivide=2"})
                      : packageScene("cloth_on_branch");
  enum
  {
    preview,
    free,
    tracked
  };
  const SceneConfig& config = scene.config();
  const TrackingConfig& tracking = *config.cloths[tracked].tracking;
  const std::vector<int> order = orderAs(config.cloths[tracked].mesh.vertices, config.cloths[free].mesh.vertices);
  const auto vertices = [&](int cloth) -> Matrix3Xd {
    const Matrix3Xd& x = scene.state().cloths[cloth].x;
    return cloth == free ? Matrix3Xd(x(Eigen::all, order)) : x;
  };
  const auto fromPreview = [&](int cloth) {
    return tracking.sets[0].constraints->error(tracking.sets[0].constraints->averages(vertices(preview)),
                                               vertices(cloth));
  };

  SurfacePicture& picture = context.picture(
      "cloth_on_branch",
      "A cloth blown against a branch (thesis figure 6.1): preview, free and tracked in full resolution");
  picture.view = {-0.35, 1.0, -0.3};
  picture.columns = 3;
  Plot& plot = context.plot("cloth_on_branch_distance",
                            "Cloth on a branch: how far the averages of its quarters are from the preview's",
                            "time [s]", "distance [m]");
  plot.log_x = plot.markers = false;
  const TriangleMesh branch = tube(std::get<Capsule>(config.obstacles.front().shape), config.obstacles.front().pose);
  // in small triangles, which can be drawn one behind the other
  const auto draw = [&](int cloth, const std::string& label) {
    const Subdivision fine = subdivide(config.cloths[cloth].mesh, cloth == preview ? 4 : 0);
    picture.panels.push_back(
        {label, {{{scene.state().cloths[cloth].x * fine.weights.transpose(), fine.mesh.triangles}}, {branch, false}}});
  };
  const double step = config.time.step;
  const int steps = static_cast<int>(std::lround(config.time.duration / step));
  double worst = 0, seconds = 0;
  for (int k = 1; k <= steps; ++k)
  {
    context.progress(k, steps, "blown");
    const double start = threadSeconds();
    const StepReport report = scene.step(scene.defaultInputs());
    seconds += threadSeconds() - start;
    if (!report.ok)
      throw std::runtime_error("cloth_on_branch, step " + std::to_string(k) + ": " + report.message);
    worst = std::max(worst, fromPreview(tracked));
    for (const int cloth : {free, tracked})
    {
      plot.at(config.cloths[cloth].name).x.push_back(k * step);
      plot.at(config.cloths[cloth].name).y.push_back(std::max(fromPreview(cloth), 1e-17));
    }
    if (k % 10 == 0)   // the three as they are at the same time
      context.row()
          .set("time_s", k * step)
          .set("free_from_preview_m", fromPreview(free))
          .set("tracked_from_preview_m", fromPreview(tracked))
          .set("free_vertices_rms_m",
               rmsDistance(vertices(free).leftCols(tracking.guide.mesh.vertices.cols()), vertices(preview)))
          .set("tracked_vertices_rms_m",
               rmsDistance(vertices(tracked).leftCols(tracking.guide.mesh.vertices.cols()), vertices(preview)));
  }
  draw(preview, "preview, " + std::to_string(config.cloths[preview].mesh.vertices.cols()) + " vertices");
  draw(free, "free, " + std::to_string(order.size()) + " vertices");
  draw(tracked, "tracked, by the averages of four regions");
  const double size = tracking.size, away = fromPreview(free);
  context.metric("tracked_from_preview_over_size", worst / size);
  context.metric("free_from_preview_over_size", away / size);
  context.metric("free_speed", scene.state().cloths[free].v.colwise().norm().maxCoeff());
  context.metric("seconds_per_step", seconds / steps);
  context.note(
      "from_preview: greatest distance of the average of a quarter from the preview's; of the tracked one the worst "
      "after any step. vertices_rms: of the "
      "vertices that the meshes share.");
}

const StudyRegistration kClothOnBranchRegistration{
    "cloth_on_branch",
    "a preview of 35 vertices, its scene in full resolution, and the same tracked (thesis figure 6.1): where they "
    "end",
    runClothOnBranch};

}   // namespace slender::study
