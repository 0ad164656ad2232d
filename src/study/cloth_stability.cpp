// Cloth under whatever may be asked of it: done, or refused with a reason and the state untouched, never NaN.
#include <cmath>
#include <functional>
#include <random>

#include <Eigen/Geometry>

#include "cloth_cases.h"
#include "slender_sim/study/study.h"

namespace slender::study {

namespace {

struct Verdict
{
  int steps = 0, cuts = 0, nans = 0, refused = 0, unexplained = 0;
  double cpu_seconds = 0, largest_stretch = 0, end_stretch = 0, fastest = 0;
  std::string reason;
};

bool isFinite(const ClothState& s) { return s.x.allFinite() && s.v.allFinite() && s.rest_angles.allFinite(); }

/// Runs up to `steps` steps of h; `motion` sets the inputs for the end of each. A refusal must say why and leave the state as it was.
Verdict run(ClothSetup& cloth, const ClothOptions& options, double h, int steps, const std::function<void(int, ClothInputs&)>& motion)
{
  Verdict v;
  ClothStepper stepper(cloth.model, options);
  const double begin = threadSeconds();
  for (int k = 0; k < steps && v.refused == 0; ++k)
  {
    if (motion)
      motion(k, cloth.inputs);
    const ClothState before = cloth.state;
    const StepReport report = stepper.step(cloth.state, cloth.inputs, h);
    v.cuts += report.cut_steps;
    v.nans += !isFinite(cloth.state) || (report.ok && (!stepper.pinForces().allFinite() || !std::isfinite(report.max_strain)));
    if (report.ok)
    {
      ++v.steps;
      v.end_stretch = report.max_strain;
      v.largest_stretch = std::max(v.largest_stretch, report.max_strain);
      v.fastest = std::max(v.fastest, cloth.state.v.cwiseAbs().maxCoeff());
      continue;
    }
    ++v.refused;
    v.reason = report.message;
    v.unexplained += report.message.empty() || cloth.state.x != before.x || cloth.state.v != before.v;
  }
  v.cpu_seconds = threadSeconds() - begin;
  return v;
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
    const Eigen::Vector3d a = mesh.vertices.col(face[0]), b = mesh.vertices.col(face[1]), c = mesh.vertices.col(face[2]);
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

}  // namespace

void runClothStability(StudyContext& context)
{
  useOneBlasThread();
  int nans = 0, refused = 0, unexplained = 0, cases = 0, not_recovered = 0;
  const auto report = [&](const std::string& what, const ClothSetup& cloth, double h, const Verdict& v, bool expects_recovery) {
    // stretch at the end: of a sheet that has come to hang again
    const bool recovered = v.refused == 0 && v.end_stretch < 0.5;
    Row& row = context.row();
    row.set("case", what).set("model", toString(cloth.model->bending)).set("step_ms", 1e3 * h).set("steps", v.steps).set("cuts", v.cuts)
      .set("largest_stretch", v.largest_stretch).set("end_stretch", v.end_stretch).set("cpu_seconds", v.cpu_seconds)
      .set("outcome", v.refused ? "refused" : expects_recovery ? (recovered ? "recovered" : "not recovered") : "done");
    if (v.refused)
      row.set("reason", v.reason);
    nans += v.nans;
    refused += v.refused;
    unexplained += v.unexplained;
    not_recovered += expects_recovery && v.refused == 0 && !recovered;
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
  const std::vector<double> steps = context.quick() ? std::vector<double>{0.01, 0.1} : std::vector<double>{0.001, 0.01, 1.0 / 30, 0.1};
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
          report(what, cloth, h, run(cloth, options, h, context.quick() ? 5 : 20, nullptr), false);
        }
  for (const BendingModel bending : models)
    for (int decade = -8; decade <= 2; decade += 5)
    {
      ClothSetup cloth = sheet(grid, bending, 1e3, std::pow(10.0, decade));
      hung(cloth);
      char what[80];
      std::snprintf(what, sizeof what, "bending 1e%d N m", decade);
      report(what, cloth, 0.1, run(cloth, common, 0.1, 20, nullptr), false);
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
          if (std::find(cloth.state.pins.begin(), cloth.state.pins.end(), static_cast<int>(i)) == cloth.state.pins.end())
            cloth.state.x.col(i) = 0.25 * Eigen::Vector3d(1 + uniform(random), 1 + uniform(random), uniform(random));
        report("random positions", cloth, h, run(cloth, common, h, settling, nullptr), true);
      }
      {   // mirrored: all faces turned over inside their plane
        ClothSetup cloth = sheet(grid, bending, 1e3, 1e-4);
        cloth.pin({0});
        cloth.state.x.row(0) *= -1.0;
        report("mirrored", cloth, h, run(cloth, common, h, settling, nullptr), true);
      }
      {   // single vertices across the opposite edge: inverted triangles
        ClothSetup cloth = sheet(grid, bending, 1e3, 1e-4);
        hung(cloth);
        for (int i = side + 4; i < side * cells; i += side)
          cloth.state.x.col(i) += Eigen::Vector3d(0.1, 0.07, 0);
        report("inverted triangles", cloth, h, run(cloth, common, h, settling, nullptr), true);
      }
      {   // all vertices on one line, and in one point
        ClothSetup cloth = sheet(grid, bending, 1e3, 1e-4);
        cloth.state.x.row(1).setZero();
        report("crushed to a line", cloth, h, run(cloth, common, h, settling, nullptr), false);
        ClothSetup point = sheet(grid, bending, 1e3, 1e-4);
        point.state.x.setZero();
        report("crushed to a point", point, h, run(point, common, h, settling, nullptr), false);
      }
      {
        ClothSetup cloth = sheet(needleMesh(), bending, 1e3, 1e-4);
        cloth.pin({0, 10});
        report("needle triangles", cloth, h, run(cloth, common, h, settling, nullptr), false);
      }
      {   // a corner yanked at 100 m/s for 20 ms, then held there until all is still
        ClothSetup cloth = sheet(grid, bending, 1e3, 1e-4);
        hung(cloth);
        double travelled = 0.0;
        report("yanked at 100 m/s", cloth, h,
               run(cloth, common, h, settling,
                   [&](int, ClothInputs& inputs) {
                     const double move = std::min(100.0 * h, 2.0 - travelled);
                     inputs.pins.col(1) += Eigen::Vector3d(0, 0, move);
                     inputs.pins.col(0) += Eigen::Vector3d(0, 0, travelled > 1.0 ? move : 0.0);
                     travelled += move;
                     if (move <= 0 && inputs.pins(2, 0) < inputs.pins(2, 1))
                       inputs.pins.col(0) += Eigen::Vector3d(0, 0, std::min(0.2, inputs.pins(2, 1) - inputs.pins(2, 0)));
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
      report("explicit", cloth, h, run(cloth, options, h, 500, nullptr), false);
    }

  context.metric("nan_count", nans);
  context.metric("refused", refused);
  context.metric("unexplained_failures", unexplained);
  context.metric("not_recovered", not_recovered);
  context.metric("cases", cases);
  context.note("recovered: strained by less than half in the last step; refused: with a reason, the state as before the step.");
}

}  // namespace slender::study
