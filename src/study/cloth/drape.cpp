// A square sheet draped over a sphere (thesis figures 2.2 and 2.3): isometric bending beside nonlinear hinges.
#include "sheet_cases.h"

namespace slender::study {

namespace {

constexpr double kSphereRadius = 0.2;   // [m]
constexpr double kThickness = 4e-3;

/// 1 m x 1 m over a sphere about the origin.
SheetScene sheetOverSphere(const std::string& name, int cells, double stiffness, double area_density,
                           double bending_modulus, double step, double duration)
{
  SheetScene s;
  s.name = name;
  s.mesh = gridMesh(1.0, 1.0, cells, cells, GridPattern::alternating);
  s.columns = s.rows = cells;
  s.start = s.mesh.vertices.colwise() - Eigen::Vector3d(0.5, 0.5, -(kSphereRadius + kThickness));
  s.model = buildCloth(name, s.mesh, area_density, isotropicMembrane(stiffness, 0.3, 1.0));
  s.model.bending_modulus = bending_modulus;
  s.model.mass_damping = 4.0;   // only where it comes to rest matters
  s.model.stiffness_damping = 2e-3;
  s.contact.thickness = kThickness;
  s.contact.friction = 0.4;
  s.solids.push_back({Sphere{kSphereRadius}, -1.0, {}});
  s.step = step;
  s.duration = duration;
  s.keep_from = duration - 0.5 * s.step;
  return s;
}

SurfacePicture::Panel panelOf(const std::string& label, const SheetScene& scene, const Eigen::Matrix3Xd& x)
{
  return {label, {{{x, scene.mesh.triangles}}, {icosphere(0.95 * kSphereRadius, 4), false}}};
}

struct Runs
{
  std::vector<SheetRun> of_start;
  std::vector<Eigen::Matrix3Xd> ends;
  Spectrum spectrum;            ///< of all ends
  double step = 0, alone = 0;   ///< mean CPU times per step [s]
};

/// Runs the scene with both models from several starts, which differ by thousandths of a cell: what the model changes
/// beside what chance does.
void compare(StudyContext& context, const SheetScene& scene, double ratio, int starts, const std::string& suffix,
             SurfacePicture& picture, Plot& plot)
{
  Runs models[2];
  for (int model = 0; model < 2; ++model)
  {
    Runs& runs = models[model];
    for (int k = 0; k < starts; ++k)
    {
      runs.of_start.push_back(runSheet(context, scene,
                                       model ? BendingModel::hinge : BendingModel::isometric_nonconforming,
                                       k * 1e-3 / scene.columns));
      const SheetRun& run = runs.of_start.back();
      runs.ends.push_back(run.frames.back());
      runs.step += run.seconds_per_step / starts;
      runs.alone += run.cloth_seconds / starts;
      const ShapeDifference apart = difference(scene, runs.ends.back(), models[0].ends.front());
      const Spectrum spectrum = wrinkles(scene, {runs.ends.back()});
      context.row()
          .set("scene", scene.name)
          .set("model", model ? "hinge" : "isometric")
          .set("start_shaken", k)
          .set("bending_over_membrane", ratio)
          .set("vertices", static_cast<double>(scene.start.cols()))
          .set("step_ms", 1e3 * scene.step)
          .set("rms_difference", apart.rms)
          .set("max_difference", apart.most)
          .set("mean_wavelength_m", spectrum.mean())
          .set("lowest_m", runs.ends.back().row(2).minCoeff())
          .set("rms_speed_left_mm_s", 1e3 * run.speed)
          .set("ms_per_step", 1e3 * run.seconds_per_step)
          .set("cloth_alone_ms", 1e3 * run.cloth_seconds)
          .set("intersections", static_cast<double>(run.intersections));
    }
    runs.spectrum = wrinkles(scene, runs.ends);
    Series& series = plot.at(scene.name + (model ? ", hinge" : ", isometric"));
    series.x = runs.spectrum.wavelength;
    series.y = runs.spectrum.share;
    picture.panels.push_back(
        panelOf(scene.name + (model ? ", nonlinear hinges" : ", isometric bending"), scene, runs.ends.front()));
  }
  const Runs &ibm = models[0], &hinge = models[1];
  const ShapeDifference apart = difference(scene, hinge.ends.front(), ibm.ends.front());
  double chance = 0, spectrum_chance = 0;
  for (int k = 1; k < starts; ++k)
  {
    chance += difference(scene, ibm.ends[k], ibm.ends.front()).rms / (starts - 1);
    spectrum_chance += distance(wrinkles(scene, {ibm.ends[k]}), wrinkles(scene, {ibm.ends.front()})) / (starts - 1);
  }
  context.metric("rms_difference" + suffix, apart.rms);
  context.metric("max_difference" + suffix, apart.most);
  context.metric("rms_difference_of_chance" + suffix, chance);
  context.metric("spectrum_distance" + suffix, distance(hinge.spectrum, ibm.spectrum));
  context.metric("spectrum_distance_of_chance" + suffix, spectrum_chance);
  context.metric("hinge_over_isometric_step" + suffix, hinge.step / ibm.step);
  context.metric("hinge_over_isometric_cloth_alone" + suffix, hinge.alone / ibm.alone);
}

const char kNote[] =
    "differences over the side, of the ends from unshaken starts; of_chance: what shaking the start by thousandths of "
    "a cell changes "
    "with isometric bending; spectra of all ends: half the sum of differences of the shares (0 the same, 1 nothing in "
    "common)";

}   // namespace

void runDrape(StudyContext& context)
{
  useOneBlasThread();
  SurfacePicture& picture = context.picture("drape", "A sheet of 1 m draped over a sphere (thesis figure 2.2)");
  picture.view = {0.35, 1.0, -0.55};
  Plot& plot = context.plot("drape_wrinkles", "Draped sheet: where its curvature lies", "wavelength [m]",
                            "share of the variance of mean curvature");
  constexpr double kStiffness = 500, kModulus = 3e-4;
  const int n = context.quick() ? 40 : 70;
  SheetScene scene = sheetOverSphere("drape", n, kStiffness, 0.2, kModulus, 5e-3, context.quick() ? 3.0 : 5.0);
  // off the middle: else chance alone decides which way it folds
  scene.start.colwise() += Eigen::Vector3d(0.06, 0.025, 0);
  compare(context, scene, kModulus / kStiffness, context.quick() ? 2 : 3, "", picture, plot);
  context.note(kNote);
}

void runStiffnessRange(StudyContext& context)
{
  useOneBlasThread();
  SurfacePicture& picture = context.picture(
      "stiffness_range",
      "Bending over membrane stiffness (by the square of the side) 1e-5, 1e-3, 1e-2 (thesis figure 2.3)");
  picture.view = {0.35, 1.0, -0.55};
  Plot& plot = context.plot("stiffness_range_wrinkles", "Draped sheets: where their curvature lies", "wavelength [m]",
                            "share of the variance of mean curvature");
  // its weight stretches the sheet by 5 % where it hangs by an edge
  constexpr double kStiffness = 200, kDensity = 1.0;
  struct Range
  {
    const char* name;
    double ratio, step;
  };
  // A stiff sheet's weight rests on few vertices, and contact comes after the sheet's own step: that sinks by g h^2
  // (vertices over those in contact) into the solid and is pushed out, so stiffer sheets need shorter steps.
  const int n = context.quick() ? 20 : 50;
  for (const Range& r : {Range{"1e-5", 1e-5, 2.5e-3}, Range{"1e-3", 1e-3, 1e-3}, Range{"1e-2", 1e-2, 5e-4}})
  {
    const SheetScene scene =
        sheetOverSphere(r.name, n, kStiffness, kDensity, r.ratio * kStiffness, r.step, context.quick() ? 1.0 : 3.0);
    compare(context, scene, r.ratio, 2, std::string("_") + r.name, picture, plot);
  }
  context.note(kNote);
}

const StudyRegistration kDrapeRegistration{
    "drape", "a sheet draped over a sphere, as thesis figure 2.2: isometric bending beside hinges, shapes and wrinkles",
    runDrape};

const StudyRegistration kStiffnessRangeRegistration{
    "stiffness_range",
    "draped sheets of bending over membrane stiffness 1e-5, 1e-3, 1e-2, as thesis figure 2.3: isometric bending "
    "beside hinges",
    runStiffnessRange};

}   // namespace slender::study
