// Simulated bodies that touch each other and obstacles: what stands, what falls freely, what collides, each shape on
// each shape.
#include <algorithm>
#include <cmath>
#include <sstream>
#include <stdexcept>
#include <string>
#include <vector>

#include "slender_sim/scene/reader.h"
#include "slender_sim/scene/simulation.h"
#include "slender_sim/study/study.h"

namespace slender::study {
namespace {

using Eigen::Vector3d;

constexpr double kG = 9.81;   // [m/s^2]

/// A scene as text, body by body.
class BodyScene
{
public:
  BodyScene(double step, double gap, const Vector3d& gravity = {0, 0, -kG})
  {
    for (std::ostringstream* text : {&head_, &bodies_, &obstacles_})
      text->precision(17);
    head_ << "time: {step: " << step << ", duration: 1000, integrator: implicit_euler}\ncontact: {gap: " << gap
          << "}\ngravity: [" << gravity.x() << ", " << gravity.y() << ", " << gravity.z() << "]\n";
  }
  /// `pitch`: about y [rad]; `velocity`: a YAML map.
  void addBody(const std::string& shape, double mass, const Vector3d& at, double friction, double pitch = 0.0,
               const std::string& velocity = "{linear: [0, 0, 0]}")
  {
    bodies_ << "  - {name: body" << count_++ << ", mass: " << mass << ", shape: {" << shape
            << "}, friction: " << friction << ", velocity: " << velocity << ", " << pose(at, pitch) << "}\n";
  }
  void addObstacle(const std::string& shape, const Vector3d& at, double friction)
  {
    obstacles_ << "  - {name: obstacle" << count_++ << ", shape: {" << shape << "}, friction: " << friction << ", "
               << pose(at, 0.0) << "}\n";
  }
  Simulation simulation() const
  {
    const std::string obstacles = obstacles_.str();
    return Simulation(
        parseScene(head_.str() + "bodies:\n" + bodies_.str() + (obstacles.empty() ? "" : "obstacles:\n" + obstacles)));
  }

private:
  static std::string pose(const Vector3d& at, double pitch)
  {
    std::ostringstream text;
    text.precision(17);
    text << "pose: {position: [" << at.x() << ", " << at.y() << ", " << at.z() << "], rpy: [0, " << pitch << ", 0]}";
    return text.str();
  }

