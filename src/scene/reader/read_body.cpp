#include <algorithm>

#include "read_parts.h"
#include "slender_sim/rod/rigid_body.h"

namespace slender {

namespace {

/// [Ixx, Iyy, Izz] or the rows of a symmetric matrix.
std::optional<Eigen::Matrix3d> readInertia(const YamlCursor& at)
{
  at.takes("[Ixx, Iyy, Izz] of numbers in (0, 1e+15] kg m^2, or three rows of a symmetric matrix");
  const auto rows = at.items(3, 3);
  if (rows.empty())
    return std::nullopt;
  Eigen::Matrix3d inertia = Eigen::Matrix3d::Zero();
  if (!rows[0].isList())
  {
    const auto diagonal = at.vector3(Range::above(0, 1e15, "kg m^2"));
    inertia.diagonal() = diagonal.value_or(Eigen::Vector3d::Ones());
    return diagonal ? std::optional<Eigen::Matrix3d>(inertia) : std::nullopt;
  }
  for (int i = 0; i < 3; ++i)
  {
    const auto row = rows[i].vector3(Range::closed(-1e15, 1e15, "kg m^2"));
    if (!row)
      return std::nullopt;
    inertia.row(i) = *row;
  }
  if ((inertia - inertia.transpose()).norm() > 1e-9 * inertia.norm())
    return at.problem("must be symmetric");
  return Eigen::Matrix3d(0.5 * (inertia + inertia.transpose()));
}

/// Mass and inertia from the file or from the shape; moves the body's frame to the shape's centre of mass.
void readMass(YamlMap& map, bool shape_given, BodyConfig& body)
{
  const YamlCursor mass =
      map.get("mass", "Mass of the body. Give either `mass` or `density`; bodies with a given motion need neither.");
  const YamlCursor density = map.get("density", "Mass per volume of `shape`, from which mass and inertia follow.");
  const YamlCursor at_inertia =
      map.get("inertia",
              "Moments of inertia about the centre of mass in the body's axes: [Ixx, Iyy, Izz], or the rows of a "
              "symmetric matrix. Without the key: those of the shape.");
  const std::size_t before = mass.problems().size();
  const auto kilograms = mass.number(Range::above(0, 1e9, "kg"));
  const auto per_volume = density.number(Range::above(0, 1e6, "kg/m^3"));
  const auto inertia = readInertia(at_inertia);
  if (mass.present() && density.present())
    map.at().problem("must have either mass or density");
  else if (!mass.present() && !density.present() && !body.motion)
    map.at().problem("must have a mass, or a density and a shape");
  else if (density.present() && !shape_given)
    density.problem("needs a shape to be the density of");
  else if (!at_inertia.present() && !shape_given && !body.motion)
    at_inertia.problem("is missing; a body without a shape needs [Ixx, Iyy, Izz] or three rows, in kg m^2");
  if (mass.problems().size() != before || (shape_given && !body.shape))
    return;
  const bool good = (density.present() ? density : mass).attempt([&] {
    if (kilograms && inertia)
    {
      body.mass = *kilograms;
    }
    else if ((kilograms || per_volume) && body.shape)
    {
      const MassProperties solid = massProperties(*body.shape);
      body.mass = kilograms ? *kilograms : *per_volume * solid.volume;
      body.inertia = body.mass * solid.unit_inertia;
      if (!inertia && !body.motion)
      {
        body.X_BS.position = -solid.center;
        body.pose.position = body.pose * solid.center;
      }
    }
  });
  if (!good)
    return;
  assign(body.inertia, inertia);
  (at_inertia.present() ? at_inertia : mass.present() ? mass : density).attempt([&] { checkBody(body); });
}

std::optional<WeldConfig> readWeld(const YamlCursor& at, const std::vector<RodConfig>& rods)
{
  YamlMap map(at);
  const YamlCursor at_rod = map.require("rod", "Name of the rod that the body holds.");
  const YamlCursor edge = map.require("edge",
                                      "Edge of the rod that the body holds; a negative index counts from the end. An "
                                      "end edge of an open rod, 0 or -1, means the section at the end node.");
  const auto name = at_rod.text();
  if (!name)
    return std::nullopt;
  const auto found = std::find_if(rods.begin(), rods.end(), [&](const RodConfig& rod) { return rod.name == *name; });
  if (found == rods.end())
  {
    std::vector<std::string> names;
    for (const RodConfig& rod : rods)
      names.push_back(rod.name);
    return at_rod.problem("is no rod of the scene" + didYouMean(*name, names) + itHas(names));
  }
  const int edges = found->edges;
  // no edges: reported where the rod is
  const auto index = edges > 0 ? edge.integer(-edges, edges - 1) : std::nullopt;
  if (!index)
    return std::nullopt;
  const std::size_t before = edge.problems().size();
  const int held = *index < 0 ? *index + edges : *index;
  const auto [first, last] = nodesOfEdges(edge, held, held, *found);
  return edge.problems().size() == before
             ? std::optional<WeldConfig>({static_cast<int>(found - rods.begin()), first, last})
             : std::nullopt;
}

BodyConfig readBody(const YamlCursor& at, const ReadContext& context, const std::string& default_name)
{
  BodyConfig body;
  YamlMap map(at);
  body.name = default_name;
  map.getName(body.name,
              "Name of the body; bodies and obstacles need different names. Without the key: body if there is one "
              "body, otherwise body0, body1, ...");
  body.motion = readSolidMotion(
      map.get("motion", "How the body moves. Without the key, or with free, it is simulated: forces move it."), context,
      true);
  const YamlCursor at_pose = map.get("pose",
                                     "Where the shape is at the start. Without the key: at the origin, not turned. Not "
                                     "with a table of poses, whose first pose it would contradict.");
  const YamlCursor at_shape =
      map.get("shape", "Shape of the body: give one. Without the key the body has no shape, and touches nothing.");
  std::optional<Pose> pose = readPose(at_pose);
  body.shape = readShape(at_shape, context, pose);
  if (body.motion)
    startAtTable(*body.motion, at_pose.present() ? at_pose : at, "body", pose);
  assign(body.pose, pose);
  readMass(map, at_shape.present(), body);
  YamlMap velocity(map.get("velocity", "Velocity of a simulated body at the start. Without the key: at rest."));
  velocity.get("linear", body.velocity.linear, Range::closed(-1e5, 1e5, "m/s"),
               "Velocity of the centre of mass. Without the key: 0.");
  velocity.get("angular", body.velocity.angular, Range::closed(-1e5, 1e5, "rad/s"),
               "Angular velocity in world axes. Without the key: 0.");
  velocity.finish();
  if (velocity.at().present() && body.motion)
    velocity.at().problem("the body's motion is given; only free bodies start with a velocity");
  map.get("gravity", body.gravity, "Whether gravity acts on the simulated body. Without the key: true.");
  map.get("force", body.force, Range::closed(-1e12, 1e12, "N"),
          "Constant force at the centre of mass, in world axes. Without the key: none.");
  map.get("torque", body.torque, Range::closed(-1e12, 1e12, "N m"),
          "Constant torque, in world axes. Without the key: none.");
  YamlMap damping(map.get("damping", "Damping of the motion of a simulated body. Without the key: none."));
  damping.get(
      "linear", body.linear_damping, Range::closed(0, 1e6, "1/s"),
      "Rate of the damping of the velocity: the force is -linear times mass times velocity. Without the key: 0.");
  damping.get("angular", body.angular_damping, Range::closed(0, 1e6, "1/s"),
              "Rate of the damping of the rotation: the torque is -angular times inertia times angular velocity. "
              "Without the key: 0.");
  damping.finish();
  map.get("contact", body.contact,
          "Whether the shape touches rods, threads and cloths that have contact. A simulated body also touches "
          "obstacles and other bodies. Without the key: true.");
  map.get("friction", body.friction, Range::closed(0, 100),
          "Coefficient of friction. Between two objects the geometric mean of both coefficients "
          "counts. Without the key: that of the other object, and 0.3 against obstacles and bodies.");
  body.broadcast_tf = !body.motion;
  map.get("broadcast_tf", body.broadcast_tf,
          "Whether nodes publish the body's frame on tf. Without the key: true for simulated bodies, false for bodies "
          "with a given motion.");
  map.get("welds",
          "Edges of rods that the body holds: they keep the place and the orientation that they have in the body at "
          "the start. Without the key: none.");   // read where the rods are known
  return body;
}

/// Nodes of one rod may be held only once, by grasps and welds together.
void checkWeld(const YamlCursor& at, const WeldConfig& weld, const std::vector<RodConfig>& rods,
               const std::vector<BodyConfig>& bodies)
{
  const auto overlaps = [&](int first, int last) { return weld.first_node <= last && first <= weld.last_node; };
  const auto report = [&](const std::string& other, int first, int last) {
    at.problem("holds nodes " + std::to_string(weld.first_node) + " to " + std::to_string(weld.last_node) + " of rod " +
               rods[weld.rod].name + "; " + other + " holds nodes " + std::to_string(first) + " to " +
               std::to_string(last));
  };
  for (const GraspConfig& grasp : rods[weld.rod].grasps)
    if (overlaps(grasp.first_node, grasp.last_node))
      return report("grasp " + grasp.name, grasp.first_node, grasp.last_node);
  for (const BodyConfig& body : bodies)
    for (const WeldConfig& other : body.welds)
      if (other.rod == weld.rod && overlaps(other.first_node, other.last_node))
        return report("a weld of body " + body.name, other.first_node, other.last_node);
}

}   // namespace

std::vector<BodyConfig> readBodies(const YamlCursor& at, const ReadContext& context, const std::vector<RodConfig>& rods)
{
  std::vector<BodyConfig> bodies;
  const auto entries = at.items(0, 100'000);
  for (std::size_t k = 0; k < entries.size(); ++k)
  {
    bodies.push_back(readBody(entries[k], context, entries.size() == 1 ? "body" : "body" + std::to_string(k)));
    for (const YamlCursor& item : entries[k].find("welds").items())
      if (const auto weld = readWeld(item, rods))
      {
        checkWeld(item, *weld, rods, bodies);
        bodies.back().welds.push_back(*weld);
      }
  }
  return bodies;
}

}   // namespace slender
