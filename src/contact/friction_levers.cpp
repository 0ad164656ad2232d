// The levers of friction, which acts where surfaces touch and not at centrelines and middle surfaces. With them, the
// moments of friction on both pieces of a contact are opposite.
#include <algorithm>
#include <cmath>

#include "contact_potential.h"

namespace slender {

namespace {

using Vector = Eigen::Vector3d;

/// Two vectors a and b in the plane of e and f. The matrix e a^T + f b^T maps each vector of this plane to itself. If e
/// and f are nearly parallel, it does so only for vectors along them.
struct DualVectors
{
  DualVectors(const Vector& e, const Vector& f)
  {
    constexpr double kLeast = 0.04;   // square of the sine below which a and b would become too large
    const double along_e = e.norm(), along_f = f.norm();
    if (!(along_e > 0.0 && along_f > 0.0))
      return;
    const Vector s = e / along_e, t = f / along_f;
    const double cosine = s.dot(t), diagonal = 1.0 + std::max(0.0, kLeast - (1.0 - cosine * cosine));
    const double determinant = diagonal * diagonal - cosine * cosine;
    a = (diagonal * s - cosine * t) / (determinant * along_e);
    b = (diagonal * t - cosine * s) / (determinant * along_f);
  }
  Vector a{0, 0, 0}, b{0, 0, 0};
};

}   // namespace

/// Finds how friction turns the curves of a contact. The lever reaches from the centreline to the place where the force
/// acts. If a curve touches a solid or another curve, that place is on the surface of the curve. If it touches a cloth,
/// the place is on the middle surface of the cloth, so that the moments on both are opposite.
void ContactPotential::setTurns(const Eigen::Matrix3Xd& x, Contact& contact) const
{
  const bool turns[2] = {surface_.objects[contact.object].turns,
                         contact.other >= 0 && surface_.objects[contact.other].turns};
  if (!turns[0] && !turns[1])
    return;
  Vector middle[2] = {Vector::Zero(), Vector::Zero()};
  for (int k = 0; k < 4; ++k)
    if (contact.point[k] >= 0)
      middle[contact.weight[k] < 0.0] += std::abs(contact.weight[k]) * x.col(contact.point[k]);
  const bool on_sheet = contact.solid < 0 && turns[0] != turns[1];
  const Vector place = on_sheet ? middle[turns[0]] : contact.position;
  for (int side = 0; side < 2; ++side)
    if (turns[side])
    {
      const ContactSegment& s = surface_.segments[segment_of_point_[contact.point[2 * side]]];
      const Vector tangent = (x.col(s.b) - x.col(s.a)).normalized();
      contact.turn[side] = {s.a, (side == 0 ? 1.0 : -1.0) * tangent.cross(place - middle[side])};
    }
}

/// Finds the levers of a contact of cloth. The force on point k is weight_k f + (lever_k . f) n, where f is the
/// friction, across the normal n. The levers give these forces the moment of a force f that acts where the other
/// surface feels -f. A single corner on a plane has no levers. Curves have none either: along a fine curve, the forces
/// along n would be as large as f itself, and friction would grow from them. The levers of cloth have a limit for the
/// same reason.
void ContactPotential::setLevers(Contact& contact) const
{
  constexpr double kLargest = 0.3;   // reached where edges are about three thicknesses long
  const auto isSheet = [&](int number) {
    return surface_.objects[number].curve_length == 0.0 && surface_.objects[number].carrier < 0;
  };
  if (!isSheet(contact.object) || (contact.other >= 0 && !isSheet(contact.other)))
    return;
  const Vector n = contact.force.normalized();
  double apart = contact.solid < 0 ? 0.0 : -n.dot(contact.position);   // of the points' places
  for (int k = 0; k < 4; ++k)
    if (contact.point[k] >= 0)
      apart += contact.weight[k] * n.dot(x_now_.col(contact.point[k]));
  const auto edge = [&](int from, int to) {
    return across(n, x_now_.col(contact.point[to]) - x_now_.col(contact.point[from]));
  };
  const bool on_triangle = contact.solid < 0 && contact.first_points == 1;
  Vector(&lever)[4] = contact.lever;
  if (on_triangle || contact.first_points == 3)
  {
    const int corner = on_triangle;   // the first of the triangle
    const DualVectors dual(edge(corner, corner + 1), edge(corner, corner + 2));
    lever[corner + 1] = apart * dual.a;
    lever[corner + 2] = apart * dual.b;
    lever[corner] = -lever[corner + 1] - lever[corner + 2];
  }
  else if (contact.solid < 0)
  {
    const DualVectors dual(edge(0, 1), edge(2, 3));
    lever[1] = apart * dual.a;
    lever[0] = -lever[1];
    lever[3] = apart * dual.b;
    lever[2] = -lever[3];
  }
  double largest = 0.0;
  for (const Vector& each : lever)
    largest = std::max(largest, each.norm());
  contact.levers = largest > 0.0 && std::isfinite(largest);   // It is not finite if a segment has no length.
  for (Vector& each : lever)
    each = contact.levers ? Vector(kLargest / std::max(kLargest, largest) * each) : Vector::Zero();
}

}   // namespace slender
