// A flag in the wind (thesis figure 2.1): isometric bending beside nonlinear hinges. Its motion is chaotic, so
// statistics are compared.
#include <cmath>

#include "sheet_cases.h"

namespace slender::study {

namespace {

constexpr double kWidth = 1.2, kHeight = 0.8;   // [m]

SheetScene flagScene(int cells, double duration)
{
  SheetScene s;
  s.name = "flag";
  s.columns = cells;
  s.rows = 2 * cells / 3;
  s.mesh = gridMesh(kWidth, kHeight, s.columns, s.rows, GridPattern::alternating);
  s.start.resize(3, s.mesh.vertices.cols());
  for (Eigen::Index i = 0; i < s.start.cols(); ++i)   // in the plane of x and z, a little bent
  {
    const double u = s.mesh.vertices(0, i) / kWidth;
    s.start.col(i) = Eigen::Vector3d(s.mesh.vertices(0, i), 0.02 * u * u, s.mesh.vertices(1, i));
  }
  s.model = buildCloth("flag", s.mesh, 0.15, isotropicMembrane(500.0, 0.3, 1.0));
  s.model.bending_modulus = 5e-5;
  s.model.wind_coefficient = 0.6;
  s.contact.thickness = 3e-3;
  s.contact.friction = 0.3;
  s.pins = verticesWhere(s.mesh, [](const Eigen::Vector3d& p) { return p.x() < 1e-9; });
  s.wind = Eigen::Vector3d(8.0, 0, 0);
  s.step = 5e-3;
  s.duration = duration;
  s.keep_from = 1.5;
  s.keep_every = 0.05;
  return s;
}

double meanOf(const std::vector<double>& values)
{
  double sum = 0;
  for (const double v : values)
    sum += v;
  return sum / static_cast<double>(values.size());
}

double spreadOf(const std::vector<double>& values)
{
  const double mean = meanOf(values);
  double sum = 0;
  for (const double v : values)
    sum += (v - mean) * (v - mean);
  return std::sqrt(sum / static_cast<double>(values.size()));
}

}   // namespace

void runFlag(StudyContext& context)
{
  useOneBlasThread();
  const SheetScene scene = flagScene(context.quick() ? 36 : 60, context.quick() ? 4.0 : 12.0);
  SurfacePicture& picture =
      context.picture("flag", "A flag of 1.2 m x 0.8 m in wind (thesis figure 2.1), at the same times");
  picture.view = {0.4, 1.0, -0.25};
  Plot& spectra = context.plot("flag_wrinkles", "Flag: where its curvature lies", "wavelength [m]",
                               "share of the variance of mean curvature");
  Plot& paths = context.plot("flag_corner", "Flag: its free upper corner", "time [s]", "out of the plane [m]");
  paths.log_x = paths.log_y = paths.markers = false;

  struct Case
  {
    const char* name;
    BendingModel bending;
    double shake;
  };
  const Case cases[] = {
      {"isometric", BendingModel::isometric_nonconforming, 0.0},
      {"hinge", BendingModel::hinge, 0.0},
      {"isometric, shaken start", BendingModel::isometric_nonconforming, 1e-3 * kWidth / scene.columns}};
  std::vector<SheetRun> runs;
  std::vector<Spectrum> of_runs;
  for (const Case& c : cases)
  {
    runs.push_back(runSheet(context, scene, c.bending, c.shake));
    const SheetRun& run = runs.back();
    of_runs.push_back(wrinkles(scene, run.frames));
    std::vector<double> along, across, down, out;
    for (const Eigen::Vector3d& x : run.corner)
    {
      along.push_back(x.x());
      across.push_back(x.y());
      down.push_back(x.z());
    }
    for (const Eigen::Matrix3Xd& x : run.frames)
      out.push_back(std::sqrt(x.row(1).squaredNorm() / static_cast<double>(x.cols())));
    context.row()
        .set("model", c.name)
        .set("vertices", static_cast<double>(scene.start.cols()))
        .set("corner_along_m", meanOf(along))
        .set("corner_height_m", meanOf(down))
        .set("corner_swing_m", spreadOf(across))
        .set("rms_out_of_plane_m", meanOf(out))
        .set("mean_wavelength_m", of_runs.back().mean())
        .set("spectrum_distance", distance(of_runs.back(), of_runs.front()))
        .set("rms_difference", difference(scene, run.frames.back(), runs.front().frames.back()).rms)
        .set("ms_per_step", 1e3 * run.seconds_per_step)
        .set("cloth_alone_ms", 1e3 * run.cloth_seconds)
        .set("intersections", static_cast<double>(run.intersections));
    Series& spectrum = spectra.at(c.name);
    spectrum.x = of_runs.back().wavelength;
    spectrum.y = of_runs.back().share;
    Series& path = paths.at(c.name);
    for (std::size_t k = 0; k < across.size(); ++k)
    {
      path.x.push_back(scene.keep_from + static_cast<double>(k) * scene.step);
      path.y.push_back(across[k]);
    }
  }
  context.metric("spectrum_distance", distance(of_runs[1], of_runs[0]));
  context.metric("spectrum_distance_of_chance", distance(of_runs[2], of_runs[0]));
  context.metric("hinge_over_isometric_step", runs[1].seconds_per_step / runs[0].seconds_per_step);
  context.metric("hinge_over_isometric_cloth_alone", runs[1].cloth_seconds / runs[0].cloth_seconds);
  context.note("means over the time after " + std::to_string(scene.keep_from).substr(0, 3) +
               " s; the shaken start says how far apart runs of one "
               "model are; rms_difference: of the last states, over the width");
  const std::size_t frames = runs[0].frames.size();
  for (const std::size_t k : {frames / 3, 2 * frames / 3, frames - 1})
    for (int model = 0; model < 2; ++model)
    {
      char label[60];
      std::snprintf(label, sizeof label, "%s, %.2f s", model ? "nonlinear hinges" : "isometric bending",
                    scene.duration - static_cast<double>(frames - 1 - k) * scene.keep_every);
      picture.panels.push_back({label, {{{runs[model].frames[k], scene.mesh.triangles}}}});
    }
}

const StudyRegistration kFlagRegistration{
    "flag", "a flag in wind, as thesis figure 2.1: isometric bending beside hinges, statistics and wrinkles", runFlag};

}   // namespace slender::study
