#pragma once

#include <string>

#include <geometry_msgs/Pose.h>
#include <geometry_msgs/PoseArray.h>
#include <geometry_msgs/TransformStamped.h>
#include <geometry_msgs/Twist.h>
#include <geometry_msgs/Wrench.h>
#include <sensor_msgs/PointCloud2.h>
#include <std_msgs/Header.h>

#include "slender_sim/ClothState.h"
#include "slender_sim/MeshStamped.h"
#include "slender_sim/RodState.h"
#include "slender_sim/ThreadState.h"
#include "slender_sim/cloth/cloth_model.h"
#include "slender_sim/rod/rod_model.h"
#include "slender_sim/rod/rod_stepper.h"
#include "slender_sim/scene/snapshot.h"
#include "slender_sim/thread/thread_state.h"

/// Between the solver's types and messages. Pure functions: no clock, no node handle.
namespace slender {

geometry_msgs::Point toPoint(const Eigen::Vector3d& p);
geometry_msgs::Vector3 toVector3(const Eigen::Vector3d& v);
geometry_msgs::Quaternion toQuaternion(const Eigen::Quaterniond& q);
geometry_msgs::Pose toMessage(const Pose& X);
geometry_msgs::Wrench toMessage(const Wrench& wrench);
geometry_msgs::Twist toMessage(const Twist& twist);
std_msgs::Header makeHeader(const ros::Time& stamp, const std::string& frame_id);
geometry_msgs::TransformStamped toTransform(const std_msgs::Header& header, const std::string& child, const Pose& X);

Eigen::Vector3d fromMessage(const geometry_msgs::Point& p);
Eigen::Vector3d fromMessage(const geometry_msgs::Vector3& v);
/// Not normalised.
Eigen::Quaterniond fromMessage(const geometry_msgs::Quaternion& q);
/// Not normalised: the very numbers that were recorded.
Pose recordedPose(const geometry_msgs::Pose& message);

/// Returns points or vectors first .. last - 1 as columns.
template <class Vectors>
Eigen::Matrix3Xd columnsOf(const Vectors& from, std::size_t first, std::size_t last)
{
  Eigen::Matrix3Xd out(3, static_cast<Eigen::Index>(last - first));
  for (std::size_t i = first; i < last; ++i)
    out.col(static_cast<Eigen::Index>(i - first)) = fromMessage(from[i]);
  return out;
}

template <class Vectors>
Eigen::Matrix3Xd columnsOf(const Vectors& from)
{
  return columnsOf(from, 0, from.size());
}

/// Why a pose from a message cannot be used.
enum class PoseFault
{
  none,
  not_finite,
  bad_quaternion
};

/// Takes over a pose; its quaternion may be off unit length by 1 % (it is normalised), more is a fault and leaves `X`
/// alone.
PoseFault fromMessage(const geometry_msgs::Pose& message, Pose& X);
PoseFault fromMessage(const geometry_msgs::Transform& message, Pose& X);
bool isFinite(const geometry_msgs::Twist& twist);

/// Fills everything but header, epoch and step. `out` may hold an earlier message: its memory is reused.
void toMessage(const RodModel& model, const RodState& state, slender_sim::RodState& out);
/// Then, what the rod tracks.
void toTracking(const RodConfig& rod, const GuideState& guide, const RodState& state, slender_sim::RodState& out);

void toMessage(const ThreadState& state, slender_sim::ThreadState& out);

/// Appends a cloth. Fills everything but the header, epoch and step, and what it tracks.
void append(const std::string& name, const ClothState& state, slender_sim::ClothState& out);
/// Appends what the cloth that was appended last tracks; of one that tracks nothing, too.
void appendTracking(double error, const Eigen::Matrix3Xd& guide, const Eigen::Matrix3Xd& forces,
                    slender_sim::ClothState& out);
/// Appends a cloth's undeformed mesh.
void append(const ClothModel& model, slender_sim::MeshStamped& out);

/// Reads x, y, z (float32 or float64) of all points, in order; returns why not, empty when done. `out` may hold NaN as
/// the message does.
std::string fromPoints(const sensor_msgs::PointCloud2& message, Eigen::Matrix3Xd& out);

/// Vertices of all cloths as x, y, z in float32. Fills everything but the header.
void toPoints(const slender_sim::ClothState& state, sensor_msgs::PointCloud2& out);

/// Appends the middle of each edge of a rod or a thread with the edge's frame.
template <class State>
void appendPoses(const State& state, std::vector<geometry_msgs::Pose>& out)
{
  for (std::size_t j = 0; j < state.frames.size(); ++j)
  {
    const geometry_msgs::Point &a = state.nodes[j], &b = state.nodes[(j + 1) % state.nodes.size()];
    out.emplace_back();
    out.back().position = toPoint(0.5 * (fromMessage(a) + fromMessage(b)));
    out.back().orientation = state.frames[j];
  }
}

}   // namespace slender
