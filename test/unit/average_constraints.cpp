// Prescribed averages of rods and cloths: alone, beside contact and welds, and in islands with each other kind of
// object.
#include <algorithm>
#include <cmath>
#include <string>

#include <gtest/gtest.h>

#include "slender_sim/scene/reader.h"
#include "slender_sim/scene/simulation.h"
#include "slender_sim/tracking/weak_constraints.h"
#include "slender_sim/world/world.h"
#include "test/support/allocations.h"

namespace slender::test {
namespace {

using Eigen::Matrix3Xd;
using Eigen::Vector3d;

const std::string kOpen = R"(
time: {step: 0.01, duration: 20}
rods:
  - name: rope
    centerline: {straight: {from: [0, 0, 0], to: [1, 0, 0], edges: 24}}
    cross_section: {radius: 0.004}
    material: {density: 1100, youngs_modulus: 1.0e6, poissons_ratio: 0.4}
    damping: {mass: 2}
    track: {guide: {nodes: 25, motion: {topic: points}}, test_functions: {segments: 4}}
)";

const std::string kClosed = R"(
time: {step: 0.01, duration: 20}
rods:
  - name: rope
    closed: true
    centerline: {arc: {start: [0.2, 0, 0], angle: 6.031857894892403, edges: 24}}   # one edge less than the circle
    cross_section: {radius: 0.004}
    material: {density: 1100, youngs_modulus: 1.0e6, poissons_ratio: 0.4}
    damping: {mass: 2}
    track: {guide: {nodes: 25, motion: {topic: points}}, test_functions: {segments: 4}}
)";

/// The sum of the forces with which the averages act on a rod [N].
Vector3d guideForce(const Simulation& s, int rod) { return s.state().rod_guides[rod].forces.rowwise().sum(); }

TEST(AverageConstraints, AreMetAndCarryTheRod)
{
  for (const std::string& scene : {kOpen, kClosed})
  {
    Simulation s(parseScene(scene, "rope"));
    SceneInputs inputs = s.defaultInputs();
    const Matrix3Xd start = inputs.guides[0];
    for (int k = 0; k < 1500; ++k)
    {
      const double t = std::min(0.01 * k, 5.0), share = std::min(t, 1.0);
      for (Eigen::Index i = 0; i < start.cols(); ++i)
        inputs.guides[0].col(i) = start.col(i) + Vector3d(0, 0.05 * std::sin(2 * t + 0.17 * i) * share, 0.1 * share);
      const StepReport report = s.step(inputs);
      ASSERT_TRUE(report.ok) << k << ": " << report.message;
      ASSERT_LT(s.trackingError({ObjectRef::rod, 0}).met, 1e-13) << k;
    }
    // at rest, averages carry the weight
    const double weight = 9.81 * s.rodModel(0).totalMass();
    EXPECT_LT(s.state().rods[0].v.cwiseAbs().maxCoeff(), 1e-4);
    EXPECT_LT((guideForce(s, 0) - Vector3d(0, 0, weight)).norm(), 1e-3 * weight);
    // between the averages it has a shape of its own
    EXPECT_GT((s.state().rods[0].x - inputs.guides[0]).colwise().norm().maxCoeff(), 1e-3);
  }
}

/// A rod whose averages are those that it has without them moves as it does without them.
TEST(AverageConstraints, LeaveAFreeMotionAlone)
{
  for (const std::string grasps : {"{}", "{left: {edges: [0]}}"})
  {
    // Contact that nothing meets changes nothing.
    for (const std::string contact : {"", "{friction: 0.3}"})
    {
      std::vector<std::string> set = {"rods.0.grasps=" + grasps};
      if (!contact.empty())
        set.push_back("rods.0.contact=" + contact);
      Simulation tracked(parseScene(kOpen, "rope", set));
      const std::string track = kOpen.substr(0, kOpen.find("    track"));
      set.emplace_back("time.integrator=implicit_euler");
      Simulation free(parseScene(track, "rope", set));
      SceneInputs inputs = tracked.defaultInputs();
      for (int k = 0; k < 40; ++k)
      {
        ASSERT_TRUE(free.step(free.defaultInputs()).ok);
        inputs.guides[0] = free.state().rods[0].x;
        const StepReport report = tracked.step(inputs);
        ASSERT_TRUE(report.ok) << report.message;
        ASSERT_LT((tracked.state().rods[0].x - free.state().rods[0].x).cwiseAbs().maxCoeff(), 1e-6) << grasps << k;
        ASSERT_LT(tracked.state().rod_guides[0].forces.cwiseAbs().maxCoeff(), 1e-4);
      }
      EXPECT_LT(free.state().rods[0].x.row(2).minCoeff(), -0.05);
    }
  }
}

