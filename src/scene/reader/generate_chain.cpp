#include <algorithm>
#include <cmath>

#include <Eigen/Geometry>

#include "generators.h"
#include "slender_sim/geometry/curves.h"

namespace slender {

namespace {

/// What the scene says of a chain; see the meanings of its keys.
struct Chain
{
  std::string name = "chain";
  int links = 7, edges = 30;
  double radius = 0.05, opening = 0.0, spacing = 0.0;   ///< [m], [rad], [m]
  Eigen::Vector3d from{0, 0, 0}, along, up;             ///< [m], unit vectors
};

/// `motions`: of the outermost points of the first and the last link. `rod`: what all links have in common.
void makeLinks(const Chain& chain, const Motion (&motions)[2], RodConfig rod, const YamlCursor& at, Generated& out)
{
  const auto& [name, links, edges, radius, opening, spacing, from, along, up] = chain;
  const Eigen::Vector3d side = up.cross(along).normalized();
  for (int k = 0; k < links; ++k)
  {
    rod.name = name + "_" + std::to_string(k);
    const Eigen::Vector3d center = from + k * spacing * along;
    // An opening is at the side, where it does not let the neighbours go as long as the link keeps its shape.
    const Eigen::Vector3d across = k % 2 == 0 ? side : along.cross(side), axis = along.cross(across);
    const Eigen::Vector3d start = center + Eigen::AngleAxisd(0.5 * opening, axis) * (radius * across);
    const double angle = 2 * M_PI - opening;
    rod.centerline = {edges, [=](int n, const Eigen::Vector3d&) { return arcCurve(center, start, axis, angle, n); }};
    rod.closed = opening == 0;
    rod.edges = edges;
    rod.grasps.clear();
    for (int end = 0; end < 2; ++end)
    {
      if (k != (end == 0 ? 0 : links - 1))
        continue;
      Eigen::Index outermost = 0;
      const Eigen::Matrix3Xd nodes = arcCurve(center, start, axis, angle, edges).leftCols(edges);
      (nodes.transpose() * (end == 0 ? -along : along)).maxCoeff(&outermost);
      GraspConfig grasp;
      grasp.name = name + (end == 0 ? "_start" : "_end");
      grasp.first_node = grasp.last_node = static_cast<int>(outermost);
      grasp.motion = motions[end];
      grasp.attach = Attach::initial;
      rod.grasps.push_back(std::move(grasp));
    }
    out.rods.emplace_back(rod, at);
  }
}

}   // namespace

/// Round links in a row, each turned by a quarter against the last and hooked into it. The outermost points of the
/// first and the last are held.
void generateChain(const YamlCursor& at, const ReadContext& context, Generated& out)
{
  YamlMap map(at);
  Chain chain;
  map.getName(chain.name, "Name of the chain; its links are NAME_0, NAME_1, ... Without the key: chain.");
  map.get("links", chain.links, Range::closed(1, 10'000), "Number of links. Without the key: 7.");
  map.get("radius", chain.radius, kLength,
          "Radius of each link, to the centreline of its wire. Without the key: 0.05 m.");
  map.get("opening", chain.opening, Range::closed(0, 0.5 * M_PI, "rad"),
          "Angle of the gap in each link. Without the key: 0, closed links.");
  const YamlCursor at_spacing =
      map.get("spacing",
              "Distance of the centres of two neighbouring links, more than the link's radius plus the wire's and less "
              "than twice their difference. Without the key: twice the link's radius minus four times the wire's.");
  const YamlCursor at_up =
      map.get("up", "Direction about which the links are turned, not along `direction`. Without the key: [0, 0, 1].");
  map.get("edges", chain.edges, Range::closed(3, 10'000), "Number of edges of each link. Without the key: 30.");
  map.get("from", chain.from, kCoordinate, "Centre of the first link. Without the key: [0, 0, 0].");
  chain.along = readDirection(map.get("direction", "Direction of the chain. Without the key: [1, 0, 0]."),
                              Eigen::Vector3d::UnitX());
  at_spacing.takes("a number in (R + r, 2 (R - r)) m, with the radius R of a link and r of the wire");
  chain.up = readDirection(at_up, Eigen::Vector3d::UnitZ());
  RodConfig rod;
  rod.name = chain.name;
  const YamlCursor at_section =
      map.get("cross_section", "Cross-section of the wire. Without the key: a radius of 0.005 m.");
  rod.cross_section = readCrossSection(at_section, chain.edges);
  readTraits(map, rod);
  warnOfRoundContact(at_section, rod);
  const Motion motions[2] = {readMotion(map.get("start_motion",
                                                "How the outermost point of the first link moves, which the grasp "
                                                "NAME_start holds. Without the key: fixed."),
                                        context, false),
                             readMotion(map.get("end_motion",
                                                "How the outermost point of the last link moves, which the grasp "
                                                "NAME_end holds. Without the key: fixed."),
                                        context, false)};
  double thickness = 0.0;
  for (const auto* radii : {&rod.cross_section.a, &rod.cross_section.b})
    for (double r : *radii)
      thickness = std::max(thickness, r);
  // Closer, links two apart meet; farther, neighbours do.
  const Range allowed = Range::between(chain.radius + thickness, 2 * (chain.radius - thickness), "m");
  chain.spacing = at_spacing.number(allowed).value_or(2 * chain.radius - 4 * thickness);
  map.finish();
  if (chain.up.cross(chain.along).norm() < 1e-6)
    at_up.problem("is along direction; must point away from it");
  if (map.sound() && !allowed.holds(chain.spacing))
  {
    at.problem("the wire is too thick: its radius " + shortNumber(thickness) +
               " m must be less than a fifth of the links' radius " + shortNumber(chain.radius) + " m");
  }
  if (!map.sound() || !context.claim(at, (chain.edges + 1.0) * chain.links))
    return;
  makeLinks(chain, motions, rod, at, out);
}

}   // namespace slender
