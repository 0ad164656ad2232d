#pragma once

#include <vector>

#include "slender_sim/cloth/cloth_model.h"
#include "slender_sim/energy/point_term.h"

namespace slender {

/// Force of the air on a cloth. Each corner carries a third of its faces and feels the air by its own velocity.
class WindLoad final : public PointLoad
{
public:
  /// Whether the air acts on this cloth. Throws std::invalid_argument for coefficients that are not valid.
  static bool actsOn(const ClothModel& model);

  /// Throws as actsOn() does.
  explicit WindLoad(const ClothModel& model);

  void setPattern(const BlockMatrix& matrix) override;
  /// The faces at `shape` count. What depends linearly on the velocities at the end becomes the potential. Of drag and
  /// lift that is a positive semidefinite part of the derivative: all of it for the drag of a flow along the normal.
  /// The rest is taken at v.
  void begin(const PointVector& shape, const PointVector& origin, const Eigen::Matrix3Xd& v,
             const Eigen::Vector3d& wind, double h, PointVector& force) override;
  double value(const double* x) const override;
  double addGradient(const double* x, double* gradient) const override;
  void addHessian(double* values) const override;
  const Eigen::Matrix3d& stiffness(int vertex) const override { return drag_[vertex]; }
  double work(const PointVector& from, const PointVector& to, const std::vector<char>& held) const override;
  void addForces(const PointVector& x, const PointVector& v, const Eigen::Vector3d& wind,
                 PointVector& force) const override;

private:
  /// Potential of a vertex at x.
  double potential(std::size_t vertex, const double* x) const;

  const ClothModel& model_;
  double drag_factor_, lift_factor_;    ///< 1/2 rho C [kg/m^3]
  std::vector<Eigen::Matrix3d> drag_;   ///< D of each vertex
  PointVector target_;                  ///< y
  std::vector<int> diagonal_;           ///< block of each vertex
};

}   // namespace slender
