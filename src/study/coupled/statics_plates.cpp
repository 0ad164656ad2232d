// Statics of flat plates about their buckling loads.
#include "statics_plates.h"

#include <cmath>
#include <functional>
#include <string>

#include <Eigen/SparseCholesky>

#include "study/cloth/cloth_cases.h"
#include "study/cloth/shell_modes.h"

namespace slender::study {
namespace {

/// over the length: what in-plane deformation changes of the loads is of its square
constexpr double kThickness = 2e-3;

/// A plate of length 1 with D = 1 in the plane z = 0, and how it is loaded.
struct PlateCase
{
  std::string family, label;
  int cells = 0;
  ClothModel model;
  std::vector<int> held;
  double expected = 0.0;                           ///< threshold of plate theory
  std::function<void(ClothSetup&, double)> load;   ///< sets the inputs, and for a plate that is compressed its shape
};

ClothModel plateOf(const std::string& name, const TriangleMesh& mesh, BendingModel bending, double membrane_ratio)
{
  const double stretching = 12 / (kThickness * kThickness);
  ClothModel model = buildCloth(
      name, mesh, 1.0, isotropicMembrane(stretching * (1 - membrane_ratio * membrane_ratio), membrane_ratio, 1.0));
  model.bending = bending;
  model.bending_modulus = 1.0;
  return model;
}

/// Number of negative eigenvalues of the Hessian on the free vertices. Shares no line with the search of the statics.
int negativePlateModes(const ClothSetup& plate)
{
  const ClothModel& model = *plate.model;
  const BlockMatrix hessian = elasticHessian(model, plate.state);
  std::vector<int> number(static_cast<std::size_t>(model.vertices()), 0);
  for (const int v : plate.state.pins)
    number[static_cast<std::size_t>(v)] = -1;
  int count = 0;
  for (int& k : number)
    k = k < 0 ? -1 : count++;
  std::vector<Eigen::Triplet<double>> entries;
  for (int j = 0; j < hessian.points(); ++j)
    for (int k = hessian.starts()[static_cast<std::size_t>(j)]; k < hessian.starts()[static_cast<std::size_t>(j) + 1];
         ++k)
    {
      const int i = hessian.rows()[static_cast<std::size_t>(k)], row = number[static_cast<std::size_t>(i)],
                column = number[static_cast<std::size_t>(j)];
      for (int a = 0; a < 3 && row >= 0 && column >= 0; ++a)
        for (int b = 0; b < 3; ++b)
          if (i != j || a >= b)
            entries.emplace_back(3 * row + a, 3 * column + b, hessian.values()[9 * static_cast<long>(k) + 3 * b + a]);
    }
  Eigen::SparseMatrix<double> lower(3 * count, 3 * count);
  lower.setFromTriplets(entries.begin(), entries.end());
  const Eigen::SimplicialLDLT<Eigen::SparseMatrix<double>, Eigen::Lower> factor(lower);
  return static_cast<int>((factor.vectorD().array() <= 0).count());
}

double outOfPlane(const ClothSetup& plate) { return plate.state.x.row(2).cwiseAbs().maxCoeff(); }

/// The plate in its plane under a load. Throws where statics does not find that.
ClothSetup flatPlate(const PlateCase& c, double load)
{
  ClothSetup plate{ClothModel(c.model)};
  plate.pin(c.held);
  c.load(plate, load);
  ClothStepper stepper(plate.model, ClothOptions{});
  const StepReport report = stepper.solveEquilibrium(plate.state, plate.inputs, false);
  if (!report.ok || outOfPlane(plate) > 1e-9)
    throw std::runtime_error("statics_stability: the flat plate " + c.label + " was not found: " + report.message);
  return plate;
}

/// Load at which the first eigenvalue of the flat mesh changes its sign, to a thousandth.
double meshThreshold(const PlateCase& c)
{
  double low = 0.5 * c.expected, high = 1.5 * c.expected;
  if (negativePlateModes(flatPlate(c, low)) > 0 || negativePlateModes(flatPlate(c, high)) == 0)
    throw std::runtime_error("statics_stability: the threshold of plate " + c.label +
                             " is not near that of plate theory");
  while (high - low > 1e-3 * low)
  {
    const double middle = 0.5 * (low + high);
    (negativePlateModes(flatPlate(c, middle)) > 0 ? high : low) = middle;
  }
  return 0.5 * (low + high);
}

void judgePlate(StudyContext& context, const PlateCase& c, double threshold, double factor, StaticsTally& tally)
{
  ClothSetup plate = flatPlate(c, factor * threshold);
  const int before = negativePlateModes(plate);
  const bool leaves = factor > 1;
  ClothStepper stepper(plate.model, ClothOptions{});
  const StepReport report = stepper.solveEquilibrium(plate.state, plate.inputs);
  const double away = report.ok ? outOfPlane(plate) : 0.0;
  const int after = report.ok ? negativePlateModes(plate) : 0;
  const bool wrong =
      !report.ok || (leaves && (away < kAwayFromBranch || after > 0)) || (!leaves && away > kAwayFromBranch);
  const bool called_stable = report.ok && report.stable && after > 0;
  ++tally.cases;
  tally.wrong += wrong;
  tally.refused += !report.ok;
  tally.called_stable += called_stable;
  tally.unstable_ends += report.ok && !report.stable;
  tally.worst_residual = std::max(tally.worst_residual, report.ok ? report.residual : 0.0);
  Row& row = context.row();
  row.set("family", c.family)
      .set("case", c.label)
      .set("edges", c.cells)
      .set("factor", factor * threshold / c.expected)
      .set("decided_by", "mesh");
  row.set("unstable_modes_of_branch", before)
      .set("unstable_modes_of_end", after)
      .set("distance", away)
      .set("lowest_eigenvalue", report.lowest_eigenvalue);
  row.set("stable", report.stable ? "yes" : "no").set("saddles_left", report.escapes).set("energy", report.energy);
  if (!report.ok)
    row.set("refused", report.message);
  row.check(wrong + called_stable, 0, 0.5,
            leaves ? "must leave its plane for a stable state" : "must stay in its plane");
}

/// Returns a plate of length 1 that stands upright and is clamped along x = 0. Gravity acts along -y. The load is rho g
/// h L^3 / D.
PlateCase lateralPlate(double width, int cells, BendingModel bending)
{
  const double h = 1.0 / cells, row = std::sqrt(0.75);
  // Rows of triangles run across the plate, so that its clamped edge is one of their lines. One row beyond it is held.
  const int rows = static_cast<int>(std::lround(cells / row)),
            columns = std::max(1, static_cast<int>(std::lround(width / h)));
  TriangleMesh mesh = gridMesh(width, 1.0 + 1.0 / rows, columns, rows + 1, GridPattern::equilateral);
  PlateCase c;
  for (Eigen::Index i = 0; i < mesh.vertices.cols(); ++i)
  {
    const Eigen::Vector3d at = mesh.vertices.col(i);
    mesh.vertices.col(i) = Eigen::Vector3d(at.y() - 1.0 / rows, width - at.x(), 0.0);
    if (mesh.vertices(0, i) < 0.5 / rows)
      c.held.push_back(static_cast<int>(i));
  }
  c.family = "lateral_plate";
  c.label = "width " + std::to_string(width).substr(0, 4) + ", " + toString(bending);
  c.cells = cells;
  c.model = plateOf("plate", mesh, bending, 0.3);
  clampFaces(c.model, c.held);
  c.expected = width == 0.25 ? 22.80549522 : 26.29199274;   // lateral_plate_two_poisson.csv, nu = -1/3
  c.load = [](ClothSetup& plate, double load) { plate.inputs.gravity = {0, -load, 0}; };
  return c;
}

/// A square plate, held along its boundary so that it may turn there, whose width is reduced. The load is C times the
/// strain over D.
PlateCase compressedPlate(int cells, BendingModel bending)
{
  constexpr double kRatio = 0.3;
  TriangleMesh mesh = gridMesh(1.0, 1.0, cells, 0, GridPattern::equilateral);
  PlateCase c;
  c.held = verticesWhere(mesh, [](const Eigen::Vector3d& p) {
    return std::min({p.x(), 1 - p.x(), p.y(), 1 - p.y()}) < 1e-9;
  });
  c.family = "compressed_plate";
  c.label = toString(bending);
  c.cells = cells;
  c.model = plateOf("plate", mesh, bending, kRatio);
  // Forces C eps across and nu C eps along: pi^2 D ((m^2 + n^2)^2) / (m^2 + nu n^2), m = n = 1
  c.expected = 4 * M_PI * M_PI / (1 + kRatio);
  c.load = [](ClothSetup& plate, double load) {
    const double strain = load * kThickness * kThickness / 12;
    plate.state.x.row(0) *= std::sqrt(1 - 2 * strain);   // Green's strain counts
    for (std::size_t k = 0; k < plate.state.pins.size(); ++k)
      plate.inputs.pins.col(static_cast<Eigen::Index>(k)) = plate.state.x.col(plate.state.pins[k]);
  };
  return c;
}

}   // namespace

void addPlates(StudyContext& context, StaticsTally& tally)
{
  useOneBlasThread();
  // So many cells make the triangles of these plates equilateral within half a percent. Triangles that are one percent
  // too long change the thresholds by two.
  const std::vector<int> meshes = context.quick() ? std::vector<int>{20} : std::vector<int>{20, 32, 52};
  for (const BendingModel bending : {BendingModel::hinge, BendingModel::isometric_nonconforming})
    for (const int cells : meshes)
      for (const double width : {0.25, 0.5, 0.0})
      {
        if (context.quick() && bending != BendingModel::hinge)
          continue;
        const PlateCase c = width > 0 ? lateralPlate(width, cells, bending) : compressedPlate(cells, bending);
        context.progress(tally.cases, 0, c.family + " " + c.label);
        const double threshold = meshThreshold(c);
        context.row()
            .set("family", c.family)
            .set("case", c.label + ": threshold")
            .set("edges", cells)
            .set("relative_error", threshold / c.expected - 1)
            .check(threshold, c.expected, c.expected * (0.02 + 2.0 / cells),
                   "plate theory; bound of the study plate, 2 % + 2/n");
        for (const double factor : {0.97, 1.03, 1.2})
          judgePlate(context, c, threshold, factor, tally);
      }
}

}   // namespace slender::study
