// Edits of a scene that runs: what stays goes on to the last bit, what is new starts as its text says, and what does
// not fit is refused.
#include "slender_sim/scene/scene_edit.h"

#include <algorithm>
#include <filesystem>
#include <set>
#include <string>

#include <gtest/gtest.h>

#include "slender_sim/scene/reader.h"
#include "slender_sim/scene/state_bytes.h"
#include "test/support/scenes.h"
#include "test/support/shipped_scenes.h"

namespace slender {
namespace {

using test::runSteps;
using Kind = SceneEdit::Kind;
using Running = std::unique_ptr<Simulation>;

/// A rope between two grasps with contact, a cable without any, and a body that is welded to it.
const char* const ropes = R"(
time: {step: 0.005}
rods:
  - name: rope
    centerline: {straight: {from: [0, 0, 1], to: [1, 0, 1], edges: 20}}
    cross_section: {radius: 0.01}
    material: {density: 1000, youngs_modulus: 1e6}
    damping: {mass: 1, stiffness: 0.002}
    contact: {}
    grasps: {left: {edges: [0]}, right: {edges: [-1], motion: {topic: true}}}
  - name: cable
    centerline: {straight: {from: [0, 1, 1], to: [0.4, 1, 1], edges: 12}}
    material: {density: 1000, youngs_modulus: 1e7}
    damping: {stiffness: 0.003}
    grasps: {end: {edges: [0]}}
bodies:
  - {name: plug, mass: 0.05, inertia: [1e-5, 1e-5, 1e-5], pose: {position: [0.41, 1, 1]}, welds: [{rod: cable, edge: -1}]}
)";

const char* const sheet = R"(
time: {step: 0.005}
cloths:
  - name: sheet
    grid: {corner: [0, 0, 0], sides: [[0.4, 0, 0], [0, 0.4, 0]], cells: [8, 8]}
    material: {area_density: 0.2, youngs_modulus: 1e5, thickness: 0.001}
    contact: {}
    grasps: {left: {edge: left}}
)";

Running make(const std::string& text) { return std::make_unique<Simulation>(parseScene(text, "t.yaml")); }

void edit(Running& running, Kind kind, const std::string& text) { running = editedSimulation(*running, {kind, text}); }

std::string bytes(const Simulation& simulation) { return stateBytes(simulation.state()); }

int rodNamed(const Simulation& simulation, const std::string& name)
{
  const auto& rods = simulation.config().rods;
  const auto found = std::find_if(rods.begin(), rods.end(), [&](const RodConfig& rod) { return rod.name == name; });
  EXPECT_NE(found, rods.end()) << name;
  return static_cast<int>(found - rods.begin());
}

const RodState& rod(const Simulation& simulation, const std::string& name)
{
  return simulation.state().rods[static_cast<std::size_t>(rodNamed(simulation, name))];
}

/// What the edit is refused with. The run must go on untouched.
std::string refusal(const Simulation& running, Kind kind, const std::string& text)
{
  const std::string before = bytes(running);
  try
  {
    editedSimulation(running, {kind, text});
  }
  catch (const SceneError& error)
  {
    EXPECT_TRUE(bytes(running) == before);
    return error.what();
  }
  return "not refused";
}

#define EXPECT_REFUSED(running, kind, text, why) \
  EXPECT_NE(refusal(running, kind, text).find(why), std::string::npos) << refusal(running, kind, text)

std::vector<std::string> lightScenes()
{
  // seconds per step, or only by statics
  const std::set<std::string> heavy{"hair", "skirt", "sweater"};
  std::vector<std::string> names;
  for (const std::string& name : test::shippedScenes())
    if (!heavy.count(name))
      names.push_back(name);
  return names;
}

class EditedShippedScene : public testing::TestWithParam<std::string>
{};

