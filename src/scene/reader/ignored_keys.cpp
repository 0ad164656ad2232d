// Keys that are sound but do nothing beside the other keys of the scene: each is warned of, so that nobody believes in
// an effect.
#include "ignored_keys.h"

#include <algorithm>
#include <cmath>
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

void warnOfTime(YamlMap time, const SceneConfig& scene)
{
  const Integrator integrator = scene.time.integrator;
  const YamlCursor radius = time.find("spectral_radius"), newton = time.find("newton");
  if (radius.present() && integrator != Integrator::generalized_alpha)
  {
    radius.warning(std::string("has no effect: it is for integrator: generalized_alpha, and this scene takes ") +
                   toString(integrator) + "; leave it out");
  }
  if (newton.present() && integrator == Integrator::symplectic_euler && scene.threads.empty())
    newton.warning("has no effect: explicit steps solve no equations by Newton's method; leave it out");
  else if (YamlMap(newton).has("linear") && scene.rods.size() + scene.threads.size() + scene.bodies.size() < 2)
    YamlMap(newton).find("linear").warning("has no effect: it is for rods, threads and bodies that meet; leave it out");
}

/// Wind acts on rods by damping.drag, on cloth by aerodynamics or damping.drag.
void warnOfWind(const YamlCursor& wind, const SceneConfig& scene)
{
  const bool blows = scene.wind != Eigen::Vector3d::Zero() || scene.wind_topic;
  const bool felt = any(scene.rods, [](const RodConfig& rod) { return rod.damping.drag > 0; }) ||
                    any(scene.cloths, [](const ClothConfig& cloth) {
                      return cloth.drag > 0 || cloth.aerodynamics.drag > 0 || cloth.aerodynamics.lift > 0;
                    });
  if (blows && !felt && scene.threads.empty())   // of threads it is said elsewhere
  {
    wind.warning(
        "has no effect: it acts on rods with damping: {drag: ...} and on cloths with aerodynamics: {drag: ..., lift: "
        "...} or damping: {drag: ...}, of "
        "which the scene has none; give the drag");
  }
}

bool isSimulatedSolid(const BodyConfig& body) { return body.contact && body.shape && !body.motion; }

/// An obstacle that nothing touches is of use only as the frame that grasps follow.
void warnOfObstacles(const YamlCursor& obstacles, const SceneConfig& scene)
{
  const auto touches = [](const auto& object) { return object.contact && object.contact->solids; };
  if (any(scene.rods, touches) || any(scene.threads, touches) || any(scene.cloths, touches) ||
      any(scene.bodies, isSimulatedSolid))
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
    if (!follows(obstacle.name) && names.size() < 10)
      names.push_back(obstacle.name);
  if (!names.empty() && obstacles.present())
  {
    obstacles.warning("are touched by nothing (" + joinWords(names) +
                      "): everything passes through them. Give the rods, threads or cloths that shall touch "
                      "them a contact, for example contact: {friction: 0.3}");
  }
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
  const auto touches = [](const auto& object) { return object.contact.has_value(); };
  return std::count_if(scene.rods.begin(), scene.rods.end(), touches) +
             std::count_if(scene.threads.begin(), scene.threads.end(), touches) +
             std::count_if(scene.cloths.begin(), scene.cloths.end(),
                           [](const ClothConfig& cloth) { return meetsBy(cloth, ContactMethod::barrier); }) >
         1;
}

/// Warns of a contact that finds no partner. `others`: the key for contact with objects of the same kind, of which the
/// scene has any if `has_others`.
void warnOfContact(YamlMap contact, const char* others, bool has_others, bool has_solids)
{
  const bool meets_others = has_others && !isOff(contact.find(others)),
             meets_solids = has_solids && !isOff(contact.find("obstacles"));
  if (contact.at().present() && isOff(contact.find("self")) && !meets_others && !meets_solids)
  {
    contact.at().warning(std::string("has no effect: self is false, and ") + others +
                         " and obstacles are false or the scene has none, so that there is nothing to touch; leave "
                         "contact out, or change these keys");
  }
}

