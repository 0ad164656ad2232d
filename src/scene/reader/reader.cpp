#include "slender_sim/scene/reader.h"

#include <algorithm>
#include <filesystem>
#include <fstream>
#include <map>
#include <set>
#include <sstream>

#include "read_parts.h"
#include "scene_text.h"

namespace slender {

namespace {

constexpr std::uintmax_t max_file_size = 256u << 20;   // [bytes]

/// Adds what the generators made; names must differ from those of the file.
void takeGeneratedRods(Generated& generated, std::vector<RodConfig>& rods)
{
  std::set<std::string> names, grasps;
  const auto take = [&](std::set<std::string>& used, const std::string& what, const std::string& name,
                        const YamlCursor* maker) {
    if (!used.insert(name).second && maker)
    {
      maker->problem("makes a " + what + " " + name + ", whose name is taken; give the generator another name");
      return false;
    }
    return true;
  };
  for (const RodConfig& rod : rods)
  {
    take(names, "rod", rod.name, nullptr);
    for (const GraspConfig& grasp : rod.grasps)
      take(grasps, "grasp", grasp.name, nullptr);
  }
  bool good = true;   // one generator repeats itself thousands of times
  for (auto& [rod, maker] : generated.rods)
  {
    good = good && take(names, "rod", rod.name, &maker);
    for (const GraspConfig& grasp : rod.grasps)
      good = good && take(grasps, "grasp", grasp.name, &maker);
    rod.place = maker.place();
    rods.push_back(std::move(rod));
  }
}

/// The grasps of all rods and cloths that the lists of the scene have.
std::vector<ListedGrasp> listedGrasps(const SceneConfig& scene, const std::vector<YamlCursor>& rods,
                                      const std::vector<YamlCursor>& cloths)
{
  std::vector<ListedGrasp> all;
  for (std::size_t r = 0; r < rods.size(); ++r)
    for (const GraspConfig& grasp : scene.rods[r].grasps)
      all.push_back({grasp, rods[r].find("grasps").find(grasp.name), false});
  for (std::size_t k = 0; k < cloths.size(); ++k)
    for (const GraspConfig& grasp : scene.cloths[k].grasps)
      all.push_back({grasp, cloths[k].find("grasps").find(grasp.name), true});
  return all;
}

/// A grasp cannot follow what it may hold back. Bodies that the scene does not have may be known to a node.
void checkFollowed(const SceneConfig& scene, const std::vector<ListedGrasp>& grasps)
{
  std::set<std::string> simulated;
  std::vector<std::string> names;
  for (const BodyConfig& body : scene.bodies)
  {
    names.push_back(body.name);
    if (!body.motion)
      simulated.insert(body.name);
  }
  for (const ObstacleConfig& obstacle : scene.obstacles)
    names.push_back(obstacle.name);
  for (const ListedGrasp& grasp : grasps)
  {
    const auto* motion = std::get_if<BodyMotion>(&grasp.config.motion);
    if (motion && simulated.count(motion->body))
    {
      grasp.at.find("motion").problem("body " + motion->body + " is simulated; " +
                                      (grasp.of_cloth ? "cloth follows obstacles and driven bodies only"
                                                      : "weld the rod to it instead (bodies: welds)"));
    }
    else if (motion && std::find(names.begin(), names.end(), motion->body) == names.end())
    {
      grasp.at.find("motion").warning(
          "the scene has no body or obstacle of this name" + didYouMean(motion->body, names) +
          ": the grasp stays where it is, unless a node hears of the body in its bodies topic");
    }
  }
}

/// Returns why the contact of a cloth cannot be the barrier; empty: it can.
std::string whyNoBarrier(const SceneConfig& scene, std::size_t k)
{
  for (const ClothConfig& cloth : scene.cloths)
  {
    const auto* guide = cloth.tracking ? std::get_if<ClothGuide>(&cloth.tracking->guide.motion) : nullptr;
    if (guide && guide->cloth == static_cast<int>(k))
      return "is the guide of cloth " + cloth.name;
  }
  const auto& tracking = scene.cloths[k].tracking;
  if (!tracking)
    return "";
  const std::vector<FunctionSet>& sets = tracking->sets;
  const bool bounded =
      std::any_of(sets.begin(), sets.end(), [](const FunctionSet& set) { return set.bounds.size() > 0; });
  return bounded ? "has a max_traction" : "";
}

/// Sets the method of contact of each cloth that does not name one. Impulses are cheap, but let cloth meet nothing else
/// than cloth and what moves as prescribed.
void chooseContactMethods(const std::vector<YamlCursor>& cloths, SceneConfig& scene)
{
  const auto method = [&](std::size_t k) { return cloths[k].find("contact").find("method"); };
  bool others = false;
  for (const RodConfig& rod : scene.rods)
    others = others || rod.contact;
  for (const ThreadConfig& thread : scene.threads)
    others = others || thread.contact;
  for (const BodyConfig& body : scene.bodies)
    others = others || body.isSimulatedSolid();
  for (std::size_t k = 0; k < cloths.size(); ++k)
  {
    const ClothConfig& cloth = scene.cloths[k];
    others = others || (cloth.contact && method(k).present() && cloth.contact->method == ContactMethod::barrier);
  }
  for (std::size_t k = 0; k < cloths.size(); ++k)
  {
    if (!scene.cloths[k].contact)
      continue;
    ContactMethod& chosen = scene.cloths[k].contact->method;
    const std::string why_not = whyNoBarrier(scene, k);
    if (!method(k).present())
      chosen = others && why_not.empty() ? ContactMethod::barrier : ContactMethod::impulses;
    else if (!why_not.empty() && chosen == ContactMethod::barrier)
      method(k).problem("must be impulses, because this cloth " + why_not);
  }
}

/// Cloth that impulses correct after its step gives way, which nothing that is simulated along with it would notice.
void checkUnderCloth(const SceneConfig& scene, const std::vector<YamlCursor>& cloths)
{
  const auto body =
      std::find_if(scene.bodies.begin(), scene.bodies.end(), [](const BodyConfig& b) { return b.isSimulatedSolid(); });
  for (std::size_t k = 0; body != scene.bodies.end() && k < cloths.size(); ++k)
  {
    const std::optional<ContactProperties>& contact = scene.cloths[k].contact;
    if (contact && contact->solids && contact->method == ContactMethod::impulses)
    {
      cloths[k].find("contact").problem(
          "body " + body->name +
          " is simulated, and contact by impulses does not push bodies; give the body a motion or contact: false, or "
          "the cloth contact: {obstacles: false}" +
          (whyNoBarrier(scene, k).empty() ? " or contact: {method: barrier}" : ""));
    }
  }
}

/// Grasps of rods and of cloths are entries of one list of topics. Names of generated grasps have been compared with
/// those of the rods.
void checkGraspNames(const SceneConfig& scene, const std::vector<ListedGrasp>& grasps)
{
  std::map<std::string, std::string> owners;   // to what used the name first
  const auto check = [&](bool of_cloth) {
    for (const ListedGrasp& grasp : grasps)
    {
      if (grasp.of_cloth != of_cloth)
        continue;
      const auto [other, is_new] = owners.emplace(grasp.config.name, grasp.at.path());
      if (!is_new)
        grasp.at.problem("has the same name as " + other->second + "; grasps of a scene need different names");
    }
  };
  check(false);
  for (const RodConfig& rod : scene.rods)   // generated ones
    for (const GraspConfig& grasp : rod.grasps)
      owners.emplace(grasp.name, "a grasp of " + rod.name);
  check(true);
}

/// All that has a place in space.
void readObjects(YamlMap& map, const ReadContext& context, SceneConfig& scene)
{
  // in the order of docs/scene_reference.md
  const YamlCursor at_rods = map.get("rods", "Elastic rods: cables, ropes, wires, hair.");
  const YamlCursor at_threads = map.get("threads", "Viscous threads.");
  const YamlCursor at_cloths = map.get("cloths", "Cloths.");
  const YamlCursor at_tracked = map.get("tracked",
                                        "Cloths and thin shells that track a guide. All keys of `cloths` but `grid`, "
                                        "`mesh` and `loads` are allowed, too.");
  const YamlCursor at_bodies =
      map.get("bodies", "Rigid bodies: simulated ones, which forces move, and driven ones, whose motion is given.");
  const YamlCursor at_obstacles = map.get(
      "obstacles", "Solids that move as prescribed, and that rods, threads, cloths and bodies with contact touch.");
  const YamlCursor at_robot = map.get(
      "robot", "A robot, or a list of robots. The collision shapes of its links become obstacles that follow tf.");
  const YamlCursor at_contact =
      map.get("contact", "Settings of all contacts of rods, threads, bodies and of cloth with method barrier.");
  const YamlCursor at_generate =
      map.get("generate", "Chains, trees and hair, which are expanded into rods, bodies and obstacles.");
  if (!at_rods.present() && !at_generate.present() && !at_threads.present() && !at_cloths.present() &&
      !at_tracked.present() && !at_bodies.present())
  {
    at_rods.problem(
        "is missing; a scene has rods: [{...}], threads: [{...}], cloths: [{...}], tracked: [{...}], generate: [{...}] "
        "or bodies: [{...}]");
  }
  scene.rods = readNamed(at_rods, 100'000, "rod", context, readRod);
  Generated generated = readGenerators(at_generate, context, static_cast<int>(scene.rods.size()));
  takeGeneratedRods(generated, scene.rods);
  scene.threads = readNamed(at_threads, 10'000, "thread", context, readThread);
  scene.cloths = readNamed(at_cloths, 1000, "cloth", context, readCloth);
  readTrackedCloths(at_tracked, context, scene.cloths);
  scene.obstacles = readEach(at_obstacles, 0, 100'000, "obstacle", context, readObstacle);
  auto robots = readRobots(at_robot, context);
  scene.bodies = readBodies(at_bodies, context, scene.rods);
  std::vector<YamlCursor> cloths = entriesOf(at_cloths);
  for (const YamlCursor& entry : entriesOf(at_tracked))
    cloths.push_back(entry);

  std::map<std::string, std::string> solids;   // to the path that used it first; both are entries of one topic
  const auto takeSolid = [&solids](const YamlCursor& at, const std::string& name, bool generated) {
    const auto [other, is_new] = solids.emplace(name, at.path());
    if (is_new)
      return;
    const std::string reason = "is also the name of " + other->second + "; names of bodies and obstacles must differ";
    generated ? at.problem("makes " + name + ", which " + reason) : at.find("name").problem(reason);
  };
  const std::vector<YamlCursor> obstacles = entriesOf(at_obstacles), bodies = entriesOf(at_bodies);
  for (std::size_t k = 0; k < scene.obstacles.size(); ++k)
    takeSolid(obstacles[k], scene.obstacles[k].name, false);
  for (std::size_t k = 0; k < scene.bodies.size(); ++k)
    takeSolid(bodies[k], scene.bodies[k].name, false);
  for (auto* made : {&generated.obstacles, &robots})
    for (auto& [obstacle, maker] : *made)
    {
      takeSolid(maker, obstacle.name, true);
      scene.obstacles.push_back(std::move(obstacle));
    }
  for (auto& [body, maker] : generated.bodies)
  {
    takeSolid(maker, body.name, true);
    scene.bodies.push_back(std::move(body));
  }
  chooseContactMethods(cloths, scene);
  scene.contact = readContact(at_contact, scene);
  completeThreads(scene, entriesOf(at_threads));
  const std::vector<ListedGrasp> grasps = listedGrasps(scene, entriesOf(at_rods), cloths);
  checkFollowed(scene, grasps);
  checkIgnoredContacts(scene, grasps);
  checkGraspNames(scene, grasps);
  checkUnderCloth(scene, cloths);
}

SceneConfig readTree(const YamlTree& tree, const std::string& name, const std::string& directory, KeyLog* log = nullptr)
{
  SceneConfig scene;
  Problems problems(name, log);
  const YamlCursor root(&tree, nullptr, "", problems);
  if (tree.kind != YamlTree::Kind::map)
  {
    throw SceneError(name + ":" + std::to_string(std::max(1, tree.line)) + ": scene: is " + toString(tree.kind) +
                     "; must be a map, at least with rods: [{...}], threads: [{...}] or cloths: [{...}]");
  }
  YamlMap map(root);
  // The largest acceleration serves scaled problems, whose lengths, masses and moduli are of order one.
  const Range acceleration = Range::closed(-1e9, 1e9, "m/s^2"),
              speed = Range::closed(-kMaxWindSpeed, kMaxWindSpeed, "m/s");
  map.get("name", scene.name, "Name of the scene. Without the key: scene.");
  map.get("gravity", scene.gravity, acceleration, "Acceleration by gravity. Without the key: [0, 0, -9.81] m/s^2.");
  const YamlCursor wind = map.get("wind",
                                  "The air, the same everywhere. It acts on rods with `damping.drag`, and on cloths "
                                  "with `aerodynamics` or `damping.drag`.");
  YamlMap wind_map(wind);
  wind_map.get("velocity", scene.wind, speed, "Velocity of the air. Without the key: [0, 0, 0], still air.");
  const YamlCursor wind_topic = wind_map.get(
      "topic", scene.wind_topic, "Whether messages on the topic `wind` set the velocity. Without the key: false.");
  wind_map.finish();
  scene.start = readStart(map.get("start",
                                  "How the scene starts: `as_given`, or in a static equilibrium, which the static "
                                  "solver finds first. Without the key: as_given."));
  const YamlCursor statics = map.get("statics", "What `simulate --statics` finds. Without the key: one equilibrium.");
  scene.statics = readStatics(statics);
  const YamlCursor time =
      map.get("time", "Time steps, duration and solver. Without the key: the defaults of the keys in it.");
  scene.time = readTime(time);
  const YamlCursor record = map.get("record", "What is recorded. Without the key: every step, the motion alone.");
  scene.record = readRecord(record);
  scene.limits = readLimits(map.get("limits",
                                    "Limits of strain, force, torque and speed. A run warns when one is exceeded. "
                                    "Without the key: the defaults of the keys in it."));
  ReadContext context;
  context.directory = directory;
  context.gravity = scene.gravity;
  context.step = scene.time.step;
  readObjects(map, context, scene);
  scene.guide_bags = context.guide_bags;
  completeRecord(record, scene);
  checkStatics(statics, scene);
  chooseIntegrator(map, time, scene);
  map.finish();
  if (!problems.empty())
    throw SceneError(problems.text());
  warnOfIgnoredKeys(map, scene);
  scene.warnings = problems.warnings();
  return scene;
}

std::string directoryOf(const std::string& path)
{
  const std::string directory = std::filesystem::path(path).parent_path().string();
  return directory.empty() ? "." : directory;
}

/// Where a relative path is looked for: roslaunch starts nodes in a folder of its own.
std::string lookedIn(const std::string& path)
{
  std::error_code error;
  const std::filesystem::path folder = std::filesystem::current_path(error);
  return std::filesystem::path(path).is_absolute() || error
             ? ""
             : " in " + folder.string() + " (give a whole path if it is elsewhere)";
}

}   // namespace

std::string fileText(const std::string& path)
{
  std::error_code error;
  if (!std::filesystem::is_regular_file(path, error))
  {
    throw SceneError(
        path + ": " +
        (std::filesystem::exists(path, error) ? "is not a regular file" : "no such file" + lookedIn(path)));
  }
  if (std::filesystem::file_size(path, error) > max_file_size)
    throw SceneError(path + ": is larger than " + std::to_string(max_file_size >> 20) + " MiB");
  std::ifstream file(path, std::ios::binary);
  std::ostringstream text;
  text << file.rdbuf();
  if (!file)
    throw SceneError(path + ": cannot be read");
  return text.str();
}

void requireCoordinates(const Eigen::Matrix3Xd& points, const std::string& what, const std::string& where)
{
  if (!(points.cwiseAbs().maxCoeff() <= kMaxCoordinate))
    throw std::runtime_error(what + "has coordinates beyond " + shortNumber(kMaxCoordinate) + " m" + where);
}

void takeName(std::map<std::string, std::string>& names, const YamlCursor& entry, const std::string& name)
{
  const auto [other, is_new] = names.emplace(name, entry.path());
  if (!is_new)
    entry.find("name").problem("is also the name of " + other->second + "; names must differ");
}

bool ReadContext::claim(const YamlCursor& at, double more) const
{
  nodes += more;
  if (nodes <= kMaxSceneNodes)
    return true;
  at.problem("makes " + shortNumber(more) + " nodes, with which the scene has " + shortNumber(nodes) +
             "; all its rods and cloths together may have " + shortNumber(kMaxSceneNodes));
  nodes -= more;   // what comes after may still fit
  return false;
}

SceneConfig parseScene(const std::string& text, const std::string& name, const std::vector<std::string>& overrides,
                       const std::string& directory)
{
  YamlTree tree = parseYaml(text, name);
  for (const std::string& assignment : overrides)
    applyOverride(tree, assignment);
  const bool completed = takeRobotParameters(tree, directory);
  SceneConfig scene = sceneOfTree(tree, name, directory);
  scene.source = overrides.empty() && !completed ? text : writeYaml(tree);
  return scene;
}

SceneConfig sceneOfTree(const YamlTree& tree, const std::string& file, const std::string& directory)
{
  SceneConfig scene = readTree(tree, file, directory);
  scene.file = file;
  scene.directory = directory;
  return scene;
}

void logKeysOf(const std::string& text, KeyLog& log, const std::string& directory)
{
  try
  {
    readTree(parseYaml(text, "scene"), "scene", directory, &log);
  }
  catch (const SceneError&)
  {
  }
}

void logKeys(const std::string& path, KeyLog& log) { logKeysOf(fileText(path), log, directoryOf(path)); }

SceneConfig readScene(const std::string& path, const std::vector<std::string>& overrides)
{
  return parseScene(fileText(path), path, overrides, directoryOf(path));
}

}   // namespace slender
