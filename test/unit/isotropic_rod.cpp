// The isotropic formulation: its gradient against differences of its energy, its twists against the frames it gives.
#include "slender_sim/rod/isotropic_rod.h"

#include <gtest/gtest.h>

#include "slender_sim/geometry/rotation.h"
#include "test/support/rods.h"

namespace slender::test {
namespace {

struct IsotropicCase
{
  const char* name;
  bool closed;
  int nodes;
  std::vector<std::pair<int, int>> grasps;
  double twist;   ///< imposed on every held span by turning its sections [rad]
};

void PrintTo(const IsotropicCase& c, std::ostream* out) { *out << c.name; }

class Isotropic : public ::testing::TestWithParam<IsotropicCase>
{
protected:
  Isotropic() : random_(7)
  {
    const IsotropicCase& c = GetParam();
    nodes_ = wigglyNodes(c.nodes, c.closed, random_);
    std::vector<RodSection> sections;
    for (int j = 0; j < (c.closed ? c.nodes : c.nodes - 1); ++j)
      sections.push_back(modulusSection(random_.uniform(1, 2), random_.uniform(0.5, 1), random_.uniform(2, 4), 1.0));
    RodModel model = buildRod("rod", nodes_, c.closed, sections, Vector3d::Zero(), true);
    rod_ = std::make_unique<Rod>(model, nodes_);
    for (const auto& [first, last] : c.grasps)
      rod_->hold(first, last);
    for (std::size_t k = 0; k < c.grasps.size(); ++k)
      for (int side = 0; side < 2; ++side)
        rod_->state.grasps[k].section_twist[side] += c.twist * (k + 0.3 * side);
    if (c.closed && c.grasps.empty())
      rod_->model->rest_twist[3] = -c.twist;   // a loop glued after a turn
    system_ = std::make_unique<RodSystem>(*rod_->model);
    isotropic_ = std::make_unique<IsotropicRod>(*rod_->model, *system_);
    for (const GraspState& g : rod_->state.grasps)
      poses_.push_back(g.X_WG);
  }
  bool held(int node) const
  {
    for (const auto& [first, last] : GetParam().grasps)
      if (node >= first && node <= last)
        return true;
    return false;
  }
  /// The state with one node moved, frames and twists following.
  RodState moved(int node, int k, double by)
  {
    isotropic_->evaluate(rod_->state);
    RodState to = rod_->state;
    to.x(k, node) += by;
    EXPECT_EQ(isotropic_->settle(rod_->state, poses_, to), StepFailure::none);
    return to;
  }

