#include "loaded_study.h"

#include <cmath>
#include <cstdlib>
#include <filesystem>

#include "scene/reader/yaml_tree.h"
#include "study/framework/whole_file.h"
#include "slender_sim/scene/reader.h"

namespace slender {

namespace {

double numberOf(const YamlTree& value)   // JSON has null for what is not finite
{
  double number = 0.0;
  return isNumber(value.scalar, number) ? number : std::nan("");
}

study::Row rowOf(const YamlTree& tree)
{
  study::Row row;
  for (const auto& [key, value] : tree.members)
    if (double number = 0.0; value.kind == YamlTree::Kind::null || isNumber(value.scalar, number))
      row.set(key, numberOf(value));
    else
      row.set(key, value.scalar);
  return row;
}

}   // namespace

bool isNumber(const std::string& text, double& value)
{
  char* end = nullptr;
  value = std::strtod(text.c_str(), &end);
  return !text.empty() && *end == '\0';
}

LoadedStudy loadStudy(const ReportedStudy& study)
{
  LoadedStudy loaded;
  loaded.error = study.failure;
  const std::string file = study.folder + "/result.json";
  if (!std::filesystem::exists(file))
    return loaded;
  loaded.found = true;
  try
  {
    const YamlTree tree = parseYaml(wholeFile(file), file);   // JSON is YAML
    const YamlTree *studies = tree.find("studies"),
                   *result = studies && !studies->items.empty() ? &studies->items.front() : nullptr;
    const YamlTree* metrics = result ? result->find("metrics") : nullptr;
    if (!metrics)
      throw SceneError(file + ": has no metrics");
    for (const auto& [name, value] : metrics->members)
      loaded.metrics.emplace_back(name, numberOf(value));
    if (const YamlTree* rows = result->find("rows"))
      for (const YamlTree& row : rows->items)
        loaded.rows.push_back(rowOf(row));
    if (const YamlTree* notes = result->find("notes"))
      for (const YamlTree& note : notes->items)
        loaded.notes.push_back(note.scalar);
    if (const YamlTree* error = result->find("error"))
      loaded.error = error->scalar;
    if (const YamlTree* seconds = result->find("wall_seconds"))
      loaded.seconds = numberOf(*seconds);
  }
  catch (const SceneError& error)
  {
    loaded.error = error.what();
  }
  return loaded;
}

}   // namespace slender
