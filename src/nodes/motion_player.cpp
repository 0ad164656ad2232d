#include <algorithm>
#include <cmath>
#include <map>
#include <string>
#include <vector>

#include <geometry_msgs/PoseStamped.h>
#include <ros/node_handle.h>
#include <slender_sim/BodyStates.h>
#include <tf2_msgs/TFMessage.h>

#include "param_reader.h"
#include "scene/reader/yaml_cursor.h"
#include "slender_sim/node/converters.h"
#include "slender_sim/node/node_main.h"
#include "slender_sim/scene/pose_file.h"

/// motion_player plays a table of timed poses (scene/pose_file.h) as a tracker or motion capture system would send
/// them.
///
/// The node publishes each body of the table as a tf frame BODY in ~frame_id, and for each entry `BODY: GRASP` of
/// ~bodies a PoseStamped on `grasps/GRASP/pose`, in the frame BODY itself (its pose there is the identity), so that the
/// receiver has to ask tf.
///
/// Bodies that ~solids lists go into `bodies` messages, in ~frame_id: those that move obstacles and driven bodies of a
/// scene.
///
/// Parameters: ~file (CSV); ~bodies (map); ~solids (list of names); ~frame_id ("world"); ~tf (true; false: poses in
/// ~frame_id, no tf); ~rate [Hz] (0: at the table's own times, otherwise resampled); ~speed (1); ~loop (false; true:
/// back and forth for ever, without a jump); ~wait [s] (30: how long to wait for subscribers at most); ~offset ([x, y,
/// z], added to all positions [m]).
namespace slender {
namespace {

class MotionPlayer
{
public:
  /// Throws std::runtime_error for parameters or a table that cannot be used.
  MotionPlayer(const ros::NodeHandle& nh, const ros::NodeHandle& nh_priv) : nh_(nh)
  {
    ParamReader params(nh_priv);
    std::string file;
    double rate = 0.0;
    XmlRpc::XmlRpcValue offset, bodies;
    params.read("file", file);
    params.read("frame_id", frame_id_);
    params.read("speed", speed_, 0.0, 1e6, true);
    params.read("wait", wait_, 0.0, 1e9);
    params.read("tf", tf_);
    params.read("loop", loop_);
    params.read("rate", rate, 0.0, 1e6);
    params.readList("solids", solids_);
    const bool moved = params.get("offset", offset), drives = params.get("bodies", bodies);
    params.refuseUnknown();
    if (file.empty())
      throw OptionError("~file: missing; give a CSV table t,body,x,y,z,qx,qy,qz,qw");
    if (moved)
    {
      const std::vector<double> three = nh_priv.param("offset", std::vector<double>());
      if (three.size() != 3 || !std::all_of(three.begin(), three.end(), [](double v) { return std::isfinite(v); }))
        params.refuse("offset", offset, "three numbers [x, y, z]");
      offset_ = {three[0], three[1], three[2]};
    }

    table_ = readPoseFile(file);
    const auto requireBody = [&](const std::string& param, const std::string& name) {
      std::vector<std::string> names;
      for (const BodyTrajectory& body : table_)
        names.push_back(body.body);
      if (std::find(names.begin(), names.end(), name) == names.end())
        throw OptionError("~" + param + ": " + name + " is not in " + file + ", whose bodies are: " + joinWords(names));
    };
    if (drives)
    {
      if (bodies.getType() != XmlRpc::XmlRpcValue::TypeStruct)
        params.refuse("bodies", bodies, "a map from bodies of the table to grasps, e.g. {left_wrist: left}");
      for (auto& entry : bodies)
      {
        requireBody("bodies", entry.first);
        if (entry.second.getType() != XmlRpc::XmlRpcValue::TypeString)
          params.refuse("bodies", bodies, "a map to names of grasps");
        pose_pubs_[entry.first] = nh_.advertise<geometry_msgs::PoseStamped>(
            "grasps/" + static_cast<std::string>(entry.second) + "/pose", 1000);
      }
    }
    for (const std::string& solid : solids_)
      requireBody("solids", solid);
    if (!solids_.empty())
      bodies_pub_ = nh_.advertise<slender_sim::BodyStates>("bodies", 1000);
    if (tf_)
      tf_pub_ = nh_.advertise<tf2_msgs::TFMessage>("/tf", 1000);
    instants_ = instants(rate);
  }

