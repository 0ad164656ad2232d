// A square sheet draped over a sphere (thesis figures 2.2 and 2.3): isometric bending beside nonlinear hinges.
#include "sheet_cases.h"

namespace slender::study {

namespace {

constexpr double kSphere = 0.2;       // [m]
constexpr double kThickness = 4e-3;

/// 1 m x 1 m over a sphere about the origin.
SheetScene sheetOverSphere(const std::string& name, int cells, double stiffness, double area_density, double bending_modulus, double step, double duration)
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
  s.step = step;
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
  const auto compared = [&](const char* model, const char* metric, const SheetRun& run) {
    const Spectrum spectrum = wrinkles(scene, run.frames);
    const ShapeDifference apart = difference(scene, run.frames.back(), ibm.frames.back());
    context.row().set("scene", scene.name).set("model", model).set("bending_over_membrane", ratio)
      .set("vertices", static_cast<double>(scene.start.cols())).set("step_ms", 1e3 * scene.step).set("rms_difference", apart.rms).set("max_difference", apart.most).set("spectrum_distance", distance(spectrum, of_ibm))
      .set("mean_wavelength_m", spectrum.mean()).set("lowest_m", run.frames.back().row(2).minCoeff()).set("rms_speed_left_mm_s", 1e3 * run.speed)
      .set("ms_per_step", 1e3 * run.seconds_per_step).set("cloth_alone_ms", 1e3 * run.cloth_seconds)
      .set("intersections", static_cast<double>(run.intersections));
    Series& series = plot.at(scene.name + ", " + model);
    series.x = spectrum.wavelength;
    series.y = spectrum.share;
    if (!metric)
      return;
    context.metric("rms_difference" + (metric + suffix), apart.rms);
    context.metric("max_difference" + (metric + suffix), apart.most);
    context.metric("spectrum_distance" + (metric + suffix), distance(spectrum, of_ibm));
  };
  compared("isometric", nullptr, ibm);
  compared("hinge", "", hinge);
  compared("isometric, shaken start", "_of_chance", shaken);
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
  constexpr double kStiffness = 500, kModulus = 3e-4;
  const int n = context.quick() ? 40 : 70;
  compare(context, sheetOverSphere("drape", n, kStiffness, 0.2, kModulus, 5e-3, context.quick() ? 3.0 : 5.0), kModulus / kStiffness, "", picture, plot);
  context.note(kNote);
}

void runStiffnessRange(StudyContext& context)
{
  useOneBlasThread();
  SurfacePicture& picture =
    context.picture("stiffness_range", "Bending over membrane stiffness (by the square of the side) 1e-5, 1e-3, 1e-2 (thesis figure 2.3)");
  picture.view = {0.35, 1.0, -0.55};
  Plot& plot = context.plot("stiffness_range_wrinkles", "Draped sheets: where their curvature lies", "wavelength [m]",
                            "share of the variance of mean curvature");
  constexpr double kStiffness = 200, kDensity = 1.0;   // its weight stretches the sheet by 5 % where it hangs by an edge
  struct Range
  {
    const char* name;
    double ratio, step;
  };
  // A stiff sheet's weight rests on few vertices, and contact comes after the sheet's own step: that sinks by g h^2 (vertices over those in
  // contact) into the solid and is pushed out, so stiffer sheets need shorter steps.
  const int n = context.quick() ? 30 : 50;
  for (const Range& r : {Range{"1e-5", 1e-5, 2.5e-3}, Range{"1e-3", 1e-3, 1e-3}, Range{"1e-2", 1e-2, 5e-4}})
    compare(context, sheetOverSphere(r.name, n, kStiffness, kDensity, r.ratio * kStiffness, r.step, context.quick() ? 2.0 : 3.0), r.ratio,
            std::string("_") + r.name, picture, plot);
  context.note(kNote);
}

}  // namespace slender::study
