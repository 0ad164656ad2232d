#pragma once

#include <algorithm>
#include <array>
#include <cstdint>
#include <iterator>
#include <limits>
#include <vector>

#include "barrier_stiffness.h"
#include "candidates.h"
#include "held_pieces.h"
#include "slender_sim/contact/barrier.h"
#include "slender_sim/contact/contact_potential.h"
#include "soft_gap.h"
#include "pair_gap.h"

namespace slender {

constexpr double kInfinity = std::numeric_limits<double>::infinity();
constexpr double kTurnMargin = 0.02;   ///< [rad] a solid may turn before candidates are sought again

template <class To, class From>
void copyFour(To& to, const From& from)
{
  std::copy(std::begin(from), std::end(from), std::begin(to));
}

class ContactPotential::Impl
{
public:
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
    Eigen::Vector3d own = Eigen::Vector3d::Zero();   ///< the position in the frame of the carrier, if there is one
    std::array<ContactTerm::Turn, 2> turn{};         ///< of friction
    /// Slip, force over the largest one, and its derivative at the iterate before. None before the first one.
    bool has_iterate = false;
    Eigen::Vector3d last_slip = Eigen::Vector3d::Zero(), last_force = Eigen::Vector3d::Zero();
    Eigen::Matrix3d last_stiffness = Eigen::Matrix3d::Zero();
  };

  /// Normal force of a contact at the end of an iteration, as follow() predicts it [N].
  struct PredictedForce
  {
    std::int64_t first, second;   ///< of the contact
    double size;
  };

  Impl(ContactSurface surface, const ContactOptions& options);

  double clearance(const Eigen::Matrix3Xd& x, const std::vector<Pose>& solids);
  double stepLimit(const Eigen::Matrix3Xd& x, const Eigen::Matrix3Xd& x_end, const std::vector<Pose>& solids,
                   const std::vector<Pose>& solids_end);
  double evaluate(const Eigen::Matrix3Xd& x, const std::vector<Pose>& solids, bool with_stiffness,
                  const Eigen::VectorXd* turns);
  void beginFollowing();
  void follow(const std::vector<Eigen::Vector3d>& moves);
  double lagFriction(double least = 0.0, bool predicted = false);
  void relax(double change);
  void keepSprings(const std::vector<Pose>& poses);
  void letPass(const SurfaceMotion& motion);
  bool thinToFit(const Eigen::Matrix3Xd& x, const std::vector<Pose>& solids);
  bool passedThrough(const Eigen::Matrix3Xd& x_end, const std::vector<Pose>& solids_end);
  const std::vector<GridPairs::Pair>& nearPairs() const { return near_.pairs(); }
  void setPieces(const ContactSurface& pieces);
  void check(const Eigen::Matrix3Xd& x, const std::vector<Pose>& solids) const;

  ContactSurface surface;
  ContactOptions options;
  Barrier barrier;
  std::vector<BarrierStiffness> stiffness;   ///< per object
  std::vector<SolidPieces> solids;