TEST(AverageConstraints, ThatDependOnEachOtherAreRefused)
{
  Simulation s(parseScene(kOpen, "rope"));
  WorldModel model;
  model.time = s.config().time;
  model.rods.push_back(s.world().model().rods[0]);
  WorldState state;
  state.rods.push_back(s.state().rods[0]);
  state.rods[0].grasps.push_back(makeGrasp(s.rodModel(0), state.rods[0], 0, 23, true));
  state.rod_guides.resize(1);
  WorldInputs inputs;
  inputs.rods.resize(1);
  inputs.rods[0].grasps.push_back({state.rods[0].grasps[0].X_WG, std::nullopt});
  inputs.guides.push_back(s.state().rods[0].x);
  const Matrix3Xd before = state.rods[0].x;
  World world(model, state);
  const StepReport report = world.step(state, inputs);
  EXPECT_FALSE(report.ok);
  EXPECT_NE(report.message.find("depend on each other"), std::string::npos) << report.message;
  EXPECT_TRUE(state.rods[0].x == before);
}

/// A rod cannot follow its guide through a floor. The step is refused with a message about the guide, and the state
/// stays as it was.
TEST(AverageConstraints, ThatAFloorDoesNotAllowAreRefused)
{
  Simulation s(parseScene(
      kOpen, "rope",
      {"time.step=0.005", "rods.0.contact={}", "obstacles=[{name: floor, shape: {plane: {point: [0, 0, -0.05]}}}]"}));
  SceneInputs inputs = s.defaultInputs();
  StepReport report;
  double lowest = 0.0;
  for (int k = 0; k < 100 && report.ok; ++k)
  {
    lowest = s.state().rods[0].x.row(2).minCoeff();
    inputs.guides[0].row(2).array() -= 0.001;
    report = s.step(inputs);
  }
  EXPECT_FALSE(report.ok);
  EXPECT_NE(report.message.find("the averages of its guide"), std::string::npos) << report.message;
  EXPECT_EQ(s.state().rods[0].x.row(2).minCoeff(), lowest);
  EXPECT_GT(lowest, -0.05 + 0.004);
  EXPECT_LT(lowest, -0.05 + 0.006);
}

// ---- with other objects in one island

/// A cable whose guide lifts it into what lies above it.
const std::string kLifted = R"(
time: {step: 0.001, duration: 1}
gravity: [0, 0, 0]
contact: {gap: 5.0e-5}
rods:
  - name: cable
    centerline: {straight: {from: [-0.02, 0, 0], to: [0.02, 0, 0], edges: 20}}
    cross_section: {radius: 0.001}
    material: {density: 1100, youngs_modulus: 1.0e6, poissons_ratio: 0.3}
    contact: {friction: 0.3}
    track:
      guide:
        nodes: 3
        motion:
          table:
            - [0, -0.02, 0, 0, 0, 0, 0, 0.02, 0, 0]
            - [0.04, -0.02, 0, 0.002, 0, 0.001, 0.004, 0.02, 0, 0.003]
)";

