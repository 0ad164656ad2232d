#include <algorithm>
#include <cmath>
#include <map>
#include <stdexcept>

#include "generators.h"
#include "read_cloth_mesh.h"

/// Cloths, their meshes, materials and grasps.
namespace slender {

namespace {

void readPlasticity(const YamlCursor& at, ClothConfig& cloth)
{
  if (!at.present())
    return;
  YamlMap map(at);
  assign(cloth.plasticity.yield_curvature, map.require("yield_curvature").number(Range::closed(0, 1e9, "1/m")));
  assign(cloth.plasticity.hardening, map.get("hardening").number(Range::closed(-1e6, 1e6, "m")));
  assign(cloth.plasticity.creep_time, map.get("creep_time").number(Range::closed(0, 1e9, "s")));
  map.finish();
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
  YamlMap map(at);
  assign(air.air_density, map.get("air_density").number(Range::above(0, 1e5, "kg/m^3")));
  assign(air.drag, map.get("drag").number(Range::closed(0, 1e3)));
  assign(air.lift, map.get("lift").number(Range::closed(0, 1e3)));
  map.finish();
  return air;
}

/// Mass, membrane and bending.
void readMaterials(YamlMap& map, ClothConfig& cloth)
{
  double youngs_modulus = 1e6, poissons_ratio = 0.3, thickness = 3e-4;
  YamlMap material(map.get("material"));
  const YamlCursor per_area = material.get("area_density"), per_volume = material.get("density"),
                   modulus = material.get("youngs_modulus");
  assign(thickness, material.get("thickness").number(Range::above(0, 1, "m")));
  assign(cloth.area_density, per_area.number(Range::above(0, 1e4, "kg/m^2")));
  if (const auto density = per_volume.number(Range::above(0, 1e6, "kg/m^3")))
    cloth.area_density = *density * thickness;
  if (per_area.present() && per_volume.present())
    per_volume.problem("there is an area_density as well; give one of them");
  assign(youngs_modulus, modulus.number(Range::above(0, 1e13, "Pa")));
  const YamlCursor ratio = material.get("poissons_ratio");
  assign(poissons_ratio, ratio.number(Range::above(-1, 0.5)));
  material.finish();

  const YamlCursor at_membrane = map.get("membrane"), at_bending = map.get("bending");
  YamlMap bending(at_bending);
  assign(cloth.bending, bending.get("model").choice<BendingModel>({{"isometric", BendingModel::isometric_nonconforming},
                                                                   {"conforming", BendingModel::isometric_conforming},
                                                                   {"hinge", BendingModel::hinge},
                                                                   {"none", BendingModel::none}}));
  const YamlCursor bending_modulus = bending.get("modulus"), bending_ratio = bending.get("poissons_ratio");
  cloth.bending_poissons_ratio = bending_ratio.number(Range::between(-1, 1));
  bending.finish();
  if (bending_ratio.present() && cloth.bending != BendingModel::isometric_nonconforming)
  {
    bending_ratio.problem(
        "is for bending: {model: isometric}. Hinges have the ratio of their mesh (-1/3 on equilateral triangles), "
        "conforming bending "
        "has 1; leave it out");
  }
  readPlasticity(map.get("plasticity"), cloth);
  if (at_membrane.present())
  {
    double warp = 300, weft = 300, poisson = 0.0, shear = 100;
    const Range per_width = Range::above(0, 1e9, "N/m");
    YamlMap membrane(at_membrane);
    assign(warp, membrane.require("warp").number(per_width));
    assign(weft, membrane.require("weft").number(per_width));
    assign(poisson, membrane.get("poissons_ratio").number(Range::between(-1e3, 1e3)));
    assign(shear, membrane.require("shear").number(per_width));
    cloth.warp = readDirection(membrane.get("direction"), cloth.warp);
    membrane.finish();
    for (const YamlCursor& other : {modulus, ratio})
      if (other.present())
        other.problem("there is a membrane as well, which says it per width");
    if (!bending_modulus.present() && cloth.bending != BendingModel::none && at_membrane.isMap())
      at_membrane.problem("says nothing of bending; give bending: {modulus: D} in N m, or bending: {model: none}");
    try
    {
      cloth.membrane = orthotropicMembrane(warp, weft, poisson, shear);
    }
    catch (const std::invalid_argument& error)
    {
      at_membrane.problem(error.what());
    }
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
  YamlMap map(at);
  const auto point = map.require("point").vector3(kCoordinate);
  const auto radius = map.get("radius").number(Range::above(0, kMaxCoordinate, "m"));
  map.finish();
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
  const YamlCursor list = map.get("vertices"), corner = map.get("corner"), edge = map.get("edge"),
                   near = map.get("near");
  if (list.present() + corner.present() + edge.present() + near.present() != 1)
  {
    if (map.at().isMap())
    {
      map.at().problem(
          "must have one of vertices: [...], corner: upper_left, edge: upper or near: {point: [x, y, z], radius: r}");
    }
    return {};
  }
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
  if (!at.present())
    return loads;
  for (const YamlCursor& item : at.items(1, 10'000))
  {
    ClothLoadConfig load;
    YamlMap map(item);
    load.vertices = readHeldVertices(map, cloth);
    assign(load.force, map.require("force").vector3(Range::closed(-1e15, 1e15, "N")));
    map.finish();
    loads.push_back(std::move(load));
  }
  return loads;
}

void readGrasps(const YamlCursor& at, const ReadContext& context, ClothConfig& cloth)
{
  if (!at.present())
    return;
  std::map<int, std::string> holders;
  for (const auto& [name, entry] : at.members())
  {
    GraspConfig grasp;
    grasp.name = name;
    YamlMap map(entry);
    grasp.vertices = readHeldVertices(map, cloth);
    assign(grasp.clamp, map.get("clamp").boolean());
    if (grasp.clamp)
      grasp.vertices = withFaces(cloth.mesh, grasp.vertices);
    grasp.attach = Attach::initial;
    assign(grasp.attach, map.get("attach").choice<Attach>({{"frame", Attach::section}, {"initial", Attach::initial}}));
    grasp.motion = readMotion(map.get("motion"), context, grasp.attach == Attach::section);
    map.finish();
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

ClothConfig readCloth(const YamlCursor& at, const ReadContext& context, const std::string& default_name)
{
  ClothConfig cloth;
  cloth.name = default_name;
  cloth.place = at.place();
  YamlMap map(at);
  assign(cloth.name, map.get("name").name());
  const YamlCursor grid = map.get("grid"), mesh = map.get("mesh");
  if (grid.present() == mesh.present())
  {
    at.problem("must have either grid: {corner: [...], sides: [[...], [...]], cells: N} or mesh: {file: PATH}");
  }
  else if (grid.present())
  {
    cloth.grid = readClothGrid(grid, context, cloth.mesh);
    cloth.warp = cloth.grid ? Eigen::Vector3d(cloth.grid->sides[0].normalized()) : cloth.warp;
  }
  else if (!readClothMesh(mesh, context, cloth.mesh))
  {
    cloth.mesh = TriangleMesh{};
  }
  readClothTraits(map, context, cloth);
  cloth.loads = readClothLoads(map.get("loads"), cloth);
  map.finish();
  return cloth;
}

}   // namespace

void readClothTraits(YamlMap& map, const ReadContext& context, ClothConfig& cloth)
{
  readMaterials(map, cloth);
  const YamlCursor undeformed = map.get("undeformed");
  const Eigen::Matrix3Xd start = readClothShape(map.get("start"), context, cloth.mesh);
  cloth.start = start.cols() ? start : cloth.start;
  readUndeformed(undeformed, context, cloth);
  if (undeformed.present() &&
      (cloth.bending == BendingModel::isometric_conforming || cloth.bending == BendingModel::none))
  {
    undeformed.problem(
        "gives angles at rest, which this bending model does not have; use bending: {model: hinge}, or isometric, "
        "which takes hinges "
        "for curved shapes at rest");
  }
  cloth.aerodynamics = readAerodynamics(map.get("aerodynamics"));
  YamlMap damping(map.get("damping"));
  assign(cloth.mass_damping, damping.get("mass").number(Range::closed(0, 1e6, "1/s")));
  assign(cloth.stiffness_damping, damping.get("stiffness").number(Range::closed(0, 1e3, "s")));
  assign(cloth.drag, damping.get("drag").number(Range::closed(0, 1e6, "N s/m^3")));
  damping.finish();
  YamlMap solver(map.get("solver"));
  assign(cloth.solver,
         solver.get("linear").choice<ClothSolver>({{"auto", ClothSolver::automatic},
                                                   {"cholesky", ClothSolver::cholesky},
                                                   {"conjugate_gradients", ClothSolver::conjugate_gradients},
                                                   {"gauss_seidel", ClothSolver::gauss_seidel}}));
  assign(cloth.linear_tolerance, solver.get("tolerance").number(Range::between(0, 1)));
  assign(cloth.one_newton_step, solver.get("one_newton_step").boolean());
  solver.finish();
  readGrasps(map.get("grasps"), context, cloth);
  cloth.contact = readContactProperties(map.get("contact"), "cloths", true);
}

std::vector<ClothConfig> readCloths(const YamlCursor& at, const ReadContext& context)
{
  std::vector<ClothConfig> cloths;
  if (!at.present())
    return cloths;
  std::map<std::string, std::string> names;   // to the path that used it first
  const auto entries = at.items(1, 1000);
  for (std::size_t k = 0; k < entries.size(); ++k)
  {
    cloths.push_back(readCloth(entries[k], context, entries.size() == 1 ? "cloth" : "cloth" + std::to_string(k)));
    const auto [other, is_new] = names.emplace(cloths.back().name, entries[k].path());
    if (!is_new)
      YamlMap(entries[k]).get("name").problem("is also the name of " + other->second + "; names must differ");
  }
  return cloths;
}

}   // namespace slender
