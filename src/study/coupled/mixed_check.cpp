#include "mixed_check.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "slender_sim/contact/contact_surface.h"
#include "slender_sim/contact/distance.h"
#include "slender_sim/contact/intersection.h"
#include "slender_sim/contact/solids.h"
#include "solid_overlap.h"

namespace slender::study {

namespace {

using Eigen::Vector3d;
constexpr double kInfinity = std::numeric_limits<double>::infinity();
constexpr double kRounding = 1e-9;   // [m] of distances

double segmentTriangle(const Vector3d& p, const Vector3d& q, const Vector3d& a, const Vector3d& b, const Vector3d& c)
{
  if (segmentMeetsTriangle(p, q, a, b, c))
    return 0.0;
  return std::min({pointTriangleDistance(p, a, b, c), pointTriangleDistance(q, a, b, c), segmentDistance(p, q, a, b),
                   segmentDistance(p, q, b, c), segmentDistance(p, q, c, a)});
}

double triangleTriangle(const Vector3d (&a)[3], const Vector3d (&b)[3])
{
  double least = kInfinity;
  for (int k = 0; k < 3; ++k)
    least = std::min({least, segmentTriangle(a[k], a[(k + 1) % 3], b[0], b[1], b[2]),
                      segmentTriangle(b[k], b[(k + 1) % 3], a[0], a[1], a[2])});
  return least;
}

double pointBox(const Box& box, const Vector3d& p)
{
  const Vector3d out = p.cwiseAbs() - 0.5 * box.size;
  return out.maxCoeff() > 0.0 ? out.cwiseMax(0.0).norm() : out.maxCoeff();
}

double pointCylinder(const Cylinder& cylinder, const Vector3d& p)
{
  const double side = p.head<2>().norm() - cylinder.radius, end = std::abs(p.z()) - 0.5 * cylinder.length;
  return std::max(side, end) > 0.0 ? std::hypot(std::max(side, 0.0), std::max(end, 0.0)) : std::max(side, end);
}

/// Minimum of a convex function over [0, 1].
template <class F>
double leastAlong(const F& f)
{
  double low = 0.0, high = 1.0;
  for (int k = 0; k < 70; ++k)
  {
    const double s = low + 0.382 * (high - low), t = high - 0.382 * (high - low);
    (f(s) < f(t) ? high : low) = f(s) < f(t) ? t : s;
  }
  return std::min({f(0.0), f(1.0), f(0.5 * (low + high))});
}

/// Distance of a triangle (or, with two equal corners, a segment) in the frame of a shape from it; negative inside.
double shapeDistance(const Shape& shape, const Vector3d (&v)[3])
{
  if (std::holds_alternative<Plane>(shape))
    return std::min({v[0].z(), v[1].z(), v[2].z()});
  if (const auto* sphere = std::get_if<Sphere>(&shape))
    return pointTriangleDistance(Vector3d::Zero(), v[0], v[1], v[2]) - sphere->radius;
  if (const auto* capsule = std::get_if<Capsule>(&shape))
    return segmentTriangle({0, 0, -0.5 * capsule->length}, {0, 0, 0.5 * capsule->length}, v[0], v[1], v[2]) -
           capsule->radius;
  if (const auto* mesh = std::get_if<std::shared_ptr<const TriangleMesh>>(&shape))
  {
    double least = isInsideMesh(**mesh, v[0]) ? -1.0 : kInfinity;
    for (Eigen::Index i = 0; i < (*mesh)->triangles.cols(); ++i)
    {
      const Vector3d face[3] = {(*mesh)->vertices.col((*mesh)->triangles(0, i)),
                                (*mesh)->vertices.col((*mesh)->triangles(1, i)),
                                (*mesh)->vertices.col((*mesh)->triangles(2, i))};
      least = std::min(
          least, v[1] == v[2] ? segmentTriangle(v[0], v[1], face[0], face[1], face[2]) : triangleTriangle(v, face));
    }
    return least;
  }
  const auto* cylinder = std::get_if<Cylinder>(&shape);
  const auto distance = [&](const Vector3d& p) {
    return cylinder ? pointCylinder(*cylinder, p) : pointBox(std::get<Box>(shape), p);
  };
  return leastAlong([&](double s) {
    return leastAlong([&](double t) { return distance(v[0] + s * ((1.0 - t) * (v[1] - v[0]) + t * (v[2] - v[0]))); });
  });
}

/// Gauss's linking integral of two segments, exact [Klenin & Langowski 2000]. Where they pass through each other it
/// jumps by 1.
double linkingIntegral(const Vector3d& a, const Vector3d& b, const Vector3d& c, const Vector3d& d)
{
  const Vector3d r13 = c - a, r14 = d - a, r23 = c - b, r24 = d - b;
  const Vector3d n[4] = {r13.cross(r14), r14.cross(r24), r24.cross(r23), r23.cross(r13)};
  double area = 0.0;
  for (int k = 0; k < 4; ++k)
  {
    const double size = n[k].norm() * n[(k + 1) % 4].norm();
    if (size > 0.0)
      area += std::asin(std::clamp(n[k].dot(n[(k + 1) % 4]) / size, -1.0, 1.0));
  }
  return std::copysign(area, (d - c).cross(b - a).dot(r13)) / (4.0 * M_PI);
}

/// The linking integrals of all pairs of two neighbouring segments each: a place where curves pass through each other
/// is well inside one of them. Sums over whole curves could cancel, e.g. where a needle passes through a ring twice.
std::vector<double> linkingIntegrals(const Eigen::Matrix3Xd& x, bool x_closed, const Eigen::Matrix3Xd& y, bool y_closed)
{
  const Eigen::Index n = x.cols() - !x_closed, m = y.cols() - !y_closed;
  Eigen::MatrixXd of(n, m);
  for (Eigen::Index i = 0; i < n; ++i)
    for (Eigen::Index j = 0; j < m; ++j)
      of(i, j) = linkingIntegral(x.col(i), x.col((i + 1) % x.cols()), y.col(j), y.col((j + 1) % y.cols()));
  std::vector<double> sums;
  for (Eigen::Index i = 0; i < std::max<Eigen::Index>(1, n - !x_closed); ++i)
    for (Eigen::Index j = 0; j < std::max<Eigen::Index>(1, m - !y_closed); ++j)
    {
      const Eigen::Index next_i = (i + 1) % n, next_j = (j + 1) % m;
      sums.push_back(of(i, j) + (n > 1 ? of(next_i, j) : 0.0) + (m > 1 ? of(i, next_j) : 0.0) +
                     (n > 1 && m > 1 ? of(next_i, next_j) : 0.0));
    }
  return sums;
}

}   // namespace

MixedCheck::MixedCheck(const Simulation& scene, Faces against_solids)
{
  const SceneConfig& config = scene.config();
  gap_ = config.contact.gap;
  for (std::size_t r = 0; r < config.rods.size(); ++r)
  {
    const RodModel& model = scene.rodModel(static_cast<int>(r));
    std::vector<char> held(static_cast<std::size_t>(model.nodes()), 0);
    for (const GraspState& grasp : scene.state().rods[r].grasps)
      for (int i = grasp.first_node; grasp.active && i <= grasp.last_node; ++i)
        held[i] = against_solids == Faces::without_held_corners;
    double along = 0.0;
    for (int e = 0; e < model.edges(); ++e)
    {
      const double radius = std::max(model.radius_a[e], model.radius_b[e]);
      tubes_.push_back({static_cast<int>(r), e, (e + 1) % model.nodes(), radius, radius, along, model.rest_length[e],
                        !held[e] && !held[(e + 1) % model.nodes()]});
      along += model.rest_length[e];
    }
    curves_.emplace_back();
    curves_.back().closed = model.closed;
    curves_.back().curve_length = along;
    names_.push_back("rod " + model.name);
    rest_.emplace_back();
  }
  for (std::size_t c = 0; c < config.cloths.size(); ++c)
  {
    const ClothModel& model = scene.clothModel(static_cast<int>(c));
    const std::vector<int>& pins = scene.state().cloths[c].pins;
    for (Eigen::Index t = 0; t < model.rest.triangles.cols(); ++t)
    {
      const Eigen::Vector3i corner = model.rest.triangles.col(t);
      const bool held =
          std::any_of(corner.begin(), corner.end(), [&](int v) { return std::count(pins.begin(), pins.end(), v) > 0; });
      faces_.push_back({static_cast<int>(names_.size()),
                        {corner[0], corner[1], corner[2]},
                        0.5 * config.cloths[c].contact->thickness,
                        against_solids == Faces::all || !held});
    }
    curves_.emplace_back();
    names_.push_back("cloth " + model.name);
    rest_.push_back(model.rest.vertices);
  }
  for (const ObstacleConfig& obstacle : config.obstacles)
    solids_.push_back({"obstacle " + obstacle.name, obstacle.shape, {}, false});
  for (const BodyConfig& body : config.bodies)
    solids_.push_back({"body " + body.name, *body.shape, {}, !body.motion});
  rods_ = config.rods.size();
  objects_ = names_.size();
  rod_tubes_ = tubes_.size();
  take(scene);
  MixedFindings ignored;
  checkSides(ignored);
}

void MixedCheck::take(const Simulation& scene)
{
  x_.clear();
  for (const RodState& rod : scene.state().rods)
    x_.push_back(rod.x);
  for (const ClothState& cloth : scene.state().cloths)
    x_.push_back(cloth.x);
  takeThreads(scene);
  const std::size_t obstacles = scene.config().obstacles.size();
  for (std::size_t k = 0; k < solids_.size(); ++k)
    solids_[k].pose = k < obstacles
                          ? scene.state().obstacles[k]
                          : scene.state().bodies[k - obstacles].X_WB * scene.config().bodies[k - obstacles].X_BS;
}

/// The radii of a thread change with its edges when a step ends. The check therefore asks for a share of them only.
void MixedCheck::takeThreads(const Simulation& scene)
{
  constexpr double kFirm = 0.5;
  names_.resize(objects_);
  curves_.resize(objects_);
  tubes_.resize(rod_tubes_);
  for (std::size_t k = 0; k < scene.state().threads.size(); ++k)
    for (const ThreadState& thread : scene.state().threads[k].threads)
    {
      const int object = static_cast<int>(names_.size());
      curves_.emplace_back();
      names_.push_back("thread " + scene.config().threads[k].name);
      x_.emplace_back(3, thread.nodes());
      for (int i = 0; i < thread.nodes(); ++i)
        x_.back().col(i) = thread.x[i];
      double along = 0.0;
      for (int e = 0; e < thread.edges(); ++e)
      {
        const double length = thread.edge(e).norm();
        const bool held = (e == 0 && thread.ends[0].held) || (e + 1 == thread.edges() && thread.ends[1].held);
        tubes_.push_back({object, e, e + 1, kFirm * thread.radius(e), thread.radius(e), along, length, !held});
        along += length;
      }
    }
}

MixedFindings MixedCheck::check(const Simulation& scene)
{
  take(scene);
  MixedFindings out;
  out.least_room = kInfinity;
  checkTubes(out);
  checkFaces(out);
  checkSolids(out);
  checkSolidPairs(out);
  checkSides(out);
  return out;
}

void MixedCheck::note(double room, const std::string& a, const std::string& b, MixedFindings& out) const
{
  out.least_room = std::min(out.least_room, room);
  if (room >= -kRounding)
    return;
  ++out.thickness_violations;
  if (out.first.empty())
    out.first = a + " and " + b + " by " + std::to_string(-1e3 * room) + " mm";
}

void MixedCheck::checkTubes(MixedFindings& out) const
{
  for (std::size_t i = 0; i < tubes_.size(); ++i)
    for (std::size_t j = i + 1; j < tubes_.size(); ++j)
    {
      const Tube &s = tubes_[i], &t = tubes_[j];
      // Two pieces of one curve keep the share of their thickness that contact promises for their distance along the
      // curve. Pieces that have a point in common keep none, and pieces that are far apart along it keep all.
      const double share = s.object == t.object
                               ? contactShare({0, 0, s.whole, 0, s.start, s.length},
                                              {0, 0, t.whole, 0, t.start, t.length}, curves_[s.object], gap_)
                               : 1.0;
      if (share == 0.0)
        continue;
      const Eigen::Matrix3Xd &x = x_[s.object], &y = x_[t.object];
      const double reach = s.radius + t.radius + 0.51 * (s.length + t.length) + 1e-2;
      if ((0.5 * (x.col(s.a) + x.col(s.b)) - 0.5 * (y.col(t.a) + y.col(t.b))).norm() > 2.0 * reach)
        continue;
      note(segmentDistance(x.col(s.a), x.col(s.b), y.col(t.a), y.col(t.b)) - share * (s.radius + t.radius),
           names_[s.object], names_[t.object], out);
    }
}

/// Of two faces of one cloth: the share of the thickness that they keep, because they are near each other at rest.
double MixedCheck::restScale(const Face& f, const Face& g) const
{
  const Eigen::Matrix3Xd& rest = rest_[f.object];
  Vector3d a[3], b[3];
  for (int k = 0; k < 3; ++k)
  {
    a[k] = rest.col(f.corner[k]);
    b[k] = rest.col(g.corner[k]);
  }
  const double reach = f.half_thickness + g.half_thickness + gap_;
  return std::min(1.0, 0.5 * triangleTriangle(a, b) / reach);
}

void MixedCheck::checkFaces(MixedFindings& out) const
{
  for (std::size_t i = 0; i < faces_.size(); ++i)
  {
    const Face& f = faces_[i];
    Vector3d a[3];
    for (int k = 0; k < 3; ++k)
      a[k] = x_[f.object].col(f.corner[k]);
    const Vector3d low = a[0].cwiseMin(a[1]).cwiseMin(a[2]), high = a[0].cwiseMax(a[1]).cwiseMax(a[2]);
    const auto far = [&](const Vector3d& p, const Vector3d& q, const Vector3d& r, double thickness) {
      return ((p.cwiseMin(q).cwiseMin(r).array() - thickness) > high.array()).any() ||
             ((p.cwiseMax(q).cwiseMax(r).array() + thickness) < low.array()).any();
    };
    for (std::size_t j = i + 1; j < faces_.size(); ++j)
    {
      const Face& g = faces_[j];
      const double thickness = f.half_thickness + g.half_thickness;
      Vector3d b[3];
      bool shared = false;
      for (int k = 0; k < 3; ++k)
      {
        b[k] = x_[g.object].col(g.corner[k]);
        for (int l = 0; l < 3; ++l)
          shared = shared || (f.object == g.object && f.corner[k] == g.corner[l]);
      }
      if (shared || far(b[0], b[1], b[2], thickness))
        continue;
      const double scale = f.object == g.object ? restScale(f, g) : 1.0;
      if (scale > 1e-6)
        note(triangleTriangle(a, b) - scale * thickness, names_[f.object], names_[g.object], out);
    }
    for (const Tube& t : tubes_)
    {
      const Vector3d p = x_[t.object].col(t.a), q = x_[t.object].col(t.b);
      if (!far(p, q, q, t.radius + f.half_thickness))
        note(segmentTriangle(p, q, a[0], a[1], a[2]) - t.radius - f.half_thickness, names_[t.object], names_[f.object],
             out);
    }
  }
}

void MixedCheck::checkSolids(MixedFindings& out) const
{
  constexpr double kFar = 0.01;   // [m] of room: pieces with more are not measured
  for (const Solid& solid : solids_)
  {
    const Pose inverse = solid.pose.inverse();
    const double reach = boundingRadius(solid.shape) + kFar;
    const auto look = [&](int object, const int(&corner)[3], double thickness, bool free) {
      if (!solid.simulated && !free)
        return;
      Vector3d v[3];
      for (int k = 0; k < 3; ++k)
        v[k] = inverse * Vector3d(x_[object].col(corner[k]));
      if (pointTriangleDistance(Vector3d::Zero(), v[0], v[1], v[2]) < reach + thickness)
        note(shapeDistance(solid.shape, v) - thickness, names_[object], solid.name, out);
    };
    for (const Tube& t : tubes_)
      look(t.object, {t.a, t.b, t.b}, t.radius, t.free);
    for (const Face& f : faces_)
      look(f.object, f.corner, f.half_thickness, f.free);
  }
}

void MixedCheck::checkSolidPairs(MixedFindings& out) const
{
  for (std::size_t i = 0; i < solids_.size(); ++i)
    for (std::size_t j = i + 1; j < solids_.size(); ++j)
    {
      const Solid &a = solids_[i], &b = solids_[j];
      if ((!a.simulated && !b.simulated) || !overlap(a.shape, a.pose, b.shape, b.pose))
        continue;
      ++out.penetrations;
      if (out.first.empty())
        out.first = a.name + " and " + b.name + " overlap";
    }
}

/// Rods on the other side of a cloth or of a rod than before, and balls on the other side of a cloth: the solid angle
/// of the cloth, or the linking integral, changes its sign while it is large.
void MixedCheck::checkSides(MixedFindings& out)
{
  std::vector<std::vector<double>> now;
  std::vector<std::string> pairs;
  for (std::size_t i = 0; i < rods_; ++i)
    for (std::size_t j = i + 1; j < rods_; ++j)
    {
      now.push_back(linkingIntegrals(x_[i], curves_[i].closed, x_[j], curves_[j].closed));
      for (double& integral : now.back())
        integral *= 4.0;   // large: 1, of at most 2 where curves are straight
      pairs.push_back(names_[i] + " and " + names_[j]);
    }
  for (std::size_t c = rods_; c < objects_; ++c)
  {
    Eigen::Matrix3Xi triangles(3, 0);
    for (const Face& f : faces_)
      if (f.object == static_cast<int>(c))
      {
        triangles.conservativeResize(3, triangles.cols() + 1);
        triangles.rightCols(1) << f.corner[0], f.corner[1], f.corner[2];
      }
    const auto add = [&](const Eigen::Matrix3Xd& points, const std::string& name) {
      now.emplace_back();
      for (Eigen::Index i = 0; i < points.cols(); ++i)
        now.back().push_back(solidAngle(x_[c], triangles, points.col(i)) / M_PI);   // large: 1, of at most 2
      pairs.push_back(name + " and " + names_[c]);
    };
    for (std::size_t i = 0; i < rods_; ++i)
      add(x_[i], names_[i]);
    for (const Solid& solid : solids_)
      if (solid.simulated)
        add(solid.pose.position, solid.name);
  }
  for (std::size_t k = 0; k < sides_.size(); ++k)
    for (std::size_t i = 0; i < now[k].size(); ++i)
      if (now[k][i] * sides_[k][i] < 0.0 && std::min(std::abs(now[k][i]), std::abs(sides_[k][i])) > 1.0)
      {
        ++out.penetrations;
        if (out.first.empty())
          out.first = pairs[k] + " passed through each other";
      }
  sides_.swap(now);
}

}   // namespace slender::study
