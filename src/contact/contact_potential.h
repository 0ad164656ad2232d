#pragma once

#include <algorithm>
#include <array>
#include <cstdint>
#include <iterator>
#include <limits>
#include <numeric>
#include <vector>

#include "barrier_stiffness.h"
#include "candidates.h"
#include "held_pieces.h"
#include "linalg/parallel_for.h"
#include "motion_shares.h"
#include "slender_sim/contact/barrier.h"
#include "slender_sim/contact/contact_surface.h"
#include "soft_gap.h"
#include "pair_gap.h"

namespace slender {

constexpr double kInfinity = std::numeric_limits<double>::infinity();
constexpr double kTurnMargin = 0.02;   ///< [rad] a solid may turn before candidates are sought again

/// Returns the component of u across the normal n.
inline Eigen::Vector3d across(const Eigen::Vector3d& n, const Eigen::Vector3d& u) { return u - n.dot(u) * n; }

template <class To, class From>
void copyFour(To& to, const From& from)
{
  std::copy(std::begin(from), std::end(from), std::begin(to));
}

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
  const ContactOptions& options() const { return options_; }
  /// Threads for the pairs of large surfaces; 0: see parallelFor(). Results do not depend on it.
  void setThreads(int threads) { threads_ = threads; }

  /// Takes the points, segments, triangles, and objects of another surface, which must be sound; the solids stay. For
  /// curves that are fed and divided while they move.
  void setPieces(const ContactSurface& surface);
  /// Takes the ranges of a solid.
  void setRanges(std::size_t solid, const std::vector<std::pair<int, double>>& ranges)
  {
    surface_.solids[solid].ranges = ranges;
  }
  /// Thins strands of threads where other things are nearer than a twentieth of the gap, or overlap: to a sixteenth of
  /// it. What was brought together by something else than motion (a division, growing radii) can so begin a step. All
  /// other pairs keep their thickness. False: two centrelines, or one and a middle surface or a solid, meet.
  bool thinToFit(const Eigen::Matrix3Xd& x, const std::vector<Pose>& solids);
  const ContactSurface& surface() const { return surface_; }
  /// Pairs of segments that thinToFit() found near each other: all those within the gap, and more. First and second are
  /// in order.
  const std::vector<GridPairs::Pair>& nearPairs() const { return near_.pairs(); }

  /// Smallest distance [m] between surfaces at points x (3 x points) and solids' poses, up to the gap; zero or less:
  /// they meet. Triangles that an edge passes through meet it. If a piece has held points, only its free corners and
  /// the edges between them count against solids that move as prescribed. Shares no search structure and no
  /// minimisation with the rest of this class. The surface of a mesh is touched from both sides.
  /// `strands`: whether strands of threads count against each other, which may overlap while they flow.
  double clearance(const Eigen::Matrix3Xd& x, const std::vector<Pose>& solids, bool strands = true);

