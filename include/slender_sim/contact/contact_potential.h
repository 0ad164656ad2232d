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
  double least_stiffness = 0;   ///< of the barrier about it [N], see ContactPotential::stiffness()
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
  /// [N] > 0: stiffness() never falls below it; a good choice is the weight of a piece
  double least_stiffness = 1e-6;
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
  std::array<Turn, 2> turn{};       ///< u also contains column times the turn of each of these segments
  Eigen::Vector3d force{0, 0, 0};   ///< on u [N], friction included
  double slip_range = 0.0;          ///< of friction that sticks: stretch at which it slips [m]; 0: other terms
  Eigen::Matrix3d stiffness = Eigen::Matrix3d::Zero(), geometric = Eigen::Matrix3d::Zero();

  bool turns() const { return !turn[0].column.isZero(0.0) || !turn[1].column.isZero(0.0); }
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
};

/// Decides when to try again a method that may fail. After each failure in a row it skips more attempts: 1, 3, 7, 15.
class Backoff
{
public:
  bool due() { return --after_ < 0; }
  void tried(bool succeeded)
  {
    pause_ = succeeded ? 0 : std::min(15, 2 * pause_ + 1);
    after_ = pause_;
  }

private:
  int after_ = 0, pause_ = 0;
};

/// Barrier potential of surfaces that may not touch, with Coulomb friction by lagged normal forces and tangential
/// springs [Li et al., Incremental Potential Contact, SIGGRAPH 2020; with thickness: Codimensional IPC, 2021]. It is
/// infinite where surfaces meet, except where an edge has passed through the inside of a triangle. With stepLimit() the
/// iterates of a minimisation never get to either. Memory is reused from step to step.
///
/// The pairs are: two edges (segments, and edges of triangles), a point and a triangle (corners, and ends of segments),
/// a segment and a solid, and a triangle (or a free edge or corner) and a solid. All of them have energies that are
/// once continuously differentiable, see soft_gap.h and pair_gap.h.
class ContactPotential
{
public:
  ContactPotential(ContactSurface surface, const ContactOptions& options);
  ~ContactPotential();
  ContactPotential(ContactPotential&&) noexcept;
  const ContactOptions& options() const;

  /// Takes the points, segments, triangles, and objects of another surface, which must be sound; the solids stay. For
  /// curves that are fed and divided while they move.
  void setPieces(const ContactSurface& surface);
  /// Takes the ranges of a solid.
  void setRanges(std::size_t solid, const std::vector<std::pair<int, double>>& ranges);
  /// Thins segments and triangles where others, or solids, are nearer than a twentieth of the gap, or overlap: to a
  /// sixteenth of it. What was brought together by something else than motion (a division, growing radii) can so begin
  /// a step. False: two centrelines or middle surfaces, or one and a solid, meet.
  bool thinToFit(const Eigen::Matrix3Xd& x, const std::vector<Pose>& solids);
  const ContactSurface& surface() const;
  /// Pairs of segments that thinToFit() found near each other: all those within the gap, and more. First and second are
  /// in order.
  const std::vector<GridPairs::Pair>& nearPairs() const;

  /// Smallest distance [m] between surfaces at points x (3 x points) and solids' poses, up to the gap; zero or less:
  /// they meet. Triangles that an edge passes through meet it. If a piece has held points, only its free corners and
  /// the edges between them count against solids that move as prescribed. Shares no search structure and no
  /// minimisation with the rest of this class. The surface of a mesh is touched from both sides.
  double clearance(const Eigen::Matrix3Xd& x, const std::vector<Pose>& solids);

  /// A time step of h seconds begins here: tangential displacements of friction count from this configuration, and its
  /// normal forces and tangent planes are those of friction until lagFriction(). Nothing else is carried over from
  /// earlier steps but stiffness() and springs().
  void begin(const Eigen::Matrix3Xd& x, const std::vector<Pose>& solids, double h);
  /// Tells where prescribed points and solids go in the next solution: from (x, solids) to (x_end, solids_end). If a
  /// prescribed solid comes too near to held points, neither can give way. Then the pieces at these points let the
  /// solid pass: only their free corners, and the edges between free corners, touch it. Too near is less than the gap;
  /// for triangles, less than the room that a layer of cloth needs. A piece touches the solid again when it is apart
  /// from the solid and its held points are not too near.
  void letPass(const Eigen::Matrix3Xd& x, const std::vector<Pose>& solids, const Eigen::Matrix3Xd& x_end,
               const std::vector<Pose>& solids_end);
  /// The normal forces and tangent planes of the last evaluate() become those of friction; returns the largest change
  /// of a contact's force over the largest force.
  double lagFriction();
  /// A change that lagFriction() returns is negligible if it is at most this [-].
  static constexpr double kLagTolerance = 1e-2;
  /// Tells how far the direction of an iteration moves the u of each term of terms() [m], after an evaluate() with
  /// stiffness. The next evaluate() with stiffness first gives friction the normal forces that the terms predict, to
  /// first order, for the end of the iteration. They are closer to the solution than those of the iterates, in which
  /// gaps are too small or too large. Friction does not change if the change is negligible, or if a contact moves by
  /// more than three times the smallest gap. A constant is added to the potential, so that the potential does not jump.
  /// Friction follows a limited number of times after begin(), because a minimisation might not end otherwise.
  /// beginSolution() forgets the directions before.
  void followFriction(const std::vector<Eigen::Vector3d>& moves);
  /// The springs of friction where a step begins, in ascending order and one per pair. Strands of
  /// threads have none, because their pieces change.
  const std::vector<FrictionSpring>& springs() const;
  void setSprings(const std::vector<FrictionSpring>& springs);
  /// The last evaluate() was where a step, or a stage of it, ends, with the solids at these poses. springs() become
  /// those from which the next one begins.
  void keepSprings(const std::vector<Pose>& solids);

