#include <algorithm>

#include "read_parts.h"

namespace slender {

namespace {

constexpr double most_factor = 1e9;
const Range factor_range = Range::closed(-most_factor, most_factor);

void readLoadPlace(YamlMap& map, const RodConfig& rod, RodLoadConfig& load)
{
  const YamlCursor at =
      map.get("at",
              "Where the load acts, as an arc length of the rest shape from the first node, or at the rod's start or "
              "end. Between two nodes both bear the load. Give either `at` or `node`.");
  const YamlCursor node = map.get("node", "Node on which the load acts. Give either `at` or `node`.");
  if (!map.hasOne({at, node}, "must have either at: start, end or an arc length [m], or node: INDEX"))
    return;
  const int nodes = rod.edges == 0 ? max_edges + 1 : rod.nodes();
  if (node.present())
  {
    if (const auto index = node.integer(-nodes, nodes - 1))
      load.node = *index < 0 ? *index + nodes : *index;
    return;
  }
  if (at.isWord("start") || at.isWord("end"))
  {
    load.node = at.isWord("start") ? 0 : nodes - 1;
    if (rod.closed)
      at.problem("is not for a closed rod, which has no ends; give an arc length [m], or node: INDEX");
    return;
  }
  assign(load.arc_length, at.number(Range::closed(0, 1e9, "m, start or end")));
}

RodLoadConfig readRodLoad(const YamlCursor& at, const RodConfig& rod)
{
  RodLoadConfig load;
  YamlMap map(at);
  readLoadPlace(map, rod, load);
  const YamlCursor force = map.get("force", load.force, Range::closed(-1e15, 1e15, "N"),
                                   "Force that keeps its size and its direction in the world. Without the key: none.");
  const YamlCursor torque =
      map.get("torque",
              "Torque about the tangent of the rod, right-handed about the direction from the first node to the last. "
              "A bending moment is a couple of forces instead. Without the key: none.");
  if (torque.isList())
  {
    torque.problem(
        "is a vector, and a torque that keeps its direction in the world has no potential: its work depends on the way "
        "that the rod turns, so that no energy tells which equilibrium is stable; must be a number [N m] about the "
        "tangent. For a bending moment give a couple: force: F at one node and force: -F at the next");
  }
  else
  {
    assign(load.torque, torque.number(Range::closed(-1e15, 1e15, "N m")));
  }
  if (at.isMap() && !force.present() && !torque.present())
    at.problem("has neither force: [x, y, z] nor torque; must have one of them");
  return load;
}

std::optional<PathConfig> readPath(const YamlCursor& at)
{
  if (!at.present())
    return std::nullopt;
  PathConfig path;
  YamlMap map(at);
  map.get("from", path.from, factor_range, "Load factor of the first equilibrium. Without the key: 0.");
  const YamlCursor to = map.get("to", path.to, factor_range, "Load factor at which the path ends. Without the key: 1.");
  map.get("steps", path.steps, Range::closed(1, 100'000),
          "Number of steps of equal length along the path, if nothing moves; more are taken where the rod moves. "
          "Without the key: 20.");
  if (path.from == path.to)
    to.problem("is the factor that the path starts from; must differ from it");
  return path;
}

/// The largest factor; nothing when it is not asked for.
std::optional<double> readBuckling(const YamlCursor& at)
{
  constexpr double kFarEnough = 1e6;
  if (!at.present())
    return std::nullopt;
  if (at.isMap())
  {
    YamlMap map(at);
    double up_to = kFarEnough;
    map.get("up_to", up_to, Range::above(0, most_factor),
            "Largest load factor up to which the critical one is looked for. Without the key: 1000000.");
    return up_to;
  }
  return at.boolean().value_or(false) ? std::optional<double>(kFarEnough) : std::nullopt;
}

/// Why the scene is not one rod on its own; empty when it is.
std::string whyNotAlone(const SceneConfig& scene)
{
  if (scene.rods.size() != 1)
    return "there are " + std::to_string(scene.rods.size()) + " rods";
  if (scene.rods[0].contact)
    return "rod " + scene.rods[0].name + " has contact";
  if (!scene.cloths.empty())
    return "there is the cloth " + scene.cloths[0].name;
  for (const BodyConfig& body : scene.bodies)
    if (!body.motion || !body.welds.empty())
      return "there is the body " + body.name;
  return "";
}

}   // namespace

std::vector<RodLoadConfig> readRodLoads(const YamlCursor& at, const RodConfig& rod)
{
  std::vector<RodLoadConfig> loads;
  for (const YamlCursor& item : at.items(1, 10'000))
    loads.push_back(readRodLoad(item, rod));
  return loads;
}

StartConfig readStart(const YamlCursor& at)
{
  StartConfig start;
  if (!at.isMap())
  {
    start.equilibrium = at.choice<bool>({{"as_given", false}, {"equilibrium", true}}).value_or(false);
    return start;
  }
  YamlMap map(at);
  map.get("equilibrium", start.equilibrium,
          "Whether the static solver runs before the first step, so that the scene starts at a stable equilibrium. "
          "Without the key: false.");
  const YamlCursor keep = map.get("keep_velocities", start.keep_velocities,
                                  "Whether simulated bodies have their `velocity` at the equilibrium. Without the key: "
                                  "false, everything is at rest.");
  map.get(
      "accept_unstable", start.accept_unstable,
      "Whether an unstable equilibrium is accepted with a warning. Without the key: false, such a scene is refused.");
  if (start.keep_velocities && !start.equilibrium)
    keep.problem("needs equilibrium: true; a scene that starts as given keeps all velocities anyway");
  return start;
}

std::optional<StaticsConfig> readStatics(const YamlCursor& at)
{
  if (!at.present())
    return std::nullopt;
  StaticsConfig statics;
  YamlMap map(at);
  const YamlCursor factors = map.get("factors",
                                     "Load factors at each of which a stable equilibrium is found, each from the one "
                                     "before. Without `factors` and `path`: one equilibrium at the factor 1.");
  const YamlCursor path = map.get("path",
                                  "Equilibria, stable or not, that are followed while the load factor grows, also "
                                  "through folds. For scenes of one rod without contact, bodies and cloth.");
  map.get(
      "perturbation", statics.perturbation, Range::closed(-1, 1),
      "Imperfection that rounds branch points off: forces along the lowest mode of the first equilibrium, whose sizes "
      "sum to this share of the scaled loads. A negative number pushes to the other side. Without the key: 0.");
  if (const auto values = factors.numbers(factor_range))
  {
    statics.factors = *values;
    if (values->empty())
      factors.problem("is empty; must have at least one factor");
  }
  statics.path = readPath(path);
  if (factors.present() && path.present())
    path.problem("and factors are two ways to choose the factors; leave one of them out");
  map.get("scales", statics.scales,
          {{"all", FactorScales::all}, {"gravity", FactorScales::gravity}, {"loads", FactorScales::loads}},
          "Which loads the load factor multiplies: gravity, the `loads` of rods and cloths, or both. Without the key: "
          "all.");
  statics.buckling =
      readBuckling(map.get("buckling",
                           "Whether the critical load factor is found: the smallest at which the equilibrium stops "
                           "being stable. Give true, or a map with `up_to`. Without the key: false."));
  return statics;
}

void checkStatics(const YamlCursor& at, const SceneConfig& scene)
{
  if (!scene.statics)
    return;
  const StaticsConfig& statics = *scene.statics;
  if (!scene.threads.empty())
    at.problem("is for rods, cloths and bodies; the scene has threads, which flow");
  YamlMap map(at);
  const std::string joined = whyNotAlone(scene);
  for (const auto& [key, given] :
       {std::make_pair("path", statics.path.has_value()), std::make_pair("buckling", statics.buckling.has_value()),
        std::make_pair("perturbation", statics.perturbation != 0)})
  {
    if (given && !joined.empty())
    {
      map.find(key).problem("is for scenes of one rod that touches nothing and carries no body, but " + joined +
                            "; factors can be given for all scenes");
    }
  }
  const auto bears = [](const auto& object) { return !object.loads.empty(); };
  const bool loaded = std::any_of(scene.rods.begin(), scene.rods.end(), bears) ||
                      std::any_of(scene.cloths.begin(), scene.cloths.end(), bears);
  const bool weighs = scene.gravity.norm() > 0 && statics.scales != FactorScales::loads;
  const bool pulls = loaded && statics.scales != FactorScales::gravity;
  if (!weighs && !pulls)
  {
    at.problem(
        "has nothing to scale: a load factor multiplies gravity and the loads of rods and cloths (scales); give one of "
        "them");
  }
}

}   // namespace slender
