// A thread that falls on a moving belt (thesis 5.5, Figs. 5.1 and 5.3): patterns with the belt's speed rising and
// falling, against the quasi-static geometric model of Brun, Audoly, Ribe, Eaves and Lister, PRL 114, 174501 (2015)
// (sewing_gm.csv).
#include <algorithm>
#include <cmath>
#include <string>
#include <vector>

#include "belt_pattern.h"
#include "study/rod/rod_cases.h"
#include "thread_cases.h"

namespace slender::study {
namespace {

/// Silicone oil of Morris et al. (2008), CGS units, at a height where inertia is small: H (g/nu^2)^(1/3) = 0.59,
/// Omega^2 H / g = 0.16.
constexpr double kSewingHeight = 2.5, kSewingSpeed = 0.0537;

/// What the full and the quick form differ in. The quick one finds the same thresholds at a third of the cost.
struct Resolution
{
  double per_turn, step_angle;   ///< edges, and of the coil per step [rad]
  double still, settle, watch;   ///< turns: on the still belt, at a new speed of the belt, and then recorded
};
constexpr Resolution kFull{30, 0.03, 80, 15, 15}, kQuick{20, 0.045, 60, 12, 12};

ThreadSetup fallingThread(double radius, const Resolution& resolution)
{
  const double edge = 2 * M_PI * radius / resolution.per_turn;
  ThreadModel m;
  m.name = "sewing";
  m.density = 0.996;
  m.viscosity = 273.6;
  m.nozzle_diameter = 0.8;
  m.feed_length = edge;
  m.limits.max_edge_length = 1.5 * edge;
  m.limits.min_edge_length = 0.1 * edge;
  m.limits.max_deposited = static_cast<int>(3 * resolution.per_turn);
  m.floor = {true, 0.0, false};
  ThreadSetup t = nozzleThread(m, {0, 0, kSewingHeight}, kSewingSpeed);
  t.inputs.gravity = {0, 0, -981};
  t.state.x[0].x() += 0.1 * edge;
  t.state.v[0].y() += kSewingSpeed;
  return t;
}

/// Runs on for some turns of the coil while the belt comes to its new speed and the nozzle gives the thread a nudge,
/// then records.
std::vector<Landings::Point> observe(ThreadSetup& t, double belt, double coil_radius, double coil_frequency,
                                     double step_angle, double settle, double turns)
{
  ThreadStepper stepper = makeStepper(t);
  const double h = step_angle / coil_frequency, start = t.time, period = 2 * M_PI / coil_frequency;
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

}   // namespace

void runSewingMachine(StudyContext& context)
{
  // the coil on a still belt sets the scales
  const Resolution& resolution = context.quick() ? kQuick : kFull;
  double frequency = 7.8, radius = 0.185;
  ThreadSetup still = fallingThread(radius, resolution);
  std::vector<Landings::Point> coil =
      observe(still, 0.0, radius, frequency, resolution.step_angle, resolution.still, 6);
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
      angle += std::remainder(
          std::atan2(coil[k].y - y, coil[k].x - x) - std::atan2(coil[k - 1].y - y, coil[k - 1].x - x), 2 * M_PI);
  }
  radius = r;
  frequency = std::abs(angle) / (coil.back().time - coil.front().time);
  const double speed = radius * frequency;
  context.row().set("way", "still belt").set("Rc", radius).set("Omega_c", frequency).set("Uc", speed);