/// A towel whose guide lifts it likewise.
const std::string kLiftedTowel = R"(
time: {step: 0.001, duration: 1}
gravity: [0, 0, 0]
contact: {gap: 5.0e-5}
tracked:
  - name: towel
    guide:
      grid: {corner: [-0.02, -0.02, 0.0008], sides: [[0.04, 0, 0], [0, 0.04, 0]], cells: 8, pattern: alternating}
      motion: {topic: points}
    mesh: same
    test_functions: {clusters: {count: 5}}
    material: {area_density: 0.2, thickness: 0.0004, youngs_modulus: 2.0e5, poissons_ratio: 0.3}
    contact: {friction: 0.3, thickness: 0.0004, method: barrier}
)";

const char* const kRod = R"(
  - name: other
    centerline: {straight: {from: [0.001, -0.02, 0.0024], to: [0.001, 0.02, 0.0024], edges: 20}}
    cross_section: {radius: 0.001}
    material: {density: 1100, youngs_modulus: 1.0e6, poissons_ratio: 0.3}
    contact: {friction: 0.3}
)";

const std::string kTrackedRod = std::string(kRod) + "    track: {guide: {nodes: 2}}\n";

const char* const kThread = R"(
threads:
  - name: syrup
    fluid: {density: 1300, viscosity: 10, surface_tension: 0.03}
    radius: 0.001
    centerline: {straight: {from: [0.001, -0.02, 0.0024], to: [0.001, 0.02, 0.0024], edges: 20}}
    contact: {friction: 0.3}
)";

const char* const kCloth = R"(
cloths:
  - name: sheet
    grid: {corner: [-0.012, -0.012, 0.0018], sides: [[0.024, 0, 0], [0, 0.024, 0]], cells: 6, pattern: alternating}
    material: {area_density: 0.2, thickness: 0.0004, youngs_modulus: 2.0e5, poissons_ratio: 0.3}
    contact: {friction: 0.3, thickness: 0.0004, method: barrier}
)";

const char* const kBall = R"(
bodies:
  - name: ball
    mass: 0.0002
    shape: {sphere: {radius: 0.004}}
    pose: {position: [0.001, 0.0005, 0.0054]}
    friction: 0.3
)";

const char* const kWelded = R"(
bodies:
  - name: clip
    mass: 0.0002
    inertia: [1.0e-8, 1.0e-8, 1.0e-8]
    pose: {position: [0.02, 0, 0]}
    welds: [{rod: cable, edge: -1}]
)";

Vector3d momentum(const Simulation& s)
{
  Vector3d sum = Vector3d::Zero();
  for (std::size_t r = 0; r < s.state().rods.size(); ++r)
    sum += s.state().rods[r].v * s.rodModel(static_cast<int>(r)).mass;
  for (std::size_t c = 0; c < s.state().cloths.size(); ++c)
    sum += s.state().cloths[c].v * s.clothModel(static_cast<int>(c)).mass;
  for (const RigidBodyState& body : s.state().bodies)
    sum += 0.0002 * body.velocity.linear;
  for (const ThreadGroupState& group : s.state().threads)
    for (const ThreadState& thread : group.threads)
      for (int j = 0; j < thread.edges(); ++j)
        sum += 0.5 * s.threadModel(0).density * thread.volume[j] * (thread.v[j] + thread.v[j + 1]);
  return sum;
}

struct Other
{
  const char* name;
  std::string scene;
};
void PrintTo(const Other& other, std::ostream* out) { *out << other.name; }

