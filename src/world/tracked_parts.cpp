#include "tracked_parts.h"

#include <algorithm>
#include <cmath>

namespace slender {

namespace {

/// The set takes over in the step that begins after so many.
bool isDue(const FunctionSet& set, std::uint64_t steps, double step)
{
  return set.from && std::ceil(*set.from / step - 1e-6) == static_cast<double>(steps);
}

const Eigen::Matrix3Xd& guideOf(const WorldModel& model, int cloth, const WorldState& state, const WorldInputs& inputs)
{
  const int leader = model.cloths[cloth].tracked.leader;
  return leader >= 0 ? state.cloths[leader].x : inputs.cloth_guides[cloth];
}

}   // namespace

const FunctionSet& functionsOf(const TrackedGuide& tracked, const ClothState& cloth)
{
  return tracked.sets->at(static_cast<std::size_t>(cloth.average_set));
}

void takeClothInputs(const WorldModel& model, int cloth, const WorldState& state, const WorldInputs& inputs,
                     ClothInputs& to)
{
  const ClothInputs& from = inputs.cloths[cloth];
  to.pins = from.pins;
  to.gravity = from.gravity;
  to.wind = from.wind;
  to.forces = from.forces;
  if (!model.cloths[cloth].tracked.sets)
  {
    to.averages = from.averages;
    return;
  }
  functionsOf(model.cloths[cloth].tracked, state.cloths[cloth])
      .constraints->averages(guideOf(model, cloth, state, inputs), to.averages);
  state.cloth_guides[cloth].blend.apply(static_cast<double>(state.steps + 1) * model.time.step, to.averages);
}

TrackingError errorOf(const TrackedGuide& tracked, const ClothState& cloth, const GuideState& guide, double time,
                      const Eigen::Matrix3Xd& targets)
{
  const WeakConstraints& constraints = *functionsOf(tracked, cloth).constraints;
  TrackingError error;
  error.blend = guide.blend.left(time);
  for (int i = 0; i < constraints.count(); ++i)
  {
    double& worst = std::binary_search(cloth.at_bound.begin(), cloth.at_bound.end(), i) ? error.at_bound : error.met;
    worst = std::max(worst, constraints.distance(i, targets, cloth.x));
  }
  return error;
}

void takeClothGuide(const WorldModel& model, int cloth, const Eigen::Matrix3Xd& targets, const Eigen::Matrix3Xd& forces,
                    const WorldInputs& inputs, WorldState& state, StepReport& report)
{
  const TrackedGuide& tracked = model.cloths[cloth].tracked;
  if (!tracked.sets)
    return;
  GuideState& held = state.cloth_guides[cloth];
  const Eigen::Matrix3Xd& guide = guideOf(model, cloth, state, inputs);
  if (tracked.sets->size() > 1)
    held.velocity = (guide - held.points) / model.time.step;
  held.points = guide;
  if (!held.blend.active(state.time))
    held.blend = FunctionBlend();
  held.forces = forces;
  const ClothState& moved = state.cloths[cloth];
  report.tracking_error =
      std::max(report.tracking_error, errorOf(tracked, moved, held, state.time, targets).met / tracked.size);
  report.forces_at_bound += static_cast<int>(moved.at_bound.size());
}

/// The guide's speed is that of the last step, as the cloth's is: where it jumped just then the cloth did, too.
void takeOver(const TrackedGuide& tracked, std::size_t set, double blend, double time, ClothState& cloth,
              GuideState& guide)
{
  const WeakConstraints& functions = *tracked.sets->at(set).constraints;
  guide.blend = FunctionBlend::between(functions, guide.points, guide.velocity, cloth.x, cloth.v, time, blend);
  cloth.average_set = static_cast<int>(set);
  cloth.at_bound.clear();
  guide.forces.setZero(3, functions.count());
}

bool functionsDue(const WorldModel& model, const WorldState& state)
{
  return std::any_of(model.cloths.begin(), model.cloths.end(), [&](const WorldModel::Cloth& cloth) {
    const auto& sets = cloth.tracked.sets;
    return sets && std::any_of(sets->begin(), sets->end(),
                               [&](const FunctionSet& set) { return isDue(set, state.steps, model.time.step); });
  });
}

void takeOverDue(const WorldModel& model, WorldState& state)
{
  for (std::size_t k = 0; k < model.cloths.size(); ++k)
  {
    const TrackedGuide& tracked = model.cloths[k].tracked;
    const FunctionSet* latest = nullptr;
    for (std::size_t s = 0; tracked.sets && s < tracked.sets->size(); ++s)
    {
      const FunctionSet& set = (*tracked.sets)[s];
      if (isDue(set, state.steps, model.time.step) && (!latest || *set.from > *latest->from))
        latest = &set;
    }
    if (latest)
    {
      takeOver(tracked, static_cast<std::size_t>(latest - tracked.sets->data()), latest->blend, state.time,
               state.cloths[k], state.cloth_guides[k]);
    }
  }
}

}   // namespace slender
