#pragma once

#include <vector>

#include <Eigen/Core>

#include "slender_sim/energy/hinge.h"
#include "slender_sim/energy/membrane_kernel.h"
#include "slender_sim/geometry/triangle_mesh.h"
#include "slender_sim/linalg/block_matrix.h"

namespace slender {

/// Stiffness of a membrane per width in material axes, warp first: S11 = c11 G11 + c12 G22, S22 = c12 G11 + c22 G22,
/// S12 = 2 c33 G12 [N/m].
struct MembraneModuli
{
  double c11 = 0, c12 = 0, c22 = 0, c33 = 0;
};

/// Plane stress of a sheet of the given thickness [m]; modulus E [Pa]. Throws std::invalid_argument naming the bad
/// value: modulus or thickness not positive, Poisson's ratio outside (-1, 0.5].
MembraneModuli isotropicMembrane(double youngs_modulus, double poissons_ratio, double thickness);

/// Along warp and weft the moduli [N/m] (per width), Poisson's ratio of the weft's contraction under tension along the
/// warp, and the shear modulus [N/m]. Throws std::invalid_argument naming the bad value; the energy must be positive:
/// ratio^2 < warp / weft.
MembraneModuli orthotropicMembrane(double warp, double weft, double poissons_ratio, double shear);

/// Constant-strain triangles with St. Venant-Kirchhoff's energy, area/2 (c11 G11^2 + 2 c12 G11 G22 + c22 G22^2 + 4 c33
/// G12^2) each, G Green's strain in material axes.
class MembraneEnergy
{
public:
  /// `warp` is a direction in space, projected onto each face of the rest mesh; on faces that it is normal to, any
  /// direction is taken. Throws std::invalid_argument naming a face without area.
  MembraneEnergy(const TriangleMesh& rest, const MembraneModuli& moduli,
                 const Eigen::Vector3d& warp = Eigen::Vector3d::UnitX());

  int count() const { return static_cast<int>(triangles_.cols()); }
  int paddedCount() const { return static_cast<int>(area_.size()); }
  const Eigen::Matrix3Xi& triangles() const { return triangles_; }
  const MembraneModuli& moduli() const { return moduli_; }
  double area(int triangle) const { return area_[triangle]; }

  /// Elastic response; with ratio > 0 a viscous one as well, of stress ratio C (G - viscous_strains): the one of moduli
  /// (1 + ratio) C about the weighted mean of both. From strains(); the elastic response needs none.
  void setResponse(double ratio, const double* const* viscous_strains);

  /// G11, G22, 2 G12: three arrays with room for paddedCount() each.
  void strains(const double* x, double* const* strains) const { membraneKernels().strains(arrays(), x, strains); }
  MembraneSums energy(const double* x) const;
  MembraneSums addGradient(const double* x, double* gradient) const;
  /// `slots` from slotsIn(); `from`: see PointTerm.
  MembraneSums addHessian(HessianKind kind, const double* x, const std::vector<int>& slots, double* gradient,
                          double* values, const double* from = nullptr) const;
  std::vector<int> slotsIn(const BlockMatrix& matrix) const;

private:
  MembraneArrays arrays() const;

  Eigen::Matrix3Xi triangles_;
  MembraneModuli moduli_;
  double scale_ = 1.0;
  AlignedVector<int> points_[3];
  AlignedVector<double> inverse_[4], area_, rest_strain_[3];
};

}   // namespace slender
