#include "slender_sim/node/mesh_markers.h"

#include "marker_tools.h"

namespace slender {
namespace {

const char* folderOf(ObjectKind kind)
{
  // Obstacles have one namespace, as in the markers of nodes.
  static const char* const folders[] = {"rods/", "threads/", "cloths/", "bodies/", "obstacles", "grasps/", "nozzles/"};
  return folders[static_cast<int>(kind)];
}

}   // namespace

visualization_msgs::MarkerArray MeshMarkers::picture(const std_msgs::Header& header,
                                                     const std::vector<ObjectMesh>& objects)
{
  visualization_msgs::MarkerArray out;
  std::set<std::string> shown;
  int obstacles = 0;
  for (const ObjectMesh& object : objects)
  {
    const bool obstacle = object.kind == ObjectKind::obstacle;
    std::string ns = folderOf(object.kind) + (obstacle ? "" : object.name);
    for (int copy = 2; !obstacle && shown.count(ns); ++copy)
      ns = folderOf(object.kind) + object.name + "_" + std::to_string(copy);
    visualization_msgs::Marker marker =
        makeMarker(header, ns, obstacle ? obstacles++ : 0, visualization_msgs::Marker::TRIANGLE_LIST);
    const Eigen::Vector3d paint = colors_(object.kind, object.index);
    marker.color = color(paint.x(), paint.y(), paint.z());
    paintMesh(object.mesh, marker);
    out.markers.push_back(std::move(marker));
    if (!obstacle)
      shown.insert(ns);
  }
  for (const std::string& ns : shown_)
    if (!shown.count(ns))
    {
      out.markers.push_back(makeMarker(header, ns, 0, visualization_msgs::Marker::TRIANGLE_LIST));
      out.markers.back().action = visualization_msgs::Marker::DELETE;
    }
  shown_ = std::move(shown);
  return out;
}

}   // namespace slender
