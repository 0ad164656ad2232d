#pragma once

#include <vector>

#include <Eigen/Core>

#include "slender_sim/linalg/block_matrix.h"

/// Energies and loads of parts that consist of points. Calls are virtual, one per term and evaluation; loops over
/// elements lie inside. Points have 4 doubles (see PointVector). Terms may use work space: one thread at a time.
namespace slender {

enum class HessianKind
{
  exact,
  semidefinite   ///< positive semidefinite and not below the exact one, so that a Newton step descends
};

/// The group of a term. Reports sum the energies of a group, and preconditioners its constant matrices.
enum class TermAccount
{
  stretching,
  bending
};

/// Sums of one evaluation of a term.
struct TermSums
{
  double energy = 0;       ///< [J]; contains the viscous response
  double max_strain = 0;   ///< largest |principal stretch - 1|; 0 for terms that do not know stretches
};

/// The points x + move + share (other - x). Viscous forces are zero at their strains, which are needed to second order
/// in `move`.
struct StrainReference
{
  const PointVector* x = nullptr;
  const PointVector* move = nullptr;   ///< with `ahead` and `behind`, the points x + move and x - move; may be null
  const PointVector *ahead = nullptr, *behind = nullptr;
  double share = 0;
  const PointVector* other = nullptr;   ///< not null if `share` is not 0
};

/// Plastic variables in the state of a part. A term reads those that are its own.
struct PlasticState
{
  const Eigen::VectorXd& rest_angles;   ///< one per hinge [rad]
  const Eigen::VectorXd& stiffening;    ///< one factor of the stiffness per hinge, or empty
};

/// An elastic energy of points with its viscous response: value, gradient, Hessian and pattern of the Hessian.
///
/// With a ratio set by setResponse() the term has the elastic forces and, in addition, `ratio` times the forces of the
/// strains minus those of takeStrains(). Both together are the gradient of one energy, so that value, gradient and
/// Hessian agree for every ratio. Rigid motions must not change the energy (see test/unit/energy_contract.cpp).
class PointTerm
{
public:
  virtual ~PointTerm() = default;

  virtual TermAccount account() const = 0;

  /// Returns the elements by their points, one column each. Points of one element have blocks of the Hessian in
  /// common. Without columns for a term with a constantMatrix().
  virtual Eigen::MatrixXi elements() const { return {}; }
  /// Looks up where the blocks of addHessian() are. The pattern of the matrix must hold all elements().
  virtual void setPattern(const BlockMatrix& /*matrix*/) {}
  /// Returns the matrix K of a term 1/2 x^T K x, which is its Hessian for each of the three coordinates, or nullptr.
  /// The caller adds (1 + ratio) K; addHessian() does not. A part can have one such term.
  virtual const PointMatrix* constantMatrix() const { return nullptr; }

  virtual TermSums value(const double* x) = 0;
  /// Adds the gradient to `gradient` [N].
  virtual TermSums addGradient(const double* x, double* gradient) = 0;
  /// Adds the gradient, and the Hessian to the values of the matrix of setPattern() [N/m]. `kind` chooses the exact
  /// Hessian or a positive semidefinite one that is not below it, for example that of Gauss and Newton. `from`: null,
  /// or the iterate of Newton's method before x. A term may then take for its geometric stiffness the stresses that
  /// were extrapolated linearly from there, as a method with unknown stresses has them: they lack the spurious part of
  /// second order that a turn of stiff elements causes [Magisano, Leonetti, Garcea, Computer Methods in Applied
  /// Mechanics and Engineering 313 (2017), 986].
  virtual TermSums addHessian(HessianKind kind, const double* x, double* gradient, double* values,
                              const double* from = nullptr) = 0;

  /// Keeps the strains of these points, at which viscous forces are zero.
  virtual void takeStrains(const StrainReference& at) = 0;
  /// Sets the ratio of the viscous stiffness to the elastic one, 0 or more. With 0 only elastic forces act.
  virtual void setResponse(double ratio) = 0;
  /// Comes before setResponse() where both change.
  virtual void setPlasticState(const PlasticState& /*state*/) {}
};

/// A load on points that depends on their velocities, such as wind. It has no energy: the work of such a force depends
/// on the path. Within one implicit stage the force is linearised, and the linear part is the gradient of a potential
///   1/2 sum_i (x_i - y_i)^T D_i (x_i - y_i)        [J]
/// with a positive semidefinite D_i per point. This potential is valid until the next begin() and says nothing about
/// other stages. Explicit steps take the force itself.
class PointLoad
{
public:
  virtual ~PointLoad() = default;

  /// Looks up where the blocks of the points are on the diagonal of this matrix.
  virtual void setPattern(const BlockMatrix& matrix) = 0;

  /// Linearises the force for a stage at whose end the velocities are (x - origin) / h. Now they are v (3 x n), and
  /// `shape` is the configuration that the force counts for. `wind` is the velocity of the air [m/s]. Adds the part of
  /// the force that is constant to `force` [N].
  virtual void begin(const PointVector& shape, const PointVector& origin, const Eigen::Matrix3Xd& v,
                     const Eigen::Vector3d& wind, double h, PointVector& force) = 0;
  /// The potential of the stage [J].
  virtual double value(const double* x) const = 0;
  /// Adds the gradient of the potential; returns the potential.
  virtual double addGradient(const double* x, double* gradient) const = 0;
  /// Adds D to the values of the matrix of setPattern().
  virtual void addHessian(double* values) const = 0;
  /// D of a point [N/m]; 0 before the first stage.
  virtual const Eigen::Matrix3d& stiffness(int point) const = 0;
  /// Returns the work of the potential on the points that are not held, on the way between two configurations [J].
  virtual double work(const PointVector& from, const PointVector& to, const std::vector<char>& held) const = 0;

  /// Adds the force at the configuration x and the velocities v [N].
  virtual void addForces(const PointVector& x, const PointVector& v, const Eigen::Vector3d& wind,
                         PointVector& force) const = 0;
};

}   // namespace slender
