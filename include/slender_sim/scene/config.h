#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <functional>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <variant>
#include <vector>

#include "slender_sim/cloth/cloth_stepper.h"
#include "slender_sim/contact/contact_properties.h"
#include "slender_sim/contact/obstacle.h"
#include "slender_sim/dynamics/time_config.h"
#include "slender_sim/geometry/number_table.h"
#include "slender_sim/geometry/pose.h"
#include "slender_sim/geometry/pose_trajectory.h"
#include "slender_sim/rod/rigid_body.h"
#include "slender_sim/rod/rod_model.h"
#include "slender_sim/scene/limits_config.h"
#include "slender_sim/scene/statics_config.h"
#include "slender_sim/scene/tracking_config.h"
#include "slender_sim/thread/thread_model.h"

/// Plain structs: a scene as checked by the reader (scene/reader.h). SI units.
namespace slender {

constexpr double kMaxCoordinate = 1e6;   ///< [m] of what a scene or a message places
constexpr double kMaxBeltSpeed = 1e3;    ///< [m/s] of each component
constexpr double kMaxWindSpeed = 1e3;    ///< [m/s] of each component

/// A curve of the scene is a formula, or the points of a polyline.
struct Curve
{
  /// A formula makes so many edges. A polyline is divided into so many; without a number its points are the nodes.
  std::optional<int> edges;
  /// Returns the nodes [m] of the curve with so many edges. A catenary hangs along gravity. If it is null, `points` are
  /// the curve.
  std::function<Eigen::Matrix3Xd(int edges, const Eigen::Vector3d& gravity)> formula{};
  std::vector<Eigen::Vector3d> points{};   ///< from the scene or from a CSV file
};

/// Returns a straight line. `grading` is the length of the last edge over that of the first.
Curve straightLine(const Eigen::Vector3d& from, const Eigen::Vector3d& to, int edges, double grading = 1.0);

/// Radii [m]; a vector has one entry per edge, or two (linear taper from the first to the last edge), or one.
struct CrossSection
{
  std::vector<double> a;   ///< semi-axis along d1
  std::vector<double> b;   ///< semi-axis along d2
};

enum class Torsion
{
  polar,
  saint_venant
};

/// Either by (youngs_modulus, poissons_ratio) or directly by moduli; density always.
struct Material
{
  double density = 1000.0;                 ///< [kg/m^3] > 0
  double youngs_modulus = 1e6;             ///< E [Pa] > 0
  double poissons_ratio = 0.5;             ///< (-1, 0.5]
  Torsion torsion = Torsion::polar;        ///< G A (a^2+b^2)/4, or the exact ellipse G pi a^3 b^3/(a^2+b^2)
  std::optional<double> linear_density;    ///< [kg/m] instead of density times area
  std::optional<double> stretch_modulus;   ///< k_s [N]
  /// k_s raised until the rod's own weight stretches it by at most 1e-5
  bool inextensible = false;
  std::optional<Eigen::Matrix2d> bend_modulus;   ///< B [N m^2]; scalar alpha or [B1, B2] or 2x2 in the file
  std::optional<double> twist_modulus;           ///< beta [N m^2]
};

struct Damping
{
  double mass = 0.0;        ///< Rayleigh, force -mass * m * v [1/s] >= 0
  double stiffness = 0.0;   ///< Rayleigh, stiffness * d(strain)/dt in place of strain [s] >= 0
  double drag = 0.0;        ///< linear drag, force -drag * (v - wind) per length [N s/m^2] >= 0
};

struct FixedMotion
{};
/// driven by `grasps/NAME/pose` or `guides`; fixed without a node
struct TopicMotion
{};
/// Motion that follows a frame of tf. Without a node nothing moves. `offset` is the pose of the moved object in the
/// frame. It is applied to the smoothed motion of the frame, so that objects that follow the same frame do not move
/// relative to each other.
struct TfMotion
{
  std::string frame;   ///< without a leading slash
  Pose offset;
};
/// Rigidly follows a body: an obstacle or a driven body of the scene, or else one that only the `bodies` topic knows.
/// The scene's bodies have a pose from the start, so that `attach: initial` takes its offset then.
struct BodyMotion
{
  std::string body;
};
struct TableMotion
{
  PoseTrajectory poses;
};   ///< timed poses, from the scene or a CSV file
using Motion = std::variant<FixedMotion, TopicMotion, TfMotion, BodyMotion, TableMotion>;
/// Motion of obstacles and driven bodies. Topic: the entry of the same name in `bodies` messages.
using GivenMotion = std::variant<FixedMotion, TopicMotion, TfMotion, TableMotion>;

/// Returns true if a Motion or a GivenMotion comes from outside of the node: by messages or by tf.
template <class AnyMotion>
bool comesFromOutside(const AnyMotion& motion)
{
  return std::holds_alternative<TopicMotion>(motion) || std::holds_alternative<TfMotion>(motion);
}

enum class Hold
{
  frame,
  position
};   ///< clamp (position and material frame) or point pin

/// Meaning of the poses of a grasp's motion.
enum class Attach
{
  /// poses are those of the held section itself: x along the tangent, y along d1; of a cloth's grasp: of its frame
  section,
  initial,   ///< keep the offset between the first pose and the section as the scene starts (or as it is at attaching)
};

struct GraspConfig
{
  std::string name;
  /// Held nodes, first..last (resolved by the reader: negative indices counted from the end).
  /// `edges: [0]` (or [-1]) of an open rod is the end section: first == last == the end node. More edges hold all their
  /// nodes.
  int first_node = 0, last_node = 0;
  std::vector<int> vertices;   ///< of a cloth, instead of nodes: ascending
  /// of a cloth: the faces within the vertices are clamped (see ClothModel::clamped_faces)
  bool clamp = false;
  Hold hold = Hold::frame;
  Motion motion = FixedMotion{};
  Attach attach = Attach::section;
  /// Names of obstacles, or of links of robots, that the whole object passes through. With nothing, the object passes
  /// near the grasp through the links that its held part touches at the start.
  std::optional<std::vector<std::string>> ignored_contacts;
  GraspLimits limits;
  /// Pose of the held section in the frame that `motion` gives; not with Attach::initial. With nothing the offset of a
  /// TfMotion counts, if `motion` is one.
  std::optional<Pose> offset;
  /// Unit tangent and unit first material axis of the held section of a rod, in world axes, for motions whose poses
  /// have no orientation. Zero: not given. The director need not be normal to the tangent; its normal part is used.
  Eigen::Vector3d direction{0, 0, 0}, director{0, 0, 0};
};

/// Returns the pose of the held section in the frame that drives the grasp, if the scene gives this pose.
std::optional<Pose> offsetInFrame(const GraspConfig& grasp);

/// Selects the equations of a rod. `automatic` takes the isotropic form for explicit steps of naturally straight rods
/// that bend alike in all directions, and the general form otherwise.
enum class Formulation
{
  automatic,
  isotropic,
  general
};
enum class Stretching
{
  stiff,
  projected
};

/// A section of a rod whose frame nodes publish on tf.
struct SectionFrame
{
  std::string name;
  int node = 0;   ///< resolved by the reader: never negative
};

struct RodConfig
{
  std::string name;
  std::string place;   ///< "FILE:LINE: PATH" for messages; empty when not read from a file
  /// rest (natural) shape, also the initial one unless `initial` is given
  Curve centerline = straightLine({0, 0, 0}, {1, 0, 0}, 50);
  std::optional<Curve> initial;      ///< initial shape; its edges are resampled to those of the centerline
  bool closed = false;               ///< loop: the last node is joined to the first by one more edge
  bool naturally_straight = false;   ///< rest curvature zero whatever the centerline's shape
  JointOptions joints;               ///< `curvature`, `matched_to_arcs`
  /// joints.curvature is chosen when the rod is built: see `curvature` in docs/rods.md
  bool automatic_curvature = true;
  std::vector<double> rest_twist;   ///< natural twist [rad]: of the whole rod, or of each joint; empty: none
  /// about d2, -d1 [1/m]: of all joints, or of each; empty: that of the centreline
  std::vector<Eigen::Vector2d> natural_curvature;
  Formulation formulation = Formulation::automatic;
  Stretching stretching = Stretching::stiff;
  double initial_twist = 0.0;          ///< total twist [rad], spread evenly, of the initial shape
  Eigen::Vector3d director{0, 0, 0};   ///< d1 at the first edge (projected); zero: chosen automatically
  CrossSection cross_section{{0.005}, {0.005}};
  Material material;
  Damping damping;
  std::vector<GraspConfig> grasps;
  std::vector<RodLoadConfig> loads;           ///< dead point loads, in statics and in dynamics
  std::optional<ContactProperties> contact;   ///< nothing: touches nothing
  /// what it follows (`track`), with one set of test functions; null: nothing
  std::shared_ptr<const TrackingConfig> tracking;
  std::vector<SectionFrame> broadcast_tf;   ///< sections whose frames nodes publish on tf
  int edges = 0;                            ///< of the rest shape; the reader counts them; 0: not known

