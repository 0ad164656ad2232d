// Collisions of cloth: pairs by themselves, then scenes after every step of which an exact check of all pairs looks for
// intersections.
#include <cmath>
#include <functional>
#include <limits>
#include <string>

#include "collision_pairs.h"
#include "slender_sim/geometry/mesh_shapes.h"
#include "slender_sim/geometry/rotation.h"
#include "study/framework/cpu_clock.h"
#include "world/impulse_cloths.h"

namespace slender::study {

namespace {

using Eigen::Quaterniond;
using Eigen::Vector3d;

struct Scene
{
  std::string name;
  WorldModel model;
  WorldState state;
  WorldInputs inputs;
  double step = 5e-3;
  int steps = 200;
  /// sets the inputs of the step that ends at a time
  std::function<void(Scene&, double time)> drive = [](Scene&, double) {};
};

TriangleMesh sheetMesh(int columns, int rows, double width, double height)   // about the origin
{
  TriangleMesh mesh = gridMesh(width, height, columns, rows, GridPattern::alternating);
  mesh.vertices.colwise() -= Vector3d(0.5 * width, 0.5 * height, 0.0);
  return mesh;
}

void addCloth(Scene& s, const TriangleMesh& mesh, const Pose& pose, double friction, double thickness = 2e-3,
              double bending = 2e-6)
{
  ClothModel cloth =
      buildCloth("sheet " + std::to_string(s.model.cloths.size()), mesh, 0.2, isotropicMembrane(2e6, 0.3, 5e-4));
  cloth.bending_modulus = bending;
  cloth.stiffness_damping = 1e-3;
  Eigen::Matrix3Xd x(3, mesh.vertices.cols());
  for (Eigen::Index i = 0; i < x.cols(); ++i)
    x.col(i) = pose * Vector3d(mesh.vertices.col(i));
  ContactProperties contact;
  contact.thickness = thickness;
  contact.friction = friction;
  contact.method = ContactMethod::impulses;
  ClothOptions options;
  options.one_newton_step = true;
  s.model.cloths.push_back({std::make_shared<ClothModel>(cloth), options, contact, {}, {}});
  s.state.cloths.push_back(makeClothState(cloth, x));
  s.inputs.cloths.emplace_back();
}

void addSolid(Scene& s, const Shape& shape, const Pose& pose = {})
{
  s.model.obstacles.push_back({shape, -1.0, {}});
  s.state.obstacles.push_back(pose);
  s.inputs.obstacles.push_back({pose, {}});
}

void pin(Scene& s, const std::vector<int>& vertices)
{
  pinVertices(s.state.cloths[0], vertices);
  Eigen::Matrix3Xd& pins = s.inputs.cloths[0].pins;
  pins.resize(3, static_cast<Eigen::Index>(s.state.cloths[0].pins.size()));
  for (std::size_t k = 0; k < s.state.cloths[0].pins.size(); ++k)
    pins.col(static_cast<Eigen::Index>(k)) = s.state.cloths[0].x.col(s.state.cloths[0].pins[k]);
}

std::shared_ptr<TriangleMesh> torus(double major, double minor, int nu, int nv)
{
  auto mesh = std::make_shared<TriangleMesh>();
  mesh->vertices.resize(3, nu * nv);
  mesh->triangles.resize(3, 2 * nu * nv);
  for (int i = 0; i < nu; ++i)
    for (int j = 0; j < nv; ++j)
    {
      const double u = 2 * M_PI * i / nu, v = 2 * M_PI * j / nv, r = major + minor * std::cos(v);
      mesh->vertices.col(i * nv + j) << r * std::cos(u), r * std::sin(u), minor * std::sin(v);
      const int a = i * nv + j, b = (i + 1) % nu * nv + j, c = (i + 1) % nu * nv + (j + 1) % nv,
                d = i * nv + (j + 1) % nv;
      mesh->triangles.col(2 * a) << a, b, c;
      mesh->triangles.col(2 * a + 1) << a, c, d;
    }
  return mesh;
}

Scene drape(const std::string& name, int n, const Shape& shape, const Pose& pose)
{
  Scene s;
  s.name = "drape over " + name;
  addCloth(s, sheetMesh(n, n, 0.6, 0.6), {{0, 0, 0.152}, Quaterniond::Identity()}, 0.3);
  addSolid(s, shape, pose);
  return s;
}

Scene needle(int n)
{
  const auto cone = std::make_shared<TriangleMesh>();   // with a tip of 3.8 degrees
  cone->vertices.resize(3, 5);
  cone->vertices << 0, 0.01, 0, -0.01, 0,   //
      0, 0, 0.01, 0, -0.01,                 //
      0.15, -0.15, -0.15, -0.15, -0.15;
  cone->triangles.resize(3, 6);
  cone->triangles << 0, 0, 0, 0, 1, 1,   //
      1, 2, 3, 4, 3, 4,                  //
      2, 3, 4, 1, 2, 3;
  return drape("a needle", n, cone, {{0.003, 0.002, 0}, Quaterniond::Identity()});
}

Scene heap(int n)
{
  Scene s;
  s.name = "three sheets in a heap";
  for (int k = 0; k < 3; ++k)
  {
    const Quaterniond turn(Eigen::AngleAxisd(0.6 * k, Vector3d::UnitZ()) *
                           Eigen::AngleAxisd(0.9 - 0.3 * k, Vector3d::UnitX()));
    addCloth(s, sheetMesh(n, n, 0.4, 0.4), {{0.03 * k, -0.02 * k, 0.25 + 0.2 * k}, turn}, 0.3);
  }
  addSolid(s, Plane{});
  return s;
}

/// config/scenes/twisted_cloth.yaml
Scene twisted()
{
  Scene s;
  s.name = "twisted four turns";
  constexpr int kColumns = 96, kRows = 5;
  addCloth(s, sheetMesh(kColumns, kRows, 1.2, 0.06), {}, 0.2, 1e-3, 1e-5);
  std::vector<int> ends;
  for (int j = 0; j <= kRows; ++j)
  {
    ends.push_back(j * (kColumns + 1));
    ends.push_back(j * (kColumns + 1) + kColumns);
  }
  pin(s, ends);
  s.inputs.cloths[0].gravity.setZero();
  s.steps = 800;
  const Eigen::Matrix3Xd rest = s.inputs.cloths[0].pins;
  const double duration = s.steps * s.step;
  s.drive = [rest, duration](Scene& scene, double time) {
    const double part = time / duration, nearer = std::max(0.02 * part, 0.04 * part - 0.005);   // as it becomes shorter
    for (Eigen::Index k = 0; k < rest.cols(); ++k)
    {
      const double side = rest(0, k) < 0 ? -1.0 : 1.0;
      const Eigen::AngleAxisd turn(side * 4.0 * M_PI * part, Vector3d::UnitX());
      scene.inputs.cloths[0].pins.col(k) = turn * Vector3d(rest.col(k)) - side * Vector3d(nearer, 0, 0);
    }
  };
  return s;
}

/// config/scenes/pulled_through_ring.yaml
Scene throughRing(int n)
{
  Scene s;
  s.name = "pulled through a ring";
  addCloth(s, sheetMesh(n, n, 0.3, 0.3), {{0, 0, 0.0328}, Quaterniond::Identity()}, 0.05, 1e-3, 1e-4);
  addSolid(s, torus(0.12, 0.0288, 32, 16));
  std::vector<int> held;
  for (int i = 0; i < s.state.cloths[0].x.cols(); ++i)
    if (s.state.cloths[0].x.col(i).head<2>().norm() < 0.03)
      held.push_back(i);
  pin(s, held);
  const Eigen::Matrix3Xd rest = s.inputs.cloths[0].pins;
  s.steps = 600;
  s.drive = [rest](Scene& scene, double time) {
    scene.inputs.cloths[0].pins = rest.colwise() - Vector3d(0, 0, 0.12 * time);
  };
  return s;
}

/// Largest stretch of an edge.
double stretch(const Scene& s)
{
  double most = 0.0;
  for (std::size_t k = 0; k < s.model.cloths.size(); ++k)
  {
    const Eigen::Matrix3Xd &x = s.state.cloths[k].x, &rest = s.model.cloths[k].model->rest.vertices;
    const auto& edges = s.model.cloths[k].model->topology.edges;
    for (Eigen::Index e = 0; e < edges.cols(); ++e)
      most = std::max(most, (x.col(edges(1, e)) - x.col(edges(0, e))).norm() /
                                    (rest.col(edges(1, e)) - rest.col(edges(0, e))).norm() -
                                1.0);
  }
  return most;
}

}   // namespace

void runClothCollisionSafety(StudyContext& context)
{
  const bool quick = context.quick();
  runCollisionPairs(context, quick ? 52'000 : 1'040'000);
  const int n = quick ? 16 : 40;
  // A world normalises the poses of its inputs. The box stands still only if that changes nothing.
  const Quaterniond on_corner = rotationBetween(Vector3d(1, 1, 1), Vector3d::UnitZ()).normalized();
  std::vector<Scene> scenes{drape("a sphere", n, Sphere{0.15}, {}),
                            drape("a box corner", n, Box{{0.17, 0.17, 0.17}}, {{0, 0, 0}, on_corner}),
                            needle(n),
                            heap(n),
                            twisted(),
                            throughRing(20)};   // coarser sheets cannot fold so closely
  std::size_t intersections = 0;
  int refused = 0, not_finite = 0;
  double worst_share = 0.0;
  for (Scene& s : scenes)
  {
    s.model.time.step = s.step;
    std::vector<ClothStepper> alone;
    std::vector<int> numbers;
    for (const auto& cloth : s.model.cloths)
    {
      alone.emplace_back(cloth.model, cloth.options);
      numbers.push_back(static_cast<int>(numbers.size()));
    }
    ImpulseCloths together(s.model, numbers);
    together.check(s.state);
    std::size_t found = 0;
    CollisionReport sum;
    double most_stretch = 0.0, seconds = 0.0, alone_seconds = 0.0, longest = 0.0;
    int cuts = 0, zone_steps = 0;
    const int steps = quick ? s.steps / 4 : s.steps;
    for (int k = 1; k <= steps; ++k)
    {
      context.progress(k, steps, s.name);
      s.drive(s, k * s.step);
      double start = threadSeconds();
      for (std::size_t c = 0; c < alone.size(); ++c)
      {
        ClothState copy = s.state.cloths[c];
        alone[c].step(copy, s.inputs.cloths[c], s.step);
      }
      alone_seconds += threadSeconds() - start;
      start = threadSeconds();
      StepReport report;
      together.load(s.state, s.inputs, report);
      report = *together.stepAlone();
      const double spent = threadSeconds() - start;
      if (!report.ok)
      {
        ++refused;
        context.note(s.name + ", step " + std::to_string(k) + " refused: " + report.message);
        break;
      }
      together.finish(s.state);   // no solid moves
      seconds += spent;
      longest = std::max(longest, spent);
      cuts += report.cut_steps;
      const CollisionReport& c = together.collisions();
      sum.repulsions += c.repulsions;
      sum.impulses += c.impulses;
      sum.zones += c.zones;
      sum.zone_points = std::max(sum.zone_points, c.zone_points);
      sum.rounds += c.rounds;
      zone_steps += c.zones > 0;
      for (const ClothState& cloth : s.state.cloths)
        not_finite += !cloth.x.allFinite() || !cloth.v.allFinite();
      found += together.intersections(s.state);
      most_stretch = std::max(most_stretch, stretch(s));
    }
    int triangles = 0;
    for (const auto& cloth : s.model.cloths)
      triangles += static_cast<int>(cloth.model->rest.triangles.cols());
    const double over = (seconds - alone_seconds) / alone_seconds;
    context.row()
        .set("part", "scene")
        .set("kind", s.name)
        .set("triangles", triangles)
        .set("steps", steps)
        .set("intersections", static_cast<double>(found))
        .set("largest_stretch", most_stretch)
        .set("ms_per_step", 1e3 * seconds / steps)
        .set("longest_ms", 1e3 * longest)
        .set("collisions_over_solve", over)
        .set("repulsions", static_cast<double>(sum.repulsions) / steps)
        .set("impulses", static_cast<double>(sum.impulses) / steps)
        .set("rounds", static_cast<double>(sum.rounds) / steps)
        .set("zone_steps", zone_steps)
        .set("largest_zone", sum.zone_points)
        .set("cuts", cuts);
    intersections += found;
    worst_share = std::max(worst_share, over);
  }
  context.metric("intersections", static_cast<double>(intersections));
  context.metric("refused", refused);
  context.metric("nan_count", not_finite);
  context.metric("collisions_over_solve_max", worst_share);
  context.note(
      "intersections: edges that meet a face, summed over all steps, by all pairs; collisions_over_solve: CPU time of "
      "a step less that of "
      "the cloths' own, over the latter.");
}

const StudyRegistration kClothCollisionSafetyRegistration{
    "cloth_collision_safety",
    "continuous tests of a million pairs, none missed; scenes in which cloth never passes through anything",
    runClothCollisionSafety};

}   // namespace slender::study
