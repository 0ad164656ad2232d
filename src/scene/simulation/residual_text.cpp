#include "slender_sim/scene/residual_text.h"

#include <algorithm>
#include <cstdio>

namespace slender {

std::string residualText(const SceneConfig& scene, double residual)
{
  char text[200];
  const bool one_step = std::any_of(scene.cloths.begin(), scene.cloths.end(),
                                    [](const ClothConfig& cloth) { return cloth.one_newton_step; });
  std::snprintf(
      text, sizeof text, "%.3g of the largest force%s", residual,
      one_step ? " (no failure: one_newton_step leaves forces unbalanced, which the next step takes up)" : "");
  return text;
}

}   // namespace slender
