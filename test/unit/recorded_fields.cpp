// What `record: {fields: [...]}` records, against formulas and against the balance of forces and moments.
#include <cmath>
#include <filesystem>

#include <gtest/gtest.h>

#include "slender_sim/rod/rod_sections.h"
#include "slender_sim/scene/csv_tables.h"
#include "slender_sim/scene/field_tables.h"
#include "slender_sim/scene/reader.h"
#include "slender_sim/scene/snapshot.h"
#include "study/framework/whole_file.h"
#include "test/support/scenes.h"

namespace slender {
namespace {

using Eigen::Vector3d;
using test::runSteps;

Simulation simulationOf(const std::string& yaml, const std::vector<std::string>& overrides = {})
{
  return Simulation(parseScene(yaml, "t", overrides));
}

RodSections sections(const Simulation& simulation, int rod = 0)
{
  return sectionsOf(simulation.rodModel(rod), simulation.state().rods[static_cast<std::size_t>(rod)]);
}

/// Column of a table by its name.
Eigen::VectorXd column(const FieldTable& table, const std::string& name)
{
  const auto found = std::find(table.columns.begin(), table.columns.end(), name);
  EXPECT_NE(found, table.columns.end()) << name;
  return table.values.col(found - table.columns.begin());
}

const std::string hanging = R"(
start: equilibrium
rods:
  - name: rod
    centerline: {straight: {from: [0, 0, 1], to: [0, 0, 0], edges: 20}}
    cross_section: {radius: 0.004}
    material: {density: 1100, youngs_modulus: 1.0e6, poissons_ratio: 0.45}
    grasps: {top: {edges: [0]}}
)";

TEST(RecordedFields, TensionOfAHangingRodIsTheWeightBelow)
{
  const Simulation simulation = simulationOf(hanging, {"record.fields=[force, strain]"});
  const RodModel& model = simulation.rodModel(0);
  const std::vector<FieldTable> tables = fieldTablesOf(simulation);
  ASSERT_EQ(tables.size(), 1u);
  const Eigen::VectorXd tension = column(tables[0], "tension [N]"), fz = column(tables[0], "fz [N]"),
                        strain = column(tables[0], "strain");
  for (int j = 0; j < model.edges(); ++j)
  {
    const double weight = 9.81 * model.mass.tail(model.nodes() - 1 - j).sum();
    EXPECT_NEAR(tension[j], weight, 1e-9 * 9.81 * model.totalMass());   // the solver's residual over the rod's weight
    EXPECT_NEAR(fz[j], -weight, 1e-9 * 9.81 * model.totalMass());       // what hangs below pulls down
    EXPECT_NEAR(strain[j], weight / (M_PI * 0.004 * 0.004 * 1e6), 1e-9);
  }
  EXPECT_EQ(tension[model.edges()], tension[model.edges() - 1]);   // the end's row repeats the last edge
}

const std::string cantilever = R"(
start: equilibrium
rods:
  - name: beam
    centerline: {straight: {from: [0, 0, 0], to: [1, 0, 0], edges: 40}}
    director: [0, 0, 1]
    cross_section: {ellipse: [0.004, 0.008]}
    material: {density: 1100, youngs_modulus: 2.0e10, poissons_ratio: 0.4}
    grasps: {wall: {edges: [0]}}
)";

TEST(RecordedFields, MomentOfACantileverIsThatOfTheWeightBeyond)
{
  for (const char* curvature : {"tangent", "compensated"})
  {
    const Simulation simulation = simulationOf(cantilever, {std::string("rods.0.curvature=") + curvature});
    const RodModel& model = simulation.rodModel(0);
    const RodState& state = simulation.state().rods[0];
    const RodSections s = sections(simulation);
    double largest = 0.0;
    for (int i = 0; i < model.nodes(); ++i)
    {
      Vector3d expected(0, 0, 0);
      for (int k = i + 1; k < model.nodes(); ++k)
        expected += (state.x.col(k) - state.x.col(i)).cross(Vector3d(0, 0, -9.81 * model.mass[k]));
      largest = std::max(largest, expected.norm());
      // the discrete rod is in equilibrium, so the only error is the solver's residual
      EXPECT_LT((s.moment.col(i) - expected).norm(), 1e-7 * largest) << i;
      // d1 points up, so that the moment of the weight turns about +y, which is -d2 at a rod along x
      EXPECT_NEAR(s.material_moment(2, i), -expected.y(), 1e-7 * largest + 1e-14);
      // constitutive law: the moment about d2 is B1 kappa1, up to terms of second order in the turn of one joint
      const double b1 = 2e10 * M_PI * 0.004 * 0.008 / 4 * 0.004 * 0.004;
      const double turn = s.curvature.col(i).norm() / 40;
      EXPECT_NEAR(s.material_moment(2, i), b1 * s.curvature(0, i), (0.5 * turn * turn + 1e-9) * largest) << i;
      EXPECT_NEAR(s.curvature(1, i), 0.0, 1e-9);
    }
    // small deflection, a hundredth of the length: m g L / 2 at the wall, up to the square of the slope
    EXPECT_NEAR(s.moment.col(0).y(), 0.5 * 9.81 * model.totalMass(), 0.01 * largest);
    EXPECT_GT(s.curvature.col(0).norm(), 0.01);
  }
}

