// Compiled once per instruction set (SLENDER_ISA). Plain arrays only; nothing here may be emitted under a shared name.
#include "slender_sim/dynamics/chain_kernel.h"

#include "energy/pack.h"

namespace slender {
namespace SLENDER_ISA {
namespace {

/// The node after the last edge of a closed chain is the first one again.
void closeNodes(const ChainArrays& r)
{
  for (int k = 0; k < 3; ++k)
    for (int i = 0; i < W; ++i)
      r.x[k][r.nodes + i] = r.closed ? r.x[k][i < r.nodes ? i : 0] : r.x[k][r.nodes - 1];
}

void closeEdges(const ChainArrays& r, double* p)
{
  for (int i = 0; i < W; ++i)
    p[r.edges + i] = r.closed ? p[i < r.edges ? i : 0] : 0.0;
  p[-1] = r.closed ? p[r.edges - 1] : 0.0;
}

void scaledEdges(const ChainArrays& r, double* const* to)
{
  closeNodes(r);
  for (int k = 0; k < 3; ++k)
  {
    for (int j = 0; j < r.edges; j += W)
      store(to[k] + j, (load(r.x[k] + j + 1) - load(r.x[k] + j)) * load(r.inverse_rest + j));
    closeEdges(r, to[k]);
  }
}

void takeDirections(const ChainArrays& r) { scaledEdges(r, r.direction); }

double constraints(const ChainArrays& r)
{
  scaledEdges(r, r.s);
  Pack worst = {}, poison = {};
  for (int j = 0; j < r.edges; j += W)
  {
    const Pack active = load(r.active + j), here = load(r.inverse_mass + j), next = load(r.inverse_mass + j + 1);
    Pack own = {}, before = {}, after = {}, square = {};
    for (int k = 0; k < 3; ++k)
    {
      const Pack s = load(r.s[k] + j);
      square += s * s;
      own += s * load(r.direction[k] + j);
      before += s * load(r.direction[k] + j - 1);
      after += s * load(r.direction[k] + j + 1);
    }
    const Pack error = (square - 1.0) * active;
    const Pack size = absolute(error);
    worst = worst < size ? size : worst;
    poison += error * 0.0;   // a comparison forgets what is not a number
    store(r.c + j, 0.5 * error * load(r.rest_length + j));
    store(r.diagonal + j, (here + next) * own + (1.0 - active));
    store(r.upper + j, -next * after);
    store(r.lower + j, -here * before);
  }
  double largest = 0.0;
  for (int k = 0; k < W; ++k)
    largest = (worst[k] > largest ? worst[k] : largest) + poison[k];
  return largest;
}

/// Rows 0 .. middle-1 downwards and edges-1 .. middle+1 upwards at the same time: each is one long chain of divisions.
void factor(const ChainArrays& r)
{
  const int n = r.edges, middle = n / 2;
  double top = 0.0, bottom = 0.0;   // inverse pivots before and after
  double top_coupling = 0.0, bottom_coupling = 0.0;
  for (int i = 0, j = n - 1; i < middle || j > middle; ++i, --j)
  {
    if (i < middle)
    {
      const double f = i > 0 ? r.lower[i] * top : 0.0;
      r.factor[i] = f;
      top = 1.0 / (r.diagonal[i] - f * top_coupling);
      top_coupling = r.upper[i];
      r.pivot[i] = top;
    }
    if (j > middle)
    {
      const double f = j < n - 1 ? r.upper[j] * bottom : 0.0;
      r.factor[j] = f;
      bottom = 1.0 / (r.diagonal[j] - f * bottom_coupling);
      bottom_coupling = r.lower[j];
      r.pivot[j] = bottom;
    }
  }
  const double above = middle > 0 ? r.lower[middle] * top : 0.0,
               below = middle < n - 1 ? r.upper[middle] * bottom : 0.0;
  r.pivot[middle] = 1.0 / (r.diagonal[middle] - above * top_coupling - below * bottom_coupling);
}

void solve(const ChainArrays& r, double* b)
{
  const int n = r.edges, middle = n / 2;
  for (int i = 1, j = n - 2; i < middle || j > middle; ++i, --j)
  {
    if (i < middle)
      b[i] -= r.factor[i] * b[i - 1];
    if (j > middle)
      b[j] -= r.factor[j] * b[j + 1];
  }
  double rest = b[middle];
  if (middle > 0)
    rest -= r.lower[middle] * r.pivot[middle - 1] * b[middle - 1];
  if (middle < n - 1)
    rest -= r.upper[middle] * r.pivot[middle + 1] * b[middle + 1];
  b[middle] = rest * r.pivot[middle];
  for (int i = middle - 1, j = middle + 1; i >= 0 || j < n; --i, ++j)
  {
    if (i >= 0)
      b[i] = b[i] * r.pivot[i] - (r.upper[i] * r.pivot[i]) * b[i + 1];
    if (j < n)
      b[j] = b[j] * r.pivot[j] - (r.lower[j] * r.pivot[j]) * b[j - 1];
  }
}

void apply(const ChainArrays& r)
{
  closeEdges(r, r.lambda);
  for (int i = 0; i < r.edges; i += W)
    store(r.total + i, load(r.total + i) + load(r.lambda + i));
  for (int i = 0; i < r.nodes; i += W)
  {
    const Pack w = load(r.inverse_mass + i), after = load(r.lambda + i), before = load(r.lambda + i - 1);
    for (int k = 0; k < 3; ++k)
      store(r.x[k] + i,
            load(r.x[k] + i) + w * (after * load(r.direction[k] + i) - before * load(r.direction[k] + i - 1)));
  }
}

}   // namespace

extern const ChainKernels kChainKernels;
const ChainKernels kChainKernels = {takeDirections, constraints, factor, solve, apply};

}   // namespace SLENDER_ISA
}   // namespace slender
