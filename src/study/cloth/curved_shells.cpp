// Shells that are curved at rest: under no load they stay as they are, and about that shape they vibrate like the
// shells they stand for.
#include <algorithm>
#include <array>
#include <cmath>
#include <filesystem>
#include <limits>
#include <map>

#include <Eigen/Geometry>
#include <unistd.h>

#include "cloth_cases.h"
#include "mesh_cases.h"
#include "shell_modes.h"
#include "slender_sim/geometry/mesh_file.h"
#include "slender_sim/geometry/mesh_shapes.h"
#include "slender_sim/scene/reader.h"
#include "slender_sim/scene/simulation.h"
#include "slender_sim/study/study.h"

namespace slender::study {

namespace {

using Eigen::Vector3d;

struct RestShape
{
  std::string name;
  TriangleMesh mesh;
};

/// Surface of a cube; open: without its upper side.
TriangleMesh boxMesh(double size, int cells, bool open)
{
  std::map<std::array<int, 3>, int> number;
  std::vector<std::array<int, 3>> points;
  std::vector<Eigen::Vector3i> faces;
  const auto at = [&](const std::array<int, 3>& p) {
    const auto [entry, is_new] = number.emplace(p, static_cast<int>(points.size()));
    if (is_new)
      points.push_back(p);
    return entry->second;
  };
  for (int axis = 0; axis < 3; ++axis)
    for (const int side : {0, 1})
      for (int i = 0; i < cells && !(open && axis == 2 && side == 1); ++i)
        for (int j = 0; j < cells; ++j)
        {
          const auto corner = [&](int a, int b) {
            std::array<int, 3> p{};
            p[static_cast<std::size_t>(axis)] = side * cells;
            p[static_cast<std::size_t>((axis + 1) % 3)] = a;
            p[static_cast<std::size_t>((axis + 2) % 3)] = b;
            return at(p);
          };
          const int a = corner(i, j), b = corner(i + 1, j), c = corner(i + 1, j + 1), d = corner(i, j + 1);
          faces.emplace_back(side ? Eigen::Vector3i(a, b, c) : Eigen::Vector3i(a, c, b));
          faces.emplace_back(side ? Eigen::Vector3i(a, c, d) : Eigen::Vector3i(a, d, c));
        }
  TriangleMesh mesh;
  mesh.vertices.resize(3, static_cast<Eigen::Index>(points.size()));
  for (std::size_t k = 0; k < points.size(); ++k)
    mesh.vertices.col(static_cast<Eigen::Index>(k)) = size / cells * Vector3d(points[k][0], points[k][1], points[k][2]);
  mesh.triangles.resize(3, static_cast<Eigen::Index>(faces.size()));
  for (std::size_t k = 0; k < faces.size(); ++k)
    mesh.triangles.col(static_cast<Eigen::Index>(k)) = faces[k];
  return mesh;
}

/// A sheet 0.2 m x 0.4 m folded across its length at every `period`-th row, each time by `degrees` to the other side
/// (`alternate`) or to the same one.
TriangleMesh foldedSheet(int rows, int period, double degrees, bool alternate)
{
  TriangleMesh mesh = gridMesh(0.2, 0.4, rows / 2, rows, GridPattern::one_diagonal);
  const double h = 0.4 / rows;
  std::vector<Eigen::Vector2d> line(static_cast<std::size_t>(rows) + 1, Eigen::Vector2d(0, 0));
  double angle = 0, turn = degrees * M_PI / 180;
  for (int k = 1; k <= rows; ++k)
  {
    const auto i = static_cast<std::size_t>(k);
    line[i] = line[i - 1] + h * Eigen::Vector2d(std::cos(angle), std::sin(angle));
    if (k % period == 0)
    {
      angle += turn;
      turn = alternate ? -turn : turn;
    }
  }
  for (Eigen::Index i = 0; i < mesh.vertices.cols(); ++i)
  {
    const Eigen::Vector2d at = line[static_cast<std::size_t>(std::lround(mesh.vertices(1, i) / h))];
    mesh.vertices.col(i) << mesh.vertices(0, i), at.x(), at.y();
  }
  return mesh;
}

TriangleMesh halfCylinder(int columns)
{
  TriangleMesh mesh = gridMesh(0.2 * M_PI, 0.3, columns, 0, GridPattern::equilateral);
  for (Eigen::Index i = 0; i < mesh.vertices.cols(); ++i)
  {
    const double angle = mesh.vertices(0, i) / 0.2;
    mesh.vertices.col(i) = Vector3d(-0.2 * std::cos(angle), mesh.vertices(1, i), 0.2 * std::sin(angle));
  }
  return mesh;
}

std::vector<RestShape> restShapes(bool quick)
{
  const int n = quick ? 4 : 8;
  return {{"half cylinder", halfCylinder(quick ? 12 : 24)},
          {"closed box", boxMesh(0.3, n, false)},
          {"bag", boxMesh(0.3, n, true)},
          {"sphere", icosphere(0.2, quick ? 1 : 2)},
          {"sheet with a crease", foldedSheet(quick ? 8 : 16, quick ? 4 : 8, 90, false)},
          {"accordion", foldedSheet(quick ? 8 : 16, 2, 120, true)},
          {"sheet folded by 170 degrees", foldedSheet(quick ? 8 : 16, quick ? 4 : 8, 170, false)}};
}

double sizeOf(const TriangleMesh& mesh)
{
  return (mesh.vertices.rowwise().maxCoeff() - mesh.vertices.rowwise().minCoeff()).norm();
}

struct Setting
{
  const char* name;
  Integrator integrator = Integrator::implicit_euler;
  ClothSolver solver = ClothSolver::gauss_seidel;
  bool one_newton_step = false;
  double step = 0.02;
  double damping = 0.0;   ///< by stiffness [s]
};

const Setting kSettings[] = {
    {"implicit_euler"},
    {"implicit_euler, cholesky", Integrator::implicit_euler, ClothSolver::cholesky},
    {"one_newton_step", Integrator::implicit_euler, ClothSolver::gauss_seidel, true},
    {"tr_bdf2, damped", Integrator::tr_bdf2, ClothSolver::gauss_seidel, false, 0.02, 1e-3},
    {"symplectic_euler", Integrator::symplectic_euler, ClothSolver::gauss_seidel, false, 2.5e-4}};

SceneConfig sceneOf(const RestShape& shape, BendingModel bending, const Setting& setting)
{
  SceneConfig scene;
  scene.gravity.setZero();
  scene.time.integrator = setting.integrator;
  scene.time.step = setting.step;
  ClothConfig cloth;
  cloth.name = "shell";
  cloth.mesh = shape.mesh;
  cloth.membrane = isotropicMembrane(1e5, 0.3, 1e-3);
  cloth.bending = bending;
  cloth.bending_modulus = 1e-3;
  cloth.stiffness_damping = setting.damping;
  cloth.solver = setting.solver;
  cloth.one_newton_step = setting.one_newton_step;
  scene.cloths.push_back(cloth);
  return scene;
}

/// Largest distance of a vertex from where it started, within `seconds`, over the size of the shape.
double creep(Simulation& simulation, double seconds)
{
  const Eigen::Matrix3Xd start = simulation.state().cloths[0].x;
  TriangleMesh shape;
  shape.vertices = start;
  const int steps = static_cast<int>(std::lround(seconds / simulation.config().time.step));
  double worst = 0;
  for (int k = 0; k < steps; ++k)
  {
    if (!simulation.step(simulation.defaultInputs()).ok)
      return std::numeric_limits<double>::quiet_NaN();
    worst = std::max(worst, (simulation.state().cloths[0].x - start).colwise().norm().maxCoeff());
  }
  return worst / sizeOf(shape);
}

constexpr double kSecondsAtRest = 10.0, kMostCreep = 1e-9;

/// Returns the creep. NaN: a step was refused.
double atRest(StudyContext& context, const RestShape& shape, BendingModel bending, const Setting& setting)
{
  Simulation simulation(sceneOf(shape, bending, setting));
  const double worst = creep(simulation, kSecondsAtRest);
  context.row()
      .set("case", "at rest")
      .set("shape", shape.name)
      .set("model", toString(bending))
      .set("setting", setting.name)
      .set("vertices", static_cast<double>(shape.mesh.vertices.cols()))
      .check(worst, 0.0, kMostCreep, "10 s without load; over the size");
  return worst;
}

/// A shell tracks a guide of its own shape that does not move.
double trackedAtRest(StudyContext& context, const RestShape& shape, const std::filesystem::path& folder)
{
  writeMesh((folder / "guide.obj").string(), shape.mesh);
  Simulation simulation(parseScene(R"(
gravity: [0, 0, 0]
time: {step: 0.02, duration: 10}
tracked:
  - guide: {mesh: {file: guide.obj}, motion: fixed}
    mesh: {subdivide: 1}
    material: {area_density: 0.15, thickness: 0.001, youngs_modulus: 1.0e5, poissons_ratio: 0.3}
)",
                                   "tracked", {}, folder.string()));
  const double worst = creep(simulation, kSecondsAtRest);
  context.row()
      .set("case", "tracked, at rest")
      .set("shape", shape.name)
      .set("model", "isometric, tracked")
      .check(worst, 0.0, kMostCreep, "10 s without load; over the size");
  return worst;
}

/// Models without a natural curvature are refused.
int acceptedWrongly(StudyContext& context, const std::vector<RestShape>& shapes)
{
  int wrong = 0;
  for (const RestShape& shape : shapes)
  {
    std::string message;
    try
    {
      const Simulation simulation(sceneOf(shape, BendingModel::isometric_conforming, kSettings[0]));
    }
    catch (const SceneError& error)
    {
      message = error.what();
    }
    const bool refused = message.find("bending: {model: hinge}") != std::string::npos;
    wrong += !refused;
    context.row()
        .set("case", "refused")
        .set("shape", shape.name)
        .set("model", "conforming")
        .check(refused, 1.0, 0.5, "refused with the fix");
  }
  return wrong;
}

void creeps(StudyContext& context)
{
  const std::vector<RestShape> shapes = restShapes(context.quick());
  double worst = 0;
  const auto take = [&](double value) { worst = std::isnan(worst) || value <= worst ? worst : value; };   // NaN stays
  int done = 0;
  const int total = static_cast<int>(shapes.size());
  for (const RestShape& shape : shapes)
  {
    context.progress(done++, total, shape.name);
    for (const Setting& setting : kSettings)
      if (!context.quick() || &setting == &kSettings[done % 6])
        // scenes take hinges by themselves
        take(atRest(context, shape, BendingModel::isometric_nonconforming, setting));
    if (!context.quick())
      take(atRest(context, shape, BendingModel::hinge, kSettings[0]));
    take(atRest(context, shape, BendingModel::none, kSettings[0]));
  }
  const std::filesystem::path folder =
      std::filesystem::temp_directory_path() / ("slender_curved_shells_" + std::to_string(::getpid()));
  std::filesystem::create_directories(folder);
  for (const int k : {0, 1, 2})
    if (!context.quick() || k == 2)
      take(trackedAtRest(context, shapes[static_cast<std::size_t>(k)], folder));
  std::filesystem::remove_all(folder);
  context.metric("worst_creep", worst);
  context.metric("accepted_wrongly", acceptedWrongly(context, shapes));
}

/// A shell of the study of frequencies: mesh, what of it is held, and the frequencies of the continuous shell.
struct VibratingShell
{
  std::string name;
  TriangleMesh mesh;
  std::vector<int> held;
  Eigen::VectorXd expected;   ///< angular frequencies [rad/s]
  double unsure = 0.0;        ///< change of these, relative, when the reference gets more terms
};

constexpr int kModes = 4;
/// Bending has the ratio of hinges on equilateral triangles (see docs/cloth.md). The membrane has its own.
const ShellMaterial kShell{1.0, 1e6, 0.3, 1e6 * 2e-3 * 2e-3 / 12, -1.0 / 3};

/// Largest relative difference of two lists of frequencies.
double largestDifference(const Eigen::VectorXd& a, const Eigen::VectorXd& b)
{
  return (a.array() / b.array() - 1).abs().maxCoeff();
}

/// A strip bent to an arc of 120 degrees, clamped at both ends. One more row of faces is held at each end, so that the
/// edge between that row and the strip is clamped.
VibratingShell arch(int columns)
{
  constexpr double kRadius = 0.2, kAngle = 2 * M_PI / 3;
  const int rows = 5 * columns;
  const double length = kRadius * kAngle, row = length / rows, width = columns * row / std::sqrt(0.75);
  VibratingShell shell{
      "arch", gridMesh(width, length + 2 * row, columns, rows + 2, GridPattern::equilateral), {}, {}, 0.0};
  for (Eigen::Index i = 0; i < shell.mesh.vertices.cols(); ++i)
  {
    const double s = shell.mesh.vertices(1, i) - row, a = s / kRadius - 0.5 * kAngle;
    if (s < 0.5 * row || s > length - 0.5 * row)
      shell.held.push_back(static_cast<int>(i));
    shell.mesh.vertices.col(i) = Vector3d(shell.mesh.vertices(0, i), kRadius * std::sin(a), kRadius * std::cos(a));
  }
  shell.expected = archFrequencies(kShell, kRadius, kAngle, width, 18, kModes);
  shell.unsure = largestDifference(archFrequencies(kShell, kRadius, kAngle, width, 14, kModes), shell.expected);
  return shell;
}

/// A cap of a sphere, up to 40 degrees from its axis, clamped along its rim.
VibratingShell cap(int rings)
{
  constexpr double kRadius = 0.2, kAngle = 2 * M_PI / 9;
  VibratingShell shell{"spherical cap", discMesh(kAngle * (rings + 1) / rings, rings + 1), {}, {}, 0.0};
  for (Eigen::Index i = 0; i < shell.mesh.vertices.cols(); ++i)
  {
    const Vector3d at = shell.mesh.vertices.col(i);
    const double a = at.norm(), share = a > 0 ? std::sin(a) / a : 1.0;
    if (a > kAngle * (1 - 0.5 / rings))
      shell.held.push_back(static_cast<int>(i));
    shell.mesh.vertices.col(i) = kRadius * Vector3d(share * at.x(), share * at.y(), std::cos(a));
  }
  shell.expected = capFrequencies(kShell, kRadius, kAngle, 14, kModes);
  shell.unsure = largestDifference(capFrequencies(kShell, kRadius, kAngle, 10, kModes), shell.expected);
  return shell;
}

/// Largest relative error of the frequencies of a mesh.
double frequencyError(StudyContext& context, const VibratingShell& shell, double bound)
{
  ClothModel model =
      buildCloth(shell.name, shell.mesh, kShell.area_density,
                 isotropicMembrane(kShell.stretching * (1 - kShell.membrane_ratio * kShell.membrane_ratio),
                                   kShell.membrane_ratio, 1.0));
  model.bending = BendingModel::hinge;
  model.bending_modulus = kShell.bending;
  clampFaces(model, shell.held);
  const Eigen::VectorXd found = meshFrequencies(model, shell.held, kModes);
  double worst = 0.0;
  for (int k = 0; k < kModes; ++k)
  {
    worst = std::max(worst, std::abs(found[k] / shell.expected[k] - 1));
    Row& row = context.row();
    row.set("case", "frequency " + std::to_string(k + 1))
        .set("shape", shell.name)
        .set("model", "hinge")
        .set("vertices", model.vertices());
    row.set("relative_error", found[k] / shell.expected[k] - 1).set("reference_unsure_by", shell.unsure);
    row.check(found[k], shell.expected[k], bound * shell.expected[k], "Ritz");
  }
  return worst;
}

/// The meshes converge with the width of their cells: the strip's free sides are of first order.
void frequencies(StudyContext& context)
{
  constexpr double kBound = 0.01;   // of every row, coarse ones included
  double worst = 0.0;
  for (const bool spherical : {false, true})
  {
    const std::vector<int> sizes = context.quick() ? std::vector<int>{16} : std::vector<int>{16, 32};
    for (const int n : sizes)
    {
      context.progress(n, sizes.back(), spherical ? "frequencies of a cap" : "frequencies of an arch");
      worst = std::max(worst, frequencyError(context, spherical ? cap(n) : arch(n), kBound));
    }
  }
  context.metric("worst_frequency_error", worst);
}

}   // namespace

void runCurvedShells(StudyContext& context)
{
  useOneBlasThread();
  creeps(context);
  frequencies(context);
  context.note(
      "frequencies: of small motions about the rest shape, of a mesh with hinge bending against the method of Ritz for "
      "the continuous shell, both with the same "
      "Poisson's ratios of bending (-1/3) and of the membrane (0.3).");
  context.note(
      "at rest: nothing acts on the shells, so that all motion is the model's own. Models: as the scene asks for them; "
      "for curved shapes scenes "
      "take hinges instead of isometric bending.");
}

const StudyRegistration kCurvedShellsRegistration{
    "curved_shells",
    "shells that are curved at rest: they keep their shape without load, and vibrate as the method of Ritz says",
    runCurvedShells};

}   // namespace slender::study