TEST(RecordedFields, BendModulusComesInTheOrderTowardsD1TowardsD2)
{
  // B1 resists bending towards d1, which turns about d2: with d1 up the weight bends about d2 and B1 counts, with d1
  // level B2 does.
  const std::vector<std::string> moduli = {"rods.0.material.bend_modulus=[0.1, 0.4]",
                                           "rods.0.material.stretch_modulus=1e4", "rods.0.material.twist_modulus=0.1",
                                           "rods.0.material.linear_density=0.02"};
  std::vector<std::string> level = moduli;
  level.push_back("rods.0.director=[0, 1, 0]");
  const double up_sag = -simulationOf(cantilever, moduli).state().rods[0].x(2, 40),
               level_sag = -simulationOf(cantilever, level).state().rods[0].x(2, 40);
  EXPECT_NEAR(up_sag, 0.02 * 9.81 / (8 * 0.1), 0.05 * up_sag);   // q L^4 / (8 B), small deflection
  EXPECT_NEAR(level_sag, 0.02 * 9.81 / (8 * 0.4), 0.02 * level_sag);
  EXPECT_NEAR(sections(simulationOf(cantilever, level)).curvature.row(0).norm(), 0.0, 1e-9);
}

TEST(RecordedFields, TwistMomentOfATwistedRod)
{
  const Simulation simulation = simulationOf(R"(
gravity: [0, 0, 0]
rods:
  - name: rod
    centerline: {straight: {from: [0, 0, 0], to: [0.8, 0, 0], edges: 32}}
    initial_twist: 3.0
    cross_section: {radius: 0.004}
    material: {density: 1100, youngs_modulus: 1.0e6, poissons_ratio: 0.45}
    grasps: {left: {edges: [0]}, right: {edges: [-1]}}
)");
  const RodSections s = sections(simulation);
  const double beta = 1e6 / (2 * 1.45) * M_PI * std::pow(0.004, 4) / 2;
  const RodModel& model = simulation.rodModel(0);
  // initial_twist is spread over the inner nodes, and the ends' sections follow the end edges
  double total = 0.0;
  for (int i = 1; i + 1 < model.nodes(); ++i)
  {
    total += s.twist[i] * (model.twist_modulus[i] > 0 ? 0.8 / 32 : 0.0);
    EXPECT_NEAR(s.material_moment(0, i), beta * s.twist[i], 1e-9 * beta);
    EXPECT_NEAR(s.moment(0, i), beta * s.twist[i], 1e-9 * beta);   // the rod runs along x
  }
  EXPECT_NEAR(total, 3.0, 0.02);   // the first and last joint are h/12 longer than h next to clamps
}

