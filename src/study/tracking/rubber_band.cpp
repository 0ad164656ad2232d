// A rubber band that shall look like a guide curve (thesis figure 6.3): it is held at anchor points, or segments
// between them have the guide's centres of mass.
#include <algorithm>
#include <cmath>
#include <stdexcept>

#include <Eigen/Cholesky>
#include <Eigen/Geometry>

#include "study/framework/scene_cases.h"
#include "slender_sim/tracking/weak_constraints.h"
#include "slender_sim/world/world.h"
#include "study/framework/cpu_clock.h"

namespace slender::study {

using Eigen::Matrix3Xd;
using Eigen::Vector3d;

namespace {

constexpr int kAnchors = 12;
constexpr double kBandStep = 1e-3, kSettle = 1.0, kPulse = 0.02;   // [s]

struct Band
{
  std::shared_ptr<const RodModel> model;
  Matrix3Xd guide;   ///< nodes of the guide shape, as many as the band's
  std::shared_ptr<const WeakConstraints> segments;
  Eigen::MatrixXd functions;   ///< segments x nodes
  MassMatrix mass;             ///< of hat functions along the band [m]
  double density = 0;          ///< [kg/m]
};

Band makeBand(int per_segment)
{
  Band band;
  const int nodes = kAnchors * per_segment;
  Matrix3Xd circle(3, nodes);
  band.guide.resize(3, nodes);
  for (int i = 0; i < nodes; ++i)
  {
    const double angle = 2 * M_PI * i / nodes,
                 radius = 0.1 * (1.0 + 0.22 * std::cos(3 * angle) + 0.1 * std::sin(2 * angle));
    // shorter than the guide: a band under tension
    circle.col(i) << 0.09 * std::cos(angle), 0.09 * std::sin(angle), 0;
    band.guide.col(i) << radius * std::cos(angle), radius * std::sin(angle), 0;
  }
  constexpr double kModulus = 2e5, kRadius = 1.5e-3;
  const double area = M_PI * kRadius * kRadius, inertia = 0.25 * area * kRadius * kRadius;
  band.density = 1100 * area;
  const RodSection section{kRadius,
                           kRadius,
                           band.density,
                           kModulus * area,
                           kModulus * inertia * Eigen::Matrix2d::Identity(),
                           kModulus * inertia / 1.5};
  RodModel model = buildRod("band", circle, true, std::vector<RodSection>(static_cast<std::size_t>(nodes), section),
                            Vector3d::UnitZ(), false);
  model.mass_damping = 5.0;
  model.stiffness_damping = 1e-3;
  band.model = std::make_shared<const RodModel>(std::move(model));

  TestFunctions functions;   // 1 along a segment, shared at the anchors
  std::vector<Eigen::Triplet<double>> entries;
  for (int r = 0; r < kAnchors; ++r)
  {
    functions.names.push_back("segment " + std::to_string(r));
    for (int k = 0; k <= per_segment; ++k)
      entries.emplace_back(r, (r * per_segment + k) % nodes, k == 0 || k == per_segment ? 0.5 : 1.0);
  }
  functions.tracked.resize(kAnchors, nodes);
  functions.tracked.setFromTriplets(entries.begin(), entries.end());
  functions.guide = functions.tracked;
  band.functions = functions.tracked;
  band.mass = hatMassMatrix(circle, true);
  band.segments = std::make_shared<const WeakConstraints>(functions, hatMassMatrix(band.guide, true), band.mass);
  return band;
}

/// Kinetic energy [J] of what velocities have beside their L2 projection onto the segments' functions.
double fineKinetic(const Band& band, const Matrix3Xd& v)
{
  const Eigen::MatrixXd moments = band.functions * (band.mass * v.transpose());
  const Eigen::MatrixXd gram = band.functions * (band.mass * band.functions.transpose());
  const Eigen::MatrixXd fine = v.transpose() - band.functions.transpose() * gram.ldlt().solve(moments);
  return 0.5 * band.density * (fine.transpose() * (band.mass * fine)).trace();
}

struct BandRun
{
  Matrix3Xd still, moved;   ///< before the acceleration; when it ends, seen from the guide
  /// mean from the acceleration on [J]; greatest distance of a node from where it was on the guide [m]
  double kinetic = 0, change = 0;
  double error = 0, ms = 0;   ///< greatest distance of a segment's centre from the guide's [m]; CPU time per step
};

enum class BandMotion
{
  shift,
  turn
};

/// Settles on the guide, which is then accelerated sideways, or about its middle (at 0.1 m from there), for kPulse and
/// goes on at that speed.
BandRun followedGuide(const Band& band, bool averages, BandMotion motion, double acceleration)
{
  WorldModel model;
  model.time.integrator = Integrator::implicit_euler;
  model.time.step = kBandStep;
  model.rods.emplace_back().model = band.model;
  WorldState world_state;
  WorldInputs world_inputs;
  RodState& state = world_state.rods.emplace_back(makeRodState(*band.model, band.guide, Vector3d::UnitZ()));
  RodInputs& inputs = world_inputs.rods.emplace_back();
  const int nodes = band.model->nodes(), per_segment = nodes / kAnchors;
  inputs.gravity.setZero();
  if (averages)
  {
    FunctionSet set;
    set.constraints = band.segments;
    model.rods[0].tracked.sets = std::make_shared<const std::vector<FunctionSet>>(1, set);
    world_state.rod_guides.resize(1);
    world_inputs.guides.resize(1);
  }
  else
    for (int r = 0; r < kAnchors; ++r)
    {
      state.grasps.push_back(makeGrasp(*band.model, state, r * per_segment, r * per_segment, false));
      inputs.grasps.push_back({state.grasps.back().X_WG, std::nullopt});
    }
  World world(model, world_state);
  const int settle = static_cast<int>(std::lround(kSettle / kBandStep)),
            pulse = static_cast<int>(std::lround(kPulse / kBandStep)), after = 4 * pulse;
  BandRun result;
  double seconds = 0;
  for (int k = 1; k <= settle + pulse + after; ++k)
  {
    const double t = (k - settle) * kBandStep, accelerated = std::clamp(t, 0.0, kPulse);
    const double far = acceleration * (0.5 * accelerated * accelerated + accelerated * std::max(0.0, t - kPulse));
    const bool turns = motion == BandMotion::turn;
    const Vector3d way = turns ? Vector3d(0, 0, 0) : Vector3d(far, 0, 0),
                   spin(0, 0, turns ? acceleration * accelerated / 0.1 : 0.0);
    const Eigen::Matrix3d turn = Eigen::AngleAxisd(turns ? far / 0.1 : 0.0, Vector3d::UnitZ()).toRotationMatrix();
    const Matrix3Xd guide = (turn * band.guide).colwise() + way;
    for (int r = 0; r < static_cast<int>(inputs.grasps.size()); ++r)
      inputs.grasps[r].X_WG.position = guide.col(r * per_segment);
    if (averages)
      world_inputs.guides[0] = guide;
    const double begin = threadSeconds();
    const StepReport report = world.step(world_state, world_inputs);
    seconds += threadSeconds() - begin;
    if (!report.ok)
      throw std::runtime_error(report.message);
    if (averages)
      result.error = std::max(result.error, world.trackingError({ObjectRef::rod, 0}, world_state).met);
    if (k == settle)
      result.still = state.x;
    if (k == settle + pulse)
      result.moved = turn.transpose() * (state.x.colwise() - way);
    if (k > settle)
    {
      Matrix3Xd v = state.v;
      for (Eigen::Index i = 0; i < v.cols(); ++i)
        v.col(i) -= spin.cross(Vector3d(state.x.col(i)));
      result.kinetic += fineKinetic(band, v) / (pulse + after);
      const Matrix3Xd carried = (turn * result.still).colwise() + way;
      result.change = std::max(result.change, std::sqrt((state.x - carried).colwise().squaredNorm().maxCoeff()));
    }
  }
  result.ms = 1e3 * seconds / (settle + pulse + after);
  return result;
}

}   // namespace

void runRubberBand(StudyContext& context)
{
  const Band band = makeBand(context.quick() ? 8 : 16);
  Plot& picture =
      addPicture(context, "rubber_band", "A rubber band and its guide: still (above), accelerated to the right (below)",
                 "[m]", "[m]");
  Plot& changes = context.plot("rubber_band_change", "How far the band leaves its shape",
                               "acceleration of the guide [m/s^2]", "greatest distance [m]");
  const Camera camera{{0, 0, -1}, {0, 1, 0}};
  struct Case
  {
    BandMotion motion;
    double acceleration;
  };
  std::vector<Case> cases{{BandMotion::shift, 10}, {BandMotion::shift, 1000}, {BandMotion::turn, 100}};
  if (!context.quick())
    cases.insert(cases.end(), {{BandMotion::shift, 100},
                               {BandMotion::shift, 300},
                               {BandMotion::shift, 3000},
                               {BandMotion::turn, 10},
                               {BandMotion::turn, 30},
                               {BandMotion::turn, 300}});
  int done = 0;
  for (const auto& [motion, acceleration] : cases)
  {
    const bool shifts = motion == BandMotion::shift;
    double kinetic[2];
    for (const bool averages : {false, true})
    {
      context.progress(done++, 2 * static_cast<int>(cases.size()), averages ? "averages" : "points");
      const BandRun r = followedGuide(band, averages, motion, acceleration);
      const std::string label = averages ? "averages" : "points";
      kinetic[averages] = r.kinetic;
      context.row()
          .set("motion", shifts ? "shift" : "turn")
          .set("acceleration_m_per_s2", acceleration)
          .set("constraints", label)
          .set("nodes", band.model->nodes())
          .set("count", kAnchors)
          .set("rms_from_guide_still_m",
               std::sqrt((r.still - band.guide).squaredNorm() / static_cast<double>(r.still.cols())))
          .set("greatest_change_m", r.change)
          .set("fine_kinetic_mJ", 1e3 * r.kinetic)
          .set("average_error_m", r.error)
          .set("ms_per_step", r.ms);
      Series& change = changes.at(label + (shifts ? ", shift" : ", turn"));
      change.points = true;
      change.x.push_back(acceleration);
      change.y.push_back(std::max(r.change, 1e-16));
      if (shifts && acceleration == 1000)
        for (const bool moved : {false, true})
        {
          const Vector3d shift(averages ? 0.32 : 0.0, moved ? -0.3 : 0.0, 0);
          draw(picture, "guide", band.guide, true, camera, shift);
          draw(picture, label, moved ? r.moved : r.still, true, camera, shift);
          for (int a = 0; a < kAnchors && !averages; ++a)
          {
            const Vector3d at = band.guide.col(a * band.model->nodes() / kAnchors) + shift;
            Series& anchors = picture.at("anchors");
            anchors.points = true;
            anchors.x.push_back(at.x());
            anchors.y.push_back(at.y());
          }
        }
    }
    if (acceleration == (shifts ? 1000 : 100))
      context.metric(shifts ? "tugging_ratio_shift" : "tugging_ratio", kinetic[0] / kinetic[1]);
  }
  context.note(
      "the guide is accelerated for 20 ms, sideways or in a turn (acceleration at 0.1 m from its middle); "
      "fine_kinetic: of "
      "velocities seen from the guide, less their L2 projection onto the segments' functions, mean from then on for "
      "100 ms; tugging_ratio: points over averages, "
      "turned at 100 m/s^2; shifted, averages change nothing");
}

const StudyRegistration kRubberBandRegistration{
    "rubber_band",
    "an elastic curve that follows an accelerated guide (thesis figure 6.3): averaged against pointwise constraints",
    runRubberBand};

}   // namespace slender::study