  int nodes() const { return edges + (edges > 0 && !closed ? 1 : 0); }
};

struct ContactConfig
{
  /// distance at which surfaces begin to repel [m]; the reader's default: a tenth of the smallest radius that takes
  /// part (of a nozzle: a quarter of its radius), 0 when nothing does
  double gap = 0.0;
  double slip_speed = 1e-4;   ///< friction sticks below it [m/s] > 0
};

/// An obstacle with its motion.
struct ObstacleConfig : Obstacle
{
  /// Name of the tf frame of the link, if the obstacle is a collision element of a robot. All elements of a link have
  /// the same name here.
  std::string link;
  Pose pose;   ///< of the shape, where the scene starts
  GivenMotion motion = FixedMotion{};
};

/// Nodes of a rod that a body carries, as GraspConfig's. They keep the place and orientation that they have in the body
/// at the start.
struct WeldConfig
{
  int rod = 0, first_node = 0, last_node = 0;
};

/// The properties do not matter unless the body is simulated.
struct BodyConfig : BodyProperties
{
  std::optional<Shape> shape;
  Pose X_BS;   ///< the shape in the body's frame
  /// of the body's frame at the start; simulated: centre of mass
  Pose pose;
  Twist velocity;                      ///< at the start
  std::optional<GivenMotion> motion;   ///< nothing: simulated
  /// Its shape touches rods, threads and cloths; that of a simulated body also obstacles and other bodies.
  bool contact = true;
  std::optional<double> friction;   ///< [-]; nothing: that of the rod; against solids 0.3
  bool broadcast_tf = false;        ///< nodes publish the frame of the body on tf
  std::vector<WeldConfig> welds;

