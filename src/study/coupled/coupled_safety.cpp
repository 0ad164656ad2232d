// Random scenes with all kinds of objects. An independent check looks at all pairs after each step.
#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <random>
#include <sstream>
#include <string>
#include <vector>

#include "mixed_check.h"
#include "slender_sim/geometry/mesh_shapes.h"
#include "slender_sim/scene/reader.h"
#include "slender_sim/study/study.h"

namespace slender::study {

namespace {

using Eigen::Vector3d;

constexpr double kSimulated = 1.0;   // [s] of each scene

class Draw
{
public:
  explicit Draw(unsigned seed) : engine_(seed) {}
  double between(double low, double high) { return std::uniform_real_distribution<double>(low, high)(engine_); }
  /// Of numbers that differ by orders of magnitude.
  double scale(double low, double high) { return std::exp(between(std::log(low), std::log(high))); }
  int count(int low, int high) { return std::uniform_int_distribution<int>(low, high)(engine_); }
  Vector3d direction()
  {
    for (;;)
    {
      const Vector3d v(between(-1, 1), between(-1, 1), between(-1, 1));
      if (v.norm() > 0.1 && v.norm() < 1.0)
        return v.normalized();
    }
  }

private:
  std::mt19937 engine_;
};

std::string list(const Vector3d& v)
{
  std::ostringstream out;
  out.precision(10);
  out << "[" << v.x() << ", " << v.y() << ", " << v.z() << "]";
  return out.str();
}

/// A scene out of three to seven objects of all kinds above a floor. Each object begins in a place of its own, of a
/// grid with the distance kApart, and what moves freely falls, or is thrown at another place.
class RandomScene
{
public:
  explicit RandomScene(unsigned seed) : draw_(seed)
  {
    for (int i = -1; i <= 1; ++i)
      for (int j = -1; j <= 1; ++j)
        for (int k = 0; k < 3; ++k)
          places_.push_back({kApart * i, kApart * j, kApart * (k + 1)});
    const int floor = draw_.count(0, 3);
    if (floor == 0)
      add(obstacles_, "floor", "shape: {plane: {point: [0, 0, 0], normal: [0, 0, 1]}}, friction: 0.3");
    else if (floor == 1)
      add(obstacles_, "floor", "shape: {box: {size: [4, 4, 0.2]}}, pose: {position: [0, 0, -0.1]}, friction: 0.3");
    if (draw_.count(0, 3) == 0)
      addSheet(true);
    if (draw_.count(0, 1) == 0)
      addDriven();
    const int objects = draw_.count(3, 6);
    for (int k = 0; k < objects; ++k)
      addObject();
  }

  SceneConfig config() const
  {
    std::ostringstream text;
    text << "time: {step: " << step_ << ", duration: 100, integrator: implicit_euler}\n"
         << "contact: {gap: " << gap_ << "}\n";
    for (const auto& [key, entries] :
         {std::make_pair("rods", &rods_), std::make_pair("threads", &threads_), std::make_pair("cloths", &cloths_),
          std::make_pair("bodies", &bodies_), std::make_pair("obstacles", &obstacles_)})
      if (!entries->empty())
        text << key << ":\n" << *entries;
    SceneConfig scene = parseScene(text.str(), "mixed");
    for (BodyConfig& body : scene.bodies)
      giveMesh(body.name, body.shape);
    for (ObstacleConfig& obstacle : scene.obstacles)
    {
      std::optional<Shape> shape = obstacle.shape;
      giveMesh(obstacle.name, shape);
      obstacle.shape = *shape;
    }
    return scene;
  }
  /// "rope, ball, driven box".
  const std::string& kinds() const { return kinds_; }
  int steps() const { return static_cast<int>(std::lround(kSimulated / step_)); }

private:
  static constexpr double kApart = 0.25, kReach = 0.1;   ///< of places; of an object around its place [m]

