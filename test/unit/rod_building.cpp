// Models, states and grasps from shapes.
#include <functional>

#include <gtest/gtest.h>

#include "slender_sim/geometry/rotation.h"
#include "test/support/special_numbers.h"
#include "test/support/trial.h"

namespace slender::test {
namespace {

Matrix3Xd unevenNodes()
{
  Matrix3Xd x = Matrix3Xd::Zero(3, 5);
  x.row(0) << 0.0, 1.0, 1.5, 3.5, 4.0;
  return x;
}

TEST(BuildRod, LumpsMassAndMeansStiffness)
{
  std::vector<RodSection> sections;
  for (int j = 0; j < 4; ++j)
  {
    RodSection s = modulusSection(2.0 + j, 1.0 + j, 100.0 + j, 3.0 + j);
    s.a = 0.1 + j;
    s.b = 0.2 + j;
    sections.push_back(s);
  }
  const RodModel m = buildRod("r", unevenNodes(), false, sections, Vector3d::UnitY(), true);
  EXPECT_EQ(m.nodes(), 5);
  EXPECT_EQ(m.edges(), 4);
  EXPECT_EQ(m.rest_length, Eigen::Vector4d(1.0, 0.5, 2.0, 0.5));
  Eigen::VectorXd mass(5);
  mass << 1.5, 1.5 + 1.0, 1.0 + 5.0, 5.0 + 1.5, 1.5;   // half of each edge's
  EXPECT_LT((m.mass - mass).norm(), 1e-15);
  EXPECT_DOUBLE_EQ(m.totalMass(), 3.0 + 2.0 + 10.0 + 3.0);
  EXPECT_EQ(m.stretch_modulus, Eigen::Vector4d(100, 101, 102, 103));
  EXPECT_EQ(m.radius_a, Eigen::Vector4d(0.1, 1.1, 2.1, 3.1));
  EXPECT_EQ(m.radius_b, Eigen::Vector4d(0.2, 1.2, 2.2, 3.2));
  EXPECT_DOUBLE_EQ(m.bend_modulus(0, 1), (1.0 * 2.0 + 0.5 * 3.0) / 1.5);
  EXPECT_DOUBLE_EQ(m.bend_modulus(0, 2), (0.5 * 3.0 + 2.0 * 4.0) / 2.5);
  EXPECT_DOUBLE_EQ(m.twist_modulus[2], (0.5 * 2.0 + 2.0 * 3.0) / 2.5);
  EXPECT_DOUBLE_EQ(m.bend_modulus(2, 0), 2.0);
  EXPECT_DOUBLE_EQ(m.bend_modulus(2, 4), 5.0);
  EXPECT_EQ(m.rest_curvature.norm(), 0.0);
  EXPECT_EQ(m.rest_twist.norm(), 0.0);
}

TEST(BuildRod, ClosedRodSharesItsLastEdge)
{
  const int n = 9;
  const RodModel m = buildRod("r", ringNodes(n, 1.0), true, uniformSections(modulusSection(1, 1, 1, 2.0), n),
                              Vector3d::UnitZ(), false);
  EXPECT_EQ(m.edges(), n);
  const double h = 2 * std::sin(M_PI / n);
  for (int i = 0; i < n; ++i)
  {
    EXPECT_NEAR(m.rest_length[i], h, 1e-15);
    EXPECT_NEAR(m.mass[i], 2.0 * h, 1e-15);
    EXPECT_NEAR(m.rest_curvature.col(i).norm(), 2 * std::tan(M_PI / n), 1e-14);
    EXPECT_NEAR(m.rest_twist[i], 0.0, 1e-14);   // a planar loop has none
  }
}

TEST(BuildRod, RestCurvatureOfAnArcAndAHelix)
{
  // arc: every turn 2 tan(phi/2); with d1 in its plane pointing inwards all of it is kappa1
  const int n = 33;
  const double radius = 0.7, phi = M_PI / (n - 1);
  const Matrix3Xd arc = helixNodes(n, radius, 0.0, 0.5);
  const RodModel m =
      buildRod("arc", arc, false, uniformSections(modulusSection(1, 1, 1, 1), n - 1), -arc.col(0), false);
  for (int i = 1; i + 1 < n; ++i)
  {
    EXPECT_NEAR(m.rest_curvature(0, i), 2 * std::tan(phi / 2), 1e-13);
    EXPECT_NEAR(m.rest_curvature(1, i), 0.0, 1e-13);
  }
  const RodModel turns = buildRod("arc", arc, false, uniformSections(modulusSection(1, 1, 1, 1), n - 1), -arc.col(0),
                                  false, {Curvature::compensated, false});
  EXPECT_NEAR(turns.rest_curvature(0, n / 2), phi, 1e-13);
  EXPECT_NEAR(m.rest_curvature(0, 0), std::tan(phi / 2), 1e-13);   // half an edge at the ends
  EXPECT_NEAR(m.rest_curvature(0, n - 1), std::tan(phi / 2), 1e-13);

  // helix: curvature r / (r^2 + c^2) with c = pitch / 2 pi; n edges per turn give order (2 pi / n)^2
  const double pitch = 0.3, c = pitch / (2 * M_PI);
  const int edges = 400;
  const Matrix3Xd helix = helixNodes(edges + 1, radius, pitch, 3.0);
  const RodModel h =
      buildRod("helix", helix, false, uniformSections(modulusSection(1, 1, 1, 1), edges), Vector3d::Zero(), false);
  const double length = h.rest_length.sum() / edges, expected = radius / (radius * radius + c * c);
  EXPECT_NEAR(h.rest_curvature.col(200).norm() / length, expected, expected * std::pow(2 * M_PI * 3 / edges, 2));
  // frames of the rest shape are parallel; the torsion turns the curvature among them
  EXPECT_EQ(h.rest_twist.norm(), 0.0);
  const RodModel straight =
      buildRod("helix", helix, false, uniformSections(modulusSection(1, 1, 1, 1), edges), Vector3d::Zero(), true);
  EXPECT_EQ(straight.rest_curvature.norm(), 0.0);
}

double energyAtRest(const RodModel& m, const Matrix3Xd& nodes, const std::function<void(Rod&)>& grasp)
{
  Rod rod(m, nodes);
  grasp(rod);
  RodSystem system(m);
  system.load(rod.state);
  return evaluateAt(system, rod.state, Eigen::VectorXd::Zero(4 * m.nodes())).energy();
}

TEST(BuildRod, RestShapeHasNoEnergyHoweverItIsHeld)
{
  Random random(61);
  const JointOptions options[] = {
      {}, {Curvature::compensated, false}, {Curvature::tangent, true}, {Curvature::compensated, true}};
  for (int run = 0; run < 16; ++run)
  {
    const bool closed = run % 2 == 1, uneven = run / 2 % 2 == 1;
    const int n = 16;
    // in-plane and helical, equal and unequal edges, with turns up to 0.5 rad per joint
    Matrix3Xd nodes = closed ? ringNodes(n, 1.0) : helixNodes(n, 1.0, 0.5, 0.8);
    if (uneven)
      nodes = wigglyNodes(n, closed, random);
    const RodModel m = buildRod("r", nodes, closed, oddSections(closed ? n : n - 1, random), Vector3d::Zero(), false,
                                options[run / 4]);
    const std::vector<std::function<void(Rod&)>> holds = {
        [](Rod&) {},
        [](Rod& r) { r.hold(0, 0); },
        [n](Rod& r) {
          r.hold(0, 0);
          r.hold(n - 1, n - 1);
        },
        [](Rod& r) { r.hold(5, 5); },
        [](Rod& r) {
          r.hold(0, 3);
          r.hold(7, 8);
          r.hold(12, 12, false);
        },
    };
    for (std::size_t k = 0; k < holds.size(); ++k)
      // strains of round-off size, squared; anything wrong in the share of the curvature shows at 1e-6 and above
      EXPECT_LT(energyAtRest(m, nodes, holds[k]), 1e-25)
          << (closed ? "closed " : "open ") << (uneven ? "uneven" : "even") << " options " << run / 4 << " hold " << k;
  }
}

TEST(BuildRod, JointsMatchedToArcsAreAsStiffAsThese)
{
  // Two edges of one arc. Its ends turned against each other, the arc's energy is that of the change of its rotation's
  // logarithm, which is spread evenly over its length: 1/2 d^T diag(beta, B) d / length.
  Random random(62);
  const double h = 0.5;
  for (const Curvature curvature : {Curvature::tangent, Curvature::compensated})
    for (const double turn : {0.1, 0.8})
    {
      Matrix3Xd nodes = Matrix3Xd::Zero(3, 3);
      nodes.col(0) << -h, 0, 0;
      nodes.col(2) << h * std::cos(turn), h * std::sin(turn), 0;
      const RodSection section = oddSection(random);
      const Vector3d director = random.direction();
      double worst[2] = {0, 0};
      for (int matched = 0; matched < 2; ++matched)
      {
        const RodModel m =
            buildRod("arc", nodes, false, uniformSections(section, 2), director, false, {curvature, matched == 1});
        for (int sample = 0; sample < 6; ++sample)
        {
          Rod rod(m, nodes);
          rod.state = makeRodState(m, nodes, director);
          const auto frame = [&](int j) {
            Eigen::Matrix3d f;
            f.col(0) = (rod.state.x.col(j + 1) - rod.state.x.col(j)).normalized();
            f.col(1) = rod.state.d1.col(j);
            f.col(2) = f.col(0).cross(f.col(1));
            return f;
          };
          const auto logarithm = [&] {
            const Eigen::AngleAxisd relative(Eigen::Matrix3d(frame(0).transpose() * frame(1)));
            return Vector3d(relative.angle() * relative.axis());
          };
          const Vector3d before = logarithm();
          const Eigen::Matrix3d turned = Eigen::AngleAxisd(1e-5, random.direction()) * frame(1);
          rod.state.x.col(2) = rod.state.x.col(1) + h * turned.col(0);
          rod.state.d1.col(1) = turned.col(1);
          const Vector3d t = frame(0).col(0),
                         transported = parallelTransport(Vector3d(rod.state.d1.col(0)), t, Vector3d(turned.col(0)));
          rod.state.twist[1] = signedAngle(transported, Vector3d(turned.col(1)), Vector3d(turned.col(0)));
          const Vector3d d = logarithm() - before;
          const Eigen::Vector2d kappa(d[2], -d[1]);   // kappa1 turns about d2, kappa2 about -d1
          const double arc = h * (turn / 2) / std::sin(turn / 2);
          const double expected =
              0.5 * (section.twist_modulus * d[0] * d[0] + kappa.dot(section.bend_modulus * kappa)) / arc;
          RodSystem system(m);
          system.load(rod.state);
          const double energy = evaluateAt(system, rod.state, Eigen::VectorXd::Zero(12)).bend_twist;
          worst[matched] = std::max(worst[matched], std::abs(energy / expected - 1));
        }
      }
      EXPECT_LT(worst[1], 1e-4) << turn;                    // 1e-5: terms of third order in the small turn
      EXPECT_GT(worst[0], 0.1 * turn * turn / 4) << turn;   // of second order in the joint's turn without
    }
  EXPECT_THROW(buildRod("r", unevenNodes(), false, uniformSections(modulusSection(1, 1, 1, 1), 4), Vector3d::UnitY(),
                        true, {Curvature::tangent, true}),
               std::invalid_argument);
}

TEST(BuildRod, HoldingAUniformlyBentRodKeepsItsEnergy)
{
  // A straight rod bent to an arc, with unequal edges: a grasp in the middle splits a joint into two halves whose
  // bending energies must sum to nearly that of the joint (they integrate the same curvature; equal strain per length
  // on both sides).
  const int n = 21;
  Matrix3Xd arc(3, n), straight(3, n);
  for (int i = 0; i < n; ++i)
  {
    const double s = (i + 0.3 * (i % 2)) / (n - 1);
    arc.col(i) = Vector3d(std::sin(s), 1 - std::cos(s), 0);
  }
  straight.setZero();
  for (int i = 1; i < n; ++i)
    straight(0, i) = straight(0, i - 1) + (arc.col(i) - arc.col(i - 1)).norm();
  const RodModel m = openRod(straight, modulusSection(1.0, 1.0, 100.0, 1.0));
  const double all = energyAtRest(m, arc, [](Rod&) {});
  ASSERT_NEAR(all, 0.5, 0.05);   // 1/2 B kappa^2 L
  for (int node : {9, 10})
  {
    // half cells with Gregory's weights change the sum by at most a twelfth of an edge's energy: 1/12 * 2 sides / n of
    // the whole
    EXPECT_NEAR(energyAtRest(m, arc, [node](Rod& r) { r.hold(node, node); }), all, all * 0.3 / n) << node;
  }
}

void expectRefused(const std::string& naming, const std::function<void()>& build)
{
  try
  {
    build();
    ADD_FAILURE() << "accepted a bad " << naming;
  }
  catch (const std::invalid_argument& error)
  {
    EXPECT_NE(std::string(error.what()).find(naming), std::string::npos) << error.what();
  }
}

TEST(BuildRod, RefusesEachBadValueByName)
{
  const auto build = [](const std::function<void(RodSection&)>& spoil) {
    std::vector<RodSection> sections = uniformSections(modulusSection(1, 1, 1, 1), 4);
    spoil(sections[2]);
    buildRod("r", unevenNodes(), false, sections, Vector3d::UnitY(), true);
  };
  build([](RodSection&) {});
  for (double bad : {0.0, -1.0, kNan, kInfinity})
  {
    expectRefused("semi-axis a of edge 2", [&] { build([bad](RodSection& s) { s.a = bad; }); });
    expectRefused("semi-axis b of edge 2", [&] { build([bad](RodSection& s) { s.b = bad; }); });
    expectRefused("linear density of edge 2", [&] { build([bad](RodSection& s) { s.linear_density = bad; }); });
    expectRefused("stretch modulus of edge 2", [&] { build([bad](RodSection& s) { s.stretch_modulus = bad; }); });
    expectRefused("twist modulus of edge 2", [&] { build([bad](RodSection& s) { s.twist_modulus = bad; }); });
    expectRefused("bend modulus", [&] { build([bad](RodSection& s) { s.bend_modulus(0, 0) = bad; }); });
    expectRefused("bend modulus", [&] { build([bad](RodSection& s) { s.bend_modulus(1, 1) = bad; }); });
  }
  expectRefused("bend modulus", [&] { build([](RodSection& s) { s.bend_modulus << 1, 2, 2, 1; }); });   // indefinite
  expectRefused("bend modulus", [&] { build([](RodSection& s) { s.bend_modulus << 1, kNan, kNan, 1; }); });
  // not symmetric
  expectRefused("bend modulus", [&] { build([](RodSection& s) { s.bend_modulus << 1, 0.5, 0.1, 1; }); });

  const auto shape = [](const Matrix3Xd& x, bool closed, int sections) {
    buildRod("rope", x, closed, uniformSections(modulusSection(1, 1, 1, 1), sections), Vector3d::Zero(), false);
  };
  expectRefused("rope", [&] { shape(straightNodes(2, 1.0), false, 1); });
  expectRefused("rope", [&] { shape(ringNodes(4, 1.0), true, 4); });
  expectRefused("4 cross-sections", [&] { shape(unevenNodes(), false, 5); });
  expectRefused("9 cross-sections", [&] { shape(ringNodes(9, 1.0), true, 8); });
  for (double bad : {kNan, kInfinity})
  {
    Matrix3Xd x = unevenNodes();
    x(1, 3) = bad;
    expectRefused("finite", [&] { shape(x, false, 4); });
  }
  Matrix3Xd repeated = unevenNodes();
  repeated.col(2) = repeated.col(1);
  expectRefused("nodes 1 and 2", [&] { shape(repeated, false, 4); });
  Matrix3Xd folded = unevenNodes();
  folded.col(3) = folded.col(1);
  expectRefused("node 2", [&] { shape(folded, false, 4); });
  expectRefused("director", [] {
    buildRod("r", unevenNodes(), false, uniformSections(modulusSection(1, 1, 1, 1), 4), Vector3d::UnitX(), true);
  });
  expectRefused("director", [] {
    buildRod("r", unevenNodes(), false, uniformSections(modulusSection(1, 1, 1, 1), 4), Vector3d(0, kNan, 0), true);
  });
}

TEST(MakeRodState, SpreadsTwistAndRefusesBadInput)
{
  const RodModel m = openRod(unevenNodes(), modulusSection(1, 1, 1, 1), true);
  const RodState s = makeRodState(m, unevenNodes(), Vector3d::UnitY(), 6.0);
  EXPECT_NEAR(s.twist.sum(), 6.0, 1e-14);
  EXPECT_EQ(s.twist[0], 0.0);
  EXPECT_EQ(s.twist[4], 0.0);
  EXPECT_NEAR(s.twist[2], 2.0, 1e-14);
  EXPECT_LT((s.d1.col(0) - Vector3d::UnitY()).norm(), 1e-15);
  EXPECT_LT((s.d1.col(2) - rotateAbout(Vector3d::UnitY(), Vector3d::UnitX(), 4.0)).norm(), 1e-14);
  EXPECT_EQ(s.v.norm(), 0.0);
  const int n = 8;
  const RodModel ring = buildRod("ring", ringNodes(n, 1.0), true, uniformSections(modulusSection(1, 1, 1, 1), n),
                                 Vector3d::Zero(), false);
  const RodState r = makeRodState(ring, ringNodes(n, 1.0), Vector3d::Zero(), 2 * M_PI);
  for (int i = 0; i < n; ++i)
    EXPECT_NEAR(r.twist[i], 2 * M_PI / n, 1e-13);
  expectRefused("multiple of 2 pi", [&] { makeRodState(ring, ringNodes(n, 1.0), Vector3d::Zero(), 3.0); });

  expectRefused("5 nodes", [&] { makeRodState(m, straightNodes(4, 1.0), Vector3d::Zero()); });
  expectRefused("twist", [&] { makeRodState(m, unevenNodes(), Vector3d::Zero(), kNan); });
  Matrix3Xd x = unevenNodes();
  x(0, 1) = kInfinity;
  expectRefused("finite", [&] { makeRodState(m, x, Vector3d::Zero()); });
}

TEST(MakeGrasp, TakesHoldAndRefusesBadNodes)
{
  const RodModel m = openRod(unevenNodes(), modulusSection(1, 1, 1, 1), true);
  const RodState s = makeRodState(m, unevenNodes(), Vector3d::UnitY());
  const GraspState one = makeGrasp(m, s, 1, 1, true), pair = makeGrasp(m, s, 1, 2, true),
                   three = makeGrasp(m, s, 1, 3, true);
  EXPECT_EQ(one.X_WG.position, s.x.col(1));
  // x along the tangent, y along d1
  EXPECT_LT((one.X_WG.orientation * Vector3d::UnitX() - Vector3d::UnitX()).norm(), 1e-14);
  EXPECT_LT((one.X_WG.orientation * Vector3d::UnitY() - Vector3d::UnitY()).norm(), 1e-14);
  EXPECT_LT((pair.X_WG.position - Vector3d(1.25, 0, 0)).norm(), 1e-15);
  EXPECT_EQ(three.X_WG.position, s.x.col(2));
  for (const GraspState& g : {one, pair, three})
    for (std::size_t k = 0; k < g.nodes_G.size(); ++k)
      EXPECT_LT((g.X_WG * g.nodes_G[k] - s.x.col(g.first_node + k)).norm(), 1e-15);
  expectRefused("held nodes", [&] { makeGrasp(m, s, -1, 0, true); });
  expectRefused("held nodes", [&] { makeGrasp(m, s, 0, 5, true); });
  expectRefused("held nodes", [&] { makeGrasp(m, s, 3, 2, true); });
  expectRefused("pin", [&] { makeGrasp(m, s, 1, 2, false); });
}

}   // namespace
}   // namespace slender::test
