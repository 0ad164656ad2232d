// Plates whose bending has its own Poisson's ratio, against plate theory, and what the ratio costs.
#include <algorithm>
#include <array>
#include <cmath>
#include <stdexcept>

#include "plate_linear.h"
#include "slender_sim/energy/isometric_bending.h"
#include "slender_sim/energy/plate_bending.h"
#include "slender_sim/study/study.h"

namespace slender::study {

namespace {

constexpr double kRatios[] = {-0.3, 0.0, 0.2, 0.35, 0.5};
/// Every two triangles of these meshes form a parallelogram, for which the model is exact.
constexpr GridPattern kLattices[] = {GridPattern::equilateral, GridPattern::one_diagonal};

PlateModel modelWith(double nu)
{
  return [nu](const TriangleMesh& mesh) { return plateBending(mesh, meshTopology(mesh), nu, 1.0).toEigen(); };
}

/// rho g h L^3 / D at which a plate 1 x width held along a vertical side buckles sideways. The thresholds of
/// lateral_plate.csv (nu = -1/3: lateral_plate_two_poisson.csv) over the thin-strip limit 12.8538 sqrt(2 (1 - nu)^2 (1
/// + nu)), which are smooth in nu, are joined by the polynomial through all six. Leaving out the point at 0.3 changes
/// none of the values used here by more than 1e-3 of itself.
double lateralThreshold(double width, double nu)
{
  constexpr std::array<double, 6> at = {-1.0 / 3, 0.0, 0.2, 0.3, 0.4, 0.5};
  constexpr std::array<double, 6> quarter = {22.80549522, 21.32425736, 19.14900922,
                                             17.71344449, 16.04321839, 14.1317593};
  constexpr std::array<double, 6> half = {26.29199274, 24.96336677, 22.96446579, 21.59557142, 19.95238298, 18.00314331};
  const auto limit = [](double ratio) { return 12.8538 * std::sqrt(2 * (1 - ratio) * (1 - ratio) * (1 + ratio)); };
  double sum = 0;
  for (std::size_t i = 0; i < at.size(); ++i)
  {
    double term = (width == 0.25 ? quarter[i] : half[i]) / limit(at[i]);
    for (std::size_t j = 0; j < at.size(); ++j)
      if (j != i)
        term *= (nu - at[j]) / (at[i] - at[j]);
    sum += term;
  }
  return sum * limit(nu);
}

/// Square plates. The bounds are those of the study plate: 2 % of the value extrapolated to fine meshes, and an error
/// that halves with the cells.
void uniformLoadByRatio(StudyContext& context)
{
  const std::vector<int> sizes = context.quick() ? std::vector<int>{26, 52} : std::vector<int>{26, 52, 104};
  for (const bool clamped : {true, false})
    for (const GridPattern pattern : kLattices)
      for (const double nu : kRatios)
      {
        const double expected = clamped ? 0.001265319088 : 0.004062352661;
        const std::string how = clamped ? "clamped" : "simply supported";
        double coarse = 0, fine = 0;
        for (const int n : sizes)
        {
          context.progress(n, sizes.back(), how + " " + toString(pattern));
          coarse = fine;
          fine = squarePlateDeflection(pattern, modelWith(nu), n, clamped);
          context.row()
              .set("case", how)
              .set("mesh", toString(pattern))
              .set("nu", nu)
              .set("cells", n)
              .set("value", fine)
              .set("relative_error", fine / expected - 1);
        }
        const double extrapolated = 2 * fine - coarse;
        context.row()
            .set("case", how + ", extrapolated")
            .set("mesh", toString(pattern))
            .set("nu", nu)
            .set("cells", sizes.back())
            .set("relative_error", extrapolated / expected - 1)
            .check(extrapolated, expected, 0.02 * expected, "Kirchhoff plate, centre D w/(q a^4); the same for all nu");
        if (std::abs(fine / expected - 1) > 0.01)
        {
          const double ratio = (fine - expected) / (coarse - expected);
          context.row()
              .set("case", how + ", error over the coarser one's")
              .set("mesh", toString(pattern))
              .set("nu", nu)
              .set("cells", sizes.back())
              .check(std::max(ratio, 0.5), 0.5, 0.1, "halves, or better");
        }
      }
}

/// The bound is that of the study plate.
void lateralBucklingByRatio(StudyContext& context)
{
  const std::vector<int> sizes = context.quick() ? std::vector<int>{28} : std::vector<int>{28, 56, 112};
  for (const double width : {0.25, 0.5})
    for (const GridPattern pattern : kLattices)
      for (const double nu : kRatios)
        for (const int n : sizes)
        {
          context.progress(n, sizes.back(), std::string("lateral buckling ") + toString(pattern));
          const double load = lateralBucklingLoad(pattern, modelWith(nu), width, n),
                       expected = lateralThreshold(width, nu);
          context.row()
              .set("case", "lateral buckling")
              .set("mesh", toString(pattern))
              .set("nu", nu)
              .set("width", width)
              .set("cells", n)
              .set("relative_error", load / expected - 1)
              .check(load, expected, expected * (0.02 + 2.0 / n),
                     "lateral_plate.csv joined by a polynomial in nu; bound 2 % + 2/n");
        }
}

/// Measures how much too stiff the model is on irregular and alternating meshes. Scenes warn of such meshes.
void otherMeshes(StudyContext& context)
{
  for (const GridPattern pattern : {GridPattern::irregular, GridPattern::alternating})
    for (const double nu : {0.0, 0.35})
    {
      const TriangleMesh mesh = gridMesh(1, 1, 26, 0, pattern);
      const double deflection = squarePlateDeflection(pattern, modelWith(nu), 52, false);
      context.row()
          .set("case", "simply supported")
          .set("mesh", toString(pattern))
          .set("nu", nu)
          .set("cells", 52)
          .set("value", deflection)
          .set("relative_error", deflection / 0.004062352661 - 1)
          .set("stiffening", plateStiffening(mesh, meshTopology(mesh), nu))
          .set("reason", "not made of parallelograms: too stiff, scenes warn");
    }
}

/// Product of the matrix, and implicit steps of a sheet that falls while two of its corners are held, with a ratio over
/// without.
void cost(StudyContext& context)
{
  const int cells = context.quick() ? 30 : 100;
  const TriangleMesh mesh = gridMesh(1, 1, cells, 0, GridPattern::equilateral);
  const double budget = context.quick() ? 0.05 : 1.0;
  double product[2], step[2], entries[2];
  for (const int own : {0, 1})
  {
    ClothModel model = buildCloth("sheet", mesh, 0.2, isotropicMembrane(1e5, 0.3, 1e-3));
    model.bending_modulus = 1e-4;
    if (own == 1)
      model.bending_poissons_ratio = 0.3;
    const PointMatrix matrix = own == 1 ? plateBending(mesh, model.topology, 0.3, 1e-4)
                                        : isometricBending(mesh, model.topology, IsometricElement::nonconforming, 1e-4);
    PointVector x, y(4 * mesh.vertices.cols());
    toPoints(mesh.vertices, x);
    entries[own] = static_cast<double>(matrix.values().size()) / matrix.size();
    product[own] = leastSeconds(budget, [&] {
      for (int k = 0; k < 50; ++k)
        matrix.multiply(x.data(), y.data());
    });
    ClothSetup sheet(std::move(model));
    sheet.pin({0, cells});
    sheet.inputs.gravity = Eigen::Vector3d(0, 0, -9.81);
    ClothOptions options;
    options.one_newton_step = true;
    ClothStepper stepper(sheet.model, options);
    const ClothState start = sheet.state;
    step[own] = leastSeconds(budget, [&] {
      sheet.state = start;
      for (int k = 0; k < 5; ++k)
        if (!stepper.step(sheet.state, sheet.inputs, 0.005).ok)
          throw std::runtime_error("plate_poisson: a step of the sheet was refused");
    });
  }
  context.metric("entries_per_row_isometric", entries[0]);
  context.metric("entries_per_row_with_ratio", entries[1]);
  context.metric("product_over_isometric", product[1] / product[0]);
  context.metric("step_over_isometric", step[1] / step[0]);
}

}   // namespace

void runPlatePoisson(StudyContext& context)
{
  useOneBlasThread();
  uniformLoadByRatio(context);
  lateralBucklingByRatio(context);
  otherMeshes(context);
  cost(context);
  context.note(
      "product_over_isometric, step_over_isometric: CPU time with bending: {poissons_ratio} over without, of the "
      "matrix times a vector and of "
      "an implicit step.");
}

const StudyRegistration kPlatePoissonRegistration{
    "plate_poisson", "clamped, supported and laterally loaded plates with Poisson's ratios of bending from -0.3 to 0.5",
    runPlatePoisson};

}   // namespace slender::study
