#pragma once

#include <functional>
#include <set>
#include <string>
#include <vector>

#include <visualization_msgs/MarkerArray.h>

#include "slender_sim/scene/snapshot_meshes.h"

namespace slender {

/// Makes a sequence of pictures of meshes for rviz. Markers of meshes that no longer exist are deleted.
class MeshMarkers
{
public:
  /// Returns the colour of an object: red, green and blue in [0, 1].
  using Colors = std::function<Eigen::Vector3d(ObjectKind, int index)>;
  explicit MeshMarkers(Colors colors) : colors_(std::move(colors)) {}

  visualization_msgs::MarkerArray picture(const std_msgs::Header& header, const std::vector<ObjectMesh>& objects);

private:
  Colors colors_;
  std::set<std::string> shown_;   // namespaces of the last picture
};

}   // namespace slender
