// Threads that touch: merging against differences and its rate, what is conserved, and that nothing passes through
// anything.
#include <algorithm>
#include <cmath>

#include <gtest/gtest.h>

#include "slender_sim/contact/distance.h"
#include "slender_sim/geometry/rotation.h"
#include "thread/merging.h"
#include "test/support/thread_world.h"
#include "test/support/threads.h"

namespace slender::test {
namespace {

using Eigen::Vector3d;

/// Straight along x at `at`, from -length/2 to length/2.
ThreadState straightThread(double length, int edges, double radius, const Vector3d& at)
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
      EXPECT_NEAR((mergingWork(r, d0, d + e) - mergingWork(r, d0, d - e)) / (2 * e), rho(d) * (d - d0), 1e-8)
          << d0 << " " << d;
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
  ThreadMerging merging;
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
struct TouchingThreads : ThreadWorld
{
  double r = 1e-3;
  TouchingThreads(double merging, double friction, double step) : ThreadWorld(1e-5, step)
  {
    ThreadModel m = syrup();
    m.density = 1;
    m.surface_tension = 0.05;
    ContactProperties contact;
    contact.friction = friction;
    for (int k = 0; k < 2; ++k)
      add(m, straightThread(0.02, 20, r, {0, 0, (2 * k - 1) * r}), weightless(), contact, merging);
  }
  double distance() const { return (state.threads[1].threads[0].x[10] - state.threads[0].threads[0].x[10]).norm(); }
};

/// The model's distance: 2 pi gamma r = mu (4 pi/3) rho |d'|, while surface tension thickens the threads by r' =
/// gamma/(6 mu). Runge-Kutta for the cube of a in d = 2 r cos(a), which begins smoothly.
double modelDistance(double r0, double gamma, double mu, double time)
{
  const auto rate = [&](double t, double cube) {
    const double a = std::cbrt(cube), r = r0 + gamma * t / (6 * mu), sine = a > 0 ? std::sin(a) / a : 1.0;
    return 2.25 * gamma / (mu * r * sine * sine) + 3 * a * gamma / (6 * mu) * std::cos(a) / (r * sine);
  };
  const int steps = 1000;
  const double h = time / steps;
  double u = 0.0;
  for (int k = 0; k < steps; ++k)
  {
    const double k1 = rate(k * h, u), k2 = rate((k + 0.5) * h, u + 0.5 * h * k1),
                 k3 = rate((k + 0.5) * h, u + 0.5 * h * k2), k4 = rate((k + 1) * h, u + h * k3);
    u += h / 6 * (k1 + 2 * k2 + 2 * k3 + k4);
  }
  return 2 * (r0 + gamma * time / (6 * mu)) * std::cos(std::cbrt(u));
}

TEST(TouchingThreads, ParallelThreadsMergeAtTheRateOfTheModel)
{
  const double mu = 10, gamma = 0.05, end = 0.05;
  double error[2];
  for (int fine = 0; fine < 2; ++fine)
  {
    const double h = fine ? 5e-4 : 1e-3;
    TouchingThreads pair(0.4, 0.3, h);
    World threads(pair.model, pair.state);
    const double volume = pair.state.threads[0].volumeBalance();
    for (int k = 0; k < std::lround(end / h); ++k)
    {
      const StepReport report = threads.step(pair.state, pair.inputs);
      ASSERT_TRUE(report.ok) << k << " " << report.message;
    }
    EXPECT_NEAR(pair.state.threads[0].volumeBalance(), volume, 1e-13 * volume);
    error[fine] = pair.distance() / modelDistance(pair.r, gamma, mu, end) - 1;
    const Vector3d momentum =
        momentumOf(pair.state.threads[0].threads[0]) + momentumOf(pair.state.threads[1].threads[0]);
    EXPECT_LT(momentum.norm(), 1e-6 * volume * pair.r / end);
  }
  EXPECT_LT(std::abs(error[1]), 0.01);
  EXPECT_LT(std::abs(error[1]), 0.7 * std::abs(error[0]));
}

TEST(TouchingThreads, MergedThreadsStayAtTheDistanceAskedFor)
{
  TouchingThreads pair(0.6, 0.3, 2e-3);
  World threads(pair.model, pair.state);
  for (int k = 0; k < 80; ++k)
  {
    const StepReport report = threads.step(pair.state, pair.inputs);
    ASSERT_TRUE(report.ok) << k << " " << report.message;
  }
  const double r = pair.state.threads[0].threads[0].radius(10);
  EXPECT_GT(pair.distance(), 0.6 * 2 * r);
  EXPECT_LT(pair.distance(), 0.6 * 2 * r + pair.model.contact.gap);
}

TEST(TouchingThreads, WhileNothingTouchesStepsAreThoseOfALoneThread)
{
  for (const bool merging : {false, true})   // it has nothing to do with itself as long as it falls
  {
    ThreadModel m = honey();
    m.viscosity = 100;
    m.surface_tension = 0.05;
    m.feed_length = 0.004;
    m.limits.max_edge_length = 0.005;
    const Thread t = Thread::fromNozzle(m, {0, 0, 0.06}, 0.05);
    ThreadWorld touching(3e-4, 0.002);
    touching.add(m, t.state, t.inputs, {}, merging ? 0.6 : 0.0);
    World threads(touching.model, touching.state);
    ThreadWorld lone(3e-4, 0.002);
    lone.addLone(m, t.state, t.inputs);
    World one(lone.model, lone.state);
    for (int k = 0; k < 100; ++k)
    {
      ASSERT_TRUE(threads.step(touching.state, touching.inputs).ok);
      ASSERT_TRUE(one.step(lone.state, lone.inputs).ok);
      const ThreadState &s = touching.thread(0), &a = lone.thread(0);
      ASSERT_EQ(s.id, a.id);
      for (int i = 0; i < s.nodes(); ++i)
        ASSERT_LT((s.x[i] - a.x[i]).norm(), 1e-9) << k;
    }
    EXPECT_GT(lone.thread(0).nodes(), 4);
  }
}

/// Smallest distance of centrelines over the sum of radii, of all parts that are no neighbours and do not both lie on
/// the floor. The floor, to which lying parts stick, lets them pass through each other.
double closest(const WorldState& state)
{
  struct Piece
  {
    Vector3d a, b;
    double r, start, length;
    int thread;
    bool lies;
  };
  std::vector<Piece> pieces;
  int thread = 0;
  for (const ThreadGroupState& group : state.threads)
    for (const ThreadState& s : group.threads)
    {
      double start = 0.0;
      for (int j = 0; j < s.edges(); ++j)
      {
        const double length = s.edge(j).norm();
        pieces.push_back(
            {s.x[j], s.x[j + 1], s.radius(j), start, length, thread, s.deposited[j] && s.deposited[j + 1]});
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

/// Ends that are thinner than the rest. When all pairs of a segment thinned it one after the other, the threads were
/// drawn into each other from there on, down to 0.46. Radii grow by a fifth of a gap in a step. The barrier needs some
/// steps to follow, so it may lag behind by a part of the gap.
TEST(TouchingThreads, MergedThreadsOfUnequalRadiiStayAtTheDistanceAskedFor)
{
  TouchingThreads pair(0.6, 0.3, 2e-3);
  for (ThreadGroupState& group : pair.state.threads)
    for (const int j : {0, 19})
      group.threads[0].volume[j] *= 0.98;
  World threads(pair.model, pair.state);
  for (int k = 0; k < 80; ++k)
  {
    const StepReport report = threads.step(pair.state, pair.inputs);
    ASSERT_TRUE(report.ok) << k << " " << report.message;
    EXPECT_GT(closest(pair.state), 0.6 - pair.model.contact.gap / (2 * pair.r)) << k;
  }
}

/// Honey that coils on a plate.
struct Coil : ThreadWorld
{
  Coil(double gap, double merging, double viscosity, double surface_tension) : ThreadWorld(gap, 0.002)
  {
    ThreadModel m = honey();
    m.viscosity = viscosity;
    m.surface_tension = surface_tension;
    m.feed_length = 0.004;
    m.floor.present = true;
    m.limits.max_edge_length = 0.005;
    m.limits.min_edge_length = 0.0015;
    m.limits.max_deposited = 400;
    const Thread t = Thread::fromNozzle(m, {0, 0, 0.06}, 0.05);
    ThreadState s = t.state;
    s.x[0].x() += 1e-4;
    add(m, s, t.inputs, {}, merging);
  }
};

TEST(TouchingThreads, ACoilPilesUpAndNothingPassesThrough)
{
  const struct
  {
    bool merging;
    double viscosity, surface_tension;
  } cases[] = {{false, 100, 0.05}, {true, 100, 0.05}, {true, 30, 0.3}};   // the last one thickens most while it merges
  for (const auto& c : cases)
  {
    const bool merging = c.merging;
    Coil coil(3e-4, merging ? 0.6 : 0.0, c.viscosity, c.surface_tension);
    World threads(coil.model, coil.state);
    const double start = coil.state.threads[0].volumeBalance();
    double least = 1e9;
    std::size_t most = 0;
    for (int k = 0; k < 1300; ++k)
    {
      const StepReport report = threads.step(coil.state, coil.inputs);
      ASSERT_TRUE(report.ok) << k << " " << report.message;
      least = std::min(least, closest(coil.state));
      most = std::max(most, threads.contacts().size());
    }
    const ThreadState& s = coil.state.threads[0].threads[0];
    EXPECT_NEAR(coil.state.threads[0].volumeBalance(), start, 1e-11 * s.fed_volume);
    // Barriers keep it above 1, or above the distance down to which parts merge.
    EXPECT_GT(least, merging ? 0.6 : 1.0);
    EXPECT_LT(least, merging ? 0.9 : 1.1);
    EXPECT_GT(most, merging ? 1u : 8u);
    const bool piled =
        std::any_of(s.x.begin(), s.x.begin() + s.nodes() / 2, [](const Vector3d& x) { return x.z() > 0.012; });
    EXPECT_TRUE(piled);
  }
}

TEST(TouchingThreads, ContactConservesMomentum)
{
  // two threads thrown at each other, crosswise
  ThreadWorld cross(5e-5, 1e-3);
  ThreadModel m = syrup();
  for (int k = 0; k < 2; ++k)
  {
    ThreadState s = straightThread(0.03, 15, 1e-3, {0, 0, (2 * k - 1) * 1.5e-3});
    if (k)
      for (auto& x : s.x)
        x = Vector3d(x.y() + 1e-3, x.x(), x.z());
    s = k ? makeThread(Eigen::Map<Eigen::Matrix3Xd>(s.x[0].data(), 3, s.nodes()), Eigen::VectorXd::Constant(15, 1e-3))
          : s;
    for (auto& v : s.v)
      v.z() = k ? -0.5 : 0.7;
    cross.add(m, s, weightless());
  }
  World threads(cross.model, cross.state);
  const auto momentum = [&] {
    return Vector3d(momentumOf(cross.state.threads[0].threads[0]) + momentumOf(cross.state.threads[1].threads[0]));
  };
  const Vector3d before = momentum();
  std::size_t most = 0;
  for (int k = 0; k < 100; ++k)
  {
    const StepReport report = threads.step(cross.state, cross.inputs);
    ASSERT_TRUE(report.ok) << k << " " << report.message;
    most = std::max(most, threads.contacts().size());
    ASSERT_GT(closest(cross.state), 0.95) << k;
  }
  EXPECT_GT(most, 0u);
  EXPECT_LT((momentum() - before).norm(), 1e-6 * before.norm());
}

/// A thread that lies across an obstacle and sags on both sides.
TEST(TouchingThreads, AThreadSagsOverAMovingObstacle)
{
  ThreadWorld over(1e-4, 2e-3);
  ThreadModel m = syrup();
  m.viscosity = 1000;
  ThreadInputs in;
  over.add(m, straightThread(0.1, 40, 1.5e-3, {0, 0, 0.0137}), in);
  over.addObstacle(Sphere{0.012}, Pose{}, 0.5);
  World threads(over.model, over.state);
  double least = 1e9;
  for (int k = 0; k < 200; ++k)
  {
    over.inputs.obstacles[0].X_WG.position.z() = 1e-2 * std::sin(0.05 * (k + 1));
    const StepReport report = threads.step(over.state, over.inputs);
    ASSERT_TRUE(report.ok) << k << " " << report.message;
    const Vector3d centre = over.state.obstacles[0].position;
    for (int j = 0; j < over.thread(0).edges(); ++j)
      least = std::min(least, pointSegmentDistance(centre, over.thread(0).x[j], over.thread(0).x[j + 1]) - 0.012 -
                                  over.thread(0).radius(j));
  }
  const ThreadState& s = over.state.threads[0].threads[0];
  EXPECT_GT(least, 0.0);
  EXPECT_LT(s.x[0].z(), s.x[20].z() - 0.01);
  EXPECT_NEAR((s.x[20] - over.state.obstacles[0].position).norm(), 0.0135, 3e-4);
}

/// Across a tilted plane a thread rolls with 2/3 g sin a, as a cylinder does, or slides with g (sin a - friction cos a)
/// if friction is less than a third of the slope. A belt along the thread draws it along with g friction.
TEST(TouchingThreads, ATiltedPlaneAndABeltRollAndSlipAsCoulombSays)
{
  const double tilt = 0.4, h = 1e-3;
  for (const double friction : {0.0, 0.1, 0.2, 0.6})
  {
    ThreadWorld slope(2e-5, h);
    ThreadModel m = syrup();
    m.surface_tension = 0;
    m.viscosity = 1e3;
    const Vector3d normal(0, -std::sin(tilt), std::cos(tilt)), down(0, -std::cos(tilt), -std::sin(tilt));
    ContactProperties touch;
    touch.friction = 1.0;
    slope.add(m, straightThread(0.02, 10, 1e-3, 1.01e-3 * normal), ThreadInputs{}, touch);
    slope.addObstacle(Plane{}, {Vector3d::Zero(), rotationBetween(Vector3d::UnitZ(), normal)}, friction * friction);
    World threads(slope.model, slope.state);
    for (int k = 0; k < 200; ++k)
    {
      const StepReport report = threads.step(slope.state, slope.inputs);
      ASSERT_TRUE(report.ok) << k << " " << report.message;
    }
    const double rolls = 2.0 / 3.0 * std::sin(tilt), slides = std::sin(tilt) - friction * std::cos(tilt);
    const double expected = 9.81 * std::max(rolls, slides) * 200 * h;
    EXPECT_NEAR(slope.state.threads[0].threads[0].v[5].dot(down), expected, 0.01 * expected) << friction;
  }
  ThreadWorld belt(2e-5, h);
  ThreadModel m = syrup();
  m.surface_tension = 0;
  m.viscosity = 1e3;
  m.floor.present = true;
  m.floor.friction = 0.25;
  EXPECT_THROW(ThreadStepper(std::make_shared<ThreadModel>(m), NewtonConfig{}), std::invalid_argument);
  ThreadInputs in;
  in.belt_velocity << 0.5, 0.0, 0.0;
  ContactProperties touch;
  touch.friction = 0.25;
  belt.add(m, straightThread(0.02, 10, 1e-3, {0, 0, 1.01e-3}), in, touch);
  World threads(belt.model, belt.state);
  for (int k = 1; k <= 400; ++k)
  {
    const StepReport report = threads.step(belt.state, belt.inputs);
    ASSERT_TRUE(report.ok) << k << " " << report.message;
    if (k == 100)
    {
      EXPECT_NEAR(belt.state.threads[0].threads[0].v[5].x(), 0.25 * 9.81 * k * h, 0.01);
    }
  }
  EXPECT_NEAR(belt.state.threads[0].threads[0].v[5].x(), 0.5, 1e-3);
  EXPECT_EQ(std::count(belt.state.threads[0].threads[0].deposited.begin(),
                       belt.state.threads[0].threads[0].deposited.end(), 1),
            0);
}

TEST(TouchingThreads, RefusesWhatDoesNotFit)
{
  ThreadWorld bad(1e-4, 1e-3);
  bad.add(syrup(), straightThread(0.02, 4, 1e-3, Vector3d::Zero()), weightless(), {}, 1.0);
  EXPECT_THROW(World(bad.model, bad.state), WorldError);
  bad.model.threads[0].merging = 0.0;
  bad.add(syrup(), straightThread(0.02, 4, 1e-3, {0, 0, 1.9e-3}), weightless());
  EXPECT_THROW(World(bad.model, bad.state), WorldError);   // they overlap
  for (Vector3d& x : bad.state.threads[1].threads[0].x)
    x.z() = 2.5e-3;
  World threads(bad.model, bad.state);
  const ThreadState before = bad.thread(0);
  bad.inputs.threads[1].gravity.x() = std::nan("");
  EXPECT_FALSE(threads.step(bad.state, bad.inputs).ok);
  bad.inputs.threads[1].gravity.x() = 0.0;
  bad.inputs.threads.pop_back();
  EXPECT_FALSE(threads.step(bad.state, bad.inputs).ok);
  EXPECT_TRUE(sameThread(bad.thread(0), before));
}

}   // namespace
}   // namespace slender::test
