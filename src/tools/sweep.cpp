// sweep PLAN.yaml --out DIR [--jobs N]: runs of a scene over combinations of its values, each in a process of its own, resumable.

#include <fcntl.h>
#include <spawn.h>
#include <sys/file.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <cstdio>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <iostream>
#include <limits>
#include <map>
#include <sstream>
#include <stdexcept>
#include <string>
#include <thread>

#include "arguments.h"
#include "slender_sim/scene/reader.h"
#include "slender_sim/scene/simulation.h"
#include "slender_sim/scene/sweep_plan.h"
#include "slender_sim/study/measure.h"
#include "slender_sim/study/output.h"

extern char** environ;

namespace {

namespace fs = std::filesystem;
using slender::BadInput;
using slender::SweepPlan;
using slender::study::csvCell;

constexpr int kDone = 0, kSomeFailed = 1, kBadInput = 2;

const char kUsage[] =
    "usage: sweep PLAN.yaml --out DIR [--jobs N] [--point K] [--count]\n"
    "  --out    DIR/results.csv at the end; runs that are done already are not done again\n"
    "  --jobs   runs at a time (default: one per processor)\n"
    "  --point  only run K, for other engines, e.g. `parallel sweep PLAN --out DIR --point ::: $(seq 0 199)`\n"
    "           or a Slurm array with `--point $SLURM_ARRAY_TASK_ID`; then `sweep PLAN --out DIR` collects\n"
    "  --count  prints the number of runs\n"
    "exit status: 0 done, 1 some runs failed (results.csv names the reasons), 2 bad input\n";

struct Options
{
  std::string plan, out;
  long jobs = std::max(1u, std::thread::hardware_concurrency()), point = -1;
  bool count = false;
};

Options parse(const std::vector<std::string>& words)
{
  Options options;
  for (std::size_t i = 0; i < words.size(); ++i)
  {
    const std::string& word = words[i];
    const auto value = [&]() -> const std::string& {
      if (i + 1 == words.size())
        throw BadInput(word + ": its value is missing\n" + kUsage);
      return words[++i];
    };
    if (word == "--out")
      options.out = value();
    else if (word == "--jobs")
      options.jobs = slender::parseCount(word, value(), 1, 100000);
    else if (word == "--point")
      options.point = slender::parseCount(word, value(), 0, std::numeric_limits<int>::max());
    else if (word == "--count")
      options.count = true;
    else if (word.rfind("-", 0) == 0)
      throw BadInput(word + ": unknown option\n" + kUsage);
    else if (!options.plan.empty())
      throw BadInput(word + ": only one plan can be run\n" + kUsage);
    else
      options.plan = word;
  }
  if (options.plan.empty())
    throw BadInput(std::string("a plan is missing\n") + kUsage);
  if (options.out.empty() && !options.count)
    throw BadInput(std::string("--out is missing\n") + kUsage);
  return options;
}

std::vector<const slender::study::MeasureKind*> kindsOf(const SweepPlan& plan)
{
  std::vector<const slender::study::MeasureKind*> kinds;
  for (const std::string& name : plan.measures)
  {
    kinds.push_back(slender::study::findMeasure(name));
    if (kinds.back())
      continue;
    std::string known;
    for (const auto& kind : slender::study::measureKinds())
      known += (known.empty() ? "" : ", ") + kind.name;
    throw BadInput(plan.name + ": measures: no measure " + name + "; there are " + known);
  }
  return kinds;
}

std::vector<std::string> columnsOf(const SweepPlan& plan)
{
  std::vector<std::string> columns{"point"};
  for (const slender::SweepAxis& axis : plan.axes)
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

std::vector<std::string> cellsOf(const std::string& line)
{
  std::vector<std::string> cells(1);
  bool quoted = false;
  for (std::size_t i = 0; i < line.size(); ++i)
    if (line[i] == '"' && quoted && i + 1 < line.size() && line[i + 1] == '"')
      cells.back() += line[i++];
    else if (line[i] == '"')
      quoted = !quoted;
    else if (line[i] == ',' && !quoted)
      cells.emplace_back();
    else
      cells.back() += line[i];
  return cells;
}

/// One line of results.csv; `measured`: empty when the run failed.
std::string resultLine(const SweepPlan& plan, long point, const std::string& reason, const std::vector<slender::study::Row>& measured)
{
  std::vector<std::string> cells{std::to_string(point)};
  for (const std::string& override : plan.overrides(point))
    cells.push_back(override.substr(override.find('=') + 1));
  cells.insert(cells.end(), {measured.empty() ? "failed" : "done", reason});
  const auto kinds = kindsOf(plan);
  for (std::size_t k = 0; k < kinds.size(); ++k)
    for (const std::string& column : kinds[k]->columns)
      cells.push_back(measured.empty() ? "" : slender::study::valueText(measured[k], column));
  return csvLine(cells);
}

std::string pointFile(const Options& options, long point)
{
  char name[32];
  std::snprintf(name, sizeof name, "/points/%07ld.csv", point);
  return options.out + name;
}

/// Whole or not at all, so that what is there is done.
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

std::vector<slender::study::Row> measure(const SweepPlan& plan, long point)
{
  slender::SceneConfig scene = plan.sceneOf(point);
  std::vector<std::unique_ptr<slender::study::Measure>> measures;
  for (const auto* kind : kindsOf(plan))
    measures.push_back(kind->make(scene));
  const double step = scene.time.step;
  const long steps = std::max(1L, static_cast<long>(std::ceil(scene.time.duration / step * (1 - 1e-12) - 1e-9)));
  const long first = std::min(steps, static_cast<long>(std::ceil(plan.after / step - 1e-9)));
  slender::Simulation simulation(std::move(scene));
  simulation.setThreads(1);
  for (long k = 0; k <= steps; ++k)
  {
    if (k > 0)
    {
      const slender::StepReport report = simulation.step(simulation.defaultInputs());
      if (!report.ok)
        throw std::runtime_error("step " + std::to_string(k) + ", " + slender::toString(report.failure) + ": " + report.message);
    }
    if (k >= first)
      for (auto& m : measures)
        m->look(simulation);
  }
  std::vector<slender::study::Row> rows;
  for (const auto& m : measures)
    rows.push_back(m->finish());
  return rows;
}

int runPoint(const SweepPlan& plan, const Options& options)
{
  if (options.point >= plan.points())
    throw BadInput("--point " + std::to_string(options.point) + ": the plan has " + std::to_string(plan.points()) + " runs, from 0");
  if (fs::exists(pointFile(options, options.point)))
    return kDone;
  std::string line;
  try
  {
    line = resultLine(plan, options.point, "", measure(plan, options.point));
  }
  catch (const std::exception& error)
  {
    std::string reason = error.what();
    std::replace(reason.begin(), reason.end(), '\n', ' ');
    line = resultLine(plan, options.point, reason, {});
  }
  writeWhole(pointFile(options, options.point), line + "\n");
  return kDone;
}

/// Results of another plan must not be mixed in.
void prepare(const SweepPlan& plan, const Options& options)
{
  std::error_code error;
  fs::create_directories(options.out + "/points", error);
  if (error)
    throw BadInput("cannot make directory " + options.out + "/points: " + error.message());
  const std::string copy = options.out + "/plan.txt";
  std::ifstream old(copy);
  std::ostringstream text;
  text << old.rdbuf();
  if (!old)
    writeWhole(copy, plan.text);
  else if (text.str() != plan.text)
    throw BadInput(options.out + " holds runs of another plan or scene (see " + copy + "); give another --out or delete it");
}

class Pool
{
public:
  Pool(const SweepPlan& plan, const Options& options) : plan_(plan), options_(options), start_(Clock::now()), shown_(start_) {}

  void run()
  {
    for (long point = 0; point < plan_.points(); ++point)
      if (!fs::exists(pointFile(options_, point)))
        todo_.push_back(point);
    std::reverse(todo_.begin(), todo_.end());
    total_ = todo_.size();
    while (!todo_.empty() || !running_.empty())
    {
      while (!todo_.empty() && running_.size() < static_cast<std::size_t>(options_.jobs))
      {
        start(todo_.back());
        todo_.pop_back();
      }
      int status = 0;
      const pid_t pid = waitpid(-1, &status, 0);
      if (pid < 0)
        continue;
      const auto at = running_.find(pid);
      if (at == running_.end())
        continue;
      if (!WIFEXITED(status) || WEXITSTATUS(status) != kDone)
        crashed_[at->second] = WIFSIGNALED(status) ? "ended by signal " + std::to_string(WTERMSIG(status)) : "ended early, see above";
      running_.erase(at);
      show();
    }
    if (shown_line_)
      std::fprintf(stderr, "\n");
  }

  /// Runs that left no result: to be tried again by the next call.
  const std::map<long, std::string>& crashed() const { return crashed_; }

private:
  using Clock = std::chrono::steady_clock;

  void start(long point)
  {
    std::string self = fs::read_symlink("/proc/self/exe").string(), number = std::to_string(point);
    std::string plan = options_.plan, out = options_.out;
    char out_word[] = "--out", point_word[] = "--point";
    char* const words[] = {self.data(), plan.data(), out_word, out.data(), point_word, number.data(), nullptr};
    pid_t pid = 0;
    const int error = posix_spawn(&pid, self.c_str(), nullptr, nullptr, words, environ);
    if (error != 0)
      throw std::runtime_error("cannot start a run: " + std::string(std::strerror(error)));
    running_[pid] = point;
  }

  void show()
  {
    const auto now = Clock::now();
    const bool terminal = isatty(STDERR_FILENO) == 1;
    const std::size_t done = total_ - todo_.size() - running_.size();
    if (done < total_ && now - shown_ < std::chrono::milliseconds(terminal ? 100 : 10000))
      return;
    shown_ = now;
    const double spent = std::chrono::duration<double>(now - start_).count();
    std::fprintf(stderr, "%ssweep %s  %zu/%zu runs  %.0f s left%s", terminal ? "\r" : "", plan_.name.c_str(), done, total_,
                 spent / static_cast<double>(done) * static_cast<double>(total_ - done), terminal ? "  " : "\n");
    shown_line_ = terminal;
  }

  const SweepPlan& plan_;
  const Options& options_;
  std::vector<long> todo_;
  std::map<pid_t, long> running_;
  std::map<long, std::string> crashed_;
  std::size_t total_ = 0;
  Clock::time_point start_, shown_;
  bool shown_line_ = false;
};

/// Points that failed are left out.
std::string draw(const SweepPlan& plan, const std::string& folder, const std::vector<std::vector<std::string>>& lines)
{
  const slender::SweepPlot& wanted = *plan.plot;
  const std::size_t x = columnOf(plan, wanted.x), y = columnOf(plan, wanted.y), status = columnOf(plan, "status");
  slender::study::StudyContext context(plan.name, false, false);
  slender::study::Plot& plot = context.plot(plan.name, plan.name, wanted.x_label, wanted.y_label);
  plot.log_x = plot.log_y = plot.lines = false;
  for (const auto& cells : lines)
  {
    if (cells[status] != "done")
      continue;
    slender::study::Series& series = plot.at(wanted.by.empty() ? "runs" : cells[columnOf(plan, wanted.by)]);
    series.x.push_back(std::strtod(cells[x].c_str(), nullptr));
    series.y.push_back(std::strtod(cells[y].c_str(), nullptr));
  }
  return slender::study::writePlots(folder, context);
}

int collect(const SweepPlan& plan, const Options& options, const std::map<long, std::string>& crashed)
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
      std::ifstream file(pointFile(options, point));
      if (!std::getline(file, line))
        throw std::runtime_error("cannot read " + pointFile(options, point));
    }
    all += line + "\n";
    lines.push_back(cellsOf(line));
    if (lines.back()[status] == "done")
      continue;
    ++failed;
    std::fprintf(stderr, "sweep: run %ld failed: %s\n", point, lines.back()[reason].c_str());
  }
  writeWhole(options.out + "/results.csv", all);
  if (plan.plot)
  {
    const std::string problem = draw(plan, options.out, lines);
    if (!problem.empty())
      std::fprintf(stderr, "sweep: %s\n", problem.c_str());
  }
  std::printf("%ld runs, %ld failed: %s/results.csv\n", plan.points(), failed, options.out.c_str());
  return failed ? kSomeFailed : kDone;
}

