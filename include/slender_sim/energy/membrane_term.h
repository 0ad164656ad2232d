#pragma once

#include "slender_sim/energy/membrane.h"
#include "slender_sim/energy/membrane_kernel.h"
#include "slender_sim/energy/point_term.h"
#include "slender_sim/geometry/triangle_mesh.h"

namespace slender {

/// Constant-strain triangles with St. Venant-Kirchhoff's energy, area/2 (c11 G11^2 + 2 c12 G11 G22 + c22 G22^2 + 4 c33
/// G12^2) each, G Green's strain in material axes. Viscous stresses count from Green's strains.
class MembraneTerm final : public PointTerm
{
public:
  /// `warp` is a direction in space, projected onto each face of the rest mesh; on faces that it is normal to, any
  /// direction is taken. Throws std::invalid_argument naming a face without area, and for moduli whose energy can be
  /// negative.
  MembraneTerm(const TriangleMesh& rest, const MembraneModuli& moduli,
               const Eigen::Vector3d& warp = Eigen::Vector3d::UnitX());

  int paddedCount() const { return static_cast<int>(area_.size()); }
  double area(int triangle) const { return area_[triangle]; }
  /// G11, G22, 2 G12: three arrays with room for paddedCount() each.
  void strains(const double* x, double* const* strains) const { membraneKernels().strains(arrays(), x, strains); }

  TermAccount account() const override { return TermAccount::stretching; }
  Eigen::MatrixXi elements() const override { return triangles_; }
  void setPattern(const BlockMatrix& matrix) override;
  TermSums value(const double* x) override;
  TermSums addGradient(const double* x, double* gradient) override;
  TermSums addHessian(HessianKind kind, const double* x, double* gradient, double* values,
                      const double* from = nullptr) override;
  void takeStrains(const StrainReference& at) override;
  void setResponse(double ratio) override;

private:
  MembraneArrays arrays() const;
  void addStrains(const PointVector& x, double part);

  Eigen::Matrix3Xi triangles_;
  MembraneModuli moduli_;
  double scale_ = 1.0;   ///< 1 + the viscous ratio
  AlignedVector<int> points_[3];
  AlignedVector<double> inverse_[4], area_, rest_strain_[3];
  std::vector<int> slots_;
  AlignedVector<double> strains_[3], other_strains_[3];   ///< empty without viscous response
};

}   // namespace slender
