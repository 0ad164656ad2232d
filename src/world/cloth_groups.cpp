#include "cloth_groups.h"

#include <stdexcept>

#include "tracked_parts.h"

namespace slender {

namespace {

class TouchingCloths : public StepGroup
{
public:
  TouchingCloths(const WorldModel& world, std::vector<int> cloths) : world_(world), cloths_(std::move(cloths))
  {
    ClothGroupModel model;
    for (int k : cloths_)
    {
      model.cloths.push_back(world.cloths[k].model);
      model.contact.push_back(*world.cloths[k].contact);
      model.options.push_back(world.cloths[k].options);
    }
    model.solids = world.obstacles;
    model.ignored.resize(world.obstacles.size());
    for (std::size_t k = 0; k < cloths_.size(); ++k)
      for (const IgnoredSolid& solid : world.cloths[cloths_[k]].ignored)
        model.ignored[static_cast<std::size_t>(solid.number)].push_back(static_cast<int>(k));
    for (std::size_t b = 0; b < world.bodies.size(); ++b)
    {
      const WorldModel::Body& body = world.bodies[b];
      if (!body.shape || body.body.simulated)
        continue;
      bodies_.push_back(static_cast<int>(b));
      model.solids.push_back(body.solid());
    }
    const ClothOptions common = model.options.front();
    group_ = std::make_unique<ClothGroup>(std::move(model), common);
  }

  StepReport step(WorldState& state, const WorldInputs& inputs) override
  {
    inputs_.cloths.resize(cloths_.size());
    for (std::size_t k = 0; k < cloths_.size(); ++k)
    {
      if (tracks(k))
        trackedInputs(world_, cloths_[k], state, inputs, inputs_.cloths[k]);
      else
        inputs_.cloths[k] = inputs.cloths[cloths_[k]];
    }
    inputs_.solids.clear();
    for (const GraspTarget& obstacle : inputs.obstacles)
      inputs_.solids.push_back(normalized(obstacle.X_WG));
    for (const int b : bodies_)
      inputs_.solids.push_back(normalized(inputs.bodies[b].X_WG) * world_.bodies[b].X_BS);
    const Loan<TouchingCloths> loan(*this, state);
    return group_->step(state_, inputs_, world_.time.step);
  }
  StepReport solveEquilibrium(WorldState&, const WorldInputs&) override
  {
    throw std::invalid_argument("cloth with contact has no statics");
  }
  void finish(WorldState& state, const WorldInputs& inputs, StepReport& report) override
  {
    for (std::size_t k = 0; k < cloths_.size(); ++k)
    {
      if (tracks(k))
      {
        takeClothGuide(world_, cloths_[k], inputs_.cloths[k].averages, group_->averageForces(static_cast<int>(k)),
                       inputs, state, report);
      }
    }
  }
  ClothEnergies clothEnergies(int cloth, const ClothState& state, const Eigen::Vector3d& gravity) const override
  {
    return group_->stepper(cloth).energies(state, gravity);
  }
  const Eigen::Matrix3Xd& pinForces(int cloth) const override { return group_->pinForces(cloth); }
  Eigen::Matrix3Xd clothContactForces(int cloth) const override { return group_->contactForces(cloth); }
  void forgetContacts() override { group_->forgetContacts(); }
  void check(WorldState& state) override
  {
    const Loan<TouchingCloths> loan(*this, state);
    group_->checkIntersections(state_);
  }

private:
  friend class Loan<TouchingCloths>;

  bool tracks(std::size_t k) const { return world_.cloths[cloths_[k]].tracked.sets != nullptr; }

  /// Obstacles and bodies are only read here: others move them.
  void exchange(WorldState& state)
  {
    state_.cloths.resize(cloths_.size());
    for (std::size_t k = 0; k < cloths_.size(); ++k)
      std::swap(state_.cloths[k], state.cloths[cloths_[k]]);
    state_.solids = state.obstacles;
    for (const int b : bodies_)
      state_.solids.push_back(state.bodies[b].X_WB * world_.bodies[b].X_BS);
  }

  const WorldModel& world_;
  std::vector<int> cloths_, bodies_;   ///< of the world
  std::unique_ptr<ClothGroup> group_;
  ClothGroupState state_;
  ClothGroupInputs inputs_;
};

}   // namespace

std::unique_ptr<StepGroup> makeTouchingCloths(const WorldModel& world, std::vector<int> cloths)
{
  return std::make_unique<TouchingCloths>(world, std::move(cloths));
}

}   // namespace slender