// All kinds of objects, of grasps, and of memory that integrators have.
TEST_P(EditedShippedScene, goesOnToTheLastBit)
{
  const std::string path = test::kSceneFolder + GetParam() + ".yaml";
  SceneConfig config = readScene(path);
  Running edited = std::make_unique<Simulation>(config, false), untouched = std::make_unique<Simulation>(config, false);
  runSteps(*edited, 3);
  runSteps(*untouched, 3);
  char wind[120];
  std::snprintf(wind, sizeof wind, "wind.velocity=[%.17g, %.17g, %.17g]", config.wind.x(), config.wind.y(),
                config.wind.z());
  edit(edited, Kind::set_parameter, wind);
  ASSERT_TRUE(bytes(*edited) == bytes(*untouched));
  runSteps(*edited, 3);
  runSteps(*untouched, 3);
  ASSERT_TRUE(bytes(*edited) == bytes(*untouched));
  edit(edited, Kind::spawn, "bodies: {name: far_away, pose: {position: [1000, 0, 0]}, motion: fixed}");
  runSteps(*edited, 2);
  runSteps(*untouched, 2);
  edit(edited, Kind::remove, "far_away");
  EXPECT_TRUE(bytes(*edited) == bytes(*untouched));
  edited->reset();
  untouched->reset();
  EXPECT_TRUE(bytes(*edited) == bytes(*untouched));
}

INSTANTIATE_TEST_SUITE_P(All, EditedShippedScene, testing::ValuesIn(lightScenes()),
                         [](const auto& info) { return info.param; });

TEST(SceneEdit, theSameValueChangesNothing)
{
  for (const char* integrator : {"implicit_euler", "bdf2", "tr_bdf2"})
  {
    Running edited = make(ropes + std::string("start: as_given\n")), untouched;
    const std::vector<std::string> choice{std::string("time.integrator=") + integrator};
    edited = std::make_unique<Simulation>(parseScene(ropes, "t.yaml", choice));
    untouched = std::make_unique<Simulation>(parseScene(ropes, "t.yaml", choice));
    runSteps(*edited, 20);
    runSteps(*untouched, 20);
    edit(edited, Kind::set_parameter, "rods.rope.material.youngs_modulus=1e6\nrods.1.damping.stiffness=0.003\n");
    runSteps(*edited, 20);
    runSteps(*untouched, 20);
    EXPECT_TRUE(bytes(*edited) == bytes(*untouched)) << integrator;
  }
}

TEST(SceneEdit, whatIsSpawnedFarAwayChangesNothingElse)
{
  Running edited = make(ropes), untouched = make(ropes);
  runSteps(*edited, 10);
  runSteps(*untouched, 10);
  edit(edited, Kind::spawn, R"(
rods:
  - centerline: {straight: {from: [0, 20, 1], to: [1, 20, 1], edges: 10}}
    material: {density: 1000, youngs_modulus: 1e6}
    cross_section: {radius: 0.002}   # the default gap would follow from it
    contact: {}
bodies: {name: ball, shape: {sphere: {radius: 0.05}}, mass: 0.1, pose: {position: [0, 30, 5]}}
obstacles: [{name: table, shape: {plane: {point: [0, 0, -9], normal: [0, 0, 1]}}}]
)");
  ASSERT_EQ(edited->config().rods.size(), 3u);
  EXPECT_EQ(edited->config().contact.gap, untouched->config().contact.gap);
  EXPECT_EQ(edited->config().time.integrator, untouched->config().time.integrator);
  EXPECT_EQ(edited->state().steps, 10u);
  runSteps(*edited, 20);
  runSteps(*untouched, 20);
  for (const char* name : {"rope", "cable"})
    EXPECT_TRUE(stateBytes(rod(*edited, name)) == stateBytes(rod(*untouched, name))) << name;
  EXPECT_TRUE(edited->state().bodies[0].X_WB.position == untouched->state().bodies[0].X_WB.position);
  // implicit Euler from rest, n steps: g h^2 n (n + 1) / 2
  EXPECT_NEAR(edited->state().bodies[1].X_WB.position.z(), 5 - 9.81 * 0.005 * 0.005 * 20 * 21 / 2, 1e-9);

  edit(edited, Kind::remove, "ball");
  edit(edited, Kind::remove, "table");
  edit(edited, Kind::remove, "rod2");
  EXPECT_TRUE(bytes(*edited) == bytes(*untouched));
  runSteps(*edited, 20);
  runSteps(*untouched, 20);
  EXPECT_TRUE(bytes(*edited) == bytes(*untouched));
}

