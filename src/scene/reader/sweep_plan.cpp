#include "slender_sim/scene/sweep_plan.h"

#include <cmath>
#include <filesystem>
#include <sstream>

#include "scene_text.h"
#include "slender_sim/scene/reader.h"
#include "yaml_cursor.h"

namespace slender {

namespace {

#ifdef FUZZING_BUILD_MODE_UNSAFE_FOR_PRODUCTION   // each value is tried
constexpr long max_points = 10;
#else
constexpr long max_points = 1'000'000;
#endif

std::vector<std::string> readSeries(const YamlCursor& at)
{
  YamlMap map(at);
  bool log = false;
  map.get("log", log, "Whether the values form a geometric series. Without the key: false.");
  const YamlCursor from_at = map.require("from", "First value of the series.");
  const auto from = from_at.number({}), to = map.require("to", "Last value of the series.").number({});
  const auto count = map.require("count", "Number of values.").integer(2, max_points);
  std::vector<std::string> values;
  if (!from || !to || !count)
    return values;
  if (log && !(*from * *to > 0.0))
  {
    from_at.problem("a geometric series needs two numbers of one sign");
    return values;
  }
  for (int k = 0; k < *count; ++k)
  {
    const double share = static_cast<double>(k) / (*count - 1);
    values.push_back(shortNumber(log ? *from * std::pow(*to / *from, share) : *from + share * (*to - *from)));
  }
  return values;
}

SweepAxis readAxis(const std::string& path, const YamlCursor& at)
{
  SweepAxis axis{path, {}};
  if (at.isMap())
  {
    axis.values = readSeries(at);
    return axis;
  }
  for (const YamlCursor& item : at.items(1))
    if (item.isScalar())
      axis.values.push_back(item.tree()->scalar);
    else
      item.problem("must be a single value; lists in quotes, as in --set");
  return axis;
}

SweepPlot readPlot(const YamlCursor& at)
{
  SweepPlot plot;
  YamlMap map(at);
  map.require("x", plot.x, "Measure or path on the horizontal axis.");
  map.require("y", plot.y, "Measure on the vertical axis.");
  map.get("by", plot.by, "Path whose values get a curve each. Without the key there is one curve.");
  plot.x_label = plot.x;
  plot.y_label = plot.y;
  map.get("log", plot.log, "Whether both axes are logarithmic. Without the key: false.");
  const YamlCursor labels = map.get("labels", "Labels of both axes. Without the key: the names in x and y.");
  if (labels.present())
  {
    const auto words = labels.items(2, 2);
    if (!words.empty())
    {
      assign(plot.x_label, words[0].text());
      assign(plot.y_label, words[1].text());
    }
  }
  return plot;
}

std::string dependencies(const SweepPlan& plan)
{
  std::ostringstream text;
  for (const SweepAxis& axis : plan.axes)
  {
    text << axis.path << ":";
    for (const std::string& value : axis.values)
      text << " " << value;
    text << "\n";
  }
  text << "measures:";
  for (const std::string& measure : plan.measures)
    text << " " << measure;
  text << "\nafter: " << plan.after << "\nscene:\n" << fileText(plan.scene);
  return text.str();
}

/// Each value once, the other axes at their first.
void tryValues(const SweepPlan& plan, Problems& problems)
{
  long stride = plan.points();
  for (const SweepAxis& axis : plan.axes)
  {
    stride /= static_cast<long>(axis.values.size());
    for (std::size_t k = 0; k < axis.values.size(); ++k)
      try
      {
        plan.sceneOf(static_cast<long>(k) * stride);
      }
      catch (const SceneError& error)
      {
        problems.add(error.what());
        return;   // the rest would mostly repeat it
      }
  }
}

}   // namespace

long SweepPlan::points() const
{
  long n = 1;
  for (const SweepAxis& axis : axes)
    n *= static_cast<long>(axis.values.size());
  return n;
}

std::vector<std::string> SweepPlan::overrides(long point) const
{
  std::vector<std::string> all(axes.size());
  for (std::size_t k = axes.size(); k-- > 0;)
  {
    const long n = static_cast<long>(axes[k].values.size());
    all[k] = axes[k].path + "=" + axes[k].values[point % n];
    point /= n;
  }
  return all;
}

SceneConfig SweepPlan::sceneOf(long point) const { return readScene(scene, overrides(point)); }

SweepPlan readSweepPlan(const std::string& path)
{
  const std::string text = fileText(path);
  const YamlTree tree = parseYaml(text, path);
  Problems problems(path);
  SweepPlan plan;
  YamlMap map(YamlCursor(&tree, nullptr, "", problems));
  assign(plan.name, map.require("name", "Name of the sweep.").name());
  if (const auto scene = map.require("scene", "Path of the scene file.").text())
    plan.scene = (std::filesystem::path(path).parent_path() / *scene).string();
  const YamlCursor axes =
      map.require("axes", "Values of the scene that are varied: a map from paths to lists of values, or to series.");
  double points = 1;
  for (const auto& [name, at] : axes.members("Values of the scene at this path."))
  {
    plan.axes.push_back(readAxis(name, at));
    points *= static_cast<double>(plan.axes.back().values.size());
    if (points > max_points)   // the values of more axes might not fit into memory
      break;
  }
  if (axes.isMap() && plan.axes.empty())
    axes.problem("names no value to vary");
  if (points > max_points)
    axes.problem("make " + shortNumber(points) + " runs or more; at most " + std::to_string(max_points));
  for (const YamlCursor& measure :
       map.require("measures", "Names of the measures that are taken of each run.").items(1))
    if (const auto name = measure.name())
      plan.measures.push_back(*name);
  map.get("after", plan.after, Range::closed(0, 1e9, "s"),
          "Simulated time from which measures are taken. Without the key: 0.");
  const YamlCursor plot = map.get("plot", "Picture of the results. Without the key: none.");
  if (plot.present())
    plan.plot = readPlot(plot);
  map.finish();
  if (problems.empty())
  {
    plan.text = dependencies(plan);
    tryValues(plan, problems);
  }
  if (!problems.empty())
    throw SceneError(problems.text());
  return plan;
}

}   // namespace slender
