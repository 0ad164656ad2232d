#pragma once

#include <optional>

#include "read_parts.h"

/// Meshes of cloths.
namespace slender {

std::optional<ClothGrid> readClothGrid(const YamlCursor& at, TriangleMesh& mesh);
/// {file, scale, pose}. False when there is none to be used; reported, with the mesh's defects.
bool readClothMesh(const YamlCursor& at, const ReadContext& context, TriangleMesh& mesh);
/// The same as another shape of a cloth: its vertices, or none when there is no such key, or no file with the cloth's triangles; reported.
Eigen::Matrix3Xd readClothShape(const YamlCursor& at, const ReadContext& context, const TriangleMesh& cloth);

}  // namespace slender
