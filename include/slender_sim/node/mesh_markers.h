#pragma once

#include <functional>
#include <set>
#include <string>
#include <vector>

#include <std_msgs/ColorRGBA.h>
#include <visualization_msgs/MarkerArray.h>

#include "slender_sim/scene/snapshot_meshes.h"

namespace slender {

/// Makes pictures for rviz of meshes, one after the other, and removes those that are gone.
class MeshMarkers
{
public:
  /// Red, green, blue in [0, 1] of an object.
  using Colors = std::function<Eigen::Vector3d(ObjectKind, int index)>;
  explicit MeshMarkers(Colors colors) : colors_(std::move(colors)) {}

  visualization_msgs::MarkerArray picture(const std_msgs::Header& header, const std::vector<ObjectMesh>& objects);

private:
  Colors colors_;
  std::set<std::string> shown_;   // namespaces of the last picture
};

}   // namespace slender
