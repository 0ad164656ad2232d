#include <algorithm>
#include <tuple>

#include "read_parts.h"

namespace slender {

namespace {

/// Consecutive indices first..last of edges or nodes. Reported and empty otherwise.
std::optional<std::pair<int, int>> readIndices(const YamlCursor& at, int count)
{
  const std::vector<int> indices = readIndexList(at, count);
  if (indices.empty())
    return std::nullopt;
  for (std::size_t k = 1; k < indices.size(); ++k)
    if (indices[k] != indices[k - 1] + 1)
      return at.problem("must be consecutive and each given once; make one grasp for each group");
  return std::make_pair(indices.front(), indices.back());
}

void readHeldNodes(YamlMap& map, GraspConfig& grasp, const RodConfig& rod)
{
  const YamlCursor edge_list =
      map.get("edges",
              "Edges that are held, as consecutive indices; a negative index counts from the end, and \"3..7\" is a "
              "range. A single end edge of an open rod, [0] or [-1], means the section at the end node, so that the "
              "whole length is free. All nodes of other edges are held. Give either `edges` or `nodes`.");
  const YamlCursor node_list =
      map.get("nodes",
              "Nodes that are held, as consecutive indices; a negative index counts from the end, and \"3..7\" is a "
              "range. One index holds the section at that node. Give either `edges` or `nodes`.");
  if (!map.hasOne({edge_list, node_list},
                  "must have either edges or nodes, for example edges: [0] for the start of the rod or edges: [-1] for "
                  "its end"))
    return;
  if (node_list.present())
  {
    if (const auto held = readIndices(node_list, rod.nodes()))
      std::tie(grasp.first_node, grasp.last_node) = *held;
    return;
  }
  const auto held = readIndices(edge_list, rod.edges);
  if (held && rod.edges > 0)
    std::tie(grasp.first_node, grasp.last_node) = nodesOfEdges(edge_list, held->first, held->second, rod);
}

/// `direction` and `director` of a clamped section. They stand in for the orientation of poses that have none.
void readFrame(YamlMap& map, GraspConfig& grasp)
{
  const Range any = Range::closed(-1e6, 1e6);
  const YamlCursor direction =
      map.get("direction",
              "Tangent of the held section in world axes, from the first node to the last, for poses without an "
              "orientation. Without the key the tangent at the start is kept.");
  const YamlCursor director = map.get("director",
                                      "First material axis d1 of the held section in world axes, for poses without an "
                                      "orientation; the part along the tangent does not count. Without the key d1 at "
                                      "the start is carried to the new tangent by the smallest rotation.");
  for (const auto& [at, vector] :
       {std::make_pair(direction, &grasp.direction), std::make_pair(director, &grasp.director)})
  {
    const auto value = at.vector3(any);
    if (!value)
      continue;
    if (!(value->norm() > 0))
      at.problem("must not be zero");
    else if (grasp.hold == Hold::position)
      at.problem("needs hold: frame; hold: position leaves the direction free");
    else if (grasp.attach == Attach::initial)
      at.problem("needs attach: section; attach: initial keeps the orientation that the section has at the start");
    else
      *vector = value->normalized();
  }
  if (grasp.direction.cross(grasp.director).norm() < 1e-6 && grasp.direction.norm() * grasp.director.norm() > 0)
    map.find("director").problem("is along direction; must point away from it");
}

/// Poses with an orientation of their own leave nothing for `direction` and `director` to say.
void checkFrame(YamlMap& map, const GraspConfig& grasp)
{
  if (grasp.direction.isZero(0) && grasp.director.isZero(0))
    return;
  const YamlCursor at = map.find(grasp.direction.isZero(0) ? "director" : "direction"), motion = map.find("motion");
  const YamlCursor table = motion.isMap() ? motion.find("table") : motion;
  if (!std::holds_alternative<FixedMotion>(grasp.motion) && !(motion.isMap() && table.present()))
  {
    at.problem(
        "and this motion both say how the section is turned; must be left out, or the motion fixed or a table of [t, "
        "x, y, z]");
    return;
  }
  if (!table.isList())
    return;
  for (const YamlCursor& row : table.items())
  {
    if (row.isList() && row.items().size() == 8)
    {
      row.problem("has an orientation, and so has " +
                  std::string(grasp.direction.isZero(0) ? "director" : "direction") +
                  "; must be [t, x, y, z], or leave direction and director out");
    }
  }
}

}   // namespace

bool givesOffset(const YamlMap& grasp)
{
  const YamlCursor motion = grasp.find("motion");
  return grasp.has("offset") || (motion.isMap() && motion.find("offset").present());
}

void readOffset(YamlMap& map, GraspConfig& grasp)
{
  const YamlCursor own = map.get("offset",
                                 "Where the held part is in the frame that `motion` gives, for example in that of a "
                                 "gripper. It stays the same for ever; the grasp goes there, and after a reset again. "
                                 "Not with attach: initial. Without the key: as `attach` says.");
  const YamlCursor motion = map.find("motion");
  const YamlCursor of_tf = motion.isMap() ? motion.find("offset") : map.find("offset");
  const bool twice = motion.isMap() && own.present() && of_tf.present();
  const YamlCursor& given = own.present() ? own : of_tf;
  if (own.present())
    grasp.offset = readPose(own);
  if (!given.present())
    return;
  if (twice)
    own.problem("and motion.offset both say where the grasp is in the frame; leave one of them out");
  else if (grasp.attach == Attach::initial)
    given.problem("says where the held part is, and attach: initial keeps it where it is; leave one of them out");
  else if (std::holds_alternative<FixedMotion>(grasp.motion) && !motion.isMap())
    own.problem("is for grasps that something moves; this one is fixed");
  else if (!grasp.direction.isZero(0) || !grasp.director.isZero(0))
    own.problem("turns the section, and so do direction and director; leave offset or those out");
}

std::vector<int> readIndexList(const YamlCursor& at, int count)
{
  std::vector<int> indices;
  at.takes("a list of indices from 0 (negative: from the end) and ranges FIRST..LAST");
  const int limit = count > 0 ? count : max_edges + 1;
  const auto resolve = [&](int index) { return index < 0 && count > 0 ? index + count : index; };
  for (const YamlCursor& item : at.items(1, static_cast<std::size_t>(limit)))
  {
    const std::string text = item.isScalar() ? item.tree()->scalar : "";
    const auto dots = text.find("..");
    if (dots == std::string::npos)
    {
      const auto index = item.integer(-limit, limit - 1);
      if (!index)
        return {};
      indices.push_back(resolve(*index));
      continue;
    }
    const auto first = parseNumber(text.substr(0, dots)), last = parseNumber(text.substr(dots + 2));
    const auto fits = [&](const std::optional<double>& x) {
      return x && *x == std::floor(*x) && *x >= -limit && *x < limit;
    };
    if (!fits(first) || !fits(last) || resolve(static_cast<int>(*first)) > resolve(static_cast<int>(*last)))
    {
      item.problem("must be FIRST..LAST with whole numbers in [" + std::to_string(-limit) + ", " +
                   std::to_string(limit - 1) + "]");
      return {};
    }
    const int begin = resolve(static_cast<int>(*first)), end = resolve(static_cast<int>(*last)) + 1;
    if (indices.size() + static_cast<std::size_t>(end - begin) >
        static_cast<std::size_t>(limit))   // else a short list of ranges could fill the memory
    {
      item.problem("makes a list longer than the " + std::to_string(limit) + " places that there are; give each once");
      return {};
    }
    for (int index = begin; index < end; ++index)
      indices.push_back(index);
  }
  std::sort(indices.begin(), indices.end());
  return indices;
}

std::pair<int, int> nodesOfEdges(const YamlCursor& at, int first, int last, const RodConfig& rod)
{
  const int edges = rod.edges;
  if (!rod.closed && first == last && (first == 0 || first == edges - 1))
  {
    // The end section itself, not half an edge further in.
    return first == 0 ? std::make_pair(0, 0) : std::make_pair(edges, edges);
  }
  if (rod.closed && last + 1 == edges)
  {
    at.problem("holds the edge that joins the last node to the first; hold an edge in [0, " +
               std::to_string(edges - 2) + "]");
  }
  return {first, last + 1};
}

void readGraspContact(YamlMap& map, GraspConfig& grasp)
{
  const YamlCursor at = map.get("contact", "What the object of this grasp does not touch.");
  at.sharesKeysOf("rods.N.grasps.NAME.contact");
  if (!at.present())
    return;
  YamlMap contact(at);
  const YamlCursor ignore =
      contact.get("ignore",
                  "Names of obstacles, or frames of links of a robot, that the whole object passes through. Without "
                  "the key the part near the grasp passes through the links of robots that the held part touches at "
                  "the start; with [] through none.");
  ignore.takes("a list of names");
  if (!ignore.present())
    return;
  grasp.ignored_contacts.emplace();
  for (const YamlCursor& item : ignore.items())
    if (const auto name = item.text())
      grasp.ignored_contacts->push_back(*name);
}

void checkIgnoredContacts(const SceneConfig& scene, const std::vector<ListedGrasp>& grasps)
{
  std::vector<std::string> names;
  for (const ObstacleConfig& obstacle : scene.obstacles)
  {
    names.push_back(obstacle.name);
    if (!obstacle.link.empty() && obstacle.link != obstacle.name)
      names.push_back(obstacle.link);
  }
  for (const ListedGrasp& grasp : grasps)
    for (const std::string& name : grasp.config.ignored_contacts.value_or(std::vector<std::string>{}))
      if (std::find(names.begin(), names.end(), name) == names.end())
      {
        grasp.at.find("contact").find("ignore").problem("the scene has no obstacle and no link " + name +
                                                        didYouMean(name, names));
      }
}

GraspConfig readGrasp(const std::string& name, const YamlCursor& at, const ReadContext& context, const RodConfig& rod)
{
  GraspConfig grasp;
  grasp.name = name;
  YamlMap map(at);
  readHeldNodes(map, grasp, rod);
  const YamlCursor hold = map.get("hold", grasp.hold, {{"frame", Hold::frame}, {"position", Hold::position}},
                                  "`frame` clamps position and material frame. `position` pins the position of one "
                                  "node, which can turn freely. Without the key: frame.");
  map.get("attach", grasp.attach, {{"section", Attach::section}, {"initial", Attach::initial}},
          "Which point the poses of `motion` describe. `section`: the held section itself, with the origin half way "
          "along the held part, x along the tangent and y along d1; the section moves to the first pose. `initial`: a "
          "gripper, which keeps the offset to the section that it has at its first pose. Without the key: section.");
  grasp.limits = readGraspLimits(map.get("limits", "Limits of this grasp. Without the key: those of the scene."));
  readFrame(map, grasp);
  const bool oriented = grasp.direction.norm() + grasp.director.norm() > 0;
  grasp.motion =
      readMotion(map.get("motion", "How the held section moves. Without the key: fixed where it is at the start."),
                 context, grasp.hold == Hold::frame && grasp.attach == Attach::section && !oriented);
  checkFrame(map, grasp);
  readOffset(map, grasp);
  readGraspContact(map, grasp);
  if (grasp.hold == Hold::position && grasp.first_node != grasp.last_node)
  {
    hold.problem("holds " + std::to_string(grasp.last_node - grasp.first_node + 1) +
                 " nodes; a point pin holds one: give nodes: [INDEX], or edges: [0] or [-1]");
  }
  return grasp;
}

}   // namespace slender
