// Factorisation and solve of a rod's band (four unknowns per node, half-bandwidth 10) against LAPACK's band solvers.
// Run pinned and single-threaded: OPENBLAS_NUM_THREADS=1 ./banded_ldlt_benchmark

#include <algorithm>
#include <cmath>
#include <random>
#include <stdexcept>
#include <vector>

#include <benchmark/benchmark.h>

#include "slender_sim/linalg/banded_ldlt.h"

extern "C" {
void dpbtrf_(const char* uplo, const int* n, const int* kd, double* ab, const int* ldab, int* info, std::size_t);
void dpbtrs_(const char* uplo, const int* n, const int* kd, const int* nrhs, const double* ab, const int* ldab,
             double* b, const int* ldb, int* info, std::size_t);
void dgbtrf_(const int* m, const int* n, const int* kl, const int* ku, double* ab, const int* ldab, int* pivots,
             int* info);
void dgbtrs_(const char* trans, const int* n, const int* kl, const int* ku, const int* nrhs, const double* ab,
             const int* ldab, const int* pivots, double* b, const int* ldb, int* info, std::size_t);
}

namespace {

using slender::BandedLdlt;
using slender::RodPanel;

constexpr int kHalf = 10, kBlock = 4;

/// Random symmetric positive definite band with a rod's sparsity: a column reaches down to ten rows below the first of
/// its node.
struct Band
{
  explicit Band(int nodes) : n(kBlock * nodes), lower(static_cast<std::size_t>(n) * (kHalf + 1), 0.0)
  {
    std::mt19937 random(1);
    std::uniform_real_distribution<double> entry(-1, 1);
    for (int c = 0; c < n; ++c)
      for (int d = 0; c + d < n && c % kBlock + d <= kHalf; ++d)
        at(c + d, c) = d == 0 ? 15.0 + entry(random) : entry(random);
  }
  double& at(int row, int column)
  {
    return lower[static_cast<std::size_t>(column) * (kHalf + 1) + static_cast<std::size_t>(row - column)];
  }
  double get(int row, int column) const
  {
    if (row < column)
      std::swap(row, column);
    return row - column > kHalf
               ? 0.0
               : lower[static_cast<std::size_t>(column) * (kHalf + 1) + static_cast<std::size_t>(row - column)];
  }
  int n;
  std::vector<double> lower;   ///< LAPACK's lower band storage, leading dimension kHalf + 1
};

void fillPanels(const Band& band, BandedLdlt<kHalf, kBlock>& matrix)
{
  const int blocks = band.n / kBlock;
  matrix.resize(blocks);
  for (int b = 0; b < blocks; ++b)
  {
    RodPanel& panel = matrix.panels()[b];
    for (int c = 0; c < kBlock; ++c)
    {
      const int column = b * kBlock + c;
      for (int r = 0; r < kBlock; ++r)
        panel.diag[c][r] = r >= c ? band.get(b * kBlock + r, column) : 0.0;
      for (int r = 0; r < RodPanel::kStride; ++r)
      {
        const int row = (b + 1) * kBlock + r;
        panel.below[c][r] = r < RodPanel::kBelow && row < band.n ? band.get(row, column) : 0.0;
      }
    }
  }
}

double residual(const Band& band, const std::vector<double>& x)
{
  double worst = 0;
  for (int i = 0; i < band.n; ++i)
  {
    double sum = -1.0;   // right-hand side of ones
    for (int j = std::max(0, i - kHalf); j <= std::min(band.n - 1, i + kHalf); ++j)
      sum += band.get(i, j) * x[static_cast<std::size_t>(j)];
    worst = std::max(worst, std::abs(sum));
  }
  return worst;
}

void finish(benchmark::State& state, const Band& band, const std::vector<double>& x)
{
  if (!(residual(band, x) < 1e-9))
    state.SkipWithError("wrong solution");
  state.counters["per_node"] =
      benchmark::Counter(static_cast<double>(band.n / kBlock),
                         benchmark::Counter::kIsIterationInvariantRate | benchmark::Counter::kInvert);
}

// Every loop copies the matrix in, since all of them factor in place; BM_copy is that part alone.
void BM_copy(benchmark::State& state)
{
  const Band band(static_cast<int>(state.range(0)));
  std::vector<double> work(band.lower.size());
  for (auto _ : state)
  {
    std::copy(band.lower.begin(), band.lower.end(), work.begin());
    benchmark::DoNotOptimize(work.data());
    benchmark::ClobberMemory();
  }
}

void BM_banded_ldlt(benchmark::State& state)
{
  const Band band(static_cast<int>(state.range(0)));
  BandedLdlt<kHalf, kBlock> source, matrix;
  fillPanels(band, source);
  matrix.resize(source.blocks());
  std::vector<double> x(static_cast<std::size_t>(band.n));
  for (auto _ : state)
  {
    std::copy(source.panels(), source.panels() + source.blocks(), matrix.panels());
    std::fill(x.begin(), x.end(), 1.0);
    benchmark::DoNotOptimize(matrix.factor().positive);
    matrix.solve(x.data());
    benchmark::ClobberMemory();
  }
  finish(state, band, x);
}

void BM_lapack_dpbtrf(benchmark::State& state)
{
  const Band band(static_cast<int>(state.range(0)));
  std::vector<double> work(band.lower.size()), x(static_cast<std::size_t>(band.n));
  const int half = kHalf, leading = kHalf + 1, one = 1;
  int info = 0;
  for (auto _ : state)
  {
    std::copy(band.lower.begin(), band.lower.end(), work.begin());
    std::fill(x.begin(), x.end(), 1.0);
    dpbtrf_("L", &band.n, &half, work.data(), &leading, &info, 1);
    dpbtrs_("L", &band.n, &half, &one, work.data(), &leading, x.data(), &band.n, &info, 1);
    benchmark::ClobberMemory();
  }
  finish(state, band, x);
}

void BM_lapack_dgbtrf(benchmark::State& state)
{
  const Band band(static_cast<int>(state.range(0)));
  const int half = kHalf, leading = 3 * kHalf + 1, one = 1;
  std::vector<double> general(static_cast<std::size_t>(band.n) * leading, 0.0), work(general.size()),
      x(static_cast<std::size_t>(band.n));
  for (int c = 0; c < band.n; ++c)
    for (int r = std::max(0, c - kHalf); r <= std::min(band.n - 1, c + kHalf); ++r)
      general[static_cast<std::size_t>(c) * leading + static_cast<std::size_t>(2 * kHalf + r - c)] = band.get(r, c);
  std::vector<int> pivots(static_cast<std::size_t>(band.n));
  int info = 0;
  for (auto _ : state)
  {
    std::copy(general.begin(), general.end(), work.begin());
    std::fill(x.begin(), x.end(), 1.0);
    dgbtrf_(&band.n, &band.n, &half, &half, work.data(), &leading, pivots.data(), &info);
    dgbtrs_("N", &band.n, &half, &half, &one, work.data(), &leading, pivots.data(), x.data(), &band.n, &info, 1);
    benchmark::ClobberMemory();
  }
  finish(state, band, x);
}

}   // namespace

BENCHMARK(BM_copy)->RangeMultiplier(10)->Range(100, 100000);
BENCHMARK(BM_banded_ldlt)->RangeMultiplier(10)->Range(100, 100000);
BENCHMARK(BM_lapack_dpbtrf)->RangeMultiplier(10)->Range(100, 100000);
BENCHMARK(BM_lapack_dgbtrf)->RangeMultiplier(10)->Range(100, 100000);
BENCHMARK_MAIN();
