// A character of thin material that walks as its guide does (thesis 6.5.4, figures 6.2 and 6.10): as it is, in a
// headwind, crinkled.
#include <cmath>
#include <stdexcept>

#include <Eigen/Geometry>

#include "biped.h"
#include "region_cases.h"
#include "slender_sim/geometry/mesh_offsets.h"
#include "slender_sim/tracking/clustering.h"
#include "guided_cloth.h"

namespace slender::study {

using Eigen::Matrix3Xd;
using Eigen::Vector3d;

namespace {

/// `crinkles` [m]: of the undeformed shape.
GuidedCloth character(const Biped& biped, const std::vector<int>& region, double crinkles)
{
  GuidedCloth c;
  c.name = "character";
  c.guide = biped.mesh();
  c.fine = subdivide(c.guide, 0);
  c.fine.mesh.vertices = crinkled(c.guide, crinkles, 2);
  c.functions = regionBasis(c.guide, region);
  c.model = buildCloth("character", c.fine.mesh, 0.15, isotropicMembrane(1e5, 0.3, 5e-4));
  c.model.bending = BendingModel::hinge;
  c.model.bending_modulus = 2e-5;
  c.model.stiffness_damping = 1e-3;
  c.gravity = Vector3d(0, 0, -9.81);
  c.at = [&biped](double t) { return biped.at(t); };
  return c;
}

}   // namespace

void runCharacter(StudyContext& context)
{
  useOneBlasThread();
  const Biped biped;
  std::vector<Matrix3Xd> walk;
  for (int k = 0; k < 60; ++k)
    walk.push_back(biped.at(Biped::kPeriod * (1.0 + k / 60.0)));
  ClusteringOptions clusters;
  clusters.regions = 280;
  const std::vector<int> region = clusterFaces(biped.mesh().triangles, walk, clusters).region;
  SurfacePicture& picture =
      context.picture("character", "A walking character of thin material, 280 regions (thesis figures 6.2, 6.10)");
  picture.view = {-0.8, 0.6, -0.1};
  picture.columns = 4;
  Plot& plot =
      context.plot("character_flutter", "A walking character: kinetic energy of what its regions' averages do not see",
                   "time [s]", "energy [mJ]");
  plot.log_x = plot.log_y = plot.markers = false;

  const double duration = context.quick() ? 1.2 : 5.0;
  double worst = 0;
  int done = 0;
  for (const char* look : {"plain", "headwind", "crinkled"})
  {
    context.progress(done++, 3, look);
    const std::string name = look;
    GuidedCloth c = character(biped, region, name == "crinkled" ? 0.005 : 0.0);
    if (name == "headwind")
    {
      c.wind = Vector3d(-25, 0, 0);
      c.model.aerodynamics.drag = 1.2;
      c.model.aerodynamics.lift = 0.6;
    }
    GuidedStepper run(c, Follow::averages);
    const int steps = static_cast<int>(std::lround(duration / c.step));
    double error = 0, away = 0, flutter = 0;
    Matrix3Xd guide;
    for (int k = 1; k <= steps; ++k)
    {
      const StepReport report = run.step();
      if (!report.ok)
        throw std::runtime_error(name + ": " + report.message);
      error = std::max(error, run.error());
      guide = c.at(run.time());
      away += (run.cloth().state.x - guide).squaredNorm() / static_cast<double>(guide.cols() * steps);
      const Matrix3Xd relative = run.cloth().state.v - c.velocity(run.time());
      const double energy = 0.5 * (relative.colwise().squaredNorm() * run.cloth().model->mass)(0);
      flutter += energy / steps;
      plot.at(name).x.push_back(run.time());
      plot.at(name).y.push_back(1e3 * energy);
    }
    worst = std::max(worst, error);
    const Vector3d here(guide.row(0).mean(), 0, 0);
    if (picture.panels.empty())
      picture.panels.push_back(
          {"guide and its regions",
           {{{guide.colwise() - here, c.guide.triangles}, true, huesOf(c.guide.triangles, region)}}});
    picture.panels.push_back({name, {{{run.cloth().state.x.colwise() - here, c.guide.triangles}}}});
    context.row()
        .set("look", name)
        .set("vertices", static_cast<double>(guide.cols()))
        .set("count", run.constraints().count())
        .set("rms_from_guide_m", std::sqrt(away))
        .set("flutter_mJ", 1e3 * flutter)
        .set("average_error_m", error)
        .set("ms_per_step", 1e3 * run.seconds() / steps)
        .set("seconds_per_simulated_second", run.seconds() / duration);
  }
  context.metric("worst_average_error_m", worst);
  context.note(
      "steps of 10 ms, without collisions; flutter: kinetic energy of the velocities relative to the guide's, mean. "
      "The thesis: 3038 vertices, 280 "
      "constraints, 43.2 s per frame.");
}

const StudyRegistration kCharacterRegistration{
    "character",
    "a character of 3,050 vertices that walks as its guide does (thesis figures 6.2, 6.10): as it is, in a "
    "headwind, crinkled",
    runCharacter};

}   // namespace slender::study
