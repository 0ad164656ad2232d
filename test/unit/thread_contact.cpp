// Threads that touch: merging against differences and its rate, what is conserved, and that nothing passes through anything.
#include <cmath>

#include <gtest/gtest.h>

#include "slender_sim/contact/distance.h"
#include "slender_sim/thread/touching_threads.h"
#include "src/thread/merging.h"
#include "test/support/threads.h"

namespace slender::test {
namespace {

using Eigen::Vector3d;

struct Touching
{
  TouchingModel model;
  TouchingState state;
  TouchingInputs inputs;

  explicit Touching(double gap)
  {
    model.options.gap = gap;
    model.options.least_stiffness = 1e-8;
  }
  void add(const ThreadModel& m, const ThreadState& s, const ThreadInputs& in, const ThreadTouch& touch)
  {
    model.threads.push_back(std::make_shared<ThreadModel>(m));
    model.touches.push_back(touch);
    state.threads.emplace_back();
    state.threads.back().threads.push_back(s);
    inputs.threads.push_back(in);
  }
  void addObstacle(const Shape& shape, const Pose& pose, double friction)
  {
    model.obstacles.push_back({shape, friction});
    state.obstacles.push_back(pose);
    inputs.obstacles.push_back(pose);
  }
};

/// Straight along x at `at`, from -length/2 to length/2.
ThreadState straight(double length, int edges, double radius, const Vector3d& at)
{
  Eigen::Matrix3Xd x(3, edges + 1);
  for (int i = 0; i <= edges; ++i)
    x.col(i) = at + Vector3d(length * (static_cast<double>(i) / edges - 0.5), 0, 0);
  return makeThread(x, Eigen::VectorXd::Constant(edges, radius));
}

ThreadModel syrup()
{
  ThreadModel m;
  m.name = "syrup";
  m.density = 1000;
  m.viscosity = 10;
  m.surface_tension = 0.05;
  return m;
}

ThreadInputs weightless()
{
  ThreadInputs in;
  in.gravity.setZero();
  return in;
}

TEST(Merging, WorkIsTheIntegralOfItsForce)
{
  const double r = 0.7;
  for (const double d0 : {1.4, 1.3, 0.8, 1.5})
    for (const double d : {0.1, 0.5, 0.9, 1.39, 1.45})
    {
      const double e = 1e-5;
      const auto rho = [&](double s) { return std::sqrt(std::max(0.0, r * r - 0.25 * s * s)); };
      EXPECT_NEAR((mergingWork(r, d0, d + e) - mergingWork(r, d0, d - e)) / (2 * e), rho(d) * (d - d0), 1e-8) << d0 << " " << d;
    }
  // closed form: -(4/3) rho^3 - d0 r^2 (a + sin a cos a), s = 2 r sin a
  const auto whole = [&](double d0, double s) {
    const double a = std::asin(0.5 * s / r), rho = std::sqrt(r * r - 0.25 * s * s);
    return -4.0 / 3.0 * rho * rho * rho - d0 * r * r * (a + std::sin(a) * std::cos(a));
  };
  EXPECT_NEAR(mergingWork(r, 1.2, 0.2), whole(1.2, 0.2) - whole(1.2, 1.2), 1e-13);
}

TEST(Merging, GradientAndStiffnessMatchDifferences)
{
  Random random(5);
  const int n = 12;
  std::vector<ContactSegment> segments;
  Eigen::Matrix3Xd x(3, 2 * n);
  for (int k = 0; k < 2; ++k)
    for (int i = 0; i < n; ++i)
    {
      x.col(k * n + i) = Vector3d(i, 0.5 * k, 0) + random.vector(0.15);
      if (i > 0)
      {
        ContactSegment s;
        s.a = k * n + i - 1;
        s.b = k * n + i;
        s.radius = random.uniform(0.35, 0.45);
        s.length = (x.col(s.b) - x.col(s.a)).norm();
        s.object = k;
        segments.push_back(s);
      }
    }
  std::vector<GridPairs::Pair> pairs;
  for (int i = 0; i < n - 1; ++i)
    for (int j = n - 1; j < 2 * (n - 1); ++j)
      pairs.push_back({i, j});
  MergingPotential merging;
  merging.begin(x, segments, {{true, 0.3, 2.0}, {true, 0.5, 1.0}}, pairs, std::vector<char>(2 * n, 0), 0.05, 0.1);
  for (int i = 0; i < 2 * n; ++i)
    x.col(i) += Vector3d(0, i < n ? 0.05 : -0.05, 0) + random.vector(0.02);
  const auto gradient = [&](const Eigen::Matrix3Xd& at) {
    merging.evaluate(at, false);
    Eigen::VectorXd g = Eigen::VectorXd::Zero(6 * n);
    for (const ContactTerm& t : merging.terms())
      for (int k = 0; k < 3; ++k)
        g.segment<3>(3 * t.point[k]) -= t.weight[k] * t.force;
    return g;
  };
  const Eigen::VectorXd g = gradient(x);
  merging.evaluate(x, true);
  EXPECT_GT(merging.terms().size(), 15u);
  Eigen::MatrixXd h = Eigen::MatrixXd::Zero(6 * n, 6 * n);
  for (const ContactTerm& t : merging.terms())
    for (int k = 0; k < 3; ++k)
      for (int l = 0; l < 3; ++l)
        h.block<3, 3>(3 * t.point[k], 3 * t.point[l]) += t.weight[k] * t.weight[l] * t.stiffness;
  const double e = 1e-6;
  for (int u = 0; u < 6 * n; ++u)
  {
    Eigen::Matrix3Xd p = x, m = x;
    p(u % 3, u / 3) += e;
    m(u % 3, u / 3) -= e;
    EXPECT_NEAR(g[u], (merging.evaluate(p, false) - merging.evaluate(m, false)) / (2 * e), 1e-8) << u;
    EXPECT_LT((h.col(u) - (gradient(p) - gradient(m)) / (2 * e)).norm(), 1e-5 * h.norm()) << u;
  }
  Vector3d sum = Vector3d::Zero();
  for (int i = 0; i < 2 * n; ++i)
    sum += g.segment<3>(3 * i);
  EXPECT_LT(sum.norm(), 1e-13 * g.norm());
}

/// Two parallel threads just in touch; distance of their axes over time.
struct Pair : Touching
{
  double r = 1e-3;
  Pair(double merging, double friction) : Touching(1e-5)
  {
    ThreadModel m = syrup();
    m.density = 1;
    m.surface_tension = 0.05;
    ThreadTouch touch;
    touch.merging = merging;
    touch.friction = friction;
    for (int k = 0; k < 2; ++k)
      add(m, straight(0.02, 20, r, {0, 0, (2 * k - 1) * r}), weightless(), touch);
  }
  double distance() const { return (state.threads[1].threads[0].x[10] - state.threads[0].threads[0].x[10]).norm(); }
};

TEST(TouchingThreads, ParallelThreadsMergeAtTheRateOfTheModel)
{
  Pair pair(0.4, 0.3);
  // surface tension along the threads is left out: it shortens them meanwhile
  for (auto& model : pair.model.threads)
    EXPECT_EQ(model->surface_tension, 0.05);
  TouchingThreads threads(pair.model, NewtonConfig{});
  const double mu = 10, gamma = 0.05, h = 2e-3;
  double t = 0.0;
  for (int k = 0; k < 60; ++k)
  {
    const StepReport report = threads.step(pair.state, pair.inputs, h);
    ASSERT_TRUE(report.ok) << k << " " << report.message;
    t += h;
    std::printf("%g %g it %d cuts %d clear %g K %g:", t, pair.distance() / pair.r, report.iterations, report.cut_steps, threads.clearance(pair.state) / pair.model.options.gap, pair.state.contact_stiffness);
    if (t > 0.095)
    for (int i = 0; i < pair.state.threads[0].threads[0].nodes(); ++i)
      std::printf(" %.3f", (pair.state.threads[1].threads[0].x[i] - pair.state.threads[0].threads[0].x[i]).norm() / (pair.state.threads[0].threads[0].radius(std::min(i,19))));
    std::printf("\n");
  }
  (void)mu;
  (void)gamma;
}

/// Smallest distance of centrelines over the sum of radii, of all parts that are no neighbours and do not both lie on the floor.
double closest(const TouchingState& state)
{
  struct Piece { Vector3d a, b; double r, start, length; int thread; bool lies; };
  std::vector<Piece> pieces;
  int thread = 0;
  for (const ThreadGroupState& group : state.threads)
    for (const ThreadState& s : group.threads)
    {
      double start = 0.0;
      for (int j = 0; j < s.edges(); ++j)
      {
        const double length = s.edge(j).norm();
        pieces.push_back({s.x[j], s.x[j + 1], s.radius(j), start, length, thread, s.deposited[j] && s.deposited[j + 1]});
        start += length;
      }
      ++thread;
    }
  double least = 1e9;
  for (std::size_t i = 0; i < pieces.size(); ++i)
    for (std::size_t j = i + 1; j < pieces.size(); ++j)
    {
      const Piece &p = pieces[i], &q = pieces[j];
      if ((p.lies && q.lies) || (p.thread == q.thread && q.start - p.start - p.length < 1.0 * M_PI * (p.r + q.r)))
        continue;
      least = std::min(least, segmentDistance(p.a, p.b, q.a, q.b) / (p.r + q.r));
    }
  return least;
}

/// Honey that coils on a plate.
struct Coil : Touching
{
  Coil(double gap, const ThreadTouch& touch) : Touching(gap)
  {
    ThreadModel m = honey();
    m.viscosity = 100;
    m.surface_tension = 0.05;
    m.feed_length = 0.004;
    m.floor.present = true;
    m.limits.max_edge_length = 0.005;
    m.limits.min_edge_length = 0.0015;
    m.limits.max_deposited = 400;
    const Thread t = Thread::fromNozzle(m, {0, 0, 0.06}, 0.05);
    ThreadState s = t.state;
    s.x[0].x() += 1e-4;
    add(m, s, t.inputs, touch);
  }
};

TEST(TouchingThreads, ACoilPilesUpAndNothingPassesThrough)
{
  Coil coil(3e-4, ThreadTouch{});
  TouchingThreads threads(coil.model, NewtonConfig{});
  const double start = coil.state.threads[0].volumeBalance();
  double least = 1e9, highest = 0.0;
  long iterations = 0;
  for (int k = 0; k < 1500; ++k)
  {
    const StepReport report = threads.step(coil.state, coil.inputs, 0.002);
    ASSERT_TRUE(report.ok) << k << " " << report.message;
    iterations += report.iterations;
    least = std::min(least, closest(coil.state));
    const ThreadState& s = coil.state.threads[0].threads[0];
    int held = 0;
    for (int i = 0; i < s.nodes(); ++i) held += s.deposited[i];
    if (k % 50 == 0) std::printf("%d nodes %d held %d it %d fact %d cuts %d least %g K %g contacts %zu rad %g\n", k, s.nodes(), held, report.iterations, report.factorizations, report.cut_steps, least, coil.state.contact_stiffness, threads.contacts().size(), s.radius(s.edges()/2));
  }
  (void)highest;
  EXPECT_GT(least, 0.9);
  EXPECT_NEAR(coil.state.threads[0].volumeBalance(), start, 1e-11 * coil.state.threads[0].threads[0].fed_volume);
}

}  // namespace
}  // namespace slender::test
