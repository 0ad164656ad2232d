#include <algorithm>
#include <cmath>
#include <map>

#include "generators.h"
#include "read_cloth_mesh.h"

/// Cloths, their meshes, materials and grasps.
namespace slender {

namespace {

void readPlasticity(const YamlCursor& at, ClothConfig& cloth)
{
  YamlMap map(at.sharesKeysOf("cloths.N.plasticity"));
  if (!at.present())
    return;
  map.require("yield_curvature", cloth.plasticity.yield_curvature, Range::closed(0, 1e9, "1/m"),
              "Largest elastic deviation of a crease's curvature. What is beyond it stays: it moves the rest angle.");
  map.get("hardening", cloth.plasticity.hardening, Range::closed(-1e6, 1e6, "m"),
          "How creases get stiffer as they flow: by exp(hardening times plastic curvature). Negative: softer. Without "
          "the key: 0.");
  map.get("creep_time", cloth.plasticity.creep_time, Range::closed(0, 1e9, "s"),
          "Time in which all but 1/e of what is beyond the yield flows. Without the key: 0, at once.");
  if (cloth.bending != BendingModel::hinge)
  {
    at.problem(
        "needs rest angles that can flow, which only bending: {model: hinge} has; the isometric models are for flat "
        "rest shapes");
  }
}

Aerodynamics readAerodynamics(const YamlCursor& at)
{
  Aerodynamics air;
  YamlMap map(at.sharesKeysOf("cloths.N.aerodynamics"));
  map.get("air_density", air.air_density, Range::above(0, 1e5, "kg/m^3"),
          "Density of the air. Without the key: 1.2 kg/m^3.");
  map.get("drag", air.drag, Range::closed(0, 1e3),
          "Drag coefficient C_D; a plate across the flow has about 1.2. Without the key: 0.");
  map.get("lift", air.lift, Range::closed(0, 1e3),
          "Lift coefficient C_L; the lift is largest at 45 degrees. Without the key: 0.");
  return air;
}

/// The moduli of an orthotropic cloth, per width.
void readMembrane(const YamlCursor& at_membrane, ClothConfig& cloth)
{
  double warp = 300, weft = 300, poisson = 0.0, shear = 100;
  const Range per_width = Range::above(0, 1e9, "N/m");
  YamlMap membrane(at_membrane);
  membrane.require("warp", warp, per_width, "Stiffness along the warp, force per width and strain.");
  membrane.require("weft", weft, per_width, "Stiffness along the weft, force per width and strain.");
  membrane.get("poissons_ratio", poisson, Range::between(-1e3, 1e3),
               "Poisson's ratio of the membrane. Without the key: 0.");
  membrane.require("shear", shear, per_width, "Stiffness against shear, force per width.");
  cloth.warp = readDirection(membrane.get("direction",
                                          "Direction of the warp in the undeformed shape. Without the key: the first "
                                          "side of the grid, or x of a mesh."),
                             cloth.warp);
  at_membrane.attempt([&] { cloth.membrane = orthotropicMembrane(warp, weft, poisson, shear); });
}

/// Mass, membrane and bending.
void readMaterials(YamlMap& map, ClothConfig& cloth)
{
  double youngs_modulus = 1e6, poissons_ratio = 0.3, thickness = 3e-4;
  YamlMap material(
      map.get("material", "Mass and stiffness of the cloth. Without the key: the defaults of the keys in it.")
          .sharesKeysOf("cloths.N.material"));
  const YamlCursor per_area = material.get("area_density", cloth.area_density, Range::above(0, 1e4, "kg/m^2"),
                                           "Mass per area. Without the key: 0.15 kg/m^2.");
  const YamlCursor per_volume =
      material.get("density", "Mass per volume, which is multiplied by `thickness`; in place of `area_density`.");
  const YamlCursor modulus = material.get("youngs_modulus", youngs_modulus, Range::above(0, 1e13, "Pa"),
                                          "Young's modulus E. Without the key: 1e6 Pa. Not beside `membrane`.");
  material.get("thickness", thickness, Range::above(0, 1, "m"),
               "Thickness h of the cloth, for its stiffness and mass; contact has a thickness of its own. Without the "
               "key: 0.0003 m.");
  if (const auto density = per_volume.number(Range::above(0, 1e6, "kg/m^3")))
    cloth.area_density = *density * thickness;
  if (per_area.present() && per_volume.present())
    per_volume.problem("there is an area_density as well; give one of them");
  const YamlCursor ratio = material.get("poissons_ratio", poissons_ratio, Range::above(-1, 0.5),
                                        "Poisson's ratio. Without the key: 0.3. Not beside `membrane`.");
  material.finish();

  const YamlCursor at_membrane = map.get("membrane",
                                         "Stiffness of an orthotropic cloth in its plane; `bending.modulus` must then "
                                         "be given, too. Without the key it follows from `material`.");
  const YamlCursor at_bending =
      map.get("bending", "Stiffness against bending. Without the key: the defaults of the keys in it.");
  at_membrane.sharesKeysOf("cloths.N.membrane");
  YamlMap bending(at_bending.sharesKeysOf("cloths.N.bending"));
  bending.get("model", cloth.bending,
              {{"isometric", BendingModel::isometric_nonconforming},
               {"conforming", BendingModel::isometric_conforming},
               {"hinge", BendingModel::hinge},
               {"none", BendingModel::none}},
              "Model of bending. isometric is the fastest, for flat shapes at rest; hinge takes any shape at rest; "
              "conforming does not depend on the mesh but is for flat shapes at rest; none does not bend at all. "
              "Without the key: isometric.");
  const YamlCursor bending_modulus = bending.get("modulus",
                                                 "Bending stiffness D, moment per width and curvature. Without the "
                                                 "key: E h^3 / (12 (1 - nu^2)), 0 with model none.");
  const YamlCursor bending_ratio = bending.get("poissons_ratio", cloth.bending_poissons_ratio, Range::between(-1, 1),
                                               "Poisson's ratio of bending, for model isometric. Without the key: that "
                                               "of the mesh, about -1/3 on equilateral triangles.");
  bending.finish();
  if (bending_ratio.present() && cloth.bending != BendingModel::isometric_nonconforming)
  {
    bending_ratio.problem(
        "is for bending: {model: isometric}. Hinges have the ratio of their mesh (-1/3 on equilateral triangles), "
        "conforming bending has 1; leave it out");
  }
  readPlasticity(
      map.get("plasticity", "Creases that stay, for bending model hinge. Without the key the cloth is elastic."),
      cloth);
  if (at_membrane.present())
  {
    readMembrane(at_membrane, cloth);
    for (const YamlCursor& other : {modulus, ratio})
      if (other.present())
        other.problem("there is a membrane as well, which says it per width");
    if (!bending_modulus.present() && cloth.bending != BendingModel::none && at_membrane.isMap())
      at_membrane.problem("says nothing of bending; give bending: {modulus: D} in N m, or bending: {model: none}");
  }
  else
  {
    cloth.membrane = isotropicMembrane(youngs_modulus, poissons_ratio, thickness);
    if (cloth.bending != BendingModel::none)
    {
      const double nu = cloth.bending_poissons_ratio.value_or(poissons_ratio);
      cloth.bending_modulus = youngs_modulus * thickness * thickness * thickness / (12 * (1 - nu * nu));
    }
  }
  assign(cloth.bending_modulus, bending_modulus.number(Range::closed(0, 1e9, "N m")));
}

/// Vertices of a grid that are near one of its sides: `axis` 0: left or right, 1: lower or upper.
std::vector<int> alongSide(const ClothConfig& cloth, int axis, bool far)
{
  const Eigen::Vector3d& side = cloth.grid->sides[axis];
  std::vector<int> found;
  for (Eigen::Index i = 0; i < cloth.mesh.vertices.cols(); ++i)
  {
    const double at = (cloth.mesh.vertices.col(i) - cloth.grid->corner).dot(side) / side.squaredNorm();
    if (std::abs(at - (far ? 1.0 : 0.0)) < 1e-6)
      found.push_back(static_cast<int>(i));
  }
  return found;
}

std::vector<int> readNear(const YamlCursor& at, const Eigen::Matrix3Xd& vertices)
{
  YamlMap map(at.sharesKeysOf("cloths.N.grasps.NAME.near"));
  std::optional<double> radius;
  const auto point = map.require("point", "Place near which vertices are held or loaded.").vector3(kCoordinate);
  map.get("radius", radius, kLength,
          "All vertices within this distance of `point` count. Without the key: the nearest one alone.");
  if (!point)
    return {};
  const Eigen::VectorXd distance = (vertices.colwise() - *point).colwise().norm();
  Eigen::Index nearest = 0;
  const double least = distance.minCoeff(&nearest);
  std::vector<int> found;
  for (Eigen::Index i = 0; radius && i < distance.size(); ++i)
    if (distance[i] <= *radius)
      found.push_back(static_cast<int>(i));
  if (!radius)
    found.push_back(static_cast<int>(nearest));
  else if (found.empty())
    at.problem("reaches no vertex; the nearest, " + std::to_string(nearest) + ", is " + shortNumber(least) + " m away");
  return found;
}

std::vector<int> readHeldVertices(YamlMap& map, const ClothConfig& cloth)
{
  const YamlCursor list = map.get("vertices",
                                  "Indices of the vertices; a negative index counts from the end, and \"5..9\" is a "
                                  "range. Give one of `vertices`, `corner`, `edge` and `near`.");
  const YamlCursor corner = map.get("corner", "Corner of a grid.");
  const YamlCursor edge = map.get("edge", "All vertices along a side of a grid.");
  const YamlCursor near = map.get("near", "Vertices near a point, where the cloth starts.");
  if (!map.hasOne(
          {list, corner, edge, near},
          "must have one of vertices: [...], corner: upper_left, edge: upper or near: {point: [x, y, z], radius: r}"))
    return {};
  if (cloth.mesh.vertices.cols() == 0)
    return {};   // reported
  if (list.present())
  {
    std::vector<int> vertices = readIndexList(list, static_cast<int>(cloth.mesh.vertices.cols()));
    if (std::adjacent_find(vertices.begin(), vertices.end()) != vertices.end())
      list.problem("names vertex " + std::to_string(*std::adjacent_find(vertices.begin(), vertices.end())) + " twice");
    return vertices;
  }
  if (near.present())
    return readNear(near, cloth.start.cols() ? cloth.start : cloth.mesh.vertices);
  using Sides = std::pair<int, int>;   // 1: far, 0: near, -1: all, along the first and the second side
  const YamlCursor& word = corner.present() ? corner : edge;
  const auto sides =
      corner.present()
          ? corner.choice<Sides>(
                {{"lower_left", {0, 0}}, {"lower_right", {1, 0}}, {"upper_left", {0, 1}}, {"upper_right", {1, 1}}})
          : edge.choice<Sides>({{"left", {0, -1}}, {"right", {1, -1}}, {"lower", {-1, 0}}, {"upper", {-1, 1}}});
  if (!cloth.grid)
  {
    word.problem("is for grids; of a mesh take vertices: [...] or near: {point: [x, y, z], radius: r}");
    return {};
  }
  if (!sides)
    return {};
  if (sides->first < 0 || sides->second < 0)
    return sides->first < 0 ? alongSide(cloth, 1, sides->second == 1) : alongSide(cloth, 0, sides->first == 1);
  const Eigen::Vector3d point =
      cloth.grid->corner + sides->first * cloth.grid->sides[0] + sides->second * cloth.grid->sides[1];
  Eigen::Index nearest = 0;
  (cloth.mesh.vertices.colwise() - point).colwise().squaredNorm().minCoeff(&nearest);
  return {static_cast<int>(nearest)};
}

/// Vertices, ascending, of all faces that have one of these.
std::vector<int> withFaces(const TriangleMesh& mesh, std::vector<int> vertices)
{
  std::sort(vertices.begin(), vertices.end());
  std::vector<int> found = vertices;
  for (Eigen::Index f = 0; f < mesh.triangles.cols(); ++f)
  {
    const Eigen::Vector3i corners = mesh.triangles.col(f);
    const auto held = [&](int vertex) { return std::binary_search(vertices.begin(), vertices.end(), vertex); };
    if (std::any_of(corners.begin(), corners.end(), held))
      found.insert(found.end(), corners.begin(), corners.end());
  }
  std::sort(found.begin(), found.end());
  found.erase(std::unique(found.begin(), found.end()), found.end());
  return found;
}

/// Reads the dead loads of a cloth. Each entry gives one force for all vertices that it names, as grasps name theirs.
std::vector<ClothLoadConfig> readClothLoads(const YamlCursor& at, const ClothConfig& cloth)
{
  std::vector<ClothLoadConfig> loads;
  for (const YamlCursor& item : at.items(1, 10'000))
  {
    ClothLoadConfig load;
    YamlMap map(item);
    load.vertices = readHeldVertices(map, cloth);
    map.require("force", load.force, Range::closed(-1e15, 1e15, "N"),
                "Force on each of the vertices; it keeps its size and its direction in the world.");
    loads.push_back(std::move(load));
  }
  return loads;
}

void readGrasps(const YamlCursor& at, const ReadContext& context, ClothConfig& cloth)
{
  at.sharesKeysOf("cloths.N.grasps");
  if (!at.present())
    return;
  std::map<int, std::string> holders;
  for (const auto& [name, entry] :
       at.members("A grasp under a name of yours (letters, digits and '_'), which topics and tables use."))
  {
    entry.checkOwnName(name);
    GraspConfig grasp;
    grasp.name = name;
    YamlMap map(entry);
    grasp.vertices = readHeldVertices(map, cloth);
    map.get("clamp", grasp.clamp,
            "Whether the grasp also holds the slope: it then holds all vertices of the faces that touch its vertices. "
            "Without the key: false.");
    if (grasp.clamp)
      grasp.vertices = withFaces(cloth.mesh, grasp.vertices);
    grasp.limits = readGraspLimits(map.get("limits", "Limits of this grasp. Without the key: those of the scene.")
                                       .sharesKeysOf("rods.N.grasps.NAME.limits"));
    grasp.attach = givesOffset(map) ? Attach::section : Attach::initial;
    map.get("attach", grasp.attach, {{"frame", Attach::section}, {"initial", Attach::initial}},
            "Which point the poses of `motion` describe. `initial`: a gripper, which keeps the offset to the vertices "
            "that it has at its first pose. `frame`: the grasp's frame, with the origin at the mean of the vertices "
            "and the world's axes at the start. Without the key: initial, but frame with an offset.");
    grasp.motion =
        readMotion(map.get("motion", "How the held vertices move, as one rigid body. Without the key: fixed."), context,
                   grasp.attach == Attach::section);
    readOffset(map, grasp);
    readGraspContact(map, grasp);
    for (const int vertex : grasp.vertices)
    {
      const auto [other, is_new] = holders.emplace(vertex, name);
      if (!is_new && other->second != name)
      {
        entry.problem("holds vertex " + std::to_string(vertex) + ", which grasp " + other->second + " holds already");
        break;
      }
    }
    cloth.grasps.push_back(std::move(grasp));
  }
}

}   // namespace

void readClothTraits(YamlMap& map, const ReadContext& context, ClothConfig& cloth)
{
  readMaterials(map, cloth);
  const YamlCursor undeformed =
      map.get("undeformed",
              "Shape whose bend angles are those at rest: a mesh file with the same triangles, or folds, ridges or "
              "crinkles of the cloth's mesh. For bending model hinge or isometric. Without the key: the mesh itself.");
  const YamlCursor at_start =
      map.get("start",
              "Shape in which the cloth starts: a mesh file with the same triangles of the same vertices. Without the "
              "key: the mesh itself; a tracked cloth starts as its guide does.");
  const Eigen::Matrix3Xd start = readClothShape(at_start.sharesKeysOf("cloths.N.mesh"), context, cloth.mesh);
  cloth.start = start.cols() ? start : cloth.start;
  readUndeformed(undeformed, context, cloth);
  if (undeformed.present() &&
      (cloth.bending == BendingModel::isometric_conforming || cloth.bending == BendingModel::none))
  {
    undeformed.problem(
        "gives angles at rest, which this bending model does not have; use bending: {model: hinge}, or isometric, "
        "which takes hinges for curved shapes at rest");
  }
  cloth.aerodynamics = readAerodynamics(
      map.get("aerodynamics",
              "Drag and lift of thin plates in the wind, in addition to `damping.drag`. Without the key: none."));
  YamlMap damping(map.get("damping", "Damping of the cloth. Without the key: none.").sharesKeysOf("cloths.N.damping"));
  damping.get("mass", cloth.mass_damping, Range::closed(0, 1e6, "1/s"),
              "Damping of the motion against the world: the force on a mass m is -mass m v. Without the key: 0.");
  damping.get("stiffness", cloth.stiffness_damping, Range::closed(0, 1e3, "s"),
              "Damping of deformation (Rayleigh): it acts like the stiffness times this time, on the rate of the "
              "strain. Without the key: 0.");
  damping.get("drag", cloth.wind_coefficient, Range::closed(0, 1e6, "N s/m^3"),
              "Pressure per velocity of the air against the cloth, along the normal. Without the key: 0.");
  damping.finish();
  YamlMap solver(map.get("solver", "Settings of the implicit solver of the cloth.").sharesKeysOf("cloths.N.solver"));
  solver.get(
      "linear", cloth.solver,
      {{"gauss_seidel", ClothSolver::gauss_seidel},
       {"auto", ClothSolver::gauss_seidel},
       {"conjugate_gradients", ClothSolver::gauss_seidel},
       {"cholesky", ClothSolver::cholesky}},
      "Solver of the linear equations. gauss_seidel: conjugate gradients to `tolerance`, preconditioned by symmetric "
      "Gauss-Seidel sweeps; auto and conjugate_gradients mean the same. cholesky: exactly, and not for tracked cloth. "
      "Without the key: gauss_seidel.");
  solver.get("tolerance", cloth.linear_tolerance, Range::between(0, 1),
             "Relative residual to which the linear equations are solved. Without the key: 0.005.");
  solver.get("one_newton_step", cloth.one_newton_step,
             "Whether each step takes a single Newton iteration: several times as fast, and less exact. Without the "
             "key: false.");
  solver.finish();
  readGrasps(map.get("grasps",
                     "Vertices that are held, each group under a name of its own. Names of grasps differ within a "
                     "scene. Without the key the cloth is free."),
             context, cloth);
  cloth.contact = readContactProperties(
      map.get("contact",
              "What the cloth touches. Without the key it touches nothing; `contact: {}` lets it touch everything."),
      "cloths", true);
}

ClothConfig readCloth(const YamlCursor& at, const ReadContext& context, const std::string& default_name)
{
  ClothConfig cloth;
  cloth.name = default_name;
  cloth.place = at.place();
  YamlMap map(at);
  map.getName(cloth.name,
              "Name of the cloth, which topics, tables and other keys use. Without the key: cloth if there is one "
              "cloth, otherwise cloth0, cloth1, ...");
  const YamlCursor grid = map.get("grid", "Rectangle of cloth. Give either `grid` or `mesh`.");
  const YamlCursor mesh = map.get("mesh", "Mesh of the undeformed cloth from a file. Give either `grid` or `mesh`.");
  const bool one = map.hasOne(
      {grid, mesh}, "must have either grid: {corner: [...], sides: [[...], [...]], cells: N} or mesh: {file: PATH}");
  if (one && grid.present())
  {
    cloth.grid = readClothGrid(grid, context, cloth.mesh);
    cloth.warp = cloth.grid ? Eigen::Vector3d(cloth.grid->sides[0].normalized()) : cloth.warp;
  }
  else if (one && !readClothMesh(mesh, context, cloth.mesh))
  {
    cloth.mesh = TriangleMesh{};
  }
  readClothTraits(map, context, cloth);
  cloth.loads = readClothLoads(
      map.get("loads", "Forces on vertices that act all the time, in steps and in statics. Without the key: none."),
      cloth);
  return cloth;
}

}   // namespace slender
