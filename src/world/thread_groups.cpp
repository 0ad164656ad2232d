#include "thread_groups.h"

namespace slender {

namespace {

class LoneThread : public StepGroup
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

}   // namespace

std::unique_ptr<StepGroup> makeLoneThread(const WorldModel& world, int thread)
{
  return std::make_unique<LoneThread>(world, thread);
}

}   // namespace slender