/// Cloths whose contact is by impulses meet only each other and what moves as prescribed.
void warnOfKindsThatDoNotMeet(const YamlCursor& cloths, const SceneConfig& scene)
{
  const auto touches = [](const auto& object) { return object.contact.has_value(); };
  const auto impulses = [](const ClothConfig& cloth) { return meetsBy(cloth, ContactMethod::impulses); };
  const auto barrier = [](const ClothConfig& cloth) { return meetsBy(cloth, ContactMethod::barrier); };
  if (!cloths.present() || !any(scene.cloths, impulses))
    return;
  std::vector<std::string> others;
  if (any(scene.rods, touches))
    others.push_back("rods");
  if (any(scene.threads, touches))
    others.push_back("threads");
  if (any(scene.bodies, isSimulatedSolid))
    others.push_back("simulated bodies");
  if (any(scene.cloths, barrier))
    others.push_back("cloths with contact: {method: barrier}");
  if (!others.empty())
  {
    cloths.warning(
        "whose contact is by impulses (named, or because they are guides or have a max_traction) pass through the " +
        joinWords(others) +
        " of this scene: such contact is with cloth of this kind, obstacles, and bodies with a given motion");
  }
}

/// Returns why the friction of a solid has no effect, or an empty text.
std::string whyNoFriction(const SceneConfig& scene)
{
  const auto touches = [](const auto& object) { return object.contact && object.contact->solids; };
  const auto slips = [&touches](const auto& object) { return touches(object) && object.contact->friction > 0; };
  const auto body_slips = [](const BodyConfig& body) {
    return isSimulatedSolid(body) && body.friction.value_or(1.0) > 0;
  };
  if (!any(scene.rods, touches) && !any(scene.threads, touches) && !any(scene.cloths, touches) &&
      !any(scene.bodies, isSimulatedSolid))
    return "nothing touches it; give the rods, threads or cloths a contact with obstacles, or leave friction out";
  if (!any(scene.rods, slips) && !any(scene.threads, slips) && !any(scene.cloths, slips) &&
      !any(scene.bodies, body_slips))
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

/// The section `contact` of the scene. Rods and threads have a slip speed, cloths do not.
void warnOfSlipSpeed(const YamlCursor& slip_speed, const SceneConfig& scene)
{
  const auto slips = [](const auto& object) { return object.contact && object.contact->friction > 0; };
  const auto body_slips = [](const BodyConfig& body) {
    return isSimulatedSolid(body) && body.friction.value_or(1.0) > 0;
  };
  if (slip_speed.present() && !any(scene.rods, slips) && !any(scene.threads, slips) && !any(scene.bodies, body_slips))
  {
    slip_speed.warning(
        "has no effect: friction is 0 for all rods, threads and bodies that touch anything; give them a friction, or "
        "leave it out");
  }
}

void warnOfMaterial(YamlMap material, const Eigen::Vector3d& gravity)
{
  const YamlCursor ratio = material.find("poissons_ratio"), torsion = material.find("torsion"),
                   density = material.find("density");
  for (const YamlCursor& key : {ratio, torsion})
    if (key.present() && material.has("twist_modulus"))
      key.warning("has no effect, since twist_modulus is given and nothing else follows from it; leave it out");
  if (density.present() && material.has("linear_density"))
    density.warning("has no effect, since linear_density is given; leave one of them out");
  const YamlCursor inextensible = material.find("inextensible");
  if (inextensible.present() && inextensible.boolean().value_or(false) && gravity == Eigen::Vector3d::Zero())
  {
    inextensible.warning(
        "has no effect: it raises the stretching modulus by the rod's own weight, and there is no gravity; give "
        "stretch_modulus instead");
  }
}

/// `others`: whether there are obstacles or other bodies with a shape.
void warnOfBodyShape(const YamlCursor& shape, const BodyConfig& config, bool others)
{
  if (isSimulatedSolid(config) && std::holds_alternative<Cylinder>(*config.shape) && others)
  {
    shape.warning("touches obstacles and other bodies as a prism of " + std::to_string(kSidesOfCylinder) +
                  " sides; rods, threads and cloths touch the cylinder itself");
  }
}

void warnOfBody(YamlMap body, const BodyConfig& config, const std::string& why_no_friction)
{
  const YamlCursor contact = body.find("contact"), friction = body.find("friction");
  if (contact.present() && config.contact && !config.shape)
  {
    contact.warning(
        "has no effect: the body has no shape that could touch anything; give it a shape, or leave contact out");
  }
  warnOfFriction(friction, !config.shape     ? "the body has no shape; give it one, or leave friction out"
                           : !config.contact ? "contact is false; leave one of them out"
                                             : why_no_friction);
  for (const char* key : {"gravity", "force", "torque", "damping"})
  {
    if (config.motion && body.has(key))
    {
      body.find(key).warning(
          "has no effect: the body's motion is given, so that no force moves it; leave it out, or take motion: free");
    }
  }
}

/// Hinges flow beyond the yield curvature times their width, and no hinge can be bent by more than half a turn.
void warnOfPlasticity(YamlMap plasticity, const ClothConfig& config)
{
  if (!plasticity.at().present() || config.mesh.triangles.cols() == 0)
    return;
  if (!(config.bending_modulus > 0))
  {
    plasticity.at().warning(
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
  if (config.plasticity.yield_curvature * narrowest >= M_PI)
  {
    plasticity.find("yield_curvature")
        .warning(
            "is never reached, so that plasticity has no effect: no hinge of this mesh can be bent by more than half a "
            "turn, "
            "which is a curvature of at most " +
            shortNumber(M_PI / narrowest) + " 1/m; lower the yield curvature, or refine the mesh");
  }
}

/// Keys of one set of test functions. `shapes`: how many shapes of the guide are known beforehand.
void warnOfClusters(YamlMap clusters, std::size_t shapes)
{
  if (!clusters.at().present())
    return;
  const YamlCursor frames = clusters.find("frames");
  const bool one_region = clusters.find("count").integer(1, 1'000'000, "regions").value_or(2) == 1;
  for (const char* key : {"compactness", "seed", "frames"})
    if (one_region && clusters.has(key))
      clusters.find(key).warning("has no effect with count: 1, since all faces are in one region; leave it out");
  if (!one_region && frames.present() && shapes < 2)
    frames.warning("has no effect: only one shape of the guide is known when regions are clustered; leave it out");
}

void warnOfTracking(YamlMap tracked, const ClothConfig& config)
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
    YamlMap map(set);
    for (const char* key : {"from", "blend"})
    {
      if (functions.isList() && config.tracking->sets.size() == 1 && map.has(key))
      {
        map.find(key).warning(
            "has no effect: there is only one set of test functions, which acts from the start; leave it out, or add "
            "another set");
      }
    }
    warnOfClusters(YamlMap(map.find("clusters")), shapes);
  }
}

void warnOfCloth(YamlMap cloth, const SceneConfig& scene, const ClothConfig& config)
{
  warnOfPlasticity(YamlMap(cloth.find("plasticity")), config);
  warnOfContact(YamlMap(cloth.find("contact")), "cloths", scene.cloths.size() > 1 || haveOthers(scene),
                !scene.obstacles.empty() || !scene.bodies.empty());
  const YamlCursor air_density = YamlMap(cloth.find("aerodynamics")).find("air_density"),
                   thickness = YamlMap(cloth.find("material")).find("thickness");
  if (air_density.present() && !(config.aerodynamics.drag > 0) && !(config.aerodynamics.lift > 0))
    air_density.warning("has no effect: aerodynamics.drag and lift are 0; give one of them");
  if (thickness.present() && cloth.has("membrane") && !YamlMap(cloth.find("material")).has("density"))
  {
    thickness.warning(
        "has no effect beside membrane and an area density, since nothing else follows from it; leave it out (contact "
        "has a thickness of its own)");
  }
  YamlMap bending(cloth.find("bending")), solver(cloth.find("solver"));
  const YamlCursor model = bending.find("model"), modulus = bending.find("modulus");
  if (model.isScalar() && model.tree()->scalar == "none" && modulus.present())
    modulus.warning("has no effect with model: none, which does not bend at all; leave it out, or take another model");
  const bool explicit_steps = isExplicit(scene.time.integrator);
  if (explicit_steps && solver.at().present())
  {
    solver.at().warning(std::string("has no effect with time.integrator: ") + toString(scene.time.integrator) +
                        ", which solves no such equations; leave it out");
  }
  const YamlCursor linear = solver.find("linear"), tolerance = solver.find("tolerance");
  if (linear.isScalar() && linear.tree()->scalar == "cholesky" && tolerance.present() && !explicit_steps)
    tolerance.warning("has no effect with linear: cholesky, which is exact; leave it out");
}

void warnOfThread(YamlMap thread, const ThreadConfig& config, const SceneConfig& scene)
{
  const YamlCursor deposited = YamlMap(thread.find("edges")).find("deposited"), merging = thread.find("merging");
  YamlMap contact(thread.find("contact"));
  if (deposited.present() && !config.floor)
  {
    deposited.warning(
        "has no effect: it counts nodes that lie on the thread's floor, and there is none; give a floor, or a region "
        "in which fluid is kept");
  }
  const bool has_others = scene.threads.size() > 1;
  if (config.merging > 0 && isOff(contact.find("self")) && (!has_others || isOff(contact.find("threads"))))
  {
    merging.warning(
        "has no effect: neither parts of the thread nor other threads are in touch with it; take contact: {self: "
        "true}");
  }
  warnOfContact(contact, "threads", haveOthers(scene),
                !scene.obstacles.empty() || !scene.bodies.empty() || (config.floor && config.floor->friction));
  if (config.nozzle && thread.has("nozzle"))
  {
    const YamlCursor flow = YamlMap(thread.find("nozzle")).find("flow");
    if (flow.present() && !config.nozzle->flow.topic && !(config.nozzle->flow.table.greatest() > 0))
      flow.warning("is 0, so nothing flows out of the nozzle; give it in m^3/s, or flow: {topic: true}");
  }
}

/// Keys of a generator that do nothing beside its others.
void warnOfGenerator(YamlMap generator, const SceneConfig& scene, const std::string& why_no_friction)
{
  YamlMap chain(generator.find("chain")), tree(generator.find("tree")), hair(generator.find("hair"));
  for (YamlMap* rods : {&chain, &tree, &hair})
  {
    if (!rods->at().present())
      continue;
    warnOfMaterial(YamlMap(rods->find("material")), scene.gravity);
    warnOfContact(YamlMap(rods->find("contact")), "rods", haveOthers(scene),
                  !scene.obstacles.empty() || !scene.bodies.empty());
  }
  if (chain.has("spacing") && chain.find("links").integer(1, 10'000).value_or(2) == 1)
    chain.find("spacing").warning("has no effect with links: 1; leave it out");
  for (const char* key : {"seed", "children", "length_ratio", "radius_ratio", "angle", "joint_density"})
    if (tree.has(key) && tree.find("levels").integer(1, 6).value_or(2) == 1)
      tree.find(key).warning("has no effect with levels: 1, a trunk without branches; leave it out");
  if (hair.at().present())
    warnOfFriction(YamlMap(hair.find("head")).find("friction"), why_no_friction);
}

}   // namespace

void warnOfIgnoredKeys(YamlMap& map, const SceneConfig& scene)
{
  const std::string why_no_friction = whyNoFriction(scene);
  warnOfTime(YamlMap(map.find("time")), scene);
  warnOfWind(map.find("wind"), scene);
  warnOfObstacles(map.find("obstacles"), scene);
  warnOfKindsThatDoNotMeet(map.find("cloths"), scene);
  warnOfSlipSpeed(YamlMap(map.find("contact")).find("slip_speed"), scene);
  for (const YamlCursor& obstacle : entriesOf(map.find("obstacles")))
    warnOfFriction(YamlMap(obstacle).find("friction"), why_no_friction);
  for (const YamlCursor& entry : entriesOf(map.find("rods")))
  {
    YamlMap rod(entry);
    warnOfMaterial(YamlMap(rod.find("material")), scene.gravity);
    warnOfContact(YamlMap(rod.find("contact")), "rods", haveOthers(scene),
                  !scene.obstacles.empty() || !scene.bodies.empty());
  }
  for (const YamlCursor& generator : entriesOf(map.find("generate")))
    warnOfGenerator(YamlMap(generator), scene, why_no_friction);
  std::size_t k = 0;   // tracked cloths come after the others
  for (const char* key : {"cloths", "tracked"})
  {
    for (const YamlCursor& cloth : entriesOf(map.find(key)))
    {
      warnOfCloth(YamlMap(cloth), scene, scene.cloths[k]);
      warnOfTracking(YamlMap(cloth), scene.cloths[k++]);
    }
  }
  const std::vector<YamlCursor> bodies = entriesOf(map.find("bodies")), threads = entriesOf(map.find("threads"));
  for (std::size_t b = 0; b < bodies.size(); ++b)
  {
    YamlMap body(bodies[b]);
    const auto isOther = [&](const BodyConfig& other) {
      return &other != &scene.bodies[b] && other.contact && other.shape;
    };
    warnOfBody(body, scene.bodies[b], why_no_friction);
    warnOfBodyShape(body.find("shape"), scene.bodies[b], !scene.obstacles.empty() || any(scene.bodies, isOther));
  }
  for (std::size_t t = 0; t < threads.size(); ++t)
    warnOfThread(YamlMap(threads[t]), scene.threads[t], scene);
}

}   // namespace slender
