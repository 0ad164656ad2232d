#include <algorithm>
#include <cmath>

#include <Eigen/Geometry>

#include "generators.h"
#include "slender_sim/geometry/curves.h"
#include "slender_sim/geometry/rotation.h"

namespace slender {

namespace {

/// The ball on which the strands grow.
ObstacleConfig readHead(YamlMap& map, const ReadContext& context)
{
  YamlMap head_map(map.get("head", "The ball on which the strands grow, an obstacle. The roots follow its motion."));
  ObstacleConfig head;
  head.name = "head";
  Sphere ball{0.1};
  head_map.getName(head.name, "Name of the obstacle. Without the key: head.");
  head_map.get("center", head.pose.position, kCoordinate,
               "Centre of the ball at the start. Without the key: [0, 0, 0].");
  head_map.get("radius", ball.radius, kLength, "Radius of the ball. Without the key: 0.1 m.");
  head.shape = ball;
  head_map.get("friction", head.friction, Range::closed(0, 100),
               "Coefficient of friction. Between two objects the geometric mean of both coefficients counts. Without "
               "the key: that of the other object.");
  const YamlCursor motion = head_map.get("motion", "How the ball moves. Without the key: it stands.");
  assign(head.motion, readSolidMotion(motion, context, false));
  if (const auto* table = std::get_if<TableMotion>(&head.motion))
    head.pose = table->poses.evaluate(table->poses.firstTime());
  return head;
}

/// A helix of the given arc length about an axis through its root, turned about the axis by `phase` [rad].
Curve curled(double length, double radius, double pitch, int edges, const Eigen::Vector3d& axis, double phase)
{
  const double turns = length / std::hypot(2 * M_PI * radius, pitch);
  const Eigen::Matrix3Xd helix = helixCurve(Eigen::Vector3d::Zero(), axis, radius, pitch, turns, edges);
  Curve curve;
  for (Eigen::Index i = 0; i < helix.cols(); ++i)
    curve.points.push_back(rotateAbout(helix.col(i), axis, phase));
  return curve;
}

}   // namespace

/// Strands on the upper part of a ball, which is an obstacle; their roots follow it. They start straight out, where
/// nothing touches, whatever their natural curl.
void generateHair(const YamlCursor& at, const ReadContext& context, Generated& out)
{
  YamlMap map(at);
  std::string name = "hair";
  int seed = 1, strands = 100, edges = 49;
  double length = 0.15, variation = 0.0, cap = 0.5 * M_PI, curl_radius = 0.004, curl_pitch = 0.02;
  map.getName(name, "Name of the hair; strands are NAME_0, ... Without the key: hair.");
  map.get("seed", seed, Range::closed(0, 1'000'000'000), "Seed of the random places and lengths. Without the key: 1.");
  map.get("strands", strands, Range::closed(1, 100'000), "Number of strands. Without the key: 100.");
  map.get("edges", edges, Range::closed(2, 10'000), "Number of edges of each strand. Without the key: 49.");
  map.get("length", length, kLength, "Length of the longest strand. Without the key: 0.15 m.");
  map.get("length_variation", variation, Range::closed(0, 0.9),
          "Share of the length by which strands may be shorter. Without the key: 0.");
  map.get("cap", cap, Range::above(0, M_PI, "rad"),
          "Angle from `up` within which strands grow on the ball. Without the key: pi/2, half of the ball.");
  const Eigen::Vector3d up = readDirection(
      map.get("up", "Direction of the middle of the hair. Without the key: [0, 0, 1]."), Eigen::Vector3d::UnitZ());

  ObstacleConfig head = readHead(map, context);
  const YamlCursor at_curl = map.get(
      "curl",
      "Natural curl of the strands, helices about their straight axes. Without the key the strands are straight.");
  YamlMap curl(at_curl);
  curl.get("radius", curl_radius, kLength, "Radius of the helix. Without the key: 0.004 m.");
  curl.get("pitch", curl_pitch, kLength, "Rise of the helix per turn. Without the key: 0.02 m.");
  curl.finish();

  RodConfig rod;
  const YamlCursor at_section =
      map.get("cross_section", "Cross-section of each strand. Without the key: a radius of 4e-5 m.");
  rod.cross_section = readCrossSection(at_section, edges);
  if (!at_section.present())
    rod.cross_section = {{4e-5}, {4e-5}};
  rod.name = name;
  rod.edges = edges;
  readTraits(map, rod);
  warnOfRoundContact(at_section, rod);
  map.finish();
  if (!map.sound() || !context.claim(at, (edges + 1.0) * strands))
    return;

  const double root_distance =
      std::get<Sphere>(head.shape).radius + 2 * std::max(rod.cross_section.a[0], rod.cross_section.b[0]);
  Dice dice(seed);
  const Eigen::Vector3d e1 = anyNormal(up), e2 = up.cross(e1);
  for (int k = 0; k < strands; ++k)
  {
    // Evenly over the cap (a spiral of equal areas), a little stirred.
    const double z = 1 - (1 - std::cos(cap)) * (k + dice.between(0.3, 0.7)) / strands;
    const double rho = std::sqrt(std::max(0.0, 1 - z * z));
    const double azimuth = kGoldenAngle * k;
    const Eigen::Vector3d out_W =
        head.pose.orientation * (rho * (std::cos(azimuth) * e1 + std::sin(azimuth) * e2) + z * up);
    const Eigen::Vector3d root = head.pose.position + root_distance * out_W;
    const double own_length = length * (1 - variation * dice.between(0, 1));
    const Curve straight = straightLine(root, root + own_length * out_W, edges);
    rod.name = name + "_" + std::to_string(k);
    rod.centerline = straight;
    rod.initial = std::nullopt;
    const double phase = dice.between(0, 2 * M_PI);
    if (at_curl.present())
    {
      rod.centerline = curled(own_length, curl_radius, curl_pitch, edges, out_W, phase);
      rod.initial = straight;
    }
    GraspConfig grasp;
    grasp.name = rod.name + "_root";
    grasp.motion = BodyMotion{head.name};
    grasp.attach = Attach::initial;
    rod.grasps = {std::move(grasp)};
    out.rods.emplace_back(rod, at);
  }
  out.obstacles.emplace_back(std::move(head), at);
}

}   // namespace slender
