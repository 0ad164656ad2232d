// Gradient and Hessian of whole rods, with their clamps, pins, loads and viscous response, against differences of the
// energy.
#include <algorithm>
#include <functional>

#include <gtest/gtest.h>

#include "test/support/trial.h"

namespace slender::test {
namespace {

struct DerivativeCase
{
  std::string name;
  bool closed;
  std::function<void(Rod&)> grasp;
  double viscous_ratio;
  Curvature curvature = Curvature::tangent;
  bool straight = false;   ///< naturally straight and isotropic
};

void PrintTo(const DerivativeCase& c, std::ostream* out) { *out << c.name; }

/// A rod of odd stiffness, curved, twisted, displaced from its rest shape and loaded: every term is at work.
struct LoadedRod
{
  Rod rod;
  RodSystem system;
  Eigen::Matrix4Xd viscous_strain;

  LoadedRod(const DerivativeCase& c, int n, Random& random) : rod(make(c, n, random)), system(*rod.model)
  {
    system.load(rod.state);
    if (c.viscous_ratio > 0)
    {
      viscous_strain.resize(4, n + 2 * rod.state.grasps.size());
      for (int k = 0; k < viscous_strain.cols(); ++k)
        viscous_strain.col(k) = 0.3 * random.numbers(4);
      system.setResponse(c.viscous_ratio, &viscous_strain);
    }
    for (int i = 0; i < n; ++i)
      system.setInertia(i, system.isFree(i) ? random.uniform(4.0, 6.0) : 0.0, rod.state.x.col(i) + random.vector(0.2),
                        random.vector());
    // Only held frames balance torques. Where nothing holds them Newton's direction would be mostly spin, in which
    // differences lose digits.
    Eigen::VectorXd torques(rod.model->edges());
    for (int j = 0; j < torques.size(); ++j)
      torques[j] = 0.5 * std::sin(1.0 + 2.0 * j);
    const auto& grasps = rod.state.grasps;
    if (std::any_of(grasps.begin(), grasps.end(), [](const GraspState& g) { return g.holds_frame; }))
      system.setTwistLoads(torques);
  }

