// Factorisation by components: right solutions, kept analyses, and matrices that are not definite.
#include "linalg/component_cholesky.h"

#include <Eigen/Dense>
#include <gtest/gtest.h>

#include "test/support/random.h"

namespace slender::test {
namespace {

/// A matrix whose components are pieces of a band, scattered over all unknowns.
struct Scattered
{
  Scattered(Random& random, int size, int components) : dense(Eigen::MatrixXd::Zero(size, size))
  {
    for (int i = 0; i < size; ++i)
    {
      dense(i, i) = 10.0 + random.uniform();
      for (const int j : {i + components, i + 3 * components})
        if (j < size)
          dense(j, i) = random.uniform();
    }
    for (int j = 0; j < size; ++j)
    {
      for (int i = j; i < size; ++i)
        if (dense(i, j) != 0.0)
        {
          rows.push_back(i);
          values.push_back(dense(i, j));
        }
      starts.push_back(static_cast<int>(rows.size()));
    }
  }

  Eigen::MatrixXd dense;   ///< lower triangle
  std::vector<int> starts{0}, rows;
  std::vector<double> values;
};

double errorOf(ComponentCholesky& cholesky, const Scattered& a, Random& random, int threads)
{
  const Eigen::Index n = a.dense.rows();
  Eigen::VectorXd b(n);
  for (Eigen::Index i = 0; i < n; ++i)
    b[i] = random.uniform();
  Eigen::VectorXd x = b;
  EXPECT_TRUE(cholesky.factor(a.values, threads));
  cholesky.solve(x.data(), threads);
  return (a.dense.selfadjointView<Eigen::Lower>() * x - b).norm() / b.norm();
}

TEST(ComponentCholesky, SolvesWhilePatternsComeAndGo)
{
  Random random(1);
  for (const bool simplicial : {false, true})
  {
    ComponentCholesky cholesky(simplicial);
    for (int k = 0; k < 40; ++k)
    {
      // Some sizes come again, with components that are known and others that are not.
      const Scattered a(random, 30 + 7 * (k % 5), 1 + k % 4);
      cholesky.setPattern(a.starts, a.rows);
      for (const int threads : {1, 2})   // round-off of a matrix that the diagonal dominates
        EXPECT_LT(errorOf(cholesky, a, random, threads), 1e-14) << k;
    }
  }
}

TEST(ComponentCholesky, OneIndefiniteComponentIsEnough)
{
  Random random(2);
  for (const bool simplicial : {false, true})
  {
    Scattered a(random, 60, 4);
    ComponentCholesky cholesky(simplicial);
    cholesky.setPattern(a.starts, a.rows);
    ASSERT_TRUE(cholesky.factor(a.values, 1));
    a.values[a.starts[13]] *= -1.0;   // a diagonal entry
    EXPECT_FALSE(cholesky.factor(a.values, 1));
    EXPECT_FALSE(cholesky.factor(a.values, 2));
    a.values[a.starts[13]] *= -1.0;
    a.dense(13, 13) = a.values[a.starts[13]];
    EXPECT_LT(errorOf(cholesky, a, random, 1), 1e-14);
  }
}

}   // namespace
}   // namespace slender::test
