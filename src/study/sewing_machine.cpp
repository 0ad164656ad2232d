// A thread that falls on a moving belt (thesis 5.5, Figs. 5.1 and 5.3): patterns with the belt's speed rising and falling, against the
// quasi-static geometric model of Brun, Audoly, Ribe, Eaves and Lister, PRL 114, 174501 (2015) (sewing_gm.csv).
#include <algorithm>
#include <cmath>
#include <string>
#include <vector>

#include "rod_cases.h"
#include "thread_cases.h"

namespace slender::study {
namespace {

/// Silicone oil of Morris et al. (2008), CGS units, at a height where inertia is small: H (g/nu^2)^(1/3) = 0.7.
constexpr double kHeight = 3.0, kSpeed = 0.0537, kPerTurn = 30, kStepAngle = 0.03;

ThreadSetup fallingThread(double radius)
{
  const double edge = 2 * M_PI * radius / kPerTurn;
  ThreadModel m;
  m.name = "sewing";
  m.density = 0.996;
  m.viscosity = 273.6;
  m.nozzle_diameter = 0.8;
  m.feed_length = edge;
  m.limits.max_edge_length = 1.5 * edge;
  m.limits.min_edge_length = 0.1 * edge;
  m.limits.max_deposited = static_cast<int>(3 * kPerTurn);
  m.floor = {true, 0.0, false};
  ThreadSetup t = nozzleThread(m, {0, 0, kHeight}, kSpeed);
  t.inputs.gravity = {0, 0, -981};
  t.state.x[0].x() += 0.1 * edge;
  t.state.v[0].y() += kSpeed;
  return t;
}

/// What the trace of the landing points shows. Frequencies count crossings of the middle, across (y) and along (x) the belt.
struct Trace
{
  double amplitude = 0, frequency_y = 0, frequency_x = 0;   ///< amplitude: half the extent across
  double windings = 0, swing = 0;                           ///< of the tangent of what lies on the belt: net turns, and extent [turns]
  std::string pattern;
};

Trace classify(const std::vector<Landings::Point>& p, double belt, double coil_radius, double coil_frequency)
{
  Trace t;
  double y_low = 1e300, y_high = -1e300, x_low = 1e300, x_high = -1e300;
  for (const Landings::Point& q : p)
  {
    y_low = std::min(y_low, q.y);
    y_high = std::max(y_high, q.y);
    x_low = std::min(x_low, q.x);
    x_high = std::max(x_high, q.x);
  }
  const double x_middle = 0.5 * (x_low + x_high), y_middle = 0.5 * (y_low + y_high), duration = p.back().time - p.front().time;
  t.amplitude = 0.5 * (y_high - y_low);
  // a crossing counts when the trace has gone a tenth of its extent beyond the middle
  const auto crossings = [&](auto&& value, double margin) {
    int count = 0, side = 0;
    for (const Landings::Point& q : p)
    {
      const double v = value(q);
      const int now = v > margin ? 1 : v < -margin ? -1 : side;
      count += side != 0 && now != side;
      side = now;
    }
    return count;
  };
  t.frequency_y = M_PI / duration * crossings([&](const Landings::Point& q) { return q.y - y_middle; }, 0.1 * (y_high - y_low));
  t.frequency_x = M_PI / duration * crossings([&](const Landings::Point& q) { return q.x - x_middle; }, 0.1 * (x_high - x_low));
  double angle = 0, first = 0, low = 1e300, high = -1e300;
  for (std::size_t k = 1; k < p.size(); ++k)
  {
    const double along = p[k].x - p[k - 1].x - belt * (p[k].time - p[k - 1].time), across = p[k].y - p[k - 1].y;
    const double seen = std::atan2(across, -along);
    angle = k == 1 ? seen : seen + 2 * M_PI * std::nearbyint((angle - seen) / (2 * M_PI));
    first = k == 1 ? angle : first;
    low = std::min(low, angle);
    high = std::max(high, angle);
  }
  t.windings = (angle - first) / (2 * M_PI);
  t.swing = (high - low) / (2 * M_PI);

  const double turns = duration * coil_frequency / (2 * M_PI), ratio = t.frequency_y > 0 ? t.frequency_x / t.frequency_y : 0;
  if (t.amplitude < 0.05 * coil_radius)
    t.pattern = "straight";
  else if (std::abs(t.windings) > 0.5 * turns)
    t.pattern = "translated coiling";
  else if (t.swing < 0.6 && (t.amplitude < 0.5 * coil_radius || std::abs(ratio - 2) < 0.5))
    // never turns against the belt, and goes along it twice while across it once; small ones hardly go along
    t.pattern = "meanders";
  else if (std::abs(t.windings) < 0.1 * turns && t.swing > 0.95 && t.swing < 1.4)   // a full turn to the left, then one to the right
    t.pattern = "alternating loops";
  else
    t.pattern = "W or mixed";
  return t;
}

/// Runs on for some turns of the coil while the belt comes to its new speed and the nozzle gives the thread a nudge, then records.
std::vector<Landings::Point> observe(ThreadSetup& t, double belt, double coil_radius, double coil_frequency, double settle, double turns)
{
  ThreadStepper stepper = makeStepper(t);
  const double h = kStepAngle / coil_frequency, start = t.time, period = 2 * M_PI / coil_frequency;
  const double before = t.inputs.belt_velocity.x();
  while (t.time < start + settle * period)
  {
    const double since = (t.time + h - start) / period;
    t.inputs.belt_velocity.x() = before + (belt - before) * std::min(1.0, since / 2);
    t.inputs.ends[1].position.y() = since < 1 ? 0.02 * coil_radius * std::sin(M_PI * since) : 0.0;
    advance(stepper, t, h, "sewing_machine");
  }
  Landings landings(t.state);
  while (t.time < start + (settle + turns) * period)
  {
    advance(stepper, t, h, "sewing_machine");
    landings.look(t.state, t.time);
  }
  return landings.points();
}

}  // namespace

void runSewingMachine(StudyContext& context)
{
  // the coil on a still belt sets the scales
  ThreadSetup still = fallingThread(0.19);
  double frequency = 11.0, radius = 0.19;
  std::vector<Landings::Point> coil = observe(still, 0.0, radius, frequency, 80, 6);
  double x = 0, y = 0, r = 0, angle = 0;
  for (const Landings::Point& p : coil)
  {
    x += p.x / static_cast<double>(coil.size());
    y += p.y / static_cast<double>(coil.size());
  }
  for (std::size_t k = 0; k < coil.size(); ++k)
  {
    r += std::hypot(coil[k].x - x, coil[k].y - y) / static_cast<double>(coil.size());
    if (k > 0)
      angle += std::remainder(std::atan2(coil[k].y - y, coil[k].x - x) - std::atan2(coil[k - 1].y - y, coil[k - 1].x - x), 2 * M_PI);
  }
  radius = r;
  frequency = std::abs(angle) / (coil.back().time - coil.front().time);
  const double speed = radius * frequency;
  context.row().set("way", "still belt").set("Rc", radius).set("Omega_c", frequency).set("Uc", speed);

  const double interval = context.quick() ? 0.05 : 0.025, first = 0.2;
  std::vector<double> ratios;
  for (double v = first; v < 1.1; v += interval)
    ratios.push_back(v);
  Plot& plot = context.plot("sewing_machine", "Patterns on a moving belt", "V / Uc", "amplitude across the belt / Rc");
  plot.log_x = plot.log_y = false;
  const struct Threshold
  {
    const char *way, *from, *to;   ///< "": any other pattern
    double expected;
    const char* source;
  } thresholds[] = {
      {"rising", "translated coiling", "", 0.37, "geometric model: up to about 0.29 (falling) to 0.37 (rising)"},
      {"rising", "alternating loops", "", 0.555, "end of alternating loops, geometric model"},
      {"rising", "meanders", "straight", 1.0, "end of meanders, geometric model"},
      {"falling", "straight", "meanders", 1.0, "end of meanders, geometric model"},
      {"falling", "meanders", "", 0.524, "begin of meanders, geometric model"},
      {"falling", "alternating loops", "", 0.29, "the same"},
  };
  int done = 0;
  for (const bool rising : {true, false})
  {
    const std::string way = rising ? "rising" : "falling";
    ThreadSetup t = still;
    if (!rising)
      std::reverse(ratios.begin(), ratios.end());
    std::vector<std::string> patterns;
    for (const double ratio : ratios)
    {
      context.progress(done++, static_cast<int>(2 * ratios.size()), way + " to V/Uc = " + std::to_string(ratio));
      const bool fresh = patterns.empty() && !rising;
      const Trace trace = classify(observe(t, ratio * speed, radius, frequency, fresh ? 30 : 15, 15), ratio * speed, radius, frequency);
      patterns.push_back(trace.pattern);
      context.row().set("way", way).set("V_over_Uc", ratio).set("pattern", trace.pattern).set("amplitude_over_Rc", trace.amplitude / radius)
          .set("frequency_across", trace.frequency_y / frequency).set("frequency_along", trace.frequency_x / frequency)
          .set("windings", trace.windings).set("swing_turns", trace.swing);
      Series& s = plot.at(trace.pattern + ", " + way);
      s.points = true;
      s.x.push_back(ratio);
      s.y.push_back(trace.amplitude / radius);
    }
    for (const Threshold& threshold : thresholds)
    {
      if (threshold.way != way)
        continue;
      // the last change of this kind on the way
      double at = std::nan("");
      for (std::size_t k = 1; k < ratios.size(); ++k)
        if (patterns[k - 1] == threshold.from && patterns[k] != threshold.from && (threshold.to[0] == '\0' || patterns[k] == threshold.to))
          at = 0.5 * (ratios[k - 1] + ratios[k]);
      Row& row = context.row();
      row.set("way", way).set("pattern", std::string("end of ") + threshold.from);
      // the quick form sees no better than half its interval
      row.check(at, threshold.expected, 0.06 + (context.quick() ? 0.5 * interval : 0.0), threshold.source);
    }
  }
  context.note("The tabled solutions of the model end at 0.325 (coiling, rising), 0.555 (loops, rising), 0.524 (meanders, falling), 0.289 (loops, falling).");
  context.note("V in units of the coil's own speed on a still belt. Thresholds lie between two speeds; NaN: this change was not seen.");
}

}  // namespace slender::study
