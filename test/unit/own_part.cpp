// A kind of part that the package does not have, in an island with a rod and a cloth (docs/architecture.md).
#include <cmath>
#include <string>

#include <gtest/gtest.h>

#include "test/support/cloth_island.h"
#include "test/support/rods.h"

namespace slender::test {
namespace {

/// A ball of mass m [kg] at x [m] on a spring of stiffness k [N/m] to its anchor, by implicit Euler. It has three
/// unknowns, and its surface is one segment between two points at the same place.
class SpringBall : public Part
{
public:
  Vector3d x, v{0, 0, 0};   ///< where the last accepted substep ended [m], [m/s]
  Vector3d anchor;          ///< [m]
  double mass = 0.02, stiffness = 2.0, radius = 0.02;
  Vector3d gravity{0, 0, -9.81};   ///< [m/s^2]

  explicit SpringBall(const Vector3d& at) : x(at), anchor(at) {}

  // ---- surface
  int points() const override { return 2; }
  void gather(Eigen::Matrix3Xd& all) const override { all.col(first_point) = all.col(first_point + 1) = trial_; }
  void gatherStart(Eigen::Matrix3Xd& all) const override { all.col(first_point) = all.col(first_point + 1) = x; }
  int base(int) const override { return kPrescribed - 1; }   // both points have the same unknowns
  void addColumns(int, int component, double weight, Columns& row) const override
  {
    row.push(offset + component, weight);
  }
  void addForce(int, const Vector3d& force) override { gradient_ -= force; }
  Vector3d move(int) const override { return direction_; }
  void addSurface(ContactSurface& surface) const override
  {
    surface.segments.push_back({surface.points, surface.points + 1, radius, static_cast<int>(surface.objects.size())});
    surface.points += 2;
    surface.objects.emplace_back();   // with friction 0.3
  }
  BoundingBox surfaceBox(double ahead) const override
  {
    BoundingBox box = BoundingBox::empty();
    box.include(x + ahead * v);
    box.enlarge(radius);
    return box;
  }

  // ---- unknowns and configuration
  bool numberUnknowns() override { return true; }   // they never change
  int unknowns() const override { return 3; }
  void moveAlong(double alpha) override { trial_ = base_ + alpha * direction_; }
  void accept() override { base_ = trial_; }
  void saveBase() override { saved_ = base_; }
  void restoreBase() override { base_ = saved_; }
  void retreat(double share) override { trial_ = base_ + share * (trial_ - base_); }

  // ---- equations
  void evaluate(bool, const HessianShift& shift) override
  {
    const Vector3d moved = trial_ - free_, stretched = trial_ - anchor;
    evaluation = {};
    evaluation.potential = 0.5 * inertia() * moved.squaredNorm() + 0.5 * stiffness * stretched.squaredNorm();
    gradient_ = inertia() * moved + stiffness * stretched;
    hessian_ = (inertia() * (1.0 + shift.position) + stiffness) * Eigen::Matrix3d::Identity();
    for (const ContactTerm* term : own_terms)   // with what moves as prescribed
    {
      const double weight = term->weight[0] + term->weight[1];
      gradient_ -= weight * term->force;
      hessian_ += weight * weight * term->stiffness;
    }
  }
  void solve() override { direction_ = -hessian_.ldlt().solve(gradient_); }
  void notePattern(SharedMatrix& matrix) override
  {
    each([&](int i, int j) { matrix.note(offset + i, offset + j); });
  }
  void addHessian(SharedMatrix& matrix, const HessianShift&) override
  {
    each([&](int i, int j) { matrix.add(offset + i, offset + j, hessian_(i, j)); });
  }
  void takeGradient(double* right) const override { Eigen::Map<Vector3d>(right + offset) = -gradient_; }
  void takeDirection(const double* solution) override { direction_ = Eigen::Map<const Vector3d>(solution + offset); }
  double incrementSize(double length) const override { return direction_.norm() / std::min(length, radius); }
  double slope() const override { return gradient_.dot(direction_); }
  double residual() const override { return gradient_.norm(); }
  double forceScale() const override { return mass * gravity.norm() + stiffness * (trial_ - anchor).norm(); }

