#pragma once

#include <Eigen/Core>

#include "slender_sim/linalg/banded_ldlt.h"

namespace slender {

/// Band matrix of a rod, open or closed. In a closed rod the last panels wrap around to the first blocks.
///
/// Closed: the last two blocks are a separator. The rest is an open band A; with B its coupling to the separator and C
/// the separator's own block, Schur's complement S = C - B^T A^-1 B is 8 x 8. The eight columns of A^-1 B are solved
/// together, one SIMD lane each, so a loop costs about twice an open rod.
class CyclicBandedLdlt
{
public:
  /// Throws std::invalid_argument for a closed band with fewer than five blocks.
  void resize(int blocks, bool closed);
  int blocks() const { return band_.blocks(); }
  RodPanel* panels() { return band_.panels(); }
  bool closed() const { return closed_; }
  /// The band itself; of an open rod that is the whole matrix.
  BandedLdlt<10, 4>& band() { return band_; }

  /// Factors in place; see BandedLdlt.
  Inertia factor();
  /// x := A^-1 x, four doubles per block.
  void solve(double* x) const;

private:
  static constexpr int kBorder = 8;
  using Border = Eigen::Matrix<double, kBorder, kBorder>;

  bool closed_ = false;
  int inner_ = 0;   ///< blocks before the separator
  BandedLdlt<10, 4> band_;
  AlignedVector<double> coupling_;   ///< B, row-major, eight columns
  AlignedVector<double> reduced_;    ///< A^-1 B
  Border schur_;                     ///< its L D L^T
};

}   // namespace slender
