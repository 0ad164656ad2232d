// Compiled once per instruction set (SLENDER_ISA). Plain arrays only; nothing here may be emitted under a shared name.
#include "slender_sim/linalg/point_kernel.h"

namespace slender {
namespace SLENDER_ISA {
namespace {

using Quad = double __attribute__((vector_size(32)));
using QuadU __attribute__((aligned(8), may_alias)) = Quad;
// Clang overlooks aligned() beside vector_size()
static_assert(alignof(QuadU) == 8, "loads and stores may be anywhere");

inline __attribute__((always_inline)) Quad load(const double* p) { return *reinterpret_cast<const Quad*>(p); }
inline __attribute__((always_inline)) Quad loadAnywhere(const double* p) { return *reinterpret_cast<const QuadU*>(p); }

template <bool Add>
double multiplyRows(int rows, const int* starts, const unsigned* offsets, const double* values, double factor,
                    const double* x, double* y)
{
  Quad form = {};
  int k = starts[0];
  for (int i = 0; i < rows; ++i)
  {
    const int end = starts[i + 1];
    Quad a = {}, b = {}, c = {}, d = {};   // four sums hide the latency of the additions
    for (; k + 4 <= end; k += 4)
    {
      a += values[k] * load(x + offsets[k]);
      b += values[k + 1] * load(x + offsets[k + 1]);
      c += values[k + 2] * load(x + offsets[k + 2]);
      d += values[k + 3] * load(x + offsets[k + 3]);
    }
    for (; k < end; ++k)
      a += values[k] * load(x + offsets[k]);
    a = (a + b) + (c + d);
    form += a * load(x + 4 * i);
    Quad& out = *reinterpret_cast<Quad*>(y + 4 * i);
    out = Add ? out + factor * a : a;
  }
  return form[0] + form[1] + form[2];
}

double multiply(int rows, const int* starts, const unsigned* offsets, const double* values, double factor,
                const double* x, double* y)
{
  return factor == 0.0 ? multiplyRows<false>(rows, starts, offsets, values, factor, x, y)
                       : multiplyRows<true>(rows, starts, offsets, values, factor, x, y);
}

void multiplyBlocks(int columns, const int* starts, const int* rows, const double* values, const double* x, double* y)
{
  for (int j = 0; j < columns; ++j)
  {
    const Quad xj = load(x + 4 * j);
    Quad s0 = {}, s1 = {}, s2 = {};
    const int end = starts[j + 1];
    for (int k = starts[j] + 1; k < end; ++k)
    {
      const double* a = values + 9 * static_cast<long>(k);
      // fourth lanes are other entries
      const Quad c0 = loadAnywhere(a), c1 = loadAnywhere(a + 3), c2 = loadAnywhere(a + 6);
      const int i = rows[k];
      const Quad xi = load(x + 4 * i);
      Quad& yi = *reinterpret_cast<Quad*>(y + 4 * i);
      yi += c0 * xj[0] + c1 * xj[1] + c2 * xj[2];
      s0 += c0 * xi;
      s1 += c1 * xi;
      s2 += c2 * xi;
    }
    const double* a = values + 9 * static_cast<long>(starts[j]);
    Quad yj = load(y + 4 * j) + loadAnywhere(a) * xj[0] + loadAnywhere(a + 3) * xj[1] + loadAnywhere(a + 6) * xj[2];
    yj += Quad{s0[0] + s0[1] + s0[2], s1[0] + s1[1] + s1[2], s2[0] + s2[1] + s2[2], 0.0};
    yj[3] = 0.0;
    *reinterpret_cast<Quad*>(y + 4 * j) = yj;
  }
}

// ---- conjugate gradients with symmetric sweeps, in single or double precision

template <class Scalar>
struct FourOf;
template <>
struct FourOf<double>
{
  using Aligned = Quad;
  using Anywhere = QuadU;
};
template <>
struct FourOf<float>
{
  using Aligned = float __attribute__((vector_size(16)));
  using Anywhere __attribute__((aligned(4), may_alias)) = Aligned;
};
template <class Scalar>
using Four = typename FourOf<Scalar>::Aligned;

template <class Scalar>
inline __attribute__((always_inline)) Four<Scalar> loadFour(const Scalar* p)
{
  return *reinterpret_cast<const typename FourOf<Scalar>::Anywhere*>(p);
}

template <class Scalar>
inline __attribute__((always_inline)) Four<Scalar>& four(Scalar* p)
{
  return *reinterpret_cast<Four<Scalar>*>(p);
}
template <class Scalar>
inline __attribute__((always_inline)) const Four<Scalar>& four(const Scalar* p)
{
  return *reinterpret_cast<const Four<Scalar>*>(p);
}

/// Three columns, `stride` apart; the fourth lane of the product is not to be looked at where that is 3.
template <class Scalar>
inline __attribute__((always_inline)) Four<Scalar> times(const Scalar* columns, int stride, Four<Scalar> x)
{
  return loadFour(columns) * x[0] + loadFour(columns + stride) * x[1] + loadFour(columns + 2 * stride) * x[2];
}

/// Products of the three columns with vectors, summed over several blocks.
template <class Scalar>
struct TransposedProduct
{
  Four<Scalar> columns[3] = {};
  inline __attribute__((always_inline)) void add(const Scalar* block, Four<Scalar> x)
  {
    for (int c = 0; c < 3; ++c)
      columns[c] += loadFour(block + 3 * c) * x;
  }
  inline __attribute__((always_inline)) Four<Scalar> sum() const
  {
    Four<Scalar> all = {};
    for (int c = 0; c < 3; ++c)
      all[c] = columns[c][0] + columns[c][1] + columns[c][2];
    return all;
  }
};

/// Sums of products over points; single products are summed in double precision.
template <class Scalar>
inline __attribute__((always_inline)) void addProducts(Four<Scalar> x, Four<Scalar> y, Quad& sums)
{
  sums += __builtin_convertvector(x * y, Quad);
}

template <class Scalar>
void sweepUp(const SweptMatrix<Scalar>& m, const GroupBlocks<Scalar>& b, const Scalar* p, Scalar* t, Scalar* q)
{
  int k = m.starts[m.points];
  for (int j = m.points; j-- > 0;)
  {
    TransposedProduct<Scalar> below;
    for (const int end = m.starts[j]; k > end;)
    {
      --k;
      below.add(m.blocks + 9 * static_cast<long>(k), four(t + 4 * m.rows[k]));
    }
    const Four<Scalar> sum = below.sum();
    four(q + 4 * j) = sum;
    const Four<Scalar> solved = times(m.inverse + 12 * static_cast<long>(j), 4, four(p + 4 * j) - sum);
    four(t + 4 * j) = solved;
    for (int g = b.starts ? b.starts[j] : 0, end = b.starts ? b.starts[j + 1] : 0; g < end; ++g)
      four(b.motion + 4 * b.groups[g]) += times(b.transposed + 9 * static_cast<long>(g), 3, solved);
  }
}

template <class Scalar>
double sweepDown(const SweptMatrix<Scalar>& m, const GroupBlocks<Scalar>& b, const Scalar* p, const Scalar* t,
                 Scalar* q)
{
  Quad form = {};
  int k = 0;
  for (int j = 0; j < m.points; ++j)
  {
    Four<Scalar>& own = four(q + 4 * j);
    for (int g = b.starts ? b.starts[j] : 0, end = b.starts ? b.starts[j + 1] : 0; g < end; ++g)
      own -= times(b.blocks + 9 * static_cast<long>(g), 3, four(b.motion + 4 * b.groups[g]));
    const Four<Scalar> solved = times(m.inverse + 12 * static_cast<long>(j), 4, own);
    for (const int end = m.starts[j + 1]; k < end; ++k)
      four(q + 4 * m.rows[k]) -= times(m.blocks + 9 * static_cast<long>(k), 3, solved);
    own = solved + four(t + 4 * j);
    addProducts<Scalar>(own, four(p + 4 * j), form);
  }
  return form[0] + form[1] + form[2];
}

template <class Scalar>
double advance(const SweptMatrix<Scalar>& m, double alpha, const Scalar* t, const Scalar* q, Scalar* x, Scalar* r,
               Scalar* z)
{
  const Scalar length = static_cast<Scalar>(alpha);
  Quad form = {};
  for (long j = 0; j < m.points; ++j)
  {
    four(x + 4 * j) += length * four(t + 4 * j);
    const Four<Scalar> left = four(r + 4 * j) -= length * four(q + 4 * j);
    const Four<Scalar> product = four(z + 4 * j) = times(m.diagonal + 12 * j, 4, left);
    addProducts<Scalar>(left, product, form);
  }
  return form[0] + form[1] + form[2];
}

template <class Scalar>
void turn(int points, double beta, const Scalar* z, Scalar* p)
{
  const Scalar kept = static_cast<Scalar>(beta);
  for (long j = 0; j < points; ++j)
    four(p + 4 * j) = four(z + 4 * j) + kept * four(p + 4 * j);
}

template <class Scalar>
void precondition(const SweptMatrix<Scalar>& m, Scalar* z)
{
  int k = 0;
  for (int j = 0; j < m.points; ++j)
  {
    const Four<Scalar> solved = four(z + 4 * j) = times(m.inverse + 12 * static_cast<long>(j), 4, four(z + 4 * j));
    for (const int end = m.starts[j + 1]; k < end; ++k)
      four(z + 4 * m.rows[k]) -= times(m.blocks + 9 * static_cast<long>(k), 3, solved);
  }
  for (int j = m.points; j-- > 0;)
  {
    TransposedProduct<Scalar> below;
    for (const int end = m.starts[j]; k > end;)
    {
      --k;
      below.add(m.blocks + 9 * static_cast<long>(k), four(z + 4 * m.rows[k]));
    }
    four(z + 4 * j) -= times(m.inverse + 12 * static_cast<long>(j), 4, below.sum());
  }
}

template <class Scalar>
double multiplySwept(const SweptMatrix<Scalar>& m, const Scalar* x, Scalar* y)
{
  Quad form = {};
  int k = 0;
  for (int j = 0; j < m.points; ++j)
  {
    const Four<Scalar> own = four(x + 4 * j);
    TransposedProduct<Scalar> below;
    for (const int end = m.starts[j + 1]; k < end; ++k)
    {
      const Scalar* block = m.blocks + 9 * static_cast<long>(k);
      four(y + 4 * m.rows[k]) += times(block, 3, own);
      below.add(block, four(x + 4 * m.rows[k]));
    }
    const Four<Scalar> product = four(y + 4 * j) += times(m.diagonal + 12 * static_cast<long>(j), 4, own) + below.sum();
    addProducts<Scalar>(own, product, form);
  }
  return form[0] + form[1] + form[2];
}

template <class Scalar>
void addRows(const PointRows<Scalar>& c, double factor, const Scalar* x, Scalar* y)
{
  const Scalar share = static_cast<Scalar>(factor);
  int k = 0;
  for (int i = 0; i < c.rows; ++i)
  {
    Four<Scalar> sum = {};
    for (const int end = c.starts[i + 1]; k < end; ++k)
      sum += c.values[k] * four(x + 4 * c.columns[k]);
    four(y + 4 * i) += share * sum;
  }
}

template <class Scalar>
void move(int points, double alpha, const Scalar* p, const Scalar* q, Scalar* x, Scalar* r, Scalar* z)
{
  const Scalar length = static_cast<Scalar>(alpha);
  for (long j = 0; j < points; ++j)
  {
    four(x + 4 * j) += length * four(p + 4 * j);
    four(z + 4 * j) = four(r + 4 * j) -= length * four(q + 4 * j);
  }
}

template <class Scalar>
double dotSwept(int points, const Scalar* x, const Scalar* y)
{
  Quad form = {};
  for (long j = 0; j < points; ++j)
    addProducts<Scalar>(four(x + 4 * j), four(y + 4 * j), form);
  return form[0] + form[1] + form[2];
}

template <class Scalar>
constexpr SweepKernels<Scalar> kSweeps = {sweepUp<Scalar>, sweepDown<Scalar>,    advance<Scalar>,
                                          turn<Scalar>,    precondition<Scalar>, multiplySwept<Scalar>,
                                          addRows<Scalar>, move<Scalar>,         dotSwept<Scalar>};

/// Columns from .. from+Columns-1 of a supernode of `count` rows, whose first row is that of column 0: solve with the
/// triangle, then take their part from the rows below.
template <int Columns>
inline __attribute__((always_inline)) void forward(const double* l, int count, const int* rows, int from, double* x)
{
  Quad c[Columns];
  for (int a = 0; a < Columns; ++a)
  {
    Quad value = load(x + 4 * rows[from + a]);
    for (int b = 0; b < a; ++b)
      value -= l[static_cast<long>(from + b) * count + from + a] * c[b];
    c[a] = value / l[static_cast<long>(from + a) * count + from + a];
    *reinterpret_cast<Quad*>(x + 4 * rows[from + a]) = c[a];
  }
  const double* column[Columns];
  for (int a = 0; a < Columns; ++a)
    column[a] = l + static_cast<long>(from + a) * count;
  for (int i = from + Columns; i < count; ++i)
  {
    Quad& out = *reinterpret_cast<Quad*>(x + 4 * rows[i]);
    Quad value = out;
    for (int a = 0; a < Columns; ++a)
      value -= column[a][i] * c[a];
    out = value;
  }
}

/// The same backwards with the transpose.
template <int Columns>
inline __attribute__((always_inline)) void backward(const double* l, int count, const int* rows, int from, double* x)
{
  Quad sum[Columns] = {};
  const double* column[Columns];
  for (int a = 0; a < Columns; ++a)
    column[a] = l + static_cast<long>(from + a) * count;
  for (int i = from + Columns; i < count; ++i)
  {
    const Quad value = load(x + 4 * rows[i]);
    for (int a = 0; a < Columns; ++a)
      sum[a] += column[a][i] * value;
  }
  for (int a = Columns - 1; a >= 0; --a)
  {
    Quad& out = *reinterpret_cast<Quad*>(x + 4 * rows[from + a]);
    Quad value = out - sum[a];
    for (int b = a + 1; b < Columns; ++b)
      value -= column[a][from + b] * load(x + 4 * rows[from + b]);
    out = value / column[a][from + a];
  }
}

void forwardSupernodal(const SupernodalFactor& f, double* x)
{
  for (int s = 0; s < f.supernodes; ++s)
  {
    const int columns = f.first[s + 1] - f.first[s], count = f.row_starts[s + 1] - f.row_starts[s];
    const int* rows = f.rows + f.row_starts[s];
    const double* l = f.values + f.value_starts[s];
    int c = 0;
    for (; c + 8 <= columns; c += 8)
      forward<8>(l, count, rows, c, x);
    for (; c + 4 <= columns; c += 4)
      forward<4>(l, count, rows, c, x);
    for (; c < columns; ++c)
      forward<1>(l, count, rows, c, x);
  }
}

void backwardSupernodal(const SupernodalFactor& f, double* x)
{
  for (int s = f.supernodes - 1; s >= 0; --s)
  {
    const int columns = f.first[s + 1] - f.first[s], count = f.row_starts[s + 1] - f.row_starts[s];
    const int* rows = f.rows + f.row_starts[s];
    const double* l = f.values + f.value_starts[s];
    int c = columns;
    while (c % 4 != 0)
      backward<1>(l, count, rows, --c, x);
    if (c % 8 != 0)
      backward<4>(l, count, rows, c -= 4, x);
    while (c > 0)
      backward<8>(l, count, rows, c -= 8, x);
  }
}

double dot(int points, const double* x, const double* y)
{
  Quad a = {}, b = {};
  int i = 0;
  for (; i + 2 <= points; i += 2)
  {
    a += load(x + 4 * i) * load(y + 4 * i);
    b += load(x + 4 * i + 4) * load(y + 4 * i + 4);
  }
  if (i < points)
    a += load(x + 4 * i) * load(y + 4 * i);
  a += b;
  return a[0] + a[1] + a[2];
}

}   // namespace

extern const PointKernels kPointKernels;
const PointKernels kPointKernels = {multiply, multiplyBlocks, forwardSupernodal, backwardSupernodal,
                                    dot,      kSweeps<float>, kSweeps<double>};

}   // namespace SLENDER_ISA
}   // namespace slender
