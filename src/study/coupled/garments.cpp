// Clothes on a figure that walks, dances and turns over backwards. Each garment is held at its upper edge and touches
// the figure's limbs and itself by the barrier. An independent check follows each step.
#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <limits>
#include <sstream>
#include <stdexcept>
#include <string>
#include <vector>

#include "garments_figure.h"
#include "mixed_check.h"
#include "study/cloth/cloth_cases.h"
#include "study/framework/cpu_clock.h"
#include "slender_sim/geometry/mesh_shapes.h"
#include "slender_sim/geometry/mesh_topology.h"
#include "slender_sim/scene/reader.h"
#include "slender_sim/scene/simulation.h"
#include "slender_sim/study/study.h"

namespace slender::study {

namespace {

using Eigen::Matrix3Xd;
using Eigen::Vector3d;

constexpr double kGarmentStep = 0.005;                        // [s]
constexpr double kClothThickness = 0.002;                     // of the cloth in contact [m]
constexpr double kRoundingOfRoom = 1e-9;                      // [m]
constexpr double kQuickSeconds = 0.7, kFinestSeconds = 1.0;   // simulated at most, with 400 and with 6,400 vertices
/// CPU time after which a run ends unfinished [s]. Runs in real time take less than a fiftieth of it.
constexpr double kMostCpuSeconds = 200.0;
constexpr double kFar = std::numeric_limits<double>::infinity();

/// A garment around the standing figure, in the frame of the part that holds it.
struct Garment
{
  Part carrier;
  TriangleMesh mesh;       ///< [m]
  std::vector<int> held;   ///< vertices
};

/// Part of a cone about z, from the edge of radius `inner` down and outwards at `angle` from z: `rings` rings of
/// `around` vertices, each turned by half a cell from the next.
TriangleMesh coneMesh(double inner, double slant, double angle, int around, int rings)
{
  TriangleMesh mesh;
  mesh.vertices.resize(3, around * rings);
  mesh.triangles.resize(3, 2 * around * (rings - 1));
  for (int k = 0; k < rings; ++k)
    for (int i = 0; i < around; ++i)
    {
      const double s = slant * k / (rings - 1), turn = 2 * M_PI * (i + 0.5 * (k % 2)) / around,
                   r = inner + s * std::sin(angle);
      mesh.vertices.col(k * around + i) = Vector3d(r * std::cos(turn), r * std::sin(turn), -s * std::cos(angle));
    }
  int t = 0;
  for (int k = 0; k + 1 < rings; ++k)
    for (int i = 0; i < around; ++i)
    {
      const int next = (i + 1) % around, a = k * around + i, b = k * around + next, c = a + around, d = b + around;
      const bool ahead = k % 2 == 1;   // the upper ring lies half a cell further
      mesh.triangles.col(t++) = ahead ? Eigen::Vector3i(a, c, d) : Eigen::Vector3i(a, c, b);
      mesh.triangles.col(t++) = ahead ? Eigen::Vector3i(a, d, b) : Eigen::Vector3i(b, c, d);
    }
  return mesh;
}

std::vector<int> firstVertices(int count)
{
  std::vector<int> all(count);
  for (int i = 0; i < count; ++i)
    all[i] = i;
  return all;
}

/// `fineness`: 1, 2 or 4, for 400, 1,600 or 6,400 vertices.
Garment skirt(int fineness)
{
  Garment g{kRoot, coneMesh(0.12, 0.55, M_PI / 6, 40 * fineness, 10 * fineness), firstVertices(40 * fineness)};
  g.mesh.vertices.row(2).array() += 0.18;
  return g;
}

/// A disc with a hole for the neck, which lies on the shoulders.
Garment poncho(const Skeleton& s, int fineness)
{
  Garment g{kChest, coneMesh(0.16, 0.5, 0.5 * M_PI, 40 * fineness, 10 * fineness), firstVertices(40 * fineness)};
  g.mesh.vertices.row(2).array() += s[kLeftShoulder].z() + 0.07;
  return g;
}

/// A sheet behind the back, held between the shoulders.
Garment cape(const Skeleton& s, int fineness)
{
  constexpr double kWidth = 0.6, kLength = 0.9;
  Garment g{kChest, gridMesh(kWidth, kLength, 16 * fineness - 1, 25 * fineness - 1, GridPattern::alternating), {}};
  for (Eigen::Index i = 0; i < g.mesh.vertices.cols(); ++i)
  {
    const Vector3d flat = g.mesh.vertices.col(i);
    g.mesh.vertices.col(i) = Vector3d(-0.11, flat.x() - 0.5 * kWidth, s[kLeftShoulder].z() - flat.y());
    if (flat.y() < 1e-9 && std::abs(flat.x() - 0.5 * kWidth) < 0.16)
      g.held.push_back(static_cast<int>(i));
  }
  return g;
}

Garment garmentOf(const std::string& kind, const Skeleton& s, int fineness)
{
  return kind == "skirt" ? skirt(fineness) : kind == "poncho" ? poncho(s, fineness) : cape(s, fineness);
}

/// Frame of a limb's shape, a capsule along z, in that of the part.
Pose shapeFrame(const Limb& limb)
{
  return {0.5 * (limb.from + limb.to), Eigen::Quaterniond::FromTwoVectors(Vector3d::UnitZ(), limb.to - limb.from)};
}

/// The motion of a part, or of what it carries, at each step.
TableMotion tableOf(const FigureMotion& motion, Part part, const Pose& carried)
{
  std::vector<double> times;
  std::vector<Pose> poses;
  for (int k = 0; k * kGarmentStep < motion.duration + 2 * kGarmentStep; ++k)
  {
    times.push_back(k * kGarmentStep);
    poses.push_back(motion.poses(times.back())[part] * carried);
  }
  return {PoseTrajectory(times, poses)};
}

/// A scene in which the figure wears the garment. The cloth is cotton, and the part that carries it holds its edge.
SceneConfig sceneOf(const FigureMotion& motion, const Garment& garment)
{
  std::ostringstream text;
  text << "time: {step: " << kGarmentStep
       << ", duration: 100}\ncloths:\n  - name: garment\n    grid: {sides: [[1, 0, 0], [0, 1, 0]], cells: 2}\n"
       << "    material: {area_density: 0.12, thickness: 0.0003, youngs_modulus: 1.0e6, poissons_ratio: 0.3}\n"
       << "    bending: {model: hinge, modulus: 4.0e-6}\n"
       << "    damping: {mass: 0.2, stiffness: 0.002, drag: 0.5}\n"
       << "    contact: {method: barrier, friction: 0.3, thickness: " << kClothThickness << "}\n";
  SceneConfig config = parseScene(text.str(), "garments");
  ClothConfig& cloth = config.cloths.front();
  const Pose carrier = motion.poses(0.0)[garment.carrier];
  cloth.grid.reset();
  cloth.warp = carrier.orientation * Vector3d::UnitY();
  cloth.mesh = garment.mesh;
  for (Eigen::Index i = 0; i < cloth.mesh.vertices.cols(); ++i)
    cloth.mesh.vertices.col(i) = carrier * Vector3d(cloth.mesh.vertices.col(i));
  GraspConfig grasp;
  grasp.name = "edge";
  grasp.vertices = garment.held;
  grasp.attach = Attach::initial;
  grasp.motion = tableOf(motion, garment.carrier, {});
  cloth.grasps.push_back(grasp);
  for (const Limb& limb : limbsOf(motion.skeleton))
  {
    ObstacleConfig obstacle;
    obstacle.name = limb.name;
    obstacle.shape = Capsule{limb.radius, (limb.to - limb.from).norm()};
    obstacle.pose = motion.poses(0.0)[limb.part] * shapeFrame(limb);
    obstacle.motion = tableOf(motion, limb.part, shapeFrame(limb));
    config.obstacles.push_back(obstacle);
  }
  return config;
}

/// Least room between points of the garment and the limbs, where the motion says that these are [m]. It knows nothing
/// of the scene and of contact.
class LimbCheck
{
public:
  LimbCheck(const FigureMotion& motion, const Garment& garment)
    : motion_(motion),
      limbs_(limbsOf(motion.skeleton)),
      held_(garment.held)
  {
    const auto free = [&](int v) { return !std::binary_search(held_.begin(), held_.end(), v); };
    constexpr double kAlong[] = {0.125, 0.25, 0.375, 0.5, 0.625, 0.75, 0.875};
    for (int v = 0; v < garment.mesh.vertices.cols(); ++v)
      if (free(v))
        samples_.push_back({{v, v, v}, {1, 0, 0}});
    const MeshTopology topology = meshTopology(garment.mesh);
    for (Eigen::Index e = 0; e < topology.edges.cols(); ++e)
      for (const double s : kAlong)
        if (const int from = topology.edges(0, e), to = topology.edges(1, e); free(from) && free(to))
          samples_.push_back({{from, to, to}, {1 - s, s, 0}});
    for (const auto& f : garment.mesh.triangles.colwise())
      if (free(f[0]) && free(f[1]) && free(f[2]))
        samples_.push_back({f, Vector3d::Constant(1.0 / 3)});
  }
  /// Of free vertices, points of edges between two of them, and middles of faces between three.
  double room(const Matrix3Xd& x, double time) const
  {
    const std::vector<Axis> axes = axesAt(time);
    double least = kFar;
    for (const Sample& s : samples_)
      least = std::min(
          least,
          roomOf(s.share[0] * x.col(s.face[0]) + s.share[1] * x.col(s.face[1]) + s.share[2] * x.col(s.face[2]), axes));
    return least;
  }
  /// Of the held vertices.
  double heldRoom(const Matrix3Xd& x, double time) const
  {
    const std::vector<Axis> axes = axesAt(time);
    double least = kFar;
    for (const int v : held_)
      least = std::min(least, roomOf(x.col(v), axes));
    return least;
  }

private:
  struct Sample
  {
    Eigen::Vector3i face;
    Vector3d share;
  };
  struct Axis
  {
    Vector3d from, along;
    double radius;
  };
  std::vector<Axis> axesAt(double time) const
  {
    const std::array<Pose, kParts> poses = motion_.poses(time);
    std::vector<Axis> axes;
    for (const Limb& limb : limbs_)
    {
      const Vector3d from = poses[limb.part] * limb.from, to = poses[limb.part] * limb.to;
      axes.push_back({from, to - from, limb.radius});
    }
    return axes;
  }
  static double roomOf(const Vector3d& p, const std::vector<Axis>& axes)
  {
    double least = kFar;
    for (const Axis& a : axes)
    {
      const double s = std::clamp((p - a.from).dot(a.along) / a.along.squaredNorm(), 0.0, 1.0);
      least = std::min(least, (p - a.from - s * a.along).norm() - a.radius - 0.5 * kClothThickness);
    }
    return least;
  }

