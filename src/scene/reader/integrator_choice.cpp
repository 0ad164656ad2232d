// Chooses the integrator of a scene, and reports options of time that its objects do not support.
#include <algorithm>
#include <string>

#include "read_parts.h"

namespace slender {

namespace {

void checkClothTime(YamlMap& map, SceneConfig& scene)
{
  const YamlCursor time = map.find("time");
  if (!time.find("integrator").present())
  {
    if (scene.time.integrator != Integrator::implicit_euler && !(scene.rods.empty() && scene.bodies.empty()))
    {
      map.find(map.has("cloths") ? "cloths" : "tracked")
          .warning(
              "makes implicit_euler the default integrator of the rods and bodies as well, which is of first order; "
              "without cloth it is " +
              std::string(toString(scene.time.integrator)) +
              ": give time.integrator to choose (cloth takes implicit_euler or tr_bdf2)");
    }
    scene.time.integrator = Integrator::implicit_euler;
  }
  else if (scene.time.integrator != Integrator::implicit_euler && scene.time.integrator != Integrator::tr_bdf2 &&
           scene.time.integrator != Integrator::imex && scene.time.integrator != Integrator::symplectic_euler)
  {
    time.find("integrator").problem("is not for cloth; must be implicit_euler, tr_bdf2, imex or symplectic_euler");
  }
  if (time.find("spectral_radius").present())
    time.find("spectral_radius").problem("is for generalized_alpha, which cloth does not have; leave it out");
  if (scene.start.equilibrium)
  {
    for (const ClothConfig& cloth : scene.cloths)
    {
      if (cloth.tracking || cloth.contact)
      {
        map.find("start").problem("is not for cloth that " +
                                  std::string(cloth.tracking ? "tracks a guide" : "has contact") + ", as cloth " +
                                  cloth.name + " does; must be as_given");
        return;
      }
    }
  }
}

/// Threads take implicit Euler steps of fixed length, and wind does not act on them. A scene of threads alone is
/// refused if it asks for something else. Beside other objects this is a warning, because it may be meant for them.
void checkThreadTime(YamlMap& map, const SceneConfig& scene)
{
  YamlMap time(map.find("time"));
  const bool alone = scene.rods.empty() && scene.bodies.empty() && scene.cloths.empty();
  const auto refuse = [&](const YamlCursor& at, const std::string& problem, const std::string& warning) {
    if (alone)
      at.problem(problem);
    else
      at.warning(warning);
  };
  if (time.has("integrator") && scene.time.integrator != Integrator::implicit_euler)
  {
    refuse(time.find("integrator"), "is not for threads; must be implicit_euler",
           "does not hold for the scene's threads, which take implicit Euler steps.");
  }
  if (scene.start.equilibrium)
  {
    refuse(map.find("start"), "is not for threads, which flow; must be as_given",
           "does not hold for the scene's threads, which flow: they start as given.");
  }
  if (scene.time.error_tolerance > 0)
  {
    refuse(time.find("error_tolerance"), "is not for threads, whose steps are of fixed length; leave it out",
           "does not hold for the scene's threads, whose steps are of fixed length.");
  }
  if (scene.wind != Eigen::Vector3d::Zero() || scene.wind_topic)
    map.find("wind").warning("does not act on threads.");
}

/// Rods that track a guide take implicit Euler steps of fixed length.
void checkTrackedTime(YamlMap& map, SceneConfig& scene)
{
  YamlMap time(map.find("time"));
  if (!time.has("integrator"))
    scene.time.integrator = Integrator::implicit_euler;
  else if (scene.time.integrator != Integrator::implicit_euler)
    time.find("integrator").problem("is not for rods that track a guide; must be implicit_euler");
  if (scene.time.error_tolerance > 0)
  {
    time.find("error_tolerance")
        .problem("is not for rods that track a guide, whose steps are of fixed length; leave it out");
  }
  if (scene.start.equilibrium)
    map.find("start").problem("is not for rods that track a guide; must be as_given");
}

bool touchesSomething(const RodConfig& rod) { return rod.contact.has_value(); }

/// Whether a simulated body has a shape that may hit something.
bool hitsSomething(const SceneConfig& scene, const BodyConfig& body)
{
  return body.isSimulatedSolid() &&
         (!scene.obstacles.empty() ||
          std::any_of(scene.threads.begin(), scene.threads.end(),
                      [](const ThreadConfig& thread) { return thread.contact.has_value(); }) ||
          std::any_of(scene.bodies.begin(), scene.bodies.end(),
                      [&](const BodyConfig& other) { return &other != &body && other.isSolid(); }));
}

/// The integrator of rods and bodies that touch something.
void checkContactTime(const YamlCursor& time, SceneConfig& scene)
{
  const auto hits = [&](const BodyConfig& body) { return hitsSomething(scene, body); };
  const bool touches = std::any_of(scene.rods.begin(), scene.rods.end(), touchesSomething) ||
                       std::any_of(scene.bodies.begin(), scene.bodies.end(), hits);
  if (touches && !time.find("integrator").present())
  {
    // methods of second order carry an impact's velocity on and bounce
    scene.time.integrator = Integrator::implicit_euler;
    const bool changed = !std::all_of(scene.rods.begin(), scene.rods.end(), touchesSomething);
    if (changed)
      scene.notes.push_back(
          "contact makes implicit_euler the default integrator of the whole scene, also of rods without contact; give "
          "time.integrator to choose");
  }
  else if (touches && scene.time.integrator != Integrator::implicit_euler &&
           scene.time.integrator != Integrator::symplectic_euler)
  {
    time.find("integrator")
        .warning(
            "of second order carries the velocity before an impact beyond it, so that a rod or body may bounce higher "
            "than it fell: use implicit_euler, the default with contact, where something is hit");
  }
  if (touches && scene.time.integrator == Integrator::symplectic_euler)
  {
    time.find("integrator")
        .problem(
            "takes no contact, whose forces are too stiff for explicit steps; must be implicit_euler, bdf2 or tr_bdf2, "
            "or nothing may have contact (bodies: contact: false)");
  }
}

}   // namespace

void chooseIntegrator(YamlMap& map, const YamlCursor& time, SceneConfig& scene)
{
  checkContactTime(time, scene);
  if (std::any_of(scene.rods.begin(), scene.rods.end(), [](const RodConfig& rod) { return rod.tracking != nullptr; }))
    checkTrackedTime(map, scene);
  if (!scene.threads.empty())
    checkThreadTime(map, scene);
  if (!scene.cloths.empty())
    checkClothTime(map, scene);
  if (scene.time.integrator == Integrator::imex &&
      !(scene.rods.empty() && scene.threads.empty() && scene.bodies.empty()))
  {
    time.find("integrator").problem("is for cloth only; must be another one in scenes with rods, threads or bodies");
  }
}

}   // namespace slender
