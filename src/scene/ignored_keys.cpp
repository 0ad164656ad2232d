// Keys that are sound but do nothing beside the other keys of the scene: each is warned of, so that nobody believes in an effect.
#include "ignored_keys.h"

#include <algorithm>
#include <string>
#include <variant>
#include <vector>

#include "slender_sim/dynamics/integrator.h"

namespace slender {

namespace {

std::vector<YamlCursor> entriesOf(const YamlCursor& list) { return list.isList() ? list.items() : std::vector<YamlCursor>{}; }

template <class Objects, class Condition>
bool any(const Objects& objects, const Condition& condition)
{
  return std::any_of(objects.begin(), objects.end(), condition);
}

void warnOfTime(YamlMap time, const SceneConfig& scene)
{
  const Integrator integrator = scene.time.integrator;
  const YamlCursor radius = time.get("spectral_radius"), newton = time.get("newton");
  if (radius.present() && integrator != Integrator::generalized_alpha)
  {
    radius.warning(std::string("has no effect: it is for integrator: generalized_alpha, and this scene takes ") + toString(integrator) + "; leave it out");
  }
  if (newton.present() && integrator == Integrator::symplectic_euler && scene.threads.empty())
  {
    newton.warning("has no effect: explicit steps solve no equations by Newton's method; leave it out");
  }
}

/// Wind acts on rods by damping.drag, on cloth by aerodynamics or damping.drag.
void warnOfWind(const YamlCursor& wind, const SceneConfig& scene)
{
  const bool blows = scene.wind != Eigen::Vector3d::Zero() || scene.wind_topic;
  const bool felt = any(scene.rods, [](const RodConfig& rod) { return rod.damping.drag > 0; }) || any(scene.cloths, [](const ClothConfig& cloth) {
                      return cloth.drag > 0 || cloth.aerodynamics.drag > 0 || cloth.aerodynamics.lift > 0;
                    });
  if (blows && !felt && scene.threads.empty())   // of threads it is said elsewhere
  {
    wind.warning("has no effect: it acts on rods with damping: {drag: ...} and on cloths with aerodynamics: {drag: ..., lift: ...} or damping: {drag: ...}, of "
                 "which the scene has none; give the drag");
  }
}

/// An obstacle that nothing touches is of use only as the frame that grasps follow.
void warnOfObstacles(const YamlCursor& obstacles, const SceneConfig& scene)
{
  const auto touches = [](const auto& object) { return object.contact && object.contact->obstacles; };
  if (any(scene.rods, touches) || any(scene.threads, touches) || any(scene.cloths, touches))
  {
    return;
  }
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
  {
    if (!follows(obstacle.name) && names.size() < 10)
    {
      names.push_back(obstacle.name);
    }
  }
  if (!names.empty() && obstacles.present())
  {
    obstacles.warning("are touched by nothing (" + joinWords(names) + "): everything passes through them. Give the rods, threads or cloths that shall touch "
                      "them a contact, for example contact: {friction: 0.3}");
  }
}

void warnOfMaterial(YamlMap material, const Eigen::Vector3d& gravity)
{
  const YamlCursor ratio = material.get("poissons_ratio"), torsion = material.get("torsion"), density = material.get("density");
  for (const YamlCursor& key : {ratio, torsion})
  {
    if (key.present() && material.has("twist_modulus"))
    {
      key.warning("has no effect, since twist_modulus is given and nothing else follows from it; leave it out");
    }
  }
  if (density.present() && material.has("linear_density"))
  {
    density.warning("has no effect, since linear_density is given; leave one of them out");
  }
  const YamlCursor inextensible = material.get("inextensible");
  if (inextensible.present() && inextensible.boolean().value_or(false) && gravity == Eigen::Vector3d::Zero())
  {
    inextensible.warning("has no effect: it raises the stretching modulus by the rod's own weight, and there is no gravity; give stretch_modulus instead");
  }
}

void warnOfBody(YamlMap body, const BodyConfig& config)
{
  for (const char* key : {"gravity", "force", "torque", "damping"})
  {
    if (config.motion && body.has(key))
    {
      body.get(key).warning("has no effect: the body's motion is given, so that no force moves it; leave it out, or take motion: free");
    }
  }
}

void warnOfCloth(YamlMap cloth, const SceneConfig& scene)
{
  YamlMap bending(cloth.get("bending")), solver(cloth.get("solver"));
  const YamlCursor model = bending.get("model"), modulus = bending.get("modulus");
  if (model.isScalar() && model.tree()->scalar == "none" && modulus.present())
  {
    modulus.warning("has no effect with model: none, which does not bend at all; leave it out, or take another model");
  }
  const bool explicit_steps = scene.time.integrator == Integrator::symplectic_euler || scene.time.integrator == Integrator::imex;
  if (explicit_steps && solver.at().present())
  {
    solver.at().warning(std::string("has no effect with time.integrator: ") + toString(scene.time.integrator) + ", which solves no such equations; leave it out");
  }
  const YamlCursor linear = solver.get("linear"), tolerance = solver.get("tolerance");
  if (linear.isScalar() && linear.tree()->scalar == "cholesky" && tolerance.present() && !explicit_steps)
  {
    tolerance.warning("has no effect with linear: cholesky, which is exact; leave it out");
  }
}

void warnOfThread(YamlMap thread, const ThreadConfig& config)
{
  const YamlCursor deposited = YamlMap(thread.get("edges")).get("deposited");
  if (deposited.present() && !config.floor)
  {
    deposited.warning("has no effect: it counts nodes that lie on the thread's floor, and there is none; give a floor, or a region in which fluid is kept");
  }
}

}  // namespace

void warnOfIgnoredKeys(YamlMap& map, const SceneConfig& scene)
{
  warnOfTime(YamlMap(map.get("time")), scene);
  warnOfWind(map.get("wind"), scene);
  warnOfObstacles(map.get("obstacles"), scene);
  for (const YamlCursor& rod : entriesOf(map.get("rods")))
  {
    warnOfMaterial(YamlMap(YamlMap(rod).get("material")), scene.gravity);
  }
  for (const char* key : {"cloths", "tracked"})
  {
    for (const YamlCursor& cloth : entriesOf(map.get(key)))
    {
      warnOfCloth(YamlMap(cloth), scene);
    }
  }
  const std::vector<YamlCursor> bodies = entriesOf(map.get("bodies")), threads = entriesOf(map.get("threads"));
  for (std::size_t b = 0; b < bodies.size(); ++b)
  {
    warnOfBody(YamlMap(bodies[b]), scene.bodies[b]);
  }
  for (std::size_t k = 0; k < threads.size(); ++k)
  {
    warnOfThread(YamlMap(threads[k]), scene.threads[k]);
  }
}

}  // namespace slender