  /// The largest share alpha <= 1 of the motion from (x, solids) to (x_end, solids_end) that leaves of each distance
  /// between surfaces at least a fifth, or a fifth of the gap. Points go along straight lines; solids' origins too,
  /// while they turn uniformly by the smaller angle. Conservative [Li et al. 2021, additive CCD]: misses nothing. 0 if
  /// surfaces meet at x.
  double stepLimit(const Eigen::Matrix3Xd& x, const Eigen::Matrix3Xd& x_end, const std::vector<Pose>& solids,
                   const std::vector<Pose>& solids_end);

  /// Returns whether anything would have crossed a cloth, or a curve another curve, if points and the origins of solids
  /// had moved straight from begin() to their present places. In one long step the iterates of a solution can go around
  /// the rim of a cloth, or the end of a curve, without touching it. Things that moved less than half of the shortest
  /// edge of the cloth or curve against it are not examined.
  bool passedThrough(const Eigen::Matrix3Xd& x_end, const std::vector<Pose>& solids_end);

  /// Returns the potential [J] at a configuration, plus the constant of followFriction(). It is infinite where surfaces
  /// meet or x is not finite. Fills terms(), in an order that depends on x and solids only; their stiffness and rows()
  /// are computed only on request. The second derivative is exact for pairs of segments and triangles. For solids, the
  /// parts that come from their own curvature and rotation are left out. For friction that slips back and forth, the
  /// secant is used. `turns` has one entry per point: by how much the segment that begins there has turned about its
  /// tangent since begin() [rad]. Null means that no segment has turned.
  double evaluate(const Eigen::Matrix3Xd& x, const std::vector<Pose>& solids, bool with_stiffness,
                  const Eigen::VectorXd* turns = nullptr);
  const std::vector<ContactTerm>& terms() const;
  const std::vector<ContactRow>& rows() const;
  /// Adds to the normal forces of terms() what they gain, to first order, when the solids that move as prescribed go
  /// from `solids` to `solids_end`. Forces that would become smaller do not change. The last evaluate() must have
  /// computed the stiffness of the terms.
  void pushTerms(const std::vector<Pose>& solids, const std::vector<Pose>& solids_end);

  /// Smallest softened gap of the last evaluate() [m]; infinity without contact.
  double smallestGap() const;

  /// Force [N] of the barrier about an object at half the gap. The barrier between two objects has the larger stiffness
  /// of the two, and that between an object and a solid is no softer than ContactSolid::least_stiffness.
  /// adaptStiffness(), after a step, follows the largest normal force on each object in the last evaluate(): it aims at
  /// a smallest gap of a fifth and acts outside a twelfth to a half. It makes the barrier stiffer only where stiffen()
  /// would. Part of a simulation's state.
  double stiffness(int object) const;
  /// Sets the stiffness about an object to `force` [N], or to the nearest value in the range. The range holds until the
  /// next call, and its least value is at least ContactOptions::least_stiffness.
  void setStiffness(int object, double force, const BarrierRange& range = {});
  void setStiffness(double force);   ///< of all objects
  void adaptStiffness();
  /// Makes the barrier stiffer about objects whose smallest gap is too small to be resolved: it is below a twelfth of
  /// options().gap and has shrunk since begin(), or it is below a fiftieth. If the last solution has `converged`, the
  /// stiffness becomes what adaptStiffness() chooses; otherwise it grows four- to a hundredfold. In a narrow place a
  /// stiffer barrier opens no gap. The next call finds this, takes the stiffness back, and the object keeps it until
  /// begin(). Returns whether a barrier has changed.
  bool stiffen(bool converged);
  /// Call this when a solution begins, after evaluate() at its start. stiffen() compares later gaps with those of that
  /// evaluation. Switches followFriction() off.
  void beginSolution();

private:
  class Impl;
  std::unique_ptr<Impl> impl_;
};

}   // namespace slender