  /// A time step of h seconds begins here: tangential displacements of friction count from this configuration, and its
  /// normal forces and tangent planes are those of friction until lagFriction(). Nothing else is carried over from
  /// earlier steps but barrier() and springs().
  void begin(const Eigen::Matrix3Xd& x, const std::vector<Pose>& solids, double h);
  /// Tells where prescribed points and solids go in the next solution: from (x, solids) to (x_end, solids_end). If a
  /// prescribed solid comes too near to held points, neither can give way. Then the pieces at these points let the
  /// solid pass: only their free corners, and the edges between free corners, touch it. Too near is less than the gap;
  /// for triangles, less than the room that a layer of cloth needs. A piece touches the solid again when it is apart
  /// from the solid and its held points are not too near.
  void letPass(const Eigen::Matrix3Xd& x, const std::vector<Pose>& solids, const Eigen::Matrix3Xd& x_end,
               const std::vector<Pose>& solids_end);
  /// The normal forces and tangent planes of the last evaluate() become those of friction, where a force has changed by
  /// more than kLagTolerance of the largest one on the objects that touch. Returns the largest change over the largest
  /// force of all.
  double lagFriction() { return lagFriction(0.0, false); }
  /// A point of each contact whose friction the last lagFriction(), or the last evaluate(), changed by more than
  /// kLagTolerance of the largest force on one of its objects.
  const std::vector<int>& pointsOfChanges() const { return points_of_changes_; }
  /// A change that lagFriction() returns is negligible if it is at most this [-].
  static constexpr double kLagTolerance = 1e-2;
  /// Tells how far the direction of an iteration moves the u of each term of terms() [m], after an evaluate() with
  /// stiffness. The next evaluate() with stiffness first gives friction the normal forces that the terms predict, to
  /// first order, for the end of the iteration. They are closer to the solution than those of the iterates, in which
  /// gaps are too small or too large. The friction of a contact does not change if the change is negligible, or if the
  /// contact moves by more than three times the smallest gap. A constant is added to the potential, so that the
  /// potential does not jump. pointsOfChanges() then names the contacts whose friction has changed. Friction follows a
  /// limited number of times after begin(), because a minimisation might not end otherwise. beginSolution() forgets the
  /// directions before.
  void followFriction(const std::vector<Eigen::Vector3d>& moves);
  /// The next evaluate() leaves the normal forces of friction as they are.
  void stopFollowing() { following_ = false; }
  /// The springs of friction where a step begins, in ascending order and one per pair. Strands of
  /// threads have none, because their pieces change.
  const std::vector<FrictionSpring>& springs() const { return springs_; }
  void setSprings(const std::vector<FrictionSpring>& springs) { springs_ = springs; }
  /// The last evaluate() was where a step, or a stage of it, ends, with the solids at these poses. springs() become
  /// those from which the next one begins.
  void keepSprings(const std::vector<Pose>& solids);

  /// Returns the share <= 1 of the motion from (x, solids) to (x_end, solids_end) up to which each distance between
  /// surfaces keeps two fifths of what it was, or of the gap if it was more than the gap. Points and the origins of
  /// solids go along straight lines, and solids turn uniformly by the smaller angle. The share is never too large
  /// [Li et al. 2021, additive CCD]. It is 0 if surfaces meet at x.
  double stepLimit(const Eigen::Matrix3Xd& x, const Eigen::Matrix3Xd& x_end, const std::vector<Pose>& solids,
                   const std::vector<Pose>& solids_end);
  /// Finds such limits for movers that may go different shares of the motion. `shares` has been begun, and movers that
  /// depend on each other have been united. Sets the shares, and unites those that would meet.
  void limitShares(const SurfaceMotion& motion, MotionShares& shares);

  /// Returns whether anything would have crossed a cloth, a curve another curve, or anything the core of a solid, if
  /// points and solids had moved straight from begin() to their present places. In one long step the iterates of a
  /// solution can go around the rim of a cloth, the end of a curve, or a thin solid, without touching it. The core is
  /// what lies deeper than depthOfPassing(). Things that moved less than this depth against a solid, or than half of
  /// the shortest edge against a cloth or curve, are not examined.
  bool passedThrough(const Eigen::Matrix3Xd& x_end, const std::vector<Pose>& solids_end);

  /// Returns the potential [J] at a configuration, plus the constant of followFriction(). It is infinite where surfaces
  /// meet or x is not finite. Fills terms(), in an order that depends on x and solids only; their stiffness and rows()
  /// are computed only on request. The second derivative is exact for pairs of segments and triangles. For solids, the
  /// parts that come from their own curvature and rotation are left out. For friction that slips back and forth, the
  /// secant is used. `turns` has one entry per point: by how much the segment that begins there has turned about its
  /// tangent since begin() [rad]. Null means that no segment has turned.
  double evaluate(const Eigen::Matrix3Xd& x, const std::vector<Pose>& solids, bool with_stiffness,
                  const Eigen::VectorXd* turns = nullptr);
  const std::vector<ContactTerm>& terms() const { return found_.terms; }
  /// Energy of the springs of friction in the last evaluate() [J], which is a part of the potential that evaluate()
  /// returned.
  double frictionEnergy() const { return std::accumulate(rubbed_.begin(), rubbed_.end(), 0.0); }
  const std::vector<ContactRow>& rows() const { return found_.rows; }
  /// Adds to the normal forces of terms() what they gain, to first order, in a motion of the points, and of the solids
  /// that move as prescribed. Forces that would become smaller do not change. The last evaluate() must have computed
  /// the stiffness of the terms.
  void pushTerms(const SurfaceMotion& motion);