  bool isSolid() const { return shape && contact; }   ///< others may touch it
  bool isSimulatedSolid() const { return isSolid() && !motion; }
  bool isWeldedTo(int rod) const
  {
    return std::any_of(welds.begin(), welds.end(), [rod](const WeldConfig& weld) { return weld.rod == rod; });
  }
};

/// A number that the scene gives: constant (one entry), or over time; or set by messages, until the first of which it
/// holds.
struct TimedNumber
{
  NumberTable table{{{0.0, 0.0}}};
  bool topic = false;
};

struct NozzleConfig
{
  Pose pose;                            ///< where the scene starts: origin at the outlet, x along the flow
  double diameter = 0.005;              ///< [m]
  TimedNumber flow;                     ///< [m^3/s]
  GivenMotion motion = FixedMotion{};   ///< topic: `nozzle/pose`
};

/// A horizontal floor that the thread sticks to or slips on, or a belt.
struct FloorConfig
{
  double height = 0.0;              ///< [m]
  TimedNumber belt_x, belt_y;       ///< velocity [m/s]; topic: `belt/velocity`
  bool on_surface = false;          ///< the centreline comes to lie on the surface instead of one radius above
  std::optional<double> friction;   ///< it slips with this coefficient of Coulomb [-]; nothing: it sticks
};

/// A thread that leaves a nozzle, or one that is there from the start: one of `nozzle` and `centerline`.
struct ThreadConfig : Fluid
{
  std::string name;
  std::optional<NozzleConfig> nozzle;
  std::optional<Curve> centerline;          ///< from its oldest to its newest end
  std::vector<double> radius;               ///< of its edges [m]: one, two (a taper) or one per edge
  std::array<bool, 2> held{false, false};   ///< its ends are clamped where they are
  std::optional<FloorConfig> floor;
  double feed_length = 0.0;                         ///< of the edges that leave the nozzle [m]
  double longest_edge = 0.0, shortest_edge = 0.0;   ///< [m] 0: edges are neither divided nor joined
  /// [m] edges grow up to it with their height above the floor; 0: longest_edge holds everywhere
  double highest_edge = 0.0;
  double longest_step = 0.0;   ///< [s] longer steps are taken in several; 0: they are not
  /// radius of the circle in which the nozzle starts, over that of the coil; 0: it stands
  double swirl = 0.0;
  /// the thread parts where it is thinner [m]; 0: never; the reader chooses it from the flow unless the scene gives it
  double breakup_radius = 0.0;
  int most_deposited = 0;                                 ///< nodes on the floor; 0: all are kept
  std::optional<std::array<Eigen::Vector3d, 2>> region;   ///< corners; what lies outside is dropped, oldest first
  std::optional<ContactProperties> contact;               ///< nothing: touches nothing but the floor
  /// parts in touch are drawn together down to this share of the sum of their radii; 0: never
  double merging = 0.0;
};

/// [m^3/s] At this flow a nozzle feeds a thousand edges per step of `step` [s]; more is a mistaken unit, and one step
/// would take for ever.
inline double greatestFlow(const ThreadConfig& thread, double step)
{
  const double diameter = thread.nozzle ? thread.nozzle->diameter : 0.0;
  const double feed = thread.feed_length > 0 ? thread.feed_length : diameter;
  return 1000 * feed * 0.25 * M_PI * diameter * diameter / step;
}

/// A rectangle of cloth as the scene file states it; see geometry/mesh_shapes.h.
struct ClothGrid
{
  Eigen::Vector3d corner{0, 0, 0};   ///< lower left [m]
  /// to the lower right, to the upper left; at right angles
  std::array<Eigen::Vector3d, 2> sides{Eigen::Vector3d(1, 0, 0), Eigen::Vector3d(0, 1, 0)};
};

/// A grasp's frame has its origin at the mean of the held vertices and the world's axes when it takes hold; then it
/// moves with its motion, and the vertices rigidly with it.
struct ClothConfig : ClothProperties, ClothSolving
{
  std::string name;
  std::string place;                 ///< "FILE:LINE: PATH" for messages; empty when not read from a file
  TriangleMesh mesh;                 ///< undeformed [m]
  Eigen::Matrix3Xd start;            ///< vertices where the scene starts [m]; empty: those of the mesh
  Eigen::Matrix3Xd start_velocity;   ///< of the vertices [m/s]; empty: at rest
  std::optional<ClothGrid> grid;     ///< that the mesh was made from
  double area_density = 0.15;        ///< [kg/m^2]
  std::vector<GraspConfig> grasps;
  std::vector<ClothLoadConfig> loads;               ///< dead loads on vertices, in statics and in dynamics
  std::shared_ptr<const TrackingConfig> tracking;   ///< what it follows (`tracked`); null: nothing
  std::optional<ContactProperties> contact;         ///< nothing: touches nothing
};

/// How a scene starts.
struct StartConfig
{
  bool equilibrium = false;   ///< the static solver runs first
  /// simulated bodies have their given velocities at the equilibrium; otherwise they are at rest
  bool keep_velocities = false;
  bool accept_unstable = false;   ///< an unstable equilibrium is a warning; otherwise the scene is refused
};

/// Names of rods and cloths with the nodes or vertices of theirs that tables hold, ascending. Of an object that is not
/// named, tables hold all.
using NodeChoice = std::map<std::string, std::vector<int>>;

/// Quantities that `record: {fields: [...]}` adds to what is recorded. Nothing is computed of those that are not named.
enum class RecordField
{
  curvature,       ///< of rods, per node
  twist,           ///< of rods, per node
  strain,          ///< of rods, per edge
  force,           ///< internal force of rods, per edge
  moment,          ///< internal moment of rods, per node
  energy,          ///< per rod, cloth and simulated body
  contact_force,   ///< of rods and cloths, per node or vertex; the sum on an obstacle or a body
};

struct RecordConfig
{
  int every = 1;   ///< record every n-th step (`simulate`)
  /// what the tables of `simulate --csv` hold; bags and OBJ files hold all nodes
  NodeChoice nodes;
  /// what is computed and recorded besides, each once (see field_tables.h)
  std::vector<RecordField> fields;
};

struct SceneConfig
{
  std::string name = "scene";
  std::string file;     ///< file from which the scene was read, for messages; may be empty
  std::string source;   ///< the YAML text after --set overrides (what `scene` publishes)
  /// folder from which relative file names in the scene start
  std::string directory = ".";
  /// Warnings for the user about a scene that can run, one or two sentences each. First the reader adds warnings
  /// (YamlCursor::warning), then the constructor of Simulation. simulate prints them to stderr, nodes log them as ROS
  /// warnings.
  std::vector<std::string> warnings;
  /// Choices of the constructor of Simulation that the user may want to know, one sentence each. Programs print them as
  /// information.
  std::vector<std::string> notes;
  std::vector<std::string> guide_bags;    ///< paths of bags from which guides were read
  Eigen::Vector3d gravity{0, 0, -9.81};   ///< [m/s^2]
  Eigen::Vector3d wind{0, 0, 0};          ///< [m/s]
  bool wind_topic = false;                ///< `wind` messages set it; until the first one it is as above
  StartConfig start;
  std::optional<StaticsConfig> statics;   ///< what `simulate --statics` does besides one equilibrium
  TimeConfig time;
  RecordConfig record;
  LimitsConfig limits;
  ContactConfig contact;
  std::vector<RodConfig> rods;
  std::vector<ThreadConfig> threads;
  std::vector<ClothConfig> cloths;   ///< and then those that are tracked
  std::vector<ObstacleConfig> obstacles;
  std::vector<BodyConfig> bodies;   ///< names differ from each other and from the obstacles'
};

}   // namespace slender