  static Rod make(const DerivativeCase& c, int n, Random& random)
  {
    const Matrix3Xd rest = wigglyNodes(n, c.closed, random);
    const int edges = c.closed ? n : n - 1;
    const auto sections =
        c.straight ? uniformSections(modulusSection(1.0, 1.0, 50.0, 2.5), edges) : oddSections(edges, random);
    const RodModel model = buildRod("r", rest, c.closed, sections, Vector3d::Zero(), c.straight, {c.curvature, false});
    Matrix3Xd nodes = rest;
    for (int i = 0; i < n; ++i)
      nodes.col(i) += random.vector(0.15);
    Rod rod(model, nodes, 2 * M_PI);
    c.grasp(rod);
    return rod;
  }
};

/// The solver gives d = -K^-1 g for the gradient g, so d^T K d must be -g.d; second differences of the energy along d
/// must say the same. (Differences of the gradient would not: its frames move on, by holonomy.) Random loads turn d
/// into every direction.
void checkHessian(LoadedRod& s, Random& random, int samples, double tolerance)
{
  const int n = s.rod.model->nodes();
  const Eigen::VectorXd zero = Eigen::VectorXd::Zero(4 * n);
  for (int sample = 0; sample < samples; ++sample)
  {
    for (int i = 0; i < n; ++i)
      s.system.setInertia(i, s.system.isFree(i) ? 5.0 : 0.0, s.rod.state.x.col(i), random.vector(3.0));
    const RodEvaluation base = evaluateAt(s.system, s.rod.state, zero, true);
    ASSERT_EQ(base.inertia.zero, 0);
    const Eigen::VectorXd g = gradientOf(s.system), d = newtonDirection(s.system);
    const double expected = -g.dot(d);
    double best = 1e9;
    for (double size : {1e-1, 3e-2, 1e-2, 3e-3})
    {
      const double h = size / d.lpNorm<Eigen::Infinity>();
      const auto even = [&](double f) {
        return evaluateAt(s.system, s.rod.state, f * h * d).energy() +
               evaluateAt(s.system, s.rod.state, -f * h * d).energy() - 2 * base.energy();
      };
      // fourth order: truncation h^4, round-off 1e-16 E / h^2 (E up to 1e3)
      best = std::min(best, std::abs((16 * even(1) - even(2)) / (12 * h * h) - expected) / std::abs(expected));
    }
    EXPECT_LT(best, tolerance) << "n " << n;
  }
}

class RodDerivatives : public ::testing::TestWithParam<DerivativeCase>
{};

TEST_P(RodDerivatives, Gradient)
{
  Random random(41);
  for (int n : {9, 17})
  {
    LoadedRod s(GetParam(), n, random);
    const Eigen::VectorXd zero = Eigen::VectorXd::Zero(4 * n);
    evaluateAt(s.system, s.rod.state, zero);
    const Eigen::VectorXd gradient = gradientOf(s.system);
    ASSERT_GT(gradient.norm(), 0.5);
    for (int sample = 0; sample < 8; ++sample)
    {
      const Eigen::VectorXd d = freeDirection(s.system, s.rod.state, random);
      double error[4];
      for (int k = 0; k < 4; ++k)
      {
        const double h = std::pow(10.0, -2 - k);
        error[k] = std::abs(
            (evaluateAt(s.system, s.rod.state, h * d).energy() - evaluateAt(s.system, s.rod.state, -h * d).energy()) /
                (2 * h) -
            gradient.dot(d));
      }
      EXPECT_NEAR(std::log10(error[0] / error[1]), 2.0, 0.3);
      // h = 1e-5: truncation 1e-10 and round-off 1e-15 * 100 J / 1e-5 = 1e-8, over forces of order ten
      EXPECT_LT(std::min(error[2], error[3]), 2e-8 * gradient.norm()) << "n " << n;
    }
  }
}

TEST_P(RodDerivatives, Hessian)
{
  Random random(42);
  for (int n : {9, 17})
  {
    LoadedRod s(GetParam(), n, random);
    // truncation and round-off meet near 1e-6; where no frame is held the solver adds 1e-8 of the twist stiffness, seen
    // in soft spins
    checkHessian(s, random, 12, 1e-4);
  }
}

TEST_P(RodDerivatives, HessianOfALongRodAssembledByPieces)
{
  Random random(44);
  const int n = 600;   // more than two pieces of 256 nodes
  DerivativeCase c = GetParam();
  const auto grasp = c.grasp;
  c.grasp = [&](Rod& r) {
    grasp(r);
    if (!r.state.grasps.empty())   // a clamp on every edge near the seams, wherever exactly they are
      for (int node = 244; node < 540; node += node == 272 ? 232 : 2)
        r.hold(node, node);
  };
  LoadedRod s(c, n, random);
  // one entry missing at a seam is 1e-3 and more; round-off of sixty times the energy 1e-4
  checkHessian(s, random, 3, 3e-4);
}

TEST_P(RodDerivatives, ViscousResponseIsElasticPlusRatioTimesRate)
{
  Random random(43);
  LoadedRod s(GetParam(), 12, random);
  const Eigen::VectorXd zero = Eigen::VectorXd::Zero(48);
  const auto gradientFor = [&](double ratio, const Eigen::Matrix4Xd& reference) {
    s.system.setResponse(ratio, &reference);
    evaluateAt(s.system, s.rod.state, zero);
    return gradientOf(s.system);
  };
  Eigen::Matrix4Xd reference(4, 12 + 2 * s.rod.state.grasps.size()), now;
  for (int k = 0; k < reference.cols(); ++k)
    reference.col(k) = random.numbers(4);
  evaluateAt(s.system, s.rod.state, zero);
  s.system.strains(now);
  const Eigen::VectorXd elastic = gradientFor(0.0, reference), once = gradientFor(1.0, reference) - elastic;
  ASSERT_GT(once.norm(), 0.1);
  EXPECT_LT((gradientFor(1.0, now) - elastic).norm(), 1e-12 * elastic.norm());   // no rate, no viscous force
  if (GetParam().straight)   // a viscous twisting moment softens its bending, too
    return;
  EXPECT_LT((gradientFor(3.0, reference) - elastic - 3.0 * once).norm(), 1e-12 * once.norm());
  EXPECT_LT((gradientFor(1.0, now + 0.5 * (reference - now)) - elastic - 0.5 * once).norm(), 1e-12 * once.norm());
}

const std::vector<DerivativeCase> kDerivativeCases = {
    {"open", false, [](Rod&) {}, 0.0},
    {"closed", true, [](Rod&) {}, 0.0},
    {"clamped_ends", false,
     [](Rod& r) {
       r.hold(0, 0);
       r.hold(r.model->nodes() - 1, r.model->nodes() - 1);
     },
     0.0},
    {"clamped_middle", false, [](Rod& r) { r.hold(4, 4); }, 0.0},
    {"held_edges", false,
     [](Rod& r) {
       r.hold(0, 2);
       r.hold(5, 6);
     },
     0.0},
    {"neighbouring_clamps", false,
     [](Rod& r) {
       r.hold(0, 0);
       r.hold(2, 2);
       r.hold(3, 3);
     },
     0.0},
    {"pinned", false,
     [](Rod& r) {
       r.hold(0, 0, false);
       r.hold(5, 5, false);
     },
     0.0},
    {"closed_clamped", true,
     [](Rod& r) {
       r.hold(0, 0);
       r.hold(4, 5);
     },
     0.0},
    {"closed_clamped_last", true,
     [](Rod& r) {
       r.hold(r.model->nodes() - 1, r.model->nodes() - 1);
       r.hold(3, 3, false);
     },
     0.0},
    {"viscous_open", false,
     [](Rod& r) {
       r.hold(0, 0);
       r.hold(5, 6);
     },
     1.7},
    {"viscous_closed", true, [](Rod& r) { r.hold(2, 2); }, 0.6},
    {"compensated", false,
     [](Rod& r) {
       r.hold(0, 2);
       r.hold(5, 5);
     },
     0.0, Curvature::compensated},
    {"compensated_closed", true, [](Rod&) {}, 0.0, Curvature::compensated},
    {"compensated_viscous", false,
     [](Rod& r) {
       r.hold(0, 0);
       r.hold(5, 6);
     },
     1.7, Curvature::compensated},
    {"compensated_straight", false,
     [](Rod& r) {
       r.hold(0, 0);
       r.hold(4, 4);
     },
     0.0, Curvature::compensated, true},
    {"compensated_straight_closed", true, [](Rod& r) { r.hold(3, 3); }, 0.0, Curvature::compensated, true},
};
INSTANTIATE_TEST_SUITE_P(Kinds, RodDerivatives, ::testing::ValuesIn(kDerivativeCases),
                         [](const auto& info) { return info.param.name; });

}   // namespace
}   // namespace slender::test
