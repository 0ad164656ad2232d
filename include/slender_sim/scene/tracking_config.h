#pragma once

#include <string>
#include <variant>
#include <vector>

#include "slender_sim/geometry/point_trajectory.h"
#include "slender_sim/geometry/pose_trajectory.h"
#include "slender_sim/geometry/triangle_mesh.h"
#include "slender_sim/tracking/function_set.h"
#include "slender_sim/tracking/guide_binding.h"

/// Plain structs: what a tracked cloth or rod follows, as checked by the reader.
namespace slender {

struct FixedGuide
{};
/// Through timed frames, held before the first and after the last.
struct FrameGuide
{
  PointTrajectory points;
};
/// Vertices carried by rigid bodies; the binding's own poses are identities.
struct CarriedGuide
{
  std::vector<std::string> bodies;
  GuideBinding binding;
  /// true: bodies carry the mesh with the offset at their first poses; false: vertices are in the bodies' frames
  bool keeps_offset = true;
  std::vector<PoseTrajectory> poses;   ///< per body; none: by `guide/bodies`
  bool by_tf = false;                  ///< bodies are names of tf frames instead of names in `guide/bodies`
  Pose offset;                         ///< pose of the mesh in the tf frame
};
/// Guide whose points come on the topic `guide/points`.
struct TopicGuide
{};
/// A cloth of the scene, simulated beside what tracks it, and ahead of it in each step.
struct ClothGuide
{
  int cloth = 0;                      ///< in the scene; not a tracked one
  Eigen::Matrix3Xd start, velocity;   ///< its vertices where the scene starts [m], [m/s]
};
using GuideMotion = std::variant<FixedGuide, FrameGuide, CarriedGuide, TopicGuide, ClothGuide>;

struct GuideConfig
{
  /// reference shape [m], over which averages are taken; of a rod's guide: nodes of a polyline, no triangles
  TriangleMesh mesh;
  GuideMotion motion;
  /// [s] time within which a guide by topic or tf comes to rest if no pose comes; 0: it stops at the last pose
  double coast = 0.0;

  bool byTopic() const;
  /// Vertices at `time` [s] (3 x n [m]) and their velocities [m/s]; of a guide by topic those of the mesh, at rest;
  /// of a cloth those that the scene starts with.
  void evaluate(double time, Eigen::Matrix3Xd& vertices, Eigen::Matrix3Xd* velocities = nullptr) const;
};

struct TrackingConfig
{
  GuideConfig guide;
  std::vector<FunctionSet> sets;   ///< the first acts where the scene starts
  /// diagonal of the box around the guide's mesh [m] (of a rod: its length): what errors are measured by
  double size = 1.0;
};

}   // namespace slender
