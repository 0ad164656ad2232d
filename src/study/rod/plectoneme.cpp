// A twisted rod with slack winds about itself: the ideal ply, one or several plectonemes, and their merging
// (thesis 4.7.2, Fig. 4.5).
#include <algorithm>
#include <cmath>
#include <cstdio>
#include <stdexcept>
#include <string>
#include <vector>

#include "study/framework/scene_cases.h"
#include "slender_sim/contact/distance.h"
#include "slender_sim/geometry/curves.h"
#include "slender_sim/geometry/rotation.h"

namespace slender::study {
namespace {

/// A stretch of rod wound about another stretch of itself.
struct Ply
{
  double turns = 0;    ///< of one strand about the other
  double length = 0;   ///< of rod, both strands [m]
  /// of the middle half: between strands and axis [rad]; half the strands' distance [m]
  double angle = 0, radius = 0;
};

/// All plies with at least half a turn, along the rod: edges that touch, by where the middle between them lies along
/// the rod.
std::vector<Ply> pliesOf(const Eigen::Matrix3Xd& x, double radius)
{
  const int edges = static_cast<int>(x.cols()) - 1;
  const double edge = (x.col(1) - x.col(0)).norm();
  const int apart = static_cast<int>(std::ceil(3 * M_PI * radius / edge));
  struct Touch
  {
    double from, to, cosine;
    Eigen::Vector3d across;
  };
  std::vector<std::vector<Touch>> groups;
  const auto middle = [](const Touch& t) { return 0.5 * (t.from + t.to); };
  for (int i = 0; i < edges; ++i)
  {
    const Eigen::Vector3d at = 0.5 * (x.col(i) + x.col(i + 1)), along = (x.col(i + 1) - x.col(i)).normalized();
    Touch nearest{i + 0.5, 0, 0, Eigen::Vector3d::UnitX() * 2.3 * radius};
    for (int j = i + apart; j < edges; ++j)
    {
      const double s = closestOnSegment(at, x.col(j), x.col(j + 1));
      const Eigen::Vector3d other = x.col(j + 1) - x.col(j), across = x.col(j) + s * other - at;
      if (across.norm() < nearest.across.norm())
        nearest = {i + 0.5, j + s, -along.dot(other.normalized()), across};
    }
    if (nearest.to == 0)
      continue;
    const auto mine = std::find_if(groups.begin(), groups.end(),
                                   [&](const auto& g) { return std::abs(middle(g.back()) - middle(nearest)) < 6; });
    (mine == groups.end() ? groups.emplace_back() : *mine).push_back(nearest);
  }
  std::vector<Ply> plies;
  for (const std::vector<Touch>& g : groups)
  {
    Ply p;
    p.length = 2 * edge * static_cast<double>(g.size());
    for (std::size_t k = 1; k < g.size(); ++k)
      p.turns += std::atan2(g[k - 1].across.cross(g[k].across).norm(), g[k - 1].across.dot(g[k].across)) / (2 * M_PI);
    const std::size_t from = g.size() / 4, to = g.size() - from;
    for (std::size_t k = from; k < to; ++k)
    {
      p.angle += 0.5 * std::acos(std::clamp(g[k].cosine, -1.0, 1.0)) / static_cast<double>(to - from);
      p.radius += 0.5 * g[k].across.norm() / static_cast<double>(to - from);
    }
    if (p.turns >= 0.5)
      plies.push_back(p);
  }
  return plies;
}

/// The ideal ply (plectoneme.csv): two tubes of radius a in contact wound at an angle to their axis, on long straight
/// tails; B = 1.
// M a / B
double idealMoment(double angle) { return 2 * std::pow(std::sin(angle), 3) * std::cos(angle) / std::cos(2 * angle); }
// T a^2 / B
double idealTension(double angle) { return std::pow(std::sin(angle), 4) * (0.5 + 1 / std::cos(2 * angle)); }

/// A rod of length 1 (B = 1, nu = 0.3, no friction, no weight) between clamps that come closer by `slack` while one
/// turns.
void ply(StudyContext& context, int edges, bool with_picture, double radius, double slack,
         const std::vector<int>& looks, Plot& moments, Plot& tensions, Plot& picture)
{
  RodSetup rod = rodThrough(straightCurve({0, 0, 0}, {1, 0, 0}, edges), false, radius, 1.0, 1.0, edges);
  auto model = std::make_shared<RodModel>(*rod.model);
  model->bend_modulus.colwise() = Eigen::Vector3d(1, 0, 1);
  model->twist_modulus.setConstant(1 / 1.3);
  model->stretch_modulus.setConstant(1e6);
  model->mass.setConstant(0.3 / edges);   // slow enough for Newton, fast enough to follow the clamps
  rod.model = model;
  rod.hold(0, 0, true);
  rod.hold(edges, edges, true);
  rod.inputs.forces.setZero(3, edges + 1);
  for (int i = 0; i <= edges; ++i)
    rod.inputs.forces(1, i) = 3.0 / edges * std::sin(M_PI * i / edges);   // which side it buckles to
  GroupSetup g;
  addTouching(g, rod, 0.0);
  g.setGravity(Eigen::Vector3d::Zero());
  g.model.contact.gap = 0.05 * radius;
  TimeConfig time = timeConfig(Integrator::implicit_euler, 0.02);
  time.newton.max_iterations = 60;   // contacts slide along the whole ply
  World world = g.world(time);
  RodInputs& inputs = g.inputs.rods[0];
  const Pose start = inputs.grasps[1].X_WG;
  constexpr int kMoves = 32;   // per turn
  for (int k = 1; k <= kMoves * looks.back(); ++k)
  {
    const double turns = static_cast<double>(k) / kMoves;
    inputs.grasps[1].X_WG.position = start.position - Eigen::Vector3d(slack * std::min(1.0, turns / 4), 0, 0);
    inputs.grasps[1].X_WG.orientation = fromRotationVector(Eigen::Vector3d(2 * M_PI * turns, 0, 0)) * start.orientation;
    inputs.forces *= 0.95;
    require(world.step(g.state, g.inputs), "ply");
    const auto look = std::find_if(looks.begin(), looks.end(), [&](int at) { return at * kMoves == k; });
    if (look == looks.end())
      continue;
    context.progress(k, kMoves * looks.back(),
                     "ply of " + std::to_string(edges) + " edges, turned " + std::to_string(*look));
    inputs.forces.setZero();
    require(world.solveEquilibrium(g.state, g.inputs), "ply at rest");
    const std::vector<Ply> plies = pliesOf(g.state.rods[0].x, radius);
    if (plies.empty())
      throw std::runtime_error("ply: the rod has not wound up");
    const Ply& p = plies.front();
    const Wrench end = world.rodWrenches(0)[1];
    const double moment = -end.torque.x() * p.radius, tension = -end.force.x() * p.radius * p.radius;
    const auto row = [&]() -> Row& {
      return context.row()
          .set("case", "ply")
          .set("n", edges)
          .set("applied_turns", *look)
          .set("plies", static_cast<double>(plies.size()))
          .set("ply_turns", p.turns)
          .set("ply_length", p.length)
          .set("angle_deg", p.angle * 180 / M_PI);
    };
    row()
        .set("quantity", "M a / B")
        .check(moment, idealMoment(p.angle), 0.02 * idealMoment(p.angle), "plectoneme.csv at the angle measured");
    row()
        .set("quantity", "T a^2 / B")
        .check(tension, idealTension(p.angle), 0.02 * idealTension(p.angle), "plectoneme.csv at the angle measured");
    const std::string label = "n = " + std::to_string(edges);
    for (Plot* plot : {&moments, &tensions})
    {
      plot->at(label).points = true;
      plot->at(label).x.push_back(p.angle * 180 / M_PI);
      plot->at(label).y.push_back(plot == &moments ? moment : tension);
    }
    if (!with_picture)
      continue;
    Eigen::Vector3d farthest = Eigen::Vector3d::Zero();   // which way the ply points: any way will do
    for (const auto& at : g.state.rods[0].x.colwise())
      if (at.tail<2>().norm() > farthest.tail<2>().norm())
        farthest = {0, at.y(), at.z()};
    farthest.normalize();
    draw(picture, "turned " + std::to_string(*look), g.state.rods[0].x, false,
         {farthest.cross(Eigen::Vector3d::UnitX()), farthest},
         Eigen::Vector3d((look - looks.begin()) * (1.1 - slack), 0, 0));
  }
}

/// The rod of the scene, twisted all at once by 100 rad and let go.
void letGo(StudyContext& context, Plot& picture)
{
  struct Case
  {
    const char* name;
    const char* metric;
    const char* gravity;
    double friction, duration;
    std::vector<double> looks;
  };
  // down, strongly down, and down with a little to the side
  std::vector<Case> cases = {{"as it hangs", "plies_hanging", "[0, 0, -9.81]", 0.1, 1.0, {1.0}},
                             {"five times the weight", "plies_heavy", "[0, 0, -50]", 0.1, 1.0, {1.0}}};
  if (!context.quick())
    cases.push_back({"tilted, smooth", "plies_tilted", "[1, 0, -9.75]", 0.0, 2.6, {0.6, 1.4, 2.6}});
  int drawn = 0;
  for (const Case& c : cases)
  {
    Simulation scene = packageScene(
        "plectoneme", {"rods.0.grasps.right.motion=fixed", "rods.0.initial_twist=100",
                       std::string("gravity=") + c.gravity, "rods.0.contact.friction=" + std::to_string(c.friction)});
    std::vector<Ply> plies;
    for (const double at : c.looks)
    {
      while (scene.state().time < at - 1e-9)
      {
        context.progress(static_cast<int>(1e3 * scene.state().time), static_cast<int>(1e3 * c.duration), c.name);
        require(scene.step(scene.defaultInputs()), c.name);
      }
      std::vector<Ply> now = pliesOf(scene.state().rods[0].x, scene.rodModel(0).radius_a[0]);
      Row& row = context.row();
      row.set("case", c.name)
          .set("n", scene.rodModel(0).edges())
          .set("time", at)
          .set("plies", static_cast<double>(now.size()));
      for (std::size_t k = 0; k < now.size(); ++k)
        row.set("turns_of_ply_" + std::to_string(k + 1), now[k].turns);
      plies = std::move(now);
      char label[64];
      std::snprintf(label, sizeof label, "%s, %.1f s", c.name, at);
      draw(picture, label, scene.state().rods[0].x, false, {}, {0.8 * (drawn % 2), 0, -0.4 * (drawn / 2)});
      ++drawn;
    }
    context.metric(c.metric, static_cast<double>(plies.size()));
  }
}

}   // namespace

void runPlectoneme(StudyContext& context)
{
  Plot& moments = context.plot("plectoneme_moment", "Ply of a twisted rod: twist moment",
                               "angle of the strands to the ply's axis [deg]", "M a / B");
  Plot& tensions = context.plot("plectoneme_tension", "Ply of a twisted rod: tension of the tails",
                                "angle of the strands to the ply's axis [deg]", "T a^2 / B");
  for (Plot* plot : {&moments, &tensions})
  {
    plot->log_x = plot->log_y = false;
    Series& ideal = plot->at("ideal");
    for (double degrees = 10; degrees <= 26; degrees += 0.5)
    {
      ideal.x.push_back(degrees);
      ideal.y.push_back(plot == &moments ? idealMoment(degrees * M_PI / 180) : idealTension(degrees * M_PI / 180));
    }
  }
  moments.markers = tensions.markers = false;
  Plot& plies =
      addPicture(context, "plectoneme", "A rod of length 1 between clamps, one of which is turned", "x [L]", "y [L]");
  if (context.quick())
    ply(context, 120, true, 0.008, 0.6, {6}, moments, tensions, plies);
  else
    for (const int edges : {300, 450})
      ply(context, edges, edges == 300, 0.004, 0.5, {6, 8, 10, 12, 14}, moments, tensions, plies);
  Plot& hanging = addPicture(context, "plectoneme_hanging",
                             "A hanging rod twisted at once by 100 rad (scene plectoneme)", "x [m]", "z [m]");
  letGo(context, hanging);
  context.note(
      "The ideal law leaves out the end loop and the bending where the tails join; a is half the measured distance of "
      "the strands.");
}

const StudyRegistration kPlectonemeRegistration{
    "plectoneme", "a twisted rod with slack winds about itself: twist moment and tension against the ideal ply",
    runPlectoneme};

}   // namespace slender::study
