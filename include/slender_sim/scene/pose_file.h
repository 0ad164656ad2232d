#pragma once

#include <string>
#include <vector>

#include <Eigen/Core>

#include "slender_sim/geometry/point_trajectory.h"
#include "slender_sim/geometry/pose_trajectory.h"

namespace slender {

/// The recorded motion of one named body.
struct BodyTrajectory
{
  std::string body;
  PoseTrajectory poses;
};

/// Reads a CSV table of timed poses: `t,body,x,y,z,qx,qy,qz,qw` per line (s, m, unit quaternion), '#' comments, an
/// optional header line with these names. Bodies come in the order of their first line. Throws SceneError "FILE:LINE:
/// reason" (scene/reader.h): not readable, wrong number of columns, not finite, quaternion length off 1 by more than
/// 0.01, times of a body not increasing, a turn of half a revolution or more between two samples (its direction would
/// be a guess).
std::vector<BodyTrajectory> readPoseFile(const std::string& path);

/// Reads points `x,y,z` [m], one per line, '#' comments, an optional header line `x,y,z`. Throws SceneError in the same
/// way.
std::vector<Eigen::Vector3d> readPointFile(const std::string& path);

/// Reads a motion of `count` points: `t,x0,y0,z0,x1,...` per line (s, m), '#' comments, an optional header line with
/// these names. Throws SceneError in the same way.
PointTrajectory readPointMotion(const std::string& path, int count);

/// Appends a frame given as such a row; throws std::invalid_argument: times that do not increase, another number of
/// points.
void appendPoints(PointTrajectory& points, const std::vector<double>& row);

/// Checks one pose given as seven numbers x y z qx qy qz qw and returns it; throws std::invalid_argument with the
/// reason.
Pose checkedPose(const double* numbers);

/// Appends a sample to a recorded motion under the rules above; throws std::invalid_argument with the reason.
void appendRecorded(PoseTrajectory& poses, double time, const Pose& pose);

}   // namespace slender
