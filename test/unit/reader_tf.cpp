#include <gtest/gtest.h>

#include "slender_sim/scene/reader.h"
#include "slender_sim/scene/simulation.h"
#include "test/support/scenes.h"

/// What follows frames of tf, and where it is in them.
namespace slender {
namespace {

using test::problemsOf;

const char* const scene_text = R"(name: test
time: {step: 0.01}
gravity: [0, 0, 0]
rods:
  - name: rope
    centerline: {straight: {from: [0, 0, 1], to: [1, 0, 1], edges: 10}}
    cross_section: {radius: 0.004}
    contact: {friction: 0.5}
    grasps:
      left: {edges: [0], motion: {tf: /tool0, offset: {position: [0, 0, 0.1], orientation: [0, 0, 1, 0]}}}
obstacles:
  - {name: link, shape: {box: {size: [0.1, 0.1, 0.1]}}, pose: {position: [0, 3, 0]}, motion: {tf: arm/link_3}}
bodies:
  - {name: cart, shape: {sphere: {radius: 0.1}}, motion: {tf: base, offset: {rpy: [0, 0, 1]}}}
)";

TEST(ReaderTf, readsFramesAndOffsets)
{
  const SceneConfig scene = parseScene(scene_text);
  const auto& left = std::get<TfMotion>(scene.rods[0].grasps[0].motion);
  EXPECT_EQ(left.frame, "tool0");   // tf2 wants no slash
  EXPECT_EQ(left.offset.position, Eigen::Vector3d(0, 0, 0.1));
  EXPECT_EQ(left.offset.orientation.z(), 1.0);
  const auto& link = std::get<TfMotion>(scene.obstacles[0].motion);
  EXPECT_EQ(link.frame, "arm/link_3");
  EXPECT_EQ(link.offset.position, Eigen::Vector3d::Zero());
  EXPECT_EQ(link.offset.orientation.w(), 1.0);
  const auto& cart = std::get<TfMotion>(*scene.bodies[0].motion);
  EXPECT_NEAR(cart.offset.orientation.z(), std::sin(0.5), 1e-15);
  EXPECT_TRUE(comesFromOutside(*scene.bodies[0].motion));
  EXPECT_FALSE(comesFromOutside(Motion{BodyMotion{"base"}}));
}

/// Without a node nobody knows the frames.
TEST(ReaderTf, staysWhereItIsWithoutANode)
{
  Simulation simulation{parseScene(scene_text)};
  for (int k = 0; k < 10; ++k)
    ASSERT_TRUE(simulation.step(simulation.defaultInputs()).ok);
  EXPECT_LT((simulation.grasps().pose(0).position - Eigen::Vector3d(0, 0, 1)).norm(), 1e-12);
  EXPECT_EQ(simulation.state().obstacles[0].position, Eigen::Vector3d(0, 3, 0));
  EXPECT_EQ(simulation.state().bodies[0].X_WB.position, Eigen::Vector3d::Zero());
}

TEST(ReaderTf, refusesWhatCannotBeFollowed)
{
  const std::string grasp = "rods.0.grasps.left.", obstacle = "obstacles.0.motion=";
  const std::vector<std::pair<std::string, std::string>> wrong = {
      {grasp + "motion={tf: \"\"}", "is empty; must be a text"},
      {grasp + "motion={tf: \"/\"}", "is no name of a frame"},
      {grasp + "motion={tf: \"two words\"}", "is no name of a frame"},
      {grasp + "motion={tf: tool0, topic: true}", "must be fixed or one of"},
      {grasp + "motion={topic: true, offset: {position: [0, 0, 1]}}", "offset: is for motion: {tf: FRAME}"},
      {grasp + "motion={tf: tool0, offset: {orientation: [0, 0, 0, 2]}}", "orientation"},
      {grasp + "attach=initial", "attach: initial keeps it where it is"},
      {grasp + "direction=[0, 0, 1]", "both say how the section is turned"},
      {obstacle + "{tf: a, body: b}", "must be fixed or one of"},
      {obstacle + "{table: [[0, 0, 0, 0]], offset: {}}", "offset: is for motion: {tf: FRAME}"},
  };
  for (const auto& [change, reason] : wrong)
    EXPECT_NE(problemsOf(scene_text, {change}).find(reason), std::string::npos) << change << "\n"
                                                                                << problemsOf(scene_text, {change});
}

/// `offset` of a grasp: with any motion, and once.
TEST(ReaderTf, aGraspMayHaveAnOffset)
{
  const std::string grasp = "rods.0.grasps.left=", offset = "offset: {position: [0, 0, 0.1]}";
  const auto offsetOf = [&](const std::string& text) {
    const SceneConfig scene = parseScene(scene_text, "t", {grasp + text});
    return offsetInFrame(scene.rods[0].grasps[0]).value_or(Pose()).position.z();
  };
  EXPECT_EQ(offsetOf("{edges: [0], motion: {topic: true}, " + offset + "}"), 0.1);
  EXPECT_EQ(offsetOf("{edges: [0], motion: {body: link}, " + offset + "}"), 0.1);
  EXPECT_EQ(offsetOf("{edges: [0], motion: {tf: tool0}, " + offset + "}"), 0.1);
  EXPECT_EQ(offsetOf("{edges: [0], motion: {tf: tool0, " + offset + "}}"), 0.1);
  EXPECT_EQ(offsetOf("{edges: [0], motion: {tf: tool0}}"), 0.0);
  EXPECT_EQ(offsetOf("{edges: [0], motion: {topic: true}, attach: initial}"), 0.0);
  const std::vector<std::pair<std::string, std::string>> wrong = {
      {"{edges: [0], " + offset + "}", "is for grasps that something moves"},
      {"{edges: [0], motion: {topic: true}, attach: initial, " + offset + "}", "attach: initial keeps it where it is"},
      {"{edges: [0], motion: {tf: a, offset: {}}, " + offset + "}", "both say where the grasp is in the frame"},
      {"{edges: [0], motion: {table: [[0, 0, 0, 1]]}, direction: [0, 0, 1], " + offset + "}", "turns the section"},
  };
  for (const auto& [change, reason] : wrong)
    EXPECT_NE(problemsOf(scene_text, {grasp + change}).find(reason), std::string::npos)
        << change << "\n"
        << problemsOf(scene_text, {grasp + change});
}

/// A table, and an obstacle that moves, carry the section at the offset; a reset brings it back.
TEST(ReaderTf, offsetsHoldWithoutANode)
{
  for (const char* motion : {"{body: mover}", "{table: [[0, 0, 0, 1, 0, 0, 0, 1], [1, 0, 0.2, 1, 0, 0, 0, 1]]}"})
  {
    Simulation simulation{parseScene(scene_text, "t",
                                     {std::string("rods.0.grasps.left={edges: [0], offset: {position: "
                                                  "[0, 0, 0.01]}, motion: ") +
                                          motion + "}",
                                      "obstacles.0={name: mover, shape: {sphere: {radius: 0.001}}, "
                                      "motion: {table: [[0, 0, 0, 1], [1, 0, 0.2, 1]]}}",
                                      "rods.0.contact={obstacles: false}"})};
    for (int round = 0; round < 2; ++round)
    {
      for (int k = 0; k < 100; ++k)
        ASSERT_TRUE(simulation.step(simulation.defaultInputs()).ok);
      EXPECT_LT((simulation.grasps().pose(0).position - Eigen::Vector3d(0, 0.2, 1.01)).norm(), 1e-12) << motion;
      simulation.reset();
    }
  }
}

/// The vertices of a cloth keep their offset to the first pose, unless the scene gives the offset.
TEST(ReaderTf, anOffsetStandsInForAttachInitialOfACloth)
{
  const std::string text = R"(
cloths:
  - {name: sheet, grid: {corner: [0, 0, 0], sides: [[1, 0, 0], [0, 1, 0]], cells: 2},
     grasps: {a: {vertices: [0], motion: {tf: left}}, b: {vertices: [2], motion: {tf: right, offset: {}}}}}
)";
  const SceneConfig scene = parseScene(text);
  EXPECT_EQ(scene.cloths[0].grasps[0].attach, Attach::initial);
  EXPECT_EQ(scene.cloths[0].grasps[1].attach, Attach::section);
}

