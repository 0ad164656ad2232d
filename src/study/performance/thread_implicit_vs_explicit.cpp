// A coiling thread (thesis Fig. 5.5): the largest steps of implicit and explicit integration, and what a simulated
// second costs.
#include <algorithm>
#include <cmath>
#include <string>
#include <vector>

#include "study/rod/rod_cases.h"
#include "study/framework/cpu_clock.h"
#include "study/thread/thread_cases.h"

namespace slender::study {
namespace {

/// The coil of the study `coiling` at H = 2.03: Omega = 1.568, R = 0.3945.
constexpr double kHeight = 2.02881, kFrequency = 1.56845, kCoilRadius = 0.394542;

ThreadSetup coilingThread()
{
  ThreadModel m;
  m.name = "coil";
  m.density = 5e-4;
  m.viscosity = 0.2;
  m.nozzle_diameter = 0.09;
  m.feed_length = 2 * M_PI * kCoilRadius / 40;
  m.floor = {true, 0.0, false};
  m.limits.max_deposited = 80;
  ThreadSetup t = nozzleThread(m, {0, 0, kHeight}, 0.615);
  t.inputs.gravity = {0, 0, -9.81};
  t.state.x[0].x() += 5e-3;
  t.state.v[0].y() += 1e-2;
  return t;
}

/// Frequency of the coil over `duration`; 0 when a step was refused or left the coil.
double coilFrequency(ThreadSetup& t, Integrator integrator, double h, double duration, double* cpu)
{
  ThreadStepper stepper(std::make_shared<ThreadModel>(t.model), NewtonConfig{}, integrator);
  Landings landings(t.state);
  const double end = t.time + duration, begin = threadSeconds();
  while (t.time < end)
  {
    if (!stepper.step(t.state, t.inputs, h).ok)
      return 0.0;
    t.time += h;
    landings.look(t.state, t.time);
  }
  *cpu = (threadSeconds() - begin) / duration;
  double angle = 0.0;
  const std::vector<Landings::Point>& p = landings.points();
  for (std::size_t k = 1; k < p.size(); ++k)
    angle += std::remainder(std::atan2(p[k].y, p[k].x) - std::atan2(p[k - 1].y, p[k - 1].x), 2 * M_PI);
  return p.size() < 2 ? 0.0 : std::abs(angle) / (p.back().time - p.front().time);
}

}   // namespace

void runThreadImplicitVsExplicit(StudyContext& context)
{
  ThreadSetup settled = coilingThread();
  double cpu = 0.0;
  context.progress(0, 3, "settling");
  coilFrequency(settled, Integrator::implicit_euler, 0.01, 80.0, &cpu);

  // implicit: while the coil's frequency stays within 2 %
  double implicit_step = 0, implicit_cpu = 0;
  context.progress(1, 3, "implicit steps");
  for (const double h :
       {0.01, 0.02, 0.04, 0.06, 0.08, 0.1})   // the stepper itself divides one in which more than an edge flows out
  {
    ThreadSetup t = settled;
    double seconds = 0;
    coilFrequency(t, Integrator::implicit_euler, h, 40.0, &seconds);   // first its own steady state
    const double seen = coilFrequency(t, Integrator::implicit_euler, h, 40.0, &seconds), error = seen / kFrequency - 1;
    context.row()
        .set("integrator", "implicit_euler")
        .set("step", h)
        .set("frequency_error", error)
        .set("cpu_per_second", seconds);
    if (std::abs(error) > 0.02)
      break;
    implicit_step = h;
    implicit_cpu = seconds;
  }

  // explicit: over the passage of some edges through the nozzle
  double explicit_step = 0, explicit_cpu = 0;
  const double duration = (context.quick() ? 1.2 : 4.0) * settled.model.feed_length / 0.615;
  for (double h = 4e-6; h > 1e-8; h /= std::sqrt(2.0))
  {
    context.progress(2, 3, "explicit steps");
    ThreadSetup t = settled;
    double seconds = 0;
    coilFrequency(t, Integrator::symplectic_euler, h, duration, &seconds);
    Row& row = context.row();
    row.set("integrator", "symplectic_euler").set("step", h);
    if (seconds == 0)
    {
      row.set("outcome", "blew up");
      continue;
    }
    // the same motion: every node where the implicit integration with a short step has it
    ThreadSetup other = settled;
    ThreadStepper stepper = makeStepper(other);
    while (other.time < t.time - 1e-9)
      advance(stepper, other, std::min(1e-3, t.time - other.time), "thread_implicit_vs_explicit");
    double away = 0.0;
    for (int i = 0; i < t.state.nodes(); ++i)
    {
      const auto same = std::find(other.state.id.begin(), other.state.id.end(), t.state.id[i]);
      if (same != other.state.id.end())
        away = std::max(away, (t.state.x[i] - other.state.x[same - other.state.id.begin()]).norm());
    }
    const bool stable = away < 0.01 * kCoilRadius;
    row.set("outcome", stable ? "stable" : "rattles")
        .set("cpu_per_second", seconds)
        .set("distance_from_implicit_over_R", away / kCoilRadius);
    if (!stable)
      continue;
    explicit_step = h;
    explicit_cpu = seconds;
    break;
  }
  context.metric("step_ratio", implicit_step / explicit_step);
  context.metric("speedup", explicit_cpu / implicit_cpu);
  context.note(
      "implicit: the largest step that keeps the coil's frequency within 2 %; explicit: the largest that stays");
  context.note("within 1 % of the coil's radius of an implicit integration with a step of 1e-3, by factors of sqrt 2.");
  context.note("The explicit step evaluates strains and forces once each.");
}

const StudyRegistration kThreadImplicitVsExplicitRegistration{
    "thread_implicit_vs_explicit", "a coiling thread: largest steps and cost of implicit against explicit integration",
    runThreadImplicitVsExplicit};

}   // namespace slender::study