/// Lifts cloths that track a guide into what lies above. The averages stay exact. Only the forces of the guides change
/// the total momentum, if there is no obstacle.
void lift(const std::string& scene, bool touches, const std::vector<std::string>& overrides = {}, int steps = 60)
{
  Simulation s(parseScene(scene, "lifted", overrides));
  const bool isolated = s.config().obstacles.empty();
  SceneInputs inputs = s.defaultInputs();
  const std::vector<Matrix3Xd> guides = inputs.guides;
  std::size_t contacts = 0;
  double largest = 0.0;
  for (int k = 0; k < steps; ++k)
  {
    inputs = s.defaultInputs();
    for (std::size_t c = 0; c < guides.size(); ++c)
      for (Eigen::Index i = 0; s.guides()[c].object.isCloth() && i < guides[c].cols(); ++i)
        inputs.guides[c](2, i) = guides[c](2, i) + 5e-5 * (k + 1) * (1.0 + 25.0 * guides[c](0, i));
    const Vector3d before = momentum(s);
    const StepReport report = s.step(inputs);
    ASSERT_TRUE(report.ok) << k << ": " << report.message;
    contacts = std::max(contacts, s.world().contacts().size());
    Vector3d force = Vector3d::Zero();
    const auto add = [&](const Matrix3Xd& forces) {
      force += forces.rowwise().sum();
      largest = std::max(largest, forces.cwiseAbs().maxCoeff());
    };
    for (std::size_t r = 0; r < s.state().rods.size(); ++r)
    {
      ASSERT_LT(s.trackingError({ObjectRef::rod, static_cast<int>(r)}).met, 1e-10 * 0.04) << k;
      if (s.config().rods[r].tracking)
        add(s.state().rod_guides[r].forces);
    }
    for (std::size_t c = 0; c < s.state().cloths.size(); ++c)
      if (s.config().cloths[c].tracking)
      {
        ASSERT_LT(s.trackingError({ObjectRef::cloth, static_cast<int>(c)}).met, 1e-10 * 0.04) << k;
        add(s.state().cloth_guides[c].forces);
      }
    // Newton's method leaves up to this part of the largest force unbalanced
    EXPECT_TRUE(!isolated || (momentum(s) - before - 0.001 * force).norm() < 1e-5 * 0.001 * largest) << k;
  }
  EXPECT_GT(largest, 1e-4);
  EXPECT_TRUE(!touches || contacts >= 1);
}

class TrackedRodMeets : public testing::TestWithParam<Other>
{};

TEST_P(TrackedRodMeets, AndAveragesAreExact) { lift(kLifted + GetParam().scene, GetParam().scene != kWelded); }

class TrackedClothMeets : public testing::TestWithParam<Other>
{};

TEST_P(TrackedClothMeets, AndAveragesAreExact) { lift(kLiftedTowel + GetParam().scene, true); }

INSTANTIATE_TEST_SUITE_P(EachKind, TrackedRodMeets,
                         testing::Values(Other{"Rod", kRod}, Other{"TrackedRod", kTrackedRod}, Other{"Thread", kThread},
                                         Other{"Cloth", kCloth}, Other{"Body", kBall}, Other{"WeldedBody", kWelded}),
                         [](const auto& info) { return std::string(info.param.name); });

const char* const kLid = R"(
obstacles:
  - {name: lid, shape: {box: {size: [0.01, 0.01, 0.01]}}, pose: {position: [0, 0, 0.0065]}, friction: 0.3}
)";

INSTANTIATE_TEST_SUITE_P(EachKind, TrackedClothMeets,
                         testing::Values(Other{"Rod", std::string("rods:") + kRod},
                                         Other{"TrackedRod", "rods:" + kTrackedRod}, Other{"Thread", kThread},
                                         Other{"Cloth", kCloth}, Other{"Body", kBall}, Other{"Obstacle", kLid}),
                         [](const auto& info) { return std::string(info.param.name); });

/// More than 1,500 multipliers, which are eliminated with the points of their averages.
TEST(AverageConstraints, OfManyTestFunctionsAreExact)
{
  lift(kLiftedTowel + "rods:" + kRod, true,
       {"tracked.towel.guide.grid.cells=26", "tracked.towel.test_functions.clusters.count=520"}, 20);
}

/// The pattern of the matrix has the averages that act.
TEST(AverageConstraints, OfSetsThatChangeAreExact)
{
  lift(kLiftedTowel + "rods:" + kRod, true,
       {"tracked.towel.test_functions=[{name: few, clusters: {count: 5}}, {name: many, clusters: {count: 9}, from: "
        "0.02, "
        "blend: 0.004}, {name: others, clusters: {count: 5, seed: 3}, from: 0.04, blend: 0.004}]"});
}

