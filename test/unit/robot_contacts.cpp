#include <gtest/gtest.h>

#include "slender_sim/scene/reader.h"
#include "slender_sim/scene/simulation.h"

/// What a gripper holds does not touch the gripper, but all else of the robot.
namespace slender {
namespace {

/// A hand about the start of a rod along x, and a bar 5 cm below the rod, which is part of the same link.
const char* const kHand = R"(<robot name='r'><link name='base'/><link name='hand'>
  <collision><geometry><box size='0.04 0.04 0.04'/></geometry></collision>
  <collision><origin xyz='0.35 0 -0.06'/><geometry><box size='0.9 0.2 0.02'/></geometry></collision></link>
  <joint name='j' type='fixed'><parent link='base'/><child link='hand'/><origin xyz='0 0 1'/></joint></robot>)";

std::string rodScene(const std::string& grasp)
{
  return "time: {step: 0.005, integrator: implicit_euler}\nrobot: {description: \"" + std::string(kHand) +
         "\"}\nrods:\n"
         "  - name: cable\n    centerline: {straight: {from: [0, 0, 1], to: [0.7, 0, 1], edges: 35}}\n"
         "    cross_section: {radius: 0.005}\n    material: {density: 1000, youngs_modulus: 1.0e5, poissons_ratio: "
         "0.45}\n"
         "    damping: {mass: 2}\n    contact: {}\n    grasps: {hand: {edges: [0]" +
         grasp + "}}\n";
}

std::string clothScene(const std::string& contact, const std::string& grasp)
{
  return "time: {step: 0.005}\nrobot: {description: \"" + std::string(kHand) +
         "\"}\ncloths:\n"
         "  - name: sheet\n    grid: {corner: [0, -0.05, 1], sides: [[0.6, 0, 0], [0, 0.1, 0]], cells: [24, 4]}\n"
         "    contact: " +
         contact + "\n    grasps: {hand: {near: {point: [0, 0, 1], radius: 0.01}" + grasp + "}}\n";
}

/// Height of the lowest point after so many steps.
double lowestAfter(Simulation& simulation, int steps)
{
  for (int k = 0; k < steps; ++k)
  {
    const StepReport report = simulation.step(simulation.defaultInputs());
    EXPECT_TRUE(report.ok) << report.message;
    if (!report.ok)
      break;
  }
  const SceneState& state = simulation.state();
  return state.rods.empty() ? state.cloths[0].x.row(2).minCoeff() : state.rods[0].x.row(2).minCoeff();
}

std::string refusalOf(const std::string& scene)
{
  try
  {
    Simulation simulation(parseScene(scene, "test.yaml"));
  }
  catch (const std::runtime_error& error)
  {
    return error.what();
  }
  return "";
}

constexpr double kBar = 0.95;   // [m] top of the bar

TEST(RobotContacts, theHeldPartPassesThroughItsGripperOnly)
{
  Simulation simulation(parseScene(rodScene(""), "test.yaml"));
  ASSERT_EQ(simulation.config().notes.size(), 1u);
  const std::string& note = simulation.config().notes[0];
  EXPECT_NE(note.find("no contact between rod cable, 2 points near grasp hand, and link hand"), std::string::npos)
      << note;
  const double lowest = lowestAfter(simulation, 300);
  EXPECT_GT(lowest, kBar);           // it lies on the bar of the same link
  EXPECT_LT(lowest, kBar + 0.007);   // radius and gap
}

TEST(RobotContacts, withoutTheDefaultTheSceneStartsCrossed)
{
  const std::string refusal = refusalOf(rodScene(", contact: {ignore: []}"));
  EXPECT_NE(refusal.find(" cross by "), std::string::npos) << refusal;
  EXPECT_NE(refusal.find("hand_0"), std::string::npos) << refusal;
}

TEST(RobotContacts, aNamedLinkIsIgnoredByTheWholeRod)
{
  Simulation simulation(parseScene(rodScene(", contact: {ignore: [hand]}"), "test.yaml"));
  ASSERT_EQ(simulation.config().notes.size(), 1u);
  EXPECT_NE(simulation.config().notes[0].find("no contact between rod cable and hand"), std::string::npos);
  EXPECT_LT(lowestAfter(simulation, 300), kBar - 0.05);
}

TEST(RobotContacts, oneElementOfALinkCanBeIgnored)
{
  Simulation simulation(parseScene(rodScene(", contact: {ignore: [hand_0]}"), "test.yaml"));
  EXPECT_GT(lowestAfter(simulation, 300), kBar);
}

TEST(RobotContacts, ignoresOnlyWhatThereIs)
{
  const std::string refusal = refusalOf(rodScene(", contact: {ignore: [hnad]}"));
  EXPECT_NE(refusal.find("rods.0.grasps.hand.contact.ignore"), std::string::npos) << refusal;
  EXPECT_NE(refusal.find("no obstacle and no link hnad (did you mean hand?)"), std::string::npos) << refusal;
}

TEST(RobotContacts, aLinkAwayFromTheGraspIsTouched)
{
  std::string scene = rodScene("");
  scene.replace(scene.find("0.04 0.04 0.04"), 14, "0.04 0.04 0.01");   // the hand is below the rod now
  scene.replace(scene.find("<collision><geometry>"), 21, "<collision><origin xyz='0 0 -0.02'/><geometry>");
  Simulation simulation(parseScene(scene, "test.yaml"));
  EXPECT_TRUE(simulation.config().notes.empty());
}

TEST(RobotContacts, clothByBarrierPassesNearTheGrasp)
{
  EXPECT_NE(refusalOf(clothScene("{method: barrier}", ", contact: {ignore: []}")), "");
  Simulation simulation(parseScene(clothScene("{method: barrier}", ""), "test.yaml"));
  ASSERT_EQ(simulation.config().notes.size(), 1u);
  EXPECT_NE(simulation.config().notes[0].find("points near grasp hand"), std::string::npos);
  const double lowest = lowestAfter(simulation, 60);
  EXPECT_GT(lowest, kBar);
  EXPECT_LT(lowest, 0.99);
}

TEST(RobotContacts, clothByImpulsesPassesThroughTheWholeLink)
{
  EXPECT_NE(refusalOf(clothScene("{method: impulses}", ", contact: {ignore: []}")), "");
  Simulation simulation(parseScene(clothScene("{method: impulses}", ""), "test.yaml"));
  ASSERT_EQ(simulation.config().notes.size(), 1u);
  EXPECT_NE(simulation.config().notes[0].find("no contact between cloth sheet and link hand"), std::string::npos);
  EXPECT_LT(lowestAfter(simulation, 60), kBar - 0.01);
}

}   // namespace
}   // namespace slender
