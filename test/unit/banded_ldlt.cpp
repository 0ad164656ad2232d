#include <limits>

#include <Eigen/Eigenvalues>
#include <gtest/gtest.h>

#include "slender_sim/linalg/banded_ldlt.h"
#include "slender_sim/linalg/cyclic_banded_ldlt.h"
#include "test/support/bands.h"

namespace slender::test {
namespace {

// Backward error of LDL^T with a half-bandwidth of 10 and no growth (|L| < 1): about 3 * 11 roundings of 1e-16.
constexpr double kBackward = 1e-14;

template <class Solver>
void load(Solver& solver, const AlignedVector<RodPanel>& panels)
{
  std::copy(panels.begin(), panels.end(), solver.panels());
}

Eigen::VectorXd signedPivots(int n, double negative_share, Random& random)
{
  Eigen::VectorXd d(n);
  for (int i = 0; i < n; ++i)
    d[i] = random.uniform(0.5, 2.0) * (random.uniform(0.0, 1.0) < negative_share ? -1.0 : 1.0);
  return d;
}

TEST(BandedLdlt, SolvesFilledStaircases)
{
  Random random(1);
  for (int blocks : {1, 2, 3, 4, 5, 7, 16, 61})
    for (double negative : {0.0, 0.3, 1.0})
    {
      const Eigen::VectorXd d = signedPivots(4 * blocks, negative, random);
      const Eigen::MatrixXd a = bandWithPivots(d, random);
      BandedLdlt<10, 4> solver;
      solver.resize(blocks);
      load(solver, panelsOf(a));
      const Inertia inertia = solver.factor();
      EXPECT_EQ(inertia.negative, (d.array() < 0).count());
      EXPECT_EQ(inertia.positive, (d.array() > 0).count());
      EXPECT_EQ(inertia.zero, 0);
      EXPECT_EQ(inertia.positiveDefinite(), (d.array() > 0).all());
      const Eigen::VectorXd b = random.numbers(4 * blocks);
      Eigen::VectorXd x = b;
      solver.solve(x.data());
      EXPECT_LT(backwardError(a, x, b), kBackward) << blocks << " blocks, " << negative << " negative";
      EXPECT_LT((x - a.partialPivLu().solve(b)).norm(), 1e-9 * x.norm());   // condition numbers here stay below 1e5
    }
}

TEST(BandedLdlt, SolvesEightRightHandSides)
{
  Random random(2);
  for (int blocks : {1, 2, 3, 9, 30})
  {
    const Eigen::MatrixXd a = bandWithPivots(signedPivots(4 * blocks, 0.2, random), random);
    BandedLdlt<10, 4> solver;
    solver.resize(blocks);
    load(solver, panelsOf(a));
    solver.factor();
    using Rows = Eigen::Matrix<double, Eigen::Dynamic, 8, Eigen::RowMajor>;
    Rows b(4 * blocks, 8);
    for (int i = 0; i < b.rows(); ++i)
      for (int k = 0; k < 8; ++k)
        b(i, k) = random.uniform();
    Rows x = b;
    solver.solve8(x.data());
    for (int k = 0; k < 8; ++k)
      EXPECT_LT(backwardError(a, x.col(k), b.col(k)), kBackward);
  }
}

TEST(BandedLdlt, EliminatesByPieces)
{
  Random random(9);
  const int blocks = 23;
  const Eigen::MatrixXd a = bandWithPivots(signedPivots(4 * blocks, 0.3, random), random);
  const Eigen::VectorXd b = random.numbers(4 * blocks);
  BandedLdlt<10, 4> whole, pieces;
  const AlignedVector<RodPanel> panels = panelsOf(a);
  whole.resize(blocks);
  pieces.resize(blocks);
  load(whole, panels);
  const Inertia inertia = whole.factor();
  Eigen::VectorXd x = b;
  whole.solve(x.data());
  BandCarry carry;
  Eigen::VectorXd y = b;
  for (int from = 0, to; from < blocks; from = to)
  {
    to = std::min(from + 1 + from % 4, blocks);
    // assembled elsewhere, piece by piece
    AlignedVector<RodPanel> assembled(panels.begin() + from, panels.begin() + to);
    pieces.eliminate(assembled.data(), from, to, y.data(), carry);
  }
  pieces.substitute(y.data());
  EXPECT_EQ(carry.negative, inertia.negative);
  EXPECT_EQ(carry.zero, 0);
  EXPECT_EQ(y, x);   // the same operations in the same order
}

TEST(BandedLdlt, FactorsALeadingPart)
{
  Random random(3);
  const int blocks = 12, part = 7;
  Eigen::MatrixXd a = bandWithPivots(signedPivots(4 * blocks, 0.0, random), random);
  a.bottomLeftCorner(4 * (blocks - part), 4 * part).setZero();
  a.topRightCorner(4 * part, 4 * (blocks - part)).setZero();
  BandedLdlt<10, 4> solver;
  solver.resize(blocks);
  load(solver, panelsOf(a));
  const Inertia inertia = solver.factor(part);
  EXPECT_EQ(inertia.positive, 4 * part);
  const Eigen::VectorXd b = random.numbers(4 * blocks);
  Eigen::VectorXd x = b;
  solver.solve(x.data(), part);
  EXPECT_LT(backwardError(a.topLeftCorner(4 * part, 4 * part), x.head(4 * part), b.head(4 * part)), kBackward);
  EXPECT_EQ(x.tail(4 * (blocks - part)), b.tail(4 * (blocks - part)));   // what lies beyond is not touched
}

TEST(BandedLdlt, ReportsSingularAndNonFinite)
{
  Random random(4);
  const int blocks = 6;
  const Eigen::MatrixXd good = bandWithPivots(signedPivots(4 * blocks, 0.0, random), random);
  for (int bad : {0, 5, 4 * blocks - 1})
    for (double value : {0.0, std::numeric_limits<double>::quiet_NaN(), std::numeric_limits<double>::infinity()})
    {
      Eigen::MatrixXd a = good;
      a.row(bad).setZero();
      a.col(bad).setZero();
      a(bad, bad) = value;
      BandedLdlt<10, 4> solver;
      solver.resize(blocks);
      load(solver, panelsOf(a));
      const Inertia inertia = solver.factor();
      EXPECT_EQ(inertia.zero, 1) << "unknown " << bad << " value " << value;
      EXPECT_FALSE(inertia.positiveDefinite());
    }
}

TEST(CyclicBandedLdlt, SolvesClosedBands)
{
  Random random(5);
  for (int blocks : {5, 6, 7, 8, 9, 12, 33})
    for (double negative : {0.0, 0.3, 1.0})
    {
      // diagonally dominant (rows have at most 21 other entries below 1), so that every leading block is well
      // conditioned
      const Eigen::VectorXd d = 16.0 * signedPivots(4 * blocks, negative, random).array().sign().matrix();
      const Eigen::MatrixXd a = periodicBand(d, random);
      CyclicBandedLdlt solver;
      solver.resize(blocks, true);
      load(solver, panelsOf(a, true));
      const Inertia inertia = solver.factor();
      const Eigen::VectorXd values = Eigen::SelfAdjointEigenSolver<Eigen::MatrixXd>(a).eigenvalues();
      EXPECT_EQ(inertia.positive, (values.array() > 0).count());
      EXPECT_EQ(inertia.negative, (values.array() < 0).count());
      EXPECT_EQ(inertia.zero, 0);
      const Eigen::VectorXd b = random.numbers(4 * blocks);
      Eigen::VectorXd x = b;
      solver.solve(x.data());
      EXPECT_LT(backwardError(a, x, b), 10 * kBackward) << blocks << " blocks";   // growth in the Schur complement
      EXPECT_LT((x - a.partialPivLu().solve(b)).norm(), 1e-10 * x.norm());
    }
}

TEST(CyclicBandedLdlt, OpenBandsPassThrough)
{
  Random random(6);
  const Eigen::MatrixXd a = bandWithPivots(signedPivots(40, 0.0, random), random);
  CyclicBandedLdlt solver;
  solver.resize(10, false);
  load(solver, panelsOf(a));
  EXPECT_TRUE(solver.factor().positiveDefinite());
  const Eigen::VectorXd b = random.numbers(40);
  Eigen::VectorXd x = b;
  solver.solve(x.data());
  EXPECT_LT(backwardError(a, x, b), kBackward);
}

TEST(CyclicBandedLdlt, FactorsTwiceWithoutMemoryOfTheFirst)
{
  Random random(7);
  CyclicBandedLdlt solver;
  solver.resize(9, true);
  for (int round = 0; round < 2; ++round)
  {
    const Eigen::MatrixXd a = periodicBand(Eigen::VectorXd::Constant(36, 20.0 + round), random);
    load(solver, panelsOf(a, true));
    solver.factor();
    const Eigen::VectorXd b = random.numbers(36);
    Eigen::VectorXd x = b;
    solver.solve(x.data());
    EXPECT_LT(backwardError(a, x, b), kBackward);
  }
}

TEST(CyclicBandedLdlt, ReportsSingularAndNonFinite)
{
  Random random(8);
  const int n = 28;
  for (int bad : {0, 13, n - 6, n - 1})   // in the band and in the separator
    for (double value : {0.0, std::numeric_limits<double>::quiet_NaN(), std::numeric_limits<double>::infinity()})
    {
      Eigen::MatrixXd a = periodicBand(Eigen::VectorXd::Constant(n, 20.0), random);
      a.row(bad).setZero();
      a.col(bad).setZero();
      a(bad, bad) = value;
      CyclicBandedLdlt solver;
      solver.resize(n / 4, true);
      load(solver, panelsOf(a, true));
      const Inertia inertia = solver.factor();
      EXPECT_GE(inertia.zero, 1) << "unknown " << bad << " value " << value;
      EXPECT_FALSE(inertia.positiveDefinite());
    }
}

TEST(CyclicBandedLdlt, RefusesTooFewBlocks)
{
  CyclicBandedLdlt solver;
  EXPECT_THROW(solver.resize(4, true), std::invalid_argument);
  EXPECT_NO_THROW(solver.resize(5, true));
  EXPECT_NO_THROW(solver.resize(3, false));
}

}   // namespace
}   // namespace slender::test
