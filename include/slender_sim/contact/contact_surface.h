#pragma once

#include <algorithm>
#include <array>
#include <limits>
#include <memory>
#include <utility>
#include <vector>

#include <Eigen/Core>

#include "slender_sim/contact/broad_phase.h"
#include "slender_sim/contact/contact_properties.h"
#include "slender_sim/contact/obstacle.h"
#include "slender_sim/geometry/pose.h"

namespace slender {

/// A straight piece of a tube between two points.
struct ContactSegment
{
  int a = 0, b = 0;      ///< points
  double radius = 0.0;   ///< [m]
  int object = 0;
  double start = 0.0;    ///< arc length of a along the object's curve [m]; b is at start + length
  double length = 0.0;   ///< at rest [m]
  double core = 1.0;     ///< share of the radius that other segments may not enter (fluid parts merge down to it)
  /// Bit 0: a moves as prescribed; bit 1: b does. If both do, the segment passes through everything else that moves as
  /// prescribed, but it touches simulated bodies.
  unsigned char driven = 0;

  double coreRadius() const { return core * radius; }
  bool prescribed() const { return driven == 3; }
};

/// A triangle of a cloth. Its edges and corners are derived from all triangles that have them in common.
struct ContactTriangle
{
  std::array<int, 3> corner{};   ///< points
  /// [m] > 0. The middle surfaces of two layers keep the sum of their half thicknesses as a distance, and the middle
  /// surface keeps half the thickness from a solid.
  double half_thickness = 0.0;
  int object = 0;
  /// Bit k: corner k moves as prescribed. Pieces of which all corners do so pass through each other, and through solids
  /// that move as prescribed.
  unsigned char driven = 0;
};

/// A solid that an object passes through, with all or some of its pieces (segments or triangles).
struct IgnoredSolid
{
  int number = -1;            ///< see ContactSolid::number
  std::vector<char> points;   ///< per point of the object: 1 if the pieces at this point pass; empty: all pieces pass
};

/// A curve or a cloth of a contact surface. Pieces of one object that share a point are never a contact pair. Near
/// pieces of one object keep only a share of thickness and gap: contactShare() gives that of a curve, and `rest`
/// determines that of a cloth.
struct ContactObject : ContactProperties
{
  double curve_length = 0.0;   ///< [m]
  bool closed = false;
  int owner = -1;   ///< the thread of which it is a strand, see ContactSolid::only; -1: it is none
  /// Rest positions of the points of a cloth [m]. If two pieces of the cloth are close to each other at rest, their
  /// thickness and gap are reduced, so that thickness plus gap is at most half of the distance at rest. Pieces with
  /// distance zero at rest are neighbours. With nullptr all pieces keep the whole thickness and gap.
  std::shared_ptr<const Eigen::Matrix3Xd> rest{};
  int first_point = 0;   ///< number of the first point of the object; not needed for strands of threads
  std::shared_ptr<const std::vector<IgnoredSolid>> ignored{};   ///< nullptr: the object passes through no solid
  /// Number of the solid, if this object is the surface of a simulated body; -1 otherwise. Friction then acts where the
  /// surfaces meet. It does not act at the points of the surface, because these may lie inside of the body.
  int carrier = -1;
  /// Friction also turns the segments of this curve about their tangents. Otherwise it acts at the centreline.
  bool turns = false;
};

/// A solid of a contact surface, which moves rigidly, and which objects of the surface pass through it.
struct ContactSolid : Obstacle
{
  std::vector<int> ignores{};   ///< objects it never touches
  int only = -1;                ///< touches nothing but the objects of this owner; -1: those of all
  int number = -1;              ///< IgnoredSolid refers to this number; -1: no object ignores the solid
  bool body = false;            ///< moves freely, so that triangles touch it wherever their corners are driven
  double least_stiffness = 0;   ///< of the barrier about it [N], see ContactPotential::barrier()
  /// Numbers of objects, in ascending order, and shares of the gap in (0, 1]. The solid repels such an object only
  /// within this share, so that a pair that starts closer together than the gap exerts no force at first.
  std::vector<std::pair<int, double>> ranges{};
};

struct ContactSurface
{
  int points = 0;
  std::vector<ContactSegment> segments;
  std::vector<ContactTriangle> triangles{};
  std::vector<ContactObject> objects;
  std::vector<ContactSolid> solids;
};

struct ContactOptions
{
  double gap = 0.0;   ///< distance between surfaces below which they repel [m] > 0
  /// [m/s] > 0. Friction holds like a spring (see FrictionSpring) until the slip exceeds this speed times the duration
  /// that begin() is given.
  double slip_speed = 1e-4;
  /// [N] > 0: the stiffness of barriers never falls below it; a good choice is the weight of a piece
  double least_stiffness = 1e-6;
};

/// A barrier that acts where gaps are less than a share of ContactOptions::gap.
struct BarrierLayer
{
  double share = 0.0;       ///< [-]; 0: there is no such layer
  double stiffness = 0.0;   ///< force at half of its gap [N]
  bool operator==(const BarrierLayer& b) const { return share == b.share && stiffness == b.stiffness; }
};

/// The barrier about an object: the sum of its layers, the outermost first. Without a stiffness it is not chosen yet.
struct BarrierLaw
{
  static constexpr int kMost = 5;
  std::array<BarrierLayer, kMost> layers{{{1.0, 0.0}, {}, {}, {}, {}}};
  int count() const
  {
    int n = 1;
    while (n < kMost && layers[static_cast<std::size_t>(n)].share > 0.0)
      ++n;
    return n;
  }
  const BarrierLayer& innermost() const { return layers[static_cast<std::size_t>(count() - 1)]; }
  bool operator==(const BarrierLaw& b) const { return layers == b.layers; }
};

/// The range of the stiffness of an object's barrier [N].
struct BarrierRange
{
  double least = 0.0, most = std::numeric_limits<double>::infinity();
};

/// Share of thickness and gap that two segments of one curve keep from each other, by their distance along the curve
/// and the sum of their radii [m]. It is 1 if that distance is at least (pi/2) (r1 + r2 + gap), half a turn of the
/// tightest bend that does not touch itself. If the distance is smaller, the share is proportional to it: thickness
/// plus gap is 2/pi of the distance. A bend that is not tighter than this touches nothing, and a bend that is stretched
/// keeps its room.
double contactShare(double along, double radii, double gap);
/// The same of two segments, by their distance along the curve at rest, the shorter way around a closed one. 0: they
/// have a point in common, or nearly so, and never count as a pair.
double contactShare(const ContactSegment& a, const ContactSegment& b, const ContactObject& curve, double gap);

/// The tangential spring of a touching pair with friction, which begins to slip where it is stretched by
/// ContactOptions::slip_speed times the length of a step [Cundall & Strack, A discrete numerical model for granular
/// assemblies, Geotechnique 29 (1979), 47]. From step to step it holds what sticks where it is: without memory, each
/// step would begin with a spring that is not stretched, and what sticks would creep. The memory is a force and not a
/// stretch: a change of the normal force does not change the tangential force, below its limit.
struct FrictionSpring
{
  int object = 0, other = -1;                 ///< numbers of the objects that touch; other: -1 for a solid
  int solid = -1, piece = 0;                  ///< numbers of the solid, and of its convex piece; -1: none
  std::array<int, 4> point{-1, -1, -1, -1};   ///< of the pair, counted in their objects; -1: unused
  Eigen::Vector3d tension{0, 0, 0};           ///< tangential force on what the first object touches [N]
};

/// The order of springs by their pairs.
bool operator<(const FrictionSpring& a, const FrictionSpring& b);

/// Part of a touching pair's potential. With the relative displacement u = sum_i weight[i] x[point[i]] minus, if there
/// is a solid, that of its material point at `position`, the potential has the gradient dE/du = -force and the second
/// derivative stiffness + `geometric`, of which the first is semidefinite and the second, from the turning of a normal
/// under its force, is not. A pair gives one term with its normal force; with friction, one more.
struct ContactTerm
{
  /// A segment of a curve that friction turns about its tangent.
  struct Turn
  {
    int point = -1;                    ///< where the segment begins; -1: unused
    Eigen::Vector3d column{0, 0, 0};   ///< what a turn of 1 rad adds to u [m]; zero in terms of normal forces
  };

