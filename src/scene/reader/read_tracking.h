#pragma once

#include <optional>
#include <vector>

#include "read_cloth_mesh.h"
#include "slender_sim/geometry/mesh_file.h"
#include "slender_sim/scene/recorded_guide.h"

/// Tracked cloths and their guides.
namespace slender {

struct GuideSource
{
  GuideConfig config;              ///< without vertices when its mesh could not be read
  std::optional<MeshFile> file;    ///< that the mesh was read from, or
  std::optional<ClothGrid> grid;   ///< that it was made from
};

/// `cloths`: those of the scene, which may be guides. `object`: what tracks it.
GuideSource readGuide(const YamlCursor& at, const ReadContext& context, const std::vector<ClothConfig>& cloths,
                      const std::string& object);

/// What a bag holds, its first message at `begin` [s]; nothing when reported.
std::optional<RecordedGuide> readBag(const YamlCursor& at, const ReadContext& context, bool bodies, double begin,
                                     const std::string& object);
/// Points of a bag, which must be those of the guide's mesh, as its motion.
void readBagPoints(const YamlCursor& at, const ReadContext& context, double begin, const std::string& object,
                   GuideSource& source);

/// Reads the motion of a guide that moves rigidly with a frame of tf.
void readFramedMotion(const YamlCursor& tf, const YamlCursor& offset, const YamlCursor& attach, GuideConfig& config);

/// `late` of a guide by topic, as GuideConfig::coast.
std::optional<double> readLate(const YamlCursor& at);

/// The word obj: groups of vertices of a mesh's file; none when reported.
std::vector<VertexGroup> readGroupsOf(const YamlCursor& at, const ReadContext& context,
                                      const std::optional<MeshFile>& file);

}   // namespace slender
