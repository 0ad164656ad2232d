// A thread that coils on a still floor: frequency and radius against the height of the nozzle, going up and then down
// (thesis 5.5, Fig. 5.2; coiling_grid.csv: steady coils in the rotating frame after Ribe 2004, with their linear
// stability).
#include <algorithm>
#include <cmath>
#include <string>
#include <vector>

#include "coil_cases.h"
#include "study/rod/rod_cases.h"

namespace slender::study {
namespace {

constexpr double kMedianBound = 0.05;

double heightUnit()
{
  return std::cbrt(CoilFluid::viscosity * CoilFluid::viscosity /
                   (CoilFluid::density * CoilFluid::density * CoilFluid::gravity));
}
double frequencyUnit()
{
  return std::cbrt(CoilFluid::gravity * CoilFluid::gravity * CoilFluid::density / CoilFluid::viscosity);
}

/// Heights of the table on the given branches, ascending, each once.
std::vector<double> heightsOf(const std::vector<int>& branches)
{
  std::vector<double> heights;
  for (const SteadyCoil& c : steadyCoils())
    if (c.stable && std::count(branches.begin(), branches.end(), c.branch) &&
        (heights.empty() || c.height > heights.back() * 1.0001))
      heights.push_back(c.height);
  return heights;
}

class Pouring
{
public:
  /// Radius and frequency: a first guess, for the resolution.
  Pouring(double height, double radius, double frequency, double step_angle, double per_turn)
    : step_angle_(step_angle),
      per_turn_(per_turn),
      frequency_(frequency)
  {
    resolve(height, radius);
    thread_ = nozzleThread(model_, {0, 0, height}, CoilFluid::speed);
    thread_.inputs.gravity = {0, 0, -CoilFluid::gravity};
    // a perfectly straight thread would stand on the floor as a column
    thread_.state.x[0].x() += 0.1 * model_.feed_length;
    thread_.state.v[0].y() += 0.02 * CoilFluid::speed;
  }

  /// Moves the nozzle there, slowly.
  void raise(double height)
  {
    ThreadStepper stepper = makeStepper(thread_);
    // slower where branches end
    const double from = thread_.inputs.ends[1].position.z(),
                 rate = (from > 8 && from < 20 ? 0.005 : 0.03) * CoilFluid::speed * (1 + from);
    const int steps = static_cast<int>(std::ceil(std::abs(height - from) / (rate * step())));
    for (int k = 1; k <= steps; ++k)
    {
      thread_.inputs.ends[1].position.z() = from + (height - from) * k / steps;
      advance(stepper, thread_, step(), "coiling");
    }
  }
  /// Swirls the nozzle about its axis at the frequency guessed, less and less: from high up the thread would otherwise
  /// fold to and fro.
  void stir(double radius, double duration)
  {
    ThreadStepper stepper = makeStepper(thread_);
    const Eigen::Vector3d centre = thread_.inputs.ends[1].position;
    const double frequency = frequency_, start = thread_.time;
    while (thread_.time < start + duration)
    {
      const double t = thread_.time + step() - start, r = radius * std::max(0.0, 1 - t / duration);
      thread_.inputs.ends[1].position =
          centre + r * Eigen::Vector3d(std::cos(frequency * t), std::sin(frequency * t), 0);
      advance(stepper, thread_, step(), "coiling");
    }
    thread_.inputs.ends[1].position = centre;
  }
  /// Lets it coil for some turns, then measures some more.
  CoilTrace observe(double settling_turns, double turns)
  {
    for (double settled = 0; settled < settling_turns; settled += 2)
    {
      const CoilTrace trace = watch(2);
      if (trace.frequency() > 0)
      {
        frequency_ = trace.frequency();
        resolve(thread_.inputs.ends[1].position.z(), trace.radius());
        thread_.model = model_;
      }
    }
    return watch(turns);
  }
  const ThreadSetup& thread() const { return thread_; }
  double step() const { return step_angle_ / frequency_; }

private:
  CoilTrace watch(double turns)
  {
    ThreadStepper stepper = makeStepper(thread_);
    Landings landings(thread_.state);
    const double end = thread_.time + 2 * M_PI * turns / frequency_;
    while (thread_.time < end)
    {
      advance(stepper, thread_, step(), "coiling");
      landings.look(thread_.state, thread_.time);
    }
    return CoilTrace(landings);
  }
  /// Edges that make `per_turn` of a turn of the coil; long ones are divided on their way down.
  void resolve(double height, double radius)
  {
    const double edge = 2 * M_PI * radius / per_turn_;
    model_.name = "coiling";
    model_.density = CoilFluid::density;
    model_.viscosity = CoilFluid::viscosity;
    model_.nozzle_diameter = CoilFluid::diameter;
    model_.feed_length = std::min(edge, 0.1 * height);
    model_.limits.max_edge_length = 1.5 * edge;
    model_.limits.max_deposited = static_cast<int>(3 * per_turn_);
    model_.floor = {true, 0.0, false};
  }
  double step_angle_, per_turn_, frequency_;
  ThreadModel model_;
  ThreadSetup thread_;
};

double median(std::vector<double> v)
{
  std::sort(v.begin(), v.end());
  const std::size_t n = v.size();
  return n % 2 ? v[n / 2] : 0.5 * (v[n / 2 - 1] + v[n / 2]);
}

/// What all heights add to.
struct Results
{
  Plot &frequency_plot, &radius_plot;
  std::vector<double> frequency_errors, radius_errors;