TEST(SceneEdit, spawnsFirstObjectsOfAKindAndRemovesFirstOnes)
{
  Running edited = make(ropes);
  runSteps(*edited, 10);
  const RodState before = rod(*edited, "cable");
  edit(edited, Kind::set_parameter, "contact.gap=0.0005");   // of which nothing is left below
  edit(edited, Kind::remove, "rope");
  ASSERT_EQ(edited->config().rods.size(), 1u);
  EXPECT_TRUE(stateBytes(rod(*edited, "cable")) == stateBytes(before));
  runSteps(*edited, 3);
  edit(edited, Kind::spawn, "rods: {name: rope, centerline: {straight: {from: [0, 0, 2], to: [1, 0, 2], edges: 7}}}");
  EXPECT_EQ(rod(*edited, "rope").x.cols(), 8);
  EXPECT_EQ(rod(*edited, "rope").x.col(3).z(), 2.0);   // as its text says
  runSteps(*edited, 3);
  EXPECT_LT(rod(*edited, "rope").x.col(3).z(), 2.0);
}

TEST(SceneEdit, aSpawnedBallFallsOnTheRope)
{
  Running edited = make(ropes), untouched = make(ropes);
  runSteps(*edited, 60);
  runSteps(*untouched, 60);
  const double sag = rod(*edited, "rope").x.row(2).minCoeff();
  ASSERT_LT(sag, 0.99);
  char place[80];
  std::snprintf(place, sizeof place, "[0.5, 0, %.3f]", sag + 0.1);
  edit(edited, Kind::spawn,
       std::string("bodies: [{name: ball, shape: {sphere: {radius: 0.04}}, mass: 0.3, pose: {position: ") + place +
           "}}]");
  runSteps(*edited, 40);
  runSteps(*untouched, 40);
  const double ball = edited->state().bodies[1].X_WB.position.z(), rope = rod(*edited, "rope").x.col(10).z();
  EXPECT_LT(rope, rod(*untouched, "rope").x.col(10).z() - 0.01);   // pushed down
  EXPECT_GT(ball - rope, 0.045);                                   // the radii are 0.05 together
  EXPECT_TRUE(stateBytes(rod(*edited, "cable")) == stateBytes(rod(*untouched, "cable")));
}

TEST(SceneEdit, refusesWhatCrossesNowAndNotWhatCrossedAtTheStart)
{
  Running edited = make(ropes);
  runSteps(*edited, 100);
  const double sag = rod(*edited, "rope").x.col(10).z();
  ASSERT_LT(sag, 0.92);
  const auto ball = [](double z) {
    return "bodies: {name: ball, shape: {sphere: {radius: 0.02}}, pose: {position: [0.5, 0, " + std::to_string(z) +
           "]}, mass: 0.1}";
  };
  EXPECT_REFUSED(*edited, Kind::spawn, ball(sag), "ball");
  edit(edited, Kind::spawn, ball(1.0));   // where the rope was at the start
  runSteps(*edited, 5);
  const std::string before = bytes(*edited);
  EXPECT_THROW(edited->reset(), SceneError);
  EXPECT_TRUE(bytes(*edited) == before);
  edit(edited, Kind::remove, "ball");
  edited->reset();
  EXPECT_EQ(rod(*edited, "rope").x.col(10).z(), 1.0);
}

TEST(SceneEdit, resetsToTheStartOfTheEditedScene)
{
  Running edited = make(ropes);
  runSteps(*edited, 10);
  edit(edited, Kind::spawn,
       "bodies: {name: ball, shape: {sphere: {radius: 0.02}}, mass: 1, pose: {position: [3, 3, 3]}}");
  edit(edited, Kind::attach, "rope: {middle: {nodes: [10], hold: position}}");
  runSteps(*edited, 10);
  edited->reset();
  EXPECT_EQ(edited->state().steps, 0u);
  EXPECT_EQ(edited->state().bodies[1].X_WB.position.z(), 3.0);
  const RodState& rope = rod(*edited, "rope");
  EXPECT_EQ(rope.x.col(10).z(), 1.0);
  EXPECT_EQ(rope.grasps[2].X_WG.position.z(), 1.0);
  runSteps(*edited, 5);
  EXPECT_NEAR(rod(*edited, "rope").x.col(10).z(), 1.0, 1e-12);   // held there
}