  const FigureMotion& motion_;
  std::vector<Limb> limbs_;
  std::vector<int> held_;
  std::vector<Sample> samples_;
};

struct GarmentRun
{
  std::string garment;
  int fineness = 1;        ///< see skirt()
  double seconds = kFar;   ///< simulated at most
};

struct GarmentResult
{
  int steps = 0;
  bool finished = false;
  long iterations = 0, most_iterations = 0, cut_steps = 0, penetrations = 0;
  double cpu_seconds = 0.0;
  double room = kFar, held_room = kFar;   ///< [m]
  std::string refusal;                    ///< empty: none
  std::string first;                      ///< the first pair that is wrong; empty: none

  double realTimeFactor() const { return kGarmentStep * steps / cpu_seconds; }
};

/// Steps a garment until the end of the motion, until a step is refused, or until it has taken kMostCpuSeconds. All
/// pairs are checked every `every` steps.
GarmentResult wear(Simulation& scene, const LimbCheck& limbs, int steps, int every)
{
  GarmentResult result;
  MixedCheck pairs(scene, MixedCheck::Faces::without_held_corners);
  for (int& k = result.steps; k < steps && result.cpu_seconds < kMostCpuSeconds; ++k)
  {
    const double start = threadSeconds();
    const StepReport report = scene.step(scene.defaultInputs());
    result.cpu_seconds += threadSeconds() - start;
    result.iterations += report.iterations;
    result.most_iterations = std::max(result.most_iterations, report.iterations);
    result.cut_steps += report.cut_steps;
    if (!report.ok)
    {
      result.refusal = report.message;
      break;
    }
    const Matrix3Xd& x = scene.state().cloths[0].x;
    const double time = kGarmentStep * (k + 1), room = limbs.room(x, time);
    result.penetrations += !(room >= -kRoundingOfRoom);
    result.room = std::min(result.room, room);
    result.held_room = std::min(result.held_room, limbs.heldRoom(x, time));
    if ((k + 1) % every != 0)
      continue;
    const MixedFindings found = pairs.check(scene);
    result.penetrations += found.penetrations + found.thickness_violations;
    result.room = std::min(result.room, found.least_room);
    if (result.first.empty() && !found.first.empty())
      result.first = "at " + std::to_string(time) + " s " + found.first;
  }
  result.finished = result.steps == steps || !result.refusal.empty();
  return result;
}

GarmentResult runGarment(StudyContext& context, const FigureMotion& given, const GarmentRun& run)
{
  const FigureMotion motion = withLead(given);
  const Garment garment = garmentOf(run.garment, motion.skeleton, run.fineness);
  Simulation scene(sceneOf(motion, garment));
  scene.setThreads(1);
  const LimbCheck limbs(motion, garment);
  if (limbs.room(scene.state().cloths[0].x, 0.0) < scene.config().contact.gap)
    throw std::logic_error("garments: the " + run.garment + " does not fit the figure.");
  const int steps = static_cast<int>(std::min(run.seconds, motion.duration) / kGarmentStep);
  const GarmentResult result = wear(scene, limbs, steps, 2 * run.fineness * run.fineness);
  context.row()
      .set("motion", motion.name)
      .set("garment", run.garment)
      .set("vertices", static_cast<double>(garment.mesh.vertices.cols()))
      .set("seconds", kGarmentStep * result.steps)
      .set("of_seconds", kGarmentStep * steps)
      .set("iterations_per_step", static_cast<double>(result.iterations) / std::max(1, result.steps))
      .set("iterations_max", result.most_iterations)
      .set("cut_steps", result.cut_steps)
      .set("refused", result.refusal.empty() ? 0 : 1)
      .set("penetrations", result.penetrations)
      .set("least_room_um", 1e6 * result.room)
      .set("held_room_mm", 1e3 * result.held_room)
      .set("limbs_apart_mm", 1e3 * limbsApart(motion))
      .set("real_time_factor", result.realTimeFactor())
      .set("refusal", result.refusal.empty() ? "-" : result.refusal);
  if (!result.first.empty())
    context.note(motion.name + ", " + run.garment + ", " + result.first);
  return result;
}

}   // namespace

void runGarments(StudyContext& context)
{
  useOneBlasThread();
  const char* const folder = std::getenv("SLENDER_MOTIONS");
  std::vector<FigureMotion> motions = folder ? recordedMotions(folder) : packageMotions();
  std::vector<GarmentRun> runs;
  for (const int fineness : context.quick() ? std::vector<int>{1} : std::vector<int>{1, 2, 4})
    for (const char* garment : {"cape", "skirt", "poncho"})
      runs.push_back({garment, fineness, context.quick() ? kQuickSeconds : fineness == 4 ? kFinestSeconds : kFar});
  if (context.quick())
    motions.resize(1);
  const int total = static_cast<int>(motions.size() * runs.size());
  const std::vector<int> cases = context.cases(total);
  int done = 0, refused = 0, unfinished = 0, penetrations = 0;
  double room = kFar;
  double factor[5] = {kFar, kFar, kFar, kFar, kFar};   // by fineness
  for (const int number : cases)
  {
    if (number >= total)
      throw std::invalid_argument("garments: cases are numbered from 0 to " + std::to_string(total - 1) + ".");
    const GarmentRun& run = runs[number / motions.size()];
    const FigureMotion& motion = motions[number % motions.size()];
    context.progress(done++, static_cast<int>(cases.size()), motion.name + ", " + run.garment);
    const GarmentResult result = runGarment(context, motion, run);
    refused += !result.refusal.empty();
    unfinished += !result.finished;
    penetrations += result.penetrations;
    room = std::min(room, result.room);
    factor[run.fineness] = std::min(factor[run.fineness], result.realTimeFactor());
  }
  context.metric("refused", refused);
  context.metric("unfinished", unfinished);
  context.metric("penetrations", penetrations);
  context.metric("least_room_um", 1e6 * room);
  context.metric("real_time_factor_400", factor[1]);
  if (!context.quick())
    context.metric("real_time_factor_1600", factor[2]);
  context.note(
      "steps of 5 ms; least_room: of free faces from limbs, and of all pairs of faces, beyond their thickness; "
      "held_room: of the held vertices from limbs; limbs_apart: least distance of limbs that are no neighbours, less "
      "than the thickness leaves no room for cloth between them; real_time_factor: simulated time over CPU time on one "
      "thread, without the checks.");
}

const StudyRegistration kGarmentsRegistration{
    "garments", "a cape, a skirt and a poncho on a figure that walks, dances and turns over backwards", runGarments,
    true};

}   // namespace slender::study
