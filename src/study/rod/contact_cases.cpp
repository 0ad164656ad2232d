#include "contact_cases.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "slender_sim/geometry/curves.h"

namespace slender::study {

int addTouching(GroupSetup& group, const RodSetup& rod, double friction)
{
  const int index = group.add(rod);
  group.model.rods[index].contact = ContactProperties{true, true, true, friction};
  return index;
}

int addObstacle(GroupSetup& group, const Shape& shape, const Pose& pose, double friction)
{
  group.model.obstacles.push_back({shape, friction, "obstacle"});
  group.state.obstacles.push_back(pose);
  group.state.obstacle_velocities.push_back({});
  group.inputs.obstacles.push_back({pose, std::nullopt});
  return static_cast<int>(group.state.obstacles.size()) - 1;
}

RodSetup rodThrough(const Eigen::Matrix3Xd& points, bool closed, double radius, double youngs_modulus, double density,
                    int edges)
{
  const Eigen::Matrix3Xd nodes = resampleCurve(points, closed, edges);
  const double area = M_PI * radius * radius, bend = youngs_modulus * 0.25 * area * radius * radius;
  const RodSection section{radius,    radius, density * area, youngs_modulus * area, bend * Eigen::Matrix2d::Identity(),
                           bend / 1.3};
  RodSetup rod;
  auto model = std::make_shared<RodModel>(
      buildRod("rod", nodes, closed, std::vector<RodSection>(edges, section), Eigen::Vector3d::Zero(), true));
  rod.state = makeRodState(*model, nodes, Eigen::Vector3d::Zero());
  rod.model = model;
  rod.inputs.gravity.setZero();
  return rod;
}

Eigen::Matrix3Xd overhandKnot(double size, double tail)
{
  // the polynomial trefoil (t^3 - 3t, t^4 - 4t^2, t^5 - 10t) between its outer turning points, and straight tails
  constexpr int kPoints = 400;
  constexpr double kEnd = 2.05;
  Eigen::Matrix3Xd x(3, kPoints + 3);
  for (int i = 0; i <= kPoints; ++i)
  {
    const double t = kEnd * (2.0 * i / kPoints - 1.0), t2 = t * t;
    x.col(i + 1) =
        size * Eigen::Vector3d(t * (t2 - 3.0) / 2.0, t2 * (t2 - 4.0) / 4.0 + 0.5, 0.12 * t * (t2 * t2 - 10.0));
  }
  const Eigen::Vector3d first = x.col(1), last = x.col(kPoints + 1);
  x.col(0) = first - tail * Eigen::Vector3d::UnitX();
  x.col(kPoints + 2) = last + tail * Eigen::Vector3d::UnitX();
  return x;
}

namespace {

using Eigen::Vector3d;

double segmentsApart(const Vector3d& a, const Vector3d& b, const Vector3d& c, const Vector3d& d)
{
  const Vector3d u = b - a, v = d - c;
  const auto onto = [](const Vector3d& p, const Vector3d& from, const Vector3d& along) {
    const double l2 = along.squaredNorm();
    return l2 > 0 ? std::clamp(along.dot(p - from) / l2, 0.0, 1.0) : 0.0;
  };
  // the distance is convex in (s, t): minimum over the edges of the square, and inside if the lines' common normal
  // meets both
  double best = std::numeric_limits<double>::infinity();
  for (double s : {0.0, 1.0})
    best = std::min(best, (a + s * u - c - onto(a + s * u, c, v) * v).norm());
  for (double t : {0.0, 1.0})
    best = std::min(best, (c + t * v - a - onto(c + t * v, a, u) * u).norm());
  const Vector3d n = u.cross(v);
  if (n.squaredNorm() > 1e-20 * u.squaredNorm() * v.squaredNorm())
  {
    const Vector3d w = c - a;
    const double s = w.cross(v).dot(n) / n.squaredNorm(), t = w.cross(u).dot(n) / n.squaredNorm();
    if (s >= 0 && s <= 1 && t >= 0 && t <= 1)
      best = std::min(best, std::abs(w.dot(n)) / n.norm());
  }
  return best;
}

double obstacleApart(const Shape& shape, const Pose& pose, const Vector3d& a, const Vector3d& b)
{
  const Pose to = pose.inverse();
  const Vector3d p = to * a, q = to * b;
  if (std::holds_alternative<Plane>(shape))
    return std::min(p.z(), q.z());
  if (const auto* sphere = std::get_if<Sphere>(&shape))
    return segmentsApart(p, q, Vector3d::Zero(), Vector3d::Zero()) - sphere->radius;
  if (const auto* capsule = std::get_if<Capsule>(&shape))
    return segmentsApart(p, q, {0, 0, -0.5 * capsule->length}, {0, 0, 0.5 * capsule->length}) - capsule->radius;
  return std::numeric_limits<double>::infinity();
}

}   // namespace

double bruteForceClearance(const GroupSetup& g)
{
  struct Piece
  {
    Vector3d a, b;
    double radius, from, to, whole;
    int rod;
    bool closed, self;
    double low, high;
  };
  std::vector<Piece> pieces;
  for (std::size_t r = 0; r < g.model.rods.size(); ++r)
  {
    const auto& touching = g.model.rods[r].contact;
    if (!touching)
      continue;
    const RodModel& m = *g.model.rods[r].model;
    const Eigen::Matrix3Xd& x = g.state.rods[r].x;
    double s = 0.0;
    for (int j = 0; j < m.edges(); ++j)
    {
      const Vector3d a = x.col(j), b = x.col((j + 1) % m.nodes());
      pieces.push_back({a, b, m.radius_a[j], s, s + m.rest_length[j], m.rest_length.sum(), static_cast<int>(r),
                        m.closed, touching->self, std::min(a.x(), b.x()) - m.radius_a[j],
                        std::max(a.x(), b.x()) + m.radius_a[j]});
      s += m.rest_length[j];
    }
  }
  // in order along x, so that most pairs need no more than a glance
  std::sort(pieces.begin(), pieces.end(), [](const Piece& p, const Piece& q) { return p.low < q.low; });
  double least = std::numeric_limits<double>::infinity();
  for (std::size_t i = 0; i < pieces.size(); ++i)
  {
    const Piece& p = pieces[i];
    for (std::size_t j = i + 1; j < pieces.size() && pieces[j].low - p.high < least; ++j)
    {
      const Piece& q = pieces[j];
      if (p.rod == q.rod)
      {
        // pairs within half a turn of the tightest bend keep only a share of their thickness (see contactShare)
        double apart = std::max(q.from - p.to, p.from - q.to);
        if (p.closed)
          apart = std::min(apart, p.whole - std::max(p.to, q.to) + std::min(p.from, q.from));
        if (!p.self || apart < 0.5 * M_PI * (p.radius + q.radius + g.model.contact.gap))
          continue;
      }
      least = std::min(least, segmentsApart(p.a, p.b, q.a, q.b) - p.radius - q.radius);
    }
    for (std::size_t k = 0; k < g.state.obstacles.size(); ++k)
      least = std::min(least, obstacleApart(g.model.obstacles[k].shape, g.state.obstacles[k], p.a, p.b) - p.radius);
  }
  return least;
}

}   // namespace slender::study
