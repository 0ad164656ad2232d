// Keys that are sound but do nothing beside the other keys of the scene: each is warned of, so that nobody believes in
// an effect.
#include <algorithm>
#include <cmath>
#include <functional>
#include <limits>
#include <string>
#include <variant>
#include <vector>

#include "rod/body_surface.h"
#include "read_parts.h"
#include "slender_sim/dynamics/integrator.h"
#include "slender_sim/geometry/mesh_topology.h"

namespace slender {

namespace {

template <class Objects, class Condition>
bool any(const Objects& objects, const Condition& condition)
{
  return std::any_of(objects.begin(), objects.end(), condition);
}

/// Whether a rod, a thread or a cloth of the scene meets the condition.
template <class Condition>
bool anyObject(const SceneConfig& scene, const Condition& condition)
{
  return any(scene.rods, condition) || any(scene.threads, condition) || any(scene.cloths, condition);
}

const auto has_contact = [](const auto& object) { return object.contact.has_value(); };
const auto touches_solids = [](const auto& object) { return object.contact && object.contact->solids; };

bool haveSolids(const SceneConfig& scene) { return !scene.obstacles.empty() || !scene.bodies.empty(); }

/// Warns of a key that is given although it is of no use.
void warnIf(bool useless, const YamlCursor& key, const std::string& text)
{
  if (useless && key.present())
    key.warning(text);
}

void warnOfTime(const YamlCursor& time, const SceneConfig& scene)
{
  const Integrator integrator = scene.time.integrator;
  const YamlCursor newton = time.find("newton");
  warnIf(integrator != Integrator::generalized_alpha, time.find("spectral_radius"),
         std::string("has no effect: it is for integrator: generalized_alpha, and this scene takes ") +
             toString(integrator) + "; leave it out");
  const bool no_newton = integrator == Integrator::symplectic_euler && scene.threads.empty();
  warnIf(no_newton, newton, "has no effect: explicit steps solve no equations by Newton's method; leave it out");
  warnIf(!no_newton && scene.rods.size() + scene.threads.size() + scene.bodies.size() < 2, newton.find("linear"),
         "has no effect: it is for rods, threads and bodies that meet; leave it out");
}

/// Wind acts on rods by damping.drag, on cloth by aerodynamics or damping.drag.
void warnOfWind(const YamlCursor& wind, const SceneConfig& scene)
{
  const bool blows = scene.wind != Eigen::Vector3d::Zero() || scene.wind_topic;
  const bool felt = any(scene.rods, [](const RodConfig& rod) { return rod.damping.drag > 0; }) ||
                    any(scene.cloths, [](const ClothConfig& cloth) {
                      return cloth.wind_coefficient > 0 || cloth.aerodynamics.drag > 0 || cloth.aerodynamics.lift > 0;
                    });
  // of threads it is said elsewhere
  warnIf(blows && !felt && scene.threads.empty(), wind,
         "has no effect: it acts on rods with damping: {drag: ...} and on cloths with aerodynamics: {drag: ..., lift: "
         "...} or damping: {drag: ...}, of which the scene has none; give the drag");
}

const auto is_simulated_solid = std::mem_fn(&BodyConfig::isSimulatedSolid);

/// An obstacle that nothing touches is of use only as the frame that grasps follow.
void warnOfObstacles(const YamlCursor& obstacles, const SceneConfig& scene)
{
  if (anyObject(scene, touches_solids) || any(scene.bodies, is_simulated_solid))
    return;
  const auto follows = [&scene](const std::string& name) {
    const auto by_grasp = [&name](const GraspConfig& grasp) {
      const auto* body = std::get_if<BodyMotion>(&grasp.motion);
      return body && body->body == name;
    };
    const auto by_object = [&by_grasp](const auto& object) { return any(object.grasps, by_grasp); };
    return any(scene.rods, by_object) || any(scene.cloths, by_object);
  };
  std::vector<std::string> names;
  for (const ObstacleConfig& obstacle : scene.obstacles)
    if (!follows(obstacle.name))
      names.push_back(obstacle.name);
  warnIf(!names.empty(), obstacles,
         "are touched by nothing (" + joinWords(names, 10) +
             "): everything passes through them. Give the rods, threads or cloths that shall touch them a contact, "
             "for example contact: {friction: 0.3}");
}

/// Returns true for a key that is given as false.
bool isOff(const YamlCursor& key) { return key.present() && !key.boolean().value_or(true); }

bool meetsBy(const ClothConfig& cloth, ContactMethod method)
{
  return cloth.contact && cloth.contact->method == method;
}

/// Whether the barrier of contact has several objects, which may meet each other.
bool haveOthers(const SceneConfig& scene)
{
  return std::count_if(scene.rods.begin(), scene.rods.end(), has_contact) +
             std::count_if(scene.threads.begin(), scene.threads.end(), has_contact) +
             std::count_if(scene.cloths.begin(), scene.cloths.end(),
                           [](const ClothConfig& cloth) { return meetsBy(cloth, ContactMethod::barrier); }) >
         1;
}

/// Warns of a contact that finds no partner. `others`: the key for contact with objects of the same kind, of which the
/// scene has any if `has_others`.
void warnOfContact(const YamlCursor& contact, const std::string& others, bool has_others, bool has_solids)
{
  const bool meets_others = has_others && !isOff(contact.find(others)),
             meets_solids = has_solids && !isOff(contact.find("obstacles"));
  warnIf(isOff(contact.find("self")) && !meets_others && !meets_solids, contact,
         "has no effect: self is false, and " + others +
             " and obstacles are false or the scene has none, so that there is nothing to touch; leave contact out, "
             "or change these keys");
}

/// Cloths whose contact is by impulses meet only each other and what moves as prescribed.
void warnOfKindsThatDoNotMeet(const YamlCursor& cloths, const SceneConfig& scene)
{
  const auto impulses = [](const ClothConfig& cloth) { return meetsBy(cloth, ContactMethod::impulses); };
  const auto barrier = [](const ClothConfig& cloth) { return meetsBy(cloth, ContactMethod::barrier); };
  std::vector<std::string> others;
  if (any(scene.rods, has_contact))
    others.push_back("rods");
  if (any(scene.threads, has_contact))
    others.push_back("threads");
  if (any(scene.bodies, is_simulated_solid))
    others.push_back("simulated bodies");
  if (any(scene.cloths, barrier))
    others.push_back("cloths with contact: {method: barrier}");
  warnIf(any(scene.cloths, impulses) && !others.empty(), cloths,
         "whose contact is by impulses (named, or because they are guides or have a max_traction) pass through the " +
             joinWords(others) +
             " of this scene: such contact is with cloth of this kind, obstacles, and bodies with a given motion");
}

bool slips(const BodyConfig& body) { return body.isSimulatedSolid() && body.friction.value_or(1.0) > 0; }

/// Returns why the friction of a solid has no effect, or an empty text.
std::string whyNoFriction(const SceneConfig& scene)
{
  const auto slips_on_solids = [](const auto& object) {
    return touches_solids(object) && object.contact->friction > 0;
  };
  if (!anyObject(scene, touches_solids) && !any(scene.bodies, is_simulated_solid))
    return "nothing touches it; give the rods, threads or cloths a contact with obstacles, or leave friction out";
  if (!anyObject(scene, slips_on_solids) && !any(scene.bodies, slips))
  {
    return "the friction between two objects is the geometric mean of both, and that of everything that touches solids "
           "is 0; give them a friction as well";
  }
  return "";
}

void warnOfFriction(const YamlCursor& friction, const std::string& why)
{
  if (friction.present() && friction.number(Range::closed(0, 100)).value_or(0.0) > 0 && !why.empty())
    friction.warning("has no effect: " + why);
}

/// The section `contact` of the scene. Cloth that collides by impulses has no slip speed.
void warnOfSlipSpeed(const YamlCursor& slip_speed, const SceneConfig& scene)
{
  const auto rubs = [](const auto& object) { return object.contact && object.contact->friction > 0; };
  const auto barrier_rubs = [&](const ClothConfig& cloth) {
    return rubs(cloth) && cloth.contact->method == ContactMethod::barrier;
  };
  warnIf(!any(scene.rods, rubs) && !any(scene.threads, rubs) && !any(scene.bodies, slips) &&
             !any(scene.cloths, barrier_rubs),
         slip_speed,
         "has no effect: nothing that touches by the barrier has friction; give it a friction, or leave it out");
}

void warnOfMaterial(const YamlCursor& material, const Eigen::Vector3d& gravity)
{
  for (const char* key : {"poissons_ratio", "torsion"})
    warnIf(material.find("twist_modulus").present(), material.find(key),
           "has no effect, since twist_modulus is given and nothing else follows from it; leave it out");
  warnIf(material.find("linear_density").present(), material.find("density"),
         "has no effect, since linear_density is given; leave one of them out");
  const YamlCursor inextensible = material.find("inextensible");
  warnIf(inextensible.boolean().value_or(false) && gravity == Eigen::Vector3d::Zero(), inextensible,
         "has no effect: it raises the stretching modulus by the rod's own weight, and there is no gravity; give "
         "stretch_modulus instead");
}

/// A rod, or a generator of rods, which has the same keys.
void warnOfRod(const YamlCursor& rod, const SceneConfig& scene)
{
  warnOfMaterial(rod.find("material"), scene.gravity);
  warnOfContact(rod.find("contact"), "rods", haveOthers(scene), haveSolids(scene));
}

/// `others`: whether there are obstacles or other bodies with a shape.
void warnOfBodyShape(const YamlCursor& shape, const BodyConfig& config, bool others)
{
  warnIf(config.isSimulatedSolid() && std::holds_alternative<Cylinder>(*config.shape) && others, shape,
         "touches obstacles and other bodies as a prism of " + std::to_string(kSidesOfCylinder) +
             " sides; rods, threads and cloths touch the cylinder itself");
}

void warnOfBody(const YamlCursor& body, const BodyConfig& config, const std::string& why_no_friction)
{
  warnIf(config.contact && !config.shape, body.find("contact"),
         "has no effect: the body has no shape that could touch anything; give it a shape, or leave contact out");
  warnOfFriction(body.find("friction"), !config.shape     ? "the body has no shape; give it one, or leave friction out"
                                        : !config.contact ? "contact is false; leave one of them out"
                                                          : why_no_friction);
  for (const char* key : {"gravity", "force", "torque", "damping"})
    warnIf(config.motion.has_value(), body.find(key),
           "has no effect: the body's motion is given, so that no force moves it; leave it out, or take motion: free");
}

/// Hinges flow beyond the yield curvature times their width, and no hinge can be bent by more than half a turn.
void warnOfPlasticity(const YamlCursor& plasticity, const ClothConfig& config)
{
  if (!plasticity.present() || config.mesh.triangles.cols() == 0)
    return;
  if (!(config.bending_modulus > 0))
  {
    plasticity.warning(
        "has no effect: bending.modulus is 0, so that creases have no stiffness; give a modulus, or leave plasticity "
        "out");
    return;
  }
  const MeshTopology topology = meshTopology(config.mesh);
  const Eigen::VectorXd areas = faceAreas(config.mesh);
  // [m] width of a hinge: twice the area of both faces over the length of their edge
  double narrowest = std::numeric_limits<double>::infinity();
  for (int h = 0; h < topology.hingeCount(); ++h)
  {
    const auto faces = topology.edge_faces.col(topology.hinge_edges[static_cast<std::size_t>(h)]);
    const double length =
        (config.mesh.vertices.col(topology.hinges(1, h)) - config.mesh.vertices.col(topology.hinges(0, h))).norm();
    narrowest = std::min(narrowest, 2.0 * (areas[faces[0]] + areas[faces[1]]) / length);
  }
  warnIf(config.plasticity.yield_curvature * narrowest >= M_PI, plasticity.find("yield_curvature"),
         "is never reached, so that plasticity has no effect: no hinge of this mesh can be bent by more than half a "
         "turn, which is a curvature of at most " +
             shortNumber(M_PI / narrowest) + " 1/m; lower the yield curvature, or refine the mesh");
}

/// Keys of one set of test functions. `shapes`: how many shapes of the guide are known beforehand.
void warnOfClusters(const YamlCursor& clusters, std::size_t shapes)
{
  if (!clusters.present())
    return;
  const bool one_region = clusters.find("count").integer(1, 1'000'000, "regions").value_or(2) == 1;
  for (const char* key : {"compactness", "seed", "frames"})
    warnIf(one_region, clusters.find(key),
           "has no effect with count: 1, since all faces are in one region; leave it out");
  warnIf(!one_region && shapes < 2, clusters.find("frames"),
         "has no effect: only one shape of the guide is known when regions are clustered; leave it out");
}

void warnOfTracking(const YamlCursor& tracked, const ClothConfig& config)
{
  if (!config.tracking)
    return;
  const GuideMotion& motion = config.tracking->guide.motion;
  const auto* frames = std::get_if<FrameGuide>(&motion);
  const auto* carried = std::get_if<CarriedGuide>(&motion);
  const std::size_t shapes = frames ? frames->points.frames().size() : carried && !carried->poses.empty() ? 2 : 1;
  const YamlCursor functions = tracked.find("test_functions");
  for (const YamlCursor& set : functions.isList() ? functions.items() : std::vector<YamlCursor>{functions})
  {
    for (const char* key : {"from", "blend"})
      warnIf(functions.isList() && config.tracking->sets.size() == 1, set.find(key),
             "has no effect: there is only one set of test functions, which acts from the start; leave it out, or add "
             "another set");
    warnOfClusters(set.find("clusters"), shapes);
  }
}

void warnOfCloth(const YamlCursor& cloth, const SceneConfig& scene, const ClothConfig& config)
{
  warnOfPlasticity(cloth.find("plasticity"), config);
  warnOfContact(cloth.find("contact"), "cloths", scene.cloths.size() > 1 || haveOthers(scene), haveSolids(scene));
  const YamlCursor material = cloth.find("material"), bending = cloth.find("bending"), solver = cloth.find("solver");
  warnIf(!(config.aerodynamics.drag > 0) && !(config.aerodynamics.lift > 0),
         cloth.find("aerodynamics").find("air_density"),
         "has no effect: aerodynamics.drag and lift are 0; give one of them");
  warnIf(cloth.find("membrane").present() && !material.find("density").present(), material.find("thickness"),
         "has no effect beside membrane and an area density, since nothing else follows from it; leave it out (contact "
         "has a thickness of its own)");
  warnIf(bending.find("model").isWord("none"), bending.find("modulus"),
         "has no effect with model: none, which does not bend at all; leave it out, or take another model");
  const bool explicit_steps = isExplicit(scene.time.integrator);
  warnIf(explicit_steps, solver,
         std::string("has no effect with time.integrator: ") + toString(scene.time.integrator) +
             ", which solves no such equations; leave it out");
  warnIf(solver.find("linear").isWord("cholesky") && !explicit_steps, solver.find("tolerance"),
         "has no effect with linear: cholesky, which is exact; leave it out");
}

void warnOfThread(const YamlCursor& thread, const ThreadConfig& config, const SceneConfig& scene)
{
  const YamlCursor contact = thread.find("contact");
  warnIf(!config.floor, thread.find("edges").find("deposited"),
         "has no effect: it counts nodes that lie on the thread's floor, and there is none; give a floor, or a region "
         "in which fluid is kept");
  const bool has_others = scene.threads.size() > 1;
  warnIf(config.merging > 0 && isOff(contact.find("self")) && (!has_others || isOff(contact.find("threads"))),
         thread.find("merging"),
         "has no effect: neither parts of the thread nor other threads are in touch with it; take contact: {self: "
         "true}");
  warnOfContact(contact, "threads", haveOthers(scene), haveSolids(scene) || (config.floor && config.floor->friction));
  warnIf(config.nozzle && !config.nozzle->flow.topic && !(config.nozzle->flow.table.greatest() > 0),
         thread.find("nozzle").find("flow"),
         "is 0, so nothing flows out of the nozzle; give it in m^3/s, or flow: {topic: true}");
}

/// Keys of a generator that do nothing beside its others.
void warnOfGenerator(const YamlCursor& generator, const SceneConfig& scene, const std::string& why_no_friction)
{
  const YamlCursor chain = generator.find("chain"), tree = generator.find("tree"), hair = generator.find("hair");
  for (const YamlCursor& rods : {chain, tree, hair})
    if (rods.present())
      warnOfRod(rods, scene);
  warnIf(chain.present() && chain.find("links").integer(1, 10'000).value_or(2) == 1, chain.find("spacing"),
         "has no effect with links: 1; leave it out");
  const bool alone = tree.present() && tree.find("levels").integer(1, 6).value_or(2) == 1;
  for (const char* key : {"seed", "children", "length_ratio", "radius_ratio", "angle", "joint_density"})
    warnIf(alone, tree.find(key), "has no effect with levels: 1, a trunk without branches; leave it out");
  warnOfFriction(hair.find("head").find("friction"), why_no_friction);
}

}   // namespace

void warnOfIgnoredKeys(YamlMap& map, const SceneConfig& scene)
{
  const std::string why_no_friction = whyNoFriction(scene);
  warnOfTime(map.find("time"), scene);
  warnOfWind(map.find("wind"), scene);
  warnOfObstacles(map.find("obstacles"), scene);
  warnOfKindsThatDoNotMeet(map.find("cloths"), scene);
  warnOfSlipSpeed(map.find("contact").find("slip_speed"), scene);
  for (const YamlCursor& obstacle : entriesOf(map.find("obstacles")))
    warnOfFriction(obstacle.find("friction"), why_no_friction);
  for (const YamlCursor& rod : entriesOf(map.find("rods")))
    warnOfRod(rod, scene);
  for (const YamlCursor& generator : entriesOf(map.find("generate")))
    warnOfGenerator(generator, scene, why_no_friction);
  std::size_t k = 0;   // tracked cloths come after the others
  for (const char* key : {"cloths", "tracked"})
  {
    for (const YamlCursor& cloth : entriesOf(map.find(key)))
    {
      warnOfCloth(cloth, scene, scene.cloths[k]);
      warnOfTracking(cloth, scene.cloths[k++]);
    }
  }
  const std::vector<YamlCursor> bodies = entriesOf(map.find("bodies")), threads = entriesOf(map.find("threads"));
  for (std::size_t b = 0; b < bodies.size(); ++b)
  {
    const auto isOther = [&](const BodyConfig& other) {
      return &other != &scene.bodies[b] && other.contact && other.shape;
    };
    warnOfBody(bodies[b], scene.bodies[b], why_no_friction);
    warnOfBodyShape(bodies[b].find("shape"), scene.bodies[b], !scene.obstacles.empty() || any(scene.bodies, isOther));
  }
  for (std::size_t t = 0; t < threads.size(); ++t)
    warnOfThread(threads[t], scene.threads[t], scene);
}

}   // namespace slender
