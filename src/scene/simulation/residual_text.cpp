#include "slender_sim/scene/residual_text.h"

#include <algorithm>

#include "scene/reader/yaml_number.h"

namespace slender {

std::string residualText(const SceneConfig& scene, double residual)
{
  const bool one_step = std::any_of(scene.cloths.begin(), scene.cloths.end(),
                                    [](const ClothConfig& cloth) { return cloth.one_newton_step; });
  const auto touches = [](const auto& object) { return object.contact.has_value(); };
  const bool contact = std::any_of(scene.rods.begin(), scene.rods.end(), touches) ||
                       std::any_of(scene.cloths.begin(), scene.cloths.end(), touches) ||
                       std::any_of(scene.threads.begin(), scene.threads.end(), touches);
  return shortNumber(residual, 3) + " of the largest force" +
         (one_step  ? " (no failure: one_newton_step leaves forces unbalanced, which the next step takes up)"
          : contact ? " (with contact a step ends when positions change by less than a thousandth of contact.gap)"
                    : "");
}

}   // namespace slender
