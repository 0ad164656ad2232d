#include "read_cloth_mesh.h"

#include <cmath>
#include <stdexcept>

#include "slender_sim/geometry/mesh_defects.h"
#include "slender_sim/geometry/mesh_file.h"
#include "slender_sim/geometry/mesh_shapes.h"
#include "slender_sim/scene/file_paths.h"

namespace slender {

namespace {

constexpr int max_cells = 2000;   // per side of a grid

void readSides(const YamlMap& map, const YamlCursor& at_sides, ClothGrid& grid)
{
  const auto sides = at_sides.items(2, 2);
  for (std::size_t k = 0; k < sides.size(); ++k)
  {
    sides[k].read(grid.sides[k], kCoordinate);
    if (!(grid.sides[k].norm() > 0))
      sides[k].problem("has no length");
  }
  const double width = grid.sides[0].norm(), height = grid.sides[1].norm();
  if (map.sound() && std::abs(grid.sides[0].dot(grid.sides[1])) > 1e-6 * width * height)
    at_sides.problem("must be at right angles; other shapes come from a mesh file");
}

}   // namespace

void MeshFile::place(Eigen::Matrix3Xd& vertices) const
{
  vertices *= scale;
  for (Eigen::Index i = 0; i < vertices.cols(); ++i)
    vertices.col(i) = pose * Eigen::Vector3d(vertices.col(i));
}

std::optional<MeshFile> readMeshFile(const YamlCursor& at, const ReadContext& context)
{
  MeshFile read;
  YamlMap map(at);
  const YamlCursor file =
      map.require("file", "OBJ or PLY file with a triangle mesh; relative to the folder of the scene file.");
  map.get("scale", read.scale, Range::above(0, 1e6),
          "Factor by which the coordinates of the file are multiplied. Without the key: 1.");
  read.pose =
      readPose(map.get("pose", "Where the mesh is placed, after scaling. Without the key: at the origin, not turned."))
          .value_or(Pose{});
  const auto text = file.text();
  if (!text)
    return std::nullopt;
  read.path = *text;
  const bool good = file.attempt([&] {
    requireRegularFile(context.resolve(read.path));
    read.mesh = readMesh(context.resolve(read.path));
    read.place(read.mesh.vertices);
    requireCoordinates(read.mesh.vertices, "", " after scale and pose");
  });
  return good ? std::make_optional(std::move(read)) : std::nullopt;
}

std::optional<ClothGrid> readClothGrid(const YamlCursor& at, const ReadContext& context, TriangleMesh& mesh)
{
  ClothGrid grid;
  YamlMap map(at.sharesKeysOf("cloths.N.grid"));
  map.get("corner", grid.corner, kCoordinate, "Lower left corner of the rectangle. Without the key: [0, 0, 0].");
  const YamlCursor at_sides = map.require(
      "sides",
      "Vectors from the lower left corner to the lower right and to the upper left corner; they are at right angles.");
  const YamlCursor at_cells = map.require(
      "cells", "Number of cells along both sides: [columns, rows], or columns alone, from which the rows follow.");
  int seed = 1;
  const YamlCursor at_seed = map.get("seed", seed, Range::closed(0, 2'000'000'000),
                                     "Seed of the random positions of `pattern: irregular`. Without the key: 1.");
  readSides(map, at_sides, grid);
  const double width = grid.sides[0].norm(), height = grid.sides[1].norm();
  int columns = 0, rows = 0;
  at_cells.takes("a whole number in [1, 2000], or [columns, rows]");
  if (at_cells.isList())
  {
    const auto cells = at_cells.items(2, 2);
    for (std::size_t k = 0; k < cells.size(); ++k)
      assign(k == 0 ? columns : rows, cells[k].integer(1, max_cells, "cells"));
  }
  else if (at_cells.present())
  {
    assign(columns, at_cells.integer(1, max_cells, "cells"));
    if (map.sound() && height / width * columns > max_cells)
      at_cells.problem("makes more than " + std::to_string(max_cells) + " rows; give [columns, rows]");
  }
  GridPattern pattern = GridPattern::equilateral;
  map.get("pattern", pattern, allUpTo(GridPattern::irregular),
          "How the rectangle is divided into triangles; bending depends on the pattern. Vertices are numbered from the "
          "corner along the first side, row after row. Without the key: equilateral.");
  if (at_seed.present() && pattern != GridPattern::irregular)
    at_seed.problem("is for pattern: irregular");
  if (!map.sound() ||
      !context.claim(at_cells, (columns + 1.0) * (rows > 0 ? rows + 1.0 : height / width * columns + 1)))
    return std::nullopt;
  if (!at.attempt([&] { mesh = gridMesh(width, height, columns, rows, pattern, static_cast<unsigned>(seed)); }))
    return std::nullopt;
  Eigen::Matrix<double, 3, 2> axes;
  axes << grid.sides[0] / width, grid.sides[1] / height;
  mesh.vertices = ((axes * mesh.vertices.topRows<2>()).colwise() + grid.corner).eval();
  return grid;
}

bool readClothMesh(const YamlCursor& at, const ReadContext& context, TriangleMesh& mesh)
{
  const auto read = readMeshFile(at, context);
  if (!read)
    return false;
  mesh = read->mesh;
  return at.find("file").attempt([&] { requireSoundMesh(mesh, read->path); });
}

Eigen::Matrix3Xd readClothShape(const YamlCursor& at, const ReadContext& context, const TriangleMesh& cloth)
{
  const auto read = at.present() ? readMeshFile(at, context) : std::nullopt;
  if (!read || cloth.vertices.cols() == 0)
    return {};   // none, or reported
  const TriangleMesh& mesh = read->mesh;
  const std::string same = "; both must have the same triangles of the same vertices, in the same order";
  const auto requireSame = [&](const char* what, Eigen::Index here, Eigen::Index there) {
    if (here != there)
    {
      throw std::runtime_error(read->path + " has " + std::to_string(here) + " " + what + ", the cloth's mesh has " +
                               std::to_string(there) + same);
    }
  };
  const auto corners = [](const TriangleMesh& of, Eigen::Index face) {
    const Eigen::Vector3i t = of.triangles.col(face);
    return std::to_string(t[0]) + " " + std::to_string(t[1]) + " " + std::to_string(t[2]);
  };
  const bool good = at.find("file").attempt([&] {
    requireSame("vertices", mesh.vertices.cols(), cloth.vertices.cols());
    requireSame("triangles", mesh.triangles.cols(), cloth.triangles.cols());
    for (Eigen::Index f = 0; f < mesh.triangles.cols(); ++f)
    {
      if (mesh.triangles.col(f) != cloth.triangles.col(f))
      {
        throw std::runtime_error(read->path + ": triangle " + std::to_string(f) + " has the vertices " +
                                 corners(mesh, f) + " (from 0), that of the cloth's mesh " + corners(cloth, f) + same);
      }
    }
    // unlike a cloth's mesh it may touch itself
    for (const MeshDefect& defect : meshDefects(mesh))
      if (defect.kind == MeshDefect::degenerate_face)
        throw std::runtime_error(read->path + ": " + defect.message);
  });
  return good ? mesh.vertices : Eigen::Matrix3Xd();
}

}   // namespace slender
