#include <exception>
#include <iostream>
#include <memory>
#include <set>
#include <string>

#include <geometry_msgs/TransformStamped.h>
#include <ros/callback_queue.h>
#include <ros/ros.h>
#include <tf2_ros/static_transform_broadcaster.h>
#include <visualization_msgs/MarkerArray.h>

#include "export_program.h"
#include "holder_meshes.h"
#include "marker_tools.h"
#include "object_colors.h"
#include "param_reader.h"
#include "slender_sim/node/arguments.h"
#include "slender_sim/scene/snapshot_meshes.h"

/// marker_player shows a bag that a node or `simulate` has recorded. It publishes the recorded objects on `markers` at
/// the recorded pace and simulates nothing. docs/operation.md lists its parameters.
namespace slender {
namespace {

struct Settings
{
  std::string bag, topic_namespace, scene_dir = ".", frame_id = "world";
  double speed = 1.0, rate = 30.0;
  bool loop = false;

  static Settings read(const ros::NodeHandle& nh_priv)
  {
    Settings s;
    ParamReader params(nh_priv);
    params.read("bag", s.bag);
    params.read("topic_namespace", s.topic_namespace);
    params.read("scene_dir", s.scene_dir);
    params.read("frame_id", s.frame_id);
    params.read("speed", s.speed, 0.0, 1000.0, true);
    params.read("rate", s.rate, 0.0, 30.0, true);
    params.read("loop", s.loop);
    params.refuseUnknown();
    if (s.bag.empty())
      throw OptionError("~bag: missing; give the path of a bag that ~record_bag or simulate --bag has written");
    return s;
  }
};

const char* folderOf(ObjectKind kind)
{
  // Obstacles have one namespace, as in the markers of nodes.
  static const char* const folders[] = {"rods/", "threads/", "cloths/", "bodies/", "obstacles", "grasps/", "nozzles/"};
  return folders[static_cast<int>(kind)];
}

class MarkerPlayer
{
public:
  explicit MarkerPlayer(Settings settings) : settings_(std::move(settings))
  {
    open();   // before advertising, so that a bag that cannot be read is reported at once
    publisher_ = nh_.advertise<visualization_msgs::MarkerArray>("markers", 2, true);
    geometry_msgs::TransformStamped origin;
    origin.header.stamp = ros::Time::now();
    origin.header.frame_id = settings_.frame_id;
    origin.child_frame_id = ros::this_node::getName().substr(1) + "/origin";
    origin.transform.rotation.w = 1.0;
    frame_.sendTransform(origin);
  }

  void spin()
  {
    do
    {
      play();
      open();
    }
    while (settings_.loop && ros::ok());
    ros::spin();   // the last picture stays
  }

private:
  void open()
  {
    bag_ = std::make_unique<BagReader>(settings_.bag, settings_.topic_namespace, settings_.scene_dir);
    if (!bag_->scene() && !told_)
      ROS_WARN("%s: the scene of the bag cannot be read (%s): bodies and obstacles are left out; set ~scene_dir",
               ros::this_node::getName().c_str(), bag_->sceneProblem().c_str());
    told_ = true;
  }

  void play()
  {
    FrameChoice choice(settings_.rate / settings_.speed);
    const ros::WallTime start = ros::WallTime::now();
    SceneSnapshot instant;
    while (ros::ok() && bag_->next(instant))
    {
      if (!choice.takes(bag_->seconds()))
        continue;
      while (ros::ok() && (ros::WallTime::now() - start).toSec() < bag_->seconds() / settings_.speed)
        ros::getGlobalCallbackQueue()->callAvailable(ros::WallDuration(0.002));
      publish(instant);
    }
  }

  void publish(const SceneSnapshot& instant)
  {
    TubeResolution resolution;
    resolution.sides = 10;
    resolution.sections = 200;
    std::vector<ObjectMesh> objects = objectMeshes(instant, bag_->scene(), resolution);
    const auto add = [&objects](std::vector<ObjectMesh> more) {
      std::move(more.begin(), more.end(), std::back_inserter(objects));
    };
    Eigen::AlignedBox3d box;
    for (const ObjectMesh& object : objects)
      if (object.mesh.vertices.cols() > 0)
        box.extend(object.mesh.vertices.rowwise().minCoeff()).extend(object.mesh.vertices.rowwise().maxCoeff());
    add(holderMeshes(instant, bag_->scene()));
    if (bag_->scene() && !box.isEmpty())
    {
      if (planes_box_.isEmpty())
        planes_box_ = box;   // fixed, so that planes do not grow and shrink with the motion
      add(planeMeshes(instant, *bag_->scene(), planes_box_, std::nullopt));
    }
    std_msgs::Header header;
    header.stamp = ros::Time::now();
    header.frame_id = settings_.frame_id;
    publisher_.publish(picture(header, objects));
  }

  /// Returns the next picture. Markers of meshes that no longer exist are deleted.
  visualization_msgs::MarkerArray picture(const std_msgs::Header& header, const std::vector<ObjectMesh>& objects)
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
      const Eigen::Vector3d paint = objectColor(object.kind, object.index);
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

  ros::NodeHandle nh_;
  Settings settings_;
  std::unique_ptr<BagReader> bag_;
  bool told_ = false;
  std::set<std::string> shown_;   // namespaces of the last picture
  Eigen::AlignedBox3d planes_box_;
  tf2_ros::StaticTransformBroadcaster frame_;
  ros::Publisher publisher_;
};

}   // namespace
}   // namespace slender

int main(int argc, char** argv)
try
{
  ros::init(argc, argv, "marker_player");
  slender::requireNoArguments(argc, argv);
  slender::MarkerPlayer(slender::Settings::read(ros::NodeHandle("~"))).spin();
  return 0;
}
catch (const std::exception& e)
{
  std::cerr << "marker_player: " << e.what() << std::endl;
  return 2;
}