TEST(SceneEdit, attachesWhereTheRopeIsNowAndDetaches)
{
  Running edited = make(ropes);
  runSteps(*edited, 60);
  const RodState before = rod(*edited, "rope");
  edit(edited, Kind::attach, "rope: {hand: {nodes: [9, 10], motion: {topic: true}}}");
  const std::size_t hand = 2;
  EXPECT_EQ(edited->grasps()[hand].config->name, "hand");
  EXPECT_TRUE(rod(*edited, "rope").x == before.x);
  EXPECT_TRUE(rod(*edited, "rope").v == before.v);
  const Pose held = edited->grasps().pose(hand);
  EXPECT_LT((held.position - 0.5 * (before.x.col(9) + before.x.col(10))).norm(), 1e-12);
  for (int k = 0; k < 40; ++k)
  {
    SceneInputs inputs = edited->defaultInputs();
    inputs.grasps[hand].X_WG.position.z() += 0.002;
    const StepReport report = edited->step(inputs);
    ASSERT_TRUE(report.ok) << report.message;
  }
  EXPECT_NEAR(edited->grasps().pose(hand).position.z(), held.position.z() + 0.08, 1e-9);
  EXPECT_NEAR(0.5 * (rod(*edited, "rope").x.col(9) + rod(*edited, "rope").x.col(10)).z(), held.position.z() + 0.08,
              1e-6);
  EXPECT_GT(edited->grasps().wrench(hand).force.norm(), 0.1);
  EXPECT_REFUSED(*edited, Kind::attach, "rope: {other: {nodes: [10, 11]}}", "grasp hand");
  EXPECT_REFUSED(*edited, Kind::attach, "rope: {hand: {nodes: [3]}}", "has a grasp hand already");
  edit(edited, Kind::detach, "hand");
  EXPECT_EQ(edited->grasps().size(), 3u);   // left, right, end
  runSteps(*edited, 20);
  EXPECT_LT(rod(*edited, "rope").x.col(9).z(), held.position.z() + 0.07);
}

TEST(SceneEdit, keepsGraspsThatWereMovedOrReleased)
{
  Running edited = make(ropes), untouched = make(ropes);
  for (const Running* one : {&edited, &untouched})
  {
    runSteps(**one, 20);
    (*one)->grasps().release(0);
    (*one)->grasps().attach(0, 4, 6, Hold::frame);
    (*one)->grasps().release(1);
    runSteps(**one, 5);
  }
  edit(edited, Kind::set_parameter, "wind.velocity=[0, 0, 0]");
  EXPECT_FALSE(edited->grasps().isActive(1));
  EXPECT_EQ(rod(*edited, "rope").grasps[0].first_node, 4);
  runSteps(*edited, 20);
  runSteps(*untouched, 20);
  EXPECT_TRUE(bytes(*edited) == bytes(*untouched));
  EXPECT_REFUSED(*edited, Kind::attach, "rope: {hand: {nodes: [5]}}", "overlap grasp left, which holds 4 to 6");
}

TEST(SceneEdit, graspsOfClothTakeHoldWhereItIs)
{
  Running edited = make(sheet);
  runSteps(*edited, 60);
  const ClothState before = edited->state().cloths[0];
  ASSERT_LT(before.x.row(2).minCoeff(), -0.01);
  edit(edited, Kind::attach, "sheet: {hand: {edge: right, motion: {topic: true}}}");
  EXPECT_TRUE(edited->state().cloths[0].x == before.x);
  EXPECT_EQ(edited->state().cloths[0].pins.size(), 18u);
  const double z = edited->grasps().pose(1).position.z();
  EXPECT_LT(z, -0.01);
  runSteps(*edited, 20);
  EXPECT_NEAR(edited->grasps().pose(1).position.z(), z, 1e-12);
  edit(edited, Kind::detach, "hand");
  EXPECT_EQ(edited->state().cloths[0].pins.size(), 9u);
  const Eigen::Matrix3Xd held = edited->state().cloths[0].x;
  runSteps(*edited, 20);
  EXPECT_GT((edited->state().cloths[0].x.col(8) - held.col(8)).norm(), 0.01);   // a corner of the right edge
}

