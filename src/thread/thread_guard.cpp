#include "thread_guard.h"

#include <algorithm>
#include <cmath>

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
  return forOthers(state, first, last, isFree);
}

bool ThreadGuard::mayJoin(const ThreadState& state, int i) const
{
  const Eigen::Vector3d &a = state.x[i - 1], &b = state.x[i], &c = state.x[i + 1];
  const double radius = std::sqrt((state.volume[i - 1] + state.volume[i]) / (M_PI * (c - a).norm()));
  return forOthers(state, i - 1, i, [&](const Eigen::Vector3d& p, const Eigen::Vector3d& q, double r, double core) {
    const auto apart = [&](const Eigen::Vector3d& from, const Eigen::Vector3d& to, double own) {
      return segmentDistance(from, to, p, q) / (core * (own + r));
    };
    return apart(a, c, radius) >= std::min({1.0, apart(a, b, state.radius(i - 1)), apart(b, c, state.radius(i))});
  });
}

template <class F>
bool ThreadGuard::forTubes(F&& f) const
{
  for (const Tube& tube : tubes_)
    for (Eigen::Index j = 0; j < tube.radius.size(); ++j)
    {
      const int a = static_cast<int>(j), b = (a + 1) % tube.chain->nodes();
      if (!f(tube.chain->position(a), tube.chain->position(b), tube.radius[j], 1.0))
        return false;
    }
  return true;
}

template <class F>
bool ThreadGuard::forOthers(const ThreadState& state, int first, int last, F&& f) const
{
  const double radius = std::max(state.radius(first), state.radius(last));
  const auto at = std::find_if(strands_.begin(), strands_.end(), [&](const Strand& s) { return s.state == &state; });
  if (at == strands_.end())
    return true;
  const ContactProperties& own = at->contact;
  const double core = at->merging > 0.0 ? at->merging : 1.0;
  const auto meets = [&](const ThreadState& other, int j) {
    return f(other.x[j], other.x[j + 1], other.radius(j), core);
  };
  if (own.others && !forTubes(f))
    return false;
  for (const Strand& strand : strands_)
    if (strand.state != &state && own.others && strand.contact.others)
      for (int j = 0; j < strand.state->edges(); ++j)
        if (!meets(*strand.state, j))
          return false;
  if (!own.self)
    return true;
  const auto neighbours = [&](double apart, int j) { return apart < 0.5 * M_PI * (radius + state.radius(j)) + gap_; };
  double apart = 0.0;
  for (int j = first - 1; j >= 0; apart += state.edge(j--).norm())
    if (!neighbours(apart, j) && !meets(state, j))
      return false;
  apart = 0.0;
  for (int j = last + 1; j < state.edges(); apart += state.edge(j++).norm())
    if (!neighbours(apart, j) && !meets(state, j))
      return false;
  return true;
}

}   // namespace slender
