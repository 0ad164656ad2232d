#include "rod_islands.h"

#include <algorithm>
#include <stdexcept>

#include "slender_sim/rod/averaged_rod.h"

namespace slender {

namespace {

class LoneRod : public RodIsland
{
public:
  LoneRod(const WorldModel& world, int rod) : world_(world), rod_(rod), stepper_(world.rods[rod].model, world.time) {}

  StepReport step(WorldState& state, const WorldInputs& inputs) override
  {
    return stepper_.step(state.rods[rod_], inputs.rods[rod_], world_.time.step);
  }
  StepReport solveEquilibrium(WorldState& state, const WorldInputs& inputs) override
  {
    return stepper_.solveEquilibrium(state.rods[rod_], inputs.rods[rod_]);
  }
  const std::vector<Wrench>& wrenches(int) const override { return stepper_.wrenches(); }
  RodEnergies energies(int, const RodState& state, const Eigen::Vector3d& gravity) const override
  {
    return stepper_.energies(state, gravity);
  }
  RodStepper* stepper() override { return &stepper_; }

private:
  const WorldModel& world_;
  int rod_;
  RodStepper stepper_;
};

class TrackedRod : public RodIsland
{
public:
  TrackedRod(const WorldModel& world, int rod)
    : world_(world),
      rod_(rod),
      constraints_(world.rods[rod].tracked.sets->front().constraints),
      stepper_(world.rods[rod].model, {constraints_, &constraints_->matrix()}, world.time)
  {
  }

  StepReport step(WorldState& state, const WorldInputs& inputs) override
  {
    constraints_->averages(inputs.rod_guides[rod_], targets_);
    return stepper_.step(state.rods[rod_], inputs.rods[rod_], targets_, world_.time.step);
  }
  StepReport solveEquilibrium(WorldState&, const WorldInputs&) override
  {
    throw std::invalid_argument("a rod that tracks a guide has no statics");
  }
  void finish(WorldState& state, const WorldInputs& inputs, StepReport& report) override
  {
    state.rod_guides[rod_].points = inputs.rod_guides[rod_];
    state.rod_guides[rod_].forces = stepper_.averageForces();
    report.tracking_error = std::max(
        report.tracking_error, constraints_->error(targets_, state.rods[rod_].x) / world_.rods[rod_].tracked.size);
  }
  const std::vector<Wrench>& wrenches(int) const override { return stepper_.wrenches(); }
  RodEnergies energies(int, const RodState& state, const Eigen::Vector3d& gravity) const override
  {
    return stepper_.energies(state, gravity);
  }

private:
  const WorldModel& world_;
  int rod_;
  std::shared_ptr<const WeakConstraints> constraints_;
  AveragedRod stepper_;
  Eigen::Matrix3Xd targets_;   ///< of its averages at the end of the step [m]
};

class ExplicitRods : public RodIsland
{
public:
  ExplicitRods(const WorldModel& world, std::vector<int> rods, std::vector<int> bodies, WorldState& state)
    : world_(world),
      rods_(std::move(rods)),
      bodies_(std::move(bodies))
  {
    RodGroupModel model;
    for (int r : rods_)
      model.rods.push_back(world.rods[r].model);
    for (int b : bodies_)
      model.bodies.push_back(world.bodies[b].body);
    addContact(model);
    const Loan<ExplicitRods> loan(*this, state);
    for (const WorldModel::RodWeld& weld : world.welds)
      makeWeld(model, state_, placeOf(rods_, weld.rod), weld.first_node, weld.last_node, placeOf(bodies_, weld.body));
    group_ = std::make_unique<RodGroup>(std::move(model), world.time);
    group_->checkClearance(state_);
  }

  StepReport step(WorldState& state, const WorldInputs& inputs) override
  {
    const Loan<ExplicitRods> loan(*this, state);
    takeInputs(inputs);
    return group_->step(state_, inputs_, world_.time.step);
  }
  StepReport solveEquilibrium(WorldState& state, const WorldInputs& inputs) override
  {
    const Loan<ExplicitRods> loan(*this, state);
    takeInputs(inputs);
    return group_->solveEquilibrium(state_, inputs_);
  }
  void setThreads(int threads) override { group_->setThreads(threads); }
  const std::vector<Wrench>& wrenches(int rod) const override { return group_->wrenches(rod); }
  RodEnergies energies(int rod, const RodState& state, const Eigen::Vector3d& gravity) const override
  {
    return group_->energies(rod, state, gravity);
  }

private:
  friend class Loan<ExplicitRods>;

  static int placeOf(const std::vector<int>& parts, int part)
  {
    return static_cast<int>(std::find(parts.begin(), parts.end(), part) - parts.begin());
  }

  void addContact(RodGroupModel& model) const
  {
    for (std::size_t k = 0; k < rods_.size(); ++k)
    {
      if (const auto& contact = world_.rods[rods_[k]].contact)
      {
        model.contact.rods.push_back(*contact);
        model.contact.rods.back().rod = static_cast<int>(k);
      }
    }
    for (const WorldModel::Obstacle& obstacle : world_.obstacles)
      model.contact.obstacles.push_back({obstacle.shape, obstacle.friction});
    if (model.contact.rods.empty())
      return;
    for (std::size_t k = 0; k < bodies_.size(); ++k)
    {
      const WorldModel::Body& body = world_.bodies[bodies_[k]];
      if (body.shape)
        model.contact.bodies.push_back({static_cast<int>(k), *body.shape, body.X_BS, body.friction});
    }
    model.contact.options = world_.contact;
  }

  void exchange(WorldState& state)
  {
    state_.rods.resize(rods_.size());
    state_.bodies.resize(bodies_.size());
    for (std::size_t k = 0; k < rods_.size(); ++k)
      std::swap(state_.rods[k], state.rods[rods_[k]]);
    for (std::size_t k = 0; k < bodies_.size(); ++k)
      std::swap(state_.bodies[k], state.bodies[bodies_[k]]);
    std::swap(state_.obstacles, state.obstacles);
    std::swap(state_.obstacle_velocities, state.obstacle_velocities);
  }

  void takeInputs(const WorldInputs& inputs)
  {
    inputs_.gravity = inputs.gravity;
    inputs_.rods.resize(rods_.size());
    inputs_.bodies.resize(bodies_.size());
    for (std::size_t k = 0; k < rods_.size(); ++k)
      inputs_.rods[k] = inputs.rods[rods_[k]];
    for (std::size_t k = 0; k < bodies_.size(); ++k)
      inputs_.bodies[k] = inputs.bodies[bodies_[k]];
    inputs_.obstacles = inputs.obstacles;
  }

  const WorldModel& world_;
  std::vector<int> rods_, bodies_;   ///< of the world
  std::unique_ptr<RodGroup> group_;
  RodGroupState state_;
  RodGroupInputs inputs_;
};

}   // namespace

std::unique_ptr<RodIsland> makeLoneRod(const WorldModel& world, int rod)
{
  return std::make_unique<LoneRod>(world, rod);
}

std::unique_ptr<RodIsland> makeTrackedRod(const WorldModel& world, int rod)
{
  return std::make_unique<TrackedRod>(world, rod);
}

std::unique_ptr<RodIsland> makeExplicitRods(const WorldModel& world, std::vector<int> rods, std::vector<int> bodies,
                                            WorldState& state)
{
  return std::make_unique<ExplicitRods>(world, std::move(rods), std::move(bodies), state);
}

}   // namespace slender
