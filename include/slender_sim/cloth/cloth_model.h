#pragma once

#include <memory>
#include <string>

#include <Eigen/Core>
#include <Eigen/SparseCore>

#include "slender_sim/cloth/cloth_state.h"
#include "slender_sim/energy/membrane.h"
#include "slender_sim/geometry/mesh_topology.h"

namespace slender {

enum class BendingModel
{
  none,
  hinge,                     ///< nonlinear, Discrete Shells; bends about the rest angles
  isometric_nonconforming,   ///< quadratic (thesis 2.4), for flat rest shapes
  isometric_conforming
};

const char* toString(BendingModel model);

/// Fixed properties of one cloth (thesis 2).
struct ClothModel
{
  std::string name;
  TriangleMesh rest;                 ///< the undeformed shape
  MeshTopology topology;
  Eigen::VectorXd mass;              ///< per vertex [kg]
  MembraneModuli membrane;           ///< [N/m]
  Eigen::Vector3d warp = Eigen::Vector3d::UnitX();   ///< direction in the rest shape
  BendingModel bending = BendingModel::isometric_nonconforming;
  double bending_modulus = 0.0;      ///< D [N m], as in plate theory (see bendingCalibration)
  double mass_damping = 0.0;         ///< Rayleigh [1/s]
  double stiffness_damping = 0.0;    ///< Rayleigh [s]
  double wind_coefficient = 0.0;     ///< [N s/m^3]: pressure per normal velocity of the air against the cloth

  /// Weighted averages of vertices that are prescribed (averages x vertices, rows sum to 1; see WeakConstraints); null: none. Implicit steps only.
  std::shared_ptr<const Eigen::SparseMatrix<double, Eigen::RowMajor>> averages;

  int averageCount() const { return averages ? static_cast<int>(averages->rows()) : 0; }
  int vertices() const { return static_cast<int>(rest.vertices.cols()); }
  double totalMass() const { return mass.sum(); }
};

/// Model of a cloth of the given mass per area [kg/m^2] with a mesh as its rest shape, without bending, damping and wind; these are set
/// afterwards. Throws std::invalid_argument naming the bad value, or the mesh's defects.
ClothModel buildCloth(const std::string& name, const TriangleMesh& rest, double area_density, const MembraneModuli& membrane,
                      const Eigen::Vector3d& warp = Eigen::Vector3d::UnitX());

/// A state at rest at the given vertices (3 x n [m]). Rest angles (hinge bending only) are those of the rest shape.
ClothState makeClothState(const ClothModel& model, const Eigen::Matrix3Xd& vertices);

/// Pins vertices where they are, in addition to those that already are. Throws std::invalid_argument for one that is not there.
void pinVertices(ClothState& state, const std::vector<int>& vertices);

}  // namespace slender
