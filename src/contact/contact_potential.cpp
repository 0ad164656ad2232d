#include <algorithm>
#include <cmath>
#include <limits>
#include <stdexcept>
#include <string>

#include "contact_potential.h"
#include "slender_sim/contact/distance.h"

namespace slender {

namespace {

[[noreturn]] void refuse(const std::string& why) { throw std::invalid_argument("contact: " + why); }

void checkTriangle(const ContactSurface& surface, std::size_t number)
{
  const ContactTriangle& t = surface.triangles[number];
  const auto refuseThis = [&](const std::string& why) { refuse("triangle " + std::to_string(number) + why); };
  if (!(t.object >= 0 && t.object < static_cast<int>(surface.objects.size())))
    refuseThis(" names an object that does not exist");
  const ContactObject& object = surface.objects[t.object];
  for (int k = 0; k < 3; ++k)
  {
    const int i = t.corner[k];
    if (!(i >= 0 && i < surface.points && i != t.corner[(k + 1) % 3]))
      refuseThis(" names points outside 0 ... " + std::to_string(surface.points - 1) + " or one point twice");
    if (object.rest && !(i >= object.first_point && i - object.first_point < object.rest->cols()))
      refuseThis(" names a point of which the rest position is not known");
  }
  if (!(t.half_thickness > 0.0 && std::isfinite(t.half_thickness)))
    refuseThis(": half the thickness is " + std::to_string(t.half_thickness) + " m; must be positive");
}

void checkSurface(const ContactSurface& surface, const ContactOptions& options)
{
  if (!(options.gap > 0.0 && std::isfinite(options.gap)))
    refuse("gap is " + std::to_string(options.gap) + " m; must be positive");
  if (!(options.slip_speed > 0.0))
    refuse("slip_speed is " + std::to_string(options.slip_speed) + " m/s; must be positive");
  if (!(options.least_stiffness > 0.0))
    refuse("least_stiffness is " + std::to_string(options.least_stiffness) + " N; must be positive");
  for (std::size_t i = 0; i < surface.segments.size(); ++i)
  {
    const ContactSegment& s = surface.segments[i];
    const auto refuseThis = [&](const std::string& why) { refuse("segment " + std::to_string(i) + why); };
    if (!(s.a >= 0 && s.a < surface.points && s.b >= 0 && s.b < surface.points && s.a != s.b))
      refuseThis(" names points outside 0 ... " + std::to_string(surface.points - 1) + " or one point twice");
    if (!(s.object >= 0 && s.object < static_cast<int>(surface.objects.size())))
      refuseThis(" names an object that does not exist");
    if (!(s.radius > 0.0 && std::isfinite(s.radius)))
      refuseThis(": radius is " + std::to_string(s.radius) + " m; must be positive");
    if (!(s.length >= 0.0))
      refuseThis(": length is " + std::to_string(s.length) + " m; must not be negative");
  }
  for (std::size_t i = 0; i < surface.triangles.size(); ++i)
    checkTriangle(surface, i);
  for (std::size_t i = 0; i < surface.objects.size(); ++i)
    if (!(surface.objects[i].friction >= 0.0))
      refuse("object " + std::to_string(i) + ": friction is negative");
  for (const ContactSolid& solid : surface.solids)
    checkShape(solid.shape);
}

}   // namespace

ContactPotential::ContactPotential(ContactSurface s, const ContactOptions& o)
  : surface_((checkSurface(s, o), std::move(s))),
    options_(o),
    barrier_(o.gap),
    stiffness_(surface_.objects.size()),
    margin_(o.gap)
{
  sheets_.build(surface_);
  held_.build(surface_);
  listSegments();
  for (BarrierStiffness& own : stiffness_)
    own.set({}, {options_.least_stiffness, kInfinity});
  solids_.resize(surface_.solids.size());
  for (std::size_t k = 0; k < solids_.size(); ++k)
  {
    solids_[k].reach = boundingRadius(surface_.solids[k].shape);
    std::visit(
        [&](const auto& shape) {
          using T = std::decay_t<decltype(shape)>;
          if constexpr (std::is_same_v<T, std::shared_ptr<const TriangleMesh>>)
          {
            for (Eigen::Index i = 0; i < shape->triangles.cols(); ++i)
              solids_[k].pieces.push_back(Triangle{shape->vertices.col(shape->triangles(0, i)),
                                                   shape->vertices.col(shape->triangles(1, i)),
                                                   shape->vertices.col(shape->triangles(2, i))});
            solids_[k].tree.emplace_back(*shape);
            solids_[k].middle = shape->vertices.rowwise().mean();
            solids_[k].ball = ballInMesh(*shape, solids_[k].middle);
          }
          else
          {
            solids_[k].pieces.push_back(shape);
            solids_[k].ball = std::is_same_v<T, Plane> ? 0.0 : innerRadius(shape);
          }
        },
        surface_.solids[k].shape);
  }
}

void ContactPotential::setPieces(const ContactSurface& pieces)
{
  surface_.points = pieces.points;
  surface_.segments = pieces.segments;
  surface_.triangles = pieces.triangles;
  surface_.objects = pieces.objects;
  stiffness_.resize(surface_.objects.size());
  sheets_.build(surface_);
  held_.build(surface_);
  listSegments();
  lagged_.clear();
  found_.clear();
  near_.clear();
  swept_.clear();
  for (auto* list : {&thin_pairs_, &thin_on_solids_, &thin_sheets_})
    list->clear();
}

void ContactPotential::listSegments()
{
  margins_.assign(static_cast<std::size_t>(surface_.points), margin_);
  segment_of_point_.assign(static_cast<std::size_t>(surface_.points), -1);
  for (std::size_t k = surface_.segments.size(); k-- > 0;)
    segment_of_point_[surface_.segments[k].b] = static_cast<int>(k);
  for (std::size_t k = 0; k < surface_.segments.size(); ++k)
    segment_of_point_[surface_.segments[k].a] = static_cast<int>(k);
}

void ContactPotential::letPass(const Eigen::Matrix3Xd& x, const std::vector<Pose>& solids,
                               const Eigen::Matrix3Xd& x_end, const std::vector<Pose>& solids_end)
{
  check(x, solids);
  check(x_end, solids_end);
  held_.update(surface_, solids_, {x, x_end, solids, solids_end}, options_.gap);
}

void ContactPotential::check(const Eigen::Matrix3Xd& x, const std::vector<Pose>& poses) const
{
  if (x.cols() != surface_.points || poses.size() != surface_.solids.size())
    throw std::invalid_argument("contact: " + std::to_string(x.cols()) + " points and " + std::to_string(poses.size()) +
                                " poses; needs " + std::to_string(surface_.points) + " and " +
                                std::to_string(surface_.solids.size()));
}

void ContactPotential::Batch::clear()
{
  contacts.clear();
  measures.clear();
  terms.clear();
  rows.clear();
  near.clear();
  meet = false;
}

void ContactPotential::Batch::append(const Batch& other)
{
  contacts.insert(contacts.end(), other.contacts.begin(), other.contacts.end());
  measures.insert(measures.end(), other.measures.begin(), other.measures.end());
  terms.insert(terms.end(), other.terms.begin(), other.terms.end());
  rows.insert(rows.end(), other.rows.begin(), other.rows.end());
  near.insert(near.end(), other.near.begin(), other.near.end());
  meet = meet || other.meet;
}

double ContactPotential::restart()
{
  found_.clear();
  smallest_gap_ = kInfinity;
  for (BarrierStiffness& own : stiffness_)
    own.restart();
  return kInfinity;
}

double ContactPotential::evaluate(const Eigen::Matrix3Xd& x, const std::vector<Pose>& poses, bool with_stiffness,
                                  const Eigen::VectorXd* turns)
{
  check(x, poses);
  restart();
  points_of_changes_.clear();
  if (!x.allFinite())
    return kInfinity;
  x_now_ = x;
  const SurfaceMotion standing{x, x, poses, poses};
  if (!near_.holdsFor(x, poses) && !near_.follow(surface_, solids_, standing, rangeOfCandidates()))
    near_.build(surface_, sheets_, solids_, standing, rangeOfCandidates());
  const Place place{x, poses, with_stiffness};
  inBatches(count(near_), [&](int first, int last, Batch& out) {
    for (int k = first; k < last && !out.meet; ++k)
      visit(near_, k, [&](const auto& candidate) { out.meet = !add(place, candidate, out); });
  });
  if (found_.meet)
    return restart();
  double energy = 0.0;
  for (std::size_t k = 0; k < found_.contacts.size(); ++k)
  {
    const Measure& m = found_.measures[k];
    energy += m.energy;
    smallest_gap_ = std::min(smallest_gap_, m.gap);
    for (const int object : {found_.contacts[k].object, found_.contacts[k].other})
      if (object >= 0)
        stiffness_[object].take(m.force, m.stiffness, m.share);
  }
  for (const Near& pair : found_.near)
    for (const int object : {pair.object, pair.other})
      if (object >= 0)
        stiffness_[object].take(0.0, 0.0, pair.share);
  return energy + addFriction(place, turns);
}

int ContactPotential::count(const Candidates& c)
{
  return static_cast<int>(c.pairs().size() + c.onSolids().size() + c.sheets().pairs().size() +
                          c.sheets().onSolids().size());
}

bool ContactPotential::add(const Place& place, const GridPairs::Pair& pair, Batch& out) const
{
  const ContactSegment &a = surface_.segments[pair.first], &b = surface_.segments[pair.second];
  const Eigen::Vector3d a0 = place.x.col(a.a), a1 = place.x.col(a.b), b0 = place.x.col(b.a), b1 = place.x.col(b.b);
  const double scale = scaleOf(a, b), thickness = thicknessOf(pair, scale), range = thickness + scale * options_.gap;
  const Eigen::Vector3d e = a1 - a0, f = b1 - b0;
  const double middles2 = 0.25 * (a0 + a1 - b0 - b1).squaredNorm();
  // half the lengths and the range, squared: (p + q + r)^2 <= 3 (p^2 + q^2 + r^2)
  if (middles2 > 0.75 * (e.squaredNorm() + f.squaredNorm()) + 3.0 * range * range ||
      segmentDistance(a0, a1, b0, b1) >= range)
    return true;
  const PairGap gap = edgesGap(a0, a1, b0, b1, thickness, place.with_stiffness);
  const double share = b.coreRadius() / (a.coreRadius() + b.coreRadius());
  Contact contact{pair.first,
                  pair.second,
                  {a.a, a.b, b.a, b.b},
                  {},
                  -1,
                  Eigen::Vector3d::Zero(),
                  b0 - gap.place[3] * f + (share * thickness + 0.5 * gap.gap / gap.weight) * gap.normal,
                  Eigen::Vector3d::Zero(),
                  a.object,
                  b.object};
  return addContact(place, gap, contact, scale, out);
}

bool ContactPotential::add(const Place& place, const Candidates::OnSolid& on, Batch& out) const
{
  if (passes(on))
    return true;
  const Pose& pose = place.poses[on.solid];
  const ContactSegment& s = surface_.segments[on.segment];
  const ConvexPiece& piece = solids_[on.solid].pieces[on.piece];
  const Eigen::Quaterniond to_solid = pose.orientation.conjugate();
  const Eigen::Vector3d a = to_solid * Eigen::Vector3d(place.x.col(s.a) - pose.position),
                        b = to_solid * Eigen::Vector3d(place.x.col(s.b) - pose.position);
  const double radius = thicknessOf(on);
  if (leastDistance(piece, a, b) > radius + options_.gap)
    return true;
  const Eigen::Vector3d ends[2] = {a, b};
  PairGap gap = facePieceGap(ends, 2, radius, piece);
  const Eigen::Vector3d foot = a + gap.place[1] * (b - a) - radius * gap.normal;   // on the segment's surface
  gap.normal = pose.orientation * gap.normal;
  // behind the pairs of segments
  Contact contact{static_cast<std::int64_t>(surface_.segments.size()) + on.solid,
                  (static_cast<std::int64_t>(on.segment) << 32) + on.piece,
                  {s.a, s.b, -1, -1},
                  {},
                  on.solid,
                  foot,
                  Eigen::Vector3d::Zero(),
                  Eigen::Vector3d::Zero(),
                  s.object,
                  -1};
  setPlaces(place.poses, gap.normal, contact);
  return addContact(place, gap, contact, rangeOf(s.object, on.solid), out);
}

bool ContactPotential::addContact(const Place& place, const PairGap& gap, Contact& contact, double scale,
                                  Batch& out) const
{
  if (!(gap.gap > 0.0))
    return false;
  if (gap.gap / scale >= options_.gap)
    return true;
  const PairBarrier pair = barrierOf(contact);
  double force = 0.0, energy = 0.0, curvature = 0.0, innermost = 0.0;
  for (int k = 0; k < pair.count; ++k)
  {
    const BarrierLayer& layer = pair.layers[static_cast<std::size_t>(k)];
    const double range = scale * layer.share, g = gap.gap / range;
    if (g >= options_.gap)
      continue;
    force += layer.stiffness * barrier_.force(g);
    energy += layer.stiffness * barrier_.energy(g) * range;
    curvature += layer.stiffness * barrier_.stiffness(g) / range;
    innermost = std::max(innermost, layer.stiffness);
  }
  const double share = gap.gap / scale / options_.gap;
  if (innermost == 0.0)
  {
    out.near.push_back({contact.object, contact.other, share});
    return true;
  }
  if (!std::isfinite(energy))
    return false;
  copyFour(contact.weight, gap.place);
  contact.force = force * gap.weight * gap.normal;
  setTurns(place.x, contact);
  ContactTerm& term = addTerm(contact, out);
  term.force = contact.force;
  if (place.with_stiffness)
  {
    const Eigen::Matrix3d normals = gap.normal * gap.normal.transpose();
    const double stiffness = curvature * gap.weight * gap.weight;
    term.stiffness = stiffness * normals;
    if (contact.solid < 0)
      term.geometric = -force * gap.weight / gap.distance * (Eigen::Matrix3d::Identity() - normals);
    addMotion(gap, contact, force, out);
  }
  out.contacts.push_back(contact);
  out.measures.push_back({energy, gap.gap, share, force * gap.weight, innermost});
  return true;
}

void ContactPotential::PairBarrier::add(const BarrierLaw& law)
{
  layers[0].share = std::max(layers[0].share, law.layers[0].share);
  layers[0].stiffness = std::max(layers[0].stiffness, law.layers[0].stiffness);
  for (int k = 1; k < law.count(); ++k)
    layers[static_cast<std::size_t>(count++)] = law.layers[static_cast<std::size_t>(k)];
}

ContactPotential::PairBarrier ContactPotential::barrierOf(const Contact& contact) const
{
  PairBarrier pair;
  pair.add(stiffness_[contact.object].law());
  if (contact.solid >= 0)
    pair.layers[0].stiffness = std::max(pair.layers[0].stiffness, surface_.solids[contact.solid].least_stiffness);
  else if (contact.other != contact.object)
    pair.add(stiffness_[contact.other].law());
  return pair;
}

ContactTerm& ContactPotential::addTerm(const Contact& contact, Batch& out)
{
  ContactTerm& term = out.terms.emplace_back();
  copyFour(term.point, contact.point);
  copyFour(term.weight, contact.weight);
  for (int k = 0; k < 2; ++k)
    term.turn[k].point = contact.turn[k].point;   // so that the matrix gets room for friction at once
  term.solid = contact.solid;
  term.position = contact.position;
  return term;
}

/// The place of contact runs along the pieces as they turn: force r^T H^-1 r of the gap, column by column of
/// H = L D L^T.
void ContactPotential::addMotion(const PairGap& gap, const Contact& contact, double force, Batch& out)
{
  const auto add = [&](const Eigen::Vector4d& along, const Eigen::Vector3d& turning, double d) {
    if (!(d > 0.0))
      return;
    ContactRow& row = out.rows.emplace_back();
    copyFour(row.point, contact.point);
    row.solid = contact.solid;
    Eigen::Map<Eigen::Vector4d>(row.along) = along;
    copyFour(row.across, contact.weight);
    row.normal = gap.normal;
    row.turning = turning;
    row.stiffness = force / d;
  };
  const PlaceMotion& m = gap.motion;
  if (m.count > 0)
    add(m.along[0], m.turn[0], m.h00);
  if (m.count > 1)
  {
    const double l = m.h01 / m.h00;
    add(m.along[1] - l * m.along[0], m.turn[1] - l * m.turn[0], m.h11 - l * m.h01);
  }
}

void ContactPotential::begin(const Eigen::Matrix3Xd& x, const std::vector<Pose>& solids, double h)
{
  lagged_.clear();
  shared_x_.resizeLike(x);   // A warm step takes no memory.
  shared_solids_.resize(solids.size());
  x_begin_ = x;
  solids_begin_ = solids;
  h_ = h;
  evaluate(x, solids, false, nullptr);
  bool changed = false;
  for (BarrierStiffness& own : stiffness_)
    changed = own.beginStep() || changed;
  if (changed)
    evaluate(x, solids, false, nullptr);
  lagFriction();
  beginFollowing();   // The first friction replaces none, so that its change does not count as alternation.
}

void ContactPotential::pushTerms(const SurfaceMotion& motion)
{
  // The terms of friction come after the normal ones and do not change, so that nothing is dragged along.
  for (std::size_t k = 0; k < found_.contacts.size(); ++k)
  {
    ContactTerm& term = found_.terms[k];
    Eigen::Vector3d towards = Eigen::Vector3d::Zero();
    if (const int solid = term.solid; solid >= 0 && !surface_.solids[solid].body)
      towards = motion.solids_end[solid] * (motion.solids[solid].inverse() * term.position) - term.position;
    for (int p = 0; p < 4; ++p)
      if (const int i = term.point[p]; i >= 0)
        towards -= term.moveBy(p, motion.x_end.col(i) - motion.x.col(i));
    if (towards.dot(term.force) > 0.0)
      term.force += term.stiffness * towards;
  }
}

void ContactPotential::setBarrier(int object, const BarrierLaw& barrier, const BarrierRange& range)
{
  for (const BarrierLayer& layer : barrier.layers)
    if (!(layer.stiffness >= 0.0 && layer.share >= 0.0 && layer.share <= 1.0) || !std::isfinite(layer.stiffness))
      throw std::invalid_argument("contact: stiffness is " + std::to_string(layer.stiffness) + " N, its share " +
                                  std::to_string(layer.share) +
                                  "; must be finite and not negative, and the share in [0, 1]");
  stiffness_[object].set(
      barrier, {std::max(range.least, options_.least_stiffness), std::max(range.most, options_.least_stiffness)});
}

void ContactPotential::setStiffness(double force)
{
  for (std::size_t object = 0; object < stiffness_.size(); ++object)
    setBarrier(static_cast<int>(object), {{{{1.0, force}, {}, {}, {}, {}}}});
}

void ContactPotential::adaptStiffness(double h)
{
  for (BarrierStiffness& own : stiffness_)
    own.adapt(barrier_, h);
}

void ContactPotential::beginSolution()
{
  following_ = false;
  for (BarrierStiffness& own : stiffness_)
    own.beginSolution();
}

bool ContactPotential::stiffen(bool converged)
{
  bool changed = false;
  for (BarrierStiffness& own : stiffness_)
    changed = own.stiffen(barrier_, converged) || changed;
  return changed;
}

}   // namespace slender
