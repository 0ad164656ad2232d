#pragma once

#include <memory>
#include <utility>
#include <vector>

#include "slender_sim/cloth/cloth_stepper.h"

namespace slender::test {

/// Model, state and inputs of a cloth that belong together. The cloth starts at rest.
struct Cloth
{
  std::shared_ptr<ClothModel> model;
  ClothState state;
  ClothInputs inputs;

  explicit Cloth(ClothModel m)
    : model(std::make_shared<ClothModel>(std::move(m))),
      state(makeClothState(*model, model->rest.vertices))
  {
  }
  void pin(const std::vector<int>& vertices)
  {
    pinVertices(state, vertices);
    inputs.pins.resize(3, state.pins.size());
    for (std::size_t k = 0; k < state.pins.size(); ++k)
      inputs.pins.col(k) = state.x.col(state.pins[k]);
  }
};

}   // namespace slender::test
