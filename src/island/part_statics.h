#pragma once

#include <functional>
#include <limits>

#include <Eigen/Core>

namespace slender {

/// Scales of a part that tell small eigenvalues from zero.
struct StaticScales
{
  double mass = 0.0;                                             ///< [kg]
  double least_mass = std::numeric_limits<double>::infinity();   ///< of a point [kg]
  double bending = std::numeric_limits<double>::infinity();      ///< its lowest bending stiffness [N/m]
  double largest = 0.0;                                          ///< its largest eigenvalue [1/s^2]
  int points = 0;
};

/// The functions of a part that Statics calls. The part keeps a present configuration, from which each solution starts.
/// A part without these functions has no statics.
class PartStatics
{
public:
  virtual ~PartStatics() = default;

  // ---- the present configuration
  /// Base and trial := the present configuration. Only elastic forces act.
  virtual void loadPresent() {}
  /// The trial of the last evaluation becomes the present configuration.
  virtual void takeTrial() {}
  /// Returns a function that restores the present configuration of now.
  virtual std::function<void()> wayBack()
  {
    return [] {};
  }
  /// Largest displacement by the last takeTrial(), over the size of the part [-].
  virtual double shift() const { return 0.0; }
  /// Work of loads without a potential in all solutions so far [J].
  virtual double staticWork() const { return 0.0; }

  // ---- energies
  /// Number of moves in which what is prescribed can be carried to its targets. 0: all of it is there.
  virtual double moves() const { return 0.0; }
  /// Sets the loads and a proximal term about the trial. A part may move free points of the trial first. The weight is
  /// in a unit of the part, see weightOf().
  virtual void setProximal(double) {}
  /// The weight whose proximal term has this eigenvalue [1/s^2]. It may be infinite or not a number.
  virtual double weightOf(double) const { return 0.0; }
  /// Sets the loads. From now on, until loadPresent(), the matrix is K + rate M with the stiffness K and the inertia M
  /// of the part. The rate may be negative [1/s^2]. The energy of loads counts from the origin.
  virtual void setPencil(double) {}

  // ---- modes
  virtual StaticScales scales() const { return {}; }
  /// The direction of the part, prescribed entries included.
  virtual Eigen::Map<Eigen::VectorXd> directions() { return {nullptr, 0}; }
  /// Gradient := -(inertia) direction, with zeros for prescribed entries.
  virtual void weighDirection() {}
  /// Largest turn by the direction [rad]. A motion of the part as a whole counts as its displacement over its size.
  virtual double largestTurn() const { return 0.0; }
  /// Adds what bounds the rounding error of an eigenvalue with the direction as its mode: the sum of stiffnesses that
  /// rounding errors are shares of [N m], and the inertia [kg m^2].
  virtual void addRounding(double&, double&) const {}
};

}   // namespace slender
