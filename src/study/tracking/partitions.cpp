// A sheet whose guide contracts in its plane: regions of test functions set the scale of its folds (thesis figures 6.5
// and 6.6).
#include <cmath>
#include <random>
#include <stdexcept>

#include "region_cases.h"
#include "study/cloth/sheet_cases.h"
#include "slender_sim/tracking/clustering.h"
#include "slender_sim/tracking/function_blend.h"
#include "guided_cloth.h"

namespace slender::study {

using Eigen::Matrix3Xd;

namespace {

constexpr double kSide = 0.6, kContraction = 0.12, kFoldingDuration = 1.5;

GuidedCloth contracting(int cells, const std::vector<int>& region)
{
  GuidedCloth c;
  c.name = "contracting sheet";
  c.guide = guideSheet(kSide, cells, 0.0);
  c.fine = subdivide(c.guide, 0);
  c.functions = regionBasis(c.guide, region);
  c.model = buildCloth("sheet", c.fine.mesh, 0.2, isotropicMembrane(1e5, 0.3, 1e-3));
  c.model.bending = BendingModel::hinge;
  c.model.bending_modulus = 1e5 * 1e-9 / (12 * (1 - 0.3 * 0.3));
  c.model.stiffness_damping = 2e-3;
  c.model.mass_damping = 2.0;
  c.at = [rest = c.guide.vertices](double t) {
    const double s = std::clamp(t / 0.8, 0.0, 1.0), ease = s * s * s * (10 - 15 * s + 6 * s * s);
    return Matrix3Xd((1.0 - kContraction * ease) * rest);
  };
  return c;
}

/// Square patches of so many cells in the left and in the right half.
std::vector<int> patches(int cells, int left, int right)
{
  const int half = cells / 2, left_columns = half / left, left_patches = left_columns * (cells / left),
            right_columns = half / right;
  std::vector<int> region;
  for (int j = 0; j < cells; ++j)
    for (int i = 0; i < cells; ++i)
    {
      const int r = i < half ? (j / left) * left_columns + i / left
                             : left_patches + (j / right) * right_columns + (i - half) / right;
      region.insert(region.end(), 2, r);   // two faces per cell, in the order of gridMesh
    }
  return region;
}

/// Off the plane, or it could not leave it.
void disturb(Matrix3Xd& x)
{
  std::mt19937 random(3);
  for (Eigen::Index i = 0; i < x.cols(); ++i)
    x(2, i) += 1e-4 * (random() * 0x1p-32 - 0.5);
}

struct Folded
{
  Matrix3Xd x;
  double away = 0, error = 0, ms = 0;   ///< RMS distance from the guide, greatest of an average [m]; per step
};

Folded fold(const GuidedCloth& c)
{
  GuidedStepper run(c, Follow::averages);
  Matrix3Xd& x = run.cloth().state.x;
  disturb(x);
  Folded folded;
  const int steps = static_cast<int>(std::lround(kFoldingDuration / c.step));
  for (int k = 0; k < steps; ++k)
  {
    const StepReport report = run.step();
    if (!report.ok)
      throw std::runtime_error(report.message);
    folded.error = std::max(folded.error, run.error());
  }
  folded.x = x;
  folded.away = rmsDistance(x, c.at(run.time()));
  folded.ms = 1e3 * run.seconds() / steps;
  return folded;
}

/// Mean wavelength [m] of folds in columns of cells from .. from + columns.
double wavelength(const TriangleMesh& mesh, const Matrix3Xd& x, int cells, int from, int columns)
{
  SheetScene part;
  part.columns = columns;
  part.rows = cells;
  part.mesh.vertices.resize(3, (columns + 1) * (cells + 1));
  Matrix3Xd shape(3, part.mesh.vertices.cols());
  for (int j = 0; j <= cells; ++j)
    for (int i = 0; i <= columns; ++i)
    {
      const Eigen::Index all = j * (cells + 1) + from + i, here = j * (columns + 1) + i;
      part.mesh.vertices.col(here) = mesh.vertices.col(all) - mesh.vertices.col(from);
      shape.col(here) = x.col(all);
    }
  return wrinkles(part, {shape}).mean();
}

/// Few regions, and from a certain time on many: in one step and blended.
void changeRegions(StudyContext& context, int cells, const TriangleMesh& sheet)
{
  constexpr double kFrom = 1.5, kEnd = 3.0;
  constexpr int kFew = 16, kMany = 256;
  SurfacePicture& picture =
      context.picture("partitions_changed", "16 regions, and 256 that take over while the sheet moves");
  picture.view = {0.25, 0.8, -0.9};
  picture.columns = 4;
  Plot& away = context.plot("partitions_changed_distance", "256 regions take over from 16 at 1.5 s", "time [s]",
                            "greatest distance of an average of the 256 from the guide's [m]");
  Plot& speed = context.plot("partitions_changed_speed", "256 regions take over from 16 at 1.5 s", "time [s]",
                             "greatest speed of a vertex [m/s]");
  for (Plot* plot : {&away, &speed})
  {
    plot->log_x = plot->log_y = false;
    plot->markers = false;
  }
  std::vector<Clustering> clusters;
  for (const int count : {kFew, kMany})
  {
    ClusteringOptions options;
    options.regions = count;
    options.compactness = 1.0;
    clusters.push_back(clusterFaces(sheet.triangles, {sheet.vertices}, options));
  }
  const WeakConstraints many = contracting(cells, clusters[1].region).constraints();
  double greatest[2] = {0, 0}, error = 0;
  for (const double duration : {0.4, 0.0})
  {
    GuidedCloth c = contracting(cells, clusters[0].region);
    const WeakConstraints few = c.constraints();
    for (const WeakConstraints* constraints : {&few, &many})
      c.model.averages.push_back({std::make_shared<const WeakConstraints::Matrix>(constraints->matrix()), {}});
    ClothSetup cloth(c.model);
    ClothOptions options;
    options.one_newton_step = true;
    ClothStepper stepper(cloth.model, options);
    Matrix3Xd& x = cloth.state.x;
    disturb(x);
    const std::string label = duration > 0 ? "blended within 0.4 s" : "in one step";
    FunctionBlend blend;
    const int change = static_cast<int>(std::lround(kFrom / c.step)),
              steps = static_cast<int>(std::lround(kEnd / c.step));
    for (int k = 0; k < steps; ++k)
    {
      const double t = k * c.step;
      if (k == change)
      {
        if (duration > 0)
          picture.panels.push_back({"16 regions", {{{x, sheet.triangles}}}});
        blend = FunctionBlend::between(many, c.at(t), c.velocity(t), x, cloth.state.v, t, duration);
        cloth.state.average_set = 1;
      }
      const Matrix3Xd guide = c.at(t + c.step);
      cloth.inputs.averages = (k < change ? few : many).averages(guide);
      blend.apply(t + c.step, cloth.inputs.averages);
      const StepReport report = stepper.step(cloth.state, cloth.inputs, c.step);
      if (!report.ok)
        throw std::runtime_error(report.message);
      const double fastest = cloth.state.v.colwise().norm().maxCoeff(), distance = many.error(many.averages(guide), x);
      if (k >= change)
        greatest[duration > 0] = std::max(greatest[duration > 0], fastest);
      if (t + c.step > kFrom + duration + 0.5 * c.step)
        error = std::max(error, distance);
      if (t > kFrom - 0.3)
        for (Plot* plot : {&away, &speed})
        {
          plot->at(label).x.push_back(t + c.step);
          plot->at(label).y.push_back(plot == &away ? distance : fastest);
        }
      if (duration > 0 && k == change + 20)
        picture.panels.push_back({"half of the blend", {{{x, sheet.triangles}}}});
    }
    picture.panels.push_back(
        {duration > 0 ? "256 regions, blended" : "256 regions, in one step", {{{x, sheet.triangles}}}});
  }
  context.metric("change_speed_over_blended", greatest[0] / greatest[1]);
  context.metric("error_after_change_m", error);
}

}   // namespace

void runPartitions(StudyContext& context)
{
  useOneBlasThread();
  const int cells = context.quick() ? 48 : 72, scale = cells / 24;
  SurfacePicture& scales =
      context.picture("partitions", "A contracting sheet tracked by 16, 64, 256 and 1024 regions (thesis figure 6.6)");
  SurfacePicture& spread = context.picture("partitions_spread", "Regions of one size and of two (thesis figure 6.5)");
  for (SurfacePicture* picture : {&scales, &spread})
  {
    picture->view = {0.25, 0.8, -0.9};
    picture->columns = picture == &scales ? 4 : 2;
  }
  Plot& plot = context.plot("partitions_scale", "Regions set the scale of folds",
                            "size of a region (root of its area) [m]", "[m]");
  const TriangleMesh sheet = guideSheet(kSide, cells, 0.0);

  std::vector<SurfacePicture::Panel> below;
  double last_away = std::numeric_limits<double>::infinity(), last_wavelength = last_away, first_wavelength = 0;
  int disorder = 0;
  for (const int count : {16, 64, 256, 1024})
  {
    context.progress(static_cast<int>(scales.panels.size()), 7, std::to_string(count) + " regions");
    ClusteringOptions options;
    options.regions = count;
    options.compactness = 1.0;
    const Clustering clusters = clusterFaces(sheet.triangles, {sheet.vertices}, options);
    const GuidedCloth c = contracting(cells, clusters.region);
    const Folded folded = fold(c);
    const double length = wavelength(sheet, folded.x, cells, 0, cells),
                 size = kSide / std::sqrt(static_cast<double>(count));
    const double out = std::sqrt(folded.x.row(2).squaredNorm() / static_cast<double>(folded.x.cols()));
    context.row()
        .set("regions", static_cast<double>(count))
        .set("spread", "clusters")
        .set("part", "all")
        .set("vertices", static_cast<double>(sheet.vertices.cols()))
        .set("region_size_m", size)
        .set("wavelength_m", length)
        .set("rms_from_guide_m", folded.away)
        .set("rms_out_of_plane_m", out)
        .set("average_error_m", folded.error)
        .set("ms_per_step", folded.ms);
    plot.at("mean wavelength of folds").x.push_back(size);
    plot.at("mean wavelength of folds").y.push_back(length);
    plot.at("RMS distance from the guide").x.push_back(size);
    plot.at("RMS distance from the guide").y.push_back(folded.away);
    disorder += !(length < last_wavelength) + !(folded.away < last_away);
    last_wavelength = length;
    last_away = folded.away;
    first_wavelength = count == 16 ? length : first_wavelength;
    scales.panels.push_back(
        {std::to_string(count) + " regions", {{sheet, true, huesOf(sheet.triangles, clusters.region)}}});
    below.push_back({"", {{{folded.x, sheet.triangles}}}});
  }
  scales.panels.insert(scales.panels.end(), below.begin(), below.end());
  context.metric("out_of_order", disorder);
  context.metric("wavelength_16_over_1024", first_wavelength / last_wavelength);

  below.clear();
  for (const bool even : {true, false})
  {
    context.progress(even ? 4 : 5, 7, even ? "homogeneous" : "heterogeneous");
    const int left = even ? 3 * scale : 6 * scale, right = even ? 3 * scale : 3 * scale / 2;
    const std::vector<int> region = patches(cells, left, right);
    const Folded folded = fold(contracting(cells, region));
    const char* name = even ? "homogeneous" : "heterogeneous";
    double lengths[2];
    for (const int half : {0, 1})
    {
      lengths[half] = wavelength(sheet, folded.x, cells, half * cells / 2, cells / 2);
      context.row()
          .set("regions", static_cast<double>(1 + *std::max_element(region.begin(), region.end())))
          .set("spread", name)
          .set("part", half ? "right half" : "left half")
          .set("vertices", static_cast<double>(sheet.vertices.cols()))
          .set("region_size_m", (half ? right : left) * kSide / cells)
          .set("wavelength_m", lengths[half])
          .set("rms_from_guide_m", folded.away)
          .set("average_error_m", folded.error)
          .set("ms_per_step", folded.ms);
    }
    context.metric(std::string("left_over_right_") + name, lengths[0] / lengths[1]);
    spread.panels.push_back({name, {{sheet, true, huesOf(sheet.triangles, region)}}});
    below.push_back({"", {{{folded.x, sheet.triangles}}}});
  }
  spread.panels.insert(spread.panels.end(), below.begin(), below.end());
  context.progress(6, 7, "regions that change");
  changeRegions(context, cells, sheet);
  context.note(
      "the guide contracts by 12 % in both directions of its plane; wavelength: geometric mean over the spectrum of "
      "mean curvature; "
      "out_of_order: how often more regions did not mean finer folds and closer tracking; "
      "change_speed_over_blended: greatest speed of a vertex after 256 regions take over from 16 in one step, over "
      "that with a blend of 0.4 s");
}

const StudyRegistration kPartitionsRegistration{
    "partitions", "16 to 1024 regions, of one size and of two, set the scale of folds (thesis figures 6.5, 6.6)",
    runPartitions};

}   // namespace slender::study
