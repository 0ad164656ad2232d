#include <algorithm>
#include <cmath>
#include <stdexcept>

#include "read_parts.h"
#include "slender_sim/geometry/curves.h"
#include "slender_sim/scene/shapes.h"

namespace slender {

namespace {

const Range radius = Range::above(0, 10, "m");
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
  at.takes("a number in (0, 1e+15] N m^2, [B1, B2] of such numbers, or [[B11, B12], [B12, B22]]");
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
    return at.problem("must be symmetric and positive definite");
  B(1, 0) = B(0, 1);
  return B;
}

void readGrasps(const YamlCursor& at, const ReadContext& context, RodConfig& rod)
{
  if (!at.present())
    return;
  for (const auto& [name, value] :
       at.members("A grasp under a name of yours (letters, digits and '_'), which topics and tables use."))
  {
    const std::size_t before = value.problems().size();
    value.checkOwnName(name);
    GraspConfig grasp = readGrasp(name, value, context, rod);
    for (const GraspConfig& other : rod.grasps)
    {
      if (value.problems().size() == before && rod.edges > 0 && grasp.first_node <= other.last_node &&
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

/// Reads the curves and counts the edges of the rod. Their number stays 0 if the curves cannot be read or are no rod.
void readCenterline(YamlMap& map, const ReadContext& context, RodConfig& rod)
{
  const YamlCursor centerline =
      map.get("centerline",
              "Rest shape of the rod, and the shape in which it starts unless `initial` is given. Give one kind of "
              "curve. Without the key: a straight line of 1 m along x with 50 edges.");
  const YamlCursor initial = map.get("initial",
                                     "Shape in which the rod starts, if it is not the rest shape. The edges keep their "
                                     "shares of the length. Without the key: the rest shape.");
  const std::size_t before = map.at().problems().size();
  assign(rod.centerline, readCurve(centerline, context));
  rod.initial = readCurve(initial, context);
  const YamlCursor director =
      map.get("director", rod.director, Range::closed(-1e6, 1e6),
              "Direction of the first material axis d1 at the first edge; the part along the edge does not count. The "
              "other edges follow without twist. Without the key some normal is chosen.");
  if (map.at().problems().size() != before)
    return;
  const bool good = (centerline.present() ? centerline : map.at()).attempt([&] {
    const Eigen::Matrix3Xd rest = restNodes(rod, context.gravity);
    rod.edges = static_cast<int>(rod.closed ? rest.cols() : rest.cols() - 1);
    if (rest.cols() < 3)
      throw std::invalid_argument("makes " + std::to_string(rod.edges) + " edges; a rod needs at least 2 (closed: 3)");
    const Eigen::VectorXd lengths = edgeLengths(rest, rod.closed);
    Eigen::Index shortest = 0;
    if (!(lengths.minCoeff(&shortest) > 1e-12 * lengths.maxCoeff()))
    {
      throw std::invalid_argument("nodes " + std::to_string(shortest) + " and " + std::to_string(shortest + 1) +
                                  " are at the same place; must differ");
    }
    const Eigen::Vector3d tangent = rest.col(1) - rest.col(0);
    if (rod.director.norm() > 0 && rod.director.cross(tangent).norm() < 1e-6 * rod.director.norm() * tangent.norm())
      director.problem("is along the first edge; must point away from it");
  });
  if (!good)
    rod.edges = 0;
}

void readNaturalFrames(YamlMap& map, RodConfig& rod)
{
  const YamlCursor at_twist = map.get("rest_twist",
                                      "Natural twist of the rod: the turn of the material frames about the centreline "
                                      "in the unloaded rod. A number is for the whole rod and is spread evenly; a list "
                                      "has one entry per inner node (closed rod: per node). Without the key: 0.");
  const YamlCursor at_curvature =
      map.get("natural_curvature",
              "Natural curvature [kappa1, kappa2] about d2 and -d1, in the frames that `rest_twist` turns: one pair "
              "for the whole rod, or a list of pairs, one per inner node (closed rod: per node). Without the key: the "
              "curvature of the centreline.");
  const std::size_t joints = rod.edges == 0 || rod.closed ? rod.edges : rod.edges - 1;
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
  at_curvature.takes("[kappa1, kappa2] of numbers in [-1000000, 1000000] 1/m, or a list of such pairs");
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
        ", or youngs_modulus (and poissons_ratio), from which the rest follows with the cross-section" +
        (material.has("inextensible") ? ". inextensible does not replace stretch_modulus, which it only raises" : ""));
  }
  if (missing.empty() && at_youngs.present())
    at_youngs.warning("has no effect, since stretch_modulus, bend_modulus and twist_modulus are given; leave it out");
}

/// Reads the sections of a rod whose frames are published.
std::vector<SectionFrame> readSectionFrames(const YamlCursor& at, const RodConfig& rod)
{
  std::vector<SectionFrame> frames;
  if (!at.present())
    return frames;
  const int nodes = rod.edges > 0 ? rod.nodes() : max_edges + (rod.closed ? 0 : 1);
  for (const auto& [name, value] :
       at.members("A section under a name of yours: the index of its node (negative: from the end)."))
  {
    value.checkOwnName(name);
    if (const auto node = value.integer(-nodes, nodes - 1))
      frames.push_back({name, *node < 0 ? *node + nodes : *node});
  }
  return frames;
}

}   // namespace

CrossSection readCrossSection(const YamlCursor& at, int edges)
{
  CrossSection section{{0.005}, {0.005}};
  at.sharesKeysOf("rods.N.cross_section");
  if (!at.present())
    return section;
  YamlMap map(at);
  const YamlCursor round = map.get(
      "radius",
      "Radius of a round section. One number, two for a taper from the first edge to the last, or one per edge.");
  const YamlCursor ellipse = map.get("ellipse",
                                     "Half-axes [a, b] of an elliptical section, a along d1 and b along d2. Each is "
                                     "one number, two for a taper, or one per edge.");
  map.finish();
  if (!map.hasOne({round, ellipse}, "must have either radius or ellipse: [a, b]"))
    return section;
  if (round.present())
  {
    if (const auto values = round.numbers(radius))
    {
      checkCount(round, values->size(), edges);
      section.a = section.b = *values;
    }
  }
  const auto axes = ellipse.present() ? ellipse.items(2, 2) : std::vector<YamlCursor>();
  for (std::size_t k = 0; k < axes.size(); ++k)
  {
    if (const auto values = axes[k].numbers(radius))
    {
      checkCount(axes[k], values->size(), edges);
      (k == 0 ? section.a : section.b) = *values;
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
  YamlMap map(at.sharesKeysOf("rods.N.material"));
  map.get("density", material.density, Range::above(0, 1e6, "kg/m^3"),
          "Mass per volume. Without the key: 1000 kg/m^3.");
  const YamlCursor at_youngs =
      map.get("youngs_modulus", material.youngs_modulus, Range::above(0, 1e15, "Pa"),
              "Young's modulus E. Moduli that are not given follow from it and the section. Without the key: 1e6 Pa; "
              "it must be given if only some of stretch_modulus, bend_modulus and twist_modulus are.");
  map.get("poissons_ratio", material.poissons_ratio, Range::above(-1, 0.5),
          "Poisson's ratio, which gives the shear modulus. Without the key: 0.5.");
  map.get("torsion", material.torsion, {{"polar", Torsion::polar}, {"saint_venant", Torsion::saint_venant}},
          "How the twisting stiffness follows from the section: polar takes G times the polar moment of area, "
          "saint_venant the exact value of an ellipse. Both agree for round sections. Without the key: polar.");
  map.get("linear_density", material.linear_density, Range::above(0, 1e6, "kg/m"),
          "Mass per length, in place of density times area.");
  map.get("stretch_modulus", material.stretch_modulus, Range::above(0, 1e15, "N"),
          "Force per strain (E A), in place of what follows from youngs_modulus.");
  map.get("inextensible", material.inextensible,
          "Whether the stretching modulus is raised until the rod's own weight stretches it by 1e-5 at most. It has no "
          "effect without gravity. Without the key: false.");
  material.bend_modulus =
      readBendModulus(map.get("bend_modulus",
                              "Moment per curvature (E I), in place of what follows from youngs_modulus: a number, "
                              "[B1, B2] for bending towards d1 and d2, or a symmetric 2x2 matrix."));
  map.get("twist_modulus", material.twist_modulus, stiffness,
          "Moment per twist rate (G J), in place of what follows from youngs_modulus and poissons_ratio.");
  checkModuli(map, at_youngs);
  return material;
}

Damping readDamping(const YamlCursor& at)
{
  Damping damping;
  YamlMap map(at.sharesKeysOf("rods.N.damping"));
  map.get("mass", damping.mass, Range::closed(0, 1e6, "1/s"),
          "Damping of the motion against the world: the force on a mass m is -mass m v. Without the key: 0.");
  map.get("stiffness", damping.stiffness, Range::closed(0, 1e3, "s"),
          "Damping of deformation (Rayleigh): it acts like the stiffness times this time, on the rate of the strain. "
          "Without the key: 0.");
  map.get("drag", damping.drag, Range::closed(0, 1e6, "N s/m^2"),
          "Drag force per length and per velocity relative to the wind. Without the key: 0, and wind has no effect.");
  return damping;
}

void readTraits(YamlMap& map, RodConfig& rod)
{
  const auto curvature =
      map.get("curvature",
              "Formula for the curvature of a joint. `tangent` depends on how the material frames twist; `compensated` "
              "does not. Without the key, or with auto: compensated if every section bends alike in all directions, "
              "tangent otherwise and for explicit steps in the isotropic formulation.")
          .choice<std::optional<Curvature>>(
              {{"auto", std::nullopt}, {"tangent", Curvature::tangent}, {"compensated", Curvature::compensated}});
  if (curvature && *curvature)
  {
    rod.automatic_curvature = false;
    rod.joints.curvature = **curvature;
  }
  map.get("formulation", rod.formulation,
          {{"auto", Formulation::automatic}, {"isotropic", Formulation::isotropic}, {"general", Formulation::general}},
          "Equations of explicit steps (integrator symplectic_euler): `isotropic` is cheaper, and is for naturally "
          "straight rods that bend alike in all directions; `general` is for all rods. Without the key, or with auto: "
          "isotropic where it applies. Implicit steps always take general.");
  map.get("stretching", rod.stretching, {{"stiff", Stretching::stiff}, {"projected", Stretching::projected}},
          "`stiff` lets edges stretch by their modulus. `projected` keeps the length of every edge by a projection "
          "after each explicit step (integrator symplectic_euler). Without the key: stiff.");
  rod.material = readMaterial(
      map.get("material", "Density and stiffness of the rod. Without the key: the defaults of the keys in it."));
  rod.damping = readDamping(map.get("damping", "Damping of the rod. Without the key: none."));
  rod.contact = readContactProperties(
      map.get("contact",
              "What the rod touches. Without the key it touches nothing; `contact: {}` lets it touch everything."),
      "rods");
}

RodConfig readRod(const YamlCursor& at, const ReadContext& context, const std::string& default_name)
{
  RodConfig rod;
  YamlMap map(at);
  rod.name = default_name;
  rod.place = at.place();
  map.getName(rod.name,
              "Name of the rod, which topics, tables and other keys use. Without the key: rod if there is one rod, "
              "otherwise rod0, rod1, ...");
  map.get("closed", rod.closed,
          "Whether the rod is a loop: one more edge joins its last node to its first. Without the key: false.");
  map.get("naturally_straight", rod.naturally_straight,
          "Whether the unloaded rod is straight, also where the centreline is curved. Without the key: false, the rest "
          "curvature is that of the centreline.");
  const YamlCursor matched =
      map.get("matched_to_arcs", rod.joints.matched_to_arcs,
              "Whether each joint is as stiff as the arc of the smooth curve that it stands for. Coils of few edges "
              "become about ten times more accurate. Not for naturally straight rods. Without the key: false.");
  if (rod.joints.matched_to_arcs && rod.naturally_straight)
  {
    matched.problem(
        "must not be true of a rod with naturally_straight: true, which has no arcs to match its joints to");
  }
  map.get("initial_twist", rod.initial_twist, Range::closed(-1e5, 1e5, "rad"),
          "Twist of the whole rod in the shape in which it starts, beyond the rest twist, spread evenly. Without the "
          "key: 0.");
  readCenterline(map, context, rod);
  readNaturalFrames(map, rod);
  if (rod.edges > 0 && rod.initial)
    map.find("initial").attempt([&] { initialNodes(rod, restNodes(rod, context.gravity), context.gravity); });
  const YamlCursor at_section =
      map.get("cross_section",
              "Cross-section of the rod: give either `radius` or `ellipse`. Without the key: a radius of 0.005 m.");
  rod.cross_section = readCrossSection(at_section, rod.edges);
  readTraits(map, rod);
  warnOfRoundContact(at_section, rod);
  readGrasps(map.get("grasps",
                     "Places where the rod is held, each under a name of its own. Names of grasps differ within a "
                     "scene. Without the key the rod is free."),
             context, rod);
  rod.loads = readRodLoads(
      map.get("loads",
              "Forces and torques that act on the rod all the time, in steps and in statics. Without the key: none."),
      rod);
  rod.tracking = readTrackedCurve(
      map.get("track", "Guide curve whose averages the rod has in every step. Without the key: none."), context, rod);
  rod.broadcast_tf = readSectionFrames(map.get("broadcast_tf",
                                               "Sections whose frames (x along the tangent, y along d1) nodes publish "
                                               "on tf, as NODE/rods/ROD/NAME. Without the key: none."),
                                       rod);
  return rod;
}

}   // namespace slender