  Random random_;
  Matrix3Xd nodes_;
  std::unique_ptr<Rod> rod_;
  std::unique_ptr<RodSystem> system_;
  std::unique_ptr<IsotropicRod> isotropic_;
  std::vector<Pose> poses_;
};

TEST_P(Isotropic, GradientIsTheEnergysDerivative)
{
  rod_->state = moved(0, 0, 0.0);
  const double energy = isotropic_->evaluate(rod_->state).energy();
  EXPECT_GT(energy, 0.1);
  std::vector<Vector3d> gradient(GetParam().nodes);
  for (int i = 0; i < GetParam().nodes; ++i)
    gradient[i] = isotropic_->nodeGradient(i);
  const double h = 1e-5;
  for (int i = 0; i < GetParam().nodes; ++i)
    for (int k = 0; k < 3; ++k)
    {
      if (held(i))
        continue;
      const double up = isotropic_->evaluate(moved(i, k, h)).energy(),
                   down = isotropic_->evaluate(moved(i, k, -h)).energy();
      // h^2 times third derivatives of about 100
      EXPECT_NEAR(gradient[i][k], (up - down) / (2 * h), 1e-7) << i << " " << k;
    }
}

TEST_P(Isotropic, FramesHaveTheTwists)
{
  RodState s = rod_->state;
  for (int round = 0; round < 5; ++round)
  {
    isotropic_->evaluate(s);
    RodState to = s;
    for (int i = 0; i < GetParam().nodes; ++i)
      if (!held(i))
        to.x.col(i) += random_.vector(0.05);
    ASSERT_EQ(isotropic_->settle(s, poses_, to), StepFailure::none);
    s = to;
    const int n = GetParam().nodes, edges = rod_->model->edges();
    const auto tangent = [&](int j) { return Vector3d((s.x.col((j + 1) % n) - s.x.col(j)).normalized()); };
    for (int j = 0; j < edges; ++j)
    {
      EXPECT_NEAR(s.d1.col(j).norm(), 1.0, 1e-12);
      EXPECT_NEAR(s.d1.col(j).dot(tangent(j)), 0.0, 1e-12);
    }
    for (int i = GetParam().closed ? 0 : 1; i < (GetParam().closed ? n : n - 1); ++i)
    {
      if (held(i))
        continue;
      const int e = (i + edges - 1) % edges;
      const double angle = signedAngle(parallelTransport(s.d1.col(e), tangent(e), tangent(i)), s.d1.col(i), tangent(i));
      EXPECT_NEAR(std::remainder(angle - s.twist[i], 2 * M_PI), 0.0, 1e-11) << i;
    }
    for (std::size_t k = 0; k < s.grasps.size(); ++k)
      for (int side = 0; side < 2; ++side)
      {
        const GraspState& g = s.grasps[k];
        const int node = side ? g.last_node : g.first_node;
        if (!GetParam().closed && node == (side ? n - 1 : 0))
          continue;
        const int edge = side ? node : (node + edges - 1) % edges;
        const Eigen::Matrix3d section = poses_[k].orientation * g.section_G[side];
        const Vector3d carried = parallelTransport(section.col(1), section.col(0), tangent(edge));
        const double angle = signedAngle(carried, s.d1.col(edge), tangent(edge)) * (side ? 1 : -1);
        EXPECT_NEAR(std::remainder(angle - g.section_twist[side], 2 * M_PI), 0.0, 1e-11) << k << " " << side;
      }
  }
}

TEST_P(Isotropic, AgreesWithTheGeneralFormulation)
{
  // Where nothing twists both are the same energy; the general one's mean curvature loses cos^2(m/2) when a joint
  // twists by m.
  if (GetParam().twist != 0 || GetParam().closed)
    return;
  rod_->state = moved(0, 0, 0.0);
  const RodEvaluation isotropic = isotropic_->evaluate(rod_->state);
  system_->load(rod_->state);
  for (int i = 0; i < GetParam().nodes; ++i)
    system_->setInertia(i, 0.0, Vector3d::Zero(), Vector3d::Zero());
  system_->placeGrasps(poses_);
  const RodEvaluation general = system_->evaluate(false);
  double twist = rod_->state.twist.cwiseAbs().maxCoeff();
  for (const GraspState& g : rod_->state.grasps)
    twist = std::max({twist, std::abs(g.section_twist[0]), std::abs(g.section_twist[1])});
  const double bound = 0.25 * twist * twist + 1e-12;
  EXPECT_NEAR(isotropic.bend_twist, general.bend_twist, bound * general.bend_twist);
  EXPECT_NEAR(isotropic.stretch, general.stretch, 1e-12);
}

const IsotropicCase kIsotropicCases[] = {
    {"free", false, 12, {}, 0.0},
    {"one_end", false, 40, {{0, 0}}, 0.0},
    {"other_end", false, 40, {{38, 39}}, 0.0},
    {"middle", false, 41, {{20, 22}}, 0.0},
    {"both_ends", false, 45, {{0, 1}, {44, 44}}, 9.0},
    {"three", false, 30, {{2, 2}, {11, 12}, {25, 25}}, -4.0},
    {"ring", true, 36, {}, 7.0},
    {"ring_held_once", true, 33, {{5, 6}}, 3.0},
    {"ring_held_twice", true, 20, {{0, 0}, {9, 11}}, 5.0},
};
INSTANTIATE_TEST_SUITE_P(Rods, Isotropic, ::testing::ValuesIn(kIsotropicCases),
                         [](const auto& info) { return std::string(info.param.name); });

/// A wiggly rod pinned at its first node, with and without material frames, in explicit steps.
class FramelessRod : public ::testing::Test
{
protected:
  FramelessRod()
  {
    Random random(3);
    nodes_ = wigglyNodes(20, false, random);
    RodModel model = openRod(nodes_, modulusSection(1.0, 0.7, 200.0, 1.0), true);
    model.isotropic = true;
    bare_ = std::make_unique<Rod>(model, nodes_);
    bare_->hold(0, 0, false);
    framed_ = std::make_unique<Rod>(*bare_);
    addFrames(model, framed_->state);
  }
  void step(int steps)
  {
    for (Rod* rod : {bare_.get(), framed_.get()})
    {
      RodStepper stepper(rod->model, withIntegrator(Integrator::symplectic_euler));
      for (int k = 0; k < steps; ++k)
      {
        const StepReport report = stepper.step(rod->state, rod->inputs, 1e-3);
        ASSERT_TRUE(report.ok) << report.message;
      }
    }
  }
  /// Largest difference of the two rods' frames.
  double frameError() const
  {
    std::vector<Eigen::Matrix3d> frames;
    forEachFrame(*bare_->model, bare_->state, [&](int, const Eigen::Matrix3d& axes) { frames.push_back(axes); });
    double worst = 0;
    forEachFrame(*framed_->model, framed_->state,
                 [&](int j, const Eigen::Matrix3d& axes) { worst = std::max(worst, (axes - frames[j]).norm()); });
    return worst;
  }
  Matrix3Xd nodes_;
  std::unique_ptr<Rod> bare_, framed_;
};

TEST_F(FramelessRod, MovesAsTheFramedOneAndShowsTheSameFrames)
{
  step(500);
  EXPECT_FALSE(bare_->state.framed());
  EXPECT_GT((bare_->state.x - nodes_).norm(), 0.1);
  EXPECT_EQ(bare_->state.x, framed_->state.x);
  EXPECT_EQ(framed_->state.twist.norm(), 0.0);
  EXPECT_LT(frameError(), 1e-11);   // round-off of 500 steps and 19 edges
}

TEST_F(FramelessRod, GetsFramesWhenOneIsHeld)
{
  step(200);
  for (Rod* rod : {bare_.get(), framed_.get()})
  {
    const int grasp = rod->hold(19, 19), first = rod->hold(5, 7);
    Eigen::Quaterniond& orientation = rod->inputs.grasps[grasp].X_WG.orientation;
    orientation = orientation * Eigen::AngleAxisd(0.3, Vector3d::UnitX());
    EXPECT_EQ(first, 2);
  }
  EXPECT_FALSE(bare_->state.framed());
  const RodStepper stepper(bare_->model, withIntegrator(Integrator::symplectic_euler));
  EXPECT_NEAR(stepper.energies(bare_->state, Vector3d::Zero()).twist, 0.0, 1e-20);
  step(50);
  EXPECT_TRUE(bare_->state.framed());
  EXPECT_GT(bare_->state.twist.cwiseAbs().maxCoeff(), 1e-3);
  EXPECT_LT((bare_->state.x - framed_->state.x).norm(), 1e-11);   // frames taken up that differ by round-off
  EXPECT_LT(frameError(), 1e-11);
}

TEST_F(FramelessRod, NodesThatMeetAreRefusedAndTheStateKept)
{
  for (Rod* rod : {bare_.get(), framed_.get()})
  {
    const int a = rod->hold(9, 9, false), b = rod->hold(10, 10, false);
    const GraspTarget back = rod->inputs.grasps[b];
    // one edge of no length, and so without a tangent
    rod->inputs.grasps[b].X_WG.position = rod->inputs.grasps[a].X_WG.position;
    RodStepper stepper(rod->model, withIntegrator(Integrator::symplectic_euler));
    const RodState before = rod->state;
    EXPECT_FALSE(stepper.step(rod->state, rod->inputs, 1e-3).ok);
    EXPECT_EQ(rod->state.x, before.x);
    rod->inputs.grasps[b] = back;
    EXPECT_TRUE(stepper.step(rod->state, rod->inputs, 1e-3).ok);
  }
}

TEST_F(FramelessRod, StatesThatDoNotFitAreRefused)
{
  const RodState good = bare_->state;
  const auto refusal = [&](const RodState& state) {
    bare_->state = state;
    return RodStepper(bare_->model, withIntegrator(Integrator::symplectic_euler))
        .step(bare_->state, bare_->inputs, 1e-3)
        .message;
  };
  EXPECT_EQ(refusal(good), "");
  RodState along = good, twisted = good;
  along.director = (good.x.col(1) - good.x.col(0)).normalized();
  twisted.twist.setZero(20);
  for (const RodState& bad : {along, twisted})
    EXPECT_NE(refusal(bad).find("material frames"), std::string::npos);
  bare_->state = good;
  bare_->model->rest_twist[4] = 0.1;
  EXPECT_NE(refusal(good).find("material frames"), std::string::npos);
}

TEST_F(FramelessRod, OthersHaveFrames)
{
  RodModel model = *bare_->model;
  EXPECT_TRUE(makeRodState(model, nodes_, Vector3d::Zero(), 0.1).framed());
  model.rest_twist[4] = 0.1;
  EXPECT_TRUE(makeRodState(model, nodes_, Vector3d::Zero()).framed());
  model = *bare_->model;
  model.isotropic = false;
  EXPECT_TRUE(makeRodState(model, nodes_, Vector3d::Zero()).framed());
  // and where the equations are the general ones, as in implicit steps
  RodStepper stepper(bare_->model, withIntegrator(Integrator::implicit_euler));
  ASSERT_TRUE(stepper.step(bare_->state, bare_->inputs, 1e-3).ok);
  EXPECT_TRUE(bare_->state.framed());
}

}   // namespace
}   // namespace slender::test
