#pragma once

#include <optional>

#include "read_parts.h"

/// Meshes of cloths.
namespace slender {

/// A mesh {file, scale, pose} as it is in the file, scaled and placed.
struct MeshFile
{
  TriangleMesh mesh;
  std::string path;   ///< as the scene names it
  double scale = 1.0;
  Pose pose;
  void place(Eigen::Matrix3Xd& vertices) const;
};
/// Nothing when there is none to be used; reported.
std::optional<MeshFile> readMeshFile(const YamlCursor& at, const ReadContext& context);
std::optional<ClothGrid> readClothGrid(const YamlCursor& at, const ReadContext& context, TriangleMesh& mesh);
/// {file, scale, pose}. False when there is none to be used; reported, with the mesh's defects.
bool readClothMesh(const YamlCursor& at, const ReadContext& context, TriangleMesh& mesh);
/// Material, bending, damping, shapes, grasps ...: all of a cloth but its name and mesh. `start` stays when there is no
/// such key.
void readClothTraits(YamlMap& map, const ReadContext& context, ClothConfig& cloth);
/// The same as another shape of a cloth: its vertices, or none when there is no such key, or no file with the cloth's
/// triangles; reported.
Eigen::Matrix3Xd readClothShape(const YamlCursor& at, const ReadContext& context, const TriangleMesh& cloth);
/// The undeformed shape: such a file, or the cloth's mesh folded, ridged or crinkled; its angles, or (`lengths`) its
/// lengths as well. The start is read before.
void readUndeformed(const YamlCursor& at, const ReadContext& context, ClothConfig& cloth);

}   // namespace slender
