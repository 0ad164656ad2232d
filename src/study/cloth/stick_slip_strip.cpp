// A vertical cloth strip pressed on a floor with Coulomb friction: the compression at which its foot slips (Sano,
// Yamaguchi & Wada 2017).
#include <cmath>
#include <iterator>
#include <stdexcept>
#include <string>

#include "cloth_cases.h"
#include "slender_sim/world/world.h"
#include "slender_sim/study/study.h"

namespace slender::study {

namespace {

/// stickslip_inverse.csv: first slip as the compression eps (over L) grows, for a coefficient of friction; the floor's
/// force N there.
struct Slip
{
  double mu, compression, normal;
};
constexpr Slip kSlips[] = {{0.05, 0.01238049378, 20.28494139}, {0.1, 0.04687417821, 20.54906118},
                           {0.15, 0.09690456801, 20.93474898}, {0.2, 0.1548673548, 21.38052121},
                           {0.25, 0.2144635647, 21.82808739},  {0.3, 0.2715634261, 22.23208412}};

// of the slip's compression, up to where pins hold the foot: as it buckles, the strip bounces
constexpr double kHeld = 0.85;
// largest speed at which they let go: near its buckling the strip comes to rest slowly
constexpr double kStill = 1e-3;
constexpr double kPatience = 5.0;   // for it, at most
// over the bending modulus, per L^2: the strip shortens by N / 2e4 = 0.1 %, which is taken off
constexpr double kMembrane = 2e4;

struct Result
{
  double compression = 0;   ///< of the foot's first slip, 0: none
  double seconds = 0;       ///< CPU time
  int steps = 0;
};

/// L = D = 1, mass per area 1. `crossed`: share of a cell that a wave crosses in a step. Contact comes after the
/// cloth's own step: only where that moves the foot little against its neighbours are its impulses in the proportion of
/// the forces.
Result press(StudyContext& context, int cells, const Slip& slip, double crossed)
{
  constexpr double kThickness = 4e-4;
  const double h = 1.0 / (cells + 0.5);   // clamped in the middle of the first cells
  const int columns = 4;
  TriangleMesh mesh = gridMesh(columns * h, (cells + 1) * h, columns, cells + 1, GridPattern::alternating);
  Eigen::Matrix3Xd start = mesh.vertices;
  for (Eigen::Index i = 0; i < start.cols(); ++i)
  {
    const double s = std::max(0.0, 1.0 - mesh.vertices(1, i));   // from the clamp
    const double aside = 2e-3 * s * s * (1 - s);                 // towards the first buckling mode
    start.col(i) = Eigen::Vector3d(aside, mesh.vertices(0, i), mesh.vertices(1, i) + 0.5 * kThickness);
  }
  ClothModel model = buildCloth("strip", mesh, 1.0, isotropicMembrane(kMembrane, 0.0, 1.0));
  model.bending_modulus = 1.0;
  model.mass_damping = 10.0;
  model.stiffness_damping = 1e-3;
  ClothOptions options;
  options.one_newton_step = true;
  options.solver = ClothSolver::cholesky;
  const double step = crossed * h / std::sqrt(kMembrane);
  WorldModel model_of_world;
  model_of_world.cloths.push_back({std::make_shared<ClothModel>(model),
                                   options,
                                   ContactProperties{false, false, true, slip.mu, kThickness, ContactMethod::impulses},
                                   {},
                                   {}});
  model_of_world.obstacles.emplace_back();
  model_of_world.time.step = step;
  WorldState state;
  state.cloths.push_back(makeClothState(model, start));
  pinVertices(state.cloths[0], verticesWhere(mesh, [&](const Eigen::Vector3d& p) { return p.y() > 1.0 - 0.7 * h; }));
  state.obstacles.emplace_back();
  state.obstacle_velocities.emplace_back();
  WorldInputs inputs;
  inputs.cloths.resize(1);
  inputs.obstacles.resize(1);
  inputs.cloths[0].gravity.setZero();
  const std::vector<int> upper = state.cloths[0].pins;
  pinVertices(state.cloths[0], verticesWhere(mesh, [](const Eigen::Vector3d& p) { return p.y() < 1e-9; }));
  const std::vector<int>& pins = state.cloths[0].pins;
  Eigen::Matrix3Xd held(3, static_cast<Eigen::Index>(pins.size()));
  for (std::size_t k = 0; k < pins.size(); ++k)
    held.col(static_cast<Eigen::Index>(k)) = start.col(pins[k]);
  World world(model_of_world, state);
  Result result;
  const double begin = threadSeconds();
  double compression = 0, foot = 0, waited = 0, free = 0;
  const auto isHeld = [&] { return state.cloths[0].pins.size() > upper.size(); };
  while (compression < 1.15 * slip.compression)
  {
    if (compression < kHeld * slip.compression)
      compression += 0.4 * step * slip.compression;
    else if (isHeld() && (state.cloths[0].v.colwise().norm().maxCoeff() < kStill || waited > kPatience))
    {
      state.cloths[0].pins = upper;
      held = held.rightCols(static_cast<Eigen::Index>(upper.size())).eval();
    }
    else
      (isHeld() ? waited : free) += step;
    if (free > 0.2)
      compression += 0.1 * step * slip.compression;
    inputs.cloths[0].pins = held;
    inputs.cloths[0].pins.row(2).tail(static_cast<Eigen::Index>(upper.size())).array() -= compression;
    const StepReport report = world.step(state, inputs);
    if (!report.ok)
      throw std::runtime_error("stick_slip_strip, mu = " + std::to_string(slip.mu) + ": " + report.message);
    if (result.steps++ % 200 == 0)
      context.progress(static_cast<int>(100 * compression / slip.compression), 115,
                       "mu = " + std::to_string(slip.mu).substr(0, 4));
    foot = state.cloths[0].x(0, columns / 2);
    if (std::abs(foot) > 2e-3)
    {
      result.compression = compression;
      break;
    }
  }
  result.seconds = threadSeconds() - begin;
  return result;
}

}   // namespace

void runStickSlipStrip(StudyContext& context)
{
  useOneBlasThread();
  struct Case
  {
    int cells;
    double crossed;
  };
  // of longer steps some are shown: from half a cell on, friction may fail to hold a strip that is still nearly
  // straight
  constexpr double kChecked = 0.25;
  constexpr int kQuickCells = 12;   // the cost goes with the square
  const std::vector<Case> cases =
      context.quick() ? std::vector<Case>{{kQuickCells, kChecked}, {kQuickCells, 5.0}}
                      : std::vector<Case>{{20, kChecked}, {40, kChecked}, {20, 0.5}, {20, 1.0}, {20, 2.0}, {20, 5.0}};
  for (const Case& c : cases)
    for (std::size_t k = 0; k < std::size(kSlips); ++k)
    {
      const Slip& slip = kSlips[k];
      const bool checked = c.crossed == kChecked;
      const bool left_out = context.quick() ? k != 1 && k != 5 : c.cells == 40 && k % 2 == 0;
      if (checked ? left_out : slip.mu != (context.quick() ? 0.1 : 0.2))
        continue;
      const Result r = press(context, c.cells, slip, c.crossed);
      const double bent = r.compression - slip.normal / kMembrane;
      // the coefficient that belongs to the measured compression, by the table's local power law
      const Slip &a = kSlips[k > 0 ? k - 1 : 0], &b = kSlips[k > 0 ? k : 1];
      const double power = std::log(b.mu / a.mu) / std::log(b.compression / a.compression);
      const double mu = r.compression > 0 ? slip.mu * std::pow(bent / slip.compression, power) : 0.0;
      Row& row = context.row();
      row.set("cells", c.cells)
          .set("cells_per_step", c.crossed)
          .set("mu", slip.mu)
          .set("compression", r.compression > 0 ? bent : 0.0)
          .set("expected_compression", slip.compression)
          .set("steps", r.steps)
          .set("ms_per_step", 1e3 * r.seconds / r.steps);
      if (r.compression > 0)
        row.set("relative_error", mu / slip.mu - 1);
      if (checked)
        row.check(mu, slip.mu, 0.03 * slip.mu, "stickslip_inverse.csv: mu at the compression of the first slip");
    }
  context.note(
      "cells_per_step: cells that a stretching wave crosses in a step; contact comes after the cloth's own step, and "
      "is in the "
      "proportion of the forces for short steps only. compression 0: no slip up to 1.15 of the expected compression");
}

const StudyRegistration kStickSlipStripRegistration{
    "stick_slip_strip",
    "compression at which the foot of a cloth strip pressed on a floor slips, against the coefficient of friction",
    runStickSlipStrip};

}   // namespace slender::study
