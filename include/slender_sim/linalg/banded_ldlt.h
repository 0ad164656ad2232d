#pragma once

#include <cstddef>
#include <memory>
#include <new>
#include <vector>

namespace slender {

/// std::vector allocator with cache-line alignment, for arrays that kernels read with wide loads.
template <class T>
struct AlignedAllocator
{
  using value_type = T;
  static constexpr std::align_val_t kAlignment{64};
  AlignedAllocator() = default;
  template <class U>
  AlignedAllocator(const AlignedAllocator<U>&)
  {
  }
  T* allocate(std::size_t n) { return static_cast<T*>(::operator new(n * sizeof(T), kAlignment)); }
  void deallocate(T* p, std::size_t) { ::operator delete(p, kAlignment); }
  template <class U>
  bool operator==(const AlignedAllocator<U>&) const
  {
    return true;
  }
  template <class U>
  bool operator!=(const AlignedAllocator<U>&) const
  {
    return false;
  }
};
template <class T>
using AlignedVector = std::vector<T, AlignedAllocator<T>>;

/// Signs of the pivots of an LDL^T factorisation: by Sylvester's law those of the eigenvalues.
struct Inertia
{
  int positive = 0, negative = 0, zero = 0;
  bool positiveDefinite() const { return negative == 0 && zero == 0; }
};

/// One block column of a banded symmetric matrix: the columns of Block unknowns, lower triangle.
/// Rows below the diagonal block are padded to a multiple of eight; the padding must be zero.
template <int HalfBandwidth, int Block>
struct BandPanel
{
  static constexpr int kBelow = HalfBandwidth + 1 - Block;   ///< rows below the diagonal block
  static constexpr int kStride = (kBelow + 7) / 8 * 8;
  double below[Block][kStride];   ///< below[c][r]: row (Block + r), column c, counted from the block's first unknown
  double diag[Block][Block];      ///< diag[c][r], r >= c
};

/// Where an elimination stands: what the blocks so far subtract from the next ones. Zero at the start.
struct BandCarry
{
  alignas(64) double window[4][8] = {};
  alignas(64) double ahead[8] = {};
  alignas(64) double corner[4][4] = {};
  int negative = 0, zero = 0;
};

/// Symmetric band matrix with LDL^T factorisation in place, no pivoting [Golub & Van Loan, Matrix
/// Computations, 4.1, 4.3].
///
/// Column j of block b = j / Block reaches down to row b*Block + HalfBandwidth, so no entry is further than
/// HalfBandwidth from the diagonal. For rods (positions and edge angle of a node form a block of four) HalfBandwidth
/// is 10. Without pivoting the factorisation is backward stable for definite matrices; an indefinite one is reported by
/// its inertia so that the caller can shift it.
template <int HalfBandwidth, int Block>
class BandedLdlt
{
public:
  using Panel = BandPanel<HalfBandwidth, Block>;

  /// Dimension becomes blocks * Block; entries are undefined.
  void resize(int blocks);
  int blocks() const { return blocks_; }

  Panel* panels() { return panels_.data(); }
  const Panel* panels() const { return panels_.data(); }

  /// Factors the first `count` blocks (all when negative) in place; their coupling to later blocks must be zero.
  /// A pivot that is zero or not finite counts as `zero` and stops the factorisation.
  Inertia factor(int count = -1);

  /// The same by pieces, for callers that assemble block after block: factors blocks from..to-1, and when x is given
  /// takes its rows to L^-1 x on the way. All entries of these blocks must be there; later ones need not. `assembled`
  /// is the panel of block `from`, in panels() or in memory of the caller's that is smaller and stays in the cache.
  void eliminate(Panel* assembled, int from, int to, double* x, BandCarry& carry);
  /// x := L^-T D^-1 x, which completes a solution begun by eliminate().
  void substitute(double* x) const;

  /// x := A^-1 x after factor(); x has Block doubles per factored block.
  void solve(double* x, int count = -1) const;

  /// The same for eight right-hand sides, row-major: eight doubles per row.
  void solve8(double* x, int count = -1) const;

private:
  int blocks_ = 0;
  AlignedVector<Panel> panels_;
};

using RodPanel = BandPanel<10, 4>;
extern template class BandedLdlt<10, 4>;

}   // namespace slender
