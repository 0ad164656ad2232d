// How exactly tracked cloths have the averages of their guides after every step.
#include <cmath>
#include <stdexcept>

#include <Eigen/Geometry>

#include "slender_sim/world/world.h"
#include "slender_sim/study/study.h"
#include "tracking_cases.h"

namespace slender::study {

namespace {

constexpr double kExactStep = 0.01;   // [s]
constexpr double kBound = 1e-10;      // |c| over the area of a test function and the guide's size

struct Scene
{
  std::string what;
  TrackedCase cloth;
  bool full_newton = false, contact = false;
  double thickness = 4e-3;   ///< with contact
  std::vector<Obstacle> solids = {};
  std::vector<Pose> poses = {};
};

std::vector<Scene> scenes(bool quick)
{
  const std::vector<TrackedCase> cases = thesisCases();
  const TrackedCase &sheet = cases[0], &box = cases[1], &bag = cases[2], &figure = cases[3];
  std::vector<Scene> all;
  all.push_back({"box", box});
  all.push_back({"box, full Newton", box, true});
  all.push_back({"breathing surface", breathingSurface()});
  all.push_back({"breathing surface, a guide of a fourth of the vertices", breathingSurface(30, 1)});
  Scene wind{"sheet in wind of 15 m/s", sheet};
  wind.cloth.wind = Eigen::Vector3d(-15, 3, 2);
  auto blown = std::make_shared<ClothModel>(*sheet.model);
  blown->aerodynamics.drag = 1.2;
  blown->aerodynamics.lift = 1.0;
  wind.cloth.model = blown;
  all.push_back(wind);
  Scene jumps{"sheet whose guide jumps", sheet};
  jumps.cloth.motion = [rest = sheet.guide.vertices](double t) {
    // by its own size and more, turned each time
    const int jump = static_cast<int>(std::floor(t / (10 * kExactStep) + 1e-6));
    const Eigen::Vector3d to(3 * std::sin(7.0 * jump), 2 * (1 - std::cos(5.0 * jump)), 2 * std::sin(3.0 * jump));
    return Eigen::Matrix3Xd(
        (Eigen::AngleAxisd(2.0 * jump, Eigen::Vector3d(1, 2, 3).normalized()).toRotationMatrix() * rest).colwise() +
        to);
  };
  all.push_back(jumps);
  Scene ball{"sheet lowered over a ball", sheet};
  ball.contact = true;
  ball.solids.emplace_back();
  ball.solids[0].shape = Sphere{0.25};
  ball.poses.emplace_back();
  ball.poses[0].position = Eigen::Vector3d(0.7, 0.5, -0.3);
  ball.cloth.motion = [rest = sheet.guide.vertices](double t) {
    return Eigen::Matrix3Xd(rest.colwise() - Eigen::Vector3d(0, 0, 0.15 * (1 - std::cos(std::min(4 * t, 3.14159)))));
  };
  all.push_back(ball);
  Scene crumpled{"bag whose rim is pressed together", bag};
  crumpled.contact = true;
  // its rim is pressed to 15 % of its depth; to 5 % collisions forbid some averages (4.6e-5)
  crumpled.cloth.motion = [rest = bag.guide.vertices](double t) {
    Eigen::Matrix3Xd x = rest;
    const double middle = 0.5 * (rest.row(0).minCoeff() + rest.row(0).maxCoeff());
    for (Eigen::Index i = 0; i < x.cols(); ++i)
      x(0, i) = middle + (x(0, i) - middle) * (1 - 0.85 * std::min(1.0, 4 * t) * rest(2, i) / rest.row(2).maxCoeff());
    return x;
  };
  all.push_back(crumpled);
  if (!quick)
    all.push_back({"figure in headwind", figure});
  return all;
}

struct Result
{
  double worst = 0, force = 0;   ///< over the size; largest force of an average [N]
  long contacts = 0;
  int steps = 0, cuts = 0;
  bool finite = true;
};

Result followExactly(StudyContext& context, const Scene& scene, int steps)
{
  const TrackedCase& c = scene.cloth;
  ClothOptions options;
  options.one_newton_step = !scene.full_newton;
  ContactProperties contact;
  contact.method = ContactMethod::impulses;
  contact.thickness = scene.thickness;
  contact.self = contact.solids = scene.contact;
  const auto sets = std::make_shared<std::vector<FunctionSet>>(1);
  sets->front().constraints = c.constraints;
  WorldModel model;
  model.cloths.push_back({c.model, options, contact, {}, {sets}});
  model.obstacles = scene.solids;
  model.time.step = kExactStep;
  WorldState state;
  state.cloths.push_back(c.start());
  state.cloth_guides.resize(1);
  state.obstacles = scene.poses;
  state.obstacle_velocities.resize(scene.poses.size());
  WorldInputs inputs;
  for (const Pose& pose : scene.poses)
    inputs.obstacles.push_back({pose, {}});
  inputs.cloths.resize(1);
  inputs.cloths[0].gravity = c.gravity;
  inputs.cloths[0].wind = c.wind;
  inputs.guides.resize(1);
  World world(model, state);
  const Eigen::Matrix3Xd& rest = c.guide.vertices;
  const double size = (rest.rowwise().maxCoeff() - rest.rowwise().minCoeff()).norm();
  Result result;
  for (int k = 1; k <= steps; ++k)
  {
    context.progress(k, steps, scene.what);
    inputs.guides[0] = c.motion(k * kExactStep);
    const StepReport report = world.step(state, inputs);
    if (!report.ok)
      throw std::runtime_error("tracking_exactness: " + scene.what + ", step " + std::to_string(k) + ": " +
                               report.message);
    const Eigen::Matrix3Xd averages = c.constraints->averages(inputs.guides[0]);
    result.worst = std::max(result.worst, c.constraints->error(averages, state.cloths[0].x) / size);
    result.force = std::max(result.force, state.cloth_guides[0].forces.colwise().norm().maxCoeff());
    result.contacts += report.repulsions + report.impulses;
    result.cuts += report.cut_steps;
    result.finite = result.finite && state.cloths[0].x.allFinite() && state.cloths[0].v.allFinite();
    ++result.steps;
  }
  return result;
}

}   // namespace

void runTrackingExactness(StudyContext& context)
{
  int not_finite = 0;
  for (const Scene& scene : scenes(context.quick()))
  {
    const Result r = followExactly(context, scene, context.quick() ? 40 : 120);
    not_finite += !r.finite;
    context.row()
        .set("scene", scene.what)
        .set("vertices", scene.cloth.model->vertices())
        .set("constraints", scene.cloth.constraints->count())
        .set("steps", r.steps)
        .set("cut_steps", r.cuts)
        .set("contacts", static_cast<double>(r.contacts))
        .set("largest_force_N", r.force)
        .check(r.finite ? r.worst : std::nan(""), 0.0, kBound, "thesis 6.3.2: averages are met exactly");
  }
  context.metric("nan_count", not_finite);
  context.note("measured: greatest |c| after any step, over the area of its test function and the guide's size.");
}

const StudyRegistration kTrackingExactnessRegistration{
    "tracking_exactness",
    "averages of tracked cloths against their guides' after every step, with wind, jumps, contact",
    runTrackingExactness};

}   // namespace slender::study