  /// Plays until the table ends or the node is shut down. Stamps are start + t / speed in ROS time, so they jitter less
  /// than the messages.
  void spin()
  {
    waitForSubscribers();
    ros::Time start = ros::Time::now() + ros::Duration(0.1);
    bool forward = true;
    const double begin = instants_.front().time, end = instants_.back().time;
    std::size_t next = 0;
    while (nh_.ok())
    {
      const std::size_t index = forward ? next : instants_.size() - 1 - next;
      const double since = forward ? instants_[index].time - begin : end - instants_[index].time;
      const ros::Time due = start + ros::Duration(since / speed_);
      while (nh_.ok() && ros::Time::now() < due)
        ros::WallDuration(0.001).sleep();
      if (!nh_.ok())
        return;
      publish(instants_[index], due);
      if (++next < instants_.size())
        continue;
      if (!loop_ || instants_.size() < 2)
        break;
      start = due;   // turn round; the turning point was just published
      forward = !forward;
      next = 1;
    }
    ros::WallDuration(0.5).sleep();   // the last messages leave
  }

private:
  struct Instant
  {
    double time;   ///< [s] in the table
    std::map<std::string, Pose> bodies;
  };

  std::vector<Instant> instants(double rate) const
  {
    std::map<double, Instant> by_time;
    for (const BodyTrajectory& body : table_)
    {
      const PoseTrajectory& poses = body.poses;
      if (rate == 0.0)
        for (std::size_t k = 0; k < poses.times().size(); ++k)
          by_time[poses.times()[k]].bodies[body.body] = poses.poses()[k];
      else
        for (int k = 0; poses.firstTime() + k / rate <= poses.lastTime() + 1e-9; ++k)
          by_time[poses.firstTime() + k / rate].bodies[body.body] = poses.evaluate(poses.firstTime() + k / rate);
    }
    std::vector<Instant> out;
    for (auto& [time, instant] : by_time)
    {
      instant.time = time;
      out.push_back(std::move(instant));
    }
    return out;
  }

  void waitForSubscribers()
  {
    const ros::WallTime give_up = ros::WallTime::now() + ros::WallDuration(wait_);
    const auto missing = [this]() {
      return (tf_ && tf_pub_.getNumSubscribers() == 0) || (!solids_.empty() && bodies_pub_.getNumSubscribers() == 0) ||
             std::any_of(pose_pubs_.begin(), pose_pubs_.end(),
                         [](const auto& p) { return p.second.getNumSubscribers() == 0; });
    };
    while (nh_.ok() && missing() && ros::WallTime::now() < give_up)
      ros::WallDuration(0.02).sleep();
    while (nh_.ok() && ros::Time::now().isZero())   // simulated time has not begun
      ros::WallDuration(0.02).sleep();
  }

  void publish(const Instant& instant, const ros::Time& stamp)
  {
    const std_msgs::Header header = makeHeader(stamp, frame_id_);
    if (tf_)
    {
      tf2_msgs::TFMessage message;
      for (const auto& [name, X] : instant.bodies)
        message.transforms.push_back(toTransform(header, name, {X.position + offset_, X.orientation}));
      tf_pub_.publish(message);
    }
    slender_sim::BodyStates solids;
    solids.header = header;
    for (const std::string& name : solids_)
      if (const auto body = instant.bodies.find(name); body != instant.bodies.end())
      {
        solids.name.push_back(name);
        solids.pose.push_back(toMessage(Pose{body->second.position + offset_, body->second.orientation}));
      }
    if (!solids.name.empty())
      bodies_pub_.publish(solids);
    for (const auto& [name, publisher] : pose_pubs_)
    {
      const auto body = instant.bodies.find(name);
      if (body == instant.bodies.end())
        continue;
      geometry_msgs::PoseStamped message;
      message.header = makeHeader(stamp, tf_ ? name : frame_id_);
      message.pose =
          tf_ ? toMessage(Pose()) : toMessage(Pose{body->second.position + offset_, body->second.orientation});
      publisher.publish(message);
    }
  }

  ros::NodeHandle nh_;
  std::string frame_id_ = "world";
  double speed_ = 1.0, wait_ = 30.0;
  bool tf_ = true, loop_ = false;
  Eigen::Vector3d offset_{0, 0, 0};
  std::vector<BodyTrajectory> table_;
  std::vector<Instant> instants_;
  std::vector<std::string> solids_;
  ros::Publisher tf_pub_, bodies_pub_;
  std::map<std::string, ros::Publisher> pose_pubs_;   // by body
};

}   // namespace
}   // namespace slender

int main(int argc, char** argv)
{
  return slender::nodeMain(argc, argv, "motion_player", [] {
    slender::MotionPlayer(ros::NodeHandle(), ros::NodeHandle("~")).spin();
    return 0;
  });
}
