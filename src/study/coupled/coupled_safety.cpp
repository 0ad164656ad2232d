// Random scenes in which rods, cloths, bodies and obstacles meet; after each step an independent check of all pairs.
#include <cmath>
#include <limits>
#include <random>
#include <sstream>
#include <string>

#include "mixed_check.h"
#include "slender_sim/scene/reader.h"
#include "slender_sim/study/study.h"

namespace slender::study {

namespace {

struct MixedScene
{
  const char* kind;
  std::string text;
  int steps;
};

class Draw
{
public:
  explicit Draw(unsigned seed) : engine_(seed) {}
  double between(double low, double high) { return std::uniform_real_distribution<double>(low, high)(engine_); }
  /// Of numbers that differ by orders of magnitude.
  double scale(double low, double high) { return std::exp(between(std::log(low), std::log(high))); }
  int count(int low, int high) { return std::uniform_int_distribution<int>(low, high)(engine_); }

private:
  std::mt19937 engine_;
};

std::string vec(double x, double y, double z)
{
  std::ostringstream out;
  out << "[" << x << ", " << y << ", " << z << "]";
  return out.str();
}

std::string head(double step, const std::string& gravity)
{
  std::ostringstream out;
  out << "time: {step: " << step << ", duration: 100, integrator: implicit_euler}\ngravity: " << gravity << "\n";
  return out.str();
}

std::string rod(const std::string& name, const std::string& from, const std::string& to, int edges, double radius,
                double modulus, const std::string& grasps = "")
{
  std::ostringstream out;
  out << "  - {name: " << name << ", centerline: {straight: {from: " << from << ", to: " << to << ", edges: " << edges
      << "}}, cross_section: {radius: " << radius << "}, material: {density: 1100, youngs_modulus: " << modulus
      << ", poissons_ratio: 0.4}, contact: {friction: 0.3}" << (grasps.empty() ? "" : ", grasps: " + grasps) << "}\n";
  return out.str();
}

/// A square cloth about the origin at a height.
std::string cloth(const std::string& name, double side, double z, int cells, double thickness,
                  const std::string& grasps = "")
{
  std::ostringstream out;
  out << "  - {name: " << name << ", grid: {corner: " << vec(-0.5 * side, -0.5 * side, z) << ", sides: [[" << side
      << ", 0, 0], [0, " << side << ", 0]], cells: " << cells
      << ", pattern: alternating}, material: {area_density: 0.2, thickness: 0.0005, youngs_modulus: 1.0e6, "
         "poissons_ratio: 0.3}, bending: {modulus: 1.0e-6}, contact: {method: barrier, friction: 0.3, thickness: "
      << thickness << "}" << (grasps.empty() ? "" : ", grasps: " + grasps) << "}\n";
  return out.str();
}

std::string body(const std::string& name, double mass, const std::string& shape, const std::string& position,
                 const std::string& velocity, const std::string& rpy = "[0, 0, 0]")
{
  std::ostringstream out;
  out << "  - {name: " << name << ", mass: " << mass << ", shape: {" << shape << "}, pose: {position: " << position
      << ", rpy: " << rpy << "}, velocity: {linear: " << velocity << "}, friction: 0.3}\n";
  return out.str();
}

std::string ball(double radius) { return "sphere: {radius: " + std::to_string(radius) + "}"; }

/// One rope is driven at up to 10 m/s across another one, which is free.
MixedScene crossingRopes(Draw& draw)
{
  const double r = draw.scale(0.002, 0.01), speed = draw.between(2, 10), off = 3.0 * r;
  const int edges = draw.count(8, 24);
  const double turn = draw.between(0.3, 1.57);
  std::ostringstream motion;
  motion << "{table: [[0, 0, 0, 0, 0, 0, 0, 1], [1, 0, 0, " << -speed << ", 0, 0, 0, 1]]}, attach: initial";
  return {"ropes that cross",
          head(0.01, "[0, 0, 0]") + "rods:\n" +
              rod("driven", vec(-0.3, 0, off), vec(0.3, 0, off), edges, r, 1e7,
                  "{a: {edges: [0], motion: " + motion.str() + "}, b: {edges: [-1], motion: " + motion.str() + "}}") +
              rod("free", vec(-0.3 * std::cos(turn), -0.3 * std::sin(turn), 0),
                  vec(0.3 * std::cos(turn), 0.3 * std::sin(turn), 0), draw.count(8, 24), r, 1e7),
          8};
}

/// A ball is thrown at a sheet that is held at its corners.
MixedScene ballOnSheet(Draw& draw)
{
  const double radius = draw.scale(0.005, 0.06), speed = draw.between(1, 20);
  const int cells = draw.count(4, 9), n = cells + 1;
  std::ostringstream corners;
  corners << "{corners: {vertices: [0, " << cells << ", " << n * cells << ", " << n * n - 1 << "]}}";
  return {"a ball on a sheet",
          head(0.01, "[0, 0, -9.81]") + "cloths:\n" + cloth("sheet", 0.5, 0, cells, 0.002, corners.str()) +
              "bodies:\n" +
              body("ball", draw.scale(0.001, 1.0), ball(radius),
                   vec(draw.between(-0.1, 0.1), draw.between(-0.1, 0.1), radius + 0.01), vec(0, 0, -speed)),
          12};
}

/// A stiff wire, thin as a needle, falls tip first on a sheet.
MixedScene needle(Draw& draw)
{
  const int cells = draw.count(4, 9), n = cells + 1;
  std::ostringstream corners;
  corners << "{corners: {vertices: [0, " << cells << ", " << n * cells << ", " << n * n - 1 << "]}}";
  const double x = draw.between(-0.1, 0.1), y = draw.between(-0.1, 0.1), lean = draw.between(0.0, 0.03);
  return {"a needle on a sheet",
          head(0.01, vec(0, 0, -draw.scale(10, 200))) + "rods:\n" +
              rod("needle", vec(x, y, 0.004), vec(x + lean, y, 0.11), 6, draw.scale(0.0003, 0.002), 2e11) +
              "cloths:\n" + cloth("sheet", 0.4, 0, cells, 0.002, corners.str()),
          20};
}

/// A sheet, ropes and bodies fall on each other and on a floor.
MixedScene heap(Draw& draw)
{
  const double r = draw.scale(0.003, 0.01);
  std::string text = head(0.01, "[0, 0, -9.81]") + "rods:\n";
  const int ropes = draw.count(1, 2);
  for (int k = 0; k < ropes; ++k)
  {
    const double z = 0.02 + 0.05 * k, turn = draw.between(0, 3);
    text += rod("rope" + std::to_string(k), vec(-0.2 * std::cos(turn), -0.2 * std::sin(turn), z),
                vec(0.2 * std::cos(turn), 0.2 * std::sin(turn), z + 0.01), 10, r, 1e6);
  }
  text += "cloths:\n" + cloth("sheet", 0.3, 0.15, draw.count(4, 7), 0.002);
  text += "bodies:\n" + body("ball", draw.scale(0.01, 1.0), ball(0.03), vec(draw.between(-0.1, 0.1), 0, 0.21),
                             vec(0, 0, -draw.between(0, 5)));
  text += body("box", draw.scale(0.01, 1.0), "box: {size: [0.06, 0.05, 0.04]}", vec(0.0, draw.between(-0.1, 0.1), 0.32),
               vec(0, 0, -draw.between(0, 5)), vec(draw.between(0, 3), draw.between(0, 3), 0));
  text += "obstacles:\n  - {name: floor, shape: {plane: {point: [0, 0, 0], normal: [0, 0, 1]}}, friction: 0.3}\n";
  return {"a heap", text, 40};
}

/// A heavy ball is thrown at a rope that is held at both ends, in front of a box.
MixedScene ropeAndBall(Draw& draw)
{
  const double r = draw.scale(0.002, 0.008), radius = draw.scale(0.01, 0.05);
  return {"a ball against a rope and a box",
          head(0.01, "[0, 0, -9.81]") + "rods:\n" +
              rod("rope", vec(-0.3, 0, 0), vec(0.3, 0, 0), draw.count(8, 20), r, 1e7,
                  "{a: {edges: [0]}, b: {edges: [-1]}}") +
              "bodies:\n" +
              body("ball", draw.scale(0.01, 1.0), ball(radius), vec(draw.between(-0.1, 0.1), 0, r + radius + 0.01),
                   vec(0, draw.between(-2, 2), -draw.between(1, 20))) +
              "obstacles:\n  - {name: box, shape: {box: {size: [0.5, 0.5, 0.05]}}, pose: {position: [0, 0, -0.2]}}\n",
          15};
}

/// Two sheets, one of them thrown by the wind of gravity against the other, and a capsule between them.
MixedScene sheets(Draw& draw)
{
  const int cells = draw.count(4, 8), n = cells + 1;
  std::ostringstream edge;
  edge << "{corners: {vertices: [0, " << cells << ", " << n * cells << ", " << n * n - 1 << "]}}";
  return {"sheets and a capsule",
          head(0.01, vec(0, 0, -draw.scale(9.81, 100))) + "cloths:\n" +
              cloth("held", 0.4, 0, cells, 0.003, edge.str()) + cloth("free", 0.3, 0.1, draw.count(4, 8), 0.002) +
              "bodies:\n" +
              body("capsule", draw.scale(0.01, 0.5), "capsule: {radius: 0.02, length: 0.1}",
                   vec(draw.between(-0.05, 0.05), 0, 0.05), vec(0, 0, 0), vec(1.57, draw.between(0, 0.3), 0)),
          25};
}

MixedScene drawnScene(int number)
{
  Draw source(1000u + static_cast<unsigned>(number));
  switch (number % 6)
  {
    case 0: return crossingRopes(source);
    case 1: return ballOnSheet(source);
    case 2: return needle(source);
    case 3: return heap(source);
    case 4: return ropeAndBall(source);
    default: return sheets(source);
  }
}

struct Tally
{
  int penetrations = 0, thickness_violations = 0, not_finite = 0, unexplained = 0, refused = 0;
  double least_room = std::numeric_limits<double>::infinity();
};

bool finite(const SceneState& state)
{
  bool good = true;
  for (const RodState& rod : state.rods)
    good = good && rod.x.allFinite() && rod.v.allFinite();
  for (const ClothState& cloth : state.cloths)
    good = good && cloth.x.allFinite() && cloth.v.allFinite();
  for (const RigidBodyState& body : state.bodies)
    good = good && body.X_WB.position.allFinite() && body.velocity.linear.allFinite();
  return good;
}

void runScene(StudyContext& context, int number, Tally& tally)
{
  const MixedScene mixed = drawnScene(number);
  Simulation scene(parseScene(mixed.text, "mixed"));
  MixedCheck check(scene);
  Tally own;
  std::string first;
  int k = 0, iterations = 0;
  for (; k < mixed.steps; ++k)
  {
    const StepReport report = scene.step(scene.defaultInputs());
    if (!report.ok)
    {
      ++own.refused;
      own.unexplained += report.message.empty();
      first = first.empty() ? "step " + std::to_string(k) + " refused: " + report.message : first;
      break;
    }
    iterations += report.iterations;
    own.not_finite += !finite(scene.state());
    const MixedFindings found = check.check(scene);
    own.penetrations += found.penetrations;
    own.thickness_violations += found.thickness_violations;
    own.least_room = std::min(own.least_room, found.least_room);
    if (!found.first.empty() && first.empty())
      first = "step " + std::to_string(k) + ": " + found.first;
  }
  if (!first.empty())
    context.note("scene " + std::to_string(number) + ", " + mixed.kind + ", " + first);
  context.row()
      .set("scene", number)
      .set("kind", mixed.kind)
      .set("steps", k)
      .set("iterations_per_step", static_cast<double>(iterations) / std::max(1, k))
      .set("least_room_mm", 1e3 * own.least_room)
      .set("thickness_violations", own.thickness_violations)
      .set("penetrations", own.penetrations)
      .set("refused", own.refused);
  tally.penetrations += own.penetrations;
  tally.thickness_violations += own.thickness_violations;
  tally.not_finite += own.not_finite;
  tally.unexplained += own.unexplained;
  tally.refused += own.refused;
  tally.least_room = std::min(tally.least_room, own.least_room);
}

}   // namespace

void runCoupledSafety(StudyContext& context)
{
  const int scenes = context.quick() ? 24 : 1000;
  Tally tally;
  for (int k = 0; k < scenes; ++k)
  {
    context.progress(k, scenes, drawnScene(k).kind);
    runScene(context, k, tally);
  }
  context.metric("scenes", scenes);
  context.metric("penetrations", tally.penetrations);
  context.metric("thickness_violations", tally.thickness_violations);
  context.metric("nan_count", tally.not_finite);
  context.metric("unexplained_failures", tally.unexplained);
  context.metric("refused", tally.refused);
  context.metric("least_room_mm", 1e3 * tally.least_room);
  context.note(
      "After each step all pairs are checked by brute force: distances against radii and thicknesses, and by linking "
      "integrals and solid angles whether anything is on the other side of what it met.");
}

const StudyRegistration kCoupledSafetyRegistration{
    "coupled_safety", "random scenes that mix rods, cloths, bodies and obstacles: nothing passes through anything",
    runCoupledSafety};

}   // namespace slender::study
