#include "slender_sim/scene/limit_watch.h"

#include <cmath>
#include <limits>

#include <gtest/gtest.h>

#include "slender_sim/scene/reader.h"

/// Limits of a scene: when an excursion begins and ends, and what `on_limit` does.
namespace slender {
namespace {

/// A cable whose right end goes away at 1 m/s for a second, and comes back.
std::string pulled(const std::string& limits, const std::string& grasp_limits = "{}")
{
  return R"(
gravity: [0, 0, 0]
time: {step: 0.01, duration: 2, integrator: implicit_euler}
limits: )" +
         limits + R"(
rods:
  - name: cable
    centerline: {straight: {from: [0, 0, 0], to: [1, 0, 0], edges: 10}}
    cross_section: {radius: 0.01}
    material: {density: 1000, youngs_modulus: 1.0e5}
    damping: {mass: 20}
    grasps:
      left: {edges: [0], limits: )" +
         grasp_limits + R"(}
      right: {edges: [-1], motion: {table: [[0, 1, 0, 0, 0, 0, 0, 1], [0.2, 1.2, 0, 0, 0, 0, 0, 1], [0.8, 1.8, 0, 0, 0, 0, 0, 1],
                                            [1, 2, 0, 0, 0, 0, 0, 1], [1.2, 1.8, 0, 0, 0, 0, 0, 1], [1.8, 1.2, 0, 0, 0, 0, 0, 1], [2, 1, 0, 0, 0, 0, 0, 1]]}}
)";
}

/// Runs a scene under its watch as `simulate` and the nodes do.
struct WatchedRun
{
  explicit WatchedRun(const std::string& scene) : simulation(parseScene(scene)), watch(simulation) {}

  /// Goes on to `time` [s]; ends early when the watch stops the run.
  void to(double time)
  {
    while (simulation.state().time < time - 0.5 * simulation.config().time.step && watch.stopped().empty())
    {
      SceneInputs inputs = simulation.defaultInputs();
      take(watch.checkInputs(inputs));
      if (!watch.stopped().empty())
        return;
      const StepReport report = simulation.step(inputs);
      ASSERT_TRUE(report.ok) << report.message;
      take(watch.checkStep());
    }
  }
  void take(const std::vector<LimitExcess>& begun)
  {
    all.insert(all.end(), begun.begin(), begun.end());
    for (const LimitWatch::Release& release : watch.released())
    {
      released.push_back(release.grasp);
      EXPECT_NE(release.why.find(" exceeds limits."), std::string::npos) << release.why;
    }
  }
  double end() const { return simulation.state().rods[0].x(0, 10); }

  Simulation simulation;
  LimitWatch watch;
  std::vector<LimitExcess> all;
  std::vector<int> released;
};

/// The limit that the cable's first excursion from the default limits exceeds. The speed of its end has no limit.
double defaultStrainLimit(const std::string& material)
{
  std::string scene = pulled("{speed: none}");
  const std::string own = "{density: 1000, youngs_modulus: 1.0e5}";
  scene.replace(scene.find(own), own.size(), material);
  scene.replace(scene.find("gravity: [0, 0, 0]"), 18, "gravity: [0, 0, -9.81]");
  WatchedRun run(scene);
  run.to(1.0);
  return run.all.empty() ? 0.0 : run.all[0].limit;
}

TEST(Limits, ofStrainFollowTheMaterial)
{
  EXPECT_EQ(defaultStrainLimit("{density: 1000, youngs_modulus: 1.0e6}"), 0.5);
  EXPECT_EQ(defaultStrainLimit("{density: 1000, youngs_modulus: 2.0e9}"), 0.05);
  EXPECT_EQ(defaultStrainLimit("{density: 1000, youngs_modulus: 1.0e5, inextensible: true}"), 0.01);
  // 1e6 N over the section's 3.14e-4 m^2 are 3.2 GPa
  EXPECT_EQ(defaultStrainLimit("{density: 1000, youngs_modulus: 1.0e5, stretch_modulus: 1.0e6, bend_modulus: 1.0e-3, "
                               "twist_modulus: 1.0e-3}"),
            0.05);
}

