#include <algorithm>
#include <cmath>
#include <numeric>

#include <Eigen/Geometry>

#include "generators.h"
#include "slender_sim/geometry/rotation.h"

namespace slender {

namespace {

constexpr int least_nodes = 5;   // of a branch

struct Branch
{
  int parent = -1, level = 0;
  double at = 0.0;   ///< on the parent, fraction of its length
  double azimuth = 0.0, incline = 0.0, length = 0.0, radius = 0.0;
  int nodes = 0;
  Eigen::Vector3d root{0, 0, 0}, direction{0, 0, 1};
};

/// What the scene says of a tree.
struct Tree
{
  std::string name = "tree";
  int vertices = 2158, levels = 3, children = 7;
  double length = 3.0, radius = 0.05, length_ratio = 0.5, radius_ratio = 0.45, incline = 0.9;
  double taper = 0.4, joint_density = 0.0;
  Eigen::Vector3d root{0, 0, 0}, up;
  RodConfig rod;   ///< of which each branch is a copy
  Motion motion;
};

std::vector<Branch> grow(const Tree& tree, Dice& dice)
{
  std::vector<Branch> branches(1);
  branches[0].length = tree.length;
  branches[0].radius = tree.radius;
  branches[0].root = tree.root;
  branches[0].direction = tree.up;
  for (std::size_t b = 0; b < branches.size(); ++b)
  {
    const Branch parent = branches[b];
    for (int c = 0; parent.level + 1 < tree.levels && c < tree.children; ++c)
    {
      Branch child;
      child.parent = static_cast<int>(b);
      child.level = parent.level + 1;
      child.at = 0.3 + 0.65 * (c + dice.between(0.25, 0.75)) / tree.children;
      child.azimuth = kGoldenAngle * c + dice.between(-0.4, 0.4);
      child.incline = tree.incline * dice.between(0.8, 1.2);
      child.length = parent.length * tree.length_ratio * (1.2 - 0.5 * child.at) * dice.between(0.9, 1.1);
      child.radius = parent.radius * tree.radius_ratio;
      branches.push_back(child);
    }
  }
  return branches;
}

/// As many nodes as asked for in all, shared out by length.
void shareNodes(std::vector<Branch>& branches, int vertices)
{
  const double total = std::accumulate(branches.begin(), branches.end(), 0.0,
                                       [](double sum, const Branch& b) { return sum + b.length; });
  const int spare = vertices - least_nodes * static_cast<int>(branches.size());
  std::vector<std::pair<double, std::size_t>> rests;
  int given = 0;
  for (std::size_t b = 0; b < branches.size(); ++b)
  {
    const double share = spare * branches[b].length / total;
    branches[b].nodes = least_nodes + static_cast<int>(share);
    given += static_cast<int>(share);
    rests.emplace_back(static_cast<int>(share) - share, b);
  }
  std::sort(rests.begin(), rests.end());
  for (int k = 0; k < spare - given; ++k)
    ++branches[rests[static_cast<std::size_t>(k)].second].nodes;
}

Tree readTree(YamlMap& map, const ReadContext& context)
{
  Tree tree;
  map.getName(tree.name, "Name of the tree; its branches are NAME_0 (the trunk), NAME_1, ... Without the key: tree.");
  map.get("vertices", tree.vertices, Range::closed(least_nodes, max_edges),
          "Number of nodes of all branches together. Without the key: 2158.");
  map.get("levels", tree.levels, Range::closed(1, 6), "Number of levels: 1 is a trunk alone. Without the key: 3.");
  map.get("children", tree.children, Range::closed(1, 30),
          "Number of side branches of each branch. Without the key: 7.");
  map.get("length", tree.length, kLength, "Length of the trunk. Without the key: 3 m.");
  map.get("radius", tree.radius, Range::above(0, 10, "m"), "Radius of the trunk at its root. Without the key: 0.05 m.");
  const Range ratio = Range::above(0, 1);
  map.get("length_ratio", tree.length_ratio, ratio,
          "Length of a side branch over that of its parent, about. Without the key: 0.5.");
  map.get("radius_ratio", tree.radius_ratio, ratio,
          "Radius of a side branch over that of its parent. Without the key: 0.45.");
  map.get("angle", tree.incline, Range::between(0, 0.5 * M_PI, "rad"),
          "Angle between a side branch and its parent, about. Without the key: 0.9 rad.");
  map.get("taper", tree.taper, ratio, "Radius of a branch at its tip over that at its root. Without the key: 0.4.");
  map.get("root", tree.root, kCoordinate, "Position of the root. Without the key: [0, 0, 0].");
  tree.up = readDirection(map.get("direction", "Direction of the trunk. Without the key: [0, 0, 1]."),
                          Eigen::Vector3d::UnitZ());
  readTraits(map, tree.rod);
  tree.joint_density = tree.rod.material.density;
  map.get("joint_density", tree.joint_density, Range::above(0, 1e6, "kg/m^3"),
          "Mass per volume of the balls that join branches. Without the key: that of the branches.");
  tree.motion =
      readMotion(map.get("motion", "How the root moves, which the grasp NAME_root holds. Without the key: fixed."),
                 context, false);
  return tree;
}

/// Places a branch where it leaves its parent, at an edge, whose ends are given.
void leaveParent(Branch& branch, const Eigen::Vector3d& from, const Eigen::Vector3d& to)
{
  const Eigen::Vector3d tangent = (to - from).normalized();
  const Eigen::Vector3d normal = rotateAbout(anyNormal(tangent), tangent, branch.azimuth);
  branch.root = 0.5 * (from + to);
  branch.direction = std::cos(branch.incline) * tangent + std::sin(branch.incline) * normal;
}

/// The ball that carries a branch and an edge of its parent.
BodyConfig jointBall(const Branch& branch, const Branch& parent, double density, const WeldConfig& on_parent,
                     const WeldConfig& on_branch)
{
  BodyConfig ball;
  const double radius = 1.5 * parent.radius;
  ball.shape = Sphere{radius};
  ball.mass = density * 4.0 / 3.0 * M_PI * std::pow(radius, 3);
  ball.inertia = 0.4 * ball.mass * radius * radius * Eigen::Matrix3d::Identity();
  ball.pose.position = branch.root;
  ball.contact = false;
  ball.welds = {on_parent, on_branch};
  return ball;
}

}   // namespace

/// A trunk with side branches, theirs, and so on. Each branch is a tapered rod; where it leaves its parent, a small
/// rigid ball carries both.
void generateTree(const YamlCursor& at, const ReadContext& context, int first_rod, Generated& out)
{
  YamlMap map(at);
  Tree tree = readTree(map, context);
  const YamlCursor at_vertices = map.find("vertices");
  int seed = 1;
  map.get("seed", seed, Range::closed(0, 1'000'000'000),
          "Seed of the random places and angles of the branches. Without the key: 1.");
  map.finish();
  if (!map.sound())
    return;
  Dice dice(seed);
  long count = 0, of_level = 1;
  for (int level = 0; level < tree.levels; ++level, of_level *= tree.children)
    count += of_level;
  const YamlCursor& place = at_vertices.present() ? at_vertices : at;
  if (tree.vertices < least_nodes * count)   // before they grow: 6 levels of 30 children are 750 million
  {
    place.problem("is too few for " + std::to_string(count) + " branches; must be at least " +
                  std::to_string(least_nodes * count));
    return;
  }
  if (!context.claim(place, tree.vertices))
    return;
  std::vector<Branch> branches = grow(tree, dice);
  shareNodes(branches, tree.vertices);

  std::vector<std::vector<Eigen::Vector3d>> points(branches.size());
  std::vector<int> last_joint(branches.size(), -1);   // edge of the branch that carries its last ball so far
  for (std::size_t b = 0; b < branches.size(); ++b)
  {
    Branch& branch = branches[b];
    RodConfig& rod = tree.rod;
    rod.name = tree.name + "_" + std::to_string(b);
    rod.grasps.clear();
    if (branch.parent >= 0)
    {
      const Branch& parent = branches[branch.parent];
      const auto& line = points[branch.parent];
      const int edge = std::max({static_cast<int>(branch.at * (parent.nodes - 1)), last_joint[branch.parent] + 2, 1});
      if (edge > parent.nodes - 3)
      {
        place.problem("gives " + tree.name + "_" + std::to_string(branch.parent) + " too few (" +
                      std::to_string(parent.nodes) + ") for its " + std::to_string(tree.children) +
                      " children; raise it, or lower levels or children");
        return;
      }
      last_joint[branch.parent] = edge;
      leaveParent(branch, line[edge], line[edge + 1]);
      BodyConfig ball = jointBall(branch, parent, tree.joint_density, {first_rod + branch.parent, edge, edge + 1},
                                  {first_rod + static_cast<int>(b), 0, 0});
      ball.name = rod.name + "_joint";
      out.bodies.emplace_back(std::move(ball), at);
    }
    else
    {
      GraspConfig grasp;
      grasp.name = tree.name + "_root";
      grasp.motion = tree.motion;
      grasp.attach = Attach::initial;
      rod.grasps.push_back(std::move(grasp));
    }
    // Branches turn up towards their tips.
    for (int i = 0; i < branch.nodes; ++i)
    {
      const double u = static_cast<double>(i) / (branch.nodes - 1);
      points[b].push_back(branch.root + branch.length * (u * branch.direction + 0.15 * u * u * tree.up));
    }
    rod.centerline = {std::nullopt, nullptr, points[b]};
    rod.cross_section.a = rod.cross_section.b = {branch.radius, tree.taper * branch.radius};
    rod.edges = branch.nodes - 1;
    out.rods.emplace_back(rod, at);
  }
}

}   // namespace slender