  /// Smallest softened gap of the last evaluate() [m]; infinity without contact.
  double smallestGap() const { return smallest_gap_; }

  /// The barrier about an object, part of a simulation's state. Between two objects, the outermost layer has the larger
  /// share and the larger stiffness of the two, and the inner layers of both act. Between an object and a solid, the
  /// outermost layer is no softer than ContactSolid::least_stiffness. A barrier that was not chosen yet begins at the
  /// smallest gap of the object in begin(), so that nothing is thrown from where it stands.
  /// adaptStiffness(), after a step of h seconds, follows the largest normal force on each object in the last
  /// evaluate(): it aims at a smallest gap of a fifth and acts outside a twelfth to a half of the innermost layer. It
  /// makes the barrier stiffer only where stiffen() would. With h = 0 the present forces stay as they are.
  const BarrierLaw& barrier(int object) const { return stiffness_[object].law(); }
  /// The stiffness of the outermost layer is bounded by the range, which holds until the next call, and whose least
  /// value is at least ContactOptions::least_stiffness.
  void setBarrier(int object, const BarrierLaw& barrier, const BarrierRange& range = {});
  void setStiffness(double force);   ///< of barriers of one layer about all objects [N]
  void adaptStiffness(double h);
  /// Makes the barrier stiffer about objects whose smallest gap is too small to be resolved: it is below a twelfth of
  /// the innermost layer and has shrunk since begin(), or it is below a fiftieth. If surfaces were inside this layer at
  /// begin(), a new layer begins at their smallest gap then. If the last solution has `converged`, the stiffness
  /// becomes what adaptStiffness() chooses; otherwise it grows four- to a hundredfold. In a narrow place a
  /// stiffer barrier opens no gap. The next call finds this, takes the stiffness back, and the object keeps it until
  /// begin(). Returns whether a barrier has changed.
  bool stiffen(bool converged);
  /// Call this when a solution begins, after evaluate() at its start. stiffen() compares later gaps with those of that
  /// evaluation. Switches followFriction() off.
  void beginSolution();

private:
  /// A touching pair as friction needs it.
  struct Contact
  {
    std::int64_t first, second;   ///< what touches: orders contacts
    int point[4];
    double weight[4];
    int solid;
    Eigen::Vector3d material;          ///< in the solid's frame
    Eigen::Vector3d position, force;   ///< normal force on u
    int object, other;                 ///< that touch; other: -1 for a solid
    double friction = 0.0;             ///< of the two, once the contact is lagged
    /// Of its spring: force where the step begins, and in the last evaluation.
    Eigen::Vector3d tension_begin = Eigen::Vector3d::Zero(), tension = Eigen::Vector3d::Zero();
    Eigen::Vector3d own = Eigen::Vector3d::Zero();   ///< with a carrier: the position in its frame
    /// roundPart() of the solid and of the carrier, world. Then `material` and `own` do not contain it.
    Eigen::Vector3d round = own, own_round = own;
    int first_points = 2;                              ///< how many of the points belong to the first piece
    std::array<ContactTerm::Turn, 2> turn{};           ///< of friction
    bool levers = false;                               ///< whether any lever is not zero
    Eigen::Vector3d lever[4] = {own, own, own, own};   ///< of friction, see ContactTerm
    /// Slip, force over the largest one, and its derivative at the iterate before. None before the first one.
    bool has_iterate = false;
    Eigen::Vector3d last_slip = Eigen::Vector3d::Zero(), last_force = Eigen::Vector3d::Zero();
    Eigen::Matrix3d last_stiffness = Eigen::Matrix3d::Zero();
  };

  /// The quantities of a contact that are summed or compared over all contacts.
  struct Measure
  {
    double energy;             ///< [J]
    double gap, share;         ///< the gap [m], and its ratio to the gap at which the pair repels
    double force, stiffness;   ///< normal force, and stiffness of the barrier [N]
  };
  /// Two objects that are nearer to each other than the gap, and the ratio of their distance to the gap. If the second
  /// one is a solid, `other` is -1.
  struct Near
  {
    int object, other;
    double share;
  };
  /// The contacts of a range of candidates, in the order of the candidates.
  struct Batch
  {
    std::vector<Contact> contacts;
    std::vector<Measure> measures;   ///< of each contact
    std::vector<ContactTerm> terms;
    std::vector<ContactRow> rows;
    std::vector<Near> near;   ///< pairs that do not repel each other
    bool meet = false;        ///< The surfaces of one candidate meet.
    void clear();
    void append(const Batch& other);
  };

