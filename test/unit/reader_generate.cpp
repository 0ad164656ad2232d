#include <set>

#include <Eigen/Geometry>
#include <gtest/gtest.h>

#include "slender_sim/geometry/curves.h"
#include "slender_sim/scene/reader.h"
#include "slender_sim/scene/shapes.h"

/// `generate:` in the scene file.
namespace slender {
namespace {

Eigen::Matrix3Xd nodesOf(const RodConfig& rod)
{
  return initialNodes(rod, restNodes(rod, {0, 0, -9.81}), {0, 0, -9.81});
}

double distance(const Eigen::Matrix3Xd& a, const Eigen::Matrix3Xd& b)
{
  double least = 1e300;
  for (Eigen::Index i = 0; i < a.cols(); ++i)
    least = std::min(least, (b.colwise() - a.col(i)).colwise().norm().minCoeff());
  return least;
}

/// Linking number of two closed polylines by Gauss's double sum (midpoints: not quite whole).
double linking(const Eigen::Matrix3Xd& a, const Eigen::Matrix3Xd& b)
{
  double sum = 0;
  for (Eigen::Index i = 0; i < a.cols(); ++i)
  {
    for (Eigen::Index j = 0; j < b.cols(); ++j)
    {
      const Eigen::Vector3d da = a.col((i + 1) % a.cols()) - a.col(i), db = b.col((j + 1) % b.cols()) - b.col(j);
      const Eigen::Vector3d r = a.col(i) + 0.5 * da - b.col(j) - 0.5 * db;
      sum += r.dot(da.cross(db)) / (4 * M_PI * std::pow(r.norm(), 3));
    }
  }
  return sum;
}

const char* const chain = R"(generate:
  - chain: {links: 5, radius: 0.05, edges: 90, from: [0, 1, 0], cross_section: {radius: 0.002}, contact: {friction: 0.2},
            end_motion: {topic: true}}
)";

TEST(Generate, chainLinksHang)
{
  const SceneConfig scene = parseScene(chain);
  ASSERT_EQ(scene.rods.size(), 5u);
  EXPECT_EQ(scene.rods[3].name, "chain_3");
  EXPECT_DOUBLE_EQ(scene.contact.gap, 2e-4);
  std::vector<Eigen::Matrix3Xd> nodes;
  for (const RodConfig& rod : scene.rods)
  {
    EXPECT_TRUE(rod.closed);
    EXPECT_EQ(rod.contact->friction, 0.2);
    nodes.push_back(nodesOf(rod));
    EXPECT_EQ(nodes.back().cols(), 90);
  }
  for (int k = 0; k < 4; ++k)
  {
    EXPECT_NEAR(std::abs(linking(nodes[k], nodes[k + 1])), 1, 0.01);
    EXPECT_GT(distance(nodes[k], nodes[k + 1]), 0.004);
  }
  EXPECT_NEAR(linking(nodes[0], nodes[2]), 0, 0.01);
  EXPECT_GT(distance(nodes[0], nodes[2]), 0.004);
  ASSERT_EQ(scene.rods[0].grasps.size(), 1u);
  EXPECT_EQ(scene.rods[0].grasps[0].name, "chain_start");
  EXPECT_LT(nodes[0](0, scene.rods[0].grasps[0].first_node), -0.0499);   // the outermost point
  EXPECT_TRUE(scene.rods[1].grasps.empty());
  EXPECT_EQ(scene.rods[4].grasps[0].name, "chain_end");
  EXPECT_TRUE(std::holds_alternative<TopicMotion>(scene.rods[4].grasps[0].motion));
  EXPECT_GT(nodes[4](0, scene.rods[4].grasps[0].first_node), 4 * 0.092 + 0.0499);
}

TEST(Generate, openChainLinksHaveEnds)
{
  const SceneConfig scene = parseScene(chain, "t", {"generate.0.chain.opening=0.4"});
  for (const RodConfig& rod : scene.rods)
  {
    EXPECT_FALSE(rod.closed);
    const Eigen::Matrix3Xd nodes = nodesOf(rod);
    EXPECT_NEAR((nodes.col(0) - nodes.col(90)).norm(), 2 * 0.05 * std::sin(0.2), 1e-12);
  }
}

TEST(Generate, treeHasItsVerticesAndJoints)
{
  const SceneConfig scene = parseScene("generate: [{tree: {}}]");
  ASSERT_EQ(scene.rods.size(), 57u);   // 1 + 7 + 49
  ASSERT_EQ(scene.bodies.size(), 56u);
  Eigen::Index vertices = 0;
  std::vector<Eigen::Matrix3Xd> nodes;
  for (const RodConfig& rod : scene.rods)
  {
    nodes.push_back(nodesOf(rod));
    vertices += nodes.back().cols();
    EXPECT_FALSE(rod.contact);
  }
  EXPECT_EQ(vertices, 2158);
  EXPECT_EQ(scene.rods[0].grasps[0].name, "tree_root");
  std::set<std::pair<int, int>> held;
  for (const BodyConfig& body : scene.bodies)
  {
    EXPECT_FALSE(body.motion);
    EXPECT_GT(body.mass, 0);
    ASSERT_EQ(body.welds.size(), 2u);
    const auto& [parent, child] = std::tie(body.welds[0], body.welds[1]);
    EXPECT_EQ(parent.last_node, parent.first_node + 1);
    EXPECT_LT(parent.last_node, nodes[parent.rod].cols() - 1);
    EXPECT_GT(parent.first_node, 0);
    EXPECT_EQ(child.first_node, 0);
    EXPECT_EQ(child.last_node, 0);
    EXPECT_LT((nodes[child.rod].col(0) - body.pose.position).norm(), 1e-12);
    const Eigen::Vector3d ends = nodes[parent.rod].col(parent.first_node) + nodes[parent.rod].col(parent.last_node);
    EXPECT_LT((0.5 * ends - body.pose.position).norm(), 1e-12);
    for (const WeldConfig& weld : body.welds)
      for (int node = weld.first_node; node <= weld.last_node; ++node)
        EXPECT_TRUE(held.emplace(weld.rod, node).second);   // nothing is held twice
  }
}

TEST(Generate, weldsOfTreesCountTheRodsBefore)
{
  const SceneConfig scene = parseScene(
      "rods: [{}, {}]\ngenerate:\n  - tree: {levels: 2, children: 2, vertices: 60}\n"
      "  - tree: {name: b, levels: 2, children: 1, vertices: 40}\n"
      "bodies: [{mass: 1, inertia: [1, 1, 1], welds: [{rod: tree_0, edge: -1}]}]");
  ASSERT_EQ(scene.rods.size(), 7u);
  EXPECT_EQ(scene.bodies[0].welds[0].rod, 2);
  EXPECT_EQ(scene.bodies[1].name, "tree_1_joint");
  EXPECT_EQ(scene.bodies[1].welds[0].rod, 2);
  EXPECT_EQ(scene.bodies[1].welds[1].rod, 3);
  EXPECT_EQ(scene.bodies[3].welds[0].rod, 5);
  EXPECT_EQ(scene.bodies[3].welds[1].rod, 6);
}

TEST(Generate, seedsDecide)
{
  const auto tip = [](const std::string& seed) {
    return nodesOf(parseScene("generate: [{tree: {}}]", "t", {"generate.0.tree.seed=" + seed}).rods[40])
        .rightCols<1>()
        .eval();
  };
  EXPECT_EQ(tip("1"), tip("1"));
  EXPECT_GT((tip("1") - tip("2")).norm(), 0.01);
}

TEST(Generate, hairGrowsOutOfItsHead)
{
  const SceneConfig scene = parseScene(
      "generate: [{hair: {strands: 60, edges: 20, length: 0.2, length_variation: 0.5, contact: {}, "
      "head: {center: [1, 2, 3], radius: 0.09, motion: {topic: true}}}}]");
  ASSERT_EQ(scene.rods.size(), 60u);
  ASSERT_EQ(scene.obstacles.size(), 1u);
  EXPECT_EQ(scene.obstacles[0].name, "head");
  EXPECT_EQ(std::get<Sphere>(scene.obstacles[0].shape).radius, 0.09);
  EXPECT_TRUE(std::holds_alternative<TopicMotion>(scene.obstacles[0].motion));
  const Eigen::Vector3d center(1, 2, 3);
  std::vector<Eigen::Matrix3Xd> nodes;
  for (const RodConfig& rod : scene.rods)
  {
    nodes.push_back(nodesOf(rod));
    ASSERT_EQ(nodes.back().cols(), 21);
    EXPECT_NEAR((nodes.back().col(0) - center).norm(), 0.09 + 8e-5, 1e-12);
    EXPECT_GT(nodes.back()(2, 0), 3);   // the upper half
    const double length = (nodes.back().col(20) - nodes.back().col(0)).norm();
    EXPECT_TRUE(length > 0.0999 && length < 0.2001) << length;
    ASSERT_EQ(rod.grasps.size(), 1u);
    EXPECT_EQ(rod.grasps[0].name, rod.name + "_root");
    EXPECT_EQ(std::get<BodyMotion>(rod.grasps[0].motion).body, "head");
    EXPECT_EQ(rod.grasps[0].attach, Attach::initial);
    EXPECT_EQ(rod.grasps[0].last_node, 0);
  }
  for (std::size_t k = 1; k < nodes.size(); ++k)
    for (std::size_t j = 0; j < k; ++j)
      EXPECT_GT(distance(nodes[j], nodes[k]), 0.005);   // roots are spread evenly: 60 on half a ball of 9 cm
}

TEST(Generate, curlIsNaturalOnly)
{
  const SceneConfig scene =
      parseScene("generate: [{hair: {strands: 3, edges: 200, length: 0.2, curl: {radius: 0.005, pitch: 0.02}}}]");
  for (const RodConfig& rod : scene.rods)
  {
    const Eigen::Matrix3Xd rest = restNodes(rod, {0, 0, -9.81}), initial = nodesOf(rod);
    EXPECT_NEAR(edgeLengths(rest, false).sum(), 0.2, 1e-3);
    EXPECT_NEAR((initial.col(200) - initial.col(0)).norm(), 0.2, 1e-3);
    const Eigen::Vector3d e = rest.col(101) - rest.col(100), f = rest.col(102) - rest.col(101);
    const double curvature = e.cross(f).norm() / (e.norm() * e.squaredNorm());
    EXPECT_NEAR(curvature, 0.005 / (0.005 * 0.005 + std::pow(0.02 / (2 * M_PI), 2)), 2);
  }
  EXPECT_FALSE(parseScene("generate: [{hair: {strands: 3}}]").rods[0].initial);
}

struct GeneratorCase
{
  const char* text;
  const char* expected;
};

void PrintTo(const GeneratorCase& c, std::ostream* out) { *out << c.text; }

class BadGenerator : public testing::TestWithParam<GeneratorCase>
{};

TEST_P(BadGenerator, isRefusedWithPathAndRange)
{
  std::string message;
  try
  {
    parseScene(GetParam().text, "test.yaml");
  }
  catch (const SceneError& error)
  {
    message = error.what();
  }
  EXPECT_NE(message.find(GetParam().expected), std::string::npos) << GetParam().text << "\ngave: " << message;
  EXPECT_EQ(message.find('\n'), std::string::npos) << "more than one problem:\n" << message;
  EXPECT_EQ(message.find("test.yaml:1: "), 0u) << message;
}

INSTANTIATE_TEST_SUITE_P(
    All, BadGenerator,
    testing::Values(
        GeneratorCase{"generate: {chain: {}}", "generate: is a map; must be a list"},
        GeneratorCase{"generate: [{}]", "generate.0: must be one of {chain: {...}}, {tree: {...}}, {hair: {...}}"},
        GeneratorCase{"generate: [{chain: {}, tree: {}}]", "must be one of"},
        GeneratorCase{"generate: [{bush: {}}]", "bush: unknown key"},
        GeneratorCase{"generate: [{chain: {links: 0}}]",
                      "generate.0.chain.links = 0: is out of range; must be a whole number in [1, 10000]"},
        GeneratorCase{"generate: [{chain: {spacing: 0.05}}]",
                      "spacing = 0.05: is out of range; must be a number in (0.055, 0.09) m"},
        GeneratorCase{"generate: [{chain: {cross_section: {radius: 0.02}}}]",
                      "the wire is too thick: its radius 0.02 m must be less than a fifth"},
        GeneratorCase{"generate: [{chain: {up: [1, 0, 0]}}]", "up = [1, 0, 0]: is along direction"},
        GeneratorCase{"generate: [{chain: {opening: 2}}]", "in [0, 1.570796327] rad"},
        GeneratorCase{"generate: [{chain: {length: 2}}]", "length = 2: unknown key"},
        GeneratorCase{"generate: [{chain: {}}, {chain: {}}]",
                      "generate.1.chain: makes a rod chain_0, whose name is taken; give the generator another name"},
        GeneratorCase{"{rods: [{name: chain_1}], generate: [{chain: {}}]}", "makes a rod chain_1, whose name is taken"},
        GeneratorCase{"generate: [{tree: {vertices: 200}}]",
                      "vertices = 200: is too few for 57 branches; must be at least 285"},
        GeneratorCase{"generate: [{tree: {vertices: 290}}]",
                      "vertices = 290: gives tree_0 too few (6) for its 7 children"},
        GeneratorCase{"generate: [{tree: {angle: 2}}]", "rad"},
        GeneratorCase{"generate: [{tree: {direction: [0, 0, 0]}}]", "must not be zero"},
        GeneratorCase{"generate: [{tree: {cross_section: {radius: 1}}}]", "unknown key"},
        GeneratorCase{"generate: [{hair: {strands: 0}}]", "in [1, 100000]"},
        GeneratorCase{"generate: [{hair: {head: {motion: free}}}]", "must be one of: fixed, topic"},
        GeneratorCase{"generate: [{hair: {head: {size: 3}}}]", "unknown key"},
        GeneratorCase{"generate: [{hair: {curl: {radius: 0}}}]", "in (0, 1000000] m"},
        GeneratorCase{"{generate: [{hair: {}}], obstacles: [{name: head, shape: {sphere: {}}}]}",
                      "generate.0.hair: makes head, which is also the name of obstacles.0"},
        GeneratorCase{
            "{generate: [{hair: {}}], bodies: [{mass: 1, shape: {sphere: {}}, welds: [{rod: hair_0, edge: 0}]}]}",
            "grasp hair_0_root holds nodes 0 to 0"},
        GeneratorCase{"{}", "rods: is missing"}));

}   // namespace
}   // namespace slender
