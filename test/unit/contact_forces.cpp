#include <functional>

#include <Eigen/Cholesky>
#include <Eigen/Eigenvalues>
#include <gtest/gtest.h>

#include "test/support/contact.h"

namespace slender::test {
namespace {

Eigen::Matrix3Xd nodesAbout(const Eigen::Vector3d& middle, const Eigen::Vector3d& along, int edges)
{
  Eigen::Matrix3Xd nodes(3, edges + 1);
  for (int i = 0; i <= edges; ++i)
    nodes.col(i) = middle + along * (static_cast<double>(i) / edges - 0.5);
  return nodes;
}

struct Rods
{
  ContactSurface surface;
  Eigen::Matrix3Xd x;
};

/// A rod of five edges along x and one of four above it.
Rods stackedRods(const Eigen::Vector3d& middle, const Eigen::Vector3d& along, double friction = 0.0)
{
  Rods rods;
  addCurve(rods.surface, rods.x, nodesAbout({0, 0, 0}, {1, 0, 0}, 5), kCurveRadius, friction);
  addCurve(rods.surface, rods.x, nodesAbout(middle, along, 4), kCurveRadius, friction);
  return rods;
}

ContactOptions gapOptions()
{
  ContactOptions o;
  o.gap = kContactGap;
  return o;
}

/// Largest change of all nodes' forces between neighbouring samples of a motion, over the largest force.
double largestJumpOfRods(int samples, const std::function<Rods(double)>& motion)
{
  ContactPotential potential(motion(0.0).surface, gapOptions());
  potential.setStiffness(1.0);
  double jump = 0.0, largest = 0.0;
  Eigen::Matrix3Xd before;
  for (int k = 0; k <= samples; ++k)
  {
    const Rods rods = motion(static_cast<double>(k) / samples);
    EXPECT_TRUE(std::isfinite(potential.evaluate(rods.x, {}, false)));
    const Eigen::Matrix3Xd g = gradient(potential, rods.x.cols());
    if (k > 0)
      jump = std::max(jump, (g - before).cwiseAbs().maxCoeff());
    largest = std::max(largest, g.cwiseAbs().maxCoeff());
    before = g;
  }
  return jump / largest;
}

/// A continuous force's jumps shrink with the samples' distance.
void expectContinuousRods(const std::function<Rods(double)>& motion)
{
  const double coarse = largestJumpOfRods(2000, motion), fine = largestJumpOfRods(20000, motion);
  EXPECT_LT(fine, 0.15 * coarse);
  EXPECT_LT(fine, 0.01);
}

TEST(ContactForces, DoNotJumpAsRodsBecomeParallel)
{
  static constexpr double kHeight = 2 * kCurveRadius + 0.006;
  // turning in the plane of contact, through parallel; tilting, so that the contact runs from one end to the other;
  // both, off centre
  expectContinuousRods([](double s) {
    const double angle = 0.4 * (s - 0.5);
    return stackedRods({0.05, 0, kHeight}, {std::cos(angle), std::sin(angle), 0});
  });
  expectContinuousRods([](double s) { return stackedRods({0.05, 0, kHeight}, {1, 0, 0.01 * (s - 0.5)}); });
  expectContinuousRods([](double s) {
    return stackedRods({0.05, 0.01, kHeight}, {1, 0.1 * (s - 0.47), 0.01 * (s - 0.5)});
  });
}

TEST(ContactForces, DoNotJumpAsRodsSlide)
{
  for (double angle : {0.0, 0.05, 0.7, 1.5707})
    expectContinuousRods([angle](double s) {
      return stackedRods({s - 0.5, 0.003, 2 * kCurveRadius + 0.006}, {0.8 * std::cos(angle), 0.8 * std::sin(angle), 0});
    });
}

/// Rods do not feel each other's nodes: under a constant load the height of a rod that slides across another, over
/// edges and over nodes, changes by a small share of the gap. (Steps in it act like teeth.)
TEST(ContactForces, HardlyShowTheNodes)
{
  for (double load : {2.0, 5.0, 15.0})   // gaps of about a third to a twelfth of the reach
    for (double angle : {0.6, M_PI / 2})
      for (double across : {0.0, 0.1, 0.2})   // of the sliding rod's node, edges are 0.2 long
      {
        double lowest = 1.0, highest = 0.0;
        for (int k = 0; k <= 40; ++k)
        {
          double low = 0.0, high = kContactGap;
          for (int i = 0; i < 50; ++i)
          {
            const double gap = 0.5 * (low + high);
            const Eigen::Vector3d along(std::cos(angle), std::sin(angle), 0);
            Rods rods = stackedRods(Eigen::Vector3d(0.3 * k / 40.0 - 0.15, 0, 2 * kCurveRadius + gap) + across * along,
                                    0.8 * along);
            ContactPotential potential(rods.surface, gapOptions());
            potential.setStiffness(1.0);
            const double energy = potential.evaluate(rods.x, {}, false);
            const double force = std::isfinite(energy) ? -gradient(potential, rods.x.cols()).row(2).tail(5).sum() : 1e9;
            (force > load ? low : high) = gap;
          }
          lowest = std::min(lowest, low);
          highest = std::max(highest, low);
        }
        EXPECT_LT(highest - lowest, 0.08 * kContactGap) << load << " " << angle << " " << across;
      }
}

/// Second derivatives are those of the energy; without the part that may be negative they are semidefinite.
TEST(ContactForces, StiffnessIsTheDerivativeOfTheForce)
{
  Random random(5);
  for (double angle : {0.0, 0.02, 0.3, 1.2})
  {
    const Rods rods = stackedRods({0.05, 0, 2 * kCurveRadius + 0.006}, {std::cos(angle), std::sin(angle), 1e-3});
    const Eigen::Index n = rods.x.cols();
    ContactPotential potential(rods.surface, gapOptions());
    potential.setStiffness(1.0);
    potential.evaluate(rods.x, {}, true);
    const Eigen::MatrixXd h = hessian(potential, n, true), definite = hessian(potential, n, false);
    EXPECT_GE(definite.selfadjointView<Eigen::Lower>().eigenvalues().minCoeff(), -1e-12 * h.norm());
    EXPECT_LT(h.selfadjointView<Eigen::Lower>().eigenvalues().minCoeff(), 0.0);   // it is not the same
    for (int trial = 0; trial < 5; ++trial)
    {
      Eigen::Matrix3Xd step(3, n);
      for (int c = 0; c < 3; ++c)
        step.row(c) = random.numbers(static_cast<int>(n), 1e-7);
      potential.evaluate(rods.x + step, {}, false);
      Eigen::Matrix3Xd change = gradient(potential, n);
      potential.evaluate(rods.x - step, {}, false);
      change = 0.5 * (change - gradient(potential, n));
      const Eigen::VectorXd predicted = h * Eigen::Map<const Eigen::VectorXd>(step.data(), step.size());
      // differences of forces over 1e-7 m; rows of less than a thousandth of a pair's stiffness are left out
      EXPECT_LT((Eigen::Map<const Eigen::MatrixXd>(predicted.data(), 3, n) - change).norm(), 1e-3 * change.norm())
          << angle;
    }
  }
}

/// A triangle lies on the face of a box, which turns. The second derivative contains that the place of contact runs
/// along the triangle. It leaves out that the normal turns, so that only the normal components can be compared.
TEST(ContactForces, StiffnessContainsTheTurnOfASolid)
{
  ContactSurface surface;
  Eigen::Matrix3Xd x(3, 0), corners(3, 3);
  corners << -0.01, 0.02, 0.0, -0.01, 0.0, 0.02, 0.0, 0.0, 0.0;
  addSheet(surface, x, corners, Eigen::Vector3i(0, 1, 2), 2e-3, 0.0);
  surface.solids.push_back({Box{{0.1, 0.1, 0.1}}, -1.0, {}});
  surface.solids[0].body = true;
  const Pose rest{{0.003, -0.002, -0.0515}, fromRotationVector({2e-3, -1e-3, 0.3})};
  ContactPotential potential(surface, gapOptions());
  potential.setStiffness(1.0);
  for (const Eigen::Vector3d& turn : {Eigen::Vector3d(1e-7, 0, 0), Eigen::Vector3d(0, 1e-7, 0)})
  {
    potential.evaluate(x, {rest}, true);
    ASSERT_FALSE(potential.rows().empty());
    Eigen::Vector3d predicted(0, 0, 0), along_normals = predicted;
    const Eigen::Vector3d normal = potential.rows()[0].normal;
    for (const ContactTerm& term : potential.terms())
      for (int i = 0; i < 3; ++i)
        predicted[term.point[i]] -=
            term.weight[i] * normal.dot(term.stiffness * turn.cross(term.position - rest.position));
    for (const ContactRow& row : potential.rows())
    {
      ASSERT_EQ(row.solid, 0);
      double gained = 0.0;   // of the gap, over the row
      for (int i = 0; i < 3; ++i)
        gained -= row.along[i] * row.normal.dot(turn.cross(x.col(row.point[i]) - rest.position));
      for (int i = 0; i < 3; ++i)
        along_normals[row.point[i]] += row.stiffness * row.along[i] * gained;
    }
    potential.evaluate(x, {moved(rest, Eigen::Vector3d::Zero(), turn)}, false);
    Eigen::Vector3d change = normal.transpose() * gradient(potential, 3);
    potential.evaluate(x, {moved(rest, Eigen::Vector3d::Zero(), -turn)}, false);
    change = 0.5 * (change - Eigen::Vector3d(normal.transpose() * gradient(potential, 3)));
    // rows of less than a thousandth of a pair's stiffness are left out
    EXPECT_LT((predicted + along_normals - change).norm(), 1e-3 * change.norm());
    EXPECT_GT((predicted - change).norm(), 0.1 * change.norm());   // the rows matter
  }
}

/// Newton's method with these terms and a strict line search: a rod pressed on another by weights. Both are held as in
/// an implicit step, by springs that alone would let the upper one sink 3 cm, and resist changes of their edges'
/// vectors.
TEST(ContactForces, NewtonConverges)
{
  for (double angle : {0.0, 0.01, 0.2, 1.4})
    for (double weight : {1e-3, 0.1, 10.0})
    {
      Rods rods = stackedRods({0.05, 0.01, 2 * kCurveRadius + 0.015}, {std::cos(angle), std::sin(angle), 2e-3});
      ContactPotential potential(rods.surface, gapOptions());
      potential.setStiffness(1.0);
      const Eigen::Index n = rods.x.cols();
      const Eigen::Matrix3Xd rest = rods.x;
      Eigen::MatrixXd elastic = Eigen::MatrixXd::Identity(n, n);   // per coordinate
      for (const ContactSegment& s : rods.surface.segments)
      {
        Eigen::VectorXd edge = Eigen::VectorXd::Zero(n);
        edge[s.a] = -1.0;
        edge[s.b] = 1.0;
        elastic += 10.0 * edge * edge.transpose();
      }
      elastic *= weight / 0.03;
      Eigen::Matrix3Xd load = Eigen::Matrix3Xd::Zero(3, n);
      load.row(2).tail(5).setConstant(weight);
      const auto total = [&](const Eigen::Matrix3Xd& x, bool with_stiffness) {
        const Eigen::Matrix3Xd u = x - rest;
        return potential.evaluate(x, {}, with_stiffness) + (0.5 * u * elastic + load).cwiseProduct(u).sum();
      };
      int iterations = 0;
      for (; iterations < 60; ++iterations)
      {
        const double energy = total(rods.x, true);
        const Eigen::Matrix3Xd g = gradient(potential, n) + (rods.x - rest) * elastic + load;
        const Eigen::Map<const Eigen::VectorXd> residual(g.data(), g.size());
        if (residual.norm() < 1e-9 * weight)
          break;
        Eigen::MatrixXd h = hessian(potential, n, false);
        for (Eigen::Index i = 0; i < n; ++i)
          for (Eigen::Index j = 0; j < n; ++j)
            h.block<3, 3>(3 * i, 3 * j).diagonal().array() += elastic(i, j);
        const Eigen::VectorXd direction = -h.ldlt().solve(residual);
        const Eigen::Map<const Eigen::MatrixXd> move(direction.data(), 3, n);
        double share = potential.stepLimit(rods.x, rods.x + move, {}, {});
        ASSERT_GT(share, 0.0);
        while (total(rods.x + share * move, false) >
               energy + 1e-4 * share * residual.dot(direction) + 1e-13 * std::abs(energy))
        {
          share *= 0.5;
          ASSERT_GT(share, 1e-6) << "angle " << angle << " weight " << weight << " residual " << residual.norm();
        }
        rods.x += share * move;
        ASSERT_GT(potential.clearance(rods.x, {}), 0.0);
      }
      EXPECT_LT(potential.smallestGap(), kContactGap);
      EXPECT_LT(iterations, 40) << "angle " << angle << " weight " << weight;
    }
}

TEST(ContactFriction, SticksAndSlipsAsCoulombSays)
{
  constexpr double kStep = 0.01, kFriction = 0.4;
  ContactSurface surface;
  Eigen::Matrix3Xd x;
  addCurve(surface, x, nodesAbout({0, 0, kCurveRadius + 0.008}, {0.3, 0, 0}, 1), kCurveRadius, 0.1);
  surface.solids.push_back({Plane{}, 1.6, {}});   // geometric mean 0.4
  const std::vector<Pose> solids(1);
  ContactPotential potential(surface, gapOptions());
  potential.setStiffness(2.0);
  potential.begin(x, solids, kStep);
  potential.evaluate(x, solids, false);
  ASSERT_EQ(potential.terms().size(), 2u);
  EXPECT_EQ(potential.terms()[1].force.norm(), 0.0);
  const double normal = potential.terms()[0].force.norm();
  const Eigen::Vector3d side(0.6, 0.8, 0);
  const double full = gapOptions().slip_speed * kStep;
  for (double slip : {0.1 * full, full, 20 * full})
  {
    const Eigen::Matrix3Xd there = x.colwise() + slip * side;
    potential.evaluate(there, solids, true);
    const Eigen::Vector3d force = potential.terms().back().force;
    EXPECT_LE(force.norm(), kFriction * normal * (1 + 1e-12));
    // slips are 1e-7 m of coordinates of 0.1 m
    EXPECT_NEAR(force.dot(side), slip < full ? -kFriction * normal * 0.19 : -kFriction * normal, 1e-9 * normal);
    EXPECT_GE(potential.terms().back().stiffness.selfadjointView<Eigen::Lower>().eigenvalues().minCoeff(), -1e-9);
    const double h = 1e-3 * full;
    const double slope = (potential.evaluate(there.colwise() + h * side, solids, false) -
                          potential.evaluate(there.colwise() - h * side, solids, false)) /
                         (2 * h);
    if (slip != full)
      EXPECT_NEAR(slope, -force.dot(side), 1e-6 * normal);
  }
  // a solid that moves along drags: no slip, no force
  std::vector<Pose> along = solids;
  along[0].position = full * side;
  potential.evaluate(x.colwise() + full * side, along, false);
  EXPECT_NEAR(potential.terms().back().force.norm(), 0.0, 1e-9 * normal);
  EXPECT_EQ(potential.lagFriction(), 0.0);   // the same normal forces
  potential.evaluate(x.colwise() - Eigen::Vector3d(0, 0, 0.002), solids, false);
  EXPECT_GT(potential.lagFriction(), 0.1);
}

/// One segment above a floor, within the gap.
struct SegmentOnFloor
{
  static constexpr double kStep = 0.01, kFriction = 0.4;
  Eigen::Matrix3Xd x;
  const std::vector<Pose> solids = std::vector<Pose>(1);
  ContactPotential potential = make();

private:
  ContactPotential make()
  {
    ContactSurface surface;
    addCurve(surface, x, nodesAbout({0, 0, kCurveRadius + 0.008}, {0.3, 0, 0}, 1), kCurveRadius, kFriction);
    surface.solids.push_back({Plane{}, kFriction, {}});
    ContactPotential made(surface, gapOptions());
    made.setStiffness(2.0);
    return made;
  }
};

/// If friction follows, its normal forces are those that the last evaluation predicts. The forces are the gradient of
/// the potential, and the potential does not jump.
TEST(ContactFriction, FollowsPredictedForces)
{
  SegmentOnFloor on_floor;
  Eigen::Matrix3Xd& x = on_floor.x;
  const std::vector<Pose>& solids = on_floor.solids;
  ContactPotential& potential = on_floor.potential;
  constexpr double kStep = SegmentOnFloor::kStep, kFriction = SegmentOnFloor::kFriction;
  const Eigen::Vector3d side(0.6, 0.8, 0), down(0, 0, -1);
  potential.begin(x, solids, kStep);
  const double full = gapOptions().slip_speed * kStep;
  const auto at = [&](double deep) { return Eigen::Matrix3Xd(x.colwise() + (20 * full * side + deep * down)); };
  const auto friction = [&] { return potential.terms().back().force.norm(); };
  // Evaluates at a depth, and predicts the force after a motion from there.
  const auto predict = [&](double deep, double motion) {
    potential.evaluate(at(deep), solids, true);
    const ContactTerm normal = potential.terms()[0];
    potential.followFriction(std::vector<Eigen::Vector3d>(potential.terms().size(), motion * down));
    return std::max(0.0, (normal.force - normal.stiffness * motion * down).z());
  };

  const double predicted = predict(0.0, 0.002), first = friction();
  const double before = potential.evaluate(at(0.002), solids, false);
  EXPECT_NEAR(friction(), first, 1e-9 * first);   // without the stiffness nothing changes
  potential.evaluate(at(0.002), solids, true);
  EXPECT_GT(kFriction * predicted, 1.1 * first);
  EXPECT_NEAR(friction(), kFriction * predicted, 1e-9 * kFriction * predicted);
  EXPECT_NEAR(potential.evaluate(at(0.002), solids, false), before, 1e-14 * std::abs(before));   // round-off
  const double force = friction(), h = 1e-3 * full;
  const Eigen::Matrix3Xd there = at(0.002).colwise() + h * side, back = at(0.002).colwise() - h * side;
  EXPECT_NEAR(potential.evaluate(there, solids, false) - potential.evaluate(back, solids, false), 2 * h * force,
              1e-6 * 2 * h * force);
  predict(0.002, 4 * potential.smallestGap());   // too far
  potential.evaluate(at(0.002), solids, true);
  EXPECT_NEAR(friction(), force, 1e-9 * force);
  // Friction follows twenty times, so that a minimisation ends.
  int follows = 1;
  for (; follows < 40; ++follows)
  {
    const double wanted = predict(0.001, follows % 2 == 0 ? 0.001 : -0.001);
    potential.evaluate(at(0.001), solids, true);
    if (std::abs(friction() - kFriction * wanted) > 1e-3 * kFriction * wanted)
      break;
  }
  EXPECT_EQ(follows, 20);
  potential.beginSolution();   // lagFriction() still takes new forces over
  EXPECT_GT(potential.lagFriction(), 0.1);
}

/// Solutions alternate between a place below and a place above that of the balance, because each of them follows from
/// the friction before it. Damping brings the normal forces of friction near the mean.
TEST(ContactFriction, AlternatingForcesAreDamped)
{
  SegmentOnFloor on_floor;
  ContactPotential& potential = on_floor.potential;
  constexpr double kDeep = 0.0005;   // [m]
  const auto solve = [&](double deep) {
    potential.evaluate(on_floor.x.colwise() - Eigen::Vector3d(0, 0, deep), on_floor.solids, false);
    return potential.terms()[0].force.norm();
  };
  const auto friction = [&] { return potential.terms().back().force.norm(); };
  potential.begin(on_floor.x.colwise() - Eigen::Vector3d(1.0, 0, 0), on_floor.solids, SegmentOnFloor::kStep);   // slips
  const double low = solve(-kDeep), high = solve(kDeep), mean = 0.5 * (low + high);
  for (int k = 0; k < 4; ++k)
  {
    solve(k % 2 == 0 ? kDeep : -kDeep);
    potential.lagFriction();
  }
  solve(kDeep);
  EXPECT_LT(std::abs(friction() / SegmentOnFloor::kFriction - mean), 0.6 * (high - mean));   // 1 without damping
  potential.begin(on_floor.x, on_floor.solids, SegmentOnFloor::kStep);   // the next step begins undamped
  solve(kDeep);
  potential.lagFriction();
  EXPECT_EQ(potential.lagFriction(), 0.0);
}

/// Springs of friction go on with the force that the last step left, which normal forces limit but do not change, and
/// turn with what touches.
TEST(ContactFriction, SpringsLastFromStepToStep)
{
  SegmentOnFloor on_floor;
  Eigen::Matrix3Xd& x = on_floor.x;
  const std::vector<Pose>& solids = on_floor.solids;
  ContactPotential& potential = on_floor.potential;
  constexpr double kStep = SegmentOnFloor::kStep;
  const double full = gapOptions().slip_speed * kStep;
  const Eigen::Vector3d side(0.6, 0.8, 0);
  const auto forceAfter = [&](double slip) -> Eigen::Vector3d {
    potential.begin(x, solids, kStep);
    x.colwise() += slip * side;
    potential.evaluate(x, solids, false);
    const Eigen::Vector3d force = potential.terms().back().force;
    potential.keepSprings(solids);
    return force;
  };
  const Eigen::Vector3d first = forceAfter(0.4 * full);
  EXPECT_GT(first.norm(), 0.0);
  // slips are 1e-7 m of coordinates of 0.1 m
  EXPECT_LT((forceAfter(0.0) - first).norm(), 1e-9 * first.norm());   // nothing moves
  ASSERT_EQ(potential.springs().size(), 1u);
  EXPECT_LT((potential.springs()[0].tension + first).norm(), 1e-9 * first.norm());
  const double most = first.norm() / (1 - 0.6 * 0.6);   // the spring softens towards its largest force
  forceAfter(5 * full);                                 // slips
  EXPECT_NEAR(potential.springs()[0].tension.dot(side), most, 1e-9 * most);
  forceAfter(-1.5 * full);   // and back
  EXPECT_NEAR(potential.springs()[0].tension.dot(side), -0.75 * most, 1e-6 * most);
  potential.setStiffness(2.0 * potential.barrier(0).layers[0].stiffness);   // twice the normal force
  EXPECT_NEAR(forceAfter(0.0).norm(), 0.75 * most, 1e-6 * most);
  potential.setStiffness(0.1 * potential.barrier(0).layers[0].stiffness);   // a fifth of it
  EXPECT_NEAR(forceAfter(0.0).norm(), 0.2 * most, 1e-6 * most);

  const Pose turned{Eigen::Vector3d::Zero(), Eigen::Quaterniond(Eigen::AngleAxisd(0.3, Eigen::Vector3d::UnitZ()))};
  const Eigen::Vector3d before = potential.springs()[0].tension;
  potential.begin(x, solids, kStep);
  potential.evaluate(turned.orientation.toRotationMatrix() * x, {turned}, false);
  potential.keepSprings({turned});
  EXPECT_LT((potential.springs()[0].tension - turned.orientation * before).norm(), 1e-6 * most);

  potential.setSprings({});
  potential.begin(x, solids, kStep);
  potential.evaluate(x, solids, false);
  EXPECT_EQ(potential.terms().back().force.norm(), 0.0);

  ContactSurface surface = potential.surface();
  surface.objects[0].owner = 0;   // a strand of a thread, whose pieces change
  ContactPotential strand(surface, gapOptions());
  strand.begin(x, solids, kStep);
  strand.evaluate(x.colwise() + 0.4 * full * side, solids, false);
  strand.keepSprings(solids);
  EXPECT_TRUE(strand.springs().empty());
}

/// A contact that needs three quarters of the largest friction, from a slip that is far too large.
TEST(ContactFriction, NewtonFindsTheNarrowRangeInWhichAContactSticks)
{
  constexpr double kStep = 0.01, kFriction = 0.4;
  ContactSurface surface;
  Eigen::Matrix3Xd x;
  addCurve(surface, x, nodesAbout({0, 0, kCurveRadius + 0.008}, {0.3, 0, 0}, 1), kCurveRadius, kFriction);
  surface.solids.push_back({Plane{}, kFriction, {}});
  const std::vector<Pose> solids(1);
  ContactPotential potential(surface, gapOptions());
  potential.setStiffness(1.0);
  potential.begin(x, solids, kStep);
  potential.evaluate(x, solids, false);
  const double most = kFriction * potential.terms()[0].force.norm(), full = gapOptions().slip_speed * kStep;
  const double spring = most / (1e4 * full);   // a body that is easily moved
  const Eigen::Vector3d side(0.6, 0.8, 0);
  double slip = 50.0 * full, unbalanced = most;
  int iterations = 0;
  for (; iterations < 100; ++iterations)
  {
    potential.evaluate(x.colwise() + slip * side, solids, true);
    const ContactTerm& term = potential.terms().back();
    unbalanced = term.force.dot(side) + 0.75 * most - spring * slip;
    if (std::abs(unbalanced) < 1e-6 * most)   // slips are 1e-6 m of coordinates of 0.1 m
      break;
    const Eigen::Matrix3d stiffness = term.stiffness.selfadjointView<Eigen::Lower>();
    slip += unbalanced / (side.dot(stiffness * side) + spring);
  }
  EXPECT_LE(iterations, 10);   // with the secant after a jump 39
  EXPECT_LT(std::abs(unbalanced), 1e-6 * most);
  EXPECT_NEAR(slip, 0.5 * full, 1e-3 * full);   // the force of which is three quarters
}

TEST(ContactForces, FrictionBetweenRodsIsTheGradient)
{
  Rods rods = stackedRods({0.05, 0.01, 2 * kCurveRadius + 0.006}, {0.8, 0.3, 0.001}, 0.5);
  ContactPotential potential(rods.surface, gapOptions());
  potential.setStiffness(1.0);
  potential.begin(rods.x, {}, 0.01);
  Random random(2);
  for (Eigen::Index i = 0; i < rods.x.size(); ++i)
    rods.x(i) += random.uniform(-1e-6, 1e-6);
  potential.evaluate(rods.x, {}, false);
  const Eigen::Matrix3Xd g = gradient(potential, rods.x.cols());
  for (Eigen::Index i = 0; i < rods.x.size(); ++i)
  {
    constexpr double kStep = 1e-9;
    Eigen::Matrix3Xd plus = rods.x, minus = rods.x;
    plus(i) += kStep;
    minus(i) -= kStep;
    EXPECT_NEAR((potential.evaluate(plus, {}, false) - potential.evaluate(minus, {}, false)) / (2 * kStep), g(i),
                2e-5 * g.norm());
  }
}

}   // namespace
}   // namespace slender::test
