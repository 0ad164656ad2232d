// Chooses the integrator of a scene, and reports options of time that its objects do not support.
#include <algorithm>
#include <string>
#include <vector>

#include "read_parts.h"

namespace slender {

namespace {

bool hasContact(const RodConfig& rod) { return rod.contact.has_value(); }

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

/// Whether a rod or a simulated body of the scene may hit something.
bool touchesSomething(const SceneConfig& scene)
{
  return std::any_of(scene.rods.begin(), scene.rods.end(), hasContact) ||
         std::any_of(scene.bodies.begin(), scene.bodies.end(),
                     [&](const BodyConfig& body) { return hitsSomething(scene, body); });
}

/// Whether an object of the scene takes no other steps than those of implicit Euler.
bool takesImplicitEulerAlone(const SceneConfig& scene)
{
  const auto any = [](const auto& objects, const auto& is) { return std::any_of(objects.begin(), objects.end(), is); };
  return any(scene.rods, [](const RodConfig& rod) { return rod.tracking != nullptr; }) ||
         any(scene.cloths,
             [](const ClothConfig& cloth) {
               return cloth.tracking || (cloth.contact && cloth.contact->method == ContactMethod::barrier);
             }) ||
         (touchesSomething(scene) &&
          any(scene.threads, [](const ThreadConfig& thread) { return thread.contact.has_value(); }));
}

/// The integrators that all objects of a scene with rods, bodies or cloth take.
std::vector<std::string> integratorsFor(const SceneConfig& scene)
{
  std::vector<std::string> words = {"implicit_euler"};
  if (takesImplicitEulerAlone(scene))
    return words;
  const bool touches = touchesSomething(scene), cloth = !scene.cloths.empty();
  if (!cloth)
    words.push_back("bdf2");
  words.push_back("tr_bdf2");
  if (!cloth && !touches)
    words.insert(words.end(), {"implicit_midpoint", "generalized_alpha"});
  if (!touches)
    words.push_back("symplectic_euler");
  if (scene.rods.empty() && scene.threads.empty() && scene.bodies.empty())
    words.push_back("imex");
  return words;
}

/// "must be one of: ...", for messages about the integrator.
std::string mustBe(const SceneConfig& scene)
{
  const std::vector<std::string> words = integratorsFor(scene);
  return (words.size() > 1 ? "must be one of: " : "must be ") + joinWords(words);
}

void checkClothTime(YamlMap& map, SceneConfig& scene)
{
  const YamlCursor time = map.find("time");
  const std::vector<std::string> taken = integratorsFor(scene);
  if (!time.find("integrator").present())
  {
    if (scene.time.integrator != Integrator::implicit_euler && !(scene.rods.empty() && scene.bodies.empty()))
    {
      map.find(map.has("cloths") ? "cloths" : "tracked")
          .warning(
              "makes implicit_euler the default integrator of the rods and bodies as well, which is of first order; "
              "without cloth it is " +
              std::string(toString(scene.time.integrator)) + ": give time.integrator, which in this scene " +
              mustBe(scene));
    }
    scene.time.integrator = Integrator::implicit_euler;
  }
  else if (std::find(taken.begin(), taken.end(), toString(scene.time.integrator)) == taken.end())
  {
    time.find("integrator").problem("is not for the cloth of this scene; " + mustBe(scene));
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

/// The integrator of rods and bodies that touch something.
void checkContactTime(const YamlCursor& time, SceneConfig& scene)
{
  const bool touches = touchesSomething(scene);
  if (touches && !time.find("integrator").present())
  {
    // methods of second order carry an impact's velocity on and bounce
    scene.time.integrator = Integrator::implicit_euler;
    const bool changed = !std::all_of(scene.rods.begin(), scene.rods.end(), hasContact);
    if (changed)
      scene.notes.push_back(
          "contact makes implicit_euler the default integrator of the whole scene, also of rods without contact; give "
          "time.integrator to choose");
  }
  else if (touches && (scene.time.integrator == Integrator::bdf2 || scene.time.integrator == Integrator::tr_bdf2))
  {
    time.find("integrator")
        .warning(
            "of second order carries the velocity before an impact beyond it, so that a rod or body may leave "
            "a collision much faster than it came: use implicit_euler, the default with contact, where something is "
            "hit");
  }
  const bool ends_ahead =
      scene.time.integrator == Integrator::implicit_midpoint || scene.time.integrator == Integrator::generalized_alpha;
  if (touches && (ends_ahead || scene.time.integrator == Integrator::symplectic_euler))
  {
    time.find("integrator")
        .problem(std::string("takes no contact, ") +
                 (ends_ahead ? "because its steps end beyond where contact keeps surfaces apart"
                             : "whose forces are too stiff for explicit steps") +
                 "; " + mustBe(scene) + ", or nothing may have contact (bodies: contact: false)");
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
  else if (scene.time.integrator == Integrator::imex && !(scene.rods.empty() && scene.bodies.empty()))
    time.find("integrator").problem("is for cloth only; " + mustBe(scene));
}

}   // namespace slender
