#include "slender_sim/scene/reader.h"

#include <algorithm>

#include <gtest/gtest.h>

#include "slender_sim/scene/shapes.h"
#include "test/support/scenes.h"

namespace slender {
namespace {

using test::BadOverride;
using test::problemsOf;

const char* const good_scene = R"(# line 1
name: test
gravity: [0, 0, -9.81]
time: {step: 0.005, duration: 10, integrator: bdf2, newton: {tolerance: 1e-8}}
record: {every: 4}
wind: {velocity: [1, 2, 3]}
rods:
  - name: rope
    centerline: {straight: {from: [0, 0, 1], to: [1, 0, 1], edges: 10}}
    cross_section: {radius: 0.004}
    material: {density: 1100, youngs_modulus: 1.0e6, poissons_ratio: 0.45}
    damping: {mass: 0.1, stiffness: 1e-3, drag: 0.02}
    grasps:
      right: {edges: [-1], motion: {topic: true}}
      left: {edges: [0], motion: fixed}
      middle: {nodes: [5], hold: position, motion: {table: [[0, 0.5, 0, 1], [1, 0.5, 0, 2]]}}
)";

TEST(Reader, readsAScene)
{
  const SceneConfig scene = parseScene(good_scene);
  EXPECT_EQ(scene.name, "test");
  EXPECT_EQ(scene.source, good_scene);
  EXPECT_EQ(scene.time.integrator, Integrator::bdf2);
  EXPECT_EQ(scene.time.newton.tolerance, 1e-8);
  EXPECT_EQ(scene.record.every, 4);
  EXPECT_EQ(scene.wind, Eigen::Vector3d(1, 2, 3));
  ASSERT_EQ(scene.rods.size(), 1u);
  const RodConfig& rod = scene.rods[0];
  EXPECT_EQ(rod.name, "rope");
  EXPECT_EQ(rod.material.density, 1100);
  EXPECT_EQ(rod.damping.stiffness, 1e-3);
  ASSERT_EQ(rod.grasps.size(), 3u);
  EXPECT_EQ(rod.grasps[0].name, "right");   // file order, not alphabetical
  EXPECT_EQ(rod.grasps[0].first_node, 10);
  EXPECT_EQ(rod.grasps[0].last_node, 10);
  EXPECT_TRUE(std::holds_alternative<TopicMotion>(rod.grasps[0].motion));
  EXPECT_EQ(rod.grasps[1].first_node, 0);
  EXPECT_EQ(rod.grasps[1].last_node, 0);
  EXPECT_EQ(rod.grasps[2].first_node, 5);
  EXPECT_EQ(rod.grasps[2].hold, Hold::position);
  const auto& table = std::get<TableMotion>(rod.grasps[2].motion);
  EXPECT_EQ(table.poses.evaluate(0.5).position, Eigen::Vector3d(0.5, 0, 1.5));
}

TEST(Reader, aTinySceneHasDefaults)
{
  const SceneConfig scene = parseScene("rods:\n  - {}\n");
  ASSERT_EQ(scene.rods.size(), 1u);
  EXPECT_EQ(scene.rods[0].name, "rod");
  EXPECT_EQ(scene.time.step, 0.005);
  EXPECT_EQ(restNodes(scene.rods[0], scene.gravity).cols(), 51);
  EXPECT_EQ(rodSections(scene.rods[0], 50).size(), 50u);
}

class BadValue : public testing::TestWithParam<BadOverride>
{};

/// Each bad value on its own is refused, and the message holds the path, the value, and what would be allowed.
TEST_P(BadValue, isRefusedWithPathAndRange)
{
  const std::string message = problemsOf(good_scene, {GetParam().override_text});
  EXPECT_NE(message.find(GetParam().expected), std::string::npos) << GetParam().override_text << "\ngave: " << message;
  EXPECT_EQ(message.find('\n'), std::string::npos) << "more than one problem:\n" << message;
  // Where: the override itself, or the line of what it made wrong.
  EXPECT_TRUE(message.find("--set " + std::string(GetParam().override_text)) == 0 || message.find("test.yaml:") == 0)
      << message;
}

INSTANTIATE_TEST_SUITE_P(
    Time, BadValue,
    testing::Values(
        BadOverride{"time.step=0", "time.step = 0: is out of range; must be a number in (0, 10] s"},
        BadOverride{"time.step=-1", "in (0, 10] s"}, BadOverride{"time.step=10.5", "in (0, 10] s"},
        BadOverride{"time.step=.nan", "is not finite"}, BadOverride{"time.step=.inf", "is not finite"},
        BadOverride{"time.step=1e999", "is not finite"},
        BadOverride{"time.step=fast", "time.step = fast: is not a number"},
        BadOverride{"time.step=0x10", "is not a number"}, BadOverride{"time.step=[1]", "is a list; must be a number"},
        BadOverride{"time.step=", "is nothing; must be a number"}, BadOverride{"time.step=5 ms", "is not a number"},
        BadOverride{"time.duration=0", "in (0, 10000000] s"}, BadOverride{"time.duration=1e8", "in (0, 10000000] s"},
        BadOverride{"time.integrator=euler", "must be one of: implicit_euler, bdf2"},
        BadOverride{"time.integrator=bdf3", "did you mean bdf2?"}, BadOverride{"time.spectral_radius=1.1", "in [0, 1]"},
        BadOverride{"time.spectral_radius=-0.1", "in [0, 1]"}, BadOverride{"time.error_tolerance=-1", "in [0, 1] m"},
        BadOverride{"time.min_step=0", "in (0, 10] s"},
        BadOverride{"time.min_step=0.006", "is longer than time.step; must be in (0, 0.005] s"},
        BadOverride{"time.newton.tolerance=0.1", "in (1e-14, 0.1)"},
        BadOverride{"time.newton.tolerance=1e-14", "in (1e-14, 0.1)"},
        BadOverride{"time.newton.max_iterations=0", "in [1, 1000]"},
        BadOverride{"time.newton.max_iterations=2.5", "must be a whole number"},
        BadOverride{"time.newton.max_cuts=31", "in [0, 30]"}, BadOverride{"time.newton.max_cuts=-1", "in [0, 30]"},
        BadOverride{"time.newton.iterations=3", "unknown key (did you mean max_iterations?)"},
        BadOverride{"time.dt=0.1", "unknown key; known here: step, duration"}, BadOverride{"time=3", "must be a map"}));

INSTANTIATE_TEST_SUITE_P(
    Scene, BadValue,
    testing::Values(
        BadOverride{"gravity=-9.81", "must be a list [x, y, z]"}, BadOverride{"gravity=[0, -9.81]", "has 2 entries"},
        BadOverride{"gravity.2=1e10",
                    "gravity.2 = 1e10: is out of range; must be a number in [-1000000000, 1000000000] m/s^2"},
        BadOverride{"wind.velocity.0=2000", "in [-1000, 1000] m/s"}, BadOverride{"wind.speed=3", "unknown key"},
        BadOverride{"wind=[1, 0, 0]", "wind = [1, 0, 0]: is a list; must be a map"},
        BadOverride{"start=now", "must be one of: as_given, equilibrium"},
        BadOverride{"record.every=0", "in [1, 1000000000] steps"},
        BadOverride{"contact.self=true", "unknown key; known here: gap, slip_speed"},
        BadOverride{"contact.gap=0.001", "no rod, thread, or cloth with method: barrier takes part"},
        BadOverride{"threads=[]", "threads = []: has 0 entries; must have 1 to 10000"},
        BadOverride{"cloths=[]", "cloths = []: has 0 entries; must have 1 to 1000"},
        BadOverride{"tracked=[]", "tracked = []: has 0 entries; must have 1 to 1000"},
        BadOverride{"rod=[]", "unknown key (did you mean rods?)"}, BadOverride{"name=", "must be a text"},
        BadOverride{"rods=[]", "has 0 entries; must have 1 to 100000"}, BadOverride{"rods={}", "must be a list"}));

INSTANTIATE_TEST_SUITE_P(
    Curve, BadValue,
    testing::Values(
        BadOverride{"rods.0.centerline.straight.edges=1000001", "in [1, 1000000]"},
        BadOverride{"rods.0.centerline.straight.edges=0", "in [1, 1000000]"},
        BadOverride{"rods.0.centerline.straight.edges=1", "makes 1 edges; a rod needs at least 2"},
        BadOverride{"rods.0.centerline.straight.to=[0, 0, 1]", "from and to are the same point"},
        BadOverride{"rods.0.centerline.straight.to.1=1e7", "in [-1000000, 1000000] m"},
        BadOverride{"rods.0.centerline={}", "names 0 curves; must name one of: straight, polyline"},
        BadOverride{"rods.0.centerline={straight: {}, arc: {}}", "names 2 curves"},
        BadOverride{"rods.0.centerline={strait: {}}", "did you mean straight?"},
        BadOverride{"rods.0.centerline={polyline: {points: [[0, 0, 0]]}}", "has 1 entries"},
        BadOverride{"rods.0.centerline={polyline: {edges: 10}}", "points: is missing"},
        BadOverride{"rods.0.centerline={polyline: {points: [[0, 0, 0], [1, 0, 0], [1, 0, 0]]}}",
                    "nodes 1 and 2 are at the same place"},
        BadOverride{"rods.0.centerline={polyline: {points: [[0, 0, 0], [1, 0]]}}", "points.1 = [1, 0]: has 2 entries"},
        BadOverride{"rods.0.centerline={arc: {angle: 0}}", "must not be zero"},
        BadOverride{"rods.0.centerline={arc: {angle: 1.0e6}}", "rad"},
        BadOverride{"rods.0.centerline={arc: {axis: [0, 0, 0]}}", "axis = 0 0 0: must be a vector of non-zero"},
        BadOverride{"rods.0.centerline={arc: {start: [0, 0, 1]}}", "off the axis"},
        BadOverride{"rods.0.centerline={helix: {radius: 0}}", "in (0, 1000000] m"},
        BadOverride{"rods.0.centerline={helix: {turns: 0}}", "must not be zero"},
        BadOverride{"rods.0.centerline={catenary: {length: 0.5}}",
                    "length = 0.5: must be at least the distance of the ends"},
        BadOverride{"rods.0.centerline={catenary: {to: [0, 0, 0.5]}}", "not above or below"},
        BadOverride{"rods.0.centerline={trefoil: {length: 0.5}}", "length = 0.5: must be at least"},
        BadOverride{"rods.0.centerline={trefoil: {separation: 0.1}}", "a quarter of the radius"},
        BadOverride{"rods.0.centerline={trefoil: {up: [1, 0, 0]}}", "must be a vector not along axis"},
        BadOverride{"rods.0.centerline={torus_knot: {around: 3}}", "without a common divisor with around = 3"},
        BadOverride{"rods.0.centerline={torus_knot: {tube_radius: 0.1}}", "tube_radius = 0.1: must be in (0, 0.1 m)"},
        BadOverride{"rods.0.centerline={vee: {edges: 11}}", "edges = 11: must be even"},
        BadOverride{"rods.0.centerline={vee: {angle: 4}}", "in (0, 3.141592654) rad"},
        BadOverride{"rods.0.centerline={file: {path: nowhere.csv}}", "nowhere.csv: cannot be opened"},
        BadOverride{"rods.0.centerline={file: {edges: 3}}", "path: is missing"},
        BadOverride{"rods.0.initial={catenary: {length: 0.5}}", "rods.0.initial: length = 0.5: must be at least"},
        BadOverride{"rods.0.director=[1, 0, 0]", "is along the first edge"},
        BadOverride{"rods.0.initial_twist=1e6", "in [-100000, 100000] rad"},
        BadOverride{"rods.0.closed=maybe", "must be true or false"},
        BadOverride{"rods.0.name=left rope", "is not a name"}, BadOverride{"rods.0.name=1rope", "is not a name"},
        BadOverride{"rods.0.colour=red", "unknown key; known here: name"},
        BadOverride{"rods.0.material.youngs_moduls=1e6", "did you mean youngs_modulus?"}));

INSTANTIATE_TEST_SUITE_P(
    Material, BadValue,
    testing::Values(
        BadOverride{"rods.0.cross_section.radius=0", "in (0, 10] m"},
        BadOverride{"rods.0.cross_section.radius=-0.1",
                    "rods.0.cross_section.radius = -0.1: is out of range; must be a number in (0, 10] m"},
        BadOverride{"rods.0.cross_section.radius=[1, 2, 3]",
                    "has 3 entries; must have 1, 2 (a taper) or one per edge (10)"},
        BadOverride{"rods.0.cross_section.radius=[0.1, 0]", "radius.1 = 0"},
        BadOverride{"rods.0.cross_section.radius=[]", "has 0 entries"},
        BadOverride{"rods.0.cross_section={}", "must have either radius or ellipse"},
        BadOverride{"rods.0.cross_section.ellipse=[0.1, 0.2]", "must have either radius or ellipse"},
        BadOverride{"rods.0.cross_section={ellipse: [0.1]}", "has 1 entries; must have 2"},
        BadOverride{"rods.0.cross_section={ellipse: [0.1, [1, 2, 3]]}", "ellipse.1 = [1, 2, 3]: has 3 entries"},
        BadOverride{"rods.0.material.density=0", "in (0, 1000000] kg/m^3"},
        BadOverride{"rods.0.material.youngs_modulus=0", "in (0, 1e+15] Pa"},
        BadOverride{"rods.0.material.poissons_ratio=0.51", "in (-1, 0.5]"},
        BadOverride{"rods.0.material.poissons_ratio=-1", "in (-1, 0.5]"},
        BadOverride{"rods.0.material.torsion=round", "must be one of: polar, saint_venant"},
        BadOverride{"rods.0.material.linear_density=0", "kg/m"},
        BadOverride{"rods.0.material.stretch_modulus=-1", "in (0, 1e+15] N"},
        BadOverride{"rods.0.material.twist_modulus=0", "N m^2"}, BadOverride{"rods.0.material.bend_modulus=0", "N m^2"},
        BadOverride{"rods.0.material.bend_modulus=[1, 0]", "bend_modulus.1 = 0"},
        BadOverride{"rods.0.material.bend_modulus=[1, 2, 3]", "has 3 entries; must have 2"},
        BadOverride{"rods.0.material.bend_modulus=[[1, 2], [2, 1]]", "positive definite"},
        BadOverride{"rods.0.material.bend_modulus=[[1, 0.1], [0, 1]]", "symmetric"},
        BadOverride{"rods.0.damping.mass=-1", "in [0, 1000000] 1/s"},
        BadOverride{"rods.0.damping.stiffness=-1", "in [0, 1000] s"},
        BadOverride{"rods.0.curvature=angle", "must be one of: auto, tangent, compensated"},
        BadOverride{"rods.0.matched_to_arcs=1", "matched_to_arcs = 1"},
        BadOverride{"rods.0={naturally_straight: true, matched_to_arcs: true}", "has no arcs to match its joints to"},
        BadOverride{"rods.0.damping.drag=-1", "N s/m^2"}));

INSTANTIATE_TEST_SUITE_P(
    Grasp, BadValue,
    testing::Values(
        BadOverride{"rods.0.grasps.left={}", "must have either edges or nodes"},
        BadOverride{"rods.0.grasps.left.nodes=[1]", "must have either edges or nodes"},
        BadOverride{"rods.0.grasps.left.edges=[10]", "in [-10, 9]"},
        BadOverride{"rods.0.grasps.left.edges=[-11]", "in [-10, 9]"},
        BadOverride{"rods.0.grasps.left.edges=[]", "has 0 entries"},
        BadOverride{"rods.0.grasps.left.edges=[0, 2]", "must be consecutive"},
        BadOverride{"rods.0.grasps.left.edges=[0, 0]", "must be consecutive"},
        BadOverride{"rods.0.grasps.left.edges=[3..1]", "must be FIRST..LAST"},
        BadOverride{"rods.0.grasps.left.edges=[0..x]", "must be FIRST..LAST"},
        BadOverride{"rods.0.grasps.left.edges=[0..5]", "overlap"},
        BadOverride{"rods.0.grasps.left.edges=[9]", "overlaps grasp right"},
        BadOverride{"rods.0.grasps.left={nodes: [11]}", "in [-11, 10]"},
        BadOverride{"rods.0.grasps.left={nodes: [5]}", "overlap"},
        BadOverride{"rods.0.grasps.left.hold=tight", "must be one of: frame, position"},
        BadOverride{"rods.0.grasps.middle={edges: [4, 5], hold: position}", "holds 3 nodes; a point pin holds one"},
        BadOverride{"rods.0.grasps.left.attach=glue", "must be one of: section, initial"},
        BadOverride{"rods.0.grasps.left.motion=moving", "must be one of: fixed, topic"},
        BadOverride{"rods.0.grasps.left.motion={}", "must be fixed or one of"},
        BadOverride{"rods.0.grasps.left.motion={topic: false}", "must be true"},
        BadOverride{"rods.0.grasps.left.motion={topic: true, body: b}", "must be fixed or one of"},
        BadOverride{"rods.0.grasps.left.motion={file: nowhere.csv, body: b}", "nowhere.csv: cannot be opened"},
        BadOverride{"rods.0.grasps.left.attach=gripper",
                    "must be one of: section, initial; attach: Which point the poses of `motion` describe"},
        BadOverride{"rods.0.grasps.left.motion={file: nowhere.csv}", "nowhere.csv: cannot be opened"},
        BadOverride{"rods.0.grasps.left.motion={body: b, file: [1]}", "must be"},
        BadOverride{"rods.0.grasps.left.motion={table: []}", "has 0 entries"},
        BadOverride{"rods.0.grasps.left.motion={table: [[0, 1, 2]]}",
                    "has 3 numbers; must be [t, x, y, z, qx, qy, qz, qw]"},
        BadOverride{"rods.0.grasps.left.motion={table: [[0, 1, 2, 3]]}", "has 4 numbers"},
        BadOverride{"rods.0.grasps.left.motion={table: [[0, 0, 0, 0, 0, 0, 0, 2]]}",
                    "quaternion's length is 2; must be in [0.99, 1.01]"},
        BadOverride{"rods.0.grasps.left.motion={table: [[1, 0, 0, 0, 0, 0, 0, 1], [1, 0, 0, 0, 0, 0, 0, 1]]}",
                    "times must increase"},
        BadOverride{"rods.0.grasps.left.motion={table: [[0, 0, 0, 0, 0, 0, 0, 1], [1, 0, 0, 0, 0, 0, 1, 0]]}",
                    "turns by 180 degrees"},
        BadOverride{"rods.0.grasps.left.motion={table: [[.nan, 0, 0, 0, 0, 0, 0, 1]]}", "is not finite"},
        BadOverride{"rods.0.grasps.left.speed=1", "unknown key; known here: edges, nodes"}));

INSTANTIATE_TEST_SUITE_P(
    Path, BadValue,
    testing::Values(BadOverride{"rods.1.name=x", "'rods' is a list; '1' must be a whole number in [-1, 0]"},
                    BadOverride{"rods.first.name=x", "'first' must be a whole number"},
                    BadOverride{"rods.rope.material.density=0",
                                "material.density = 0: is out of range"},   // by its name
                    BadOverride{"rods.4e85.name=x", "'4e85' must be a whole number"},
                    BadOverride{"rods.-4e85.name=x", "'-4e85' must be a whole number"},
                    BadOverride{"rods.0.5.name=x", "unknown key"},
                    BadOverride{"time.step.size=1", "'time.step' is the single value '0.005' and has no part 'size'"},
                    BadOverride{"time..step=1", "empty part"}, BadOverride{"time.step", "must be PATH=VALUE"},
                    BadOverride{"=3", "must be PATH=VALUE"}, BadOverride{"time.step=[1, 2", "not valid YAML"}));

TEST(Reader, namesFileAndLine)
{
  std::string text = good_scene;
  text.replace(text.find("radius: 0.004"), 13, "radius: -4");
  EXPECT_EQ(problemsOf(text),
            "test.yaml:10: rods.0.cross_section.radius = -4: is out of range; must be a number in (0, 10] m");
}

TEST(Reader, reportsAllProblemsAtOnce)
{
  const std::string message =
      problemsOf(good_scene, {"time.step=-1", "rods.0.material.density=0", "rods.0.colour=red", "gravity=1"});
  EXPECT_EQ(std::count(message.begin(), message.end(), '\n'), 3) << message;
}

TEST(Reader, refusesWhatIsNotAScene)
{
  EXPECT_NE(problemsOf("").find("must be a map"), std::string::npos);
  EXPECT_NE(problemsOf("[1, 2]").find("must be a map"), std::string::npos);
  EXPECT_NE(problemsOf("{}").find("rods: is missing"), std::string::npos);
  EXPECT_EQ(problemsOf("rods: [\n").find("test.yaml:"), 0u);
  EXPECT_EQ(problemsOf("a: 1\nb: 2\na: 3\n"), "test.yaml:3: key 'a' is given twice");
  EXPECT_NE(problemsOf("rods: [{}]\n---\nrods: [{}]\n").find("more than one"), std::string::npos);
  EXPECT_NE(problemsOf(std::string(1000, '[')).find("test.yaml:1"), std::string::npos);
  EXPECT_NE(problemsOf("rods: &a [*a]\n").find("inside its own anchor"), std::string::npos);
  EXPECT_THROW(readScene("/nonexistent/scene.yaml"), SceneError);
  EXPECT_THROW(readScene("/"), SceneError);
}

TEST(Reader, refusesABillionAliases)
{
  std::string text = "a: &a0 [1, 1, 1, 1, 1, 1, 1, 1, 1, 1]\n";
  for (int k = 1; k < 12; ++k)
  {
    const std::string last = "*a" + std::to_string(k - 1);
    text += "b" + std::to_string(k) + ": &a" + std::to_string(k) + " [" + last;
    for (int j = 1; j < 10; ++j)
      text += ", " + last;
    text += "]\n";
  }
  EXPECT_NE(problemsOf(text).find("more than"), std::string::npos);
}

TEST(Reader, refusesRepeatedNames)
{
  const std::string two = "rods:\n  - {name: a, grasps: {g: {edges: [0]}}}\n  - {name: a, grasps: {h: {edges: [0]}}}\n";
  EXPECT_NE(problemsOf(two).find("test.yaml:3: rods.1.name = a: is also the name of rods.0"), std::string::npos)
      << problemsOf(two);
  EXPECT_EQ(problemsOf(two, {"rods.1.name=b"}), "");
  const std::string same =
      "rods:\n  - {name: a, grasps: {g: {edges: [0]}}}\n  - {name: b, grasps: {g: {edges: [0]}}}\n";
  EXPECT_NE(problemsOf(same).find("rods.1.grasps.g: has the same name as rods.0.grasps.g"), std::string::npos)
      << problemsOf(same);
  EXPECT_NE(problemsOf("rods: [{grasps: {left-hand: {edges: [0]}}}]").find("is not a name"), std::string::npos);
  EXPECT_NE(problemsOf("rods: [{broadcast_tf: {left-end: 0}}]").find("is not a name"), std::string::npos);
  EXPECT_NE(problemsOf("rods: [{broadcast_tf: {end: 51}}]").find("in [-51, 50]"), std::string::npos);
}

TEST(Reader, overridesCreateChangeAndAreWrittenOut)
{
  const SceneConfig scene =
      parseScene(good_scene, "test.yaml",
                 {"rods.0.material.youngs_modulus=1e7", "rods.-1.closed=false", "time.newton.max_cuts=3",
                  "gravity=[0, 1, 0]", "rods.0.grasps.extra={nodes: [2]}"});
  EXPECT_EQ(scene.rods[0].material.youngs_modulus, 1e7);
  EXPECT_EQ(scene.time.newton.max_cuts, 3);
  EXPECT_EQ(scene.gravity, Eigen::Vector3d(0, 1, 0));
  ASSERT_EQ(scene.rods[0].grasps.size(), 4u);
  const SceneConfig again = parseScene(scene.source);
  EXPECT_EQ(again.rods[0].material.youngs_modulus, 1e7);
  EXPECT_EQ(again.rods[0].grasps[3].name, "extra");
  EXPECT_EQ(again.time.integrator, Integrator::bdf2);
}

TEST(Reader, overridingOneAliasLeavesTheOther)
{
  const SceneConfig scene =
      parseScene("rods:\n  - {name: a, material: &m {density: 2000}}\n  - {name: b, material: *m}\n", "t",
                 {"rods.1.material.density=3000"});
  EXPECT_EQ(scene.rods[0].material.density, 2000);
  EXPECT_EQ(scene.rods[1].material.density, 3000);
}

TEST(Reader, readsNumbersInEveryUsualForm)
{
  for (const char* text : {"1e6", "1E6", "1000000", "+1.0e+6", "'1e6'", "1000000.0"})
  {
    EXPECT_EQ(parseScene(good_scene, "t", {std::string("rods.0.material.youngs_modulus=") + text})
                  .rods[0]
                  .material.youngs_modulus,
              1e6)
        << text;
  }
}

TEST(Reader, sectionsThatAreFramesOfTf)
{
  const std::string rod = "rods: [{centerline: {straight: {from: [0, 0, 0], to: [1, 0, 0], edges: 4}}, broadcast_tf: ";
  const std::vector<SectionFrame> frames = parseScene(rod + "{tip: -1, two: 2}}]").rods[0].broadcast_tf;
  ASSERT_EQ(frames.size(), 2u);
  EXPECT_EQ(frames[0].name, "tip");
  EXPECT_EQ(frames[0].node, 4);
  EXPECT_EQ(frames[1].node, 2);
}

TEST(Reader, resolvesGraspedNodes)
{
  const auto held = [](const std::string& grasp, const std::string& closed = "false") {
    const GraspConfig g = parseScene("rods: [{centerline: {arc: {angle: 3.0, edges: 10}}}]", "t",
                                     {"rods.0.closed=" + closed, "rods.0.grasps.g=" + grasp})
                              .rods[0]
                              .grasps[0];
    return std::make_pair(g.first_node, g.last_node);
  };
  EXPECT_EQ(held("{edges: [0]}"), std::make_pair(0, 0));
  EXPECT_EQ(held("{edges: [-1]}"), std::make_pair(10, 10));
  EXPECT_EQ(held("{edges: [9]}"), std::make_pair(10, 10));
  EXPECT_EQ(held("{edges: [4]}"), std::make_pair(4, 5));
  EXPECT_EQ(held("{edges: [0, 1]}"), std::make_pair(0, 2));
  EXPECT_EQ(held("{edges: [-1, -2]}"), std::make_pair(8, 10));
  EXPECT_EQ(held("{edges: [2..5]}"), std::make_pair(2, 6));
  EXPECT_EQ(held("{nodes: [3]}"), std::make_pair(3, 3));
  EXPECT_EQ(held("{nodes: [3..5]}"), std::make_pair(3, 5));
  EXPECT_EQ(held("{edges: [0]}", "true"), std::make_pair(0, 1));
  EXPECT_THROW(held("{edges: [-1]}", "true"), SceneError);
}

TEST(Reader, readsHowJointsAreMade)
{
  const RodConfig plain = parseScene("rods:\n  - {}\n").rods[0];
  EXPECT_TRUE(plain.automatic_curvature);
  EXPECT_FALSE(plain.joints.matched_to_arcs);
  const RodConfig rod =
      parseScene("rods:\n  - {curvature: compensated, matched_to_arcs: true, centerline: {arc: {}}}\n").rods[0];
  EXPECT_EQ(rod.joints.curvature, Curvature::compensated);
  EXPECT_FALSE(rod.automatic_curvature);
  EXPECT_TRUE(parseScene("rods:\n  - {curvature: auto}\n").rods[0].automatic_curvature);
  const RodConfig natural =
      parseScene("rods:\n  - {rest_twist: [1, 2, 3], natural_curvature: [4, 5], centerline: {straight: {edges: 4}}}\n")
          .rods[0];
  EXPECT_EQ(natural.rest_twist, (std::vector<double>{1, 2, 3}));
  ASSERT_EQ(natural.natural_curvature.size(), 1u);
  EXPECT_EQ(natural.natural_curvature[0], Eigen::Vector2d(4, 5));
  EXPECT_TRUE(rod.joints.matched_to_arcs);
}

TEST(Reader, warnsWhereContactReplacesAShape)
{
  const auto warnings = [](const std::string& section, const std::string& contact) {
    return parseScene("rods:\n  - {name: strap, cross_section: " + section + ", contact: " + contact + "}\n",
                      "test.yaml")
        .warnings;
  };
  const auto flat = warnings("{ellipse: [0.02, 0.005]}", "{}");
  ASSERT_EQ(flat.size(), 1u);
  for (const char* part : {"test.yaml:2: rods.0.cross_section: ", "rod strap", "half-axes 0.02 m and 0.005 m",
                           "circle of the larger half-axis, 0.02 m"})
    EXPECT_NE(flat[0].find(part), std::string::npos) << part << " is not in: " << flat[0];
  const auto tapered = warnings("{ellipse: [[0.02, 0.01], [0.01]]}", "{}");   // a taper towards a circle
  ASSERT_EQ(tapered.size(), 1u);
  EXPECT_NE(tapered[0].find("half-axes 0.02 m and 0.01 m"), std::string::npos) << tapered[0];
  EXPECT_TRUE(warnings("{ellipse: [0.01, 0.01]}", "{}").empty());
  EXPECT_TRUE(warnings("{radius: 0.01}", "{}").empty());
  // touches nothing
  EXPECT_TRUE(parseScene("rods:\n  - {cross_section: {ellipse: [0.02, 0.005]}}\n").warnings.empty());
}

TEST(Reader, warnsOnceOfTheRodsOfAGenerator)
{
  const auto warnings =
      parseScene("generate:\n  - hair: {strands: 20, edges: 5, cross_section: {ellipse: [4e-5, 8e-5]}, contact: {}}\n")
          .warnings;
  ASSERT_EQ(warnings.size(), 1u);
  EXPECT_NE(warnings[0].find("rod hair has elliptical sections"), std::string::npos) << warnings[0];
}

TEST(Reader, moduliThatAreLeftOutFollowOnlyFromAStatedYoungsModulus)
{
  const auto read = [](const std::string& material) {
    return parseScene("rods:\n  - {material: " + material + "}\n", "test.yaml");
  };
  const auto problem = [](const std::string& material) {
    return problemsOf("rods:\n  - {material: " + material + "}\n");
  };
  EXPECT_EQ(problem("{bend_modulus: 1}"),
            "test.yaml:2: rods.0.material: gives bend_modulus but not stretch_modulus, twist_modulus; give these too, "
            "or youngs_modulus (and "
            "poissons_ratio), from which the rest follows with the cross-section");
  EXPECT_NE(problem("{stretch_modulus: 1, bend_modulus: 1, poissons_ratio: 0.3}")
                .find("but not twist_modulus; give this too, or youngs_modulus"),
            std::string::npos);
  EXPECT_NE(problem("{twist_modulus: 1}").find("but not stretch_modulus, bend_modulus;"), std::string::npos);
  EXPECT_TRUE(read("{bend_modulus: 1, youngs_modulus: 1e5}").warnings.empty());
  EXPECT_TRUE(read("{bend_modulus: 1, twist_modulus: 1, stretch_modulus: 1}").warnings.empty());
  EXPECT_TRUE(read("{density: 1}").warnings.empty());
  const auto unused = read("{bend_modulus: 1, twist_modulus: 1, stretch_modulus: 1, youngs_modulus: 1e5}").warnings;
  ASSERT_EQ(unused.size(), 1u);
  EXPECT_NE(unused[0].find("rods.0.material.youngs_modulus = 1e5: has no effect"), std::string::npos) << unused[0];
}

TEST(Reader, readsModuliInEveryForm)
{
  const auto bend = [](const std::string& value) {
    return *parseScene(good_scene, "t", {"rods.0.material.bend_modulus=" + value}).rods[0].material.bend_modulus;
  };
  EXPECT_EQ(bend("2"), (Eigen::Matrix2d() << 2, 0, 0, 2).finished());
  EXPECT_EQ(bend("[2, 3]"), (Eigen::Matrix2d() << 2, 0, 0, 3).finished());
  EXPECT_EQ(bend("[[2, 1], [1, 3]]"), (Eigen::Matrix2d() << 2, 1, 1, 3).finished());
}

}   // namespace
}   // namespace slender