  /// Normal force of a contact at the end of an iteration, as followFriction() predicts it [N].
  struct PredictedForce
  {
    std::int64_t first, second;   ///< of the contact
    double size;
    bool far;   ///< The contact moves so far that its force is not known.
  };

  void beginFollowing();
  double lagFriction(double least, bool predicted);
  void keepHistory(Contact& contact, const Contact& old, bool predicted) const;
  void findSpring(Contact& contact) const;
  double findLargestForces();
  bool isNoticeable(const Contact& contact, double change) const;
  void addChange(const Contact& contact, double change);
  void relax(double change);
  void check(const Eigen::Matrix3Xd& x, const std::vector<Pose>& solids) const;
  /// How the points of an object have moved since begin() [m].
  struct Displacements
  {
    BoundingBox box = BoundingBox::empty();
    double shortest_edge = std::numeric_limits<double>::infinity();   ///< [m]; infinite without edges
  };
  void takeDisplacements(const Eigen::Matrix3Xd& x_end);
  double depthOfPassing(int object, int solid) const;
  bool crossesCore(const SurfaceMotion& motion, const int* corner, int corners, int object, int solid, int piece,
                   double radius) const;
  bool movedFar(const Eigen::Matrix3Xd& x_end);
  /// Calls f for one candidate; `number` counts them in the order of their lists.
  template <class F>
  static void visit(const Candidates& candidates, int number, F&& f);
  static int count(const Candidates& candidates);
  /// Calls f(first, last, batch) for consecutive ranges of 0 ... count-1. Appends the batches to found_ in the order of
  /// the ranges.
  template <class F>
  void inBatches(int count, F&& f);
  /// A configuration that is evaluated.
  struct Place
  {
    const Eigen::Matrix3Xd& x;
    const std::vector<Pose>& poses;
    bool with_stiffness;
  };
  bool add(const Place& place, const GridPairs::Pair& pair, Batch& out) const;
  bool add(const Place& place, const Candidates::OnSolid& on, Batch& out) const;
  bool add(const Place& place, const SheetCandidates::Pair& pair, Batch& out) const;
  bool add(const Place& place, const SheetCandidates::OnSolid& on, Batch& out) const;
  /// Sets what friction needs to know of where a solid is touched, from `material` in the solid's frame. `normal`:
  /// world.
  void setPlaces(const std::vector<Pose>& poses, const Eigen::Vector3d& normal, Contact& contact) const;
  /// Adds a contact if its gap is small enough. `scale`: the share of the gap at which the pair repels. Returns false
  /// if the pieces meet.
  bool addContact(const Place& place, const PairGap& gap, Contact& contact, double scale, Batch& out) const;
  void setTurns(const Eigen::Matrix3Xd& x, Contact& contact) const;
  void setLevers(Contact& contact) const;
  void listSegments();
  /// Appends a term of a contact, without its force.
  static ContactTerm& addTerm(const Contact& contact, Batch& out);
  static void addMotion(const PairGap& gap, const Contact& contact, double force, Batch& out);
  /// Share of the gap at which an object and a solid repel each other.
  double rangeOf(int object, int solid) const
  {
    const auto& ranges = surface_.solids[solid].ranges;
    const auto at = std::lower_bound(ranges.begin(), ranges.end(), object,
                                     [](const auto& range, int wanted) { return range.first < wanted; });
    return at == ranges.end() || at->first != object ? 1.0 : at->second;
  }
  double frictionOf(const Contact& contact) const;
  /// The layers that act between the objects of a contact.
  struct PairBarrier
  {
    int count = 1;
    std::array<BarrierLayer, 2 * BarrierLaw::kMost - 1> layers;
    void add(const BarrierLaw& law);
  };
  PairBarrier barrierOf(const Contact& contact) const;
  FrictionSpring springOf(const Contact& contact) const;
  bool turnsWithSolid(const Contact& contact) const;
  double spin(const Contact& contact, const std::vector<Pose>& poses) const;
  Eigen::Vector3d displacement(int solid, const Eigen::Vector3d& place, const Eigen::Vector3d& round,
                               const std::vector<Pose>& poses) const;
  double addFriction(const Place& place, const Eigen::VectorXd* turns);
  double addTerms(const Place& place, const Eigen::VectorXd* turns);
  double addFriction(const Place& place, const Eigen::VectorXd* turns, Contact& contact, Batch& out) const;
  double restart();

