#pragma once

#include <optional>
#include <vector>

#include "read_cloth_mesh.h"
#include "slender_sim/geometry/mesh_file.h"

/// Tracked cloths and their guides.
namespace slender {

struct GuideSource
{
  GuideConfig config;               ///< without vertices when its mesh could not be read
  std::optional<MeshFile> file;     ///< that the mesh was read from, or
  std::optional<ClothGrid> grid;    ///< that it was made from
};

GuideSource readGuide(const YamlCursor& at, const ReadContext& context);

/// The word obj: groups of vertices of a mesh's file; none when reported.
std::vector<VertexGroup> readGroupsOf(const YamlCursor& at, const ReadContext& context, const std::optional<MeshFile>& file);

}  // namespace slender