  // ---- its steps
  StepFailure beginSubstep(const StepPlan&, const Substep& substep) override
  {
    h_ = substep.length;
    free_ = x + h_ * v + h_ * h_ * gravity;
    base_ = x;
    trial_ = x + h_ * v;
    return StepFailure::none;
  }
  void acceptSubstep(const Substep&) override
  {
    v = (trial_ - x) / h_;
    x = trial_;
  }
  void refuse(StepFailure failure, double, StepReport& report) const override
  {
    report.ok = false;
    report.failure = failure;
    report.message = "the ball on the spring has no solution: use a shorter step";
  }

private:
  double inertia() const { return mass / (h_ * h_); }
  template <class F>
  void each(F&& f) const
  {
    for (int i = 0; i < 3; ++i)
      for (int j = 0; j <= i; ++j)
        f(i, j);
  }

  double h_ = 1.0;   ///< of the substep [s]
  Vector3d base_, trial_, saved_, free_, gradient_, direction_{0, 0, 0};
  Eigen::Matrix3d hessian_;
};

/// A ball that says how much it is folded. While it is folded sharply, no step succeeds.
class FoldedBall final : public SpringBall
{
public:
  double fold;   ///< see Part::sharpestFold()
  bool mended = false;
  std::string* calls = nullptr;   ///< gets a letter for each call at the end of a substep

