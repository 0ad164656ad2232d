#pragma once

/// Structure-of-arrays view of the constant-strain triangles of a membrane for the hot loops. With F = [x1 - x0, x2 -
/// x0] B (3 x 2), Green's strain G = (F^T F - 1) / 2 less a rest strain, E = sum area/2 (c11 G11^2 + 2 c12 G11 G22 +
/// c22 G22^2 + 4 c33 G12^2). Points have 4 doubles. Arrays are padded to whole packs of 8 with copies of the last
/// triangle of no area.
namespace slender {

struct MembraneArrays
{
  int count = 0;   ///< triangles with the padding
  const int* points[3] = {};
  const double* inverse[4] = {};               ///< B11, B12, B21, B22 [1/m]: rest edges in material axes, inverted
  const double* area = nullptr;                ///< [m^2]
  const double* rest_strain[3] = {};           ///< G11, G22, 2 G12, or null
  double c11 = 0, c12 = 0, c22 = 0, c33 = 0;   ///< [N/m]
};

struct MembraneSums
{
  double energy = 0;       ///< [J]
  double max_strain = 0;   ///< largest principal stretch less 1
  double min_strain = 0;   ///< smallest principal stretch less 1
};

struct MembraneKernels
{
  /// Green's strains G11, G22, 2 G12 of each triangle.
  void (*strains)(const MembraneArrays& membrane, const double* x, double* const* strains);
  void (*energy)(const MembraneArrays& membrane, const double* x, MembraneSums& sums);
  /// Adds dE/dx.
  void (*gradient)(const MembraneArrays& membrane, const double* x, double* gradient, MembraneSums& sums);
  /// Adds dE/dx and the second derivatives to the blocks of a matrix (6 slots per triangle, see BlockMatrix::slots).
  /// `from`: null, or points from which the stresses in the second derivatives are extrapolated, see PointTerm.
  void (*hessian)(const MembraneArrays& membrane, const double* x, const double* from, const int* slots,
                  double* gradient, double* values, MembraneSums& sums);
  /// The same with a positive semidefinite matrix not below the exact one: compressive principal stresses are left out
  /// of it.
  void (*semidefiniteHessian)(const MembraneArrays& membrane, const double* x, const double* from, const int* slots,
                              double* gradient, double* values, MembraneSums& sums);
};

namespace baseline {
extern const MembraneKernels kMembraneKernels;
}
namespace avx2 {
extern const MembraneKernels kMembraneKernels;
}
namespace avx512 {
extern const MembraneKernels kMembraneKernels;
}

/// The table for this machine.
const MembraneKernels& membraneKernels();

}   // namespace slender
