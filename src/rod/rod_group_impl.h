#pragma once

#include <memory>
#include <vector>

#include "slender_sim/rod/rod_group.h"
#include "step_loop.h"

namespace slender {

class RodGroup::Impl
{
public:
  Impl(RodGroupModel m, const TimeConfig& t) : model(std::move(m)), time(t)
  {
    std::vector<RodStepper::Impl*> parts;
    for (const auto& rod : model.rods)
    {
      rods.push_back(std::make_unique<RodStepper::Impl>(rod, time));
      parts.push_back(rods.back().get());
    }
    loop = std::make_unique<StepLoop>(time, parts, &model);
  }

  StepReport step(RodGroupState& state, const RodGroupInputs& inputs, double duration);
  // group_statics.cpp
  StepReport solveEquilibrium(RodGroupState& state, const RodGroupInputs& inputs, bool leave_saddles);

  RodGroupModel model;
  TimeConfig time;
  std::vector<std::unique_ptr<RodStepper::Impl>> rods;
  std::unique_ptr<StepLoop> loop;
  int threads = 0;
  RodGroupInputs inputs;   ///< with the targets of grasps that driven bodies carry
};

}   // namespace slender
