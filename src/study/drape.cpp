// A square sheet draped over a sphere (thesis figures 2.2 and 2.3): isometric bending beside nonlinear hinges.
#include <cmath>

#include "sheet_cases.h"

namespace slender::study {

namespace {

constexpr double kSphere = 0.2;       // [m]
constexpr double kThickness = 4e-3;

/// 1 m x 1 m over a sphere about the origin.
SheetScene sheetOverSphere(const std::string& name, int cells, double stiffness, double area_density, double bending_modulus, double duration)
{
  SheetScene s;
  s.name = name;
  s.mesh = gridMesh(1.0, 1.0, cells, cells, GridPattern::alternating);
  s.columns = s.rows = cells;
  s.start = s.mesh.vertices.colwise() - Eigen::Vector3d(0.5, 0.5, -(kSphere + kThickness));
  s.model = buildCloth(name, s.mesh, area_density, isotropicMembrane(stiffness, 0.3, 1.0));
  s.model.bending_modulus = bending_modulus;
  s.model.mass_damping = 4.0;   // only where it comes to rest matters
  s.model.stiffness_damping = 2e-3;
  s.contact.thickness = kThickness;
  s.contact.friction = 0.4;
  s.solids.push_back({Sphere{kSphere}, -1.0, {}});
  s.duration = duration;
  s.keep_from = duration - 0.5 * s.step;
  return s;
}

SurfacePicture::Panel panelOf(const std::string& label, const SheetScene& scene, const Eigen::Matrix3Xd& x)
{
  return {label, {{{x, scene.mesh.triangles}}, {icosphere(0.95 * kSphere, 4), false}}};
}

/// Runs the scene with both models, and once more with a start shaken by a thousandth of a cell: what the model changes beside what chance does.
void compare(StudyContext& context, const SheetScene& scene, double ratio, const std::string& suffix, SurfacePicture& picture, Plot& plot)
{
  const double shake = 1e-3 / scene.columns;
  const SheetRun ibm = runSheet(context, scene, BendingModel::isometric_nonconforming, 0.0);
  const SheetRun hinge = runSheet(context, scene, BendingModel::hinge, 0.0);
  const SheetRun shaken = runSheet(context, scene, BendingModel::isometric_nonconforming, shake);
  const Spectrum of_ibm = wrinkles(scene, ibm.frames);
  const auto compared = [&](const char* model, const std::string& key, const SheetRun& run) {
    const Spectrum spectrum = wrinkles(scene, run.frames);
    const ShapeDifference apart = difference(scene, run.frames.back(), ibm.frames.back());
    context.row().set("scene", scene.name).set("model", model).set("bending_over_membrane", ratio).set("vertices", static_cast<double>(scene.start.cols()))
      .set("rms_difference", apart.rms).set("max_difference", apart.most).set("spectrum_distance", distance(spectrum, of_ibm))
      .set("mean_wavelength_m", spectrum.mean()).set("lowest_m", run.frames.back().row(2).minCoeff()).set("speed_left_mm_s", 1e3 * run.speed)
      .set("ms_per_step", 1e3 * run.seconds_per_step).set("cloth_alone_ms", 1e3 * run.cloth_seconds)
      .set("intersections", static_cast<double>(run.intersections));
    Series& series = plot.at(scene.name + ", " + model);
    series.x = spectrum.wavelength;
    series.y = spectrum.share;
    if (key.empty())
      return;
    context.metric("rms_difference" + key, apart.rms);
    context.metric("max_difference" + key, apart.most);
    context.metric("spectrum_distance" + key, distance(spectrum, of_ibm));
  };
  compared("isometric", "", ibm);
  compared("hinge", suffix, hinge);
  compared("isometric, shaken start", "_of_chance" + suffix, shaken);
  context.metric("hinge_over_isometric_step" + suffix, hinge.seconds_per_step / ibm.seconds_per_step);
  context.metric("hinge_over_isometric_cloth_alone" + suffix, hinge.cloth_seconds / ibm.cloth_seconds);
  picture.panels.push_back(panelOf(scene.name + ", isometric bending", scene, ibm.frames.back()));
  picture.panels.push_back(panelOf(scene.name + ", nonlinear hinges", scene, hinge.frames.back()));
}

const char kNote[] = "differences from the isometric run at the end, over the side; of_chance: what a start shaken by a thousandth of a cell changes; "
                     "spectra: half the sum of differences of the shares (0 the same, 1 nothing in common)";

}  // namespace

void runDrape(StudyContext& context)
{
  useOneBlasThread();
  SurfacePicture& picture = context.picture("drape", "A sheet of 1 m draped over a sphere (thesis figure 2.2)");
  picture.view = {0.35, 1.0, -0.55};
  Plot& plot = context.plot("drape_wrinkles", "Draped sheet: where its curvature lies", "wavelength [m]", "share of the variance of mean curvature");
  const int n = context.quick() ? 40 : 70;
  const double stiffness = 500, modulus = 1e-4;
  compare(context, sheetOverSphere("drape", n, stiffness, 0.2, modulus, context.quick() ? 3.0 : 5.0), modulus / stiffness, "", picture, plot);
  context.note(kNote);
}

void runStiffnessRange(StudyContext& context)
{
  useOneBlasThread();
  SurfacePicture& picture = context.picture("stiffness_range", "Bending over membrane stiffness (per square of the side): 1e-5, 1e-3, 1e-2 (thesis figure 2.3)");
  picture.view = {0.35, 1.0, -0.55};
  Plot& plot = context.plot("stiffness_range_wrinkles", "Draped sheets: where their curvature lies", "wavelength [m]", "share of the variance of mean curvature");
  const int n = context.quick() ? 30 : 60;
  const double stiffness = 200;
  for (const double ratio : {1e-5, 1e-3, 1e-2})
  {
    char name[20];
    std::snprintf(name, sizeof name, "%.0e", ratio);
    compare(context, sheetOverSphere(name, n, stiffness, 1.0, ratio * stiffness, context.quick() ? 3.0 : 5.0), ratio, std::string("_") + name, picture, plot);
  }
  context.note(kNote);
}

}  // namespace slender::study