  /// What thinToFit() made room for, and the distance [m] that remains forbidden there. Only this pair is thinner: a
  /// segment that overlaps one neighbour keeps its distance from all others.
  struct Thinned
  {
    std::array<int, 3> key;   ///< two segments; or a solid, a segment and a piece
    double thickness;
    bool operator<(const Thinned& other) const { return key < other.key; }
  };
  /// Thins a pair at this distance if it has to be; `scale`: of its gap. False: the pieces meet.
  bool fit(std::vector<Thinned>& list, const std::array<int, 3>& key, double distance, double thickness,
           double scale = 1.0) const;
  bool thinSheetsToFit(const Eigen::Matrix3Xd& x);
  static double thinned(const std::vector<Thinned>& list, const std::array<int, 3>& key, double thickness);
  /// Share of thickness and gap that a pair of segments keeps, see contactShare().
  double scaleOf(const ContactSegment& a, const ContactSegment& b) const
  {
    return a.object == b.object ? contactShare(a, b, surface_.objects[a.object], options_.gap) : 1.0;
  }
  bool isStrand(int object) const { return object >= 0 && surface_.objects[object].owner >= 0; }
  static double fullThickness(const ContactSegment& a, const ContactSegment& b, double scale)
  {
    return scale * (a.coreRadius() + b.coreRadius());
  }
  /// Distances of centrelines [m] at which pairs touch.
  double thicknessOf(const GridPairs::Pair& pair, double scale) const
  {
    const double full = fullThickness(surface_.segments[pair.first], surface_.segments[pair.second], scale);
    return thin_pairs_.empty() ? full : thinned(thin_pairs_, {pair.first, pair.second, 0}, full);
  }
  double thicknessOf(const Candidates::OnSolid& on) const
  {
    const double full = surface_.segments[on.segment].radius;
    return thin_on_solids_.empty() ? full : thinned(thin_on_solids_, {on.solid, on.segment, on.piece}, full);
  }
  bool passes(const Candidates::OnSolid& on) const { return held_.letPass(on.solid, false, on.segment); }
  bool passes(const SheetCandidates::OnSolid& on) const
  {
    return on.face.driven != 0 && !surface_.solids[on.solid].body && held_.letPass(on.solid, true, on.face.index);
  }
  static std::array<int, 3> keyOf(const SheetCandidates::Pair& pair) { return {pair.edges, pair.first, pair.second}; }
  double thicknessOf(const SheetCandidates::Pair& pair) const
  {
    return thin_sheets_.empty() ? pair.thickness : thinned(thin_sheets_, keyOf(pair), pair.thickness);
  }
  /// Tells which movers may meet in a pair of pieces, or of a piece and a solid.
  struct Meeting
  {
    int point, other;   ///< a point of each piece; `other` is -1 if the second one is a solid
    int solid;          ///< number of the solid; -1: none
    bool driven;        ///< A point of the pieces is driven.
  };
  Meeting meetingOf(const GridPairs::Pair& pair) const;
  Meeting meetingOf(const Candidates::OnSolid& on) const;
  Meeting meetingOf(const SheetCandidates::Pair& pair) const;
  Meeting meetingOf(const SheetCandidates::OnSolid& on) const;
  double limitOf(const SurfaceMotion& motion, const GridPairs::Pair& pair) const;
  double limitOf(const SurfaceMotion& motion, const Candidates::OnSolid& on) const;
  double limitOf(const SurfaceMotion& motion, const SheetCandidates::Pair& pair) const;
  double limitOf(const SurfaceMotion& motion, const SheetCandidates::OnSolid& on) const;
  Candidates::Range rangeOfCandidates() const
  {
    constexpr double kLongest =
        10.0;   // gaps: if many points went longer ways, evaluations would examine too many pairs
    return {options_.gap, margin_, margins_, kLongest * options_.gap, kTurnMargin, threads_};
  }
  /// Candidates in this range hold for one motion only, because no point has a margin.
  Candidates::Range rangeOfSweeps() const { return {options_.gap, 0.0, margins_, -1.0, 0.0, threads_}; }
  const Candidates& candidatesOf(const SurfaceMotion& motion);
  void setRigid(const SurfaceMotion& motion);
  template <class Wanted, class Take>
  void forLimits(const SurfaceMotion& motion, Wanted&& wanted, Take&& take);
  using Movers = std::array<int, 3>;
  static Movers moversOf(const Meeting& meeting, const MotionShares& shares);
  void setShared(const SurfaceMotion& motion, const MotionShares& shares);
  double sheetClearance(const Eigen::Matrix3Xd& x, const std::vector<Pose>& solids, double least);