int run(const Options& options)
{
  const SweepPlan plan = slender::readSweepPlan(options.plan);
  for (const auto* kind : kindsOf(plan))
    kind->make(plan.sceneOf(0));
  if (plan.plot)
    for (const std::string& name : {plan.plot->x, plan.plot->y, plan.plot->by})
      if (!name.empty())
        columnOf(plan, name);
  if (options.count)
  {
    std::printf("%ld\n", plan.points());
    return kDone;
  }
  prepare(plan, options);
  if (options.point >= 0)
    return runPoint(plan, options);
  const int lock = open((options.out + "/lock").c_str(), O_CREAT | O_RDWR | O_CLOEXEC, 0644);
  if (lock < 0 || flock(lock, LOCK_EX | LOCK_NB) != 0)
    throw BadInput(options.out + ": another sweep is at work there");
  Pool pool(plan, options);
  pool.run();
  return collect(plan, options, pool.crashed());
}

}  // namespace

int main(int argc, char** argv)
{
  const std::vector<std::string> words(argv + 1, argv + argc);
  if (words.size() == 1 && (words[0] == "--help" || words[0] == "-h"))
  {
    std::cout << kUsage;
    for (const auto& kind : slender::study::measureKinds())
      std::cout << "measure " << kind.name << ": " << kind.description << "\n";
    return kDone;
  }
  try
  {
    return run(parse(words));
  }
  catch (const std::exception& error)   // SceneError, BadInput, a directory that cannot be written
  {
    std::cerr << "sweep: " << error.what() << "\n";
    return kBadInput;
  }
}
