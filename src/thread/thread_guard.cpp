#include "thread_guard.h"

#include <algorithm>
#include <cmath>

#include "contact/soft_gap.h"
#include "slender_sim/contact/ccd.h"
#include "slender_sim/contact/distance.h"

namespace slender {

bool ThreadGuard::allows(const ThreadState& state, int first, int last, const Eigen::Vector3d& from,
                         const Eigen::Vector3d& to) const
{
  const MovingPoint node{from, to}, a{state.x[first], state.x[first]}, b{state.x[last + 1], state.x[last + 1]};
  const double reach_a = std::max((from - a.from).norm(), (to - a.from).norm()),
               reach_b = std::max((from - b.from).norm(), (to - b.from).norm());
  const double radius = std::max(state.radius(first), state.radius(last));
  const auto isFree = [&](const Eigen::Vector3d& p, const Eigen::Vector3d& q, double r, double core) {
    const double thickness = core * radius + core * r;
    if ((p - from).norm() > thickness + gap_ + 2.0 * std::max(reach_a, reach_b) + (q - p).norm())
      return true;
    const MovingPoint s{p, p}, t{q, q};
    const auto side = [&](const MovingPoint& end) {
      ApproachLimit limit;
      limit.thickness = std::min(thickness, 0.99 * segmentDistance(end.from, node.from, p, q));
      limit.reach = gap_;
      return segmentsLimit(end, node, s, t, limit) >= 1.0;
    };
    return side(a) && side(b);
  };
  const auto isOutside = [&](const ConvexPiece& piece, const Pose& pose, double reach, double r) {
    if ((pose.position - from).norm() > reach + radius + r + gap_ + 2.0 * std::max(reach_a, reach_b))
      return true;
    // Contact presses apart what overlaps. The centreline must stay outside.
    constexpr double kCore = 0.5;
    const RigidMotion rest(pose, pose);
    const Pose to_piece = pose.inverse();
    ApproachLimit limit;
    limit.thickness = kCore * (radius + r);
    for (const MovingPoint& end : {a, b})
      limit.thickness = std::min(
          limit.thickness, 0.99 * segmentPieceDistance(piece, to_piece * end.from, to_piece * node.from).distance);
    limit.reach = gap_;
    return segmentSolidLimit(a, node, piece, rest, limit) >= 1.0 &&
           segmentSolidLimit(b, node, piece, rest, limit) >= 1.0;
  };
  const Strand* strand = strandOf(state);
  return !strand || (forOthers(state, first, last, isFree) && forFaces(strand->contact, isOutside));
}

bool ThreadGuard::hasRoom(const ThreadState& state, const Edge& edge, const Room& room) const
{
  // distance(from, to): to what the edge may touch, whose thickness is counted by `core`
  const auto leaves = [&](double share, double thickness, double core, const auto& distance) {
    const auto clear = [&](const Eigen::Vector3d& from, const Eigen::Vector3d& to, double radius) {
      return distance(from, to) / (core * (radius + thickness));
    };
    double needed = share;
    for (int j = edge.first; j <= edge.last; ++j)
      needed = std::min(needed, clear(state.x[j], state.x[j + 1], state.radius(j)));
    return clear(edge.from, edge.to, edge.radius) >= needed;
  };
  const auto fromOthers = [&](const Eigen::Vector3d& p, const Eigen::Vector3d& q, double r, double core) {
    return leaves(room.others, r, core, [&](const Eigen::Vector3d& from, const Eigen::Vector3d& to) {
      return segmentDistance(from, to, p, q);
    });
  };
  const Eigen::Vector3d middle = 0.5 * (edge.from + edge.to);
  const double half = 0.5 * (edge.to - edge.from).norm();
  const auto fromSolids = [&](const ConvexPiece& piece, const Pose& pose, double reach, double thickness) {
    if ((pose.position - middle).norm() > reach + half + edge.radius + thickness)
      return true;
    const Pose to_piece = pose.inverse();
    return leaves(room.solids, thickness, 1.0, [&](const Eigen::Vector3d& from, const Eigen::Vector3d& to) {
      return segmentPieceDistance(piece, to_piece * from, to_piece * to).distance;
    });
  };
  const Strand* strand = strandOf(state);
  return !strand || (forOthers(state, edge.first, edge.last, fromOthers) && forFaces(strand->contact, fromSolids));
}

const ThreadGuard::Strand* ThreadGuard::strandOf(const ThreadState& state) const
{
  const auto at = std::find_if(strands_.begin(), strands_.end(), [&](const Strand& s) { return s.state == &state; });
  return at == strands_.end() ? nullptr : &*at;
}

template <class F>
bool ThreadGuard::forRods(F&& f) const
{
  const ContactPotential* contact = equations_ ? equations_->contact() : nullptr;
  if (!contact)
    return true;
  const ContactSurface& surface = contact->surface();
  const Eigen::Matrix3Xd& x = equations_->startPoints();
  for (const ContactSegment& s : surface.segments)
    if (const ContactObject& object = surface.objects[s.object];
        object.owner < 0 && object.others && !f(x.col(s.a), x.col(s.b), s.radius, 1.0))
      return false;
  return true;
}

template <class F>
bool ThreadGuard::forFaces(const ContactProperties& own, F&& f) const
{
  const ContactPotential* contact = equations_ ? equations_->contact() : nullptr;
  if (!contact)
    return true;
  const ContactSurface& surface = contact->surface();
  const Eigen::Matrix3Xd& x = equations_->startPoints();
  for (const ContactTriangle& t : surface.triangles)
  {
    if (!own.others || !surface.objects[t.object].others)
      continue;
    const Pose corner{x.col(t.corner[0]), Eigen::Quaterniond::Identity()};
    const Triangle face{Eigen::Vector3d::Zero(), x.col(t.corner[1]) - corner.position,
                        x.col(t.corner[2]) - corner.position};
    if (!f(face, corner, std::max(face[1].norm(), face[2].norm()), t.half_thickness))
      return false;
  }
  return !own.solids || forSolids(f);
}

template <class F>
bool ThreadGuard::forSolids(F&& f) const
{
  const std::vector<ContactSolid>& solids = equations_->contact()->surface().solids;
  for (std::size_t k = 0; k < solids.size(); ++k)
  {
    if (solids[k].only >= 0)   // the floor of a thread: flat, so that its mesh stays above
      continue;
    const Pose& pose = equations_->startSolids()[k];
    const double reach = boundingRadius(solids[k].shape);
    const bool passed = std::visit(
        [&](const auto& shape) {
          if constexpr (!std::is_same_v<std::decay_t<decltype(shape)>, std::shared_ptr<const TriangleMesh>>)
            return f(shape, pose, reach, 0.0);
          else
          {
            for (Eigen::Index i = 0; i < shape->triangles.cols(); ++i)
            {
              const auto corner = [&](int c) { return Eigen::Vector3d(shape->vertices.col(shape->triangles(c, i))); };
              const Pose at{pose * corner(0), pose.orientation};
              const Triangle face{Eigen::Vector3d::Zero(), corner(1) - corner(0), corner(2) - corner(0)};
              if (!f(face, at, std::max(face[1].norm(), face[2].norm()), 0.0))
                return false;
            }
            return true;
          }
        },
        solids[k].shape);
    if (!passed)
      return false;
  }
  return true;
}

template <class F>
bool ThreadGuard::forOthers(const ThreadState& state, int first, int last, F&& f) const
{
  const double radius = std::max(state.radius(first), state.radius(last));
  const Strand* strand_of_state = strandOf(state);
  if (!strand_of_state)
    return true;
  const ContactProperties& own = strand_of_state->contact;
  const double core = strand_of_state->merging > 0.0 ? strand_of_state->merging : 1.0;
  const auto meets = [&](const ThreadState& other, int j, double share = 1.0) {
    return share == 0.0 || f(other.x[j], other.x[j + 1], other.radius(j), share * core);
  };
  if (own.others && !forRods(f))
    return false;
  for (const Strand& strand : strands_)
    if (strand.state != &state && own.others && strand.contact.others)
      for (int j = 0; j < strand.state->edges(); ++j)
        if (!meets(*strand.state, j))
          return false;
  if (!own.self)
    return true;
  const auto meetsItself = [&](double along, int j) {
    return meets(state, j, contactShare(along, radius + state.radius(j), gap_));
  };
  double along = 0.0;
  for (int j = first - 1; j >= 0; along += state.edge(j--).norm())
    if (!meetsItself(along, j))
      return false;
  along = 0.0;
  for (int j = last + 1; j < state.edges(); along += state.edge(j++).norm())
    if (!meetsItself(along, j))
      return false;
  return true;
}

}   // namespace slender
