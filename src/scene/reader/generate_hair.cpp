#include <algorithm>
#include <cmath>

#include <Eigen/Geometry>

#include "generators.h"
#include "slender_sim/geometry/curves.h"
#include "slender_sim/geometry/rotation.h"

namespace slender {

/// Strands on the upper part of a ball, which is an obstacle; their roots follow it. They start straight out, where
/// nothing touches, whatever their natural curl.
void generateHair(const YamlCursor& at, const ReadContext& context, Generated& out)
{
  const std::size_t before = at.problems().size();
  YamlMap map(at);
  const std::string name = map.get("name").name().value_or("hair");
  Dice dice(map.get("seed").integer(0, 1'000'000'000).value_or(1));
  const int strands = map.get("strands").integer(1, 100'000).value_or(100);
  const int edges = map.get("edges").integer(2, 10'000).value_or(49);
  const double length = map.get("length").number(kGeneratorLength).value_or(0.15);
  const double variation = map.get("length_variation").number(Range::closed(0, 0.9)).value_or(0.0);
  const double cap = map.get("cap").number(Range::above(0, M_PI, "rad")).value_or(0.5 * M_PI);
  const Eigen::Vector3d up = readDirection(map.get("up"), Eigen::Vector3d::UnitZ());

  YamlMap head_map(map.get("head"));
  ObstacleConfig head;
  head.name = head_map.get("name").name().value_or("head");
  head.pose.position = head_map.get("center").vector3(kGeneratorPosition).value_or(Eigen::Vector3d::Zero());
  const double head_radius = head_map.get("radius").number(kGeneratorLength).value_or(0.1);
  head.shape = Sphere{head_radius};
  assign(head.friction, head_map.get("friction").number(Range::closed(0, 100)));
  const YamlCursor motion = head_map.get("motion");
  assign(head.motion, readSolidMotion(motion, context, false));
  head_map.finish();
  if (const auto* table = std::get_if<TableMotion>(&head.motion))
    head.pose = table->poses.evaluate(table->poses.firstTime());

  const YamlCursor at_curl = map.get("curl");
  YamlMap curl(at_curl);
  const double curl_radius = curl.get("radius").number(kGeneratorLength).value_or(0.004);
  const double curl_pitch = curl.get("pitch").number(kGeneratorLength).value_or(0.02);
  curl.finish();

  RodConfig rod;
  const YamlCursor at_section = map.get("cross_section");
  rod.cross_section = readCrossSection(at_section, edges);
  if (!at_section.present())
    rod.cross_section = {{4e-5}, {4e-5}};
  rod.name = name;
  readTraits(map, rod);
  warnOfRoundContact(at_section, rod);
  map.finish();
  if (at.problems().size() != before || !context.claim(at, (edges + 1.0) * strands))
    return;

  const double root_distance = head_radius + 2 * std::max(rod.cross_section.a[0], rod.cross_section.b[0]);
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
    const StraightCurve straight{root, root + own_length * out_W, edges, 1.0};
    rod.name = name + "_" + std::to_string(k);
    rod.centerline = straight;
    rod.initial = std::nullopt;
    const double phase = dice.between(0, 2 * M_PI);
    if (at_curl.present())
    {
      const double turns = own_length / std::hypot(2 * M_PI * curl_radius, curl_pitch);
      const Eigen::Matrix3Xd helix = helixCurve(Eigen::Vector3d::Zero(), out_W, curl_radius, curl_pitch, turns, edges);
      PolylineCurve curled;
      for (Eigen::Index i = 0; i < helix.cols(); ++i)
        curled.points.push_back(rotateAbout(helix.col(i), out_W, phase));
      rod.centerline = std::move(curled);
      rod.initial = straight;
    }
    GraspConfig grasp;
    grasp.name = rod.name + "_root";
    grasp.motion = BodyMotion{head.name};
    grasp.attach = Attach::initial;
    rod.grasps = {std::move(grasp)};
    out.rods.emplace_back(ReadRod{rod, edges}, at);
  }
  out.obstacles.emplace_back(std::move(head), at);
}

}   // namespace slender
