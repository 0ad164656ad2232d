#pragma once

#include <memory>
#include <string>
#include <utility>
#include <vector>

#include "slender_sim/scene/simulation.h"
#include "slender_sim/study/study.h"

namespace slender::study {

/// Something that a sweep measures of a run.
class Measure
{
public:
  virtual ~Measure() = default;
  /// Once, before the first step looked at, and after every step from there on.
  virtual void look(const Simulation& simulation) = 0;
  /// Of columns(), in their order.
  virtual Row finish() const = 0;
};

struct MeasureKind
{
  std::string name, description;
  std::vector<std::string> columns;
  /// Throws std::invalid_argument when the scene has nothing to measure.
  std::unique_ptr<Measure> (*make)(const SceneConfig& scene);
};

const std::vector<MeasureKind>& measureKinds();
/// nullptr when there is none of this name.
const MeasureKind* findMeasure(const std::string& name);

}   // namespace slender::study
