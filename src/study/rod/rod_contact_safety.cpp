// Random scenes in which rods are pulled, dropped and whipped against each other and against obstacles. After every
// step an independent check of all pairs looks for penetrations.
#include <cmath>
#include <functional>
#include <limits>
#include <map>
#include <random>

#include "contact_cases.h"
#include "slender_sim/geometry/rotation.h"
#include "slender_sim/study/study.h"

namespace slender::study {

namespace {

using Eigen::Vector3d;
using Random = std::mt19937;

double uniform(Random& random, double from, double to)
{
  // the same on every machine
  return from + (to - from) * (static_cast<double>(random()) / static_cast<double>(Random::max()));
}
double logUniform(Random& random, double from, double to)
{
  return std::exp(uniform(random, std::log(from), std::log(to)));
}
Vector3d direction(Random& random)
{
  for (;;)
  {
    const Vector3d v(uniform(random, -1, 1), uniform(random, -1, 1), uniform(random, -1, 1));
    if (v.norm() > 0.1 && v.norm() < 1)
      return v.normalized();
  }
}

struct Scene
{
  GroupSetup group;
  double step = 1e-3;
  int steps = 100;
  std::function<void(GroupSetup&, double time)> drive = [](GroupSetup&, double) {};
};

/// An overhand knot pulled at both ends.
Scene knot(Random& random)
{
  Scene s;
  const double size = 0.05, radius = size * uniform(random, 0.03, 0.07);
  RodSetup rod = rodThrough(overhandKnot(size, uniform(random, 0.05, 0.2)), false, radius, logUniform(random, 1e5, 1e7),
                            1100, 60 + random() % 60);
  const int last = rod.model->nodes() - 1;
  rod.hold(0, 0, true);
  rod.hold(last, last, true);
  addTouching(s.group, rod, uniform(random, 0, 0.6));
  s.steps = 300;
  const double speed = uniform(random, 0.3, 1.0), turn = uniform(random, -6, 6);
  const double room = 0.8 * (rod.model->rest_length.sum() - (rod.state.x.col(last) - rod.state.x.col(0)).norm());
  s.drive = [=](GroupSetup& g, double time) {
    const double way = std::min(speed * time, 0.5 * room);
    for (int k = 0; k < 2; ++k)
    {
      g.inputs.rods[0].grasps[k].X_WG = rod.state.grasps[k].X_WG;
      g.inputs.rods[0].grasps[k].X_WG.position.x() += (k ? 1 : -1) * way;
    }
    Pose& end = g.inputs.rods[0].grasps[1].X_WG;
    end.orientation = (Eigen::AngleAxisd(turn * time, Vector3d::UnitX()) * end.orientation).normalized();
  };
  return s;
}

/// Ropes and rings dropped on a floor and on each other.
Scene heap(Random& random)
{
  Scene s;
  const int count = 2 + random() % 4;
  addObstacle(s.group, Plane{}, {}, 0.4);
  if (random() % 2)
    addObstacle(s.group, Sphere{0.03}, {Vector3d(0.02, 0, 0.03), Eigen::Quaterniond::Identity()}, 0.2);
  for (int r = 0; r < count; ++r)
  {
    const double radius = uniform(random, 0.002, 0.005), height = 0.08 + 0.025 * r, angle = uniform(random, 0, M_PI);
    const Vector3d middle(uniform(random, -0.03, 0.03), uniform(random, -0.03, 0.03), height),
        along(std::cos(angle), std::sin(angle), 0);
    const bool closed = random() % 3 == 0;
    Eigen::Matrix3Xd points(3, closed ? 60 : 2);
    if (closed)
      for (int i = 0; i < 60; ++i)
        points.col(i) = middle + 0.06 * Vector3d(std::cos(2 * M_PI * i / 60), std::sin(2 * M_PI * i / 60), 0);
    else
      points << middle - 0.15 * along, middle + 0.15 * along;
    addTouching(s.group, rodThrough(points, closed, radius, logUniform(random, 1e5, 1e8), 1100, 24 + random() % 30),
                uniform(random, 0, 0.8));
  }
  s.group.setGravity(Vector3d(0, 0, -9.81));
  s.step = 2e-3;
  s.steps = 150;
  return s;
}

/// A rope thrown at up to 50 m/s at a thin bar.
Scene whip(Random& random)
{
  Scene s;
  const double radius = logUniform(random, 0.0005, 0.003), length = 0.5;
  Eigen::Matrix3Xd points(3, 2);
  points << Vector3d(0, 0, 0), Vector3d(length, 0, 0);
  RodSetup rod = rodThrough(points, false, radius, logUniform(random, 1e6, 1e9), 1100, 25 + random() % 50);
  const double speed = uniform(random, 10, 50);
  const bool held = random() % 2;
  for (int i = 0; i < rod.model->nodes(); ++i)   // swung about its first end, or thrown whole
    rod.state.v.col(i) = Vector3d(0, 0, -speed * (held ? rod.state.x(0, i) / length : 1.0));
  if (held)
    rod.hold(0, 0, false);
  addTouching(s.group, rod, uniform(random, 0, 0.5));
  const Vector3d across = (Vector3d::UnitY() + 0.5 * direction(random)).normalized();
  const Pose bar{Vector3d(uniform(random, 0.15, 0.4), 0, -uniform(random, 0.02, 0.1)),
                 rotationBetween(Vector3d::UnitZ(), across)};
  addObstacle(s.group, Capsule{logUniform(random, 0.0005, 0.005), 0.4}, bar, 0.2);
  s.steps = 40;
  return s;
}

double smallestRadius(const GroupSetup& g)
{
  double least = std::numeric_limits<double>::infinity();
  for (const auto& rod : g.model.rods)
    least = std::min(least, rod.model->radius_a.minCoeff());
  return least;
}

}   // namespace

void runRodContactSafety(StudyContext& context)
{
  using Maker = Scene (*)(Random&);
  const std::pair<const char*, Maker> kinds[] = {{"knot", knot}, {"heap", heap}, {"whip", whip}};
  const int total = context.quick() ? 30 : 1000;
  struct Tally
  {
    int scenes = 0, steps = 0, penetrations = 0, refused = 0, cuts = 0, not_finite = 0;
    double least = std::numeric_limits<double>::infinity();
  };
  std::map<std::string, Tally> tallies;
  std::map<std::string, int> reasons;
  for (int n = 0; n < total; ++n)
  {
    const auto& [kind, make] = kinds[n % 3];
    context.progress(n, total, kind);
    Random random(1000 + n);
    Scene scene = make(random);
    GroupSetup& g = scene.group;
    g.model.contact.gap = 0.1 * smallestRadius(g);
    TimeConfig time = timeConfig(Integrator::implicit_euler, scene.step);
    World world = g.world(time);
    Tally& tally = tallies[kind];
    ++tally.scenes;
    for (int k = 1; k <= scene.steps; ++k)
    {
      scene.drive(g, k * scene.step);
      const StepReport report = world.step(g.state, g.inputs);
      if (!report.ok)
      {
        ++tally.refused;
        ++reasons[toString(report.failure)];
        context.row().set("kind", kind).set("seed", 1000 + n).set("refused_at_step", k).set("reason", report.message);
        break;
      }
      ++tally.steps;
      tally.cuts += report.cut_steps > 0;
      for (const RodState& rod : g.state.rods)
        tally.not_finite += !isFinite(rod);
      const double clearance = bruteForceClearance(g);
      tally.least = std::min(tally.least, clearance);
      tally.penetrations += !(clearance > 0);
    }
  }
  int penetrations = 0, refused = 0, steps = 0, not_finite = 0;
  for (const auto& [kind, t] : tallies)
  {
    context.row()
        .set("kind", kind)
        .set("scenes", t.scenes)
        .set("steps", t.steps)
        .set("penetrations", t.penetrations)
        .set("refused_scenes", t.refused)
        .set("cut_steps", t.cuts)
        .set("least_clearance_um", 1e6 * t.least);
    penetrations += t.penetrations;
    refused += t.refused;
    steps += t.steps;
    not_finite += t.not_finite;
  }
  context.metric("scenes", total);
  context.metric("steps", steps);
  context.metric("penetrations", penetrations);
  context.metric("refused_scenes", refused);
  context.metric("nan_count", not_finite);
  context.note(
      "penetrations: steps after which two surfaces overlap, found by all pairs; refused: scenes that ended with a "
      "step that said why.");
}

const StudyRegistration kRodContactSafetyRegistration{
    "rod_contact_safety",
    "1,000 random knots, heaps and whips: an independent check finds no penetration after any step",
    runRodContactSafety};

}   // namespace slender::study
