// Every energy that a chain takes as a term, from one list: gradient and Hessian against differences, and that a chain
// may be evaluated in ranges. Clamps are tested with their rods (rod_derivatives.cpp).
#include <algorithm>
#include <cstring>
#include <functional>
#include <memory>

#include <gtest/gtest.h>

#include "slender_sim/energy/spin_inertia.h"
#include "slender_sim/energy/surface_energy.h"
#include "slender_sim/energy/twist_loads.h"
#include "slender_sim/thread/thread_system.h"
#include "test/support/threads.h"

namespace slender::test {
namespace {

/// A wiggly chain without stiffness, inertia or loads: its energy is that of the terms.
class BareChain : public ChainSystem
{
public:
  using ChainSystem::addTerm;
  using ChainSystem::turned;

  BareChain(int n, Random& random)
  {
    const ThreadState state = wigglyThread(n, random);
    setSize(n, false, Curvature::tangent);
    allocate(n);
    holds_.release(a_.nodes);
    keepTurns(true);
    for (int i = 0; i < n; ++i)
      setPosition(i, state.x[i]);
    for (int j = -2; j < n + 9; ++j)
    {
      const int edge = std::clamp(j, 0, n - 2);
      put(a_.base_t, j, state.edge(edge).normalized());
      put(a_.base_d1, j, state.d1[edge]);
    }
    // the terms are at work where the edges have been turned already
    for (int j = 0; j + 1 < n; ++j)
      a_.turn[j] = random.uniform();
    evaluateWhole(false);
    accept();
  }

  /// Energy at the base moved by d, four unknowns per node.
  RodEvaluation at(const Eigen::VectorXd& d, bool with_hessian = false)
  {
    Eigen::Map<Eigen::VectorXd>(direction(), d.size()) = d;
    moveAlong(d.isZero(0.0) ? 0.0 : 1.0);
    return evaluateWhole(with_hessian);
  }
  Eigen::VectorXd gradientAt(const Eigen::VectorXd& d)
  {
    at(d);
    return Eigen::Map<Eigen::VectorXd>(gradient(), d.size());
  }
  /// The matrix of the last evaluation with Hessian, times d.
  Eigen::VectorXd times(const Eigen::VectorXd& d)
  {
    Eigen::VectorXd product = Eigen::VectorXd::Zero(d.size());
    for (int i = 0; i < nodes(); ++i)
      for (int c = 0; c < 4; ++c)
        for (int r = c; r < kPanelRows; ++r)
          if (const int row = panelUnknown(i, r), column = 4 * i + c; row >= 0)
          {
            const double entry = panelEntry(panels()[i], c, r);
            product[row] += entry * d[column];
            if (row != column)
              product[column] += entry * d[row];
          }
    return product;
  }
};

struct TermCase
{
  std::string name;
  std::function<std::unique_ptr<ChainTerm>(int edges, Random& random)> make;
};

void PrintTo(const TermCase& c, std::ostream* out) { *out << c.name; }

class ChainTerms : public ::testing::TestWithParam<TermCase>
{
protected:
  static constexpr int kNodes = 13;

  Random random_{17};
  BareChain chain_{kNodes, random_};
  std::unique_ptr<ChainTerm> term_ = GetParam().make(kNodes - 1, random_);
  const Eigen::VectorXd zero_ = Eigen::VectorXd::Zero(4 * kNodes);

