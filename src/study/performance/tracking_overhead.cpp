// Steps of cloths of the thesis's sizes with and without tracking, beside its table 6.1.
#include <cmath>
#include <stdexcept>

#include "slender_sim/world/world.h"
#include "slender_sim/study/study.h"
#include "study/tracking/tracking_cases.h"

namespace slender::study {

namespace {

constexpr double kTrackedStep = 0.01;   // [s]
constexpr int kRepeats = 3;             // of each step that is timed, from the same state; the quickest counts
constexpr double kEqual = 1.05;         // ratio of errors that counts as equal
constexpr int kMostPasses = 10;         // to get there
constexpr double kExact = 1e-9;         // tolerance of the linear solver in steps that others are compared with

/// Sums over the steps of a run.
struct StepCost
{
  double seconds = 0, square = 0;
  int linear_iterations = 0, steps = 0, compared = 0;

  double milliseconds() const { return 1e3 * seconds / steps; }
  double iterations() const { return static_cast<double>(linear_iterations) / steps; }
  /// Root mean square over vertices and steps of what the linear solver left [m].
  double error() const { return std::sqrt(square / compared); }
};

/// One cloth, alone or with collisions with itself.
class Solver
{
public:
  StepCost cost;

  Solver(const std::shared_ptr<const ClothModel>& model, ClothOptions options, bool collides)
    : stepper_(model, options),
      exact_(model, [options]() mutable {
        options.linear_tolerance = kExact;
        return options;
      }())
  {
    if (!collides)
      return;
    WorldModel world;
    world.cloths.push_back({model, options, ContactProperties(), {}, {}});
    world.cloths[0].contact->method = ContactMethod::impulses;
    world.time.step = kTrackedStep;
    world_state_.cloths.push_back(makeClothState(*model, model->rest.vertices));
    world_ = std::make_unique<World>(std::move(world), world_state_);
    world_inputs_.cloths.resize(1);
  }

  /// A step from the state given, which stays. Counted, and compared with an exact solution, if told so.
  ClothState step(const ClothState& from, const ClothInputs& inputs, bool counts, bool compares, int repeats)
  {
    ClothState end;
    StepReport report;
    double least = 1e300;
    for (int k = 0; k < repeats; ++k)
    {
      end = from;
      const double start = threadSeconds();
      report = advance(end, inputs);
      least = std::min(least, threadSeconds() - start);
      if (!report.ok)
        throw std::runtime_error("tracking_overhead: " + report.message);
    }
    if (counts)
    {
      cost.seconds += least;
      cost.linear_iterations += report.linear_iterations;
      ++cost.steps;
    }
    if (compares)
    {
      ClothState solved = from;
      if (!exact_.step(solved, inputs, kTrackedStep).ok)
        throw std::runtime_error("tracking_overhead: a step with an exact linear solver failed");
      cost.square += (end.x - solved.x).squaredNorm() / static_cast<double>(end.x.cols());
      ++cost.compared;
    }
    return end;
  }

private:
  StepReport advance(ClothState& state, const ClothInputs& inputs)
  {
    if (!world_)
      return stepper_.step(state, inputs, kTrackedStep);
    world_state_.cloths = {state};
    world_inputs_.cloths[0] = inputs;
    const StepReport report = world_->step(world_state_, world_inputs_);
    state = world_state_.cloths[0];
    return report;
  }

