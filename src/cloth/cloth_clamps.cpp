// Clamped faces of a cloth that are held or released.
#include "cloth_work.h"
#include "slender_sim/energy/isometric_bending.h"

namespace slender {

namespace {

/// Returns the clamped faces of the model whose vertices the state holds, one entry per face.
std::vector<char> heldClamps(const ClothModel& model, const ClothState& state)
{
  std::vector<char> faces = facesWithin(model.rest, state.pins);
  for (std::size_t f = 0; f < faces.size(); ++f)
    faces[f] = static_cast<char>(faces[f] != 0 && model.clamped_faces[f] != 0);
  return faces;
}

}   // namespace

void ClothWork::followClamps(const ClothState& state)
{
  if (model->clamped_faces.empty() || (clamps_known_ && state.pins == clamp_pins_))
    return;
  std::vector<char> acting = heldClamps(*model, state);
  if (acting != (clamped_model_ ? clamped_model_ : model)->clamped_faces)
  {
    std::shared_ptr<const ClothModel> next;
    if (acting != model->clamped_faces)
    {
      ClothModel changed = *model;
      changed.clamped_faces = std::move(acting);
      next = std::make_shared<const ClothModel>(std::move(changed));
    }
    // The bending stiffness of clamped edges is part of constant matrices and of their factors, so that the system is
    // built anew.
    buildSystem(next ? *next : *model);
    clamped_model_ = std::move(next);
    system->useBudget(*budget_);
    linear->useBudget(*budget_);
    systemChanged();
  }
  clamp_pins_ = state.pins;
  clamps_known_ = true;
}

}   // namespace slender
