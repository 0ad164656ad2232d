#include "impulse_cloths.h"

#include <algorithm>

#include "tracked_parts.h"

namespace slender {

ImpulseCloths::ImpulseCloths(const WorldModel& world, std::vector<int> cloths)
  : WorldObject(0),
    world_(world),
    cloths_(std::move(cloths))
{
  ClothGroupModel model;
  model.solids = world.obstacles;
  model.ignored.resize(world.obstacles.size());
  for (const int c : cloths_)
  {
    const WorldModel::Cloth& cloth = world.cloths[c];
    for (const IgnoredSolid& solid : cloth.ignored)
      model.ignored[static_cast<std::size_t>(solid.number)].push_back(static_cast<int>(model.cloths.size()));
    model.cloths.push_back(cloth.model);
    model.contact.push_back(*cloth.contact);
    model.options.push_back(cloth.options);
  }
  for (std::size_t b = 0; b < world.bodies.size(); ++b)
    if (const WorldModel::Body& body = world.bodies[b]; body.shape && !body.body.simulated)
    {
      bodies_.push_back(static_cast<int>(b));
      model.solids.push_back(body.solid());
    }
  const ClothOptions common = model.options.front();
  group_ = std::make_unique<ClothGroup>(std::move(model), common);
  inputs_.cloths.resize(cloths_.size());
}

/// Obstacles and bodies are only read: others move them.
void ImpulseCloths::take(const WorldState& state)
{
  state_.cloths.resize(cloths_.size());
  for (std::size_t k = 0; k < cloths_.size(); ++k)
    state_.cloths[k] = state.cloths[cloths_[k]];
  state_.solids = state.obstacles;
  for (const int b : bodies_)
    state_.solids.push_back(state.bodies[b].X_WB * world_.bodies[b].X_BS);
}

bool ImpulseCloths::load(const WorldState& state, const WorldInputs& inputs, StepReport&)
{
  take(state);
  for (std::size_t k = 0; k < cloths_.size(); ++k)
    takeClothInputs(world_, cloths_[k], state, inputs, inputs_.cloths[k]);
  inputs_.solids.clear();
  for (const GraspTarget& obstacle : inputs.obstacles)
    inputs_.solids.push_back(normalized(obstacle.X_WG));
  for (const int b : bodies_)
    inputs_.solids.push_back(normalized(inputs.bodies[b].X_WG) * world_.bodies[b].X_BS);
  return true;
}

void ImpulseCloths::finish(WorldState& state)
{
  for (std::size_t k = 0; k < cloths_.size(); ++k)
    std::swap(state.cloths[cloths_[k]], state_.cloths[k]);
}

void ImpulseCloths::finishGuide(const WorldInputs& inputs, WorldState& state, StepReport& report) const
{
  for (std::size_t k = 0; k < cloths_.size(); ++k)
    takeClothGuide(world_, cloths_[k], inputs_.cloths[k].averages, group_->averageForces(static_cast<int>(k)), inputs,
                   state, report);
}

void ImpulseCloths::check(const WorldState& state)
{
  take(state);
  group_->checkIntersections(state_);
}

int ImpulseCloths::placeOf(int cloth) const
{
  return static_cast<int>(std::lower_bound(cloths_.begin(), cloths_.end(), cloth) - cloths_.begin());
}

int ImpulseCloths::vertices() const
{
  int sum = 0;
  for (const int c : cloths_)
    sum += world_.cloths[c].model->vertices();
  return sum;
}

}   // namespace slender