  std::ostringstream head_, bodies_, obstacles_;
  int count_ = 0;
};

std::string boxText(const Vector3d& size)
{
  std::ostringstream text;
  text.precision(17);
  text << "box: {size: [" << size.x() << ", " << size.y() << ", " << size.z() << "]}";
  return text.str();
}

void stepFor(Simulation& s, double seconds, const std::string& what)
{
  for (int k = static_cast<int>(std::round(seconds / s.config().time.step)); k > 0; --k)
    if (const StepReport report = s.step(s.defaultInputs()); !report.ok)
      throw std::runtime_error(what + ": " + report.message);
}

/// Largest motion of a body after half a second in which gaps take up the weights [m].
double motionOf(Simulation s, double seconds, const std::string& what)
{
  stepFor(s, 0.5, what);
  const SceneState settled = s.state();
  double most = 0.0;
  for (double t = 0.5; t < seconds; t += 0.5)
  {
    stepFor(s, 0.5, what);
    for (std::size_t k = 0; k < settled.bodies.size(); ++k)
      most = std::max(most, (s.state().bodies[k].X_WB.position - settled.bodies[k].X_WB.position).norm());
  }
  return most;
}

Simulation stackOfBoxes(int count)
{
  constexpr double kSide = 0.1, kGap = 0.0004;
  BodyScene scene(0.005, kGap);
  for (int k = 0; k < count; ++k)
    scene.addBody(boxText(Vector3d::Constant(kSide)), 1.0, {0, 0, 0.5 * kSide + 0.5 * kGap + (kSide + 0.5 * kGap) * k},
                  0.3);
  scene.addObstacle("plane: {}", Vector3d::Zero(), 0.3);
  return scene.simulation();
}

/// Two pairs of cards that lean on each other, a card across, and a pair on top.
Simulation houseOfCards()
{
  constexpr double kLength = 0.1, kWidth = 0.06, kThick = 0.001, kGap = 1e-4, kRoom = 0.6 * kGap, kMu = 0.6;
  const double lean = 25 * M_PI / 180, half = 0.5 * kLength * std::cos(lean) + 0.5 * kThick * std::sin(lean);
  BodyScene scene(0.005, kGap);
  const auto addPair = [&](double x, double z) {
    const double off = 0.5 * kLength * std::sin(lean) + 0.5 * kThick * std::cos(lean) + 0.5 * kRoom;
    for (const double side : {-1.0, 1.0})
      scene.addBody(boxText({kThick, kWidth, kLength}), 0.002, {x + side * off, 0, z + half + kRoom}, kMu,
                    -side * lean);
    return z + 2 * half + kRoom;
  };
  const double apart = kLength * std::sin(lean) + 0.006;
  double top = addPair(-apart, 0.0);
  addPair(apart, 0.0);
  const double across = 2 * apart + 0.06;
  scene.addBody(boxText({across, kWidth, kThick}), 0.002 * across / kLength, {0, 0, top + kRoom + 0.5 * kThick}, kMu);
  addPair(0.0, top + kRoom + kThick);
  scene.addObstacle("plane: {}", Vector3d::Zero(), kMu);
  return scene.simulation();
}

/// A cube between four walls with friction, which are nearer than the gap.
Simulation shaft(double clearance, double speed, double step)
{
  constexpr double kGap = 0.0005;
  BodyScene scene(step, kGap);
  scene.addBody(boxText(Vector3d::Constant(0.1)), 1.0, {0, 0, 0.5}, 0.5, 0.0,
                "{linear: [0, 0, " + std::to_string(-speed) + "]}");
  const double at = 0.15 + clearance * kGap;
  for (const double side : {-at, at})
  {
    scene.addObstacle(boxText({0.2, 1, 40}), {side, 0, 0}, 0.5);
    scene.addObstacle(boxText({1, 0.2, 40}), {0, side, 0}, 0.5);
  }
  return scene.simulation();
}

/// Whether a cube with much friction on a slope of this angle [degrees] tips over within six seconds.
bool tips(double angle)
{
  const double slope = angle * M_PI / 180;
  BodyScene scene(0.005, 1e-5, {kG * std::sin(slope), 0, -kG * std::cos(slope)});
  scene.addBody(boxText(Vector3d::Constant(0.1)), 1.0, {0, 0, 0.05 + 0.5e-5}, 2.0);
  scene.addObstacle("plane: {}", Vector3d::Zero(), 2.0);
  Simulation s = scene.simulation();
  stepFor(s, 6.0, "tipping cube");
  return std::abs(s.state().bodies[0].X_WB.orientation.y()) > 0.1;
}

void addStanding(StudyContext& context)
{
  context.row()
      .set("case", "stack of ten boxes, motion in 10 s")
      .check(motionOf(stackOfBoxes(10), context.quick() ? 3.0 : 10.0, "stack"), 0.0, 1e-4, "stands");
  context.row()
      .set("case", "house of seven cards, motion in 10 s")
      .check(motionOf(houseOfCards(), context.quick() ? 2.0 : 10.0, "cards"), 0.0, 1e-4, "stands");
  double low = 43.0, high = 47.0;
  for (int k = 0; k < (context.quick() ? 4 : 8); ++k)
    (tips(0.5 * (low + high)) ? high : low) = 0.5 * (low + high);
  context.row().set("case", "cube tips [degrees]").check(0.5 * (low + high), 45.0, 0.2, "support as wide as the cube");
}

/// Speed of a fall, against the same without walls.
void addShafts(StudyContext& context)
{
  for (const double clearance : {1.0, 0.1, 0.01, 1e-3, 1e-4})
    for (const double speed : {0.0, 10.0, 1000.0})
    {
      const double step = speed < 100 ? 0.005 : 1e-4;
      Simulation s = shaft(clearance, speed, step);
      stepFor(s, 40 * step, "shaft");
      context.row()
          .set("case",
               "shaft, clearance " + std::to_string(clearance) + " of the gap, " + std::to_string(speed) + " m/s")
          .check(s.state().bodies[0].velocity.linear.z(), -speed - kG * 40 * step, 1e-9 * std::max(1.0, speed),
                 "free fall");
    }
}

void addCollision(StudyContext& context)
{
  BodyScene scene(0.005, 0.0004, Vector3d::Zero());
  scene.addBody("sphere: {radius: 0.1}", 1.0, {-0.3, 0.02, 0}, 0.3, 0.0, "{linear: [4, 0, 0]}");
  scene.addBody("sphere: {radius: 0.1}", 3.0, {0.1, 0, 0}, 0.3);
  Simulation s = scene.simulation();
  stepFor(s, 0.2, "two balls");
  const Vector3d momentum =
      s.state().bodies[0].velocity.linear + 3.0 * s.state().bodies[1].velocity.linear - Vector3d(4, 0, 0);
  context.row()
      .set("case", "two balls, change of momentum [kg m/s]")
      .check(momentum.norm(), 0.0, 4e-12, "what one loses, the other gains");
}

/// A body that lies on an obstacle of any shape: at rest at the height of both, and pressing it with its weight.
void addShapes(StudyContext& context)
{
  struct Shape
  {
    const char *name, *text;
    double half;   ///< height above its centre [m]
  };
  const Shape shapes[] = {{"sphere", "sphere: {radius: 0.1}", 0.1},
                          {"box", "box: {size: [0.2, 0.2, 0.2]}", 0.1},
                          {"cylinder", "cylinder: {radius: 0.1, length: 0.2}", 0.1},
                          {"small sphere", "sphere: {radius: 0.03}", 0.03},
                          {"small box", "box: {size: [0.02, 0.02, 0.02]}", 0.01},
                          {"small capsule", "capsule: {radius: 0.02, length: 0.02}", 0.03}};
  constexpr double kGap = 0.0004;
  for (const Shape& upper : shapes)
    for (const Shape& lower : shapes)
    {
      BodyScene scene(0.005, kGap);
      const double height = upper.half + lower.half + 0.5 * kGap;
      scene.addBody(upper.text, 1.0, {0, 0, height}, 0.5);
      scene.addObstacle(lower.text, Vector3d::Zero(), 0.5);
      Simulation s = scene.simulation();
      stepFor(s, 0.3, std::string(upper.name) + " on " + lower.name);
      context.row()
          .set("case", std::string(upper.name) + " on " + lower.name + ", height [m]")
          .check(s.state().bodies[0].X_WB.position.z(), height, kGap, "within the gap");
    }
}

}   // namespace

void runBodyContact(StudyContext& context)
{
  const std::vector<void (*)(StudyContext&)> parts = {addStanding, addShafts, addCollision, addShapes};
  for (std::size_t k = 0; k < parts.size(); ++k)
  {
    context.progress(static_cast<int>(k), static_cast<int>(parts.size()), "bodies");
    parts[k](context);
  }
}

const StudyRegistration kBodyContactRegistration{
    "body_contact", "bodies that stand on, fall between, and collide with obstacles and each other", runBodyContact};

}   // namespace slender::study
