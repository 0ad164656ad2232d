#include <algorithm>
#include <cmath>
#include <limits>
#include <string>
#include <vector>

#include "study/rod/rod_cases.h"
#include "study/framework/cpu_clock.h"
#include "slender_sim/study/study.h"

namespace slender::study {
namespace {

constexpr double kFrame = 1.0 / 30;
constexpr int kVertices = 200;

/// A hair: 30 cm, E = 3 GPa, 1300 kg/m^3, radius 0.05 mm, in air (linear drag: falls at about 0.4 m/s).
/// `soft` lowers EA until its explicit limit equals that of bending, which favours the explicit code as much as a code
/// with a separate inextensibility constraint would.
RodSetup hair(bool soft)
{
  RodCase c = circularRod(0.3, 5e-5, 3e9, 0.4, 1300, kVertices - 1);
  const double h = c.length / c.edges;
  if (soft)
    c.stretch = 4 * c.bend / (h * h);   // (2/h) sqrt(EA/rhoA) = (4/h^2) sqrt(EI/rhoA)
  c.drag = c.linear_density * 9.81 / 0.4;
  RodSetup rod = straightRod(c);
  rod.inputs.gravity = {0, 0, -9.81};
  rod.hold(0, 0, true);
  return rod;
}

/// The root turns and shifts as on a shaken head: 3 cm at 1 Hz sideways, from rest.
Eigen::Vector3d rootPosition(double t)
{
  const double start = std::min(1.0, t);
  return {0, 0.03 * start * start * std::sin(2 * M_PI * t), 0.01 * start * start * std::sin(3 * t)};
}

struct Strand
{
  std::vector<Eigen::Matrix3Xd> frames;   ///< nodes at the end of every frame
  double cpu_seconds = 0;
  int iterations = 0, cuts = 0;
  std::string failure;
};

/// Plays `frames` frames in equal steps of at most `step`.
Strand play(bool soft, const TimeConfig& time, int frames)
{
  RodSetup rod = hair(soft);
  const Pose start = rod.inputs.grasps[0].X_WG;
  RodStepper stepper(rod.model, time);
  const int per_frame = std::max(1, static_cast<int>(std::ceil(kFrame / time.step - 1e-9)));
  Strand strand;
  const double begin = threadSeconds();
  double bookkeeping = 0;
  for (int f = 0; f < frames; ++f)
  {
    for (int i = 1; i <= per_frame; ++i)
    {
      rod.inputs.grasps[0].X_WG.position =
          start.position + rootPosition((f + static_cast<double>(i) / per_frame) * kFrame);
      const StepReport report = stepper.step(rod.state, rod.inputs, kFrame / per_frame);
      strand.iterations += report.iterations;
      strand.cuts += report.cut_steps;
      if (!report.ok)
        strand.failure = std::string(toString(report.failure)) + ": " + report.message;
      else if (i % 100 == 0 || i == per_frame)
        if (!(rod.state.x.cwiseAbs().maxCoeff() < 1.0))   // a 30 cm hair cannot get there
          strand.failure = "unbounded";
      if (!strand.failure.empty())
        return strand;
    }
    const double pause = threadSeconds();
    strand.frames.push_back(rod.state.x);
    bookkeeping += threadSeconds() - pause;
  }
  strand.cpu_seconds = threadSeconds() - begin - bookkeeping;
  return strand;
}

/// Root mean square distance over nodes and frames [m].
double distance(const Strand& a, const Strand& b)
{
  double sum = 0;
  const std::size_t frames = std::min(a.frames.size(), b.frames.size());
  for (std::size_t f = 0; f < frames; ++f)
    sum += (a.frames[f] - b.frames[f]).colwise().squaredNorm().mean();
  return std::sqrt(sum / static_cast<double>(frames));
}

/// Largest stable explicit step: bisection (to 5 %) around the linear limit, 15 frames each.
double largestExplicitStep(bool soft)
{
  const RodSetup rod = hair(soft);
  const RodModel& m = *rod.model;
  const double h = m.rest_length[1], line = m.mass[1] / h;
  const double limit = 2 / std::max(2 / h * std::sqrt(m.stretch_modulus[1] / line),
                                    4 / (h * h) * std::sqrt(m.bend_modulus(0, 1) / line));
  double stable = 0, unstable = 3 * limit;
  for (double step = limit; stable == 0; step *= 0.8)
    (play(soft, timeConfig(Integrator::symplectic_euler, step), 15).failure.empty() ? stable : unstable) = step;
  while (unstable > 1.05 * stable)
  {
    const double step = std::sqrt(stable * unstable);
    (play(soft, timeConfig(Integrator::symplectic_euler, step), 15).failure.empty() ? stable : unstable) = step;
  }
  return stable;
}

}   // namespace

void runImplicitVsExplicit(StudyContext& context)
{
  Plot& plot = context.plot("rod_implicit_vs_explicit", "Hair strand, 200 vertices: error against run time",
                            "CPU time [s]", "rms error [m]");
  double worst_ratio = std::numeric_limits<double>::infinity(), worst_speedup = worst_ratio;
  for (const bool soft : {true, false})
  {
    const char* material = soft ? "soft stretch" : "own EA";
    // at its own EA the explicit code takes 30,000 steps per frame
    const int frames = context.quick() ? (soft ? 10 : 1) : (soft ? 300 : 30);
    context.progress(soft ? 0 : 10, 20, std::string(material) + ", largest explicit step");
    const double explicit_step = largestExplicitStep(soft);
    context.progress(soft ? 1 : 11, 20, std::string(material) + ", explicit run");
    Strand explicit_run = play(soft, timeConfig(Integrator::symplectic_euler, explicit_step), frames);
    if (!explicit_run.failure.empty())   // what was stable for half a second need not be so for ten
      explicit_run = play(soft, timeConfig(Integrator::symplectic_euler, 0.8 * explicit_step), frames);
    StepReport outcome;
    outcome.ok = explicit_run.failure.empty();
    outcome.message = explicit_run.failure;
    require(outcome, "explicit hair");

    context.progress(soft ? 2 : 12, 20, std::string(material) + ", converged solution");
    const Strand exact = play(soft, timeConfig(Integrator::tr_bdf2, 5e-5, 1e-8), frames);
    const double explicit_error = distance(explicit_run, exact);
    const auto add = [&](const char* integrator, double step, double tolerance, const Strand& s, double error) {
      context.row()
          .set("material", material)
          .set("integrator", integrator)
          .set("step_s", step)
          .set("newton_tolerance", tolerance)
          .set("frames", frames)
          .set("rms_error_m", error)
          .set("cpu_seconds", s.cpu_seconds)
          .set("speedup", explicit_run.cpu_seconds / s.cpu_seconds)
          .set("microseconds_per_step", 1e6 * s.cpu_seconds / (frames * std::ceil(kFrame / step - 1e-9)))
          .set("iterations", s.iterations)
          .set("cuts", s.cuts)
          .set("failure", s.failure.empty() ? "" : s.failure);
      if (!s.failure.empty())
        return;
      Series& series = plot.at(std::string(integrator) + ", " + material);
      series.x.push_back(s.cpu_seconds);
      series.y.push_back(error);
    };
    add(toString(Integrator::symplectic_euler), explicit_step, 0, explicit_run, explicit_error);

    double implicit_step = 0, cheapest = std::numeric_limits<double>::infinity();
    int done = soft ? 3 : 13;
    for (const Integrator integrator : implicitIntegrators())
    {
      context.progress(done++, 20, std::string(material) + ", " + toString(integrator));
      for (const int per_frame : {1, 2, 4, 8, 12, 16, 24, 32, 48, 64, 96, 128, 192})
      {
        // Steps far below the explicit code's error cost much and show nothing.
        if (per_frame > (soft ? 64 : 192) || (context.quick() && per_frame % 12 == 0 && soft))
          continue;
        for (const double tolerance : {1e-6, 1e-2})
        {
          if (tolerance < 1e-3 && per_frame > 8)
            continue;
          const double step = kFrame / per_frame;
          const Strand s = play(soft, timeConfig(integrator, step, tolerance), frames);
          const double error = s.failure.empty() ? distance(s, exact) : std::numeric_limits<double>::quiet_NaN();
          add(toString(integrator), step, tolerance, s, error);
          if (s.failure.empty() && s.cuts == 0)
            implicit_step = std::max(implicit_step, step);
          if (s.failure.empty() && error <= explicit_error)
            cheapest = std::min(cheapest, s.cpu_seconds);
        }
      }
    }
    const double ratio = implicit_step / explicit_step, speedup = explicit_run.cpu_seconds / cheapest;
    context.row()
        .set("material", material)
        .set("integrator", "summary")
        .set("step_ratio", ratio)
        .set("speedup", speedup)
        .set("rms_error_m", explicit_error);
    context.metric(std::string("step_ratio_") + (soft ? "soft" : "own_EA"), ratio);
    context.metric(std::string("speedup_") + (soft ? "soft" : "own_EA"), speedup);
    worst_ratio = std::min(worst_ratio, ratio);
    worst_speedup = std::min(worst_speedup, speedup);
  }
  context.metric("step_ratio", worst_ratio);
  context.metric("speedup", worst_speedup);
  context.note(
      "hair: 0.3 m, r = 0.05 mm, E = 3 GPa, 1300 kg/m^3, drag for a terminal speed of 0.4 m/s, root shaken by 3 cm at "
      "1 Hz.");
  context.note(
      "step_ratio: largest implicit step without cuts (a frame at most) over the largest stable explicit step;");
  context.note(
      "speedup: explicit run at that step over the cheapest implicit run whose error is no larger. The lesser of both "
      "materials counts;");
  context.note(
      "soft stretch: EA lowered until stretching limits the explicit step no more than bending does. The thesis has 70 "
      "and 8.6.");
}

const StudyRegistration kImplicitVsExplicitRegistration{
    "rod_implicit_vs_explicit", "hair strand: stable steps and cost of implicit against explicit integration",
    runImplicitVsExplicit};

}   // namespace slender::study