  void add(std::string& entries, const std::string& name, const std::string& rest)
  {
    entries += "  - {name: " + name + ", " + rest + "}\n";
  }
  std::string named(const char* kind)
  {
    kinds_ += (kinds_.empty() ? "" : ", ") + std::string(kind);
    std::string name = kind + std::to_string(count_++);
    std::replace(name.begin(), name.end(), ' ', '_');
    return name;
  }
  Vector3d takePlace()
  {
    const auto at = places_.begin() + draw_.count(0, static_cast<int>(places_.size()) - 1);
    const Vector3d place = *at;
    places_.erase(at);
    return place;
  }

  void addObject()
  {
    switch (draw_.count(0, 9))
    {
      case 0: return addRope();
      case 1: return addRing();
      case 2: return addNeedle();
      case 3: return addSheet(false);
      case 4: return addThread();
      case 5: return addObstacle();
      default: return addBody();
    }
  }

  std::string rodEnd(double radius, double modulus)
  {
    std::ostringstream out;
    out << ", cross_section: {radius: " << radius << "}, material: {density: " << draw_.scale(300, 8000)
        << ", youngs_modulus: " << modulus
        << ", poissons_ratio: 0.4}, damping: {stiffness: 0.001}, contact: {friction: " << friction() << "}";
    return out.str();
  }
  double friction() { return draw_.count(0, 3) == 0 ? 0.0 : draw_.between(0.1, 1.0); }