  Eigen::VectorXd direction()
  {
    Eigen::VectorXd d = random_.numbers(4 * kNodes);
    d[4 * kNodes - 1] = 0.0;   // the last node has no edge
    return d;
  }
};

TEST_P(ChainTerms, GradientMatchesDifferences)
{
  chain_.addTerm(*term_);
  const Eigen::VectorXd gradient = chain_.gradientAt(zero_);
  ASSERT_GT(gradient.norm(), 0.1);
  for (int sample = 0; sample < 8; ++sample)
  {
    const Eigen::VectorXd d = direction();
    double best = 1e9;
    for (const double h : {1e-3, 1e-4, 1e-5})
      best = std::min(best,
                      std::abs((chain_.at(h * d).energy() - chain_.at(-h * d).energy()) / (2 * h) - gradient.dot(d)));
    EXPECT_LT(best, 1e-8 * gradient.norm());   // h = 1e-4: truncation and round-off of 1e-9 and less
  }
}

TEST_P(ChainTerms, HessianMatchesDifferences)
{
  chain_.addTerm(*term_);
  for (int sample = 0; sample < 8; ++sample)
  {
    const Eigen::VectorXd d = direction();
    chain_.at(zero_, true);
    const Eigen::VectorXd product = chain_.times(d);
    double best = 1e9;
    for (const double h : {1e-3, 1e-4, 1e-5})
      best = std::min(best, ((chain_.gradientAt(h * d) - chain_.gradientAt(-h * d)) / (2 * h) - product).norm());
    EXPECT_LT(best, 1e-8 * (1.0 + product.norm()));   // as the gradient
  }
}

/// Long chains are evaluated piece by piece. What the terms add must not depend on where the pieces end.
TEST_P(ChainTerms, RangesAddWhatTheWholeChainDoes)
{
  struct Sum
  {
    Eigen::VectorXd gradient;
    AlignedVector<RodPanel> panels = AlignedVector<RodPanel>(kNodes, RodPanel{});
    RodEvaluation energies;
  };
  const auto add = [&](std::initializer_list<int> ends) {
    Sum sum;
    chain_.at(zero_);   // without the term the gradient is zero
    int from = 0;
    for (const int to : ends)
    {
      term_->add({chain_.arrays(), chain_.turned(), sum.panels.data(), 0, from, to}, sum.energies);
      from = to;
    }
    sum.gradient = Eigen::Map<Eigen::VectorXd>(chain_.gradient(), 4 * kNodes);
    return sum;
  };
  const Sum whole = add({kNodes});
  ASSERT_GT(whole.gradient.norm(), 0.1);
  for (const auto& ends : {std::initializer_list<int>{2, kNodes}, {3, 4, 5, 9, kNodes}, {kNodes - 1, kNodes}})
  {
    const Sum sum = add(ends);
    EXPECT_EQ(sum.gradient, whole.gradient);
    // sums of some ten energies of order one
    EXPECT_NEAR(sum.energies.energy(), whole.energies.energy(), 1e-14 * (1.0 + std::abs(whole.energies.energy())));
    for (int i = 0; i < kNodes; ++i)
      EXPECT_EQ(std::memcmp(&sum.panels[i], &whole.panels[i], sizeof(RodPanel)), 0) << "node " << i;
  }
}

/// Panels of nodes that an element of a later range still reaches may be eliminated no earlier.
TEST_P(ChainTerms, RangesReachNoFurtherBackThanPromised)
{
  const int from = 7;
  AlignedVector<RodPanel> panels(kNodes, RodPanel{});
  chain_.at(zero_);
  RodEvaluation sum;
  term_->add({chain_.arrays(), chain_.turned(), panels.data(), 0, from, kNodes}, sum);
  const Eigen::Map<Eigen::VectorXd> gradient(chain_.gradient(), 4 * kNodes);
  const int untouched = from - ChainTerm::kReach;
  EXPECT_TRUE(gradient.head(4 * untouched).isZero(0.0));
  EXPECT_GT(gradient.norm(), 0.0);
  const RodPanel zero{};
  for (int i = 0; i < untouched; ++i)
    EXPECT_EQ(std::memcmp(&panels[i], &zero, sizeof(RodPanel)), 0) << "node " << i;
}

std::unique_ptr<ChainTerm> surface(SurfaceShape shape, int edges, Random& random)
{
  auto term = std::make_unique<SurfaceEnergy>();
  term->begin(0.7, shape, edges);
  for (int j = 0; j + 1 < edges; ++j)   // the last edge is the inside of a holder
    term->setVolume(j, random.uniform(0.2, 2.0));
  return term;
}

const std::vector<TermCase> kTermCases = {
    {"surface_of_cones", [](int edges, Random& random) { return surface(SurfaceShape::cone, edges, random); }},
    {"surface_of_cylinders", [](int edges, Random& random) { return surface(SurfaceShape::cylinder, edges, random); }},
    {"spin_inertia",
     [](int edges, Random& random) {
       auto term = std::make_unique<SpinInertia>();
       term->resize(edges);
       for (int j = 0; j < edges; ++j)
         term->set(j, random.uniform(0.5, 2.0), random.uniform());
       return term;
     }},
    {"twist_loads",
     [](int edges, Random& random) {
       auto term = std::make_unique<TwistLoads>();
       term->set(random.numbers(edges));
       return term;
     }},
};
INSTANTIATE_TEST_SUITE_P(Kinds, ChainTerms, ::testing::ValuesIn(kTermCases),
                         [](const auto& info) { return info.param.name; });

/// A thread with all its terms, longer than the pieces by which matrices are assembled and eliminated (256 nodes), and
/// longer than those matrices that stay in the cache as a whole (8192 nodes).
TEST(LongChains, PiecesSolveTheSameEquations)
{
  for (const int n : {256, 257, 258, 700, 9000})
  {
    Random random(n);
    Eigen::Matrix3Xd x(3, n);
    for (int i = 0; i < n; ++i)
      x.col(i) = Eigen::Vector3d(i, 0, 0) + random.vector(0.3);
    const ThreadState state = makeThread(x, Eigen::VectorXd::Constant(n - 1, 0.3), random.direction());
    ThreadSystem system;
    system.resize(n);
    for (int i = 0; i < n; ++i)
    {
      system.setPosition(i, state.x[i]);
      system.setTwist(i, state.twist[i]);
    }
    for (int j = 0; j + 1 < n; ++j)
      system.setFrame(j, state.edge(j).normalized(), state.d1[j]);
    system.takeRestStrains();
    system.setSurfaceTension(0.5, SurfaceShape::cone);
    for (int i = 0; i < n; ++i)
    {
      system.setInertia(i, random.uniform(4, 6), state.x[i] + random.vector(0.2), random.vector(3.0));
      if (i > 0 && i + 1 < n)
        system.setJoint(i, random.uniform(0.5, 1.5), random.uniform(0.5, 1.5));
      if (i + 1 < n)
      {
        system.setEdge(i, random.uniform(1, 3), state.volume[i]);
        system.setSpin(i, random.uniform(4, 6), random.uniform());
      }
    }
    for (int i = 250; i < std::min(n, 262); i += 3)
      system.hold(i);
    const HessianShift shift{0.3, 0.2};
    const auto solution = [&] {
      system.solve();
      return Eigen::VectorXd(Eigen::Map<Eigen::VectorXd>(system.direction(), 4 * n));
    };
    const auto gradient = [&] { return Eigen::VectorXd(Eigen::Map<Eigen::VectorXd>(system.gradient(), 4 * n)); };

    const RodEvaluation whole = system.evaluateWhole(true);
    const Inertia inertia = system.factorWhole(shift);
    const Eigen::VectorXd whole_gradient = gradient(), whole_solution = solution();
    const RodEvaluation pieces = system.evaluate(true, shift);
    EXPECT_TRUE(inertia.positiveDefinite());
    EXPECT_EQ(pieces.inertia.positive, inertia.positive);
    EXPECT_TRUE((gradient().array() == whole_gradient.array()).all()) << "n " << n;
    EXPECT_TRUE((solution().array() == whole_solution.array()).all()) << "n " << n;
    EXPECT_GT(whole_solution.norm(), 1.0);
    // areas are added up by pieces
    EXPECT_NEAR(pieces.energy(), whole.energy(), 1e-13 * std::abs(whole.energy())) << "n " << n;
  }
}

}   // namespace
}   // namespace slender::test