  const double interval = context.quick() ? 0.05 : 0.025, first = 0.2;
  const int parts = context.quick() ? 2 : 4;   // of an interval in which the pattern changes
  std::vector<double> ratios;
  for (double v = first; v < 1.1; v += interval)
    ratios.push_back(v);
  Plot& plot = context.plot("sewing_machine", "Patterns on a moving belt", "V / Uc", "amplitude across the belt / Rc");
  plot.log_x = plot.log_y = false;
  const struct Threshold
  {
    const char *way, *from, *to;   ///< "": any other pattern
    double low, high, tabled;      ///< range that the reference's README gives, and where its tabled solution ends
    const char* source;
  } thresholds[] = {
      {"rising", "translated coiling", "", 0.29, 0.37, 0.325, "reference: translated coiling up to about 0.29-0.37"},
      {"rising", "alternating loops", "", 0.555, 0.555, 0.555, "reference: end of the tabled alternating loops"},
      {"rising", "meanders", "straight", 1.0, 1.0, 0.995, "reference: meanders to 1"},
      {"falling", "straight", "meanders", 1.0, 1.0, 0.995, "reference: straight above 1"},
      {"falling", "meanders", "", 0.524, 0.524, 0.524, "reference: begin of the tabled meanders"},
      {"falling", "alternating loops", "", 0.29, 0.37, 0.28875, "reference: translated coiling up to about 0.29-0.37"},
  };
  int done = 0;
  double off_tabled = 0.0;
  for (const bool rising : {true, false})
  {
    if (context.quick() && !rising)
      continue;   // as long again
    const std::string way = rising ? "rising" : "falling";
    ThreadSetup t = still;
    if (!rising)
      std::reverse(ratios.begin(), ratios.end());
    std::vector<double> seen_at;
    std::vector<std::string> patterns;
    const auto look = [&](double ratio) {
      const bool fresh = patterns.empty() && !rising;
      const double settle = (fresh ? 2 : 1) * resolution.settle;
      return classifyBeltTrace(
          observe(t, ratio * speed, radius, frequency, resolution.step_angle, settle, resolution.watch), ratio * speed,
          0.05 * radius);
    };
    const auto record = [&](double ratio, const BeltTrace& trace) {
      seen_at.push_back(ratio);
      patterns.push_back(trace.pattern);
      context.row()
          .set("way", way)
          .set("V_over_Uc", ratio)
          .set("pattern", trace.pattern)
          .set("amplitude_over_Rc", trace.amplitude / radius)
          .set("frequency_across", trace.frequency_y / frequency)
          .set("frequency_along", trace.frequency_x / frequency)
          .set("windings", trace.windings)
          .set("swing_turns", trace.swing);
      Series& s = plot.at(trace.pattern + ", " + way);
      s.points = true;
      s.x.push_back(ratio);
      s.y.push_back(trace.amplitude / radius);
    };
    for (const double ratio : ratios)
    {
      context.progress(done++, static_cast<int>((context.quick() ? 1 : 2) * ratios.size()),
                       way + " to V/Uc = " + std::to_string(ratio));
      const ThreadSetup before = t;
      const BeltTrace trace = look(ratio);
      if (patterns.empty() || trace.pattern == patterns.back())
      {
        record(ratio, trace);
        continue;
      }
      // the pattern changes: the same way again in smaller steps
      t = before;
      const double from = seen_at.back();
      for (int part = 1; part <= parts; ++part)
      {
        const double between = from + (ratio - from) * part / parts;
        record(between, look(between));
      }
    }
    for (const Threshold& threshold : thresholds)
    {
      if (threshold.way != way)
        continue;
      // the last change of this kind on the way
      double at = std::nan("");
      for (std::size_t k = 1; k < patterns.size(); ++k)
        if (patterns[k - 1] == threshold.from && patterns[k] != threshold.from &&
            (threshold.to[0] == '\0' || patterns[k] == threshold.to))
          at = 0.5 * (seen_at[k - 1] + seen_at[k]);
      Row& row = context.row();
      row.set("way", way).set("pattern", std::string("end of ") + threshold.from);
      // the quick form sees no better than half of its smaller steps
      row.check(at, std::clamp(at, threshold.low, threshold.high),
                0.06 + (context.quick() ? 0.5 * interval / parts : 0.0), threshold.source);
      row.set("tabled", threshold.tabled).set("off_tabled", at - threshold.tabled);
      off_tabled = std::max(off_tabled, std::abs(at - threshold.tabled));
    }
  }
  context.metric("largest_distance_from_tabled", off_tabled);
  context.note(
      "tabled: where the geometric model's solution ends in sewing_gm.csv. That model is quasi-static with one fitted "
      "law for the heel; here");
  context.note(
      "coils and loops last to higher belt speeds, the more so the higher the thread falls: coils rising to 0.375, "
      "0.41 and 0.44 from 2, 3 and");
  context.note(
      "6 cm, loops to 0.565 and 0.62 from 2 and 3 cm. At 3 cm twice the resolution, a quarter of the step, six times "
      "longer settling or a");
  context.note(
      "hundredth of the inertia (density and 1/g) change the end of the coils by less than 0.02. No W pattern: loops "
      "go over into meanders.");
  context.note(
      "V in units of the coil's own speed on a still belt. Thresholds lie between two speeds; NaN: this change was not "
      "seen.");
}

const StudyRegistration kSewingMachineRegistration{
    "sewing_machine", "patterns of a viscous thread on a moving belt, its speed rising and falling", runSewingMachine};

}   // namespace slender::study