TEST(RecordedFields, TwistMomentOfATurnedEndIsItsTorque)
{
  Simulation simulation = simulationOf(R"(
time: {step: 0.02, integrator: implicit_euler}
gravity: [0, 0, 0]
rods:
  - name: rod
    centerline: {straight: {from: [0, 0, 0], to: [0.8, 0, 0], edges: 32}}
    director: [0, 1, 0]
    cross_section: {radius: 0.004}
    damping: {mass: 5}
    material: {density: 1100, youngs_modulus: 1.0e6, poissons_ratio: 0.45}
    grasps: {left: {edges: [0]}, right: {edges: [-1], motion: {table: [[0, 0.8, 0, 0, 0, 0, 0, 1], [1, 0.8, 0, 0, 0.8414709848, 0, 0, 0.5403023059]]}}}
)");
  runSteps(simulation, 60);
  const double beta = 1e6 / (2 * 1.45) * M_PI * std::pow(0.004, 4) / 2;
  const RodSections s = sections(simulation);
  for (int i = 0; i < simulation.rodModel(0).nodes(); ++i)
    EXPECT_NEAR(s.material_moment(0, i), beta * 2.0 / 0.8, 1e-6 * beta) << i;   // 2 rad over 0.8 m
  EXPECT_NEAR(simulation.grasps().wrench(0).torque.x(), s.material_moment(0, 0), 1e-9 * beta);
  EXPECT_NEAR(simulation.grasps().wrench(1).torque.x(), -s.material_moment(0, 32), 1e-9 * beta);
}

TEST(RecordedFields, CurvatureOfAHelixIsItsOwnToSecondOrder)
{
  // Chords of a helix of radius R and rise c per radian, whose nodes are a rad apart, have the length l and turn by
  // phi:
  //   l^2 = 4 R^2 sin^2(a/2) + c^2 a^2,   l^2 cos(phi) = 4 R^2 sin^2(a/2) cos(a) + c^2 a^2.
  // The curvature of a joint is 2 tan(phi/2) / l (tangent) or phi / l (compensated).
  constexpr double kRadius = 0.1, kRise = 0.1 / (2 * M_PI), kTurns = 3;
  const double smooth = kRadius / (kRadius * kRadius + kRise * kRise);
  for (const char* curvature : {"tangent", "compensated"})
  {
    double error[2];
    for (int fine : {0, 1})
    {
      const int edges = fine ? 180 : 90;
      const Simulation simulation = simulationOf(
          R"(
gravity: [0, 0, 0]
rods:
  - name: helix
    centerline: {helix: {radius: 0.1, pitch: 0.1, turns: 3, edges: 90}}
)",
          {"rods.0.centerline.helix.edges=" + std::to_string(edges), std::string("rods.0.curvature=") + curvature});
      const RodSections s = sections(simulation);
      const double a = 2 * M_PI * kTurns / edges, across = std::pow(2 * kRadius * std::sin(0.5 * a), 2),
                   along = std::pow(kRise * a, 2);
      const double length = std::sqrt(across + along),
                   turn = std::acos((across * std::cos(a) + along) / (across + along));
      const double expected = (curvature[0] == 't' ? 2 * std::tan(0.5 * turn) : turn) / length;
      for (int i = 2; i + 2 < simulation.rodModel(0).nodes(); ++i)
        // acos loses half of the digits at small turns
        EXPECT_NEAR(s.curvature.col(i).norm(), expected, 1e-9 * expected) << i;
      error[fine] = std::abs(s.curvature.col(edges / 2).norm() / smooth - 1);
      EXPECT_LT(s.moment.cwiseAbs().maxCoeff(), 1e-12);   // at rest
      EXPECT_LT(s.force.cwiseAbs().maxCoeff(), 1e-9);
    }
    // halving the edges quarters the error of a method of second order
    EXPECT_NEAR(error[0] / error[1], 4.0, 0.2) << curvature;
  }
}

TEST(RecordedFields, ARingBentFromAStraightRodCarriesOnlyItsMoment)
{
  const Simulation simulation = simulationOf(R"(
gravity: [0, 0, 0]
rods:
  - name: ring
    closed: true
    naturally_straight: true
    centerline: {arc: {center: [0, 0, 0], start: [0.2, 0, 0], axis: [0, 0, 1], angle: 6.2, edges: 79}}
    material: {bend_modulus: 0.01, twist_modulus: 0.01, stretch_modulus: 1e4, linear_density: 0.05}
)");
  const RodSections s = sections(simulation);
  for (int i = 0; i < simulation.rodModel(0).nodes(); ++i)
  {
    // B / R; polygon of 80 edges, of which one is 4 % longer
    EXPECT_NEAR(s.moment(2, i), 0.01 / 0.2, 0.01 * 0.01 / 0.2) << i;
    EXPECT_NEAR(s.moment.col(i).head<2>().norm(), 0.0, 1e-10);
  }
}