TEST(Limits, tellOfEachExcursionOnce)
{
  WatchedRun run(pulled("{strain: 0.3, speed: none}"));
  run.to(0.25);
  EXPECT_TRUE(run.all.empty());
  run.to(1.0);
  ASSERT_EQ(run.all.size(), 1u);
  EXPECT_EQ(run.all[0].kind, LimitExcess::Kind::strain);
  EXPECT_GT(run.all[0].value, 0.3);
  EXPECT_LT(run.all[0].value, 0.35);
  EXPECT_EQ(run.all[0].text.find("rod 'cable', edge "), 0u) << run.all[0].text;
  EXPECT_NE(run.all[0].text.find("exceeds limits.strain = 0.3 (t = "), std::string::npos) << run.all[0].text;
  EXPECT_EQ(run.watch.lasting().size(), 1u);
  run.to(2.0);   // back at strain 0
  EXPECT_TRUE(run.watch.lasting().empty());
  EXPECT_EQ(run.watch.count(), 1u);
  EXPECT_NEAR(run.end(), 1.0, 1e-9);   // `warn` changes nothing
}

TEST(Limits, haveDefaultsThatTellOfTheImplausibleAlone)
{
  WatchedRun run(pulled("{}"));
  run.to(0.4);
  EXPECT_TRUE(run.all.empty());
  run.to(1.0);   // the cable is twice as long as it was
  ASSERT_EQ(run.all.size(), 1u);
  EXPECT_EQ(run.all[0].limit, 0.5);
  EXPECT_EQ(run.simulation.config().limits.on_limit, OnLimit::warn);
  EXPECT_EQ(run.simulation.config().limits.speed, 10.0);
  EXPECT_TRUE(std::isinf(run.simulation.config().limits.force));
}

TEST(Limits, ofAGraspComeBeforeThoseOfTheScene)
{
  // E A = 31 N: at strain 0.3 the cable pulls with 9.4 N at both ends
  WatchedRun scene(pulled("{strain: none, force: 8}"));
  scene.to(1.0);
  EXPECT_EQ(scene.all.size(), 2u);
  WatchedRun own(pulled("{strain: none, force: 8}", "{force: none}"));
  own.to(1.0);
  ASSERT_EQ(own.all.size(), 1u);
  EXPECT_EQ(own.all[0].text.find("grasp 'right': its force "), 0u) << own.all[0].text;
  EXPECT_NE(own.all[0].text.find(" N exceeds limits.force = 8 N"), std::string::npos) << own.all[0].text;
}

TEST(Limits, holdKeepsEverythingWhereItIsUntilItGoesOn)
{
  WatchedRun run(pulled("{strain: 0.3, speed: none, on_limit: hold}"));
  run.to(1.0);
  EXPECT_FALSE(run.watch.held().empty());
  EXPECT_LT(run.end(), 1.35);
  const double held = run.end();
  run.to(1.3);
  EXPECT_DOUBLE_EQ(run.end(), held);
  run.to(1.74);   // the table comes back to where the cable is held: it does not catch up
  run.watch.goOn();
  run.to(2.0);
  EXPECT_NEAR(run.end(), 1.0, 1e-9);
  EXPECT_TRUE(run.watch.held().empty());
}

TEST(Limits, releaseLetsGoOfTheGraspAndOfTheNextOneOnlyWhileTheExcursionLasts)
{
  WatchedRun run(pulled("{strain: 0.3, on_limit: release}"));
  run.to(1.0);
  ASSERT_EQ(run.released.size(), 1u);   // the one with the larger force; the cable then contracts
  EXPECT_FALSE(run.simulation.grasps().isActive(run.released[0]));
  EXPECT_TRUE(run.simulation.grasps().isActive(1 - run.released[0]));
  EXPECT_EQ(run.all.size(), 1u);

  WatchedRun own(pulled("{strain: none, on_limit: release}", "{force: 5}"));
  own.to(1.0);
  EXPECT_EQ(own.released, std::vector<int>{0});
}