  int point[4] = {-1, -1, -1, -1};   ///< -1: unused
  double weight[4] = {0, 0, 0, 0};
  int solid = -1;                      ///< that is touched, -1: none
  Eigen::Vector3d position{0, 0, 0};   ///< of the contact, world
  /// u begins with the displacement of the material point at `position` of the body that carries the points, in place
  /// of the sum over the points.
  bool carried = false;
  std::array<Turn, 2> turn{};   ///< u also contains column times the turn of each of these segments
  /// Friction acts at surfaces and not at points. Its u therefore also contains, for each point, `lever` times the
  /// displacement along `normal`. A lever is across the normal and has no unit.
  Eigen::Vector3d normal{0, 0, 0}, lever[4] = {normal, normal, normal, normal};
  Eigen::Vector3d force{0, 0, 0};   ///< on u [N], friction included
  double slip_range = 0.0;          ///< of friction that sticks: stretch at which it slips [m]; 0: other terms
  Eigen::Matrix3d stiffness = Eigen::Matrix3d::Zero(), geometric = Eigen::Matrix3d::Zero();

  bool turns() const { return !turn[0].column.isZero(0.0) || !turn[1].column.isZero(0.0); }
  /// Returns what a displacement of point k adds to u.
  Eigen::Vector3d moveBy(int k, const Eigen::Vector3d& displacement) const
  {
    return weight[k] * displacement + normal.dot(displacement) * lever[k];
  }
  /// Returns the force on point k that a force f on u makes.
  Eigen::Vector3d share(int k, const Eigen::Vector3d& f) const { return weight[k] * f + lever[k].dot(f) * normal; }
  /// Returns the block of points i and j of the second derivative; `second`: the second derivative in u.
  Eigen::Matrix3d block(int i, int j, const Eigen::Matrix3d& second) const
  {
    Eigen::Matrix3d sum = weight[i] * weight[j] * second;
    if (!normal.isZero(0.0))
    {
      const Eigen::Vector3d from = second * lever[i], to = second * lever[j];
      sum += weight[i] * to * normal.transpose() + weight[j] * normal * from.transpose() +
             lever[i].dot(to) * normal * normal.transpose();
    }
    return sum;
  }
};

/// What a pair's second derivative contains besides, because the place of contact runs along the pieces: stiffness r
/// r^T over the points, with r_i = along[i] normal + across[i] turning. Without `turning` the parts that make up for
/// `geometric` are left out. If a solid is touched, points count by their displacement against the solid's material
/// that is there, so that r contains the turn of the solid.
struct ContactRow
{
  int point[4] = {-1, -1, -1, -1};
  int solid = -1;   ///< that is touched, -1: none
  double along[4] = {0, 0, 0, 0}, across[4] = {0, 0, 0, 0};
  Eigen::Vector3d normal{0, 0, 0}, turning{0, 0, 0};
  double stiffness = 0.0;

  /// Returns the block of points i and j of this part of the second derivative, without `turning`.
  Eigen::Matrix3d block(int i, int j) const { return along[i] * along[j] * stiffness * normal * normal.transpose(); }
};

}   // namespace slender