/// Two towels in one island, of which only one is lifted, into a rod.
TEST(AverageConstraints, ATrackedClothRestsBesideOneThatMoves)
{
  std::string beside = kLiftedTowel.substr(kLiftedTowel.find("  - name: towel"));
  beside.replace(beside.find("towel"), 5, "other").replace(beside.find("[-0.02, "), 8, "[0.0206, ");
  Simulation alone(parseScene(kLiftedTowel + "rods:" + kRod, "lifted")),
      both(parseScene(kLiftedTowel + beside + "rods:" + kRod, "lifted"));
  const Matrix3Xd rest = both.state().cloths[1].x;
  const auto lifted = [](const Simulation& s, int k) {
    SceneInputs inputs = s.defaultInputs();
    inputs.guides[0].row(2).array() += 5e-5 * (k + 1);
    return inputs;
  };
  for (int k = 0; k < 30; ++k)
  {
    ASSERT_TRUE(alone.step(lifted(alone, k)).ok) << k;
    ASSERT_TRUE(both.step(lifted(both, k)).ok) << k;
    // One island has one stiffness of the barrier.
    ASSERT_EQ(both.state().contact.cloths[0].barrier.layers[0].stiffness,
              both.state().contact.cloths[1].barrier.layers[0].stiffness)
        << k;
    ASSERT_LT(both.trackingError({ObjectRef::cloth, 0}).met, 1e-10 * 0.04) << k;
  }
  EXPECT_FALSE(both.world().contacts().empty());
  EXPECT_LT((both.state().cloths[1].x - rest).cwiseAbs().maxCoeff(), 1e-15);   // rounding errors
  const Matrix3Xd &forces = both.state().cloth_guides[0].forces, &expected = alone.state().cloth_guides[0].forces;
  EXPECT_LT(both.state().cloth_guides[1].forces.cwiseAbs().maxCoeff(), 1e-9 * forces.cwiseAbs().maxCoeff());
  // Newton's method leaves up to this part of the largest force unbalanced.
  EXPECT_LT((forces - expected).cwiseAbs().maxCoeff(), 1e-5 * forces.cwiseAbs().maxCoeff());
}

/// The guide presses the towel against a ceiling, and the work for it is bounded.
TEST(AverageConstraints, OfAClothThatACeilingDoesNotAllowAreRefused)
{
  Simulation s(
      parseScene(kLiftedTowel, "lifted",
                 {"obstacles=[{name: ceiling, shape: {plane: {point: [0, 0, 0.0015], normal: [0, 0, -1]}}}]"}));
  SceneInputs inputs = s.defaultInputs();
  StepReport report;
  double highest = 0.0;
  for (int k = 0; k < 100 && report.ok; ++k)
  {
    highest = s.state().cloths[0].x.row(2).maxCoeff();
    inputs.guides[0].row(2).array() += 5e-5;
    report = s.step(inputs);
  }
  EXPECT_FALSE(report.ok);
  EXPECT_NE(report.message.find("the averages of its guide"), std::string::npos) << report.message;
  EXPECT_EQ(s.state().cloths[0].x.row(2).maxCoeff(), highest);
  EXPECT_LT(highest, 0.0015 - 0.0002);   // half the thickness
}

#ifdef SLENDER_COUNTS_ALLOCATIONS
/// Steps alone and beside a rod, while the guide and contact move.
TEST(AverageConstraints, WarmStepsTakeNoMemory)
{
  for (const std::string& scene : {kLifted, kLifted + kRod})
  {
    Simulation s(parseScene(scene, "lifted"));
    s.setThreads(1);
    SceneInputs inputs = s.defaultInputs();
    long least = 1000;
    for (int k = 0; k < 120; ++k)   // contacts may come and go in some of the steps
    {
      const long before = allocations;
      ASSERT_TRUE(s.step(inputs).ok);
      if (k >= 60)
        least = std::min<long>(least, allocations - before);
    }
    EXPECT_EQ(least, 0) << scene;
  }
}
#endif

}   // namespace
}   // namespace slender::test
