#pragma once

#include <array>
#include <functional>
#include <string>
#include <vector>

#include <Eigen/Geometry>

#include "slender_sim/geometry/pose.h"

namespace slender::study {

/// Parts of a figure. The frame of a part has its origin at the joint nearer to the root. If the figure stands upright,
/// the frames have the axes of the world: x forwards, y to the left, z up.
enum Part
{
  kRoot,
  kChest,
  kNeck,
  kRightHip,
  kRightKnee,
  kRightAnkle,
  kRightShoulder,
  kRightElbow,
  kRightWrist,
  kLeftHip,
  kLeftKnee,
  kLeftAnkle,
  kLeftShoulder,
  kLeftElbow,
  kLeftWrist,
  kParts
};

/// Where the joints are in the frames of the parts that carry them [m]. That of the root is zero.
using Skeleton = std::array<Eigen::Vector3d, kParts>;
/// Place of the root, and orientation of each part in the world.
struct Posture
{
  Eigen::Vector3d root = Eigen::Vector3d::Zero();
  std::array<Eigen::Quaterniond, kParts> turn;
};

/// A motion of a figure, from 0 to `duration` [s].
struct FigureMotion
{
  std::string name;
  Skeleton skeleton;
  double duration = 0.0;
  std::function<Posture(double)> at;

  /// Poses of all parts at a time [s].
  std::array<Pose, kParts> poses(double t) const;
};

/// A walk by joint angles (walk_angles.h), the backflip of the package by key poses, and a dance by joint angles, which
/// twists the trunk and swings the arms.
std::vector<FigureMotion> packageMotions();
/// All motions `*.csv` in a folder, sorted by name: tables of timed poses (scene/pose_file.h) of the fifteen parts, by
/// these names. Throws std::runtime_error with the reason.
std::vector<FigureMotion> recordedMotions(const std::string& folder);

/// The same motion after a lead: the figure stands upright with its arms spread, and begins to move from rest. Clothes
/// can be put on in this posture.
FigureMotion withLead(const FigureMotion& motion);

/// A limb of the figure: a capsule that a part carries.
struct Limb
{
  std::string name;
  Part part;
  Eigen::Vector3d from, to;   ///< ends of the axis in the frame of the part [m]
  double radius;              ///< [m]
};
/// The limbs are slim, so that cloth has room between them in the postures of a dance.
std::vector<Limb> limbsOf(const Skeleton& skeleton);

/// Least distance in a motion of two limbs that are no neighbours, that is which are apart as the motion begins [m].
double limbsApart(const FigureMotion& motion);

}   // namespace slender::study
