#include "sweep_runs.h"

#include <unistd.h>

#include <algorithm>
#include <cstdio>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <memory>
#include <sstream>
#include <stdexcept>

#include "arguments.h"
#include "slender_sim/dynamics/integrator.h"
#include "slender_sim/scene/simulation.h"
#include "slender_sim/study/measure.h"
#include "slender_sim/study/output.h"

namespace slender::sweep {

namespace fs = std::filesystem;
using study::csvCell;

namespace {

std::vector<const study::MeasureKind*> kindsOf(const SweepPlan& plan)
{
  std::vector<const study::MeasureKind*> kinds;
  for (const std::string& name : plan.measures)
  {
    kinds.push_back(study::findMeasure(name));
    if (kinds.back())
      continue;
    std::string known;
    for (const auto& kind : study::measureKinds())
      known += (known.empty() ? "" : ", ") + kind.name;
    throw BadInput(plan.name + ": measures: no measure " + name + "; there are " + known);
  }
  return kinds;
}

std::vector<std::string> columnsOf(const SweepPlan& plan)
{
  std::vector<std::string> columns{"point"};
  for (const SweepAxis& axis : plan.axes)
    columns.push_back(axis.path);
  columns.insert(columns.end(), {"status", "reason"});
  for (const auto* kind : kindsOf(plan))
    columns.insert(columns.end(), kind->columns.begin(), kind->columns.end());
  return columns;
}

std::size_t columnOf(const SweepPlan& plan, const std::string& name)
{
  const std::vector<std::string> columns = columnsOf(plan);
  const auto at = std::find(columns.begin(), columns.end(), name);
  if (at != columns.end())
    return at - columns.begin();
  std::string known;
  for (const std::string& column : columns)
    known += (known.empty() ? "" : ", ") + column;
  throw BadInput(plan.name + ": plot: no column " + name + "; there are " + known);
}

std::string csvLine(const std::vector<std::string>& cells)
{
  std::string line;
  for (const std::string& cell : cells)
    line += (line.empty() ? "" : ",") + csvCell(cell);
  return line;
}

/// One line of results.csv; `measured`: empty when the run failed.
std::string resultLine(const SweepPlan& plan, long point, const std::string& reason,
                       const std::vector<study::Row>& measured)
{
  std::vector<std::string> cells{std::to_string(point)};
  for (const std::string& override : plan.overrides(point))
    cells.push_back(override.substr(override.find('=') + 1));
  cells.insert(cells.end(), {measured.empty() ? "failed" : "done", reason});
  const auto kinds = kindsOf(plan);
  for (std::size_t k = 0; k < kinds.size(); ++k)
    for (const std::string& column : kinds[k]->columns)
      cells.push_back(measured.empty() ? "" : study::valueText(measured[k], column));
  return csvLine(cells);
}

std::vector<study::Row> measure(const SweepPlan& plan, long point)
{
  SceneConfig scene = plan.sceneOf(point);
  std::vector<std::unique_ptr<study::Measure>> measures;
  for (const auto* kind : kindsOf(plan))
    measures.push_back(kind->make(scene));
  const double step = scene.time.step;
  const long steps = stepsUntil(scene.time.duration, step),
             first = plan.after > 0 ? std::min(steps, stepsUntil(plan.after, step)) : 0;
  Simulation simulation(std::move(scene));
  simulation.setThreads(1);
  for (long k = 0; k <= steps; ++k)
  {
    if (k > 0)
    {
      const StepReport report = simulation.step(simulation.defaultInputs());
      if (!report.ok)
        throw std::runtime_error("step " + std::to_string(k) + ", " + toString(report.failure) + ": " + report.message);
    }
    if (k >= first)
      for (auto& m : measures)
        m->look(simulation);
  }
  std::vector<study::Row> rows;
  for (const auto& m : measures)
    rows.push_back(m->finish());
  return rows;
}

/// Points that failed are left out.
std::string draw(const SweepPlan& plan, const std::string& folder, const std::vector<std::vector<std::string>>& lines)
{
  const SweepPlot& wanted = *plan.plot;
  const std::size_t x = columnOf(plan, wanted.x), y = columnOf(plan, wanted.y), status = columnOf(plan, "status");
  study::StudyContext context(plan.name, false, false);
  study::Plot& plot = context.plot(plan.name, plan.name, wanted.x_label, wanted.y_label);
  plot.log_x = plot.log_y = wanted.log;
  plot.lines = false;
  for (const auto& cells : lines)
  {
    if (cells[status] != "done")
      continue;
    study::Series& series = plot.at(wanted.by.empty() ? "runs" : cells[columnOf(plan, wanted.by)]);
    series.x.push_back(std::strtod(cells[x].c_str(), nullptr));
    series.y.push_back(std::strtod(cells[y].c_str(), nullptr));
  }
  return study::writePlots(folder, context);
}

}   // namespace

void checkPlan(const SweepPlan& plan)
{
  for (const auto* kind : kindsOf(plan))
    kind->make(plan.sceneOf(0));
  if (plan.plot)
    for (const std::string& name : {plan.plot->x, plan.plot->y, plan.plot->by})
      if (!name.empty())
        columnOf(plan, name);
}

std::string pointFile(const std::string& out, long point)
{
  char name[48];
  std::snprintf(name, sizeof name, "/points/%07ld.csv", point);
  return out + name;
}

void writeWhole(const std::string& path, const std::string& text)
{
  const std::string temporary = path + "." + std::to_string(getpid());
  std::ofstream file(temporary);
  file << text;
  file.close();
  std::error_code error;
  fs::rename(temporary, path, error);
  if (!file || error)
    throw std::runtime_error("cannot write " + path);
}

void prepare(const SweepPlan& plan, const std::string& out)
{
  std::error_code error;
  fs::create_directories(out + "/points", error);
  if (error)
    throw BadInput("cannot make directory " + out + "/points: " + error.message());
  const std::string copy = out + "/plan.txt";
  std::ifstream old(copy);
  std::ostringstream text;
  text << old.rdbuf();
  if (!old)
    writeWhole(copy, plan.text);
  else if (text.str() != plan.text)
    throw BadInput(out + " holds runs of another plan or scene (see " + copy + "); give another --out or delete it");
}

void runPoint(const SweepPlan& plan, const std::string& out, long point)
{
  if (point >= plan.points())
    throw BadInput("--point " + std::to_string(point) + ": the plan has " + std::to_string(plan.points()) +
                   " runs, from 0");
  if (fs::exists(pointFile(out, point)))
    return;
  std::string line;
  try
  {
    line = resultLine(plan, point, "", measure(plan, point));
  }
  catch (const std::exception& error)
  {
    std::string reason = error.what();
    std::replace(reason.begin(), reason.end(), '\n', ' ');
    line = resultLine(plan, point, reason, {});
  }
  writeWhole(pointFile(out, point), line + "\n");
}

long collect(const SweepPlan& plan, const std::string& out, const std::map<long, std::string>& crashed)
{
  std::string all = csvLine(columnsOf(plan)) + "\n";
  std::vector<std::vector<std::string>> lines;
  long failed = 0;
  const std::size_t status = columnOf(plan, "status"), reason = columnOf(plan, "reason");
  for (long point = 0; point < plan.points(); ++point)
  {
    const auto crash = crashed.find(point);
    std::string line;
    if (crash != crashed.end())
      line = resultLine(plan, point, crash->second, {});
    else
    {
      std::ifstream file(pointFile(out, point));
      if (!std::getline(file, line))
        throw std::runtime_error("cannot read " + pointFile(out, point));
    }
    all += line + "\n";
    lines.push_back(study::csvCells(line));
    if (lines.back()[status] == "done")
      continue;
    ++failed;
    std::fprintf(stderr, "sweep: run %ld failed: %s\n", point, lines.back()[reason].c_str());
  }
  writeWhole(out + "/results.csv", all);
  if (plan.plot)
  {
    const std::string problem = draw(plan, out, lines);
    if (!problem.empty())
      std::fprintf(stderr, "sweep: %s\n", problem.c_str());
  }
  std::printf("%ld runs, %ld failed: %s/results.csv\n", plan.points(), failed, out.c_str());
  return failed;
}

}   // namespace slender::sweep
