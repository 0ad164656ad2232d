// Undeformed shapes of cloths: from a file, or made from the cloth's mesh.
#include <cmath>

#include "read_cloth_mesh.h"
#include "slender_sim/geometry/mesh_offsets.h"

namespace slender {

namespace {

constexpr double fewest_edges = 4.0;   // of a wave that a mesh can show

/// Folds that the mesh cannot show would vanish, or come out as longer ones.
bool foldsFit(const YamlCursor& at, const YamlCursor& at_along, const Eigen::Vector3d& along, double wavelength,
              const TriangleMesh& cloth)
{
  const double length = extent(cloth, along), edge = meanFaceEdge(cloth);
  if (length < 0.25 * wavelength)
  {
    at_along.problem("the cloth is " + shortNumber(length) +
                     " m long along it, less than a quarter of a wavelength, and gets no folds; take a direction "
                     "within the cloth, or a shorter wavelength");
    return false;
  }
  if (wavelength < fewest_edges * edge)
  {
    at.problem("is less than " + shortNumber(fewest_edges) + " edges of the mesh (" + shortNumber(edge) +
               " m on average), which cannot show it; take " + shortNumber(fewest_edges * edge) +
               " m or more, or a finer mesh");
    return false;
  }
  return true;
}

/// Likewise, by the mean distance from the axis.
bool ridgesFit(const YamlCursor& at, const Eigen::Vector3d& axis, int count, const TriangleMesh& cloth)
{
  const double round = 2 * M_PI * meanRadius(cloth, axis), edge = meanFaceEdge(cloth);
  if (round < count * fewest_edges * edge)
  {
    at.problem("makes ridges of less than " + shortNumber(fewest_edges) + " edges of the mesh (" + shortNumber(edge) +
               " m on average), which cannot show them; " +
               (round < fewest_edges * edge
                    ? ""
                    : "take " + std::to_string(static_cast<int>(round / (fewest_edges * edge))) + " or fewer, or ") +
               "use a finer mesh");
    return false;
  }
  return true;
}

/// The cloth's mesh folded, ridged or crinkled; empty when reported.
Eigen::Matrix3Xd readOffsets(const YamlMap& map, const YamlCursor& folds, const YamlCursor& ridges,
                             const YamlCursor& crinkles, const TriangleMesh& cloth)
{
  if (!map.hasOne({folds, ridges, crinkles},
                  "must have one of {file: PATH}, {folds: {along: [...], wavelength: L, height: H}}, {ridges: {axis: "
                  "[...], count: N, height: H}}, {crinkles: {height: H}}"))
    return {};
  YamlMap shape(folds.present() ? folds : ridges.present() ? ridges : crinkles);
  std::optional<double> height;
  shape.require("height", height, Range::above(0, 10, "m"), "Height of the offsets from the mesh, along its normals.");
  Eigen::Vector3d direction(0, 0, 1);
  const std::size_t before = map.at().problems().size();
  double wavelength = 1.0;
  int count = 1, seed = 1;
  if (crinkles.present())
  {
    shape.get("seed", seed, Range::closed(0, 2'000'000'000), "Seed of the random offsets. Without the key: 1.");
  }
  else
  {
    const Range any = Range::closed(-1e6, 1e6);
    const YamlCursor along =
        folds.present()
            ? shape.require("along", direction, any, "Direction within the cloth along which folds follow each other.")
            : shape.get("axis", direction, any,
                        "Axis about which ridges follow each other. Without the key: [0, 0, 1].");
    if (!(direction.norm() > 0))
    {
      along.problem("must not be zero");
      return {};
    }
    const YamlCursor scale =
        folds.present()
            ? shape.require("wavelength", wavelength, Range::above(0, 1e3, "m"),
                            "Length of a fold and the next; at least four edges of the mesh.")
            : shape.require("count", count, Range::closed(1, 100'000, "ridges"), "Number of ridges around the axis.");
    const bool known = along.problems().size() == before && cloth.vertices.cols() > 0;
    if (known && !(folds.present() ? foldsFit(scale, along, direction, wavelength, cloth)
                                   : ridgesFit(scale, direction, count, cloth)))
      return {};
  }
  if (!height || cloth.vertices.cols() == 0)
    return {};
  return folds.present()    ? folded(cloth, direction, wavelength, *height)
         : ridges.present() ? ridged(cloth, direction, count, *height)
                            : crinkled(cloth, *height, static_cast<unsigned>(seed));
}

}   // namespace

void readUndeformed(const YamlCursor& at, const ReadContext& context, ClothConfig& cloth)
{
  YamlMap map(at.sharesKeysOf("cloths.N.undeformed"));
  if (!at.isMap() || !(map.has("folds") || map.has("ridges") || map.has("crinkles")))
  {
    cloth.undeformed = readClothShape(at, context, cloth.mesh);
    return;
  }
  bool lengths = false;
  const YamlCursor folds = map.get("folds", "Folds like those of an accordion.");
  const YamlCursor ridges = map.get("ridges", "Ridges about an axis.");
  const YamlCursor crinkles = map.get("crinkles", "Random offsets of the vertices.");
  map.get("lengths", lengths,
          "Whether lengths at rest are also those of the offset shape; the cloth still starts as its mesh. Without the "
          "key: false, lengths at rest are those of the mesh.");
  map.finish();
  const Eigen::Matrix3Xd shape = readOffsets(map, folds, ridges, crinkles, cloth.mesh);
  if (shape.cols() == 0 || !lengths)
  {
    cloth.undeformed = shape;
    return;
  }
  if (cloth.start.cols() == 0)
    cloth.start = cloth.mesh.vertices;
  cloth.mesh.vertices = shape;
}

}   // namespace slender