  void addRope()
  {
    const Vector3d place = takePlace(), half = 0.9 * kReach * draw_.direction();
    const std::string first = std::to_string(count_) + ": {edges: [0]}",
                      last = std::to_string(count_) + ": {edges: [-1]}";
    const std::string held[] = {"", ", grasps: {a" + first + "}", ", grasps: {a" + first + ", b" + last + "}"};
    add(rods_, named("rope"),
        "centerline: {straight: {from: " + list(place - half) + ", to: " + list(place + half) +
            ", edges: " + std::to_string(draw_.count(6, 20)) + "}}" +
            rodEnd(draw_.scale(0.001, 0.006), draw_.scale(1e5, 1e8)) + held[draw_.count(0, 2)]);
  }
  void addRing()
  {
    const Vector3d place = takePlace(), axis = draw_.direction(), out = axis.unitOrthogonal();
    const int edges = draw_.count(12, 24);
    std::ostringstream text;
    text.precision(12);
    text << "closed: true, centerline: {arc: {center: " << list(place)
         << ", start: " << list(place + 0.8 * kReach * out) << ", axis: " << list(axis)
         << ", angle: " << 2 * M_PI * (edges - 1) / edges << ", edges: " << edges - 1 << "}}"
         << rodEnd(draw_.scale(0.001, 0.005), draw_.scale(1e6, 1e9));
    add(rods_, named("ring"), text.str());
  }
  /// A stiff wire that falls tip first.
  void addNeedle()
  {
    const Vector3d place = takePlace(),
                   half = 0.8 * kReach * (Vector3d(0, 0, 1) + 0.1 * draw_.direction()).normalized();
    add(rods_, named("needle"),
        "centerline: {straight: {from: " + list(place - half) + ", to: " + list(place + half) + ", edges: 6}}" +
            rodEnd(draw_.scale(0.0003, 0.002), 2e11));
  }
  /// A small sheet, or one that takes a whole level of places and is held at its corners or free.
  void addSheet(bool large)
  {
    Vector3d middle, u, v;
    if (large)
    {
      const double z = kApart * draw_.count(2, 3);
      middle = {0, 0, z};
      u = 2.2 * kApart * Vector3d::UnitX();
      v = 2.2 * kApart * Vector3d::UnitY();
      places_.erase(std::remove_if(places_.begin(), places_.end(), [&](const Vector3d& p) { return p.z() == z; }),
                    places_.end());
    }
    else
    {
      middle = takePlace();
      const Vector3d normal = draw_.direction();
      u = 1.3 * kReach * normal.unitOrthogonal();
      v = normal.cross(u);
    }
    const int cells = draw_.count(4, large ? 9 : 6), n = cells + 1;
    std::ostringstream text;
    text.precision(10);
    text << "grid: {corner: " << list(middle - 0.5 * (u + v)) << ", sides: [" << list(u) << ", " << list(v)
         << "], cells: " << cells << ", pattern: alternating}, material: {area_density: " << draw_.scale(0.05, 0.5)
         << ", thickness: 0.0005, youngs_modulus: " << draw_.scale(1e5, 1e7)
         << ", poissons_ratio: 0.3}, bending: {modulus: " << draw_.scale(1e-7, 1e-4)
         << "}, damping: {stiffness: 0.001}, contact: {method: barrier, friction: " << friction()
         << ", thickness: " << draw_.scale(0.0005, 0.003) << "}";
    const int held = draw_.count(0, 2);
    if (held == 1)
      text << ", grasps: {corners" << count_ << ": {vertices: [0, " << cells << ", " << n * cells << ", " << n * n - 1
           << "]}}";
    if (held == 2)
      text << ", grasps: {edge" << count_ << ": {edge: upper}}";
    add(cloths_, named(large ? "large sheet" : "sheet"), text.str());
  }
  void addThread()
  {
    const Vector3d place = takePlace(), half = 0.8 * kReach * draw_.direction();
    const double radius = draw_.scale(0.002, 0.006);
    std::ostringstream text;
    text << "centerline: {straight: {from: " << list(place - half) << ", to: " << list(place + half)
         << ", edges: 16}}, radius: " << radius << ", fluid: {density: 1300, viscosity: " << draw_.scale(10, 1000)
         << ", surface_tension: 0.04}, ends: {oldest: " << (draw_.count(0, 1) ? "free" : "held")
         << "}, edges: {longest: " << 0.012 << ", shortest: 0.003}, breakup_radius: " << 0.05 * radius
         << ", contact: {friction: " << friction() << "}, region: {from: [-2, -2, -1], to: [2, 2, 2]}";
    add(threads_, named("thread"), text.str());
  }
  /// A shape within `reach`, and its name.
  std::string shape(double reach, std::string& kind)
  {
    std::ostringstream text;
    switch (draw_.count(0, 4))
    {
      case 0: text << "sphere: {radius: " << draw_.scale(0.2, 0.9) * reach << "}", kind = "ball"; break;
      case 1:
        text << "box: {size: [" << draw_.scale(0.1, 1.1) * reach << ", " << draw_.scale(0.1, 1.1) * reach << ", "
             << draw_.scale(0.1, 1.1) * reach << "]}";
        kind = "box";
        break;
      case 2:
        text << "cylinder: {radius: " << draw_.scale(0.1, 0.6) * reach << ", length: " << draw_.scale(0.1, 1.4) * reach
             << "}";
        kind = "cylinder";
        break;
      case 3:
        text << "capsule: {radius: " << draw_.scale(0.1, 0.4) * reach << ", length: " << draw_.scale(0.2, 1.2) * reach
             << "}";
        kind = "capsule";
        break;
      default: text << "sphere: {radius: " << draw_.scale(0.3, 0.9) * reach << "}", kind = "mesh"; break;
    }
    return "shape: {" + text.str() + "}";
  }
  std::string pose(const Vector3d& place)
  {
    return "pose: {position: " + list(place) + ", rpy: " + list(M_PI * draw_.direction()) + "}";
  }
  void addBody()
  {
    const Vector3d place = takePlace();
    const Vector3d at(kApart * draw_.count(-1, 1), kApart * draw_.count(-1, 1), kApart * draw_.count(0, 3));
    const double speed = draw_.count(0, 1) ? draw_.between(0, 20) : 0.0;
    std::string kind;
    const std::string form = shape(kReach, kind);
    std::ostringstream text;
    text << "mass: " << draw_.scale(0.003, 1.0) << ", " << form << ", " << pose(place)
         << ", velocity: {linear: " << list(speed * (at - place).normalized())
         << ", angular: " << list(draw_.between(0, 30) * draw_.direction()) << "}, friction: " << friction();
    add(bodies_, named(kind.c_str()), text.str());
  }
  void addObstacle()
  {
    std::string kind;
    const Vector3d place = takePlace();
    const std::string form = shape(kReach, kind);
    add(obstacles_, named(("fixed " + kind).c_str()), form + ", " + pose(place) + ", friction: 0.3");
  }
  /// It goes through the places of a row, one level above the lowest or higher, and turns. Nothing fixed is in its way.
  void addDriven()
  {
    const double y = kApart * draw_.count(-1, 1), z = kApart * draw_.count(2, 3), away = draw_.count(0, 1) ? 1 : -1;
    const Vector3d from(-1.5 * kApart * away, y, z), to(1.5 * kApart * away, y, z);
    places_.erase(
        std::remove_if(places_.begin(), places_.end(),
                       [&](const Vector3d& p) { return std::abs(p.y() - y) < 1e-9 && std::abs(p.z() - z) < 1e-9; }),
        places_.end());
    std::string kind;
    const std::string form = shape(0.6 * kReach, kind);
    const double time = 3.0 * kApart / draw_.scale(0.5, 8.0);
    std::ostringstream text;
    text << form << ", friction: 0.3, motion: {table: [[0, " << from.x() << ", " << y << ", " << z << ", 0, 0, 0, 1], ["
         << time << ", " << to.x() << ", " << y << ", " << z << ", 0, 0, 0.7071068, 0.7071068]]}";
    add(obstacles_, named(("driven " + kind).c_str()), text.str());
  }
  /// What is named a mesh becomes one: a flat icosahedron, with the radius of its sphere.
  static void giveMesh(const std::string& name, std::optional<Shape>& shape)
  {
    if (name.find("mesh") == std::string::npos || !shape)
      return;
    TriangleMesh mesh = icosphere(std::get<Sphere>(*shape).radius, 0);
    mesh.vertices = Vector3d(1.0, 0.8, 0.5).asDiagonal() * mesh.vertices;
    shape = std::make_shared<const TriangleMesh>(std::move(mesh));
  }