  ClothStepper stepper_, exact_;
  std::unique_ptr<World> world_;
  WorldState world_state_;
  WorldInputs world_inputs_;
};

struct TrackingCosts
{
  StepCost tracked, beside, alone;   ///< beside: free steps from the tracked cloth's states; alone: of a free run
};

enum class Purpose
{
  errors,
  times,
  times_with_collisions
};

TrackingCosts run(StudyContext& context, const TrackedCase& c, double tolerance, int steps, Purpose purpose)
{
  const bool collides = purpose == Purpose::times_with_collisions;
  auto free_model = std::make_shared<ClothModel>(*c.model);
  free_model->averages.clear();
  ClothOptions options;
  options.one_newton_step = true;
  Solver beside(free_model, options, collides), alone(free_model, options, collides);
  options.linear_tolerance = tolerance;
  Solver tracked(c.model, options, collides);
  ClothInputs inputs, free_inputs;
  inputs.gravity = free_inputs.gravity = c.gravity;
  inputs.wind = free_inputs.wind = c.wind;
  ClothState state = c.start(), free_state = state;
  for (int i = 0; i < steps; ++i)
  {
    if (i % 10 == 0)
      context.progress(i, steps, c.name);
    // what stays is factored in the first one
    const bool counts = i > 0, compares = counts && !collides && i % 5 == 0;
    inputs.averages = c.constraints->averages(c.motion((i + 1) * kTrackedStep));
    const int repeats = counts && purpose != Purpose::errors ? kRepeats : 1;
    beside.step(state, free_inputs, counts, compares, repeats);
    if (purpose == Purpose::times)
      free_state = alone.step(free_state, free_inputs, counts, compares, repeats);
    state = tracked.step(state, inputs, counts, compares, repeats);
  }
  return {tracked.cost, beside.cost, alone.cost};
}

}   // namespace

void runTrackingOverhead(StudyContext& context)
{
  useOneBlasThread();
  const int steps = context.quick() ? 30 : 120;
  double worst = -1.0, worst_run = -1.0, worst_colliding = -1.0, worst_error = 0.0;
  for (const TrackedCase& c : thesisCases())
  {
    // errors of both no larger than the free cloth's: the tolerance of a tracked one counts from a load of its own
    const double usual = ClothOptions().linear_tolerance;
    double tolerance = usual;
    for (int pass = 0; pass < kMostPasses; ++pass)
    {
      const TrackingCosts costs = run(context, c, tolerance, steps, Purpose::errors);
      const double ratio = costs.tracked.error() / costs.beside.error();
      if (ratio <= kEqual)
        break;
      tolerance /= std::min(ratio, 2.0);
    }
    const TrackingCosts costs = run(context, c, tolerance, steps, Purpose::times);
    const StepCost &tracked = costs.tracked, &beside = costs.beside, &alone = costs.alone;
    const TrackingCosts colliding = run(context, c, tolerance, steps / 2, Purpose::times_with_collisions);
    const double overhead = tracked.seconds / beside.seconds - 1, run_overhead = tracked.seconds / alone.seconds - 1;
    worst = std::max(worst, overhead);
    const double colliding_overhead = colliding.tracked.seconds / colliding.beside.seconds - 1;
    worst_colliding = std::max(worst_colliding, colliding_overhead);
    worst_run = std::max(worst_run, run_overhead);
    worst_error = std::max(worst_error, tracked.error() / beside.error());
    context.row()
        .set("case", c.name)
        .set("section", c.section)
        .set("guide", static_cast<double>(c.guide.vertices.cols()))
        .set("vertices", c.model->vertices())
        .set("constraints", c.constraints->count())
        .set("tracked_ms", tracked.milliseconds())
        .set("free_ms", beside.milliseconds())
        .set("overhead", overhead)
        .set("free_run_ms", alone.milliseconds())
        .set("overhead_run", run_overhead)
        .set("colliding_tracked_ms", colliding.tracked.milliseconds())
        .set("colliding_free_ms", colliding.beside.milliseconds())
        .set("overhead_colliding", colliding_overhead)
        .set("tolerance", tolerance)
        .set("tracked_iterations", tracked.iterations())
        .set("free_iterations", beside.iterations())
        .set("free_run_iterations", alone.iterations())
        .set("tracked_error_um", 1e6 * tracked.error())
        .set("free_error_um", 1e6 * beside.error())
        .set("free_run_error_um", 1e6 * alone.error())
        .set("equal_error", tracked.error() <= kEqual * beside.error() ? "yes" : "no")
        .set("published_tracked_s", c.published_tracked)
        .set("published_free_s", c.published_free)
        .set("published_overhead", c.published_tracked / c.published_free - 1);
  }
  context.metric("max_overhead", worst);
  context.metric("max_overhead_colliding", worst_colliding);
  context.metric("max_overhead_of_runs", worst_run);
  context.metric("max_error_ratio", worst_error);
  context.note(
      "free_ms, overhead: steps without tracking from the tracked cloth's own states; free_run_ms, overhead_run: of "
      "the same cloth left to itself, "
      "which falls, or stays at rest, and has less to solve. colliding: with collisions of the cloth with itself, as "
      "overhead.");
  context.note(
      "errors: what conjugate gradients leave of a step's positions; the tracked run's tolerance is such that its "
      "error is not larger.");
  context.note("published: with collisions, on a 2 GHz CPU of 2007.");
}

const StudyRegistration kTrackingOverheadRegistration{
    "tracking_overhead", "steps of cloth with and without tracking, in the sizes of the thesis's table 6.1, beside it",
    runTrackingOverhead};

}   // namespace slender::study
