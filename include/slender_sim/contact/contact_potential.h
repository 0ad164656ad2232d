#pragma once

#include <memory>
#include <vector>

#include <Eigen/Core>

#include "slender_sim/contact/shape.h"
#include "slender_sim/geometry/pose.h"

namespace slender {

/// A straight piece of a tube between two points.
struct ContactSegment
{
  int a = 0, b = 0;        ///< points
  double radius = 0.0;     ///< [m]
  int object = 0;
  double start = 0.0;      ///< arc length of a along the object's curve [m]; b is at start + length
  double length = 0.0;     ///< at rest [m]
};

/// What a curve (later: a surface) touches. Pieces of one curve that are closer along it than about a quarter of a turn at its
/// tightest are neighbours and never a pair.
struct ContactObject
{
  double curve_length = 0.0;   ///< [m]
  bool closed = false;
  bool self = true, others = true, solids = true;
  double friction = 0.0;       ///< Coulomb [-]
};

/// An obstacle or a rigid body: a shape that moves rigidly.
struct ContactSolid
{
  Shape shape;
  double friction = -1.0;      ///< negative: that of whatever touches it; otherwise the geometric mean of both counts
  int ignores = -1;            ///< an object it never touches
};

struct ContactSurface
{
  int points = 0;
  std::vector<ContactSegment> segments;
  std::vector<ContactObject> objects;
  std::vector<ContactSolid> solids;
};

struct ContactOptions
{
  double gap = 0.0;            ///< distance between surfaces below which they repel [m] > 0
  double slip_speed = 1e-4;    ///< friction sticks below it [m/s]
};

/// One touching pair. With the relative displacement u = sum_i weight[i] x[point[i]] minus that of the solid's material point at
/// `position`, the potential has the gradient dE/du = -force and, projected to be semidefinite, the second derivative `stiffness`.
struct ContactTerm
{
  int point[4] = {-1, -1, -1, -1};   ///< -1: unused
  double weight[4] = {0, 0, 0, 0};
  int solid = -1;                    ///< that is touched, -1: none
  Eigen::Vector3d position{0, 0, 0}; ///< of the contact, world
  Eigen::Vector3d force{0, 0, 0};    ///< on u [N], friction included
  Eigen::Matrix3d stiffness = Eigen::Matrix3d::Zero();
};

/// Barrier potential of surfaces that may not touch, with Coulomb friction by lagged normal forces
/// [Li et al., Incremental Potential Contact, SIGGRAPH 2020; Codimensional IPC, 2021]. Infinite where surfaces meet; with stepLimit() the
/// iterates of a minimisation never get there. Memory is reused from step to step.
class ContactPotential
{
public:
  ContactPotential(ContactSurface surface, const ContactOptions& options);
  ~ContactPotential();
  ContactPotential(ContactPotential&&) noexcept;

  /// Smallest distance [m] between surfaces at points x (3 x points) and solids' poses, up to the gap; negative or zero: they meet.
  double clearance(const Eigen::Matrix3Xd& x, const std::vector<Pose>& solids);

  /// A time step of h seconds begins here: tangential displacements of friction count from this configuration.
  void begin(const Eigen::Matrix3Xd& x, const std::vector<Pose>& solids, double h);
  /// The normal forces and tangent planes of the last evaluate() become those of friction; returns their largest relative change.
  double lagFriction();

  /// The largest share alpha <= 1 of the motion from (x, solids) to (x_end, solids_end), along straight lines and uniform screw motions,
  /// that leaves at least a fifth of each present distance. Conservative [Li et al. 2021, additive CCD]: misses nothing.
  double stepLimit(const Eigen::Matrix3Xd& x, const Eigen::Matrix3Xd& x_end, const std::vector<Pose>& solids, const std::vector<Pose>& solids_end);

  /// Potential [J] at a configuration; infinite where surfaces meet. Fills terms(); their stiffness only on request.
  double evaluate(const Eigen::Matrix3Xd& x, const std::vector<Pose>& solids, bool with_stiffness);
  const std::vector<ContactTerm>& terms() const;

  /// Force [N] of the barrier at half the gap. adaptStiffness(), after a step, follows the largest contact forces and keeps gaps from
  /// getting too small to resolve. Part of a simulation's state.
  double stiffness() const;
  void setStiffness(double force);
  void adaptStiffness();

private:
  class Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace slender
