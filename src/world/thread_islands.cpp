#include "thread_islands.h"

namespace slender {

namespace {

class LoneThread : public Island
{
public:
  LoneThread(const WorldModel& world, int thread)
    : world_(world),
      thread_(thread),
      group_(world.threads[thread].model, world.time.newton)
  {
  }

  StepReport step(WorldState& state, const WorldInputs& inputs) override
  {
    return group_.step(state.threads[thread_], inputs.threads[thread_], world_.time.step);
  }
  StepReport solveEquilibrium(WorldState&, const WorldInputs&) override { return {}; }
  void finish(WorldState& state, const WorldInputs&, StepReport&) override
  {
    state.end_loads[thread_] = group_.endLoads();
  }

private:
  const WorldModel& world_;
  int thread_;
  ThreadGroup group_;
};

class TouchingThreadsIsland : public Island
{
public:
  TouchingThreadsIsland(const WorldModel& world, std::vector<int> threads, WorldState& state)
    : world_(world),
      threads_(std::move(threads))
  {
    TouchingModel model;
    for (int k : threads_)
    {
      model.threads.push_back(world.threads[k].model);
      model.touches.push_back(*world.threads[k].contact);
    }
    for (const WorldModel::Obstacle& obstacle : world.obstacles)
      model.obstacles.push_back({obstacle.shape, obstacle.friction, obstacle.name});
    model.options = world.contact;
    group_ = std::make_unique<TouchingThreads>(std::move(model), world.time.newton);
    const Loan<TouchingThreadsIsland> loan(*this, state);
    group_->checkClearance(state_);
  }

  StepReport step(WorldState& state, const WorldInputs& inputs) override
  {
    inputs_.threads.resize(threads_.size());
    for (std::size_t k = 0; k < threads_.size(); ++k)
      inputs_.threads[k] = inputs.threads[threads_[k]];
    inputs_.obstacles.clear();
    for (const GraspTarget& obstacle : inputs.obstacles)
      inputs_.obstacles.push_back(normalized(obstacle.X_WG));
    const Loan<TouchingThreadsIsland> loan(*this, state);
    return group_->step(state_, inputs_, world_.time.step);
  }
  StepReport solveEquilibrium(WorldState&, const WorldInputs&) override { return {}; }
  void finish(WorldState& state, const WorldInputs&, StepReport&) override
  {
    for (std::size_t k = 0; k < threads_.size(); ++k)
      state.end_loads[threads_[k]] = group_->endLoads(static_cast<int>(k));
  }
  const std::vector<ContactTerm>* contacts() const override { return &group_->contacts(); }

private:
  friend class Loan<TouchingThreadsIsland>;

  /// Obstacles are only read here: others move them.
  void exchange(WorldState& state)
  {
    state_.threads.resize(threads_.size());
    for (std::size_t k = 0; k < threads_.size(); ++k)
      std::swap(state_.threads[k], state.threads[threads_[k]]);
    state_.obstacles = state.obstacles;
    std::swap(state_.contact_stiffness, state.thread_contact_stiffness);
  }

  const WorldModel& world_;
  std::vector<int> threads_;   ///< of the world
  std::unique_ptr<TouchingThreads> group_;
  TouchingState state_;
  TouchingInputs inputs_;
};

}   // namespace

std::unique_ptr<Island> makeLoneThread(const WorldModel& world, int thread)
{
  return std::make_unique<LoneThread>(world, thread);
}

std::unique_ptr<Island> makeTouchingThreads(const WorldModel& world, std::vector<int> threads, WorldState& state)
{
  return std::make_unique<TouchingThreadsIsland>(world, std::move(threads), state);
}

}   // namespace slender