TEST(SceneEdit, setsWhatMayChange)
{
  Running soft = make(ropes), same = make(ropes);
  runSteps(*soft, 40);
  runSteps(*same, 40);
  edit(soft, Kind::set_parameter,
       "rods.rope.material.youngs_modulus=1e5\nwind.velocity=[0, 3, 0]\n"
       "rods.cable.damping={mass: 20, drag: 0.1}");
  EXPECT_EQ(soft->config().rods[0].material.youngs_modulus, 1e5);
  EXPECT_EQ(soft->defaultInputs().wind.y(), 3.0);
  EXPECT_TRUE(rod(*soft, "rope").x == rod(*same, "rope").x);
  runSteps(*soft, 20);
  runSteps(*same, 20);
  EXPECT_LT(rod(*soft, "rope").x.row(2).minCoeff(), rod(*same, "rope").x.row(2).minCoeff() - 0.005);   // softer
  EXPECT_GT(rod(*soft, "cable").x.col(12).y(), rod(*same, "cable").x.col(12).y() + 1e-3);              // blown away
  // and back again
  edit(soft, Kind::set_parameter, "rods.rope.material.youngs_modulus=1e6");
  EXPECT_EQ(soft->rodModel(0).stretch_modulus, same->rodModel(0).stretch_modulus);
}

TEST(SceneEdit, clothMeetsASpawnedBallOnceItsContactIsTheBarrier)
{
  std::string text = sheet;
  text.replace(text.find("{left: {edge: left}}"), 20, "{left: {edge: left}, right: {edge: right}}");
  Running edited = make(text);
  runSteps(*edited, 20);
  const std::string ball =
      "bodies: [{name: ball, shape: {sphere: {radius: 0.03}}, mass: 0.02, pose: {position: [0.2, 0.2, "
      "0.05]}}]";
  EXPECT_REFUSED(*edited, Kind::spawn, ball, "contact: {method: barrier}");   // its method does not change by itself
  edit(edited, Kind::set_parameter, "cloths.sheet.contact.method=barrier");
  edit(edited, Kind::spawn, ball);
  runSteps(*edited, 60);
  EXPECT_GT(edited->state().bodies[0].X_WB.position.z(), -0.1);   // free fall: -0.4
}

/// A body repels what it started near to within that distance, and what it came near to later within the gap; edits
/// and resets change nothing about that.
TEST(SceneEdit, bodiesKeepTheRangesWithWhichTheyStarted)
{
  Running edited = make(R"(
time: {step: 0.005}
contact: {gap: 0.001}
bodies:
  - {name: near, mass: 1, shape: {box: {size: [0.1, 0.1, 0.1]}}, pose: {position: [0, 0, 0.05001]}}
  - {name: far, mass: 1, shape: {box: {size: [0.1, 0.1, 0.1]}}, pose: {position: [0.3, 0, 0.052]}}
obstacles:
  - {name: floor, shape: {plane: {}}}
)");
  const auto share = [&](int body) {
    const std::vector<ContactRange>& ranges = edited->state().contact.bodies[static_cast<std::size_t>(body)].ranges;
    return ranges.size() == 1 ? ranges[0].share : static_cast<double>(ranges.size());
  };
  EXPECT_NEAR(share(0), 0.01, 1e-6);
  EXPECT_EQ(share(1), 0.0);
  const double start = share(0);
  runSteps(*edited, 100);
  const double height = edited->state().bodies[1].X_WB.position.z();
  for (int k = 0; k < 3; ++k)
  {
    edit(edited, Kind::spawn,
         "bodies: [{name: ball, shape: {sphere: {radius: 0.03}}, mass: 0.02, pose: {position: [0, 2, 0.03002]}}]");
    EXPECT_NEAR(share(2), 0.02, 1e-6);
    runSteps(*edited, 20);
    EXPECT_EQ(share(0), start);
    EXPECT_EQ(share(1), 0.0);
    edit(edited, Kind::remove, "ball");
  }
  EXPECT_EQ(share(0), start);
  EXPECT_NEAR(edited->state().bodies[1].X_WB.position.z(), height, 1e-6);
  edit(edited, Kind::set_parameter, "contact.gap=0.002");
  EXPECT_DOUBLE_EQ(share(0), 0.5 * start);
  edited->reset();
  EXPECT_DOUBLE_EQ(share(0), 0.5 * start);
  EXPECT_EQ(share(1), 0.0);
}