/// Newton's law for every free node, with the force that implicit Euler balances at the end of the step: the recorded
/// force is the solver's own.
TEST(RecordedFields, ForcesAreThoseThatAccelerateTheNodes)
{
  Simulation simulation = simulationOf(R"(
time: {step: 0.002, integrator: implicit_euler}
rods:
  - name: rope
    centerline: {straight: {from: [0, 0, 1], to: [0.8, 0, 1], edges: 20}}
    cross_section: {ellipse: [0.004, 0.006]}
    damping: {stiffness: 0.01}
    material: {density: 1100, youngs_modulus: 1.0e6, poissons_ratio: 0.45}
    grasps: {hand: {edges: [0]}, middle: {nodes: [8, 9, 10]}}
)");
  runSteps(simulation, 20);
  simulation.grasps().release(1);
  runSteps(simulation, 10);
  const RodState before = simulation.state().rods[0];
  runSteps(simulation, 1);
  const RodState& after = simulation.state().rods[0];
  const RodSections s = sections(simulation);
  const RodModel& model = simulation.rodModel(0);
  for (int i = 1; i < model.nodes(); ++i)
  {
    const Vector3d next = i < model.edges() ? Vector3d(s.force.col(i)) : Vector3d(0, 0, 0);
    const Vector3d acceleration = (after.v.col(i) - before.v.col(i)) / 0.002;
    const Vector3d unbalanced = model.mass[i] * (acceleration - Vector3d(0, 0, -9.81)) - (next - s.force.col(i - 1));
    EXPECT_LT(unbalanced.norm(), 1e-6 * 9.81 * model.totalMass()) << i;   // tolerance of Newton's method
  }
  EXPECT_GT(s.force.colwise().norm().maxCoeff(), 0.1 * 9.81 * model.totalMass());
}

TEST(RecordedFields, NothingIsToldOfWhatIsHeldAsAWhole)
{
  const Simulation simulation = simulationOf(hanging, {"rods.0.grasps.top.edges=[0, 1, 2]"});
  const RodSections s = sections(simulation);
  for (int j = 0; j < simulation.rodModel(0).edges(); ++j)
    EXPECT_EQ(std::isnan(s.tension[j]), j <= 2) << j;
  for (int i = 0; i < simulation.rodModel(0).nodes(); ++i)
    EXPECT_EQ(s.moment.col(i).hasNaN(), i == 1 || i == 2) << i;
  EXPECT_TRUE(s.curvature.allFinite());
  EXPECT_TRUE(s.twist.allFinite());
  EXPECT_TRUE(s.strain.allFinite());
}

TEST(RecordedFields, ContactForcesCarryTheWeight)
{
  Simulation simulation = simulationOf(R"(
time: {step: 0.005}
record: {fields: [contact_force, energy]}
obstacles: [{name: floor, shape: {plane: {normal: [0, 0, 1]}}}]
rods:
  - name: other
    centerline: {straight: {from: [0, 1, 1], to: [0.8, 1, 1], edges: 10}}
  - name: rope
    centerline: {straight: {from: [0, 0, 0.0052], to: [0.8, 0, 0.0052], edges: 20}}
    cross_section: {radius: 0.005}
    damping: {mass: 20}
    contact: {friction: 0.3}
)");
  runSteps(simulation, 100);
  const std::vector<FieldTable> tables = fieldTablesOf(simulation);
  ASSERT_EQ(tables.size(), 5u);
  EXPECT_EQ(tables[0].object, "other");
  EXPECT_EQ(column(tables[0], "contact_fz [N]").norm(), 0.0);
  const double weight = 9.81 * simulation.rodModel(1).totalMass();
  EXPECT_NEAR(column(tables[1], "contact_fz [N]").sum(), weight, 1e-3 * weight);   // it has come to rest
  EXPECT_EQ(tables[2].object, "floor");
  EXPECT_NEAR(column(tables[2], "contact_fz [N]")[0], -weight, 1e-3 * weight);
  EXPECT_EQ(tables[4].table, "energies");
  const RodEnergies e = simulation.energies(1);
  EXPECT_EQ(column(tables[4], "kinetic [J]")[0], e.kinetic);
  EXPECT_EQ(column(tables[4], "gravity [J]")[0], e.gravity);
  EXPECT_GT(e.gravity, 0.0);
}

