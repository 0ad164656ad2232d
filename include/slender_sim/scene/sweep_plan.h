#pragma once

#include <optional>
#include <string>
#include <vector>

#include "slender_sim/scene/config.h"

namespace slender {

/// One scene value that a sweep varies.
struct SweepAxis
{
  std::string path;                  ///< as of --set: threads.0.floor.belt.x
  std::vector<std::string> values;   ///< as written in the plan or in shortest form
};

/// A picture of the results: a point per run at two columns' values, drawn by a third column's word.
struct SweepPlot
{
  std::string x, y, by;   ///< columns: paths of axes, or what the measures give; `by` may be empty
  std::string x_label, y_label;
  bool log = false;   ///< logarithmic axes
};

/// Runs of one scene over every combination of the axes' values. The last axis varies fastest.
struct SweepPlan
{
  std::string name;
  std::string scene;   ///< file
  std::vector<SweepAxis> axes;
  std::vector<std::string> measures;   ///< names, see study/measure.h
  double after = 0.0;                  ///< measures look from this simulated time on [s]
  std::optional<SweepPlot> plot;
  std::string text;   ///< what results depend on: axes, measures, the scene's text

  long points() const;
  /// One "path=value" per axis; 0 <= point < points().
  std::vector<std::string> overrides(long point) const;
  SceneConfig sceneOf(long point) const;
};

/// Reads and checks a plan; the scene file is relative to it. Every value of every axis is tried in the scene. Throws
/// SceneError (scene/reader.h) listing every problem found.
///
///     name: sewing_map
///     scene: ../scenes/sewing_map.yaml
///     axes:
///       threads.0.floor.belt.x: {from: 0.5, to: 6, count: 12}     # or a list of values; log: true for a geometric
///       series
///     measures: [belt_pattern]
///     after: 20
///     plot: {x: threads.0.floor.belt.x, y: threads.0.nozzle.position.2, by: pattern, labels: ["belt speed [m/s]",
///     "height [m]"]}
SweepPlan readSweepPlan(const std::string& path);

}   // namespace slender
