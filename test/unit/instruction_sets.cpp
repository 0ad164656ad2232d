// Every table of kernels that this machine can run must give what the portable one gives, to round-off.
#include <algorithm>
#include <cmath>
#include <string>
#include <tuple>
#include <vector>

#include <gtest/gtest.h>

#include "slender_sim/energy/rod_kernel.h"
#include "slender_sim/linalg/banded_ldlt_kernel.h"
#include "slender_sim/linalg/isa.h"
#include "slender_sim/rod/rod_system.h"
#include "test/support/bands.h"
#include "test/support/rods.h"

namespace slender::test {
namespace {

template <class Table>
struct Named
{
  std::string name;
  const Table* table;
};

/// The tables other than the baseline's.
template <class Table>
std::vector<Named<Table>> wideTables([[maybe_unused]] const Table* avx2, [[maybe_unused]] const Table* avx512)
{
  std::vector<Named<Table>> tables;
#if defined(__x86_64__)
  if (__builtin_cpu_supports("avx2") && __builtin_cpu_supports("fma"))
    tables.push_back({"avx2", avx2});
  if (__builtin_cpu_supports("avx512f") && __builtin_cpu_supports("avx512dq") && __builtin_cpu_supports("avx512vl"))
    tables.push_back({"avx512", avx512});
#endif
  return tables;
}

std::vector<Named<BandKernels>> bandTables()
{
#if defined(__x86_64__)
  return wideTables(&avx2::kBandKernels, &avx512::kBandKernels);
#else
  return {};
#endif
}
std::vector<Named<RodKernels>> rodTables()
{
#if defined(__x86_64__)
  return wideTables(&avx2::kRodKernels, &avx512::kRodKernels);
#else
  return {};
#endif
}

TEST(InstructionSets, BestIsAmongThoseOfTheMachine)
{
  const auto tables = bandTables();
  const Isa widest = tables.empty() ? Isa::baseline : tables.back().name == "avx512" ? Isa::avx512 : Isa::avx2;
  EXPECT_EQ(bestIsa(), widest);
}

TEST(InstructionSets, BandKernelsAgree)
{
  Random random(11);
  for (int blocks : {1, 2, 3, 8, 40})
  {
    const int n = 4 * blocks;
    Eigen::VectorXd d(n);
    for (int i = 0; i < n; ++i)
      d[i] = random.uniform(0.5, 2.0) * (i % 5 == 3 ? -1 : 1);
    const AlignedVector<RodPanel> original = panelsOf(bandWithPivots(d, random));
    const Eigen::VectorXd b = random.numbers(n), b8 = random.numbers(8 * n);
    AlignedVector<RodPanel> reference = original;
    BandCarry carry;
    Eigen::VectorXd x = b, x8 = b8, by_pieces = b;
    baseline::kBandKernels.eliminate(reference.data(), reference.data(), 0, blocks, by_pieces.data(), carry);
    baseline::kBandKernels.substitute(reference.data(), blocks, by_pieces.data());
    EXPECT_EQ(carry.negative, (d.array() < 0).count());
    EXPECT_EQ(carry.zero, 0);
    baseline::kBandKernels.solve(reference.data(), blocks, x.data());
    baseline::kBandKernels.solve8(reference.data(), blocks, x8.data());
    for (const auto& [name, table] : bandTables())
    {
      AlignedVector<RodPanel> panels = original;
      BandCarry other;
      Eigen::VectorXd y = b, y8 = b8, y_pieces = b;
      AlignedVector<RodPanel> assembled = original;   // factors go elsewhere, past the cache
      table->eliminate(assembled.data(), panels.data(), 0, blocks, y_pieces.data(), other);
      table->substitute(panels.data(), blocks, y_pieces.data());
      EXPECT_EQ(other.negative, carry.negative) << name;
      table->solve(panels.data(), blocks, y.data());
      table->solve8(panels.data(), blocks, y8.data());
      // fused products round differently; times a condition number below 1e5
      EXPECT_LT((y - x).norm(), 1e-10 * x.norm()) << name << " " << blocks;
      EXPECT_LT((y_pieces - by_pieces).norm(), 1e-10 * x.norm()) << name << " " << blocks;
      EXPECT_LT((y8 - x8).norm(), 1e-10 * x8.norm()) << name << " " << blocks;
      Eigen::MatrixXd broken = Eigen::MatrixXd::Identity(n, n);
      broken(n - 2, n - 2) = 0.0;
      AlignedVector<RodPanel> singular = panelsOf(broken);
      BandCarry stopped;
      table->eliminate(singular.data(), singular.data(), 0, blocks, nullptr, stopped);
      EXPECT_EQ(stopped.zero, 1) << name;
    }
  }
}

struct Output
{
  RodEvaluation with, without;
  Eigen::VectorXd gradient, gradient_only, frames, strains, hessian, angles;
};

RodEvaluation sweep(const RodKernels& table, Curvature curvature, const RodArrays& a, RodPanel* panels, int piece)
{
  RodSweep sweep;
  table.begin(a, sweep);
  for (int done = 0; done < a.nodes;)
  {
    const int before = done;
    done = table.advance[static_cast<int>(curvature)](a, sweep, panels, 0,
                                                      a.closed ? a.nodes : std::min(done + piece, a.nodes));
    if (done <= before)
    {
      ADD_FAILURE() << "the sweep stands still at node " << done;
      break;
    }
  }
  return table.end(sweep);
}

Output evaluate(const RodKernels& table, const RodSystem& system, int piece)
{
  const RodArrays& a = system.arrays();
  const int n = a.nodes, edges = a.edges;
  const Curvature curvature = system.model().curvature;
  AlignedVector<RodPanel> panels(n);
  Output out;
  out.without = sweep(table, curvature, a, nullptr, n);
  out.gradient_only = Eigen::Map<Eigen::VectorXd>(a.gradient, 4 * n);
  out.angles.resize(2 * edges);
  out.angles << Eigen::Map<Eigen::VectorXd>(a.theta_diagonal, edges), Eigen::Map<Eigen::VectorXd>(a.theta_off, edges);
  out.with = sweep(table, curvature, a, panels.data(), piece);
  out.gradient = Eigen::Map<Eigen::VectorXd>(a.gradient, 4 * n);
  out.frames.resize(6 * edges);
  for (int k = 0; k < 3; ++k)
    out.frames.segment(2 * k * edges, 2 * edges) << Eigen::Map<Eigen::VectorXd>(a.t[k], edges),
        Eigen::Map<Eigen::VectorXd>(a.d1[k], edges);
  out.strains.resize(3 * n + edges);
  out.strains << Eigen::Map<Eigen::VectorXd>(a.kappa1, n), Eigen::Map<Eigen::VectorXd>(a.kappa2, n),
      Eigen::Map<Eigen::VectorXd>(a.twist, n), Eigen::Map<Eigen::VectorXd>(a.strain, edges);
  out.hessian =
      Eigen::Map<Eigen::VectorXd>(reinterpret_cast<double*>(panels.data()), n * sizeof(RodPanel) / sizeof(double));
  return out;
}

class RodKernelTables : public ::testing::TestWithParam<std::tuple<bool, Curvature>>
{};

TEST_P(RodKernelTables, Agree)
{
  const auto [closed, curvature] = GetParam();
  Random random(12);
  for (int n : {3, 4, 5, 6, 7, 8, 9, 10, 15, 16, 17, 18, 23, 24, 25, 64, 101})
  {
    if (closed && n < 5)
      continue;
    const Matrix3Xd nodes = wigglyNodes(n, closed, random);
    const RodModel model = buildRod("r", nodes, closed, oddSections(closed ? n : n - 1, random), Vector3d::Zero(),
                                    false, {curvature, false});
    // several turns per joint: the unwrapping must agree too
    const RodState state = makeRodState(model, nodes, Vector3d::Zero(), 2 * M_PI * n);
    RodSystem system(model);
    system.load(state);
    for (int i = 0; i < n; ++i)
    {
      system.setPosition(i, state.x.col(i) + random.vector(0.15));
      system.setInertia(i, random.uniform(0.1, 1.0), random.vector(), random.vector());
      system.arrays().turn[i] = i < model.edges() ? random.uniform(-1.5, 1.5) : 0.0;
    }
    if (closed)
    {
      for (int i = 1; i <= RodArrays::kHalo; ++i)
      {
        system.arrays().turn[-i] = system.arrays().turn[((n - i) % n + n) % n];
        system.arrays().turn[n - 1 + i] = system.arrays().turn[(i - 1) % n];
      }
    }
    const Output reference = evaluate(baseline::kRodKernels, system, n);
    // a sweep by pieces adds the same numbers in the same order
    const Output pieces = evaluate(baseline::kRodKernels, system, 1 + n / 3);
    EXPECT_EQ(pieces.gradient, reference.gradient);
    EXPECT_EQ(pieces.hessian, reference.hessian);
    EXPECT_EQ(pieces.with.energy(), reference.with.energy());
    EXPECT_GT(reference.gradient.norm(), 0.1);
    EXPECT_EQ(reference.gradient, reference.gradient_only);   // with or without the Hessian: one formula
    EXPECT_EQ(reference.with.energy(), reference.without.energy());
    // Towards opposite directors the compensated strain is the quotient of two small numbers.
    const auto twists = Eigen::Map<Eigen::VectorXd>(system.arrays().twist, n).array();
    const double conditioning =
        curvature == Curvature::tangent ? 1.0 : (0.5 * twists).cos().square().inverse().maxCoeff();
    for (const auto& [name, table] : rodTables())
    {
      const Output out = evaluate(*table, system, 1 + n / 2);
      const auto near = [&, conditioning, name = name](const Eigen::VectorXd& a, const Eigen::VectorXd& b,
                                                       const char* what) {
        // some tens of roundings each, relative to the largest entry
        EXPECT_LT((a - b).lpNorm<Eigen::Infinity>(), 1e-13 * conditioning * (1 + b.lpNorm<Eigen::Infinity>()))
            << what << " " << name << " n " << n;
      };
      near(out.frames, reference.frames, "frames");
      near(out.strains, reference.strains, "strains");
      near(out.gradient, reference.gradient, "gradient");
      near(out.gradient_only, reference.gradient_only, "gradient without Hessian");
      near(out.angles, reference.angles, "angle block");
      near(out.hessian, reference.hessian, "Hessian");
      EXPECT_NEAR(out.with.stretch, reference.with.stretch, 1e-13 * (1 + reference.with.stretch));
      EXPECT_NEAR(out.with.bend_twist, reference.with.bend_twist, 1e-13 * (1 + reference.with.bend_twist));
      EXPECT_NEAR(out.with.potential, reference.with.potential, 1e-13 * (1 + std::abs(reference.with.potential)));
      EXPECT_NEAR(out.with.min_chi, reference.with.min_chi, 1e-13);
      EXPECT_NEAR(out.with.max_strain, reference.with.max_strain, 1e-13);
    }
  }
}

TEST_P(RodKernelTables, ReportNanInAnyNode)
{
  const auto [closed, curvature] = GetParam();
  Random random(13);
  const int n = 19;
  const Matrix3Xd nodes = wigglyNodes(n, closed, random);
  const RodModel model = buildRod("r", nodes, closed, oddSections(closed ? n : n - 1, random), Vector3d::Zero(), false,
                                  {curvature, false});
  const RodState state = makeRodState(model, nodes, Vector3d::Zero());
  auto tables = rodTables();
  tables.push_back({"baseline", &baseline::kRodKernels});
  for (const auto& [name, table] : tables)
    for (int bad = 0; bad < n; ++bad)
    {
      RodSystem system(model);
      system.load(state);
      system.setPosition(bad, Vector3d(0, std::nan(""), 0));
      EXPECT_FALSE(std::isfinite(sweep(*table, curvature, system.arrays(), nullptr, n).energy()))
          << name << " node " << bad;
    }
}

INSTANTIATE_TEST_SUITE_P(OpenAndClosed, RodKernelTables,
                         ::testing::Combine(::testing::Bool(),
                                            ::testing::Values(Curvature::tangent, Curvature::compensated)));

}   // namespace
}   // namespace slender::test
