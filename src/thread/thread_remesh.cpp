#include "slender_sim/thread/thread_remesh.h"

#include <algorithm>

#include "slender_sim/geometry/rotation.h"

namespace slender {

namespace {

template <class F>
void forNodeArrays(ThreadState& s, F&& f)
{
  f(s.x), f(s.v), f(s.twist), f(s.id), f(s.deposited);
}

template <class F>
void forEdgeArrays(ThreadState& s, F&& f)
{
  f(s.d1), f(s.spin), f(s.volume);
}

template <class F>
void forAllArrays(ThreadState& s, F&& f)
{
  forNodeArrays(s, f);
  forEdgeArrays(s, f);
}

/// Mass with this share of the volume leaves node `from`, with its velocity, and comes to node `to`.
void moveMomentum(ThreadState& state, int from, int to, double volume)
{
  const double own = (to > 0 ? state.volume[to - 1] : 0.0) + (to < state.edges() ? state.volume[to] : 0.0);
  state.v[to] = (0.5 * own * state.v[to] + volume * state.v[from]) / (0.5 * own + volume);
}

/// Edge `to`, a neighbour of edge `from`, gets this volume with fluid from there.
void moveFluid(ThreadState& state, int from, int to, double volume)
{
  const double flow = volume - state.volume[to], rest = state.volume[from] - flow;
  const double length = state.edge(from).norm(), length_to = state.edge(to).norm();
  moveMomentum(state, from < to ? from : from + 1, from < to ? to + 1 : to, 0.5 * flow);
  // the rest spins as before, and what it has lost goes with the fluid
  const double lost = (state.volume[from] * state.volume[from] - rest * rest) / length * state.spin[from];
  state.spin[to] =
      (state.volume[to] * state.volume[to] / length_to * state.spin[to] + lost) * length_to / (volume * volume);
  state.volume[to] = volume;
  state.volume[from] = rest;
}

/// Lagrange's polynomial through (s[k], y[k]), k = 0..count-1, at s = 0.
template <class Value>
Value interpolate(const double* s, const Value* y, int count)
{
  Value sum = 0.0 * y[0];
  for (int k = 0; k < count; ++k)
  {
    double weight = 1.0;
    for (int m = 0; m < count; ++m)
      if (m != k)
        weight *= s[m] / (s[m] - s[k]);
    sum += weight * y[k];
  }
  return sum;
}

Eigen::Vector3d carried(const Eigen::Vector3d& d1, const Eigen::Vector3d& from, const Eigen::Vector3d& to, double angle)
{
  const Eigen::Vector3d d = rotateAbout(parallelTransport(d1, from, to), to, angle);
  return (d - to * to.dot(d)).normalized();
}

}   // namespace

Eigen::Vector3d splitPoint(const ThreadState& state, int j, double fraction)
{
  const int last = state.nodes() - 1;
  const Eigen::Vector3d a = state.x[j], b = state.x[j + 1], e = b - a;
  const double length = e.norm();

  // arc lengths from the new node; beyond a held end the straight inside of its holder
  double s[4];
  Eigen::Vector3d y[4];
  int count = 0;
  const auto add = [&](double at, const Eigen::Vector3d& x) {
    s[count] = at;
    y[count++] = x;
  };
  const double to_a = fraction * length, to_b = length - to_a;
  if (j > 0)
    add(-to_a - state.edge(j - 1).norm(), state.x[j - 1]);
  else if (state.ends[0].held)
    add(-to_a - length, a - state.ends[0].X_WE.orientation * Eigen::Vector3d(length, 0, 0));
  add(-to_a, a);
  add(to_b, b);
  if (j + 1 < last)
    add(to_b + state.edge(j + 1).norm(), state.x[j + 2]);
  else if (state.ends[1].held)
    add(to_b + length, b - state.ends[1].X_WE.orientation * Eigen::Vector3d(length, 0, 0));
  const Eigen::Vector3d x = interpolate(s, y, count);
  // next to a much longer edge the cubic may swing out; the chord is then the better guess
  if ((x - (a + fraction * e)).norm() > 0.25 * std::min(to_a, to_b))
    return a + fraction * e;
  return x;
}

void splitEdge(ThreadState& state, int j, double fraction)
{
  splitEdge(state, j, fraction, splitPoint(state, j, fraction));
}

void splitEdge(ThreadState& state, int j, double fraction, const Eigen::Vector3d& x)
{
  const int last = state.nodes() - 1;
  const Eigen::Vector3d a = state.x[j], b = state.x[j + 1], e = b - a;
  const double length = e.norm();
  const Eigen::Vector3d t = e / length;
  const double to_a = fraction * length, to_b = length - to_a;
  const double before = j > 0 ? state.edge(j - 1).norm() : 0.0, after = j + 1 < last ? state.edge(j + 1).norm() : 0.0;

  // radii at the middles of three edges, seen from the middles of the two new ones
  double volume_ratio = fraction;
  if (j > 0 && j + 1 < last)
  {
    double radius_at[3];
    const double radii[3] = {state.radius(j - 1), state.radius(j), state.radius(j + 1)};
    const double middles[3] = {-0.5 * before, 0.5 * length, length + 0.5 * after};   // from node j
    const auto radius = [&](double where) {
      for (int k = 0; k < 3; ++k)
        radius_at[k] = middles[k] - where;
      const double r = interpolate(radius_at, radii, 3);
      return std::clamp(r, 0.5 * radii[1], 2.0 * radii[1]);
    };
    const double left = radius(0.5 * to_a), right = radius(to_a + 0.5 * to_b);
    const double left_volume = left * left * to_a;
    volume_ratio = left_volume / (left_volume + right * right * to_b);
  }
  const double volume = state.volume[j], left_volume = volume_ratio * volume, right_volume = volume - left_volume;
  // each half of a removed share goes to the new node: momentum of the lumped masses stays
  const Eigen::Vector3d v = (right_volume * state.v[j] + left_volume * state.v[j + 1]) / volume;

  // The twist between the middles of neighbouring edges stays spread as it was. At a held end it lies on half an edge.
  const double first_span = 0.5 * (length + before), second_span = 0.5 * (length + after);
  const double twist_a = state.twist[j] / first_span, twist_b = state.twist[j + 1] / second_span;
  // their middles moved by these lengths
  const double left_turn = -twist_a * 0.5 * to_b, right_turn = twist_b * 0.5 * to_a;
  const Eigen::Vector3d left = (x - a).normalized(), right = (b - x).normalized(), d1 = state.d1[j];
  state.x.insert(state.x.begin() + j + 1, x);
  state.v.insert(state.v.begin() + j + 1, v);
  state.id.insert(state.id.begin() + j + 1, state.next_id++);
  state.deposited.insert(state.deposited.begin() + j + 1,
                         static_cast<char>(state.deposited[j] && state.deposited[j + 1]));
  state.twist.insert(state.twist.begin() + j + 1, right_turn - left_turn);
  state.twist[j] += left_turn;
  state.twist[j + 2] -= right_turn;
  state.d1[j] = carried(d1, t, left, left_turn);
  state.d1.insert(state.d1.begin() + j + 1, carried(d1, t, right, right_turn));
  // angular momentum stays; the moment of inertia of an edge goes with the square of its volume over its length
  const double left_inertia = left_volume * left_volume / (x - a).norm(),
               right_inertia = right_volume * right_volume / (b - x).norm();
  state.spin[j] *= volume * volume / length / (left_inertia + right_inertia);
  state.spin.insert(state.spin.begin() + j + 1, state.spin[j]);
  state.volume[j] = left_volume;
  state.volume.insert(state.volume.begin() + j + 1, right_volume);
}

void removeNode(ThreadState& state, int i)
{
  const Eigen::Vector3d e = state.edge(i - 1), f = state.edge(i), joined = e + f;
  const double le = e.norm(), lf = f.norm(), share = le / (le + lf);
  const Eigen::Vector3d te = e / le, t = joined.normalized();
  const double ve = state.volume[i - 1], vf = state.volume[i];

  // the share of the lumped mass that a neighbour takes over brings its momentum along
  const auto give = [&](int k, double taken) {
    double own = (k > 0 ? state.volume[k - 1] : 0.0) + (k < state.edges() ? state.volume[k] : 0.0);
    state.v[k] = (own * state.v[k] + taken * state.v[i]) / (own + taken);
  };
  give(i - 1, vf);
  give(i + 1, ve);

  // the frame in the middle of the joined edge lies between those of the two: turned by the nearer part of their twist
  const double turn = (1.0 - share) * state.twist[i], rest = state.twist[i] - turn;
  state.d1[i - 1] = carried(state.d1[i - 1], te, t, turn);
  state.twist[i - 1] += turn;
  state.twist[i + 1] += rest;
  state.spin[i - 1] =
      (ve * ve / le * state.spin[i - 1] + vf * vf / lf * state.spin[i]) * joined.norm() / ((ve + vf) * (ve + vf));
  state.volume[i - 1] = ve + vf;
  forAllArrays(state, [i](auto& v) { v.erase(v.begin() + i); });
  if (!state.ends[0].held)
    state.twist.front() = 0.0;
  if (!state.ends[1].held)
    state.twist.back() = 0.0;
}

void removeEnd(ThreadState& state, int end)
{
  const int own = end ? state.edges() - 1 : 0, next = end ? own - 1 : 1;
  const int node = end ? own + 1 : 0, beyond = end ? next : 2;
  const double ve = state.volume[own], vf = state.volume[next], le = state.edge(own).norm(),
               lf = state.edge(next).norm();
  moveMomentum(state, node, beyond, 0.5 * ve);
  state.spin[next] = (ve * ve / le * state.spin[own] + vf * vf / lf * state.spin[next]) * lf / ((ve + vf) * (ve + vf));
  state.volume[next] += ve;
  forNodeArrays(state, [node](auto& v) { v.erase(v.begin() + node); });
  forEdgeArrays(state, [own](auto& v) { v.erase(v.begin() + own); });
  (end ? state.twist.back() : state.twist.front()) = 0.0;
}

void spreadFluid(ThreadState& state, int j)
{
  const auto area = [&](int k) { return state.volume[k] / state.edge(k).norm(); };
  const auto takes = [&](int k) {
    return k >= 0 && k < state.edges() && !(state.deposited[k] && state.deposited[k + 1]) && area(k) < area(j);
  };
  // With the thinner neighbour first, the wider one takes a share only if it is thinner than both together.
  int neighbours[2] = {j - 1, j + 1};
  if (takes(j - 1) && takes(j + 1) && area(j + 1) < area(j - 1))
    std::swap(neighbours[0], neighbours[1]);
  double volume = state.volume[j], length = state.edge(j).norm();
  bool shares[2] = {false, false};
  for (int k = 0; k < 2; ++k)
    if (takes(neighbours[k]) && area(neighbours[k]) < volume / length)
    {
      volume += state.volume[neighbours[k]];
      length += state.edge(neighbours[k]).norm();
      shares[k] = true;
    }
  for (int k = 0; k < 2; ++k)
    if (shares[k])
      moveFluid(state, j, neighbours[k], volume / length * state.edge(neighbours[k]).norm());
}

bool mayJoin(const ThreadState& state, int i, const RemeshGuard* guard)
{
  const Eigen::Vector3d &a = state.x[i - 1], &c = state.x[i + 1];
  const double radius = std::sqrt((state.volume[i - 1] + state.volume[i]) / (M_PI * (c - a).norm()));
  return !guard || guard->hasRoom(state, {i - 1, i, a, c, radius}, {1.0, kFirmShare});
}

bool mayRemove(const ThreadState& state, int i, const RemeshGuard* guard)
{
  if (!guard)
    return true;
  const double le = state.edge(i - 1).norm(), lf = state.edge(i).norm();
  return guard->allows(state, i - 1, i, state.x[i],
                       state.x[i - 1] + le / (le + lf) * (state.x[i + 1] - state.x[i - 1]));
}

bool breakThread(ThreadState& state, double min_radius, ThreadState& older)
{
  int at = -1;
  double thinnest = min_radius;
  for (int j = 1; j + 1 < state.edges(); ++j)
  {
    if (state.deposited[j] && state.deposited[j + 1])
      continue;
    const double r = state.radius(j);
    if (r < thinnest)
    {
      thinnest = r;
      at = j;
    }
  }
  if (at < 0)
    return false;

  // Each half of the edge's fluid thickens the edge beyond its node. A quarter of it, which that node had, comes to the
  // next one.
  const double half = 0.5 * state.volume[at];
  const auto pass = [&](int from, int to) {
    const double own = (to > 0 ? state.volume[to - 1] : 0.0) + (to < state.edges() ? state.volume[to] : 0.0);
    state.v[to] = (own * state.v[to] + half * state.v[from]) / (own + half);
  };
  pass(at, at - 1);
  pass(at + 1, at + 2);
  state.volume[at - 1] += half;
  state.volume[at + 1] += half;

  older = state;
  forNodeArrays(older, [&](auto& v) { v.resize(at + 1); });
  forEdgeArrays(older, [&](auto& v) { v.resize(at); });
  forAllArrays(state, [&](auto& v) { v.erase(v.begin(), v.begin() + at + 1); });
  older.ends[1].held = state.ends[0].held = false;
  older.twist.back() = state.twist.front() = 0.0;
  older.fed_volume = older.dropped_volume = older.left_volume = 0.0;
  return true;
}

void dropOldest(ThreadState& state, int count, double& account)
{
  count = std::min(count, state.nodes() - 2);
  if (count <= 0)
    return;
  for (int j = 0; j < count; ++j)
    account += state.volume[j];
  forAllArrays(state, [&](auto& v) { v.erase(v.begin(), v.begin() + count); });
  state.twist[0] = 0.0;
  state.ends[0].held = false;
}

}   // namespace slender
