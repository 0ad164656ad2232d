// Undeformed shapes of cloths: from a file, or made from the cloth's mesh.
#include "read_cloth_mesh.h"
#include "slender_sim/geometry/mesh_offsets.h"

namespace slender {

namespace {

/// The cloth's mesh folded, ridged or crinkled; empty when reported.
Eigen::Matrix3Xd readOffsets(const YamlCursor& at, const YamlCursor& folds, const YamlCursor& ridges, const YamlCursor& crinkles, const TriangleMesh& cloth)
{
  if (folds.present() + ridges.present() + crinkles.present() != 1)
  {
    at.problem("must have one of {file: PATH}, {folds: {along: [...], wavelength: L, height: H}}, {ridges: {axis: [...], count: N, height: H}}, "
               "{crinkles: {height: H}}");
    return {};
  }
  YamlMap shape(folds.present() ? folds : ridges.present() ? ridges : crinkles);
  const auto height = shape.require("height").number(Range::above(0, 10, "m"));
  Eigen::Vector3d direction(0, 0, 1);
  double wavelength = 1.0;
  int count = 1, seed = 1;
  if (crinkles.present())
  {
    assign(seed, shape.get("seed").integer(0, 2'000'000'000));
  }
  else
  {
    const YamlCursor along = shape.get(folds.present() ? "along" : "axis");
    assign(direction, along.vector3(Range::closed(-1e6, 1e6)));
    if (!(direction.norm() > 0))
    {
      along.problem("must not be zero");
      return {};
    }
    if (folds.present())
    {
      assign(wavelength, shape.require("wavelength").number(Range::above(0, 1e3, "m")));
    }
    else
    {
      assign(count, shape.require("count").integer(1, 100'000, "ridges"));
    }
  }
  shape.finish();
  if (!height || cloth.vertices.cols() == 0)
  {
    return {};
  }
  return folds.present()    ? folded(cloth, direction, wavelength, *height)
         : ridges.present() ? ridged(cloth, direction, count, *height)
                            : crinkled(cloth, *height, static_cast<unsigned>(seed));
}

}  // namespace

void readUndeformed(const YamlCursor& at, const ReadContext& context, ClothConfig& cloth)
{
  YamlMap map(at);
  if (!at.isMap() || !(map.has("folds") || map.has("ridges") || map.has("crinkles")))
  {
    cloth.undeformed = readClothShape(at, context, cloth.mesh);
    return;
  }
  bool lengths = false;
  const YamlCursor folds = map.get("folds"), ridges = map.get("ridges"), crinkles = map.get("crinkles");
  assign(lengths, map.get("lengths").boolean());
  map.finish();
  const Eigen::Matrix3Xd shape = readOffsets(at, folds, ridges, crinkles, cloth.mesh);
  if (shape.cols() == 0 || !lengths)
  {
    cloth.undeformed = shape;
    return;
  }
  if (cloth.start.cols() == 0)
  {
    cloth.start = cloth.mesh.vertices;
  }
  cloth.mesh.vertices = shape;
}

}  // namespace slender