/// A ball on a box on a table: what each bears is what stands on it, and the torque comes from where it stands.
TEST(RecordedFields, ContactForcesOfSolids)
{
  Simulation simulation = simulationOf(R"(
time: {step: 0.005}
record: {fields: [contact_force]}
obstacles: [{name: table, shape: {box: {size: [1, 1, 0.1]}}, pose: {position: [0.2, 0, 0.45]}}]
bodies:
  - {name: box, mass: 2, shape: {box: {size: [0.4, 0.2, 0.1]}}, pose: {position: [0, 0, 0.551]}}
  - {name: ball, mass: 1, shape: {sphere: {radius: 0.05}}, pose: {position: [0.1, 0.02, 0.652]}}
)");
  runSteps(simulation, 400);
  const std::vector<FieldTable> tables = fieldTablesOf(simulation);
  ASSERT_EQ(tables.size(), 3u);
  const auto load = [&](std::size_t k, const std::string& name) { return column(tables[k], "contact_" + name)[0]; };
  const double ball = 9.81, box = 2 * 9.81;
  EXPECT_NEAR(load(0, "fz [N]"), box, 1e-3 * box);   // the table's force less the ball's
  EXPECT_NEAR(load(0, "mx [N m]"), 0.0, 1e-3);
  EXPECT_NEAR(load(1, "fz [N]"), ball, 1e-3 * ball);
  EXPECT_NEAR(load(2, "fz [N]"), -(box + ball), 1e-3 * box);
  const double x_ball = simulation.state().bodies[1].X_WB.position.x(),
               x_box = simulation.state().bodies[0].X_WB.position.x();
  EXPECT_NEAR(load(2, "my [N m]"), (x_ball - 0.2) * ball + (x_box - 0.2) * box, 1e-2);
}

/// A rope with a ball hangs over an obstacle and a driven body: grasps and both bear its weight.
TEST(RecordedFields, ContactForcesOfAnEquilibrium)
{
  Simulation simulation = simulationOf(R"(
start: equilibrium
time: {step: 0.004}
record: {fields: [contact_force]}
rods:
  - name: rope
    centerline: {straight: {from: [-0.3, 0, 0.2], to: [0.3, 0, 0.2], edges: 60}}
    cross_section: {radius: 0.004}
    material: {density: 1100, youngs_modulus: 1.0e6, poissons_ratio: 0.45}
    contact: {friction: 0}
    grasps: {l: {edges: [0]}, r: {edges: [-1]}}
obstacles: [{name: peg, shape: {capsule: {radius: 0.02, length: 0.2}}, pose: {position: [0.12, 0, 0.15], rpy: [1.5707963, 0, 0]}}]
bodies:
  - {name: ball, mass: 0.02, shape: {sphere: {radius: 0.02}}, pose: {position: [-0.1, 0, 0.1]}, welds: [{rod: rope, edge: 20}]}
  - {name: bar, motion: fixed, shape: {capsule: {radius: 0.02, length: 0.2}}, pose: {position: [0.2, 0, 0.165], rpy: [1.5707963, 0, 0]}}
)");
  const auto up = [&](std::size_t k) { return column(fieldTablesOf(simulation).at(k), "contact_fz [N]").sum(); };
  const double weight = 9.81 * (simulation.rodModel(0).totalMass() + 0.02),
               held = -simulation.grasps().wrench(0).force.z() - simulation.grasps().wrench(1).force.z();
  EXPECT_EQ(up(1), 0.0);     // the ball touches nothing
  EXPECT_LT(up(2), -1e-3);   // the bar
  EXPECT_LT(up(3), -1e-3);   // the peg
  EXPECT_NEAR(up(0), -up(2) - up(3), 1e-9);
  EXPECT_NEAR(held + up(0), weight, 1e-5 * weight);
  runSteps(simulation, 1);   // from where it stands
  EXPECT_NEAR(held + up(0), weight, 1e-2 * weight);
}