  ContactSurface surface_;
  ContactOptions options_;
  Barrier barrier_;
  std::vector<BarrierStiffness> stiffness_;   ///< per object
  std::vector<SolidPieces> solids_;

  double h_ = 0.0;
  Eigen::Matrix3Xd x_begin_, x_now_;   ///< where the step begins; in the last evaluation
  std::vector<Pose> solids_begin_;
  Batch found_;                  ///< in the last evaluation
  std::vector<Batch> batches_;   ///< for inBatches()
  std::vector<Contact> lagged_;
  int threads_ = 1;
  std::vector<FrictionSpring> springs_;   ///< where the step begins; sorted
  double smallest_gap_ = 0.0;
  bool following_ = false;   ///< see followFriction()

  std::vector<Thinned> thin_pairs_, thin_on_solids_, thin_sheets_;   ///< sorted
  std::vector<Contact> rubbing_;                                     ///< for lagFriction()
  std::vector<PredictedForce> predicted_;   ///< if friction follows: one per contact, in their order
  int follows_left_ = 0;                    ///< how often friction may still follow before the next begin()
  /// The change that lagFriction() without prediction returned last, and the share of the change of each force that
  /// the next call takes over.
  double last_change_ = kInfinity, relaxation_ = 1.0;
  std::vector<double> largest_forces_;   ///< the largest normal force that rubs on each object [N]; for lagFriction()
  double largest_change_ = 0.0;          ///< the largest change of such a force by lagFriction() [N]
  std::vector<int> points_of_changes_;
  std::vector<double> rubbed_;   ///< energies of friction, for addTerms() [J]
  double shift_ = 0.0;           ///< constant of the potential, see followFriction() [J]
  Candidates near_, swept_;
  std::vector<double> limits_;        ///< for forLimits()
  std::vector<RigidMotion> rigid_;    ///< likewise, per solid
  Eigen::Matrix3Xd shared_x_;         ///< for limitShares()
  std::vector<Pose> shared_solids_;   ///< likewise
  SheetPieces sheets_;
  HeldPieces held_;
  std::vector<Displacements> displacements_;   ///< per object, see movedFar()
  std::vector<int> segment_of_point_;          ///< begins at a point, or ends there if none begins; -1: none
  double margin_;                              ///< of candidates near solids and triangles [m]
  std::vector<double> margins_;                ///< of candidates near points of curves [m]
  std::vector<int> order_;                     ///< for clearance()
  std::vector<BoundingBox> boxes_;
};

template <class F>
void ContactPotential::visit(const Candidates& candidates, int number, F&& f)
{
  const auto in = [&](const auto& list) {
    const bool found = number < static_cast<int>(list.size());
    found ? f(list[number]) : void(number -= static_cast<int>(list.size()));
    return found;
  };
  in(candidates.pairs()) || in(candidates.onSolids()) || in(candidates.sheets().pairs()) ||
      in(candidates.sheets().onSolids());
}

template <class F>
void ContactPotential::inBatches(int count, F&& f)
{
  constexpr int kBatch = 256;   // Fewer pairs are done before another thread could help.
  const int batches = threads_ == 1 ? 1 : (count + kBatch - 1) / kBatch;
  if (batches <= 1)
    return f(0, count, found_);
  if (static_cast<int>(batches_.size()) < batches)
    batches_.resize(batches);
  parallelFor(threads_, batches, 1, [&](int k) {
    batches_[k].clear();
    f(kBatch * k, std::min(count, kBatch * (k + 1)), batches_[k]);
  });
  for (int k = 0; k < batches; ++k)
    found_.append(batches_[k]);
}

}   // namespace slender
