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

const Eigen::Matrix3Xd& guideOf(const TrackedGuide& tracked, const WorldState& state, const WorldInputs& inputs)
{
  return tracked.leader >= 0 ? state.cloths[tracked.leader].x : inputs.guides[tracked.input];
}

}   // namespace

const FunctionSet& functionsOf(const WorldModel& model, const ObjectRef& part, const WorldState& state)
{
  return model.tracked(part).sets->at(part.isCloth() ? state.cloths[part.index].average_set : 0);
}

void takeTargets(const WorldModel& model, const ObjectRef& part, const WorldState& state, const WorldInputs& inputs,
                 Eigen::Matrix3Xd& targets)
{
  functionsOf(model, part, state).constraints->averages(guideOf(model.tracked(part), state, inputs), targets);
  state.guide(part).blend.apply(static_cast<double>(state.steps + 1) * model.time.step, targets);
}

void takeClothInputs(const WorldModel& model, int cloth, const WorldState& state, const WorldInputs& inputs,
                     ClothInputs& to)
{
  const ClothInputs& from = inputs.cloths[cloth];
  to.pins = from.pins;
  to.gravity = from.gravity;
  to.wind = from.wind;
  to.forces = from.forces;
  if (model.cloths[cloth].tracked.sets)
    takeTargets(model, {ObjectRef::cloth, cloth}, state, inputs, to.averages);
  else
    to.averages = from.averages;
}

TrackingError errorOf(const WorldModel& model, const ObjectRef& part, const WorldState& state,
                      const Eigen::Matrix3Xd& targets)
{
  static const std::vector<int> none;
  const WeakConstraints& constraints = *functionsOf(model, part, state).constraints;
  const Eigen::Matrix3Xd& x = state.points(part);
  const std::vector<int>& at_bound = part.isCloth() ? state.cloths[part.index].at_bound : none;
  TrackingError error;
  error.blend = state.guide(part).blend.left(state.time);
  for (int i = 0; i < constraints.count(); ++i)
  {
    double& worst = std::binary_search(at_bound.begin(), at_bound.end(), i) ? error.at_bound : error.met;
    worst = std::max(worst, constraints.distance(i, targets, x));
  }
  return error;
}

void takeGuide(const WorldModel& model, const ObjectRef& part, const Eigen::Matrix3Xd& targets,
               const Eigen::Matrix3Xd& forces, const WorldInputs& inputs, WorldState& state, StepReport& report)
{
  const TrackedGuide& tracked = model.tracked(part);
  if (!tracked.sets)
    return;
  GuideState& held = state.guide(part);
  const Eigen::Matrix3Xd& guide = guideOf(tracked, state, inputs);
  if (tracked.sets->size() > 1)
    held.velocity = (guide - held.points) / model.time.step;
  held.points = guide;
  if (!held.blend.active(state.time))
    held.blend = FunctionBlend();
  held.forces = forces;
  report.tracking_error = std::max(report.tracking_error, errorOf(model, part, state, targets).met / tracked.size);
  if (part.isCloth())
    report.forces_at_bound += static_cast<int>(state.cloths[part.index].at_bound.size());
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