  double h = 0.0;
  Eigen::Matrix3Xd x_begin;
  std::vector<Pose> solids_begin;
  std::vector<Contact> contacts, lagged;
  std::vector<FrictionSpring> springs;   ///< where the step begins; sorted
  std::vector<ContactTerm> terms;
  std::vector<ContactRow> rows;
  double smallest_gap = 0.0;
  bool following = false;   ///< see followFriction()

private:
  /// How the points of an object have moved since begin() [m].
  struct Displacements
  {
    BoundingBox box = BoundingBox::empty();
    double shortest_edge = std::numeric_limits<double>::infinity();   ///< [m]; infinite without edges
    bool has_triangles = false;
  };
  void takeDisplacements(const Eigen::Matrix3Xd& x_end);
  bool movedFar(const Eigen::Matrix3Xd& x_end, const std::vector<Pose>& solids_end);
  double addPair(const Eigen::Matrix3Xd& x, const GridPairs::Pair& pair, bool with_stiffness);
  double addOnSolid(const Eigen::Matrix3Xd& x, const Candidates::OnSolid& on, const std::vector<Pose>& poses,
                    bool with_stiffness);
  double addSheets(const Eigen::Matrix3Xd& x, const std::vector<Pose>& solids, bool with_stiffness);
  double addSheetPair(const Eigen::Matrix3Xd& x, const SheetCandidates::Pair& pair, bool with_stiffness);
  double addSheetOnSolid(const Eigen::Matrix3Xd& x, const SheetCandidates::OnSolid& on, const std::vector<Pose>& poses,
                         bool with_stiffness);
  /// Sets the place of a contact in the frame of the body that carries the first piece. Friction needs it.
  void setOwn(Contact& contact, const std::vector<Pose>& poses) const
  {
    if (const int carrier = surface.objects[contact.object].carrier; carrier >= 0)
      contact.own = poses[carrier].inverse() * contact.position;
  }
  /// `scale`: of the gap at which the pair repels.
  double addContact(const Eigen::Matrix3Xd& x, const PairGap& gap, Contact& contact, double scale, bool with_stiffness);
  void setTurns(const Eigen::Matrix3Xd& x, Contact& contact) const;
  void listSegments();
  /// Appends a term of a contact, without its force.
  ContactTerm& addTerm(const Contact& contact);
  void addMotion(const PairGap& gap, const Contact& contact, double force, double own);
  /// Share of the gap at which an object and a solid repel each other.
  double rangeOf(int object, int solid) const
  {
    const auto& ranges = surface.solids[solid].ranges;
    const auto at = std::lower_bound(ranges.begin(), ranges.end(), object,
                                     [](const auto& range, int wanted) { return range.first < wanted; });
    return at == ranges.end() || at->first != object ? 1.0 : at->second;
  }
  double frictionOf(const Contact& contact) const;
  double stiffnessOf(const Contact& contact) const;
  FrictionSpring springOf(const Contact& contact) const;
  bool turnsWithSolid(const Contact& contact) const;
  double spin(const Contact& contact, const std::vector<Pose>& poses) const;
  double addFriction(const Eigen::Matrix3Xd& x, const std::vector<Pose>& poses, const Eigen::VectorXd* turns,
                     bool with_stiffness);
  double addFriction(const Eigen::Matrix3Xd& x, const std::vector<Pose>& poses, const Eigen::VectorXd* turns,
                     Contact& contact, bool with_stiffness);
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
  bool thinSheetsToFit(const Eigen::Matrix3Xd& x, const std::vector<Pose>& solids);
  static double thinned(const std::vector<Thinned>& list, const std::array<int, 3>& key, double thickness);
  /// Share of thickness and gap that a pair of segments keeps, see contactShare().
  double scaleOf(const ContactSegment& a, const ContactSegment& b) const
  {
    return a.object == b.object ? contactShare(a, b, surface.objects[a.object], options.gap) : 1.0;
  }
  static double fullThickness(const ContactSegment& a, const ContactSegment& b, double scale)
  {
    return scale * (a.coreRadius() + b.coreRadius());
  }
  /// Distances of centrelines [m] at which pairs touch.
  double thicknessOf(const GridPairs::Pair& pair, double scale) const
  {
    const double full = fullThickness(surface.segments[pair.first], surface.segments[pair.second], scale);
    return thin_pairs_.empty() ? full : thinned(thin_pairs_, {pair.first, pair.second, 0}, full);
  }
  double thicknessOf(const Candidates::OnSolid& on) const
  {
    const double full = surface.segments[on.segment].radius;
    return thin_on_solids_.empty() ? full : thinned(thin_on_solids_, {on.solid, on.segment, on.piece}, full);
  }
  bool passes(const Candidates::OnSolid& on) const { return held_.letPass(on.solid, false, on.segment); }
  bool passes(const SheetCandidates::OnSolid& on) const
  {
    return on.face.driven != 0 && !surface.solids[on.solid].body && held_.letPass(on.solid, true, on.face.index);
  }
  static std::array<int, 3> keyOf(const SheetCandidates::Pair& pair) { return {pair.edges, pair.first, pair.second}; }
  static std::array<int, 3> keyOf(const SheetCandidates::OnSolid& on)
  {
    return {3 * on.solid + on.face.corners - 1, on.face.index, on.piece};
  }
  double thicknessOf(const SheetCandidates::Pair& pair) const
  {
    return thin_sheets_.empty() ? pair.thickness : thinned(thin_sheets_, keyOf(pair), pair.thickness);
  }
  double thicknessOf(const SheetCandidates::OnSolid& on) const
  {
    return thin_sheets_on_solids_.empty() ? on.face.radius : thinned(thin_sheets_on_solids_, keyOf(on), on.face.radius);
  }
  double sheetsLimit(const Candidates& candidates, const Eigen::Matrix3Xd& x, const Eigen::Matrix3Xd& x_end,
                     const std::vector<Pose>& solids, const std::vector<Pose>& solids_end) const;
  double sheetClearance(const Eigen::Matrix3Xd& x, const std::vector<Pose>& solids, double least);

  std::vector<Thinned> thin_pairs_, thin_on_solids_, thin_sheets_, thin_sheets_on_solids_;   ///< sorted
  std::vector<Contact> rubbing_;                                                             ///< for lagFriction()
  std::vector<PredictedForce> predicted_;   ///< if friction follows: one per contact, in their order
  int follows_left_ = 0;                    ///< how often friction may still follow before the next begin()
  /// The change that lagFriction() without prediction returned last, and the share of the change of each force that
  /// the next call takes over.
  double last_change_ = kInfinity, relaxation_ = 1.0;
  double shift_ = 0.0;   ///< constant of the potential, see followFriction() [J]
  Candidates near_, swept_;
  SheetPieces sheets_;
  HeldPieces held_;
  std::vector<Displacements> displacements_;   ///< per object, see movedFar()
  std::vector<int> segment_of_point_;          ///< begins at a point, or ends there if none begins; -1: none
  double margin_;
  std::vector<int> order_;   ///< for clearance()
  std::vector<BoundingBox> boxes_;
};

}   // namespace slender
