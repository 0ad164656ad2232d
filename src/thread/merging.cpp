#include "merging.h"

#include <algorithm>
#include <cmath>

#include "slender_sim/contact/distance.h"

namespace slender {

namespace {

double rhoOf(double r, double d) { return std::sqrt(std::max(0.0, r * r - 0.25 * d * d)); }

/// Place of segment j nearest to a point.
double nearest(const Eigen::Matrix3Xd& x, const ContactSegment& s, const Eigen::Vector3d& p, double& distance)
{
  const double t = closestOnSegment(p, x.col(s.a), x.col(s.b));
  distance = (p - x.col(s.a) - t * (x.col(s.b) - x.col(s.a))).norm();
  return t;
}

}   // namespace

double mergingWork(double r, double d0, double d)
{
  // s = 2 r sin(a): the integrand becomes smooth also where the balls touch
  const auto angle = [r](double s) { return std::asin(std::clamp(0.5 * s / r, -1.0, 1.0)); };
  const double a = angle(d0), b = angle(d);
  // Gauss's rule with five points, on four parts: exact to rounding for the whole range
  constexpr double kAt[5] = {-0.9061798459386640, -0.5384693101056831, 0.0, 0.5384693101056831, 0.9061798459386640};
  constexpr double kWeight[5] = {0.2369268850561891, 0.4786286704993665, 0.5688888888888889, 0.4786286704993665,
                                 0.2369268850561891};
  constexpr int kParts = 4;
  double sum = 0.0;
  for (int part = 0; part < kParts; ++part)
    for (int k = 0; k < 5; ++k)
    {
      const double at = a + (b - a) * (part + 0.5 + 0.5 * kAt[k]) / kParts, c = std::cos(at);
      sum += kWeight[k] * 2.0 * r * r * c * c * (2.0 * r * std::sin(at) - d0);
    }
  return 0.5 * (b - a) / kParts * sum;
}

void ThreadMerging::begin(const Eigen::Matrix3Xd& x, const ContactSurface& surface,
                          const std::vector<GridPairs::Pair>& pairs, double gap, double h)
{
  fluids_.assign(surface.objects.size() - parts_.size(), {});
  held_.assign(static_cast<std::size_t>(surface.points), 0);
  for (const ThreadPart* part : parts_)
  {
    const ThreadModel& model = *part->thread().model;
    fluids_.push_back({part->merging() > 0.0, model.surface_tension, model.viscosity});
    for (int i = 0; i < part->points(); ++i)
      held_[static_cast<std::size_t>(part->first_point + i)] = part->thread().isHeld(i);
  }
  begin(x, surface.segments, fluids_, pairs, held_, gap, h);
}

void ThreadMerging::begin(const Eigen::Matrix3Xd& x, const std::vector<ContactSegment>& segments,
                          const std::vector<MergingFluid>& fluids, const std::vector<GridPairs::Pair>& pairs,
                          const std::vector<char>& held, double gap, double h)
{
  places_.clear();
  terms_.clear();
  const auto isLast = [&](int j) {
    return j + 1 == static_cast<int>(segments.size()) || segments[j + 1].object != segments[j].object;
  };
  const auto meetBoth = [&](int own, int other) {
    const ContactSegment &s = segments[own], &o = segments[other];
    const bool still = held[o.a] && held[o.b];
    if (!(still && held[s.a]))
      meet(x, segments, fluids, own, false, other, gap, h);
    if (isLast(own) && !(still && held[s.b]))
      meet(x, segments, fluids, own, true, other, gap, h);
  };
  const auto merge = [&](const ContactSegment& s, const ContactSegment& o) {
    const bool bend = s.object == o.object && contactShare(s, o, {}, gap) < 1.0;   // of one strand, which is open
    return fluids[s.object].merges && fluids[o.object].merges && !bend;
  };
  for (const GridPairs::Pair& pair : pairs)
    if (merge(segments[pair.first], segments[pair.second]))
    {
      meetBoth(pair.first, pair.second);
      meetBoth(pair.second, pair.first);
    }
}

/// Node a of segment `own` (b with far_end) and segment `other`, if that holds the place of its strand that is nearest
/// around there.
void ThreadMerging::meet(const Eigen::Matrix3Xd& x, const std::vector<ContactSegment>& segments,
                         const std::vector<MergingFluid>& fluids, int own, bool far_end, int other, double gap,
                         double h)
{
  const ContactSegment &s = segments[own], &o = segments[other];
  const int point = far_end ? s.b : s.a, count = static_cast<int>(segments.size());
  const Eigen::Vector3d p = x.col(point);
  const int before = far_end ? own : own - 1, after = far_end ? count : own;
  const bool has_before = before >= 0 && segments[before].object == s.object, has_after = after < count;
  double length = 0.0, radius = 0.0;
  for (const int j : {has_before ? before : -1, has_after ? after : -1})
    if (j >= 0)
    {
      length += 0.5 * segments[j].length;
      radius += segments[j].radius;
    }
  radius /= has_before && has_after ? 2.0 : 1.0;

  double distance = 0.0;
  const double t = nearest(x, o, p, distance);
  const double r = 0.5 * (radius + o.radius);
  if (distance >= 2.0 * r + gap || !(distance > 0.0))
    return;
  const auto sameStrand = [&](int j) { return j >= 0 && j < count && segments[j].object == o.object; };
  double beside = 0.0;
  if (t == 0.0 && sameStrand(other - 1) && nearest(x, segments[other - 1], p, beside) < 1.0)
    return;
  if (t == 1.0 && sameStrand(other + 1))
    return;                 // that one's beginning
  if (t > 0.0 && t < 1.0)   // inside a bend both edges have such a place: the nearer one counts
  {
    if (sameStrand(other - 1))
      if (const double u = nearest(x, segments[other - 1], p, beside); u > 0.0 && u < 1.0 && beside < distance)
        return;
    if (sameStrand(other + 1))
      if (const double u = nearest(x, segments[other + 1], p, beside); u > 0.0 && u < 1.0 && beside <= distance)
        return;
  }
  const MergingFluid &f = fluids[s.object], &g = fluids[o.object];
  const double balls = 0.5 * length / (2.0 * r);   // half: the other strand's nodes count as well
  const double out = std::clamp((distance - 2.0 * r) / gap, 0.0, 1.0), onset = 1.0 - out * out * (3.0 - 2.0 * out);
  Place place;
  place.point[0] = point;
  place.point[1] = o.a;
  place.point[2] = o.b;
  place.t = t;
  place.normal = (p - x.col(o.a) - t * (x.col(o.b) - x.col(o.a))) / distance;
  place.start = distance;
  place.radius = r;
  place.attraction = balls * onset * M_PI * (f.surface_tension + g.surface_tension) * r;
  place.drag = balls * 2.0 * M_PI / 3.0 * (f.viscosity + g.viscosity) / h;
  places_.push_back(place);
}

double ThreadMerging::largestForce() const
{
  double largest = 0.0;
  for (const Place& place : places_)
    largest = std::max(largest, place.attraction);
  return largest;
}

double ThreadMerging::evaluate(const Eigen::Matrix3Xd& x, bool with_stiffness)
{
  terms_.clear();
  double energy = 0.0;
  for (const Place& place : places_)
  {
    terms_.emplace_back();
    ContactTerm& term = terms_.back();
    const double weight[3] = {1.0, place.t - 1.0, -place.t};
    Eigen::Vector3d u = Eigen::Vector3d::Zero();
    for (int k = 0; k < 3; ++k)
    {
      term.point[k] = place.point[k];
      term.weight[k] = weight[k];
      u += weight[k] * x.col(place.point[k]);
    }
    const double d = place.normal.dot(u), away = d - place.start, rho = rhoOf(place.radius, d);
    energy += place.attraction * away + place.drag * mergingWork(place.radius, place.start, d);
    term.force = -(place.attraction + place.drag * rho * away) * place.normal;
    term.position = x.col(place.point[0]) - 0.5 * d * place.normal;
    if (with_stiffness && rho > 0.0)
      term.stiffness =
          std::max(0.0, place.drag * (rho - 0.25 * d * away / rho)) * place.normal * place.normal.transpose();
  }
  return energy;
}

}   // namespace slender