  FoldedBall(const Vector3d& at, double how_sharp) : SpringBall(at), fold(how_sharp) {}
  StepFailure beginSubstep(const StepPlan& plan, const Substep& substep) override
  {
    SpringBall::beginSubstep(plan, substep);
    return fold < 0.1 && !mended ? StepFailure::folded_back : StepFailure::none;
  }
  double sharpestFold() const override { return mended ? 1.0 : fold; }
  bool mend() override { return mended = true; }
  StepFailure finishSubstep(StepReport&) override { return note('f'); }
  StepFailure changeMesh() override { return note('m'); }

private:
  StepFailure note(char call)
  {
    if (calls)
      calls->push_back(call);
    return StepFailure::none;
  }
};

StepReport step(ClothIsland& island)
{
  const StepReport report = island.step();
  EXPECT_TRUE(report.ok) << report.message;
  return report;
}

/// Alone it solves with its own matrix. Implicit Euler of a linear spring has a closed form.
TEST(OwnPart, SwingsOnItsOwn)
{
  SpringBall ball({0, 0, 0});
  ClothIsland island(kIslandStep, kIslandGap);
  island.others = {&ball};
  double x = 0.0, v = 0.0;
  for (int k = 0; k < 200; ++k)
  {
    step(island);
    v = (v - kIslandStep * (9.81 + ball.stiffness / ball.mass * x)) /
        (1.0 + kIslandStep * kIslandStep * ball.stiffness / ball.mass);
    x += kIslandStep * v;
    EXPECT_NEAR(ball.x.z(), x, 1e-12);   // round-off of a tenth of a metre
  }
}

/// What is merely bent does not change if a step fails because of a fold elsewhere.
TEST(OwnPart, TheSharpestFoldIsMended)
{
  FoldedBall bent({0, 0, 0}, 0.8), folded({1, 0, 0}, 0.01);
  ClothIsland island(kIslandStep, kIslandGap);
  island.others = {&bent, &folded};
  EXPECT_EQ(step(island).mended_folds, 1);
  EXPECT_TRUE(folded.mended);
  EXPECT_FALSE(bent.mended);
}

/// A mesh changes when all parts are where the substep ends.
TEST(OwnPart, MeshesChangeAfterAllPartsHaveMoved)
{
  std::string calls;
  FoldedBall a({0, 0, 0}, 1.0), b({1, 0, 0}, 1.0);
  a.calls = b.calls = &calls;
  ClothIsland island(kIslandStep, kIslandGap);
  island.others = {&a, &b};
  step(island);
  EXPECT_EQ(calls, "ffmm");
}

/// A ball that counts how often Newton's method evaluates it.
class CountingBall final : public SpringBall
{
public:
  int evaluations = 0;
  using SpringBall::SpringBall;
  void evaluate(bool with_hessian, const HessianShift& shift) override
  {
    ++evaluations;
    SpringBall::evaluate(with_hessian, shift);
  }
};

/// What touches nothing arrives after a few iterations. Then it is left alone, and contact elsewhere goes on.
TEST(OwnPart, SettlesWhileOthersTouch)
{
  CountingBall alone({0, 0, 0.5}), upper({1, 0, 0.041}), lower({1, 0, 0});
  upper.v = {0, 0, -3};
  upper.gravity = lower.gravity.setZero();
  ClothIsland island(kIslandStep, kIslandGap);
  island.others = {&alone, &upper, &lower};
  double v = 0.0, z = 0.5;
  for (int k = 0; k < 5; ++k)
  {
    step(island);
    v = (v - kIslandStep * (9.81 + alone.stiffness / alone.mass * (z - 0.5))) /
        (1.0 + kIslandStep * kIslandStep * alone.stiffness / alone.mass);
    z += kIslandStep * v;
    EXPECT_NEAR(alone.x.z(), z, 1e-12);   // round-off: its equation is linear
  }
  EXPECT_LT(lower.v.z(), -0.5);
  EXPECT_GT(lower.evaluations, 50);
  EXPECT_LT(alone.evaluations, lower.evaluations / 2);
}

/// Two balls that rest against each other, pressed together by their springs, settle although they touch. Two others
/// collide meanwhile. The motion of the first two hardly depends on that: by as much as a solution is resolved.
TEST(OwnPart, AGroupSettlesWhileAnotherOneGoesOn)
{
  const auto run = [](double speed, int& quiet, int& busy) {
    CountingBall a({0, 0, 0}), b({0, 0, 0.0405}), upper({1, 0, 0.041}), lower({1, 0, 0});
    a.anchor.z() = 0.01;   // presses
    upper.v = {0, 0, -speed};
    for (CountingBall* ball : {&a, &b, &upper, &lower})
      ball->gravity.setZero();
    ClothIsland island(kIslandStep, kIslandGap);
    island.others = {&a, &b, &upper, &lower};
    for (int k = 0; k < 5; ++k)
      step(island);
    quiet = a.evaluations;
    busy = lower.evaluations;
    return Eigen::Vector2d(a.x.z(), b.x.z());
  };
  int alone = 0, beside = 0, few = 0, many = 0;
  const Eigen::Vector2d expected = run(0.0, alone, few), found = run(3.0, beside, many);
  EXPECT_GT(expected[1] - expected[0], 0.04);   // They touch, and do not overlap.
  EXPECT_LT(expected[1] - expected[0], 0.04 + kIslandGap);
  EXPECT_GT(many, few + 20);
  EXPECT_LT(beside, many - 20);
  EXPECT_LT((expected - found).cwiseAbs().maxCoeff(), 5e-3 * kIslandGap);   // A solution is resolved to 1e-3 of it.
}

/// A ball that slides over another one in a collision gets the friction of the normal force that it feels. Several
/// solutions find the two forces, and the balls may not settle before.
TEST(OwnPart, SlidesWithCoulombsFriction)
{
  for (const Vector3d& thrown : {Vector3d(2, 0, -1), Vector3d(1, 0, -0.3), Vector3d(0, 4, -4), Vector3d(0, 1, -0.2)})
  {
    SpringBall lower({0, 0, 0}), upper({0, 0, 0.0405});
    upper.v = thrown;
    for (SpringBall* ball : {&lower, &upper})
    {
      ball->gravity.setZero();
      ball->stiffness = 1e-3;   // so soft that it does not count here
    }
    ClothIsland island(kIslandStep, kIslandGap);
    island.others = {&lower, &upper};
    step(island);
    const Vector3d impulse = upper.mass * (upper.v - thrown);
    const Vector3d normal = (upper.x - lower.x).normalized(), along = impulse - normal.dot(impulse) * normal;
    EXPECT_GT(normal.dot(impulse), 0.1 * upper.mass * -thrown.z());
    // Forces are resolved to a hundredth. Friction acts across the normal of the last solution but one.
    EXPECT_NEAR(along.norm() / normal.dot(impulse), 0.3, 0.01) << thrown.transpose();
  }
}

/// Twists a straight rod at one end, beside two balls of which one flies at the other with this speed [m/s]. Returns
/// the twist.
Eigen::VectorXd twistBeside(double speed, int& evaluations)
{
  CountingBall above({1, 0, 0.041}), below({1, 0, 0});
  above.v = {0, 0, -speed};
  above.gravity = below.gravity.setZero();
  ClothIsland island(kIslandStep, kIslandGap);
  island.gravity.setZero();
  island.others = {&above, &below};
  const Matrix3Xd nodes = straightNodes(9, 0.4, {0, 0, 0});
  const auto rod = std::make_shared<RodModel>(openRod(nodes, roundSection(4e-3, 1e6, 1000.0)));
  RodState state = makeRodState(*rod, nodes, Vector3d::Zero());
  for (const int edge : {0, 7})
    state.grasps.push_back(makeGrasp(*rod, state, edge, edge + 1, true));
  island.addRod(rod, state);
  for (int k = 0; k < 4; ++k)
  {
    island.rods[0].inputs.grasps.clear();
    for (const GraspState& grasp : state.grasps)
      island.rods[0].inputs.grasps.push_back({grasp.X_WG, {}});
    island.rods[0].inputs.grasps[1].X_WG.orientation =
        Eigen::AngleAxisd(0.1 * k, Vector3d::UnitX()) * state.grasps[1].X_WG.orientation;
    step(island);
  }
  evaluations = below.evaluations;
  return island.rods[0].state.twist;
}

/// The rod needs one iteration a step. It settles with its twist, while the balls touch and go on.
TEST(OwnPart, ARodSettlesWithItsTwist)
{
  int few = 0, many = 0;
  const Eigen::VectorXd alone = twistBeside(0.0, few), beside = twistBeside(3.0, many);
  EXPECT_GT(many, few + 10);
  ASSERT_GT(alone.size(), 0);
  EXPECT_NEAR(alone.sum(), 0.3, 1e-9);
  EXPECT_LT((alone - beside).cwiseAbs().maxCoeff(), 1e-9);   // the equation of the twist is linear
}

/// It flies against a rod and a cloth. What it loses they gain, up to Newton's tolerance, and nothing passes through.
TEST(OwnPart, SharesAnIslandWithARodAndACloth)
{
  SpringBall ball({0.003, 0.004, 0.028});
  ball.stiffness = 0.0;
  ball.gravity.setZero();
  ball.v = {0, 0, -2};
  ClothIsland island(kIslandStep, kIslandGap);
  island.gravity.setZero();
  island.others = {&ball};
  const Matrix3Xd nodes = straightNodes(8, 0.2, {-0.1, 0, 0});
  const auto rod = std::make_shared<RodModel>(openRod(nodes, roundSection(4e-3, 1e6, 1000.0)));
  island.addRod(rod, makeRodState(*rod, nodes, Vector3d::Zero()));
  const auto cloth = cotton(0.3, 6);
  island.addCloth(cloth, centred(*cloth, {0, 0, -0.012}), 2e-3);
  const auto momentum = [&] {
    Vector3d sum = ball.mass * ball.v;
    for (Eigen::Index i = 0; i < rod->mass.size(); ++i)
      sum += rod->mass[i] * island.rods[0].state.v.col(i);
    for (Eigen::Index i = 0; i < cloth->mass.size(); ++i)
      sum += cloth->mass[i] * island.cloths[0].state.v.col(i);
    return sum;
  };
  const Vector3d before = momentum();
  for (int k = 0; k < 15; ++k)
  {
    step(island);
    EXPECT_GT(island.clearance(), 0.0);
  }
  EXPECT_GT(ball.v.z(), -1.6);                                    // the rod took a part of its momentum
  EXPECT_LT(island.cloths[0].state.v.row(2).minCoeff(), -0.01);   // and gave of it to the cloth
  EXPECT_LT((momentum() - before).norm(), 1e-4 * before.norm());
}

/// It falls on a rope that is held at its ends, and stays there.
TEST(OwnPart, FallsOnARope)
{
  SpringBall ball({0.2, 0, 0.06});
  ball.stiffness = 0.1;   // bears 2 % of the weight
  ClothIsland island(kIslandStep, kIslandGap);
  island.others = {&ball};
  const Matrix3Xd nodes = straightNodes(21, 0.4, {0, 0, 0});
  auto rod = std::make_shared<RodModel>(openRod(nodes, roundSection(4e-3, 1e6, 1000.0)));
  rod->mass_damping = 5.0;
  RodState state = makeRodState(*rod, nodes, Vector3d::Zero());
  for (const int node : {0, 20})
    state.grasps.push_back(makeGrasp(*rod, state, node, node, true));
  island.addRod(rod, state);
  for (const GraspState& grasp : state.grasps)
    island.rods[0].inputs.grasps.push_back({grasp.X_WG, {}});
  for (int k = 0; k < 400; ++k)
    step(island);
  const Vector3d middle = island.rods[0].state.x.col(10);
  EXPECT_NEAR(ball.x.z() - middle.z(), ball.radius + 4e-3, kIslandGap + 1e-4);   // within the barrier's range
  EXPECT_LT(ball.v.norm(), 0.01);
}

}   // namespace
}   // namespace slender::test
