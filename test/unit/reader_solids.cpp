#include <gtest/gtest.h>

#include "slender_sim/scene/reader.h"
#include "test/support/scenes.h"

/// Bodies, obstacles and contact in the scene file.
namespace slender {
namespace {

using test::BadOverride;
using test::problemsOf;

const char* const solid_scene = R"(name: test
contact: {slip_speed: 1e-3}
rods:
  - name: rope
    centerline: {straight: {from: [0, 0, 1], to: [1, 0, 1], edges: 10}}
    cross_section: {ellipse: [0.004, 0.002]}
    contact: {friction: 0.5}
    grasps:
      left: {edges: [0]}
      middle: {nodes: [5], motion: {body: door}, attach: initial}
  - {name: ring, closed: true, centerline: {arc: {angle: 6.283185307179586, edges: 12}}, cross_section: {radius: 0.001}}
obstacles:
  - {name: floor, shape: {plane: {point: [0, 0, -1], normal: [0, 2, 0]}}, friction: 0.7}
  - {name: pin, shape: {cylinder: {radius: 0.02, length: 0.3}}, pose: {position: [0, 1, 0], rpy: [0, 1.5707963267948966, 0]}}
  - {name: door, shape: {box: {size: [1, 0.1, 2]}}, motion: {table: [[0, 1, 2, 3], [1, 2, 2, 3]]}}
  - {name: hand, shape: {capsule: {radius: 0.02}}, motion: {topic: true}, pose: {orientation: [0, 0, 1, 0]}}
bodies:
  - name: bob
    mass: 2
    shape: {sphere: {radius: 0.1}}
    pose: {position: [1.1, 0, 1]}
    velocity: {linear: [0, 0, -1], angular: [0, 0, 3]}
    gravity: false
    force: [1, 0, 0]
    torque: [0, 1, 0]
    damping: {linear: 0.1, angular: 0.2}
    contact: false
    friction: 0.1
    broadcast_tf: true
    welds: [{rod: rope, edge: -1}, {rod: ring, edge: 3}]
  - {name: brick, density: 1000, shape: {box: {size: [0.1, 0.2, 0.3]}}}
  - {name: point, mass: 1, inertia: [1, 2, 2.5]}
  - {name: driven, motion: {topic: true}, welds: [{rod: rope, edge: 7}]}
)";

/// Methods of second order make what hits something bounce.
TEST(ReaderSolids, contactOfAnyKindMakesImplicitEulerTheDefault)
{
  const auto defaultOf = [](const std::string& scene) { return parseScene(scene).time.integrator; };
  const std::string ball = "bodies: [{name: ball, mass: 1, shape: {sphere: {radius: 0.1}}",
                    floor = "\nobstacles: [{name: floor, shape: {plane: {point: [0, 0, -1]}}}]",
                    honey =
                        "\nthreads: [{centerline: {straight: {from: [0, 0, 2], to: [1, 0, 2], edges: 10}}, "
                        "radius: 0.01, contact: {}}]";
  EXPECT_EQ(defaultOf(ball + "}]"), Integrator::tr_bdf2);
  EXPECT_EQ(defaultOf(ball + "}]" + floor), Integrator::implicit_euler);
  EXPECT_EQ(defaultOf(ball + ", contact: false}]" + floor), Integrator::tr_bdf2);
  EXPECT_EQ(defaultOf(ball + ", motion: fixed}]" + floor), Integrator::tr_bdf2);
  EXPECT_EQ(defaultOf(ball + "}, {name: other, mass: 1, shape: {sphere: {radius: 0.1}}, pose: {position: [1, 0, 0]}}]"),
            Integrator::implicit_euler);
  EXPECT_EQ(defaultOf(ball + "}]" + honey), Integrator::implicit_euler);
  for (const char* const bouncy : {"bdf2", "tr_bdf2"})
  {
    const SceneConfig scene = parseScene(ball + "}]" + floor, "test.yaml", {std::string("time.integrator=") + bouncy});
    ASSERT_EQ(scene.warnings.size(), 1u) << bouncy;
    EXPECT_NE(scene.warnings[0].find("may leave a collision much faster than it came"), std::string::npos)
        << scene.warnings[0];
  }
  for (const char* const refused : {"symplectic_euler", "implicit_midpoint", "generalized_alpha"})
    EXPECT_NE(problemsOf(ball + "}]" + floor, {std::string("time.integrator=") + refused}).find("takes no contact, "),
              std::string::npos)
        << refused;
}

TEST(ReaderSolids, saysThatASceneHasNoRodsToWeldTo)
{
  EXPECT_NE(problemsOf("bodies: [{mass: 1, inertia: [1, 1, 1], welds: [{rod: rope, edge: 0}]}]", {})
                .find("rod = rope: is no rod of the scene, which has none"),
            std::string::npos);
}

TEST(ReaderSolids, tellsThatContactChoosesTheIntegratorOfRodsWithoutIt)
{
  EXPECT_EQ(parseScene(solid_scene).notes.size(), 1u);   // the ring has no contact
  EXPECT_TRUE(parseScene(solid_scene, "test.yaml", {"rods.1.contact={}"}).notes.empty());
  EXPECT_TRUE(parseScene(solid_scene, "test.yaml", {"time.integrator=implicit_euler"}).notes.empty());
}

TEST(ReaderSolids, readsContact)
{
  const SceneConfig scene = parseScene(solid_scene);
  EXPECT_DOUBLE_EQ(scene.contact.gap, 0.0002);   // of the rope's smaller half axis; the ring takes no part
  EXPECT_EQ(scene.contact.slip_speed, 1e-3);
  ASSERT_TRUE(scene.rods[0].contact);
  EXPECT_TRUE(scene.rods[0].contact->self && scene.rods[0].contact->others && scene.rods[0].contact->solids);
  EXPECT_EQ(scene.rods[0].contact->friction, 0.5);
  EXPECT_FALSE(scene.rods[1].contact);
  const SceneConfig other =
      parseScene(solid_scene, "t", {"rods.1.contact={self: false, rods: no}", "contact.gap=0.003"});
  EXPECT_EQ(other.contact.gap, 0.003);
  ASSERT_TRUE(other.rods[1].contact);
  EXPECT_FALSE(other.rods[1].contact->self || other.rods[1].contact->others);
  EXPECT_EQ(other.rods[1].contact->friction, 0.3);
  EXPECT_TRUE(parseScene("rods: [{contact: {}}]").rods[0].contact);
  EXPECT_EQ(parseScene("rods: [{}]").contact.gap, 0);
}

TEST(ReaderSolids, readsObstacles)
{
  const SceneConfig scene = parseScene(solid_scene);
  ASSERT_EQ(scene.obstacles.size(), 4u);
  const auto& [floor, pin, door, hand] =
      std::tie(scene.obstacles[0], scene.obstacles[1], scene.obstacles[2], scene.obstacles[3]);
  EXPECT_TRUE(std::holds_alternative<Plane>(floor.shape));
  EXPECT_LT((floor.pose * Eigen::Vector3d(0, 0, 1) - Eigen::Vector3d(0, 1, -1)).norm(), 1e-12);
  EXPECT_EQ(floor.friction, 0.7);
  EXPECT_TRUE(std::holds_alternative<FixedMotion>(floor.motion));
  EXPECT_EQ(std::get<Cylinder>(pin.shape).length, 0.3);
  EXPECT_LT((pin.pose * Eigen::Vector3d(0, 0, 1) - Eigen::Vector3d(1, 1, 0)).norm(), 1e-12);
  EXPECT_LT(pin.friction, 0.0);
  EXPECT_EQ(std::get<Box>(door.shape).size, Eigen::Vector3d(1, 0.1, 2));
  EXPECT_EQ(door.pose.position, Eigen::Vector3d(1, 2, 3));
  EXPECT_EQ(std::get<TableMotion>(door.motion).poses.evaluate(2).position.x(), 2);
  EXPECT_EQ(std::get<Capsule>(hand.shape).radius, 0.02);
  EXPECT_TRUE(std::holds_alternative<TopicMotion>(hand.motion));
  EXPECT_EQ(hand.pose.orientation.z(), 1);
}

TEST(ReaderSolids, readsBodies)
{
  const SceneConfig scene = parseScene(solid_scene);
  ASSERT_EQ(scene.bodies.size(), 4u);
  const BodyConfig& bob = scene.bodies[0];
  EXPECT_EQ(bob.mass, 2);
  EXPECT_LT((bob.inertia - Eigen::Matrix3d(0.4 * 2 * 0.01 * Eigen::Matrix3d::Identity())).norm(), 1e-12);
  EXPECT_FALSE(bob.motion);
  EXPECT_EQ(bob.pose.position, Eigen::Vector3d(1.1, 0, 1));
  EXPECT_EQ(bob.velocity.linear, Eigen::Vector3d(0, 0, -1));
  EXPECT_EQ(bob.velocity.angular, Eigen::Vector3d(0, 0, 3));
  EXPECT_FALSE(bob.gravity);
  EXPECT_EQ(bob.force, Eigen::Vector3d(1, 0, 0));
  EXPECT_EQ(bob.torque, Eigen::Vector3d(0, 1, 0));
  EXPECT_EQ(bob.linear_damping, 0.1);
  EXPECT_EQ(bob.angular_damping, 0.2);
  EXPECT_FALSE(bob.contact);
  EXPECT_EQ(bob.friction, 0.1);
  EXPECT_TRUE(bob.broadcast_tf);
  ASSERT_EQ(bob.welds.size(), 2u);
  EXPECT_EQ(bob.welds[0].rod, 0);
  EXPECT_EQ(bob.welds[0].first_node, 10);   // the end section
  EXPECT_EQ(bob.welds[0].last_node, 10);
  EXPECT_EQ(bob.welds[1].rod, 1);
  EXPECT_EQ(bob.welds[1].first_node, 3);
  EXPECT_EQ(bob.welds[1].last_node, 4);
  const BodyConfig& brick = scene.bodies[1];
  EXPECT_DOUBLE_EQ(brick.mass, 6);
  EXPECT_LT((brick.inertia.diagonal() - Eigen::Vector3d(0.065, 0.05, 0.025)).norm(), 1e-12);
  EXPECT_TRUE(brick.gravity && brick.contact && brick.broadcast_tf);
  EXPECT_EQ(scene.bodies[2].inertia, Eigen::Matrix3d(Eigen::Vector3d(1, 2, 2.5).asDiagonal()));
  EXPECT_FALSE(scene.bodies[2].shape);
  ASSERT_TRUE(scene.bodies[3].motion);
  EXPECT_TRUE(std::holds_alternative<TopicMotion>(*scene.bodies[3].motion));
  EXPECT_EQ(scene.bodies[3].welds[0].first_node, 7);
  EXPECT_EQ(scene.bodies[3].welds[0].last_node, 8);
}

TEST(ReaderSolids, aBodyIsFreeUnlessItsMotionIsGiven)
{
  const auto motion = [](const std::string& value) {
    return parseScene(solid_scene, "t", {"bodies.1.motion=" + value}).bodies[1].motion;
  };
  EXPECT_FALSE(motion("free"));
  ASSERT_TRUE(motion("fixed"));
  EXPECT_TRUE(std::holds_alternative<FixedMotion>(*motion("fixed")));
  EXPECT_TRUE(std::holds_alternative<TopicMotion>(*motion("topic")));
  EXPECT_TRUE(std::holds_alternative<TableMotion>(*motion("{table: [[0, 0, 0, 0]]}")));
}

/// A mesh's own frame may be anywhere; a simulated body's frame sits at its centre of mass. The mesh stays where it was
/// put.
TEST(ReaderSolids, meshesAreCentredWhenSimulated)
{
  const std::string mesh =
      "{mesh: {file: " + std::string(SLENDER_SOURCE_DIR) + "/test/unit/data/cube.obj, scale: 0.1}}";
  const std::string pose = "bodies.1.pose={position: [1, 0, 0], rpy: [0, 0, 1.5707963267948966]}";
  const auto read = [&](const std::vector<std::string>& more) {
    std::vector<std::string> all{"bodies.1.shape=" + mesh, pose};
    all.insert(all.end(), more.begin(), more.end());
    return parseScene(solid_scene, "t", all).bodies[1];
  };
  const BodyConfig free = read({});   // corners at 0 and 0.1
  EXPECT_NEAR(free.mass, 1, 1e-12);
  EXPECT_LT((free.pose.position - Eigen::Vector3d(0.95, 0.05, 0.05)).norm(), 1e-12);
  EXPECT_LT((free.X_BS.position - Eigen::Vector3d(-0.05, -0.05, -0.05)).norm(), 1e-12);
  EXPECT_LT((free.inertia - Eigen::Matrix3d(0.01 / 6 * Eigen::Matrix3d::Identity())).norm(), 1e-12);
  const BodyConfig driven = read({"bodies.1.motion=fixed"});
  EXPECT_EQ(driven.pose.position, Eigen::Vector3d(1, 0, 0));
  EXPECT_EQ(driven.X_BS.position, Eigen::Vector3d(0, 0, 0));
}

class BadSolid : public testing::TestWithParam<BadOverride>
{};

TEST_P(BadSolid, isRefusedWithPathAndRange)
{
  const std::string message = problemsOf(solid_scene, {GetParam().override_text});
  EXPECT_NE(message.find(GetParam().expected), std::string::npos) << GetParam().override_text << "\ngave: " << message;
  EXPECT_EQ(message.find('\n'), std::string::npos) << "more than one problem:\n" << message;
  EXPECT_TRUE(message.find("--set " + std::string(GetParam().override_text)) == 0 || message.find("test.yaml:") == 0)
      << message;
}

INSTANTIATE_TEST_SUITE_P(
    Contact, BadSolid,
    testing::Values(
        BadOverride{"contact.gap=0", "contact.gap = 0: is out of range; must be a number in (0, 1] m"},
        BadOverride{"contact.slip_speed=0", "in (0, 10] m/s"},
        BadOverride{"contact.self=true", "unknown key; known here: gap, slip_speed"},
        BadOverride{"rods.0.contact.self=maybe", "must be true or false"},
        BadOverride{"rods.0.contact.friction=-0.1",
                    "rods.0.contact.friction = -0.1: is out of range; must be a number in [0, 100]"},
        BadOverride{"rods.0.contact.bodies=true", "unknown key; known here: self, rods, obstacles, friction"},
        BadOverride{"time.integrator=symplectic_euler", "time.integrator = symplectic_euler: takes no contact"},
        BadOverride{"rods.0.contact=true", "must be a map"}));

INSTANTIATE_TEST_SUITE_P(
    Obstacle, BadSolid,
    testing::Values(
        BadOverride{"obstacles=3", "must be a list"},
        BadOverride{"obstacles.0.shape=plane",
                    "obstacles.0.shape = plane: must be a map with one shape and its measures, e.g. {plane: {}}"},
        BadOverride{"obstacles.0.name=the floor", "is not a name"},
        BadOverride{"obstacles.0.name=pin", "is also the name of obstacles.0"},
        BadOverride{"obstacles.0.name=bob",
                    "bodies.0.name = bob: is also the name of obstacles.0; names of bodies and obstacles must differ"},
        BadOverride{"obstacles.0.mass=1", "unknown key; known here: name, pose, shape, friction, motion"},
        BadOverride{"obstacles.0.shape={}",
                    "names 0 shapes; must name one of: plane, sphere, box, cylinder, capsule, mesh"},
        BadOverride{"obstacles.0.shape={sphere: {}, box: {}}", "names 2 shapes"},
        BadOverride{"obstacles.0.shape={ball: {}}", "unknown key"},
        BadOverride{"obstacles.0.shape.plane.normal=[0, 0, 0]", "must not be zero"},
        BadOverride{"obstacles.0.pose={position: [0, 0, 0]}", "there is a pose as well"},
        BadOverride{"obstacles.0.friction=-1", "in [0, 100]"},
        BadOverride{"obstacles.0.motion=free", "must be one of: fixed, topic"},
        BadOverride{"obstacles.0.motion={body: bob}",
                    "must be fixed or one of {topic: true}, {tf: FRAME}, {table: [...]}, {file: PATH, body: NAME}"},
        BadOverride{"obstacles.0.motion={topic: false}", "must be true"},
        BadOverride{"obstacles.0.motion={file: nowhere.csv}", "nowhere.csv: cannot be opened"},
        BadOverride{"obstacles.2.pose={}", "there is a table of poses as well; the obstacle starts at its first"},
        BadOverride{"obstacles.2.motion={table: [[0, 1, 2]]}",
                    "has 3 numbers; must be [t, x, y, z, qx, qy, qz, qw] or [t, x, y, z]"},
        BadOverride{"obstacles.1.shape.cylinder.radius=0", "in (0, 1000000] m"},
        BadOverride{"obstacles.1.shape.cylinder.height=1", "unknown key; known here: radius, length"},
        BadOverride{"obstacles.1.shape={box: {size: 1}}", "must be a list [x, y, z]"},
        BadOverride{"obstacles.1.shape={box: {size: [1, 0, 1]}}", "size.1 = 0"},
        BadOverride{"obstacles.1.shape={mesh: {}}", "file: is missing"},
        BadOverride{"obstacles.1.shape={mesh: {file: nowhere.obj}}", "nowhere.obj: cannot be opened"},
        BadOverride{"obstacles.1.pose.orientation=[0, 0, 0, 1]",
                    "must have either orientation: [x, y, z, w] or rpy: [roll, pitch, yaw]"},
        BadOverride{"obstacles.1.pose={orientation: [0, 0, 1]}",
                    "has 3 entries; must be a unit quaternion [x, y, z, w]"},
        BadOverride{"obstacles.1.pose={orientation: [0, 0, 1, 1]}", "quaternion's length is 1.41421"},
        BadOverride{"obstacles.1.pose.rpy=[0, 1]", "has 2 entries"},
        BadOverride{"obstacles.1.pose.angle=1", "unknown key"}));

INSTANTIATE_TEST_SUITE_P(
    Body, BadSolid,
    testing::Values(
        BadOverride{"bodies.1.name=bob", "is also the name of bodies.0"},
        BadOverride{"bodies.1.mass=1", "must have either mass or density"},
        BadOverride{"bodies.1.density=0", "in (0, 1000000] kg/m^3"},
        BadOverride{"bodies.0.mass=-2", "in (0, 1000000000] kg"},
        BadOverride{"bodies.2={name: point}", "must have a mass, or a density and a shape"},
        BadOverride{"bodies.2={name: point, mass: 1}",
                    "inertia: is missing; a body without a shape needs [Ixx, Iyy, Izz]"},
        BadOverride{"bodies.2={name: point, density: 1, inertia: [1, 1, 1]}", "density = 1: needs a shape"},
        BadOverride{"bodies.2.inertia=[1, 2, 4]", "bodies.2.inertia = [1, 2, 4]: body point: principal moments"},
        BadOverride{"bodies.2.inertia=[1, 2, 0]", "inertia.2 = 0"},
        BadOverride{"bodies.2.inertia=[1, 2]", "has 2 entries"},
        BadOverride{"bodies.2.inertia=[[1, 0, 0], [0, 1, 0.1], [0, 0, 1]]", "must be symmetric"},
        BadOverride{"bodies.1.shape={plane: {}}", "mass of a plane"},
        BadOverride{"bodies.1.shape={sphere: {radius: -1}}", "in (0, 1000000] m"},
        BadOverride{"bodies.0.motion=fixed", "the body's motion is given; only free bodies start with a velocity"},
        BadOverride{"bodies.1.motion=moving", "must be one of: fixed, topic, free"},
        BadOverride{"bodies.1.motion={}", "must be free, fixed or one of"},
        BadOverride{"bodies.0.velocity.linear=1", "must be a list [x, y, z]"},
        BadOverride{"bodies.0.velocity.speed=1", "unknown key"},
        BadOverride{"bodies.0.damping.linear=-1", "in [0, 1000000] 1/s"},
        BadOverride{"bodies.0.gravity=[0, 0, 1]", "must be true or false"},
        BadOverride{"bodies.0.colour=red", "unknown key; known here: name"},
        BadOverride{"bodies.0.welds=rope", "must be a list"},
        BadOverride{"bodies.0.welds.0.rod=rop",
                    "welds.0.rod = rop: is no rod of the scene (did you mean rope?); it has: rope, ring"},
        BadOverride{"bodies.0.welds.0={edge: 3}", "rod: is missing"},
        BadOverride{"bodies.0.welds.0.edge=10", "in [-10, 9]"},
        BadOverride{"bodies.0.welds.0={rod: rope}", "edge: is missing"},
        BadOverride{"bodies.0.welds.0.edge=0", "holds nodes 0 to 0 of rod rope; grasp left holds nodes 0 to 0"},
        BadOverride{"bodies.0.welds.0.edge=4", "holds nodes 4 to 5 of rod rope; grasp middle holds nodes 5 to 5"},
        BadOverride{"bodies.0.welds.1={rod: rope, edge: 9}", "a weld of body bob holds nodes 10 to 10"},
        BadOverride{"bodies.3.welds.0={rod: ring, edge: 2}",
                    "holds nodes 2 to 3 of rod ring; a weld of body bob holds nodes 3 to 4"},
        BadOverride{"bodies.0.welds.1.edge=-1", "holds the edge that joins the last node to the first"},
        BadOverride{"rods.0.grasps.middle.motion.body=bob", "body bob is simulated; weld the rod to it instead"}));

}   // namespace
}   // namespace slender
