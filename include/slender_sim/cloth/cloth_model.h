#pragma once

#include <limits>
#include <memory>
#include <optional>
#include <string>
#include <vector>

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
  isometric_nonconforming,   ///< quadratic (thesis 2.4), for flat rest shapes only (see restAngleLimit())
  isometric_conforming       ///< likewise
};

const char* toString(BendingModel model);

/// Drag and lift of a thin plate, quadratic in the velocity u of the air relative to it [Keckeisen et al. 2004,
/// Modelling Effects of Wind Fields in Cloth Animations]: with the unit normal n and c = |n . u| / |u|, an area A feels
/// 1/2 rho A |u|^2 C_D c along u and 1/2 rho A |u|^2 C_L c sqrt(1 - c^2) across it, in the plane of u and n. Flow along
/// the plate does nothing.
struct Aerodynamics
{
  double air_density = 1.2;   ///< rho [kg/m^3] > 0
  double drag = 0.0;          ///< C_D [-] >= 0; a plate across the flow: about 1.2
  double lift = 0.0;          ///< C_L [-] >= 0; largest at 45 degrees, where the lift is that of C_L / 2
};

/// Curvature plasticity with hardening (thesis 6.4.4), for hinge bending; see PlasticFlow.
struct Plasticity
{
  /// largest elastic curvature deviation [1/m] >= 0; infinity: elastic
  double yield_curvature = std::numeric_limits<double>::infinity();
  double hardening = 0.0;    ///< eta [m]: creases get exp(eta * plastic curvature) times as stiff; negative: softer
  double creep_time = 0.0;   ///< [s] in which all but 1/e of what is beyond the yield flows; 0: at once
};

/// Weighted averages of a cloth's vertices that are prescribed (see WeakConstraints). Implicit steps only.
struct PrescribedAverages
{
  std::shared_ptr<const Eigen::SparseMatrix<double, Eigen::RowMajor>> weights;   ///< averages x vertices, rows sum to 1

  /// Largest force [N] with which each may act, > 0 or infinite; empty: as large as it takes. An average whose force is
  /// there is not met, but pulled towards where it should be. For one_newton_step only, and for all sets of a cloth or
  /// for none.
  Eigen::VectorXd bounds;

  int count() const { return static_cast<int>(weights->rows()); }
};

/// What a cloth is like, apart from its shape and mass.
struct ClothProperties
{
  MembraneModuli membrane;                           ///< [N/m]
  Eigen::Vector3d warp = Eigen::Vector3d::UnitX();   ///< direction in the rest shape; of a grid the first side
  BendingModel bending = BendingModel::isometric_nonconforming;
  double bending_modulus = 0.0;   ///< D [N m], as in plate theory (see bendingCalibration)
  /// Of bending, in (-1, 1): the plate energy D/2 [(k1 + k2)^2 - 2 (1 - nu) k1 k2] with the principal curvatures k1 and
  /// k2 (see plateBending()). Empty: the bending model has the ratio of its discretisation, about -1/3 (nonconforming,
  /// hinges) or 1 (conforming).
  std::optional<double> bending_poissons_ratio;
  Eigen::Matrix3Xd undeformed;   ///< 3 x n: its bend angles are those at rest; empty: those of the rest shape
  Plasticity plasticity;
  double mass_damping = 0.0;        ///< Rayleigh [1/s]
  double stiffness_damping = 0.0;   ///< Rayleigh [s]
  double wind_coefficient = 0.0;    ///< [N s/m^3]: pressure per normal velocity of the air against the cloth
  Aerodynamics aerodynamics;        ///< in addition
};

/// Fixed properties of one cloth (thesis 2).
struct ClothModel : ClothProperties
{
  std::string name;
  TriangleMesh rest;   ///< the undeformed shape
  MeshTopology topology;
  Eigen::VectorXd mass;   ///< per vertex [kg]
  /// One per face, not 0 for faces that do not bend while all their vertices are pins of the state; empty: none. Their
  /// edges to other faces are then clamped edges (see hingeArea()). Once a pin of theirs is released they bend like the
  /// rest. See clampFaces(). Not for conforming bending.
  std::vector<char> clamped_faces;

  /// sets of them, of which that of the state (ClothState::average_set) acts; empty: none
  std::vector<PrescribedAverages> averages;

  /// Null without any, and where the state names none.
  const PrescribedAverages* averagesOf(const ClothState& state) const
  {
    const bool there = state.average_set >= 0 && state.average_set < static_cast<int>(averages.size());
    return there ? &averages[static_cast<std::size_t>(state.average_set)] : nullptr;
  }
  int vertices() const { return static_cast<int>(rest.vertices.cols()); }
  double totalMass() const { return mass.sum(); }
};

/// Model of a cloth of the given mass per area [kg/m^2] with a mesh as its rest shape, without bending, plasticity,
/// damping and wind; these are set afterwards. Throws std::invalid_argument naming the bad value, or the mesh's
/// defects.
ClothModel buildCloth(const std::string& name, const TriangleMesh& rest, double area_density,
                      const MembraneModuli& membrane, const Eigen::Vector3d& warp = Eigen::Vector3d::UnitX());

/// A state at rest at the given vertices (3 x n [m]). Rest angles (hinge bending only) are those of the undeformed
/// shape. Throws std::invalid_argument for vertices or an undeformed shape that do not fit.
ClothState makeClothState(const ClothModel& model, const Eigen::Matrix3Xd& vertices);

/// Largest angle [rad] between two adjacent faces of the undeformed shape, or of the rest shape where that is empty.
double largestRestAngle(const ClothModel& model);

/// Whether isometric bending keeps the rest shape: its constant matrix acts on positions and flattens all that is
/// curved. A shape counts as flat if no vertex is farther from a plane than two millionths of the shape's size, and if
/// the shape is not folded onto itself. Files with six digits have this precision.
bool restsFlat(const ClothModel& model);

/// Throws std::invalid_argument with the fix where the bending model does not suit the cloth: isometric bending of a
/// curved rest shape, a Poisson's ratio of bending that the model does not have or that is out of range, an undeformed
/// shape of the wrong size.
void checkBending(const ClothModel& model);

/// Clamps all faces whose three vertices are among `held`. Throws std::invalid_argument where there is none, so that
/// nothing holds a slope.
void clampFaces(ClothModel& model, const std::vector<int>& held);

/// Pins vertices where they are, in addition to those that already are. Throws std::invalid_argument for one that is
/// not there.
void pinVertices(ClothState& state, const std::vector<int>& vertices);

}   // namespace slender
