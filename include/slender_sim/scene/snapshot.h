#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include <Eigen/Core>
#include <Eigen/Geometry>

#include "slender_sim/scene/field_tables.h"
#include "slender_sim/scene/simulation.h"

/// What is kept of one instant, whether it comes from a running simulation or from a bag. SI units, world axes.
namespace slender {

struct RodSnapshot
{
  std::string name;
  bool closed = false;
  Eigen::Matrix3Xd x, v;                    ///< per node
  std::vector<Eigen::Quaterniond> frames;   ///< per edge: x along the tangent, y along d1
  Eigen::VectorXd twist;                    ///< per node [rad]
  Eigen::VectorXd radius_a, radius_b;       ///< per edge: semi-axes along d1 and d2
};

/// A thread, or a piece that broke off it.
struct ThreadSnapshot
{
  std::string name;
  std::uint64_t thread_id = 0;
  std::vector<std::uint64_t> ids;           ///< per node, never used again
  Eigen::Matrix3Xd x, v;                    ///< per node, from the oldest on
  std::vector<std::uint8_t> deposited;      ///< per node
  std::vector<Eigen::Quaterniond> frames;   ///< per edge
  Eigen::VectorXd radius;                   ///< per edge
};

struct ClothSnapshot
{
  std::string name;
  Eigen::Matrix3Xd x, v;        ///< per vertex
  Eigen::Matrix3Xi triangles;   ///< empty: not recorded
};

struct GraspSnapshot
{
  struct Held
  {
    std::string object;   ///< rod or cloth
    bool active = false;
    Pose X_WG;   ///< of the held section, or of the frame that holds a cloth's vertices
  };
  std::string name;
  std::optional<Held> held;   ///< nothing: not recorded
  Wrench wrench;              ///< zero while released
};

/// A body or an obstacle.
struct SolidSnapshot
{
  std::string name;
  Pose pose;
  Twist velocity;
};

/// A test function of a tracked cloth or rod.
struct FunctionSnapshot
{
  std::string object, name;
  Eigen::Vector3d average{0, 0, 0}, force{0, 0, 0};   ///< over the guide; with which the guide acts
};

struct SceneSnapshot
{
  double time = 0.0;   ///< of the scene: steps * step length
  std::vector<RodSnapshot> rods;
  std::vector<ThreadSnapshot> threads;
  std::vector<ClothSnapshot> cloths;
  std::vector<GraspSnapshot> grasps;
  std::vector<SolidSnapshot> bodies, obstacles;
  std::vector<FunctionSnapshot> functions;
  std::vector<FieldTable> fields;   ///< what `record.fields` of the scene asks for
};

/// Material frame of an edge: x along the tangent, y along d1.
Eigen::Quaterniond edgeFrame(const ThreadState& state, int edge);

RodSnapshot snapshotOf(const RodModel& model, const RodState& state);
ThreadSnapshot snapshotOf(const std::string& name, const ThreadState& state);
SceneSnapshot snapshotOf(const Simulation& simulation);

/// The averages over the guide, vertices 3 x n [m], by the functions in force of a tracked cloth or rod and the forces,
/// 3 x functions [N], appended to `out`; functions of a named set as SET/NAME.
void appendFunctions(const std::string& object, const FunctionSet& set, const Eigen::Matrix3Xd& guide,
                     const Eigen::Matrix3Xd& forces, std::vector<FunctionSnapshot>& out);

/// The same of a rod or cloth and a set by their names; false, and nothing, when the scene has none such that tracks a
/// guide of this size.
bool appendFunctions(const SceneConfig& scene, const std::string& object, const std::string& set,
                     const Eigen::Matrix3Xd& guide, const Eigen::Matrix3Xd& forces, std::vector<FunctionSnapshot>& out);

}   // namespace slender
