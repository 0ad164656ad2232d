// Rods with prescribed averages.
#include <cmath>
#include <limits>

#include <gtest/gtest.h>

#include "slender_sim/rod/averaged_rod.h"
#include "slender_sim/tracking/weak_constraints.h"

namespace slender {
namespace {

using Eigen::Matrix3Xd;
using Eigen::Vector3d;

class AveragedRodTest : public testing::Test
{
protected:
  static constexpr int kNodes = 25, kSegments = 4;

  void SetUp() override { build(false); }

  void build(bool closed)
  {
    nodes_.resize(3, kNodes);
    for (int i = 0; i < kNodes; ++i)
    {
      const double s = static_cast<double>(i) / (closed ? kNodes : kNodes - 1);
      nodes_.col(i) =
          closed ? Vector3d(0.2 * std::cos(2 * M_PI * s), 0.2 * std::sin(2 * M_PI * s), 0) : Vector3d(s, 0, 0);
    }
    const RodSection section{0.005, 0.005, 0.1, 200.0, 1e-3 * Eigen::Matrix2d::Identity(), 1e-3};
    RodModel model = buildRod("rod", nodes_, closed, std::vector<RodSection>(closed ? kNodes : kNodes - 1, section),
                              Vector3d::UnitZ(), !closed);
    model.mass_damping = 2.0;
    model_ = std::make_shared<const RodModel>(std::move(model));
    std::vector<PaintedRegion> regions;
    for (int r = 0; r < kSegments; ++r)
    {
      PaintedRegion region{"part " + std::to_string(r), {}, {}};
      for (int i = 6 * r; i <= 6 * r + 6; ++i)
        region.tracked.push_back(i);
      region.guide = region.tracked;
      regions.push_back(region);
    }
    const MassMatrix mass = hatMassMatrix(nodes_, closed);
    const WeakConstraints constraints(paintedRegions(regions, kNodes, kNodes), mass, mass);
    averages_ = std::make_shared<const AveragedRod::Averages>(constraints.matrix());
    time_.integrator = Integrator::implicit_euler;
    state_ = makeRodState(*model_, nodes_, Vector3d::UnitZ());
    inputs_ = RodInputs{};
  }

  double error(const Matrix3Xd& targets) const
  {
    return (state_.x * averages_->transpose() - targets).colwise().norm().maxCoeff();
  }

  Matrix3Xd nodes_;
  std::shared_ptr<const RodModel> model_;
  std::shared_ptr<const AveragedRod::Averages> averages_;
  TimeConfig time_;
  RodState state_;
  RodInputs inputs_;
};

TEST_F(AveragedRodTest, HasItsAveragesAndIsCarriedByThem)
{
  for (const bool closed : {false, true})
  {
    build(closed);
    AveragedRod rod(model_, averages_, time_);
    const Matrix3Xd start = nodes_ * averages_->transpose();
    Matrix3Xd targets = start;
    for (int k = 0; k < 1500; ++k)
    {
      const double t = std::min(0.01 * k, 5.0);
      for (int r = 0; r < kSegments; ++r)
        targets.col(r) =
            start.col(r) + Vector3d(0, 0.05 * std::sin(2 * t + r) * std::min(t, 1.0), 0.1 * std::min(t, 1.0));
      const StepReport report = rod.step(state_, inputs_, targets, 0.01);
      ASSERT_TRUE(report.ok) << closed << " " << k << ": " << report.message;
      ASSERT_LT(error(targets), 1e-13) << closed << " " << k;
    }
    // at rest, averages carry the weight
    EXPECT_LT(state_.v.cwiseAbs().maxCoeff(), 1e-4);
    EXPECT_LT((rod.averageForces().rowwise().sum() + model_->totalMass() * inputs_.gravity).norm(),
              1e-3 * 9.81 * model_->totalMass());
    EXPECT_GT((state_.x.row(2).array() - 0.1).abs().maxCoeff(), 1e-4);   // and it sags between them
  }
}

TEST_F(AveragedRodTest, MovesFreelyWhereAveragesDoNotForceIt)
{
  RodState free = state_;
  RodStepper stepper(model_, time_);
  AveragedRod rod(model_, averages_, time_);
  for (const bool held : {false, true})
  {
    if (held)
    {
      free = state_ = makeRodState(*model_, nodes_, Vector3d::UnitZ());
      state_.grasps = free.grasps = {makeGrasp(*model_, free, 0, 1, true)};
      inputs_.grasps = {{state_.grasps[0].X_WG, std::nullopt}};
    }
    for (int k = 0; k < 40; ++k)
    {
      ASSERT_TRUE(stepper.step(free, inputs_, 0.01).ok);
      const StepReport report = rod.step(state_, inputs_, free.x * averages_->transpose(), 0.01);
      ASSERT_TRUE(report.ok) << report.message;
      ASSERT_LT((state_.x - free.x).cwiseAbs().maxCoeff(), 1e-6) << held << " " << k;
      ASSERT_LT(rod.averageForces().cwiseAbs().maxCoeff(), 1e-4);
    }
    EXPECT_GT((free.x - nodes_).cwiseAbs().maxCoeff(), 0.05);
  }
}

TEST_F(AveragedRodTest, RefusesWithAReason)
{
  AveragedRod rod(model_, averages_, time_);
  const RodState before = state_;
  Matrix3Xd targets = nodes_ * averages_->transpose();
  const auto refused = [&](const Matrix3Xd& bad, AveragedRod& by) {
    const StepReport report = by.step(state_, inputs_, bad, 0.01);
    EXPECT_FALSE(report.ok);
    EXPECT_TRUE(state_.x == before.x && state_.v == before.v);
    return report.message;
  };
  EXPECT_NE(refused(targets.leftCols(3), rod).find("3 for 4"), std::string::npos);
  Matrix3Xd bad = targets;
  bad(1, 2) = std::numeric_limits<double>::quiet_NaN();
  EXPECT_NE(refused(bad, rod).find("averages"), std::string::npos);

  AveragedRod::Averages twice(2, kNodes);
  twice.insert(0, 3) = twice.insert(1, 3) = 1.0;
  AveragedRod dependent(model_, std::make_shared<const AveragedRod::Averages>(twice), time_);
  EXPECT_NE(refused(targets.leftCols(2), dependent).find("depend on each other"), std::string::npos);

  EXPECT_TRUE(rod.step(state_, inputs_, targets, 0.01).ok);

  AveragedRod::Averages other = *averages_;
  other *= 2.0;
  EXPECT_THROW(AveragedRod(model_, std::make_shared<const AveragedRod::Averages>(other), time_), std::invalid_argument);
  EXPECT_THROW(AveragedRod(model_, std::make_shared<const AveragedRod::Averages>(4, kNodes - 1), time_),
               std::invalid_argument);
  EXPECT_THROW(AveragedRod(model_, nullptr, time_), std::invalid_argument);
  time_.integrator = Integrator::tr_bdf2;
  EXPECT_THROW(AveragedRod(model_, averages_, time_), std::invalid_argument);
}

}   // namespace
}   // namespace slender
