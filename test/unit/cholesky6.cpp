#include "linalg/cholesky6.h"

#include <cmath>

#include <gtest/gtest.h>

#include "test/support/random.h"

namespace slender::test {
namespace {

TEST(Cholesky6, SolvesAndTellsIndefiniteMatrices)
{
  Random random(61);
  for (int k = 0; k < 50; ++k)
  {
    Cholesky6::Matrix root;
    Cholesky6::Vector x;
    for (int i = 0; i < 6; ++i)
    {
      root.col(i) << random.vector(), random.vector();
      x[i] = random.vector().x();
    }
    Cholesky6::Matrix a = root * root.transpose() + Cholesky6::Matrix::Identity();
    Cholesky6 factor;
    ASSERT_TRUE(factor.compute(a));
    Cholesky6::Vector v = a * x;
    factor.solveInPlace(v);
    EXPECT_LT((v - x).norm(), 1e-13 * a.norm() * x.norm());   // roundings times the condition number
    a(k % 6, k % 6) = -1.0;
    EXPECT_FALSE(factor.compute(a));
    a(k % 6, k % 6) = std::nan("");
    EXPECT_FALSE(factor.compute(a));
  }
}

}   // namespace
}   // namespace slender::test
