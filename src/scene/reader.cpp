#include "slender_sim/scene/reader.h"

#include <filesystem>
#include <fstream>
#include <map>
#include <sstream>

#include "read_parts.h"

namespace slender {

namespace {

constexpr std::uintmax_t max_file_size = 256u << 20;   // [bytes]

std::vector<RodConfig> readRods(const YamlCursor& at, const ReadContext& context)
{
  std::vector<RodConfig> rods;
  std::map<std::string, std::string> rod_names, grasp_names;   // to the path that used it first
  const auto entries = at.items(1, 100'000);
  for (std::size_t k = 0; k < entries.size(); ++k)
  {
    const YamlCursor& entry = entries[k];
    rods.push_back(readRod(entry, context, entries.size() == 1 ? "rod" : "rod" + std::to_string(k)));
    const auto [rod, new_rod] = rod_names.emplace(rods.back().name, entry.path());
    if (!new_rod)
    {
      YamlMap(entry).get("name").problem("is also the name of " + rod->second + "; names must differ");
    }
    for (const GraspConfig& grasp : rods.back().grasps)
    {
      const std::string path = entry.path() + ".grasps." + grasp.name;
      const auto [other, new_grasp] = grasp_names.emplace(grasp.name, path);
      if (!new_grasp)
      {
        YamlMap(YamlMap(entry).get("grasps")).get(grasp.name).problem("has the same name as " + other->second +
                                                                      "; grasps of a scene need different names");
      }
    }
  }
  return rods;
}

SceneConfig readTree(const YamlTree& tree, const std::string& name, const std::string& directory)
{
  SceneConfig scene;
  Problems problems(name);
  const YamlCursor root(&tree, nullptr, "", problems);
  if (tree.kind != YamlTree::Kind::map)
  {
    throw SceneError(name + ":" + std::to_string(std::max(1, tree.line)) + ": scene: is " + toString(tree.kind) +
                     "; must be a map, at least with rods: [{...}]");
  }
  YamlMap map(root);
  const Range acceleration = Range::closed(-1e4, 1e4, "m/s^2"), speed = Range::closed(-1e3, 1e3, "m/s");
  assign(scene.name, map.get("name").text());
  assign(scene.gravity, map.get("gravity").vector3(acceleration));
  const YamlCursor wind = map.get("wind");
  YamlMap wind_map(wind);
  assign(scene.wind, wind_map.get("velocity").vector3(speed));
  wind_map.finish();
  assign(scene.start, map.get("start").choice<Start>({{"as_given", Start::as_given}, {"equilibrium", Start::equilibrium}}));
  scene.time = readTime(map.get("time"));
  YamlMap record(map.get("record"));
  assign(scene.record.every, record.get("every").integer(1, 1'000'000'000, "steps"));
  record.finish();
  ReadContext context;
  context.directory = directory;
  context.gravity = scene.gravity;
  scene.rods = readRods(map.require("rods"), context);
  map.finish();
  if (!problems.empty())
  {
    throw SceneError(problems.text());
  }
  return scene;
}

}  // namespace

TimeConfig readTime(const YamlCursor& at)
{
  TimeConfig time;
  YamlMap map(at);
  assign(time.step, map.get("step").number(Range::above(0, 10, "s")));
  assign(time.duration, map.get("duration").number(Range::above(0, 1e7, "s")));
  assign(time.integrator, map.get("integrator").choice<Integrator>({{"implicit_euler", Integrator::implicit_euler},
                                                                    {"bdf2", Integrator::bdf2},
                                                                    {"tr_bdf2", Integrator::tr_bdf2},
                                                                    {"implicit_midpoint", Integrator::implicit_midpoint},
                                                                    {"generalized_alpha", Integrator::generalized_alpha},
                                                                    {"symplectic_euler", Integrator::symplectic_euler}}));
  assign(time.spectral_radius, map.get("spectral_radius").number(Range::closed(0, 1)));
  assign(time.error_tolerance, map.get("error_tolerance").number(Range::closed(0, 1, "m")));
  const YamlCursor min_step = map.get("min_step");
  if (const auto value = min_step.number(Range::above(0, 10, "s")))
  {
    time.min_step = *value;
    if (*value > time.step)
    {
      min_step.problem("is longer than time.step; must be in (0, " + shortNumber(time.step) + "] s");
    }
  }
  time.min_step = std::min(time.min_step, time.step);
  YamlMap newton(map.get("newton"));
  assign(time.newton.tolerance, newton.get("tolerance").number(Range::between(1e-14, 1e-1)));
  assign(time.newton.max_iterations, newton.get("max_iterations").integer(1, 1000));
  assign(time.newton.max_cuts, newton.get("max_cuts").integer(0, 30));
  newton.finish();
  map.finish();
  return time;
}

SceneConfig parseScene(const std::string& text, const std::string& name, const std::vector<std::string>& overrides,
                       const std::string& directory)
{
  YamlTree tree = parseYaml(text, name);
  for (const std::string& assignment : overrides)
  {
    applyOverride(tree, assignment);
  }
  SceneConfig scene = readTree(tree, name, directory);
  scene.source = overrides.empty() ? text : writeYaml(tree);
  return scene;
}

SceneConfig readScene(const std::string& path, const std::vector<std::string>& overrides)
{
  std::error_code error;
  if (!std::filesystem::is_regular_file(path, error))
  {
    throw SceneError(path + ": " + (std::filesystem::exists(path, error) ? "is not a regular file" : "no such file"));
  }
  if (std::filesystem::file_size(path, error) > max_file_size)
  {
    throw SceneError(path + ": is larger than " + std::to_string(max_file_size >> 20) + " MiB");
  }
  std::ifstream file(path, std::ios::binary);
  std::ostringstream text;
  text << file.rdbuf();
  if (!file)
  {
    throw SceneError(path + ": cannot be read");
  }
  const std::string directory = std::filesystem::path(path).parent_path().string();
  return parseScene(text.str(), path, overrides, directory.empty() ? "." : directory);
}

}  // namespace slender
