// Projection to the manifold of constant edge lengths, alone: chains, closed chains, bodies welded to them.
#include <gtest/gtest.h>

#include "slender_sim/dynamics/fast_projection.h"
#include "slender_sim/geometry/rotation.h"
#include "test/support/rods.h"

namespace slender::test {
namespace {

struct ProjectionCase
{
  FastProjection projection;
  std::vector<Matrix3Xd> start, trial, v;
  std::vector<Eigen::VectorXd> mass;
  std::vector<std::vector<char>> free;
  double h = 1e-3;

  int add(const Matrix3Xd& x, bool closed, Random& random)
  {
    const int n = static_cast<int>(x.cols()), edges = closed ? n : n - 1;
    Eigen::VectorXd length(edges), m(n);
    for (int j = 0; j < edges; ++j)
      length[j] = (x.col((j + 1) % n) - x.col(j)).norm();
    for (int i = 0; i < n; ++i)
      m[i] = random.uniform(0.5, 2.0);
    start.push_back(x);
    mass.push_back(m);
    free.emplace_back(n, 1);
    Matrix3Xd velocity(3, n);
    for (int i = 0; i < n; ++i)
      velocity.col(i) = random.vector(20.0);
    v.push_back(velocity);
    trial.push_back(x + h * velocity);
    return projection.addChain(length, m, closed);
  }
  void hold(int chain, int node, const Vector3d& at)
  {
    projection.hold(chain, node);
    free[chain][node] = 0;
    trial[chain].col(node) = at;
  }
  void weld(int chain, int node, int body)
  {
    const ProjectedBody& b = projection.body(body);
    projection.weld(chain, node, body, b.start.orientation.conjugate() * (start[chain].col(node) - b.start.position));
    free[chain][node] = 0;
  }
  int addBody(const Vector3d& at, Random& random)
  {
    const int b = projection.addBody();
    ProjectedBody& body = projection.body(b);
    body.mass = random.uniform(1.0, 3.0);
    body.inertia = Vector3d(0.4, 0.5, 0.7).asDiagonal();
    body.inertia *= body.mass;
    body.start = {at, fromRotationVector(random.vector(2.0))};
    body.velocity = {random.vector(10.0), random.vector(20.0)};
    body.pose.position = at + h * body.velocity.linear;
    body.pose.orientation = (fromRotationVector(h * body.velocity.angular) * body.start.orientation).normalized();
    return b;
  }
  ProjectionReport run()
  {
    for (std::size_t c = 0; c < start.size(); ++c)
    {
      projection.setStart(static_cast<int>(c), start[c]);
      projection.setTrial(static_cast<int>(c), trial[c]);
    }
    const ProjectionReport report = projection.project(h);
    for (std::size_t c = 0; c < start.size(); ++c)
      projection.correct(static_cast<int>(c), trial[c], v[c]);
    return report;
  }
  /// Linear and angular momentum about the origin, with positions at the end of the step.
  Eigen::Matrix<double, 6, 1> momentum(int bodies) const
  {
    Vector3d p = Vector3d::Zero(), l = p;
    for (std::size_t c = 0; c < start.size(); ++c)
      for (int i = 0; i < mass[c].size(); ++i)
        if (free[c][i])
        {
          p += mass[c][i] * v[c].col(i);
          l += mass[c][i] * trial[c].col(i).cross(v[c].col(i));
        }
    for (int b = 0; b < bodies; ++b)
    {
      const ProjectedBody body = const_cast<FastProjection&>(projection).body(b);
      const Eigen::Matrix3d r = body.pose.orientation.toRotationMatrix();
      p += body.mass * body.velocity.linear;
      l += body.mass * body.pose.position.cross(body.velocity.linear) +
           r * body.inertia * r.transpose() * body.velocity.angular;
    }
    Eigen::Matrix<double, 6, 1> m;
    m << p, l;
    return m;
  }
  double worst(int chain, const Matrix3Xd& x, bool closed) const
  {
    const int n = static_cast<int>(x.cols());
    double error = 0;
    for (int j = 0; j < (closed ? n : n - 1); ++j)
      error = std::max(error, std::abs((x.col((j + 1) % n) - x.col(j)).squaredNorm() /
                                           (start[chain].col((j + 1) % n) - start[chain].col(j)).squaredNorm() -
                                       1));
    return error;
  }
};

TEST(FastProjection, RestoresLengthsOfOpenAndClosedChainsAndKeepsMomenta)
{
  Random random(3);
  for (bool closed : {false, true})
    for (int n : {closed ? 3 : 2, 4, 5, 8, 9, 17, 100})
    {
      ProjectionCase c;
      c.add(wigglyNodes(n, closed, random), closed, random);
      const auto before = c.momentum(0);
      const ProjectionReport report = c.run();
      ASSERT_TRUE(report.ok) << n;
      EXPECT_LE(c.worst(0, c.trial[0], closed), 1e-8);
      EXPECT_NEAR(report.constraint_error, c.worst(0, c.trial[0], closed), 1e-14);
      EXPECT_GE(report.iterations, 2);
      EXPECT_LE(report.iterations, 5);
      // round-off of displacements, divided by the step
      EXPECT_LT((c.momentum(0) - before).norm(), 1e-11 * n * before.norm()) << n;
    }
}

TEST(FastProjection, HeldNodesStayAndForcesBalance)
{
  Random random(4);
  for (bool closed : {false, true})
  {
    ProjectionCase c;
    const Matrix3Xd x = wigglyNodes(20, closed, random);
    c.add(x, closed, random);
    c.hold(0, 0, x.col(0) + Vector3d(0.01, 0, 0));
    c.hold(0, 7, x.col(7) + Vector3d(0.0, 0.02, 0));
    c.hold(0, 8, x.col(8) + Vector3d(0.0, 0.02, 0));
    const Matrix3Xd v = c.v[0], held = c.trial[0];
    ASSERT_TRUE(c.run().ok);
    EXPECT_LE(c.worst(0, c.trial[0], closed), 1e-8);
    Vector3d change = Vector3d::Zero(), reaction = change;
    for (int i = 0; i < 20; ++i)
      if (c.free[0][i])
      {
        change += c.mass[0][i] * (c.v[0].col(i) - v.col(i)) / c.h;
        EXPECT_LT((c.mass[0][i] * (c.v[0].col(i) - v.col(i)) / c.h - c.projection.force(0, i)).norm(),
                  1e-6 * c.projection.force(0, i).norm() + 1e-6);
      }
      else
      {
        EXPECT_EQ(c.trial[0].col(i), held.col(i));
        reaction += c.projection.force(0, i);
      }
    EXPECT_GT(change.norm(), 1.0);
    EXPECT_LT((change + reaction).norm(), 1e-7 * change.norm());
  }
}

TEST(FastProjection, BodiesAtOneEndAtBothEndsAndAtTheMiddleOfThreeRods)
{
  Random random(5);
  for (int kind = 0; kind < 5; ++kind)
  {
    ProjectionCase c;
    int bodies = 1;
    const Matrix3Xd x = wigglyNodes(12, false, random);
    c.add(x, false, random);
    if (kind == 0 || kind == 1)   // an edge at one end, or at both
    {
      c.addBody(x.col(0) + random.vector(), random);
      c.weld(0, 0, 0);
      c.weld(0, 1, 0);
    }
    if (kind == 1)
    {
      c.addBody(x.col(11) + random.vector(), random);
      c.weld(0, 10, 1);
      c.weld(0, 11, 1);
      bodies = 2;
    }
    if (kind == 2)   // T-junction: one rod's middle edge, two rods' ends
    {
      c.addBody(x.col(5), random);
      c.weld(0, 5, 0);
      c.weld(0, 6, 0);
      for (int rod : {1, 2})
      {
        c.add(wigglyNodes(9, false, random).colwise() + (x.col(5) + random.vector(0.5)), false, random);
        c.weld(rod, 0, 0);
        c.weld(rod, 1, 0);
      }
    }
    if (kind == 3)   // bodies that share an edge: no node between them can give
    {
      bodies = 3;
      for (int b = 0; b < 3; ++b)
        c.addBody(x.col(3 + b) + random.vector(), random);
      for (int b = 0; b < 3; ++b)
        c.weld(0, 3 + b, b);
    }
    if (kind == 4)   // a loop
    {
      bodies = 2;
      c.add(wigglyNodes(10, true, random), true, random);
      c.addBody(x.col(11), random);
      c.addBody(c.start[1].col(4), random);
      c.weld(0, 11, 0);
      c.weld(1, 0, 0);
      c.weld(1, 4, 1);
      c.weld(1, 5, 1);
    }
    const auto before = c.momentum(bodies);
    const ProjectionReport report = c.run();
    ASSERT_TRUE(report.ok) << kind;
    EXPECT_LE(report.iterations, 6) << kind;
    for (std::size_t k = 0; k < c.start.size(); ++k)
      EXPECT_LE(c.worst(static_cast<int>(k), c.trial[k], kind == 4 && k == 1), 1e-8) << kind;
    EXPECT_LT((c.momentum(bodies) - before).norm(), 1e-10 * before.norm()) << kind;
    for (int b = 0; b < bodies; ++b)
      EXPECT_NEAR(c.projection.body(b).pose.orientation.norm(), 1.0, 1e-14);
  }
}

TEST(FastProjection, ABodyAtAGripperSwingsAboutIt)
{
  // one edge between a held node and a body: only the body can give
  Random random(6);
  ProjectionCase c;
  const Matrix3Xd x = straightNodes(3, 2.0);
  c.add(x, false, random);
  c.hold(0, 0, x.col(0));
  c.addBody(x.col(1) + Vector3d(0.3, 0.1, 0), random);
  c.weld(0, 1, 0);
  c.weld(0, 2, 0);
  const ProjectionReport report = c.run();
  ASSERT_TRUE(report.ok);
  EXPECT_LE(c.worst(0, c.trial[0], false), 1e-8);
  EXPECT_NEAR(c.trial[0].col(1).norm(), 1.0, 1e-8);
}

TEST(FastProjection, StraightChainsThatOnlyBodiesCanRelieve)
{
  // exactly straight between two nodes that are not free: the chain's own system is singular, that with the bodies is
  // not
  for (int n : {3, 4, 5, 12})
    for (int kind = 0; kind < 4; ++kind)
    {
      Random random(10 + n);
      ProjectionCase c;
      const bool closed = kind == 3;
      Matrix3Xd x = straightNodes(n, 0.1 * n);
      if (closed)   // back again by way of a corner at the side
      {
        const Vector3d corner(0.05 * n, 0.05 * n, 0.0), from = x.col(n - 1), to = x.col(0);
        Matrix3Xd loop(3, 2 * n + 3);
        loop.leftCols(n) = x;
        for (int i = 1; i <= n + 3; ++i)
        {
          const double s = 2.0 * i / (n + 4);
          loop.col(n - 1 + i) = s < 1 ? from + s * (corner - from) : corner + (s - 1) * (to - corner);
        }
        x = loop;
      }
      c.add(x, closed, random);
      if (kind == 0)
        c.hold(0, 0, x.col(0));
      else
      {
        c.addBody(x.col(0) - Vector3d(0.05, 0.02, 0), random);
        c.weld(0, 0, 0);
      }
      if (kind == 1)
        c.hold(0, n - 1, x.col(n - 1));
      else
      {
        const int body = c.addBody(x.col(n - 1) + Vector3d(0.0, 0.0, 0.03), random);
        c.weld(0, n - 1, body);
      }
      const auto before = c.momentum(kind < 2 ? 1 : 2);
      const ProjectionReport report = c.run();
      ASSERT_TRUE(report.ok) << n << " " << kind;
      EXPECT_LE(report.iterations, 7) << n << " " << kind;
      EXPECT_LE(c.worst(0, c.trial[0], closed), 1e-8) << n << " " << kind;
      if (kind >= 2)
        EXPECT_LT((c.momentum(2) - before).norm(), 1e-9 * before.norm()) << n << " " << kind;
    }
}

TEST(FastProjection, ConvergesQuadratically)
{
  Random random(7);
  double error[3];
  int k = 0;
  for (int iterations : {1, 2, 3})
  {
    Random same(7);
    ProjectionCase c;
    c.add(wigglyNodes(40, false, same), false, same);
    c.projection.max_iterations = iterations;
    c.projection.tolerance = 1e-15;
    c.projection.setStart(0, c.start[0]);
    c.projection.setTrial(0, c.trial[0]);
    error[k++] = c.projection.project(c.h).constraint_error;
  }
  EXPECT_GT(std::log(error[2] / error[1]) / std::log(error[1] / error[0]), 1.8);   // observed order
  EXPECT_GT(error[2], 1e-13);                                                      // not round-off
}

TEST(FastProjection, NamesGripsThatAreTooFarApart)
{
  for (bool closed : {false, true})
  {
    Random random(8);
    ProjectionCase c;
    const Matrix3Xd x = wigglyNodes(20, closed, random);
    c.add(x, closed, random);
    c.hold(0, 2, x.col(2));
    c.hold(0, 9, x.col(2) + Vector3d(0, 0, 20.0));
    const ProjectionReport report = c.run();
    EXPECT_FALSE(report.ok);
    EXPECT_EQ(report.chain, 0);
    EXPECT_EQ(report.first_node, 2);
    EXPECT_EQ(report.last_node, 9);
  }
  Random random(9);
  ProjectionCase c;
  c.add(wigglyNodes(20, false, random), false, random);
  c.trial[0](1, 4) = std::nan("");
  c.projection.setStart(0, c.start[0]);
  c.projection.setTrial(0, c.trial[0]);
  const ProjectionReport report = c.projection.project(c.h);
  EXPECT_FALSE(report.ok);
  EXPECT_EQ(report.chain, -1);
}

}   // namespace
}   // namespace slender::test