  void plot(const std::string& label, double height, double frequency, double radius, bool points)
  {
    for (Plot* p : {&frequency_plot, &radius_plot})
    {
      Series& s = p->at(label);
      s.points = points;
      s.x.push_back(height / heightUnit());
      s.y.push_back(p == &frequency_plot ? frequency / frequencyUnit() : radius / heightUnit());
    }
  }
};

/// One height: measures, compares, plots. Returns the branch.
int recordHeight(StudyContext& context, Pouring& pouring, double height, const std::string& way, double settling_turns,
                 Results& results)
{
  const CoilTrace trace = pouring.observe(settling_turns, 4);
  const double frequency = trace.frequency(), radius = trace.radius();
  Row& row = context.row();
  row.set("way", way).set("H", height).set("H_nd", height / heightUnit()).set("Omega", frequency).set("R", radius);
  row.set("Omega_nd", frequency / frequencyUnit())
      .set("R_nd", radius / heightUnit())
      .set("unsteadiness", trace.unsteadiness());
  row.set("nodes", pouring.thread().state.nodes()).set("nodes_per_turn", trace.perTurn()).set("step", pouring.step());
  const SteadyCoil* coil = nearestStableCoil(height, frequency);
  int branch = 0;
  if (coil)
  {
    branch = coil->branch;
    results.frequency_errors.push_back(std::abs(frequency / coil->frequency - 1));
    results.radius_errors.push_back(std::abs(radius / coil->radius - 1));
    row.set("branch", branch).set("Omega_steady", coil->frequency).set("Omega_error", frequency / coil->frequency - 1);
    row.set("R_steady", coil->radius).set("R_error", radius / coil->radius - 1);
  }
  results.plot(way, height, frequency, radius, false);
  return branch;
}

}   // namespace

void runCoiling(StudyContext& context)
{
  Results results{context.plot("coiling_frequency", "Coiling frequency against height", "H / H*", "Omega / Omega*"),
                  context.plot("coiling_radius", "Coil radius against height", "H / H*", "R / H*"),
                  {},
                  {}};
  std::vector<double> heights = heightsOf({1, 3}), inertial = heightsOf({7});
  if (context.quick())
  {
    std::vector<double> some;
    for (std::size_t k = 0; k < heights.size(); ++k)
      if (k % 3 == 0)
        some.push_back(heights[k]);
    heights = some;
    inertial = {inertial[1], inertial[3]};
  }
  const double step_angle = context.quick() ? 0.04 : 0.02, per_turn = context.quick() ? 20 : 30;
  const int total = static_cast<int>(2 * heights.size() + inertial.size());
  int done = 0;
  const auto progress = [&](const std::string& way, double height) {
    context.progress(done++, total, way + " to H = " + std::to_string(height));
  };

  double jump_up = 0, jump_down = 0, last = 0;   // jumps: in the middle between two heights
  Pouring pouring(heights.front(), 0.12, 4.5, step_angle, per_turn);
  int before = 0;
  for (const double height : heights)
  {
    progress("up", height);
    pouring.raise(height);
    const int branch = recordHeight(context, pouring, height, "up", height > 10 ? 30 : 12, results);
    if (before == 1 && branch == 3)
      jump_up = 0.5 * (last + height);
    before = branch;
    last = height;
  }
  for (auto height = heights.rbegin(); height != heights.rend(); ++height)
  {
    progress("down", *height);
    pouring.raise(*height);
    const int branch = recordHeight(context, pouring, *height, "down", *height > 8 ? 30 : 12, results);
    if (before == 3 && branch == 1)
      jump_down = 0.5 * (last + *height);
    before = branch;
    last = *height;
  }
  Pouring high(inertial.front(), 0.45, 8e-3 * inertial.front() * inertial.front(), step_angle, per_turn);
  high.stir(2 * CoilFluid::diameter, 40.0);
  for (const double height : inertial)
  {
    progress("inertial", height);
    high.raise(height);
    recordHeight(context, high, height, "inertial", 30, results);
  }

  for (const SteadyCoil& c : steadyCoils())
    results.plot(c.stable ? "steady, stable" : "steady, unstable", c.height, c.frequency, c.radius, true);
  const double frequency = median(results.frequency_errors), radius = median(results.radius_errors);
  context.row()
      .set("way", "median relative error of Omega")
      .check(frequency, 0.0, kMedianBound, "steady coils on their stable branches");
  context.row().set("way", "median relative error of R").check(radius, 0.0, kMedianBound, "the same");
  // without hysteresis this would be 1
  context.row()
      .set("way", "hysteresis: jump going up over jump going down")
      .check(jump_up / jump_down, 13.64 / 10.0, 0.2, "where the stable branches end");
  context.metric("median_relative_error_frequency", frequency);
  context.metric("median_relative_error_radius", radius);
  context.metric("worst_relative_error_frequency",
                 *std::max_element(results.frequency_errors.begin(), results.frequency_errors.end()));
  context.metric("jump_up_at_H", jump_up);
  context.metric("jump_down_at_H", jump_down);
}

const StudyRegistration kCoilingRegistration{
    "coiling", "a viscous thread that coils: frequency and radius against height, up and down", runCoiling};

}   // namespace slender::study
