#pragma once

#include <map>
#include <string>
#include <vector>

#include <ros/node_handle.h>

#include "slender_sim/scene/pose_file.h"

namespace slender {

/// Plays a table of timed poses (scene/pose_file.h) as a tracker or motion capture system would send them.
///
/// Publishes each body of the table as a tf frame BODY in ~frame_id, and for each entry `BODY: GRASP` of ~bodies a
/// PoseStamped on `grasps/GRASP/pose`, in the frame BODY itself (its pose there is the identity), so that the receiver
/// has to ask tf.
///
/// Bodies that ~solids lists go into `bodies` messages, in ~frame_id: those that move obstacles and driven bodies of a
/// scene.
///
/// Parameters: ~file (CSV); ~bodies (map); ~solids (list of names); ~frame_id ("world"); ~tf (true; false: poses in
/// ~frame_id, no tf); ~rate [Hz] (0: at the table's own times, otherwise resampled); ~speed (1); ~loop (false; true:
/// back and forth for ever, without a jump); ~wait [s] (30: how long to wait for subscribers at most); ~offset ([x, y,
/// z], added to all positions [m]).
class MotionPlayer
{
public:
  /// Throws std::runtime_error for parameters or a table that cannot be used.
  MotionPlayer(const ros::NodeHandle& nh, const ros::NodeHandle& nh_priv);
  /// Until the table ends, or shut down. Stamps are start + t / speed in ROS time, so they jitter less than the
  /// messages.
  void spin();

private:
  struct Instant
  {
    double time;   ///< [s] in the table
    std::map<std::string, Pose> bodies;
  };

  std::vector<Instant> instants(double rate) const;
  void waitForSubscribers();
  void publish(const Instant& instant, const ros::Time& stamp);

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

}   // namespace slender
