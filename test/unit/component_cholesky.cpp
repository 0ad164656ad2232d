// Factorisation by components gives right solutions, keeps analyses, and finds matrices that are not definite.
#include "linalg/component_cholesky.h"

#include <algorithm>
#include <cmath>

#include <Eigen/Dense>
#include <gtest/gtest.h>

#include "test/support/random.h"

namespace slender::test {
namespace {

/// The lower triangle of a symmetric matrix that its diagonal dominates.
struct Matrix
{
  explicit Matrix(int size) : dense(10.0 * Eigen::MatrixXd::Identity(size, size)) {}
  void couple(int a, int b, double value)
  {
    dense(std::max(a, b), std::min(a, b)) = value;
    dense(a, a) += std::abs(value);
    dense(b, b) += std::abs(value);
  }
  /// Couples each of the unknowns first, first + stride, ... with the next `band` of them.
  void addBand(Random& random, int first, int stride, int count, int band)
  {
    for (int i = 0; i < count; ++i)
      for (int j = i + 1; j < count && j <= i + band; ++j)
        couple(first + stride * i, first + stride * j, random.uniform());
  }
  /// Lists the entries by columns.
  void list()
  {
    starts = {0};
    rows.clear();
    values.clear();
    for (int j = 0; j < dense.cols(); ++j)
    {
      for (int i = j; i < dense.rows(); ++i)
        if (dense(i, j) != 0.0)
        {
          rows.push_back(i);
          values.push_back(dense(i, j));
        }
      starts.push_back(static_cast<int>(rows.size()));
    }
  }

  Eigen::MatrixXd dense;
  std::vector<int> starts, rows;
  std::vector<double> values;
};

/// No unknown is idle.
std::vector<char> busy(Eigen::Index unknowns) { return std::vector<char>(static_cast<std::size_t>(unknowns), 0); }

/// Solves with `kept`, which may know parts of the pattern, and with a fresh factorisation. The results are equal to
/// the last bit, and solve the equations up to round-off.
void solveWith(ComponentCholesky& kept, const Matrix& a, bool simplicial)
{
  const Eigen::Index n = a.dense.rows();
  const Eigen::VectorXd b = Eigen::VectorXd::LinSpaced(n, 1.0, 2.0);
  ComponentCholesky fresh(simplicial);
  kept.setPattern(a.starts, a.rows);
  fresh.setPattern(a.starts, a.rows);
  for (const int threads : {1, 3})
  {
    Eigen::VectorXd x = b, y = b;
    ASSERT_TRUE(kept.factor(a.values, busy(n), threads));
    ASSERT_TRUE(fresh.factor(a.values, busy(n), 1));
    kept.solve(x.data(), threads);
    fresh.solve(y.data(), 1);
    EXPECT_EQ(x, y);
    if (n > 0)   // The bound is round-off: the condition number is about 10.
      EXPECT_LT((a.dense.selfadjointView<Eigen::Lower>() * x - b).norm(), 1e-14 * b.norm());
  }
}

TEST(ComponentCholesky, SolvesWhilePatternsComeAndGo)
{
  for (const bool simplicial : {false, true})
  {
    Random random(1);
    ComponentCholesky kept(simplicial);
    for (const int coupled : {0, 0, 1, 3, 2, 0, 5})   // pairs of components that contacts couple
    {
      Matrix a(6 * 40 + 200);
      for (int k = 0; k < 6; ++k)   // equal components, scattered, and another one that is dense enough for supernodes
        a.addBand(random, k, 6, 40, 3);
      a.addBand(random, 240, 1, 200, 199);
      for (int k = 0; k < coupled; ++k)
        a.couple(60 + k, 61 + k, random.uniform());
      a.list();
      solveWith(kept, a, simplicial);
    }
    for (const int size : {1, 0, 7})
    {
      Matrix a(size);
      a.list();
      solveWith(kept, a, simplicial);
    }
  }
}

TEST(ComponentCholesky, OneIndefiniteComponentIsEnough)
{
  for (const bool simplicial : {false, true})
  {
    Random random(2);
    Matrix a(80);
    for (int k = 0; k < 4; ++k)
      a.addBand(random, k, 4, 20, 2);
    a.list();
    ComponentCholesky cholesky(simplicial);
    solveWith(cholesky, a, simplicial);
    a.values[a.starts[13]] *= -1.0;   // a diagonal entry
    EXPECT_FALSE(cholesky.factor(a.values, busy(80), 1));
    EXPECT_FALSE(cholesky.factor(a.values, busy(80), 2));
    a.list();
    solveWith(cholesky, a, simplicial);
  }
}

TEST(ComponentCholesky, ComponentsHaveTheirMultipliers)
{
  Random random(5);
  Matrix a(42);
  for (int k = 0; k < 2; ++k)
  {
    a.addBand(random, k, 2, 20, 2);
    for (int i = 3; i < 8; ++i)
      a.dense(40 + k, 2 * i + k) = 1.0;
    a.dense(40 + k, 40 + k) = -0.1;
  }
  a.list();
  const Eigen::VectorXd b = Eigen::VectorXd::LinSpaced(42, 1.0, 2.0);
  for (const bool simplicial : {false, true})
  {
    ComponentCholesky cholesky(simplicial);
    for (const int multipliers : {2, 0, 2})   // The analyses of other numbers of multipliers are of no use.
    {
      cholesky.setPattern(a.starts, a.rows, multipliers);
      EXPECT_EQ(cholesky.factor(a.values, busy(42), 2), multipliers == 2);
    }
    Eigen::VectorXd x = b;
    cholesky.solve(x.data(), 2);
    EXPECT_LT((a.dense.selfadjointView<Eigen::Lower>() * x - b).norm(), 1e-14 * b.norm());
  }
}

/// Idle components are neither factored nor solved for, and come back when they are wanted.
TEST(ComponentCholesky, LeavesIdleComponentsOut)
{
  Random random(3);
  Matrix a(80);
  for (int k = 0; k < 4; ++k)
    a.addBand(random, k, 4, 20, 2);
  a.list();
  ComponentCholesky cholesky(false);
  solveWith(cholesky, a, false);
  std::vector<double> values = a.values;
  values[a.starts[13]] *= -1.0;   // a diagonal entry of the second component
  std::vector<char> idle = busy(80);
  for (int u = 1; u < 80; u += 4)
    idle[u] = 1;
  ASSERT_TRUE(cholesky.factor(values, idle, 2));
  const Eigen::VectorXd b = Eigen::VectorXd::LinSpaced(80, 1.0, 2.0);
  Eigen::VectorXd some = b, all = b;
  cholesky.solve(some.data(), 2);
  ASSERT_TRUE(cholesky.factor(a.values, busy(80), 1));
  cholesky.solve(all.data(), 1);
  for (int u = 0; u < 80; ++u)
    EXPECT_EQ(some[u], idle[u] ? b[u] : all[u]) << u;
}

}   // namespace
}   // namespace slender::test
