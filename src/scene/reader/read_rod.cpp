#include <algorithm>
#include <cmath>
#include <stdexcept>

#include "read_parts.h"
#include "slender_sim/geometry/curves.h"
#include "slender_sim/scene/shapes.h"

namespace slender {

namespace {

const Range radius = Range::above(0, 10, "m");
const Range modulus = Range::above(0, 1e15, "N");
const Range stiffness = Range::above(0, 1e15, "N m^2");

void checkCount(const YamlCursor& at, std::size_t count, int edges)
{
  if (count == 0 || (edges > 0 && count > 2 && count != static_cast<std::size_t>(edges)))
  {
    at.problem("has " + std::to_string(count) + " entries; must have 1, 2 (a taper) or one per edge" +
               (edges > 0 ? " (" + std::to_string(edges) + ")" : ""));
  }
}

std::optional<Eigen::Matrix2d> readBendModulus(const YamlCursor& at)
{
  if (!at.present())
    return std::nullopt;
  if (!at.isList())
  {
    const auto alpha = at.number(stiffness);
    return alpha ? std::optional<Eigen::Matrix2d>(*alpha * Eigen::Matrix2d::Identity()) : std::nullopt;
  }
  const auto rows = at.items(2, 2);
  if (rows.empty())
    return std::nullopt;
  Eigen::Matrix2d B = Eigen::Matrix2d::Zero();
  if (!rows[0].isList() && !rows[1].isList())
  {
    const auto B1 = rows[0].number(stiffness), B2 = rows[1].number(stiffness);
    B.diagonal() << B1.value_or(1.0), B2.value_or(1.0);
    return B1 && B2 ? std::optional<Eigen::Matrix2d>(B) : std::nullopt;
  }
  for (int i = 0; i < 2; ++i)
  {
    const auto entries = rows[i].items(2, 2);
    for (int j = 0; j < 2; ++j)
    {
      const auto value = entries.empty() ? std::nullopt : entries[j].number(Range::closed(-1e15, 1e15, "N m^2"));
      if (!value)
        return std::nullopt;
      B(i, j) = *value;
    }
  }
  if (std::abs(B(0, 1) - B(1, 0)) > 1e-9 * B.norm() || !(B(0, 0) > 0) || !(B.determinant() > 0))
  {
    at.problem("must be symmetric and positive definite");
    return std::nullopt;
  }
  B(1, 0) = B(0, 1);
  return B;
}

void readGrasps(const YamlCursor& at, const ReadContext& context, RodConfig& rod, int edges)
{
  if (!at.present())
    return;
  for (const auto& [name, value] : at.members())
  {
    const std::size_t before = value.problems().size();
    YamlTree word;
    word.kind = YamlTree::Kind::scalar;
    word.scalar = name;
    word.line = value.tree()->line;
    word.origin = value.tree()->origin;
    YamlCursor(&word, at.tree(), value.path() + " (name)", value.problems()).name();
    GraspConfig grasp = readGrasp(name, value, context, rod.closed, edges);
    for (const GraspConfig& other : rod.grasps)
    {
      if (value.problems().size() == before && edges > 0 && grasp.first_node <= other.last_node &&
          other.first_node <= grasp.last_node)
      {
        value.problem("overlaps grasp " + other.name + ": it holds nodes " + std::to_string(grasp.first_node) + " to " +
                      std::to_string(grasp.last_node) + ", the other " + std::to_string(other.first_node) + " to " +
                      std::to_string(other.last_node));
      }
    }
    rod.grasps.push_back(std::move(grasp));
  }
}

/// Edges of the rod as its curves give them; 0 when they could not be read or do not make a rod.
int readCenterline(YamlMap& map, const ReadContext& context, RodConfig& rod)
{
  const YamlCursor centerline = map.get("centerline"), initial = map.get("initial");
  const std::size_t before = map.at().problems().size();
  assign(rod.centerline, readCurve(centerline, context));
  rod.initial = readCurve(initial, context);
  const YamlCursor director = map.get("director");
  assign(rod.director, director.vector3(Range::closed(-1e6, 1e6)));
  if (map.at().problems().size() != before)
    return 0;
  try
  {
    const Eigen::Matrix3Xd rest = restNodes(rod, context.gravity);
    const int edges = static_cast<int>(rod.closed ? rest.cols() : rest.cols() - 1);
    if (rest.cols() < 3)
    {
      centerline.problem("makes " + std::to_string(edges) + " edges; a rod needs at least 2 (closed: 3)");
      return 0;
    }
    const Eigen::VectorXd lengths = edgeLengths(rest, rod.closed);
    Eigen::Index shortest = 0;
    if (!(lengths.minCoeff(&shortest) > 1e-12 * lengths.maxCoeff()))
    {
      centerline.problem("nodes " + std::to_string(shortest) + " and " + std::to_string(shortest + 1) +
                         " are at the same place; must differ");
      return 0;
    }
    const Eigen::Vector3d tangent = rest.col(1) - rest.col(0);
    if (rod.director.norm() > 0 && rod.director.cross(tangent).norm() < 1e-6 * rod.director.norm() * tangent.norm())
      director.problem("is along the first edge; must point away from it");
    return edges;
  }
  catch (const std::invalid_argument& error)
  {
    (centerline.present() ? centerline : map.at()).problem(error.what());
    return 0;
  }
}

void checkInitial(YamlMap& map, const ReadContext& context, const RodConfig& rod)
{
  try
  {
    initialNodes(rod, restNodes(rod, context.gravity), context.gravity);
  }
  catch (const std::invalid_argument& error)
  {
    map.get("initial").problem(error.what());
  }
}

/// `rest_twist` and `natural_curvature` of a rod with so many edges (0: not known).
void readNaturalFrames(YamlMap& map, RodConfig& rod, int edges)
{
  const YamlCursor at_twist = map.get("rest_twist"), at_curvature = map.get("natural_curvature");
  const std::size_t joints = edges == 0 ? 0 : rod.closed ? edges : edges - 1;
  const auto checkJoints = [joints, &rod](const YamlCursor& at, std::size_t count) {
    if (joints > 0 && count != 1 && count != joints)
      at.problem("has " + std::to_string(count) + " entries; must have 1 or " + std::to_string(joints) +
                 (rod.closed ? " (one per node)" : " (one per inner node)"));
  };
  if (const auto twist = at_twist.numbers(Range::closed(-1e5, 1e5, "rad")))
  {
    checkJoints(at_twist, twist->size());
    rod.rest_twist = *twist;
  }
  if (!at_curvature.present())
    return;
  const Range curvature = Range::closed(-1e6, 1e6, "1/m");
  const auto pair = [&curvature](const YamlCursor& at) {
    const auto values = at.numbers(curvature);
    if (values && values->size() != 2)
      at.problem("must be [kappa1, kappa2]");
    return values && values->size() == 2 ? Eigen::Vector2d((*values)[0], (*values)[1]) : Eigen::Vector2d(0, 0);
  };
  const auto entries = at_curvature.items(1);
  if (!entries.empty() && !entries[0].isList())
  {
    rod.natural_curvature = {pair(at_curvature)};
  }
  else
  {
    for (const YamlCursor& entry : entries)
      rod.natural_curvature.push_back(pair(entry));
    checkJoints(at_curvature, entries.size());
  }
  if (rod.naturally_straight)
    at_curvature.problem("contradicts naturally_straight: true; leave one of them out");
  if (rod.joints.matched_to_arcs)
  {
    at_curvature.problem(
        "contradicts matched_to_arcs: true, whose arcs are those of the centreline; leave one of them out");
  }
}

/// Moduli that the scene leaves out may only follow from a Young's modulus that it states: the default one has nothing
/// to do with the moduli that are given. A Young's modulus that nothing follows from is worth a warning.
void checkModuli(const YamlMap& material, const YamlCursor& at_youngs)
{
  std::vector<std::string> given, missing;
  for (const char* key : {"stretch_modulus", "bend_modulus", "twist_modulus"})
    (material.has(key) ? given : missing).push_back(key);
  if (!given.empty() && !missing.empty() && !at_youngs.present())
  {
    material.at().problem(
        "gives " + joinWords(given) + " but not " + joinWords(missing) + "; give " +
        (missing.size() == 1 ? "this too" : "these too") +
        ", or youngs_modulus (and poissons_ratio), from which the rest follows with the cross-section");
  }
  if (missing.empty() && at_youngs.present())
    at_youngs.warning("has no effect, since stretch_modulus, bend_modulus and twist_modulus are given; leave it out");
}

}   // namespace

CrossSection readCrossSection(const YamlCursor& at, int edges)
{
  CrossSection section{{0.005}, {0.005}};
  if (!at.present())
    return section;
  YamlMap map(at);
  const YamlCursor round = map.get("radius"), ellipse = map.get("ellipse");
  map.finish();
  if (at.isMap() && round.present() == ellipse.present())
  {
    at.problem("must have either radius or ellipse: [a, b]");
  }
  else if (round.present())
  {
    if (const auto values = round.numbers(radius))
    {
      checkCount(round, values->size(), edges);
      section.a = section.b = *values;
    }
  }
  else if (ellipse.present())
  {
    const auto axes = ellipse.items(2, 2);
    for (std::size_t k = 0; k < axes.size(); ++k)
    {
      if (const auto values = axes[k].numbers(radius))
      {
        checkCount(axes[k], values->size(), edges);
        (k == 0 ? section.a : section.b) = *values;
      }
    }
  }
  return section;
}

void warnOfRoundContact(const YamlCursor& at_section, const RodConfig& rod)
{
  if (!rod.contact)
    return;
  // an entry list is one number, the two ends of a taper, or one number per edge; the most eccentric section is the one
  // to name
  const CrossSection& section = rod.cross_section;
  const std::size_t count = std::max(section.a.size(), section.b.size());
  const auto entry = [count](const std::vector<double>& list, std::size_t k) {
    return list.size() == count ? list[k] : list.size() == 1 ? list[0] : list[k < count / 2 ? 0 : 1];
  };
  double worst = 1.0, a = 0.0, b = 0.0;
  for (std::size_t k = 0; k < count; ++k)
  {
    const double here_a = entry(section.a, k), here_b = entry(section.b, k),
                 ratio = std::max(here_a / here_b, here_b / here_a);
    if (ratio > worst)
    {
      worst = ratio;
      a = here_a;
      b = here_b;
    }
  }
  if (worst > 1.0 + 1e-9)   // round-off of half-axes that are meant to be equal
  {
    at_section.warning(
        "rod " + rod.name + " has elliptical sections (half-axes " + shortNumber(a) + " m and " + shortNumber(b) +
        " m), but contact treats each section as a circle of the larger half-axis, " + shortNumber(std::max(a, b)) +
        " m; bending and twisting use the ellipse. Give the rod a round section or leave out its contact");
  }
}

Material readMaterial(const YamlCursor& at)
{
  Material material;
  YamlMap map(at);
  assign(material.density, map.get("density").number(Range::above(0, 1e6, "kg/m^3")));
  const YamlCursor at_youngs = map.get("youngs_modulus");
  assign(material.youngs_modulus, at_youngs.number(Range::above(0, 1e15, "Pa")));
  assign(material.poissons_ratio, map.get("poissons_ratio").number(Range::above(-1, 0.5)));
  assign(material.torsion,
         map.get("torsion").choice<Torsion>({{"polar", Torsion::polar}, {"saint_venant", Torsion::saint_venant}}));
  material.linear_density = map.get("linear_density").number(Range::above(0, 1e6, "kg/m"));
  material.stretch_modulus = map.get("stretch_modulus").number(modulus);
  assign(material.inextensible, map.get("inextensible").boolean());
  material.bend_modulus = readBendModulus(map.get("bend_modulus"));
  material.twist_modulus = map.get("twist_modulus").number(stiffness);
  map.finish();
  checkModuli(map, at_youngs);
  return material;
}

Damping readDamping(const YamlCursor& at)
{
  Damping damping;
  YamlMap map(at);
  assign(damping.mass, map.get("mass").number(Range::closed(0, 1e6, "1/s")));
  assign(damping.stiffness, map.get("stiffness").number(Range::closed(0, 1e3, "s")));
  assign(damping.drag, map.get("drag").number(Range::closed(0, 1e6, "N s/m^2")));
  map.finish();
  return damping;
}

void readTraits(YamlMap& map, RodConfig& rod)
{
  const auto curvature =
      map.get("curvature")
          .choice<std::optional<Curvature>>(
              {{"auto", std::nullopt}, {"tangent", Curvature::tangent}, {"compensated", Curvature::compensated}});
  if (curvature && *curvature)
  {
    rod.automatic_curvature = false;
    rod.joints.curvature = **curvature;
  }
  assign(rod.formulation, map.get("formulation")
                              .choice<Formulation>({{"auto", Formulation::automatic},
                                                    {"isotropic", Formulation::isotropic},
                                                    {"general", Formulation::general}}));
  assign(
      rod.stretching,
      map.get("stretching").choice<Stretching>({{"stiff", Stretching::stiff}, {"projected", Stretching::projected}}));
  rod.material = readMaterial(map.get("material"));
  rod.damping = readDamping(map.get("damping"));
  rod.contact = readContactProperties(map.get("contact"), "rods");
}

ReadRod readRod(const YamlCursor& at, const ReadContext& context, const std::string& default_name)
{
  RodConfig rod;
  YamlMap map(at);
  rod.name = default_name;
  assign(rod.name, map.get("name").name());
  assign(rod.closed, map.get("closed").boolean());
  assign(rod.naturally_straight, map.get("naturally_straight").boolean());
  const YamlCursor matched = map.get("matched_to_arcs");
  assign(rod.joints.matched_to_arcs, matched.boolean());
  if (rod.joints.matched_to_arcs && rod.naturally_straight)
  {
    matched.problem(
        "must not be true of a rod with naturally_straight: true, which has no arcs to match its joints to");
  }
  assign(rod.initial_twist, map.get("initial_twist").number(Range::closed(-1e5, 1e5, "rad")));
  const int edges = readCenterline(map, context, rod);
  readNaturalFrames(map, rod, edges);
  if (edges > 0 && rod.initial)
    checkInitial(map, context, rod);
  const YamlCursor at_section = map.get("cross_section");
  rod.cross_section = readCrossSection(at_section, edges);
  readTraits(map, rod);
  warnOfRoundContact(at_section, rod);
  readGrasps(map.get("grasps"), context, rod, edges);
  rod.loads = readRodLoads(map.get("loads"), rod.closed, edges);
  rod.tracking = readTrackedCurve(map.get("track"), context, rod, edges);
  map.finish();
  return {std::move(rod), edges};
}

}   // namespace slender