  Draw draw_;
  const double step_ = draw_.count(0, 1) ? 0.005 : 0.01, gap_ = draw_.scale(0.0003, 0.002);   // [s], [m]
  std::vector<Vector3d> places_;
  std::string rods_, threads_, cloths_, bodies_, obstacles_, kinds_;
  int count_ = 0;
};

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
  for (const ThreadGroupState& group : state.threads)
    for (const ThreadState& thread : group.threads)
      for (int i = 0; i < thread.nodes(); ++i)
        good = good && thread.x[i].allFinite() && thread.v[i].allFinite();
  for (const ClothState& cloth : state.cloths)
    good = good && cloth.x.allFinite() && cloth.v.allFinite();
  for (const RigidBodyState& body : state.bodies)
    good = good && body.X_WB.position.allFinite() && body.velocity.linear.allFinite();
  return good;
}

void runScene(StudyContext& context, int number, Tally& tally)
{
  const RandomScene drawn(1000u + static_cast<unsigned>(number));
  Simulation scene(drawn.config());
  MixedCheck check(scene, MixedCheck::Faces::without_held_corners);
  Tally own;
  std::string first;
  int k = 0, iterations = 0;
  for (; k < drawn.steps(); ++k)
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
    context.note("scene " + std::to_string(number) + " (" + drawn.kinds() + "), " + first);
  context.row()
      .set("scene", number)
      .set("kinds", drawn.kinds())
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
  const std::vector<int> numbers = context.cases(context.quick() ? 24 : 1000);
  const int scenes = static_cast<int>(numbers.size());
  Tally tally;
  for (int k = 0; k < scenes; ++k)
  {
    const int number = numbers[static_cast<std::size_t>(k)];
    context.progress(k, scenes, RandomScene(1000u + static_cast<unsigned>(number)).kinds());
    runScene(context, number, tally);
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
    "coupled_safety", "random scenes that mix all kinds of objects: nothing passes through anything", runCoupledSafety,
    true};

}   // namespace slender::study