TEST(SceneEdit, bodiesAreWeldedToRodsThatMove)
{
  Running edited = make(ropes), untouched = make(ropes);
  runSteps(*edited, 30);
  runSteps(*untouched, 30);
  const Eigen::Vector3d middle = rod(*edited, "rope").x.col(10);
  char place[100];
  std::snprintf(place, sizeof place, "[%.4f, %.4f, %.4f]", middle.x(), middle.y(), middle.z() - 0.05);
  edit(edited, Kind::spawn,
       std::string("bodies: {name: weight, mass: 0.5, inertia: [1e-4, 1e-4, 1e-4], pose: {position: ") + place +
           "}, welds: [{rod: rope, edge: 9}]}");
  ASSERT_EQ(rod(*edited, "rope").grasps.size(), 3u);
  runSteps(*edited, 20);
  EXPECT_LT(rod(*edited, "rope").x.col(10).z(), middle.z() - 0.01);
  EXPECT_NEAR((edited->state().bodies[1].X_WB.position - rod(*edited, "rope").x.col(10)).norm(), 0.05, 0.01);
  EXPECT_THROW(edited->reset(), SceneError);   // where the scene starts the two are not together
  // an edit in between leaves the weld where it is
  runSteps(*untouched, 20);
  EXPECT_TRUE(stateBytes(rod(*edited, "cable")) == stateBytes(rod(*untouched, "cable")));
  Running again = editedSimulation(*edited, {Kind::set_parameter, "wind.velocity=[0, 0, 0]"});
  runSteps(*edited, 10);
  runSteps(*again, 10);
  EXPECT_TRUE(bytes(*edited) == bytes(*again));
  EXPECT_REFUSED(*edited, Kind::remove, "rope", "rope");
  edit(edited, Kind::remove, "weight");
  EXPECT_EQ(rod(*edited, "rope").grasps.size(), 2u);
  runSteps(*edited, 5);
  edited->reset();
}

TEST(SceneEdit, graspsFollowABodyThatIsSpawnedWithoutAJump)
{
  Running edited = make(ropes);
  runSteps(*edited, 10);
  edit(edited, Kind::attach, "rope: {hand: {nodes: [10], motion: {body: gripper}}}");
  const Pose before = edited->grasps().pose(2);
  edit(edited, Kind::spawn,
       "obstacles: {name: gripper, shape: {sphere: {radius: 0.01}}, motion: {table: "
       "[[0.05, 0.5, 0.5, 1, 0, 0, 0, 1], [1.05, 0.5, 1.5, 1, 0, 0, 0, 1]]}}");
  runSteps(*edited, 1);
  EXPECT_LT((edited->grasps().pose(2).position - before.position).norm(), 0.02);
  runSteps(*edited, 20);
  EXPECT_GT(edited->grasps().pose(2).position.y(), before.position.y() + 0.01);
  EXPECT_REFUSED(*edited, Kind::spawn,
                 "obstacles: {name: late, shape: {sphere: {radius: 0.01}}, motion: {table: [[0, 5, 5, 5, 0, 0, 0, 1], "
                 "[1, 5, 5, 6, 0, 0, 0, 1]]}}",
                 "times of tables are those of the scene");
}

