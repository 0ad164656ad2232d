#pragma once

#include "slender_sim/energy/membrane.h"
#include "slender_sim/energy/point_term.h"

namespace slender {

/// The term of MembraneEnergy. Viscous stresses count from Green's strains.
class MembraneTerm final : public PointTerm
{
public:
  /// As MembraneEnergy. Throws std::invalid_argument for moduli whose energy can be negative, too.
  MembraneTerm(const TriangleMesh& rest, const MembraneModuli& moduli, const Eigen::Vector3d& warp);

  TermAccount account() const override { return TermAccount::stretching; }
  Eigen::MatrixXi elements() const override { return energy_.triangles(); }
  void setPattern(const BlockMatrix& matrix) override { slots_ = energy_.slotsIn(matrix); }
  TermSums value(const double* x) override;
  TermSums addGradient(const double* x, double* gradient) override;
  TermSums addHessian(HessianKind kind, const double* x, double* gradient, double* values, const double* from) override;
  void takeStrains(const StrainReference& at) override;
  void setResponse(double ratio) override;

private:
  void addStrains(const PointVector& x, double part);

  MembraneEnergy energy_;
  std::vector<int> slots_;
  AlignedVector<double> strains_[3], other_strains_[3];   ///< empty without viscous response
};

}   // namespace slender
