#pragma once

#include <cstddef>
#include <map>
#include <string>
#include <utility>
#include <vector>

#include "slender_sim/scene/snapshot_meshes.h"

namespace slender {

/// Moving surfaces as one binary glTF 2.0 file: morph targets whose weights are animated, linear between frames. Where
/// the triangles of an object change, another mesh takes over, in one step. glTF's y axis is up: a root node turns our
/// z axis there, buffers hold our axes.
class GltfAnimation
{
public:
  /// Frames in the order of time [s].
  void add(double seconds, const std::vector<ObjectMesh>& objects);
  std::size_t frames() const { return seconds_.size(); }

  /// Throws std::runtime_error: too large for the format (4 GiB), or cannot be written.
  void write(const std::string& path) const;

private:
  /// An object while its triangles stay the same.
  struct Part
  {
    ObjectKind kind;
    std::string name;
    int index;
    std::vector<std::uint64_t> key;
    Eigen::Matrix3Xi triangles;
    std::vector<std::size_t> frames;
    std::vector<Eigen::Matrix3Xf> positions;   ///< per frame of it
  };
  friend class GltfWriter;

  std::vector<double> seconds_;
  std::vector<Part> parts_;
  /// its parts, in the order of time
  std::map<std::pair<ObjectKind, std::string>, std::vector<std::size_t>> of_object_;
};

}   // namespace slender
