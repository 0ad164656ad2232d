#pragma once

#include <optional>
#include <string>

#include "slender_sim/scene/config.h"
#include "yaml_cursor.h"

/// The parts of a scene's reader, one file each. All report into the cursor's Problems and return what could be read.
namespace slender {

/// What the parts need to know of the scene around them.
struct ReadContext
{
  std::string directory;                   ///< files are relative to it
  Eigen::Vector3d gravity{0, 0, -9.81};
  std::string resolve(const std::string& path) const { return path[0] == '/' ? path : directory + "/" + path; }
};

constexpr int max_edges = 1'000'000;
constexpr double max_coordinate = 1e6;     // [m]

std::optional<Curve> readCurve(const YamlCursor& at, const ReadContext& context);
/// `edges` of the rod, or 0 when its centreline could not be read: then indices are not checked.
GraspConfig readGrasp(const std::string& name, const YamlCursor& at, const ReadContext& context, bool closed, int edges);
CrossSection readCrossSection(const YamlCursor& at, int edges);
Material readMaterial(const YamlCursor& at);
Damping readDamping(const YamlCursor& at);
RodConfig readRod(const YamlCursor& at, const ReadContext& context, const std::string& default_name);
TimeConfig readTime(const YamlCursor& at);

}  // namespace slender