/// Damping takes nothing of what a floor bears.
TEST(RecordedFields, ContactForcesOfDampedClothCarryItsWeight)
{
  for (const char* damping : {"{}", "{mass: 10}", "{mass: 100}", "{drag: 2}"})
  {
    Simulation simulation = simulationOf(R"(
time: {step: 0.01}
record: {fields: [contact_force]}
cloths:
  - name: sheet
    grid: {corner: [-0.2, -0.2, 0.0021], sides: [[0.4, 0, 0], [0, 0.4, 0]], cells: 8}
    material: {area_density: 0.2}
    contact: {thickness: 0.004, method: impulses}
obstacles: [{name: floor, shape: {plane: {}}}]
)",
                                         {std::string("cloths.0.damping=") + damping});
    runSteps(simulation, 100);
    const double weight = 9.81 * simulation.clothModel(0).totalMass();
    EXPECT_NEAR(column(fieldTablesOf(simulation).at(0), "contact_fz [N]").sum(), weight, 1e-3 * weight) << damping;
  }
}

TEST(RecordedFields, AreWrittenOnlyWhenAskedFor)
{
  const std::string folder = testing::TempDir() + "recorded_fields";
  std::filesystem::remove_all(folder);
  const auto record = [&](const std::string& name, const std::vector<std::string>& overrides) {
    const Simulation simulation = simulationOf(hanging, overrides);
    CsvTables tables(folder + "/" + name);
    tables.write(snapshotOf(simulation));
    tables.finish();
    return folder + "/" + name;
  };
  const std::string plain = record("plain", {});
  const std::string full =
      record("full", {"record.fields=[curvature, twist, strain, force, moment, energy, contact_force]",
                      "rods.0.grasps.top.edges=[0, 1]"});
  EXPECT_FALSE(std::filesystem::exists(plain + "/rod_fields.csv"));
  EXPECT_FALSE(std::filesystem::exists(plain + "/energies.csv"));
  EXPECT_TRUE(snapshotOf(simulationOf(hanging)).fields.empty());
  const std::string fields = wholeFile(full + "/rod_fields.csv");
  EXPECT_EQ(fields.substr(0, fields.find('\n')),
            "t [s],object,index,kappa1 [1/m],kappa2 [1/m],twist_rate [rad/m],strain,tension [N],fx [N],fy [N],fz "
            "[N],moment_t [N m],moment_d1 [N m],"
            "moment_d2 [N m],mx [N m],my [N m],mz [N m],contact_fx [N],contact_fy [N],contact_fz [N]");
  EXPECT_EQ(std::count(fields.begin(), fields.end(), '\n'), 22);
  EXPECT_EQ(fields.find("nan"), std::string::npos);
  EXPECT_NE(fields.find(",,,,"), std::string::npos);   // the force of the edge that is held as a whole
  const std::string energies = wholeFile(full + "/energies.csv");
  EXPECT_EQ(energies.substr(0, energies.find('\n')),
            "t [s],object,stretch [J],bend [J],twist [J],kinetic [J],gravity [J]");
}

std::string complaint(const std::vector<std::string>& overrides, const std::string& scene = hanging)
{
  try
  {
    parseScene(scene, "t", overrides);
  }
  catch (const SceneError& error)
  {
    return error.what();
  }
  return "";
}

TEST(RecordedFields, ThatNothingHasAreRefused)
{
  EXPECT_NE(complaint({"record.fields=[curvatur]"}).find("must be one of: curvature"), std::string::npos)
      << complaint({"record.fields=[curvatur]"});
  EXPECT_NE(complaint({"record.fields=[twist, twist]"}).find("named twice"), std::string::npos);
  EXPECT_NE(complaint({"record.fields=[force]", "rods.0.stretching=projected", "rods.0.formulation=isotropic",
                       "time.integrator=symplectic_euler", "start=as_given"})
                .find("stretching: projected"),
            std::string::npos);
  const std::string cloth = R"(
cloths:
  - {name: c, grid: {corner: [0, 0, 0], sides: [[1, 0, 0], [0, 1, 0]], cells: 2}, material: {youngs_modulus: 1e5, thickness: 1e-3, area_density: 0.1}, bending: {modulus: 1e-5}}
)";
  EXPECT_EQ(complaint({}, cloth), "");
  EXPECT_EQ(complaint({"record={fields: [energy, contact_force]}"}, cloth), "");
  EXPECT_NE(complaint({"record={fields: [moment]}"}, cloth).find("recorded of rods"), std::string::npos);
}

