// Continuous tests of vertices against faces and edges against edges: nothing may be missed.
#include "collision_pairs.h"

#include <algorithm>
#include <cmath>
#include <random>
#include <string>
#include <vector>

#include <Eigen/Geometry>

#include "slender_sim/contact/distance.h"
#include "study/framework/cpu_clock.h"

namespace slender::study {

namespace {

using Eigen::Vector3d;
using Wide = Eigen::Matrix<long double, 3, 1>;
using Random = std::mt19937;

struct WidePair
{
  Wide p[4];
  int first;   ///< corners of the first piece
};

WidePair at(const MovingPair& pair, long double t)
{
  WidePair out;
  out.first = pair.edges ? 2 : 1;
  const Wide from0 = pair.point[3].from.cast<long double>(), to0 = pair.point[3].to.cast<long double>();
  for (int i = 0; i < 4; ++i)   // relative to a corner: rounded in proportion to the extent
  {
    const Wide a = pair.point[i].from.cast<long double>() - from0, b = pair.point[i].to.cast<long double>() - to0;
    out.p[i] = (1.0L - t) * a + t * b;
  }
  return out;
}

long double clampShare(long double x) { return x > 1.0L ? 1.0L : x > 0.0L ? x : 0.0L; }

Wide towardsSegment(const Wide& p, const Wide& a, const Wide& b)
{
  const Wide e = b - a;
  const long double e2 = e.squaredNorm();
  return p - a - (e2 > 0.0L ? clampShare(e.dot(p - a) / e2) : 0.0L) * e;
}

/// The shortest way from the second piece to the first, the best of all candidates.
Wide shortestWay(const WidePair& w)
{
  Wide best = Wide::Constant(1e300L);
  const auto consider = [&](const Wide& way) {
    if (way.squaredNorm() < best.squaredNorm())
      best = way;
  };
  if (w.first == 2)
  {
    const Wide &a = w.p[0], &b = w.p[1], &c = w.p[2], &d = w.p[3];
    consider(towardsSegment(a, c, d));
    consider(towardsSegment(b, c, d));
    consider(-towardsSegment(c, a, b));
    consider(-towardsSegment(d, a, b));
    const Wide e = b - a, f = d - c, r = c - a, n = e.cross(f);
    const long double n2 = n.squaredNorm();
    if (n2 > 0.0L)
    {
      const long double s = r.cross(f).dot(n) / n2, t = r.cross(e).dot(n) / n2;
      if (s >= 0.0L && s <= 1.0L && t >= 0.0L && t <= 1.0L)
        consider(s * e - t * f - r);
    }
    return best;
  }
  const Wide &p = w.p[0], &a = w.p[1], &b = w.p[2], &c = w.p[3];
  consider(towardsSegment(p, a, b));
  consider(towardsSegment(p, b, c));
  consider(towardsSegment(p, c, a));
  const Wide n = (b - a).cross(c - a);
  const long double n2 = n.squaredNorm();
  if (n2 > 0.0L)
  {
    const long double u = (c - b).cross(p - b).dot(n) / n2, v = (a - c).cross(p - c).dot(n) / n2;
    if (u >= 0.0L && v >= 0.0L && u + v <= 1.0L)
      consider(p - u * a - v * b - (1.0L - u - v) * c);
  }
  return best;
}

long double separation(const WidePair& w, const Wide& direction)
{
  long double least = 1e300L;
  for (int i = 0; i < w.first; ++i)
    for (int j = w.first; j < 4; ++j)
      least = std::min(least, direction.dot(w.p[i] - w.p[j]));
  return least;
}

Contact decide(const MovingPair& pair, long double from, long double to, long double rounding, int depth)
{
  const long double middle = 0.5L * (from + to);
  const WidePair a = at(pair, from), b = at(pair, to), m = at(pair, middle);
  bool near = false;
  for (const WidePair* w : {&m, &a, &b})
  {
    const Wide way = shortestWay(*w);
    const long double d = way.norm();
    near = near || d <= rounding;
    // The way, where pieces nearly touch, is rounded more than what is across both.
    const Wide across = pair.edges ? Wide((w->p[1] - w->p[0]).cross(w->p[3] - w->p[2]))
                                   : Wide((w->p[2] - w->p[1]).cross(w->p[3] - w->p[1]));
    for (const Wide& direction : {way, across, Wide(-across)})
    {
      const long double size = direction.norm();
      if (size > 0.0L && separation(a, direction / size) > rounding && separation(b, direction / size) > rounding)
        return Contact::none;
    }
  }
  if (near)
    return Contact::some;
  if (depth == 0)
    return Contact::undecided;
  const Contact first = decide(pair, from, middle, rounding, depth - 1);
  return first != Contact::none ? first : decide(pair, middle, to, rounding, depth - 1);
}

double extent(const MovingPair& pair)
{
  double size = 0.0;
  for (int i = 0; i < 3; ++i)
    size = std::max({size, (pair.point[i].from - pair.point[3].from).cwiseAbs().maxCoeff(),
                     (pair.point[i].to - pair.point[3].to).cwiseAbs().maxCoeff()});
  return size;
}

double uniform(Random& random, double from, double to)
{
  return from + (to - from) * (static_cast<double>(random()) / static_cast<double>(Random::max()));
}
Vector3d vector(Random& random, double size)
{
  const double x = uniform(random, -size, size), y = uniform(random, -size, size);
  return {x, y, uniform(random, -size, size)};
}

constexpr const char* kKinds[] = {"general",
                                  "fast",
                                  "coplanar motion",
                                  "parallel",
                                  "needle",
                                  "without extent",
                                  "at rest",
                                  "touching at the start",
                                  "constructed",
                                  "constructed at a border",
                                  "grid",
                                  "far from the origin",
                                  "sliding closely"};
constexpr int kKindCount = static_cast<int>(std::size(kKinds));

/// Changes the motion so that the pieces meet at a time t at given places of both.
void meetAt(MovingPair& m, double t, const double* weights)
{
  Vector3d gap = Vector3d::Zero();
  for (int i = 0; i < 4; ++i)
    gap += weights[i] * (m.point[i].from + t * (m.point[i].to - m.point[i].from));
  for (int i = 0; i < (m.edges ? 2 : 1); ++i)
    m.point[i].to -= gap / t;
}

MovingPair drawPair(Random& random, int kind)
{
  MovingPair m;
  m.edges = random() % 2;
  const double motion = kind == 1 ? 100.0 : 1.0;
  for (MovingPoint& p : m.point)
  {
    p.from = vector(random, 1.0);
    p.to = p.from + vector(random, motion);
  }
  switch (kind)
  {
    case 2:
      for (MovingPoint& p : m.point)
        p.from.z() = p.to.z() = 0.0;
      break;
    case 3:   // edges parallel to each other or to the triangle, at the start or throughout
    {
      const Vector3d along = vector(random, 1.0), shift = vector(random, 1.0), other = vector(random, 1.0);
      m.point[1].from = m.point[0].from + along;
      m.point[3].from = m.point[2].from + uniform(random, -2, 2) * along;
      if (random() % 2)
        for (int i = 0; i < 4; ++i)
          m.point[i].to = m.point[i].from + (i < (m.edges ? 2 : 1) ? shift : other);
      break;
    }
    case 4:   // two corners of the second piece nearly in one place or three nearly in a line
    {
      const double thin = std::pow(10.0, uniform(random, -14, -3));
      const double s = random() % 2 ? uniform(random, 0, 1) : 0.0;
      for (int k : {0, 1})
      {
        Vector3d& p = k ? m.point[3].to : m.point[3].from;
        const Vector3d &a = k ? m.point[1].to : m.point[1].from, &b = k ? m.point[2].to : m.point[2].from;
        p = (m.edges ? b : Vector3d(a + s * (b - a))) + vector(random, thin);
      }
      break;
    }
    case 5:
      for (int k : {0, 1})
      {
        Vector3d& p = k ? m.point[3].to : m.point[3].from;
        p = k ? m.point[2].to : m.point[2].from;
      }
      if (random() % 2)
        m.point[1] = m.point[2];
      break;
    case 6:
      for (MovingPoint& p : m.point)
        p.to = p.from;
      break;
    case 10:   // few places: everything degenerate happens, exactly
      for (MovingPoint& p : m.point)
        for (int k = 0; k < 3; ++k)
        {
          p.from[k] = static_cast<int>(random() % 4);
          p.to[k] = p.from[k] + static_cast<int>(random() % 5) - 2;
        }
      break;
    case 12:   // across the other at a small distance, which hardly changes
    {
      const double height = std::pow(10.0, uniform(random, -9, -3));
      for (MovingPoint& p : m.point)
        p.from.z() = p.to.z() = 0.0;
      for (int i = 0; i < (m.edges ? 2 : 1); ++i)
      {
        m.point[i].from.z() = height;
        m.point[i].to.z() = height * uniform(random, -0.2, 1.0);
      }
      break;
    }
    default: break;
  }
  if (kind == 4 || kind == 5 || kind == 7 || kind == 8 || kind == 9 ||
      (kind == 11 && random() % 2))   // most of them collide
  {
    double w[4];
    if (m.edges)
    {
      const double s = uniform(random, 0, 1), t = kind == 9 ? static_cast<double>(random() % 2) : uniform(random, 0, 1);
      w[0] = 1.0 - s;
      w[1] = s;
      w[2] = t - 1.0;
      w[3] = -t;
    }
    else
    {
      const double u = kind == 9 ? static_cast<double>(random() % 2) : uniform(random, 0, 1),
                   v = uniform(random, 0, 1) * (1.0 - u);
      w[0] = 1.0;
      w[1] = -u;
      w[2] = -v;
      w[3] = u + v - 1.0;
    }
    if (kind == 7)
    {
      Vector3d gap = Vector3d::Zero();
      for (int i = 0; i < 4; ++i)
        gap += w[i] * m.point[i].from;
      for (int i = 0; i < (m.edges ? 2 : 1); ++i)
        m.point[i].from -= gap;
    }
    else
      meetAt(m, uniform(random, 0.05, 1.0), w);
  }
  if (kind == 11)
  {
    const Vector3d away = 1e4 * Vector3d(1.0, -0.7, 0.3), drift = vector(random, 1e3);
    for (MovingPoint& p : m.point)
    {
      p.from += away;
      p.to += away + drift;
    }
  }
  return m;
}

double limitOf(const MovingPair& m, const ApproachLimit& limit)
{
  return m.edges ? segmentsLimit(m.point[0], m.point[1], m.point[2], m.point[3], limit)
                 : pointTriangleLimit(m.point[0], m.point[1], m.point[2], m.point[3], limit);
}

}   // namespace

Contact referenceContact(const MovingPair& pair, double from, double to)
{
  return decide(pair, from, to, 1e-15L * extent(pair), 40);
}

bool cubicContact(const MovingPair& pair)
{
  const double tolerance = 1e-6 * extent(pair);
  const MovingPoint& o = pair.point[3];
  Vector3d r[3], v[3];
  for (int i = 0; i < 3; ++i)
  {
    r[i] = pair.point[i].from - o.from;
    v[i] = pair.point[i].to - o.to - r[i];
  }
  const auto triple = [](const Vector3d& a, const Vector3d& b, const Vector3d& c) { return a.dot(b.cross(c)); };
  const double c0 = triple(r[0], r[1], r[2]),
               c1 = triple(v[0], r[1], r[2]) + triple(r[0], v[1], r[2]) + triple(r[0], r[1], v[2]),
               c2 = triple(r[0], v[1], v[2]) + triple(v[0], r[1], v[2]) + triple(v[0], v[1], r[2]),
               c3 = triple(v[0], v[1], v[2]);
  const auto value = [&](double t) { return c0 + t * (c1 + t * (c2 + t * c3)); };
  double ends[4] = {0.0, 1.0, 1.0, 1.0};   // between them it is monotonic
  int count = 1;
  const double disc = c2 * c2 - 3.0 * c3 * c1;
  if (disc >= 0.0)
  {
    const double q = -(c2 + std::copysign(std::sqrt(disc), c2));
    double turns[2] = {c3 != 0.0 ? q / (3.0 * c3) : -1.0, q != 0.0 ? c1 / q : -1.0};
    std::sort(turns, turns + 2);
    for (const double t : turns)
      if (t > 0.0 && t < 1.0)
        ends[count++] = t;
  }
  ends[count] = 1.0;
  const auto near = [&](double t) {
    Vector3d p[4];
    for (int i = 0; i < 3; ++i)
      p[i] = r[i] + t * v[i];
    p[3].setZero();
    return (pair.edges ? segmentDistance(p[0], p[1], p[2], p[3]) : pointTriangleDistance(p[0], p[1], p[2], p[3])) <=
           tolerance;
  };
  for (int k = 0; k < count; ++k)
  {
    double a = ends[k], b = ends[k + 1];
    if (near(b))
      return true;
    if (value(a) * value(b) > 0.0)
      continue;
    for (int i = 0; i < 60; ++i)
    {
      const double middle = 0.5 * (a + b);
      (value(a) * value(middle) <= 0.0 ? b : a) = middle;
    }
    if (near(0.5 * (a + b)))
      return true;
  }
  return near(0.0);
}

void runCollisionPairs(StudyContext& context, int count)
{
  struct Tally
  {
    int pairs = 0, contacts = 0, missed = 0, false_hits = 0, cubic_missed = 0, cubic_false = 0;
    double seconds = 0.0, cubic_seconds = 0.0;
  };
  Tally tallies[kKindCount], total;
  ApproachLimit limit;
  limit.reach = 1e-3;
  constexpr int kBatch = 2000;
  std::vector<MovingPair> pairs(kBatch);
  std::vector<double> shares(kBatch);
  std::vector<char> cubic(kBatch);
  for (int done = 0, batch = 0; done < count; done += kBatch, ++batch)
  {
    const int kind = batch % kKindCount;
    context.progress(done, count, std::string("pairs: ") + kKinds[kind]);
    Random random(7 + batch);
    for (MovingPair& m : pairs)
      m = drawPair(random, kind);
    Tally& tally = tallies[kind];
    double start = threadSeconds();
    for (int i = 0; i < kBatch; ++i)
      shares[i] = limitOf(pairs[i], limit);
    tally.seconds += threadSeconds() - start;
    start = threadSeconds();
    for (int i = 0; i < kBatch; ++i)
      cubic[i] = cubicContact(pairs[i]);
    tally.cubic_seconds += threadSeconds() - start;
    for (int i = 0; i < kBatch; ++i)
    {
      const bool apart_before = shares[i] == 0.0 || referenceContact(pairs[i], 0.0, shares[i]) == Contact::none;
      const bool contact = shares[i] == 1.0 ? !apart_before : referenceContact(pairs[i], 0.0, 1.0) != Contact::none;
      ++tally.pairs;
      tally.contacts += contact;
      tally.missed += !apart_before;
      tally.false_hits += !contact && shares[i] < 1.0;
      tally.cubic_missed += contact && !cubic[i];
      tally.cubic_false += !contact && cubic[i];
    }
  }
  for (int kind = 0; kind < kKindCount; ++kind)
  {
    const Tally& t = tallies[kind];
    if (t.pairs == 0)
      continue;
    context.row()
        .set("part", "pairs")
        .set("kind", kKinds[kind])
        .set("pairs", t.pairs)
        .set("contacts", t.contacts)
        .set("missed", t.missed)
        .set("false_hits", t.false_hits)
        .set("ns_per_test", 1e9 * t.seconds / t.pairs)
        .set("cubic_missed", t.cubic_missed)
        .set("cubic_false_hits", t.cubic_false)
        .set("cubic_ns_per_test", 1e9 * t.cubic_seconds / t.pairs);
    total.pairs += t.pairs;
    total.contacts += t.contacts;
    total.missed += t.missed;
    total.false_hits += t.false_hits;
    total.cubic_missed += t.cubic_missed;
    total.seconds += t.seconds;
    total.cubic_seconds += t.cubic_seconds;
  }
  context.metric("pairs", total.pairs);
  context.metric("contacts", total.contacts);
  context.metric("missed", total.missed);
  context.metric("false_positive_share",
                 static_cast<double>(total.false_hits) / std::max(1, total.pairs - total.contacts));
  context.metric("ns_per_test", 1e9 * total.seconds / total.pairs);
  context.metric("cubic_missed", total.cubic_missed);
  context.metric("cubic_ns_per_test", 1e9 * total.cubic_seconds / total.pairs);
}

}   // namespace slender::study
