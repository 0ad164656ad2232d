#include "garments_figure.h"

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <limits>
#include <memory>
#include <stdexcept>

#include "slender_sim/contact/distance.h"
#include "slender_sim/scene/pose_file.h"
#include "study/framework/scene_cases.h"
#include "study/tracking/walk_angles.h"

namespace slender::study {

using Eigen::Quaterniond;
using Eigen::Vector3d;

namespace {

constexpr const char* kNames[kParts] = {"root",        "chest",          "neck",          "right_hip",   "right_knee",
                                        "right_ankle", "right_shoulder", "right_elbow",   "right_wrist", "left_hip",
                                        "left_knee",   "left_ankle",     "left_shoulder", "left_elbow",  "left_wrist"};
constexpr Part kCarrier[kParts] = {kRoot,      kRoot,     kChest,         kRoot,         kRightHip,
                                   kRightKnee, kChest,    kRightShoulder, kRightElbow,   kRoot,
                                   kLeftHip,   kLeftKnee, kChest,         kLeftShoulder, kLeftElbow};
constexpr double kLead = 0.6;          // [s]
constexpr double kSpread = 0.85;       // angle between arms and trunk when the motion begins [rad]
constexpr double kSlightly = 0.2;      // this angle while the figure walks [rad]
constexpr double kHipHeight = 0.887;   // [m]

Quaterniond turnAbout(const Vector3d& axis, double angle) { return Quaterniond(Eigen::AngleAxisd(angle, axis)); }
/// What hangs goes forwards.
Quaterniond flexed(double angle) { return turnAbout(Vector3d::UnitY(), -angle); }
/// What hangs goes to its side.
Quaterniond abducted(bool left, double angle) { return turnAbout(Vector3d::UnitX(), left ? angle : -angle); }
Part mirrored(Part right, bool left) { return static_cast<Part>(right + (left ? kLeftHip - kRightHip : 0)); }

/// A person of 1.7 m.
Skeleton commonSkeleton()
{
  Skeleton s;
  s.fill(Vector3d::Zero());
  s[kChest] = {0, 0, 0.235};
  s[kNeck] = {0, 0, 0.225};
  for (const bool left : {false, true})
  {
    const double side = left ? 1.0 : -1.0;
    s[mirrored(kRightHip, left)] = {0, side * 0.085, 0};
    s[mirrored(kRightKnee, left)] = s[mirrored(kRightAnkle, left)] = {0, 0, -0.41};
    s[mirrored(kRightShoulder, left)] = {0, side * 0.18, 0.245};
    s[mirrored(kRightElbow, left)] = {0, 0, -0.28};
    s[mirrored(kRightWrist, left)] = {0, 0, -0.26};
  }
  return s;
}

Posture upright(const Vector3d& at, const Quaterniond& heading)
{
  Posture p;
  p.root = at;
  p.turn.fill(heading);
  return p;
}

Posture walkAt(double t)
{
  const double phase = 2 * M_PI * t / kWalkPeriod;
  Posture p = upright({kWalkSpeed * t, 0, kHipHeight + 0.015 * std::cos(2 * phase)}, Quaterniond::Identity());
  p.turn[kChest] = p.turn[kNeck] = turnAbout(Vector3d::UnitZ(), 0.12 * std::cos(phase));
  for (const bool left : {false, true})
  {
    const double own = phase + (left ? M_PI : 0.0);
    const Quaterniond shoulder = p.turn[kChest] * flexed(kShoulderSwing.at(own)) * abducted(left, kSlightly);
    p.turn[mirrored(kRightShoulder, left)] = shoulder;
    p.turn[mirrored(kRightElbow, left)] = p.turn[mirrored(kRightWrist, left)] = shoulder * flexed(kElbowSwing.at(own));
    const double hip = kHipSwing.at(own), knee = kKneeSwing.at(own);
    p.turn[mirrored(kRightHip, left)] = flexed(hip);
    p.turn[mirrored(kRightKnee, left)] = flexed(hip - knee);
    p.turn[mirrored(kRightAnkle, left)] = flexed(0.4 * (hip - knee));
  }
  return p;
}

Posture danceAt(double t)
{
  const double beat = 2 * M_PI * t / 1.2, slow = 0.5 * beat;
  Posture p = upright({0.1 * std::sin(slow), 0.15 * (1 - std::cos(slow)), kHipHeight - 0.03 * (1 - std::cos(2 * beat))},
                      turnAbout(Vector3d::UnitZ(), 0.5 * std::sin(slow)));
  p.turn[kChest] = p.turn[kRoot] * turnAbout(Vector3d::UnitZ(), -0.7 * std::sin(slow)) *
                   turnAbout(Vector3d::UnitX(), 0.2 * std::sin(beat)) * flexed(-0.15 * (1 - std::cos(beat)));
  p.turn[kNeck] = p.turn[kChest] * turnAbout(Vector3d::UnitZ(), 0.4 * std::sin(slow));
  for (const bool left : {false, true})
  {
    const double own = beat + (left ? M_PI : 0.0);
    const Quaterniond shoulder =
        p.turn[kChest] * flexed(0.9 * std::sin(own)) * abducted(left, 0.8 + 0.5 * std::cos(own));
    p.turn[mirrored(kRightShoulder, left)] = shoulder;
    p.turn[mirrored(kRightElbow, left)] = p.turn[mirrored(kRightWrist, left)] =
        shoulder * flexed(0.8 + 0.6 * std::sin(own));
    const double hip = 0.35 * (1 + std::sin(own)), knee = 0.45 * (1 + std::sin(own));
    p.turn[mirrored(kRightHip, left)] = p.turn[kRoot] * flexed(hip) * abducted(left, 0.1);
    p.turn[mirrored(kRightKnee, left)] = p.turn[kRoot] * flexed(hip - knee) * abducted(left, 0.1);
    p.turn[mirrored(kRightAnkle, left)] = p.turn[kRoot] * flexed(0.3 * (hip - knee));
  }
  return p;
}

using Trajectories = std::array<PoseTrajectory, kParts>;

/// Parts that the table does not have remain empty.
Trajectories trajectoriesIn(const std::vector<BodyTrajectory>& bodies)
{
  Trajectories all;
  for (int part = 0; part < kParts; ++part)
    for (const BodyTrajectory& body : bodies)
      if (body.body == kNames[part])
        all[part] = body.poses;
  return all;
}

/// The keys have neither hips nor arms. The thighs lead from the root to the knees, and the arms stay spread.
FigureMotion backflipByKeys()
{
  const auto all = std::make_shared<const Trajectories>(trajectoriesIn(packageMotion("backflip_keys")));
  FigureMotion motion{"backflip", commonSkeleton(), (*all)[kRoot].lastTime(), {}};
  motion.at = [all, skeleton = motion.skeleton](double t) {
    const auto pose = [&](Part part) { return (*all)[part].evaluate(t); };
    Posture p = upright(pose(kRoot).position, pose(kRoot).orientation);
    for (const Part part : {kChest, kNeck})
      p.turn[part] = pose(part).orientation;
    for (const bool left : {false, true})
    {
      const Vector3d thigh =
          pose(kRoot).inverse() * pose(mirrored(kRightKnee, left)).position - skeleton[mirrored(kRightHip, left)];
      p.turn[mirrored(kRightHip, left)] = p.turn[kRoot] * Quaterniond::FromTwoVectors(-Vector3d::UnitZ(), thigh);
      for (const Part part : {kRightKnee, kRightAnkle})
        p.turn[mirrored(part, left)] = pose(mirrored(part, left)).orientation;
      for (const Part part : {kRightShoulder, kRightElbow, kRightWrist})
        p.turn[mirrored(part, left)] = p.turn[kChest] * abducted(left, 0.6);
    }
    return p;
  };
  return motion;
}

/// Frames of the table may have y up and z to the right while the figure stands; ours have z up.
FigureMotion recordedMotion(const std::filesystem::path& file)
{
  const auto all = std::make_shared<const Trajectories>(trajectoriesIn(readPoseFile(file.string())));
  for (int part = 0; part < kParts; ++part)
    if ((*all)[part].empty())
      throw std::runtime_error(file.string() + ": the part " + kNames[part] + " is missing.");
  const Eigen::Matrix3d first = (*all)[kRoot].poses().front().orientation.toRotationMatrix();
  const Quaterniond own =
      first(2, 1) > first(2, 2) ? turnAbout(Vector3d::UnitX(), -0.5 * M_PI) : Quaterniond::Identity();
  FigureMotion motion{file.stem().string(), {}, (*all)[kRoot].lastTime() - (*all)[kRoot].firstTime(), {}};
  for (int part = 0; part < kParts; ++part)
  {
    const Pose carrier = (*all)[kCarrier[part]].poses().front(), joint = (*all)[part].poses().front();
    motion.skeleton[part] = own.conjugate() * (carrier.orientation.conjugate() * (joint.position - carrier.position));
  }
  motion.at = [all, own, begin = (*all)[kRoot].firstTime()](double t) {
    Posture p;
    p.root = (*all)[kRoot].evaluate(begin + t).position;
    for (int part = 0; part < kParts; ++part)
      p.turn[part] = (*all)[part].evaluate(begin + t).orientation * own;
    return p;
  };
  return motion;
}

}   // namespace

std::array<Pose, kParts> FigureMotion::poses(double t) const
{
  const Posture p = at(t);
  std::array<Pose, kParts> all;
  for (int part = 0; part < kParts; ++part)
    all[part] = {part == kRoot ? p.root : all[kCarrier[part]] * skeleton[part], p.turn[part]};
  return all;
}

std::vector<FigureMotion> packageMotions()
{
  return {
      {"walk", commonSkeleton(), 2 * kWalkPeriod, walkAt}, {"dance", commonSkeleton(), 2.4, danceAt}, backflipByKeys()};
}

std::vector<FigureMotion> recordedMotions(const std::string& folder)
{
  if (!std::filesystem::is_directory(folder))
    throw std::runtime_error("SLENDER_MOTIONS: '" + folder + "' is not a folder; give one with motions *.csv.");
  std::vector<std::filesystem::path> files;
  for (const auto& entry : std::filesystem::directory_iterator(folder))
    if (entry.path().extension() == ".csv")
      files.push_back(entry.path());
  if (files.empty())
    throw std::runtime_error(folder + ": there is no motion *.csv.");
  std::sort(files.begin(), files.end());
  std::vector<FigureMotion> motions;
  for (const std::filesystem::path& file : files)
    motions.push_back(recordedMotion(file));
  return motions;
}

FigureMotion withLead(const FigureMotion& motion)
{
  FigureMotion out = motion;
  out.duration = motion.duration + 0.5 * kLead;
  const Posture first = motion.at(0.0);
  const Vector3d ahead = first.turn[kRoot] * Vector3d::UnitX();
  Posture dressing = upright(first.root, turnAbout(Vector3d::UnitZ(), std::atan2(ahead.y(), ahead.x())));
  for (const bool left : {false, true})
    for (const Part part : {kRightShoulder, kRightElbow, kRightWrist})
      dressing.turn[mirrored(part, left)] = dressing.turn[kRoot] * abducted(left, kSpread);
  out.at = [motion, dressing](double t) {
    const double u = std::clamp(t / kLead, 0.0, 1.0), share = u * u * u * (10 - 15 * u + 6 * u * u);
    // the integral of the share: time of the motion passes ever faster during the lead
    const double passed = kLead * u * u * u * u * (2.5 - 3 * u + u * u) + std::max(0.0, t - kLead);
    const Posture to = motion.at(passed);
    Posture p;
    p.root = to.root;
    for (int part = 0; part < kParts; ++part)   // carriers come first
    {
      const auto joint = [&](const Posture& q) {
        return part == kRoot ? q.turn[kRoot] : Quaterniond(q.turn[kCarrier[part]].conjugate() * q.turn[part]);
      };
      const Quaterniond blended = joint(dressing).slerp(share, joint(to));
      p.turn[part] = part == kRoot ? blended : (p.turn[kCarrier[part]] * blended).normalized();
    }
    return p;
  };
  return out;
}

std::vector<Limb> limbsOf(const Skeleton& s)
{
  const Vector3d up = Vector3d::UnitZ();
  std::vector<Limb> limbs{{"hips", kRoot, s[kRightHip], s[kLeftHip], 0.085},
                          {"abdomen", kRoot, 0.03 * up, s[kChest], 0.10},
                          {"thorax", kChest, Vector3d::Zero(), 0.75 * s[kNeck], 0.105},
                          {"shoulders", kChest, s[kRightShoulder], s[kLeftShoulder], 0.05},
                          {"head", kNeck, 0.06 * up, 0.2 * up, 0.08}};
  for (const bool left : {false, true})
  {
    const std::string side = left ? "left_" : "right_";
    const auto of = [&](Part right) { return mirrored(right, left); };
    limbs.push_back({side + "upper_arm", of(kRightShoulder), Vector3d::Zero(), s[of(kRightElbow)], 0.035});
    limbs.push_back({side + "forearm", of(kRightElbow), Vector3d::Zero(), 0.8 * s[of(kRightWrist)], 0.025});
    limbs.push_back({side + "thigh", of(kRightHip), Vector3d::Zero(), s[of(kRightKnee)], 0.06});
    limbs.push_back({side + "shin", of(kRightKnee), Vector3d::Zero(), s[of(kRightAnkle)], 0.04});
    limbs.push_back({side + "foot", of(kRightAnkle), Vector3d::Zero(), Vector3d(0.14, 0, -0.03), 0.035});
  }
  return limbs;
}

double limbsApart(const FigureMotion& motion)
{
  const std::vector<Limb> limbs = limbsOf(motion.skeleton);
  const auto distances = [&](double t) {
    const std::array<Pose, kParts> poses = motion.poses(t);
    std::vector<double> all;
    for (std::size_t i = 0; i < limbs.size(); ++i)
      for (std::size_t j = 0; j < i; ++j)
      {
        const Limb &a = limbs[i], &b = limbs[j];
        all.push_back(segmentDistance(poses[a.part] * a.from, poses[a.part] * a.to, poses[b.part] * b.from,
                                      poses[b.part] * b.to) -
                      a.radius - b.radius);
      }
    return all;
  };
  const std::vector<double> first = distances(0.0);
  double least = std::numeric_limits<double>::infinity();
  for (double t = 0.0; t < motion.duration; t += 0.01)
  {
    const std::vector<double> now = distances(t);
    for (std::size_t k = 0; k < now.size(); ++k)
      if (first[k] > 0.0)
        least = std::min(least, now[k]);
  }
  return least;
}

}   // namespace slender::study
