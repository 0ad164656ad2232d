#include "belt_pattern.h"

#include <algorithm>
#include <cmath>

namespace slender::study {

namespace {

struct Extent
{
  double low = 1e300, high = -1e300;
  void add(double v)
  {
    low = std::min(low, v);
    high = std::max(high, v);
  }
  double middle() const { return 0.5 * (low + high); }
  double size() const { return high - low; }
};

/// Half the crossings of the middle of its extent; one counts when the trace has gone a tenth of the extent beyond.
template <class Value>
double periods(const std::vector<Landings::Point>& points, const Extent& extent, const Value& value)
{
  int count = 0, side = 0;
  for (const Landings::Point& p : points)
  {
    const double v = value(p) - extent.middle(), margin = 0.1 * extent.size();
    const int now = v > margin ? 1 : v < -margin ? -1 : side;
    count += side != 0 && now != side;
    side = now;
  }
  return 0.5 * count;
}

}   // namespace

BeltTrace classifyBeltTrace(const std::vector<Landings::Point>& points, double belt, double straight_below)
{
  BeltTrace t;
  t.pattern = "none";
  if (points.size() < 3 || !(points.back().time > points.front().time))
    return t;
  Extent x, y, turned;
  for (const Landings::Point& p : points)
  {
    x.add(p.x);
    y.add(p.y);
  }
  const double duration = points.back().time - points.front().time;
  const double across = periods(points, y, [](const Landings::Point& p) { return p.y; });
  const double along = periods(points, x, [](const Landings::Point& p) { return p.x; });
  t.amplitude = 0.5 * y.size();
  t.frequency_y = 2 * M_PI * across / duration;
  t.frequency_x = 2 * M_PI * along / duration;
  double angle = 0, first = 0;
  for (std::size_t k = 1; k < points.size(); ++k)
  {
    const Landings::Point &p = points[k - 1], &q = points[k];
    const double seen = std::atan2(q.y - p.y, belt * (q.time - p.time) - (q.x - p.x));
    angle = k == 1 ? seen : seen + 2 * M_PI * std::nearbyint((angle - seen) / (2 * M_PI));
    first = k == 1 ? angle : first;
    turned.add(angle);
  }
  t.windings = (angle - first) / (2 * M_PI);
  t.swing = turned.size() / (2 * M_PI);

  const double ratio = across > 0 ? along / across : 0, wound = across > 0 ? std::abs(t.windings) / across : 0;
  if (t.amplitude < straight_below)
    t.pattern = "straight";
  else if (wound > 0.5)   // once around for each time across
    t.pattern = "translated coiling";
  else if (t.swing < 0.6 && (t.swing < 0.45 || std::abs(ratio - 2) < 0.5))
    // never turns against the belt, and goes along it twice while across it once; small ones go along by less than an
    // edge
    t.pattern = "meanders";
  else if (wound < 0.1 && t.swing > 0.95 && t.swing < 1.4)   // a full turn to the left, then one to the right
    t.pattern = "alternating loops";
  else
    t.pattern = "W or mixed";
  return t;
}

}   // namespace slender::study