/// `motion`: path of the key.
void checkGuideOnAFrame(const std::string& text, const std::string& motion,
                        const std::vector<std::pair<std::string, std::string>>& refused)
{
  const auto guide = [&](const std::string& change) {
    const SceneConfig scene = change.empty() ? parseScene(text) : parseScene(text, "t", {change});
    const GuideConfig& config = (scene.rods.empty() ? scene.cloths[0].tracking : scene.rods[0].tracking)->guide;
    EXPECT_TRUE(config.byTopic());
    return std::get<CarriedGuide>(config.motion);
  };
  const CarriedGuide carried = guide("");
  EXPECT_TRUE(carried.by_tf && carried.keeps_offset);
  EXPECT_EQ(carried.bodies, std::vector<std::string>{"hand"});
  const CarriedGuide placed = guide(motion + "={tf: hand, offset: {position: [0, 0, 2]}, late: extrapolate}");
  EXPECT_FALSE(placed.keeps_offset);
  EXPECT_EQ(placed.offset.position.z(), 2.0);
  for (const auto& [change, reason] : refused)
  {
    try
    {
      parseScene(text, "t", {motion + "=" + change});
      ADD_FAILURE() << change;
    }
    catch (const SceneError& error)
    {
      EXPECT_NE(std::string(error.what()).find(reason), std::string::npos) << error.what();
    }
  }
}

TEST(ReaderTf, aGuideOfAShellRidesOnAFrame)
{
  checkGuideOnAFrame(R"(
tracked:
  - {name: shell, guide: {grid: {corner: [0, 0, 0], sides: [[1, 0, 0], [0, 1, 0]], cells: 2}, motion: {tf: hand}},
     mesh: same, test_functions: {clusters: {count: 1}}}
)",
                     "tracked.0.guide.motion",
                     {{"{tf: hand, offset: {}, attach: initial}", "give one"},
                      {"{topic: points, offset: {}}", "is for tf"},
                      {"{tf: hand, groups: {a: [0]}}", "is for bodies"}});
}

TEST(ReaderTf, aGuideOfARodRidesOnAFrame)
{
  checkGuideOnAFrame("rods: [{centerline: {straight: {}}, track: {guide: {nodes: 4, motion: {tf: hand}}}}]",
                     "rods.0.track.guide.motion",
                     {{"{tf: hand, offset: {}, attach: initial}", "give one"},
                      {"{topic: points, attach: frame}", "is for guides by tf"},
                      {"{tf: hand, topic: points}", "one of"}});
}

}   // namespace
}   // namespace slender