TEST(Limits, stopEndsTheRun)
{
  WatchedRun run(pulled("{strain: 0.3, on_limit: stop}"));
  run.to(2.0);
  EXPECT_LT(run.simulation.state().time, 0.5);
  EXPECT_NE(run.watch.stopped().find("exceeds limits.strain"), std::string::npos);
  run.watch.reset();
  EXPECT_TRUE(run.watch.stopped().empty());
}

TEST(Limits, ofSpeedsActBeforeTheStep)
{
  const std::string jump = R"(
gravity: [0, 0, 0]
limits: {strain: none, on_limit: hold}
time: {step: 0.01, duration: 1, integrator: implicit_euler}
rods:
  - name: cable
    centerline: {straight: {from: [0, 0, 0], to: [1, 0, 0], edges: 10}}
    cross_section: {radius: 0.01}
    material: {density: 1000, youngs_modulus: 1.0e5}
    grasps:
      left: {edges: [0]}
      right: {edges: [-1], motion: {table: [[0, 1, 0, 0, 0, 0, 0, 1], [0.5, 1, 0, 0, 0, 0, 0, 1], [0.51, 1.3, 0, 0, 0, 0, 0, 1], [0.52, 1, 0, 0, 0, 0, 0, 1]]}}
)";
  WatchedRun run(jump);
  run.to(0.505);
  const double before = run.end();
  run.to(0.52);
  ASSERT_EQ(run.all.size(), 1u);
  EXPECT_EQ(run.all[0].kind, LimitExcess::Kind::speed);
  EXPECT_NEAR(run.all[0].value, 30.0, 1.0);   // 0.3 m in a step of 0.01 s
  EXPECT_EQ(run.all[0].text.find("grasp 'right': the speed of its input "), 0u) << run.all[0].text;
  EXPECT_DOUBLE_EQ(run.end(), before);   // the outlier is not followed
}

TEST(Limits, ofClothNameAnEdgeOfTheMesh)
{
  WatchedRun run(R"(
gravity: [0, 0, 0]
limits: {strain: 0.2}
time: {step: 0.01, duration: 1}
cloths:
  - name: sheet
    grid: {corner: [0, 0, 0], sides: [[1, 0, 0], [0, 1, 0]], cells: 4}
    material: {area_density: 0.2, thickness: 0.001, youngs_modulus: 1.0e5, poissons_ratio: 0.3}
    grasps:
      a: {edge: left}
      b: {edge: right, motion: {table: [[0, 1, 0.5, 0, 0, 0, 0, 1], [1, 1.5, 0.5, 0, 0, 0, 0, 1]]}}
)");
  run.to(0.2);
  EXPECT_TRUE(run.all.empty());
  run.to(0.9);
  ASSERT_EQ(run.all.size(), 1u);
  EXPECT_EQ(run.all[0].text.find("cloth 'sheet', between vertices "), 0u) << run.all[0].text;
}

TEST(Limits, areReadAndRefused)
{
  const LimitsConfig limits =
      parseScene("limits: {strain: 0.1, force: 40, torque: none, speed: 2, on_limit: stop}\nrods: [{name: r}]\n")
          .limits;
  EXPECT_EQ(limits.strain, 0.1);
  EXPECT_EQ(limits.force, 40.0);
  EXPECT_EQ(limits.torque, std::numeric_limits<double>::infinity());
  EXPECT_EQ(limits.speed, 2.0);
  EXPECT_EQ(limits.on_limit, OnLimit::stop);
  for (const char* bad : {"{strain: 0}", "{force: -1}", "{speed: fast}", "{on_limit: panic}", "{strength: 1}"})
    EXPECT_THROW(parseScene(std::string("limits: ") + bad + "\nrods: [{name: r}]\n"), SceneError) << bad;
}

}   // namespace
}   // namespace slender
