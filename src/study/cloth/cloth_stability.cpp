// Cloth under whatever may be asked of it: done, or refused with a reason and the state untouched, never NaN.
#include <cmath>
#include <cstdio>
#include <functional>
#include <random>

#include <Eigen/Geometry>

#include "cloth_cases.h"
#include "study/framework/stability.h"
#include "slender_sim/scene/state_bytes.h"
#include "slender_sim/study/study.h"

namespace slender::study {

namespace {

bool isFinite(const ClothState& s) { return s.x.allFinite() && s.v.allFinite() && s.rest_angles.allFinite(); }

/// Runs up to `steps` steps of h; `motion` sets the inputs for the end of each. `keeps_energy`: beyond what there is to
/// give (deformation, and the fall through the sheet's size) none may appear; not asked of what is moved or of explicit
/// steps, which are bounded by refusal.
StabilityCell runCloth(ClothSetup& cloth, const ClothOptions& options, double h, int steps,
                       const std::function<void(int, ClothInputs&)>& motion, bool keeps_energy = true)
{
  StabilityCell cell;
  cell.linear_steps = options.one_newton_step || options.integrator == Integrator::symplectic_euler;
  ClothStepper stepper(cloth.model, options);
  const Eigen::Vector3d& gravity = cloth.inputs.gravity;
  const ClothEnergies start = stepper.energies(cloth.state, gravity);
  const Eigen::Matrix3Xd& rest = cloth.model->rest.vertices;
  const double size = (rest.rowwise().maxCoeff() - rest.rowwise().minCoeff()).norm();
  const double scale =
      start.membrane + start.bending + start.kinetic + cloth.model->totalMass() * gravity.norm() * size;
  const double begin = threadSeconds();
  for (int k = 0; k < steps; ++k)
  {
    if (motion)
      motion(k, cloth.inputs);
    const ClothState before = cloth.state;
    const StepReport report = stepper.step(cloth.state, cloth.inputs, h);
    const bool finite =
        isFinite(cloth.state) && (!report.ok || (stepper.pinForces().allFinite() && std::isfinite(report.max_strain)));
    if (!cell.took(report, finite, stateBytes(before) == stateBytes(cloth.state)))
      break;
    if (!motion && keeps_energy &&
        !cell.energyIs((stepper.energies(cloth.state, gravity).total() - start.total()) / scale, 1e-2))
      break;
  }
  cell.cpu_seconds = threadSeconds() - begin;
  return cell;
}

ClothSetup sheet(const TriangleMesh& mesh, BendingModel bending, double stiffness, double modulus)
{
  ClothModel model = buildCloth("sheet", mesh, 0.15, isotropicMembrane(stiffness * 1e3, 0.3, 1e-3));
  model.bending = bending;
  model.bending_modulus = modulus;
  model.mass_damping = 0.5;
  ClothSetup cloth(std::move(model));
  cloth.inputs.gravity = Eigen::Vector3d(0, 0, -9.81);
  return cloth;
}

/// Some faces crushed to slivers, 1e-4 of their size, as rest shape.
TriangleMesh needleMesh()
{
  TriangleMesh mesh = gridMesh(0.5, 0.5, 10, 10, GridPattern::alternating);
  std::mt19937 random(5);
  for (int k = 0; k < 12; ++k)
  {
    const auto face = mesh.triangles.col(static_cast<Eigen::Index>(random() % mesh.triangles.cols()));
    const Eigen::Vector3d a = mesh.vertices.col(face[0]), b = mesh.vertices.col(face[1]),
                          c = mesh.vertices.col(face[2]);
    const Eigen::Vector3d foot = a + (b - a) * (c - a).dot(b - a) / (b - a).squaredNorm();
    mesh.vertices.col(face[2]) = foot + 1e-4 * (c - foot);
  }
  for (Eigen::Index f = 0; f < mesh.triangles.cols(); ++f)   // neighbours may have turned over
  {
    const auto face = mesh.triangles.col(f);
    const Eigen::Vector3d a = mesh.vertices.col(face[0]);
    if ((mesh.vertices.col(face[1]) - a).cross(mesh.vertices.col(face[2]) - a).norm() < 1e-9)
      mesh.vertices.col(face[2]) += Eigen::Vector3d(0, 0, 1e-3);
  }
  return mesh;
}

}   // namespace

void runClothStability(StudyContext& context)
{
  useOneBlasThread();
  StabilityTally tally(context);
  int cases = 0, not_recovered = 0;
  const auto report = [&](const std::string& what, const ClothSetup& cloth, double h, const StabilityCell& cell,
                          bool expects_recovery) {
    Row& row = context.row();
    row.set("case", what).set("model", toString(cloth.model->bending)).set("step_s", h);
    tally.record(row, cell);
    row.set("end_strain", cell.end_strain);
    // of a sheet that has come to hang again
    not_recovered += expects_recovery && !cell.refused && !(cell.end_strain < 0.5);
    context.progress(++cases, context.quick() ? 64 : 204, what);
  };
  ClothOptions common;
  if (context.quick())
    common.newton.max_cuts = 4;   // refusals come sooner
  const int cells = context.quick() ? 8 : 12, side = cells + 1;
  const TriangleMesh grid = gridMesh(0.5, 0.5, cells, cells, GridPattern::alternating);
  const auto hung = [&](ClothSetup& cloth) { cloth.pin({0, side - 1}); };
  std::vector<BendingModel> models{BendingModel::hinge, BendingModel::isometric_nonconforming};
  if (!context.quick())
    models.push_back(BendingModel::isometric_conforming);

  // Stiffness over ten decades, steps up to 1/10 s
  const std::vector<double> steps =
      context.quick() ? std::vector<double>{0.01, 0.1} : std::vector<double>{0.001, 0.01, 1.0 / 30, 0.1};
  for (const BendingModel bending : models)
    for (const bool newton : {true, false})
      for (int decade = -2; decade <= 8; decade += context.quick() ? 5 : 2)
        for (const double h : steps)
        {
          ClothSetup cloth = sheet(grid, bending, std::pow(10.0, decade), 1e-4);
          hung(cloth);
          ClothOptions options = common;
          options.one_newton_step = !newton;
          char what[80];
          std::snprintf(what, sizeof what, "membrane 1e%d N/m, %s", decade, newton ? "Newton" : "one step");
          report(what, cloth, h, runCloth(cloth, options, h, context.quick() ? 5 : 20, nullptr), false);
        }
  for (const BendingModel bending : models)
    for (int decade = -8; decade <= 2; decade += 5)
    {
      ClothSetup cloth = sheet(grid, bending, 1e3, std::pow(10.0, decade));
      hung(cloth);
      char what[80];
      std::snprintf(what, sizeof what, "bending 1e%d N m", decade);
      report(what, cloth, 0.1, runCloth(cloth, common, 0.1, 20, nullptr), false);
    }

  const int settling = context.quick() ? 20 : 60;
  std::mt19937 random(17);
  std::uniform_real_distribution<double> uniform(-1, 1);
  for (const BendingModel bending : models)
    for (const double h : {0.01, 0.1})
    {
      {   // every vertex anywhere in the sheet's bounding cube
        ClothSetup cloth = sheet(grid, bending, 1e3, 1e-4);
        hung(cloth);
        for (Eigen::Index i = 0; i < cloth.state.x.cols(); ++i)
          if (std::find(cloth.state.pins.begin(), cloth.state.pins.end(), static_cast<int>(i)) ==
              cloth.state.pins.end())
            cloth.state.x.col(i) = 0.25 * Eigen::Vector3d(1 + uniform(random), 1 + uniform(random), uniform(random));
        report("random positions", cloth, h, runCloth(cloth, common, h, settling, nullptr), true);
      }
      {   // mirrored: all faces turned over inside their plane
        ClothSetup cloth = sheet(grid, bending, 1e3, 1e-4);
        cloth.pin({0});
        cloth.state.x.row(0) *= -1.0;
        report("mirrored", cloth, h, runCloth(cloth, common, h, settling, nullptr), true);
      }
      {   // single vertices across the opposite edge: inverted triangles
        ClothSetup cloth = sheet(grid, bending, 1e3, 1e-4);
        hung(cloth);
        for (int i = side + 4; i < side * cells; i += side)
          cloth.state.x.col(i) += Eigen::Vector3d(0.1, 0.07, 0);
        report("inverted triangles", cloth, h, runCloth(cloth, common, h, settling, nullptr), true);
      }
      {   // all vertices on one line, and in one point
        ClothSetup cloth = sheet(grid, bending, 1e3, 1e-4);
        cloth.state.x.row(1).setZero();
        report("crushed to a line", cloth, h, runCloth(cloth, common, h, settling, nullptr), false);
        ClothSetup point = sheet(grid, bending, 1e3, 1e-4);
        point.state.x.setZero();
        report("crushed to a point", point, h, runCloth(point, common, h, settling, nullptr), false);
      }
      {
        ClothSetup cloth = sheet(needleMesh(), bending, 1e3, 1e-4);
        if (bending != BendingModel::hinge)   // some of its faces are folded over at rest
          cloth.model->undeformed = gridMesh(0.5, 0.5, 10, 10, GridPattern::alternating).vertices;
        cloth.pin({0, 10});
        report("needle triangles", cloth, h, runCloth(cloth, common, h, settling, nullptr), false);
      }
      {   // a corner yanked at 100 m/s for 20 ms, then held there until all is still
        ClothSetup cloth = sheet(grid, bending, 1e3, 1e-4);
        hung(cloth);
        double travelled = 0.0;
        report("yanked at 100 m/s", cloth, h,
               runCloth(cloth, common, h, settling,
                        [&](int, ClothInputs& inputs) {
                          const double move = std::min(100.0 * h, 2.0 - travelled);
                          inputs.pins.col(1) += Eigen::Vector3d(0, 0, move);
                          inputs.pins.col(0) += Eigen::Vector3d(0, 0, travelled > 1.0 ? move : 0.0);
                          travelled += move;
                          if (move <= 0 && inputs.pins(2, 0) < inputs.pins(2, 1))
                            inputs.pins.col(0) +=
                                Eigen::Vector3d(0, 0, std::min(0.2, inputs.pins(2, 1) - inputs.pins(2, 0)));
                        }),
               true);
      }
    }

  for (const BendingModel bending : models)
    for (const double h : {1e-5, 1e-3, 0.1})   // explicit: stable, or refused when it has blown up
    {
      ClothSetup cloth = sheet(grid, bending, 1e3, 1e-4);
      hung(cloth);
      ClothOptions options = common;
      options.integrator = Integrator::symplectic_euler;
      report("explicit", cloth, h, runCloth(cloth, options, h, 500, nullptr, h < 1e-4), false);
    }

  // Held at two corners and let go: soft and stiff, thin and thick.
  const auto hanging = [](double youngs_modulus, double thickness) {
    char text[700];
    std::snprintf(text, sizeof text, R"(
cloths:
  - grid: {corner: [0, 0, 0], sides: [[0.5, 0, 0], [0, 0.5, 0]], cells: 8, pattern: alternating}
    material: {density: 1000, thickness: %g, youngs_modulus: %g, poissons_ratio: 0.3}
    grasps: {left: {corner: lower_left}, right: {corner: lower_right}}
)",
                  thickness, youngs_modulus);
    return MapScene{text, {}};
  };
  sheetMaps(context, tally, "cloth_stability", 0.5, hanging);
  context.metric("not_recovered", not_recovered);
  context.metric("cases", static_cast<double>(context.rows().size()));
  context.note(
      "not_recovered: of sheets crushed, mirrored or yanked, those strained by half or more in the last step.");
}

const StudyRegistration kClothStabilityRegistration{
    "cloth_stability",
    "extreme stiffness, steps, random and crushed starts, needles, a yanked corner: done, recovered or refused with "
    "reason",
    runClothStability};

}   // namespace slender::study