TEST(SceneEdit, refusesWhatDoesNotFit)
{
  Running running = make(ropes);
  runSteps(*running, 5);
  const auto spawn = [&](const std::string& text) { return refusal(*running, Kind::spawn, text); };
  const auto has = [](const std::string& text, const std::string& part) {
    EXPECT_NE(text.find(part), std::string::npos) << text;
  };
  has(spawn(""), "must be a section with an object");
  has(spawn("bodies: ["), "~spawn:1: not valid YAML");
  has(spawn("time: {step: 1}"), "'time' is no section of objects");
  has(spawn("tracked: [{}]"), "belongs into the scene from its start");
  has(spawn("generate: [{}]"), "belongs into the scene from its start");
  has(spawn("rods: [{track: {}}]"), "belongs into the scene from its start");
  has(spawn("bodies: 3"), "must be a list of objects");
  has(spawn("bodies:\n- {name: ball, mas: 1}"), "~spawn:2: bodies.1.mas = 1: unknown key");
  has(spawn("bodies: [{name: plug, mass: 1}]"), "is also the name of bodies.0");
  has(spawn("rods: [{name: rope}]"), "is also the name of rods.0");
  has(refusal(*running, Kind::remove, "ropes"), "did you mean rope?");
  has(refusal(*running, Kind::remove, "cable"), "cable");   // the plug is welded to it
  has(refusal(*running, Kind::attach, "rop: {hand: {nodes: [1]}}"), "did you mean rope?");
  has(refusal(*running, Kind::attach, "rope"), "must be OBJECT: {GRASP: {...}}");
  has(refusal(*running, Kind::attach, "plug: {hand: {nodes: [1]}}"), "there is no object \"plug\" for this");
  has(refusal(*running, Kind::attach, "rope: {hand: {nodes: [21]}}"), "~attach:1: rods.0.grasps.hand.nodes.0 = 21");
  has(refusal(*running, Kind::attach, "rope: {left: {nodes: [3]}}"), "has a grasp left already");
  has(refusal(*running, Kind::attach, "cable: {left: {nodes: [3]}}"), "has the same name");
  has(refusal(*running, Kind::attach, "rope: {hand: {nodes: [3], direction: [0, 0, 1]}}"), "leave direction out");
  has(refusal(*running, Kind::detach, "lift"), "did you mean left?");
  const auto set = [&](const std::string& text) { return refusal(*running, Kind::set_parameter, text); };
  has(set(""), "must be PATH=VALUE");
  has(set("rods.rope.material.density"), "must be PATH=VALUE");
  has(set("time.step=0.01"), "may not change while the scene runs");
  has(set("rods.rope.centerline.straight.edges=30"), "material, damping, contact");
  has(set("rods.rope=1"), "material, damping, contact");
  has(set("wind.topic=true"), "velocity");
  has(set("rods.rope.material.density=-1"), "must be a number in");
  has(set("rods.rope.material.colour=1"), "unknown key");
  has(set("rods.rop.material.density=1"), "0 is rope, 1 is cable");
  has(set("wind.velocity=[0, 0, 1]\nrods.5.material.density=1"), "must be a whole number");   // all or nothing
  EXPECT_EQ(running->config().wind.z(), 0.0);

  Running lone = make("rods: [{name: only}]");
  has(refusal(*lone, Kind::remove, "only"), "is the last object");
  Running windy = make("rods: [{name: only}]\nwind: {topic: true}\n");
  has(refusal(*windy, Kind::set_parameter, "wind.velocity=[1, 0, 0]"), "publish there instead");
}

TEST(SceneEdit, whatWasMadeByGenerateGoesOn)
{
  const char* const chain = R"(
time: {step: 0.005, integrator: implicit_euler}
generate: [{chain: {links: 3, edges: 12, material: {density: 1000, youngs_modulus: 1e8}, damping: {mass: 1}}}]
rods: [{name: rope, centerline: {straight: {from: [3, 0, 0], to: [4, 0, 0], edges: 5}}}]
)";
  Running edited = make(chain), untouched = make(chain);
  runSteps(*edited, 10);
  runSteps(*untouched, 10);
  edit(edited, Kind::spawn, "rods: [{name: more, centerline: {straight: {from: [3, 9, 0], to: [4, 9, 0], edges: 5}}}]");
  runSteps(*edited, 10);
  runSteps(*untouched, 10);
  for (const char* name : {"rope", "chain_0", "chain_2"})
    EXPECT_TRUE(stateBytes(rod(*edited, name)) == stateBytes(rod(*untouched, name))) << name;
  EXPECT_REFUSED(*edited, Kind::remove, "chain_1", "was made by generate");
  EXPECT_REFUSED(*edited, Kind::attach, "chain_1: {hand: {nodes: [1]}}", "was made by generate");
  EXPECT_REFUSED(*edited, Kind::detach, "chain_start", "there is no grasp \"chain_start\"");
}

TEST(SceneEdit, aSavedStateBelongsToTheEditedScene)
{
  Running edited = make(ropes);
  runSteps(*edited, 5);
  const std::string path = testing::TempDir() + "/slender_sim_edited_state";
  edited->save(path);
  edit(edited, Kind::set_parameter, "rods.rope.material.youngs_modulus=2e6");
  EXPECT_THROW(edited->load(path), std::runtime_error);
  edited->save(path);
  const std::string before = bytes(*edited);
  runSteps(*edited, 5);
  edited->load(path);
  EXPECT_TRUE(bytes(*edited) == before);
  // the text of the edited scene is that scene
  Simulation fresh(parseScene(edited->config().source, "edited"));
  fresh.load(path);
  EXPECT_TRUE(bytes(fresh) == before);
  std::filesystem::remove(path);
}

}   // namespace
}   // namespace slender