// A thread that hangs from a nozzle without flow, so viscous that inertia is nothing against weight and viscosity.
TEST(RecordedFields, TensionOfAHangingThreadIsTheWeightBelow)
{
  Simulation simulation = simulationOf(R"(
time: {step: 0.01}
record: {fields: [force, strain, curvature]}
threads:
  - name: pitch
    fluid: {density: 1000, viscosity: 1.0e5, surface_tension: 0.05}
    centerline: {straight: {from: [0, 0, 0], to: [0, 0, 0.4], edges: 20}}
    radius: 0.005
    ends: {newest: held}
)");
  runSteps(simulation, 5);
  const std::vector<FieldTable> tables = fieldTablesOf(simulation);
  ASSERT_EQ(tables.size(), 1u);
  EXPECT_EQ(tables[0].table, "thread_fields");
  EXPECT_EQ(tables[0].object, "pitch");
  const ThreadState& thread = simulation.state().threads[0].threads[0];
  const Eigen::VectorXd tension = column(tables[0], "tension [N]"), rate = column(tables[0], "stretch_rate [1/s]"),
                        radius = column(tables[0], "radius [m]");
  const Eigen::VectorXd flux = column(tables[0], "flux [m^3/s]"), kappa = column(tables[0], "curvature [1/m]"),
                        id = column(tables[0], "id");
  ASSERT_EQ(tension.size(), thread.nodes());
  double below = 0.0;
  for (int j = 0; j < thread.edges(); ++j)
  {
    // the balance of node j: what hangs below it is whole edges and half of its own on either side; surface tension of
    // the free end pulls up
    below += 9.81 * 1000 * 0.5 * (thread.volume[j] + (j > 0 ? thread.volume[j - 1] : 0.0));
    // the rates are those of a step that ends here: first order in time
    EXPECT_NEAR(tension[j], below, 2e-3 * 9.81 * 1000 * thread.totalVolume()) << j;
    EXPECT_NEAR(radius[j], thread.radius(j), 1e-15);
    EXPECT_NEAR(tension[j], 3 * 1e5 * M_PI * radius[j] * radius[j] * rate[j] + M_PI * 0.05 * radius[j], 1e-12);
    EXPECT_NEAR(id[j], static_cast<double>(thread.id[j]), 0.0);
  }
  EXPECT_LT(kappa.lpNorm<Eigen::Infinity>(), 1e-9);
  // it falls towards its oldest node: that is downstream, and positive
  EXPECT_GT(flux[0], 0.0);
  EXPECT_NEAR(flux[0], -thread.v[0].z() * M_PI * radius[0] * radius[0], 1e-9 * flux[0]);
  EXPECT_EQ(flux[thread.nodes() - 1], 0.0);   // held
}

TEST(RecordedFields, FluxOfAThreadIsThatOfTheNozzle)
{
  // fed slowly and in free air: near the nozzle the section has not changed yet, so that the flux is the flow
  Simulation simulation = simulationOf(R"(
time: {step: 0.002}
record: {fields: [strain]}
threads:
  - name: honey
    fluid: {density: 1400, viscosity: 100}
    nozzle: {position: [0, 0, 1], diameter: 0.01, flow: 2.0e-6}
)");
  runSteps(simulation, 100);
  const std::vector<FieldTable> tables = fieldTablesOf(simulation);
  ASSERT_EQ(tables.size(), 1u);
  const Eigen::VectorXd flux = column(tables[0], "flux [m^3/s]");
  EXPECT_NEAR(flux[flux.size() - 1], 2e-6, 0.1 * 2e-6);   // the last edge is still filling
}

TEST(RecordedFields, CurvatureOfAThreadIsThatOfItsArc)
{
  const Simulation simulation = simulationOf(R"(
record: {fields: [curvature]}
threads:
  - name: bow
    fluid: {viscosity: 10}
    centerline: {arc: {center: [0, 0, 0], start: [0.2, 0, 0], axis: [0, 0, 1], angle: 1.5, edges: 30}}
    radius: 0.005
)");
  const Eigen::VectorXd kappa = column(fieldTablesOf(simulation).at(0), "curvature [1/m]");
  EXPECT_EQ(kappa[0], 0.0);   // free ends carry none
  for (Eigen::Index i = 1; i + 1 < kappa.size(); ++i)
  {
    // on chords that turn by 1/20 rad, 2 tan(turn/2) / chord exceeds 1/R by the factor 1 + turn^2/8
    EXPECT_NEAR(kappa[i], 5.0, 5.0 * 1e-3);
  }
}

}   // namespace
}   // namespace slender
