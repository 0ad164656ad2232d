// Friction of ContactPotential: normal forces of an earlier configuration, and springs that last from step to step.
#include <algorithm>
#include <cmath>
#include <numeric>
#include <tuple>

#include "contact_potential.h"
#include "slender_sim/contact/friction.h"
#include "slender_sim/geometry/rotation.h"

namespace slender {

namespace {

/// Returns the stretch of a spring that exerts `tension`, which was across another normal, turned across n. `most`: the
/// largest force [N].
Eigen::Vector3d stretchOf(const Eigen::Vector3d& tension, const Eigen::Vector3d& n, double most,
                          const SmoothedCoulomb& law)
{
  constexpr double kMostTurn = 0.5;   // share that has to be left across n; less is another contact
  const Eigen::Vector3d left = across(n, tension);
  const double size = left.norm(), whole = tension.norm();
  if (!(size > 0.0))
    return Eigen::Vector3d::Zero();
  const double force = size > kMostTurn * whole ? whole : size;
  return law.stretchAt(std::min(1.0, force / most)) / size * left;
}

/// Returns the angle by which a solid turns between two poses about an axis of length 1 [rad].
double turnAbout(const Eigen::Vector3d& axis, const Pose& from, const Pose& to)
{
  if (to.orientation.coeffs() == from.orientation.coeffs())
    return 0.0;
  return axis.dot(rotationVector(to.orientation * from.orientation.conjugate()));
}

/// The order of contacts.
template <class A, class B>
bool comesBefore(const A& a, const B& b)
{
  return a.first != b.first ? a.first < b.first : a.second < b.second;
}

}   // namespace

bool operator<(const FrictionSpring& a, const FrictionSpring& b)
{
  const auto key = [](const FrictionSpring& s) { return std::tie(s.object, s.other, s.solid, s.piece, s.point); };
  return key(a) < key(b);
}

double ContactPotential::frictionOf(const Contact& contact) const
{
  const double own = surface_.objects[contact.object].friction;
  const double other =
      contact.solid >= 0 ? surface_.solids[contact.solid].friction : surface_.objects[contact.other].friction;
  return own > 0.0 && other >= 0.0 ? std::sqrt(own * other) : own;
}

/// Returns how far a solid has moved since the step began where it is touched [m]. `place` moves with its material, in
/// its frame. From there, `round` leads to the contact: what rolls turns its material away below the contact, and the
/// contact stays below its centre. The path of the material is then an arc, and not the chord of this arc.
Eigen::Vector3d ContactPotential::displacement(int solid, const Eigen::Vector3d& place, const Eigen::Vector3d& round,
                                               const std::vector<Pose>& poses) const
{
  const Pose &from = solids_begin_[solid], &to = poses[solid];
  Eigen::Vector3d u = to * place - from * place;
  if (!round.isZero(0.0) && to.orientation.coeffs() != from.orientation.coeffs())
    u += rotationVector(to.orientation * from.orientation.conjugate()).cross(round);
  return u;
}

void ContactPotential::setPlaces(const std::vector<Pose>& poses, const Eigen::Vector3d& normal, Contact& contact) const
{
  const auto split = [&](int solid, const ConvexPiece& piece, Eigen::Vector3d& place, Eigen::Vector3d& round) {
    const Eigen::Quaterniond& turn = poses[solid].orientation;
    const Eigen::Vector3d part = roundPart(piece, place, turn.conjugate() * normal);
    place -= part;
    round = turn * part;
  };
  contact.position = poses[contact.solid] * contact.material;
  if (const int carrier = surface_.objects[contact.object].carrier; carrier >= 0)
  {
    contact.own = poses[carrier].inverse() * contact.position;
    split(carrier, solids_[carrier].pieces.front(), contact.own, contact.own_round);
  }
  const auto piece = static_cast<std::size_t>(contact.second & 0xffffffff);
  split(contact.solid, solids_[contact.solid].pieces[piece], contact.material, contact.round);
}

double ContactPotential::addFriction(const Place& place, const Eigen::VectorXd* turns, Contact& contact,
                                     Batch& out) const
{
  const std::vector<Pose>& poses = place.poses;
  const double normal_force = contact.force.norm(), most = contact.friction * normal_force;
  if (!(most > 0.0))
  {
    contact.tension.setZero();
    return 0.0;
  }
  ContactTerm& term = addTerm(contact, out);
  Eigen::Vector3d u = Eigen::Vector3d::Zero();
  const int carrier = surface_.objects[contact.object].carrier;
  term.carried = carrier >= 0;
  if (term.carried)
    u = displacement(carrier, contact.own, contact.own_round, poses);
  const Eigen::Vector3d n = contact.force / normal_force;
  if (contact.levers)
  {
    term.normal = n;
    copyFour(term.lever, contact.lever);
  }
  for (int i = 0; i < 4 && !term.carried; ++i)
    if (contact.point[i] >= 0)
      u += term.moveBy(i, place.x.col(contact.point[i]) - x_begin_.col(contact.point[i]));
  if (contact.solid >= 0)
  {
    term.position = poses[contact.solid] * contact.material + contact.round;
    u -= displacement(contact.solid, contact.material, contact.round, poses);
  }
  term.turn = contact.turn;
  for (const ContactTerm::Turn& turn : contact.turn)
    if (turns && turn.point >= 0)
      u += (*turns)[turn.point] * turn.column;
  const SmoothedCoulomb law{options_.slip_speed * h_};
  Eigen::Vector3d tension = contact.tension_begin;
  if (const double angle = turnsWithSolid(contact) ? spin(contact, poses) : 0.0; angle != 0.0)
    tension = Eigen::AngleAxisd(angle, n) * tension;
  const Eigen::Vector3d slip = stretchOf(tension, n, most, law) + across(n, u);
  const double y = slip.norm(), over_slip = law.forceOverSlip(y);
  contact.tension = most * over_slip * slip;
  term.force = -contact.tension;
  term.slip_range = y < law.e ? law.e : 0.0;
  if (place.with_stiffness)
  {
    // Where a contact slips, the tangent along the slip is zero: Newton's method may jump across the narrow range in
    // which it sticks, from slip in one direction to slip in the other, without end. So the direction of the force is
    // an unknown of its own, which follows from the linear equations: the stiffness along the slip is then that which
    // stops a contact at the force it needs [Chan, Golub, Mulet, A nonlinear primal-dual method for total
    // variation-based image restoration, SIAM J. Sci. Comput. 20, 1999]. It is never longer than 1, hence the stiffness
    // semidefinite.
    Eigen::Matrix3d unit = over_slip * (Eigen::Matrix3d::Identity() - n * n.transpose());
    if (y > 0.0)
    {
      const Eigen::Vector3d along = slip / y;
      Eigen::Vector3d direction = along;
      if (y > law.e && contact.has_iterate)
      {
        direction = contact.last_force + contact.last_stiffness * (slip - contact.last_slip);
        direction -= n.dot(direction) * n;
        direction /= std::max(1.0, direction.norm());
      }
      const Eigen::Matrix3d both = direction * along.transpose();
      unit += 0.5 * (law.slope(y) - over_slip) * (both + both.transpose());
    }
    contact.has_iterate = true;
    contact.last_slip = slip;
    contact.last_force = over_slip * slip;
    contact.last_stiffness = unit;
    term.stiffness = most * unit;
  }
  return most * law.energy(y);
}

void ContactPotential::beginFollowing()
{
  constexpr int kMostFollows = 20;   // Contacts that alternately stick and slip would follow without end.
  following_ = false;
  follows_left_ = kMostFollows;
  last_change_ = kInfinity;
  relaxation_ = 1.0;
}

void ContactPotential::followFriction(const std::vector<Eigen::Vector3d>& moves)
{
  constexpr double kFar = 3.0;   // smallest gaps: the change of a force is not linear over such distances
  following_ = true;
  predicted_.clear();
  // The normal terms come first, in the order of the contacts.
  for (std::size_t k = 0; k < found_.contacts.size(); ++k)
  {
    const Contact& c = found_.contacts[k];
    const double size = c.force.norm(), change = -c.force.normalized().dot(found_.terms[k].stiffness * moves[k]);
    predicted_.push_back({c.first, c.second, std::max(0.0, size + change), moves[k].norm() >= kFar * smallest_gap_});
  }
}

/// Adds the friction of all contacts. Its normal forces are those of an earlier configuration or, if friction follows,
/// predicted ones.
double ContactPotential::addFriction(const Place& place, const Eigen::VectorXd* turns)
{
  if (!following_ || !place.with_stiffness || follows_left_ == 0)
    return addTerms(place, turns) + shift_;
  const std::size_t others = found_.terms.size();
  const double before = addTerms({place.x, place.poses, false}, turns) + shift_;
  found_.terms.resize(others);
  if (lagFriction(kLagTolerance, true) > kLagTolerance)
    --follows_left_;
  shift_ = before - addTerms(place, turns);
  return before;
}

/// Adds the terms of friction of all contacts. Returns their energy [J].
double ContactPotential::addTerms(const Place& place, const Eigen::VectorXd* turns)
{
  rubbed_.assign(lagged_.size(), 0.0);
  inBatches(static_cast<int>(lagged_.size()), [&](int first, int last, Batch& out) {
    for (int k = first; k < last; ++k)
      rubbed_[k] = addFriction(place, turns, lagged_[k], out);
  });
  return frictionEnergy();
}

/// Does not take the new forces over if they have changed by less than `least`. `predicted`: instead of present normal
/// forces it takes the predicted ones of the same contacts. A contact whose force has not changed noticeably keeps its
/// friction and where this acts, so that what has settled stays in balance.
double ContactPotential::lagFriction(double least, bool predicted)
{
  const double largest = findLargestForces();
  auto old = lagged_.begin();
  auto before = predicted_.begin();
  rubbing_.clear();
  const auto isOld = [&](const Contact& contact) {
    for (; old != lagged_.end() && comesBefore(*old, contact); ++old)
      addChange(*old, old->force.norm());
    return old != lagged_.end() && !comesBefore(contact, *old);
  };
  for (const Contact& present : found_.contacts)
  {
    if (!(frictionOf(present) > 0.0))
      continue;
    if (predicted)
    {
      before = std::find_if(before, predicted_.end(), [&](const auto& p) { return !comesBefore(p, present); });
      if (before == predicted_.end() || comesBefore(present, *before))
        continue;
    }
    Contact contact = present;
    contact.friction = frictionOf(present);
    if (predicted)
      contact.force = before->size * present.force.normalized();
    const bool same = isOld(present);
    const double change = same ? (contact.force - old->force).norm() : contact.force.norm();
    if (same && ((predicted && before->far) || !isNoticeable(contact, change)))
    {
      rubbing_.push_back(*old++);
      continue;
    }
    if (predicted && before->far)
      continue;
    addChange(contact, change);
    same ? keepHistory(contact, *old++, predicted) : findSpring(contact);
    if (!same || !predicted)
      setLevers(contact);
    rubbing_.push_back(contact);
  }
  for (; old != lagged_.end(); ++old)
    addChange(*old, old->force.norm());
  const double share = largest > 0.0 ? largest_change_ / largest : 0.0;
  shift_ = 0.0;
  if (!predicted)
    relax(share);
  if (share >= least)
    lagged_.swap(rubbing_);
  else
    points_of_changes_.clear();
  return share;
}

/// Finds the largest normal force that rubs on each object, now or as friction has it. Returns the largest of all.
double ContactPotential::findLargestForces()
{
  double largest = 0.0;
  largest_change_ = 0.0;
  points_of_changes_.clear();
  largest_forces_.assign(surface_.objects.size(), 0.0);
  for (const auto* list : {&lagged_, &found_.contacts})
    for (const Contact& contact : *list)
      for (const int object : {contact.object, contact.other})
        if (object >= 0 && frictionOf(contact) > 0.0)
        {
          largest_forces_[object] = std::max(largest_forces_[object], contact.force.norm());
          largest = std::max(largest, largest_forces_[object]);
        }
  return largest;
}

/// Returns whether a change of a contact's normal force counts beside the forces on the objects that touch.
bool ContactPotential::isNoticeable(const Contact& contact, double change) const
{
  const double of_other = contact.other >= 0 ? largest_forces_[contact.other] : 0.0;
  return change > kLagTolerance * std::max(largest_forces_[contact.object], of_other);
}

void ContactPotential::addChange(const Contact& contact, double change)
{
  largest_change_ = std::max(largest_change_, change);
  if (isNoticeable(contact, change))
    points_of_changes_.push_back(contact.point[0]);
}

/// A contact that had friction before, `old`, keeps its history. `predicted`: see lagFriction().
void ContactPotential::keepHistory(Contact& contact, const Contact& old, bool predicted) const
{
  if (predicted)
  {
    // It stays where it was. If the material points that touch were taken from an iterate, they would have moved
    // apart by the end of the step, and what turns with a solid would creep.
    const Eigen::Vector3d force = contact.force;
    contact = old;
    contact.force = force;
    return;
  }
  contact.force = old.force + relaxation_ * (contact.force - old.force);
  contact.has_iterate = old.has_iterate;
  contact.last_slip = old.last_slip;
  contact.last_force = old.last_force;
  contact.last_stiffness = old.last_stiffness;
  contact.tension_begin = old.tension_begin;
  contact.tension = old.tension;
}

/// A contact that is new takes the tension of its spring, if it has one.
void ContactPotential::findSpring(Contact& contact) const
{
  if (springs_.empty())
    return;
  const FrictionSpring wanted = springOf(contact);
  const auto spring = std::lower_bound(springs_.begin(), springs_.end(), wanted);
  if (spring != springs_.end() && !(wanted < *spring))
    contact.tension = contact.tension_begin = spring->tension;
}

/// Solutions with lagged friction may alternate between two states. If the change of the forces hardly becomes smaller,
/// friction takes over only a part of it from then on.
void ContactPotential::relax(double change)
{
  constexpr double kHardly = 0.7;   // of the change before; where forces alternate, it stays near 1
  constexpr double kLeast = 0.25;
  if (change > kHardly * last_change_)
    relaxation_ = std::max(kLeast, 0.5 * relaxation_);
  last_change_ = change;
}

/// The spring of a contact, without its tension.
FrictionSpring ContactPotential::springOf(const Contact& contact) const
{
  FrictionSpring spring;
  spring.object = contact.object;
  spring.other = contact.other;
  spring.solid = contact.solid;
  if (contact.solid >= 0)
    spring.piece = static_cast<int>(contact.second & 0xffffffff);
  else if (contact.first_points == 1)
    spring.piece = 1;   // A point and a triangle may have the numbers of two edges.
  const auto [first, second] = std::minmax({surface_.objects[contact.object].first_point,
                                            surface_.objects[std::max(contact.object, contact.other)].first_point});
  for (int k = 0; k < 4; ++k)
    if (const int point = contact.point[k]; point >= 0)
      spring.point[k] = point - (point < second ? first : second);
  return spring;
}

/// Springs turn with a solid that moves as prescribed while the step is solved, and with bodies when it has ended.
bool ContactPotential::turnsWithSolid(const Contact& contact) const
{
  return contact.solid >= 0 && !surface_.solids[contact.solid].body;
}

/// The angle by which a prescribed solid has turned about the normal since the step began [rad]; else the mean angle of
/// the bodies that touch.
double ContactPotential::spin(const Contact& contact, const std::vector<Pose>& poses) const
{
  const Eigen::Vector3d normal = contact.force.normalized();
  double sum = 0.0;
  int count = 0;
  const int carrier = turnsWithSolid(contact) ? -1 : surface_.objects[contact.object].carrier;
  for (const int solid : {contact.solid, carrier})
    if (solid >= 0)
    {
      sum += turnAbout(normal, solids_begin_[solid], poses[solid]);
      ++count;
    }
  return count > 0 ? sum / count : 0.0;
}

void ContactPotential::keepSprings(const std::vector<Pose>& poses)
{
  springs_.clear();
  for (const Contact& contact : lagged_)
  {
    if (!(contact.tension.squaredNorm() > 0.0) || isStrand(contact.object) || isStrand(contact.other))
      continue;
    springs_.push_back(springOf(contact));
    springs_.back().tension = contact.tension;
    if (!turnsWithSolid(contact))
      springs_.back().tension = Eigen::AngleAxisd(spin(contact, poses), contact.force.normalized()) * contact.tension;
  }
  std::sort(springs_.begin(), springs_.end());
}

}   // namespace slender
