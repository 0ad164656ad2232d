#include <algorithm>
#include <cmath>
#include <limits>

#include "read_parts.h"
#include "slender_sim/contact/solids.h"
#include "slender_sim/geometry/mesh_file.h"
#include "slender_sim/geometry/rotation.h"
#include "slender_sim/scene/file_paths.h"
#include "slender_sim/scene/pose_file.h"

/// Poses, shapes, obstacles, and what touches.
namespace slender {

namespace {

const Range friction = Range::closed(0, 100);

Eigen::Quaterniond fromRpy(const Eigen::Vector3d& rpy)
{
  using Eigen::AngleAxisd;
  using Eigen::Vector3d;
  return AngleAxisd(rpy.z(), Vector3d::UnitZ()) * AngleAxisd(rpy.y(), Vector3d::UnitY()) *
         AngleAxisd(rpy.x(), Vector3d::UnitX());
}

Plane readPlane(YamlMap& map, std::optional<Pose>& pose)
{
  const YamlCursor point = map.get("point", "A point of the surface, in place of `pose`. Without the key: the origin.");
  const YamlCursor normal =
      map.get("normal", "Direction out of the solid, in place of `pose`. Without the key: z of the pose.");
  if (!point.present() && !normal.present())
    return {};
  if (pose)
  {
    map.at().problem("has a point or normal, and there is a pose as well; give one or the other");
    return {};
  }
  const auto through = point.vector3(kCoordinate);
  const auto up = normal.vector3(Range::closed(-1e6, 1e6));
  if (up && !(up->norm() > 0))
  {
    normal.problem("must not be zero; it points out of the solid");
    return {};
  }
  pose = Pose{through.value_or(Eigen::Vector3d::Zero()),
              rotationBetween(Eigen::Vector3d::UnitZ(), up.value_or(Eigen::Vector3d::UnitZ()))};
  return {};
}

/// Radius and length of a cylinder or a capsule.
template <class Round>
Round readRound(YamlMap& map)
{
  Round shape;
  map.get("radius", shape.radius, kLength, "Radius about the z axis of the shape. Without the key: 0.1 m.");
  map.get("length", shape.length, kLength,
          "Length along the z axis of the shape, without the round ends of a capsule. Without the key: 0.2 m.");
  return shape;
}

Box readBox(YamlMap& map)
{
  Box box;
  map.get("size", box.size, kLength, "Lengths of the edges along the axes of the shape. Without the key: 0.1 m each.");
  return box;
}

std::optional<Shape> readMesh(YamlMap& map, const ReadContext& context)
{
  const YamlCursor file = map.require("file", "OBJ file with a closed triangle mesh.");
  double scale = 1.0;
  map.get("scale", scale, Range::above(0, 1e6),
          "Factor by which the coordinates of the file are multiplied. Without the key: 1.");
  const auto path = file.text();
  if (!path)
    return std::nullopt;
  auto mesh = std::make_shared<TriangleMesh>();
  const bool good = file.attempt([&] {
    requireRegularFile(context.resolve(*path));
    *mesh = readObj(context.resolve(*path));
    mesh->vertices *= scale;
  });
  return good ? std::optional<Shape>(std::move(mesh)) : std::nullopt;
}

}   // namespace

std::optional<Pose> readPose(const YamlCursor& at)
{
  at.sharesKeysOf("obstacles.N.pose");
  if (!at.present())
    return std::nullopt;
  Pose pose;
  YamlMap map(at);
  map.get("position", pose.position, kCoordinate,
          "Position of the origin of the shape or mesh. Without the key: [0, 0, 0].");
  const YamlCursor orientation = map.get(
      "orientation",
      "Orientation as a unit quaternion [x, y, z, w]. Give either `orientation` or `rpy`. Without both: not turned.");
  const YamlCursor rpy =
      map.get("rpy", "Orientation as roll, pitch and yaw about the fixed axes x, y and z, in this order.");
  orientation.takes("a unit quaternion [x, y, z, w]");
  if (orientation.present() && rpy.present())
  {
    at.problem("must have either orientation: [x, y, z, w] or rpy: [roll, pitch, yaw]");
  }
  else if (orientation.present())
  {
    const auto entries = orientation.numbers(Range::closed(-2, 2));
    if (entries && entries->size() != 4)
    {
      orientation.problem("has " + std::to_string(entries->size()) +
                          " entries; must be a unit quaternion [x, y, z, w]");
    }
    else if (entries)
    {
      const double numbers[7] = {0, 0, 0, (*entries)[0], (*entries)[1], (*entries)[2], (*entries)[3]};
      orientation.attempt([&] { pose.orientation = checkedPose(numbers).orientation; });
    }
  }
  else if (const auto angles = rpy.vector3(Range::closed(-100, 100, "rad")))
  {
    pose.orientation = fromRpy(*angles);
  }
  return pose;
}

void startAtTable(const GivenMotion& motion, const YamlCursor& at, const std::string& what, std::optional<Pose>& pose)
{
  const auto* table = std::get_if<TableMotion>(&motion);
  if (!table)
    return;
  if (pose)
    at.problem("there is a table of poses as well; the " + what + " starts at its first");
  pose = table->poses.evaluate(table->poses.firstTime());
}

std::optional<Shape> readShape(const YamlCursor& at, const ReadContext& context, std::optional<Pose>& pose)
{
  at.sharesKeysOf("obstacles.N.shape");
  if (!at.present())
    return std::nullopt;
  if (!at.isMap())
    return at.problem("must be a map with one shape and its measures, e.g. {plane: {}} or {sphere: {radius: 0.1}}");
  KindMap<Shape> kinds(at);
  kinds.add("plane",
            "A half-space below a plane: z of the pose points out of the solid. `plane: {}` is the floor z = 0.",
            [&](YamlMap& map) { return readPlane(map, pose); });
  kinds.add("sphere", "A sphere about the origin of the pose.", [](YamlMap& map) {
    Sphere sphere;
    map.get("radius", sphere.radius, kLength, "Radius. Without the key: 0.1 m.");
    return sphere;
  });
  kinds.add("box", "A box, centred at the origin of the pose.", readBox);
  kinds.add("cylinder", "A cylinder about z, centred at the origin of the pose.", readRound<Cylinder>);
  kinds.add("capsule", "A cylinder about z with round ends, centred at the origin of the pose.", readRound<Capsule>);
  kinds.add("mesh", "A closed triangle mesh.", [&](YamlMap& map) { return readMesh(map, context); });
  const std::optional<Shape> shape = kinds.read("shapes");
  const bool good = shape && at.attempt([&] { checkShape(*shape); });
  return good ? shape : std::nullopt;
}

std::optional<ContactProperties> readContactProperties(const YamlCursor& at, const char* others, bool of_cloth)
{
  at.sharesKeysOf((std::string(others) + ".N.contact").c_str());
  if (!at.present())
    return std::nullopt;
  ContactProperties contact;
  YamlMap map(at);
  map.get("self", contact.self, "Whether the object touches itself. Without the key: true.");
  map.get(others, contact.others,
          "Whether the object touches others of its kind that have contact. Without the key: true.");
  map.get("obstacles", contact.solids, "Whether the object touches obstacles and bodies. Without the key: true.");
  map.get("friction", contact.friction, friction,
          "Coefficient of friction. Between two objects the geometric mean of both coefficients counts. Without the "
          "key: 0.3.");
  if (of_cloth)
  {
    map.get("thickness", contact.thickness, Range::above(0, 1, "m"),
            "Distance of two layers of cloth in contact; of two cloths the mean counts, and half of it from an "
            "obstacle. Without the key: 0.001 m.");
    map.get(
        "method", contact.method, {{"barrier", ContactMethod::barrier}, {"impulses", ContactMethod::impulses}},
        "`barrier` makes contact a part of the step, so that cloth meets everything that has contact. `impulses` "
        "correct the end of the step: cheaper, but for cloth, obstacles and driven bodies only. Without the key: "
        "barrier if rods, threads, simulated bodies or another cloth with barrier have contact, otherwise impulses; a "
        "cloth that has a max_traction or is a guide always takes impulses.");
  }
  return contact;
}

ContactConfig readContact(const YamlCursor& at, const SceneConfig& scene)
{
  ContactConfig contact;
  YamlMap map(at);
  double smallest = std::numeric_limits<double>::infinity();
  for (const RodConfig& rod : scene.rods)
  {
    if (rod.contact)
    {
      for (const auto* radii : {&rod.cross_section.a, &rod.cross_section.b})
        for (double radius : *radii)
          smallest = std::min(smallest, radius);
    }
  }
  for (const ThreadConfig& thread : scene.threads)
  {
    if (thread.contact)
    {
      smallest =
          std::min(smallest, thread.nozzle ? 0.125 * thread.nozzle->diameter : std::numeric_limits<double>::infinity());
      for (double radius : thread.radius)
        smallest = std::min(smallest, radius);
    }
  }
  double gap = 0.1 * smallest;
  for (const ClothConfig& cloth : scene.cloths)
    if (cloth.contact && cloth.contact->method == ContactMethod::barrier)
      gap = std::min(gap, 0.5 * cloth.contact->thickness);
  if (!std::isfinite(gap))   // bodies alone
    for (const BodyConfig& body : scene.bodies)
      if (body.isSimulatedSolid())
        gap = std::min(gap, 5e-3 * boundingRadius(*body.shape));
  const bool any = std::isfinite(gap);
  contact.gap = any ? gap : 0.0;
  map.get("gap", contact.gap, Range::above(0, 1, "m"),
          "Distance of two surfaces at which they begin to repel each other. Without the key: a tenth of the smallest "
          "radius of the rods and threads with contact (of a nozzle a quarter of its radius counts), and at most half "
          "the smallest thickness of cloths with method barrier. If only simulated bodies touch: 0.005 times their "
          "smallest bounding radius.");
  map.get("slip_speed", contact.slip_speed, Range::above(0, 10, "m/s"),
          "Friction that sticks is a spring, which slips when it is stretched by this speed times time.step. Without "
          "the key: 1e-4 m/s.");
  map.finish();
  if (at.present() && !any && map.sound())
  {
    at.problem(
        "no rod, thread, or cloth with method: barrier takes part; give those that do a contact of their own, for "
        "example contact: {friction: 0.3} (contact of cloth by impulses has a thickness and no gap)");
  }
  return contact;
}

ObstacleConfig readObstacle(const YamlCursor& at, const ReadContext& context, const std::string& default_name)
{
  ObstacleConfig obstacle;
  YamlMap map(at);
  obstacle.name = default_name;
  map.getName(obstacle.name,
              "Name of the obstacle; bodies and obstacles need different names. Without the key: obstacle if there "
              "is one obstacle, otherwise obstacle0, obstacle1, ...");
  const YamlCursor at_pose = map.get("pose",
                                     "Where the shape is at the start. Without the key: at the origin, not turned. "
                                     "Not with a table of poses, whose first pose it would contradict.");
  std::optional<Pose> pose = readPose(at_pose);
  assign(obstacle.shape, readShape(map.require("shape", "Shape of the obstacle: give one."), context, pose));
  map.get("friction", obstacle.friction, friction,
          "Coefficient of friction. Between two objects the geometric mean of both coefficients counts. Without the "
          "key: that of the other object.");
  assign(obstacle.motion,
         readSolidMotion(map.get("motion", "How the obstacle moves. Without the key: it stands."), context, false));
  startAtTable(obstacle.motion, at_pose.present() ? at_pose : at, "obstacle", pose);
  assign(obstacle.pose, pose);
  return obstacle;
}

}   // namespace slender
