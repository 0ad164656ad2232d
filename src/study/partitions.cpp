// A sheet whose guide contracts in its plane: regions of test functions set the scale of its folds (thesis figures 6.5 and 6.6).
#include <cmath>
#include <random>
#include <stdexcept>

#include "region_cases.h"
#include "sheet_cases.h"
#include "slender_sim/tracking/clustering.h"
#include "guided_cloth.h"

namespace slender::study {

using Eigen::Matrix3Xd;

namespace {

constexpr double kSide = 0.6, kContraction = 0.12, kDuration = 1.5;

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
  const int half = cells / 2, left_columns = half / left, left_patches = left_columns * (cells / left), right_columns = half / right;
  std::vector<int> region;
  for (int j = 0; j < cells; ++j)
    for (int i = 0; i < cells; ++i)
    {
      const int r = i < half ? (j / left) * left_columns + i / left : left_patches + (j / right) * right_columns + (i - half) / right;
      region.insert(region.end(), 2, r);   // two faces per cell, in the order of gridMesh
    }
  return region;
}

struct Folded
{
  Matrix3Xd x;
  double away = 0, error = 0, ms = 0;   ///< RMS distance from the guide, greatest of an average [m]; per step
};

Folded fold(const GuidedCloth& c)
{
  GuidedStepper run(c, Follow::averages);
  std::mt19937 random(3);
  Matrix3Xd& x = run.cloth().state.x;
  for (Eigen::Index i = 0; i < x.cols(); ++i)   // off the plane, or it could not leave it
    x(2, i) += 1e-4 * (random() * 0x1p-32 - 0.5);
  Folded folded;
  const int steps = static_cast<int>(std::lround(kDuration / c.step));
  for (int k = 0; k < steps; ++k)
  {
    const StepReport report = run.step();
    if (!report.ok)
      throw std::runtime_error(report.message);
    folded.error = std::max(folded.error, run.error());
  }
  folded.x = x;
  folded.away = std::sqrt((x - c.at(run.time())).squaredNorm() / static_cast<double>(x.cols()));
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

}  // namespace

void runPartitions(StudyContext& context)
{
  useOneBlasThread();
  const int cells = context.quick() ? 48 : 72, scale = cells / 24;
  SurfacePicture& scales = context.picture("partitions", "A contracting sheet tracked by 16, 64, 256 and 1024 regions (thesis figure 6.6)");
  SurfacePicture& spread = context.picture("partitions_spread", "Regions of one size and of two (thesis figure 6.5)");
  for (SurfacePicture* picture : {&scales, &spread})
  {
    picture->view = {0.25, 0.8, -0.9};
    picture->columns = picture == &scales ? 4 : 2;
  }
  Plot& plot = context.plot("partitions_scale", "Regions set the scale of folds", "size of a region (root of its area) [m]", "[m]");
  const TriangleMesh sheet = guideSheet(kSide, cells, 0.0);

  std::vector<SurfacePicture::Panel> below;
  double last_away = std::numeric_limits<double>::infinity(), last_wavelength = last_away, first_wavelength = 0;
  int disorder = 0;
  for (const int count : {16, 64, 256, 1024})
  {
    context.progress(disorder, 6, std::to_string(count) + " regions");
    ClusteringOptions options;
    options.regions = count;
    options.compactness = 1.0;
    const Clustering clusters = clusterFaces(sheet.triangles, {sheet.vertices}, options);
    const GuidedCloth c = contracting(cells, clusters.region);
    const Folded folded = fold(c);
    const double length = wavelength(sheet, folded.x, cells, 0, cells), size = kSide / std::sqrt(static_cast<double>(count));
    const double out = std::sqrt(folded.x.row(2).squaredNorm() / static_cast<double>(folded.x.cols()));
    context.row().set("regions", static_cast<double>(count)).set("spread", "clusters").set("part", "all").set("vertices", static_cast<double>(sheet.vertices.cols()))
      .set("region_size_m", size).set("wavelength_m", length).set("rms_from_guide_m", folded.away).set("rms_out_of_plane_m", out)
      .set("average_error_m", folded.error).set("ms_per_step", folded.ms);
    plot.at("mean wavelength of folds").x.push_back(size);
    plot.at("mean wavelength of folds").y.push_back(length);
    plot.at("RMS distance from the guide").x.push_back(size);
    plot.at("RMS distance from the guide").y.push_back(folded.away);
    disorder += !(length < last_wavelength) + !(folded.away < last_away);
    last_wavelength = length;
    last_away = folded.away;
    first_wavelength = count == 16 ? length : first_wavelength;
    scales.panels.push_back({std::to_string(count) + " regions", {{sheet, true, huesOf(sheet.triangles, clusters.region)}}});
    below.push_back({"", {{{folded.x, sheet.triangles}}}});
  }
  scales.panels.insert(scales.panels.end(), below.begin(), below.end());
  context.metric("out_of_order", disorder);
  context.metric("wavelength_16_over_1024", first_wavelength / last_wavelength);

  below.clear();
  for (const bool even : {true, false})
  {
    context.progress(even ? 4 : 5, 6, even ? "homogeneous" : "heterogeneous");
    const int left = even ? 3 * scale : 6 * scale, right = even ? 3 * scale : 3 * scale / 2;
    const std::vector<int> region = patches(cells, left, right);
    const Folded folded = fold(contracting(cells, region));
    const char* name = even ? "homogeneous" : "heterogeneous";
    double lengths[2];
    for (const int half : {0, 1})
    {
      lengths[half] = wavelength(sheet, folded.x, cells, half * cells / 2, cells / 2);
      context.row().set("regions", static_cast<double>(1 + *std::max_element(region.begin(), region.end()))).set("spread", name)
        .set("part", half ? "right half" : "left half").set("vertices", static_cast<double>(sheet.vertices.cols()))
        .set("region_size_m", (half ? right : left) * kSide / cells).set("wavelength_m", lengths[half]).set("rms_from_guide_m", folded.away)
        .set("average_error_m", folded.error).set("ms_per_step", folded.ms);
    }
    context.metric(std::string("left_over_right_") + name, lengths[0] / lengths[1]);
    spread.panels.push_back({name, {{sheet, true, huesOf(sheet.triangles, region)}}});
    below.push_back({"", {{{folded.x, sheet.triangles}}}});
  }
  spread.panels.insert(spread.panels.end(), below.begin(), below.end());
  context.note("the guide contracts by 12 % in both directions of its plane; wavelength: geometric mean over the spectrum of mean curvature; "
               "out_of_order: how often more regions did not mean finer folds and closer tracking");
}

}  // namespace slender::study
