#include <unistd.h>

#include <algorithm>
#include <array>
#include <chrono>
#include <cmath>
#include <csignal>
#include <cstdio>
#include <exception>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "arguments.h"
#include "moduli.h"
#include "program_main.h"
#include "run_summary.h"
#include "slender_sim/dynamics/integrator.h"
#include "slender_sim/linalg/interruption.h"
#include "slender_sim/scene/file_paths.h"
#include "slender_sim/scene/crossing_watch.h"
#include "slender_sim/scene/limit_watch.h"
#include "slender_sim/scene/reader.h"
#include "slender_sim/scene/recorder.h"
#include "slender_sim/scene/simulation.h"
#include "statics_report.h"
#ifdef SLENDER_WITH_BAG
#include "slender_sim/node/bag_recorder.h"
#include "slender_sim/node/guide_bag.h"
#include "slender_sim/node/robot_sources.h"
#endif

/// simulate SCENE.yaml: runs a scene without a ROS master. Exit status 0 done, 2 bad input, 3 the simulation failed, or
/// its results could not be written, 128 + N stopped by signal N.
namespace {

using slender::BadInput;
using slender::Recorder;
using slender::Simulation;
using slender::StepReport;
using Clock = std::chrono::steady_clock;

const char* const usage =
    "usage: simulate SCENE.yaml [options]\n"
    "  --duration S        simulated seconds (default: time.duration of the scene)\n"
    "  --bag FILE          record a ROS bag (only in a build with ROS)\n"
    "  --csv DIR           record tables: DIR/nodes.csv, DIR/grasps.csv\n"
    "  --obj DIR           record one OBJ file per instant\n"
    "  --state FILE        save the state that was reached, as the nodes' save_state does; after a failure as well\n"
    "  --set PATH=VALUE    override a value of the scene, e.g. rods.0.material.youngs_modulus=1e7; may be repeated\n"
    "  --threads N         threads for scenes of several rods; results do not depend on it\n"
    "  --statics           only find equilibria: those that `statics` of the scene asks for, or one. Prints residual, "
    "energy, lowest\n"
    "                      eigenvalue and stability of each; tables of them with --csv. Exit status 3 without a stable "
    "one\n"
    "  --quiet             print nothing but warnings and errors\n"
    "record.every of the scene says which steps are recorded. Exit status: 0 done, 2 bad input, 3 the simulation "
    "failed,\n"
    "or its results could not be written (disk full): the message names what is left of them; 130 stopped by SIGINT "
    "(Ctrl-C),\n"
    "143 by SIGTERM: within the step, whose start is then the end of what is recorded. A second signal ends it at "
    "once.\n";

struct Options
{
  std::string scene, bag, csv, obj, state;
  std::vector<std::string> overrides;
  std::optional<double> duration;
  std::optional<int> threads;
  bool quiet = false, help = false, statics = false;
};

Options parseOptions(int argc, char** argv)
{
  Options options;
  for (int k = 1; k < argc; ++k)
  {
    const std::string argument = argv[k];
    const auto value = [&]() -> std::string {
      if (k + 1 >= argc)
        throw BadInput(argument + ": its value is missing\n" + usage);
      return argv[++k];
    };
    if (argument != "--set" && argument.size() > 1 && argument[0] == '-' &&
        std::find(argv + 1, argv + k, argument) != argv + k)
      throw BadInput(argument + ": is given twice\n" + usage);
    if (argument == "--duration")
      options.duration = slender::parsePositive(argument, value(), 1e7);
    else if (argument == "--threads")
      options.threads = slender::parseCount(argument, value(), 1, 1024);
    else if (argument == "--bag")
      options.bag = value();
    else if (argument == "--csv")
      options.csv = value();
    else if (argument == "--obj")
      options.obj = value();
    else if (argument == "--state")
      options.state = value();
    else if (argument == "--set")
      options.overrides.push_back(value());
    else if (argument == "--quiet")
      options.quiet = true;
    else if (argument == "--statics")
      options.statics = true;
    else if (argument == "--help" || argument == "-h")
      options.help = true;
    else if (argument.size() > 1 && argument[0] == '-')
      throw BadInput(argument + ": unknown option\n" + usage);
    else if (!options.scene.empty())
      throw BadInput(argument + ": only one scene can be run\n" + usage);
    else
      options.scene = argument;
  }
  if (options.scene.empty() && !options.help)
    throw BadInput(std::string("a scene file is missing\n") + usage);
  if (options.statics && options.duration)
    throw BadInput(std::string("--duration: statics has no time; leave out --duration or --statics\n") + usage);
  return options;
}

/// Recorders asked for; called after the scene was checked, so that a bad scene leaves no files behind.
std::vector<std::unique_ptr<Recorder>> makeRecorders(const Options& options)
{
  std::vector<std::unique_ptr<Recorder>> recorders;
  if (!options.csv.empty())
    recorders.push_back(slender::makeCsvRecorder(options.csv));
  if (!options.obj.empty())
    recorders.push_back(slender::makeObjRecorder(options.obj));
#ifdef SLENDER_WITH_BAG
  if (!options.bag.empty())
    recorders.push_back(slender::makeBagRecorder(options.bag));
#endif
  return recorders;
}

volatile std::sig_atomic_t stopped_by = 0;

/// The next of these signals ends the step that is being solved, and the run; the one after it the process.
void stopOnSignals()
{
  struct sigaction action = {};
  action.sa_handler = [](int signal) {
    stopped_by = signal;
    slender::interruptSteps();
  };
  action.sa_flags = static_cast<int>(SA_RESETHAND);
  for (const int signal : {SIGINT, SIGTERM})
    ::sigaction(signal, &action, nullptr);
}

/// A bar on a terminal; nothing when the output goes elsewhere.
class Progress
{
public:
  Progress(bool on, long total) : on_(on), total_(total), start_(Clock::now()), last_(start_) {}

  void show(long done, double simulated)
  {
    const auto now = Clock::now();
    if (!on_ || now - last_ < std::chrono::milliseconds(100))
      return;
    last_ = now;
    shown_ = true;
    const double part = static_cast<double>(done) / static_cast<double>(total_);
    const double wall = std::chrono::duration<double>(now - start_).count();
    constexpr int width = 40;
    const int filled = static_cast<int>(part * width);
    std::fprintf(stderr, "\r[%s%s] %3.0f %%  t = %.3f s  x%.2f real time  %.0f s left  ",
                 std::string(filled, '#').c_str(), std::string(width - filled, '.').c_str(), 100 * part, simulated,
                 simulated / wall, wall * (1 / part - 1));
  }

  void clear()
  {
    if (shown_)
    {
      std::fprintf(stderr, "\r\033[K");
      shown_ = false;
    }
  }

private:
  bool on_, shown_ = false;
  long total_;
  Clock::time_point start_, last_;
};

/// Checks the limits of the scene and reports excursions on stderr: each excursion once, and of each kind of limit at
/// most one per simulated second. Reports objects without contact that others pass through, each pair once.
class LimitTeller
{
public:
  explicit LimitTeller(Simulation& simulation) : simulation_(simulation), watch_(simulation), crossings_(simulation) {}

  /// beforeStep() and afterStep() return false if the run must stop.
  bool beforeStep(slender::SceneInputs& inputs, Progress& progress)
  {
    return tell(watch_.checkInputs(inputs), progress);
  }
  bool afterStep(Progress& progress)
  {
    for (const std::string& crossing : crossings_.check())
    {
      progress.clear();
      std::fprintf(stderr, "simulate: warning: %s\n", crossing.c_str());
    }
    return tell(watch_.checkStep(), progress);
  }

  const slender::LimitWatch& watch() const { return watch_; }

private:
  bool tell(const std::vector<slender::LimitExcess>& begun, Progress& progress)
  {
    const auto& released = watch_.released();
    for (const slender::LimitExcess& excess : begun)
    {
      if (std::any_of(released.begin(), released.end(), [&](const auto& r) { return r.why == excess.text; }))
        continue;
      std::optional<double>& told = told_[static_cast<std::size_t>(excess.kind)];
      if (told && simulation_.state().time < *told + 1.0)
        continue;
      told = simulation_.state().time;
      progress.clear();
      std::fprintf(stderr, "simulate: warning: %s%s\n", excess.text.c_str(),
                   watch_.held().empty() ? "" : "; all driven objects stay in place from now on (on_limit: hold)");
    }
    for (const auto& [grasp, why] : released)
    {
      progress.clear();
      std::fprintf(stderr, "simulate: warning: %s; grasp '%s' is released (on_limit: release)\n", why.c_str(),
                   simulation_.grasps()[static_cast<std::size_t>(grasp)].config->name.c_str());
    }
    if (watch_.stopped().empty())
      return true;
    progress.clear();
    std::fprintf(stderr, "simulate: stopped after step %llu: %s (on_limit: stop)\n",
                 static_cast<unsigned long long>(simulation_.state().steps), watch_.stopped().c_str());
    return false;
  }

  Simulation& simulation_;
  slender::LimitWatch watch_;
  slender::CrossingWatch crossings_;
  std::array<std::optional<double>, 4> told_;   // [s] per kind: simulated time of the last report
};

void saveState(const Simulation& simulation, const std::string& path)
{
  try
  {
    simulation.save(path);
  }
  catch (const std::runtime_error& error)
  {
    throw slender::WriteError(std::string("--state ") + error.what());
  }
}

void printStatics(const Simulation& simulation, const slender::StaticsRun& found, double wall)
{
  std::printf("scene             %s\n", simulation.config().name.c_str());
  std::printf("wall              %.6g s\n", wall);
  slender::printModuli(simulation);
  slender::printEquilibria(simulation.config(), found);
}

/// `simulate --statics`. Returns the exit status.
int runStatics(const Options& options, Simulation& simulation, Clock::time_point start)
{
  std::vector<std::unique_ptr<Recorder>> recorders = makeRecorders(options);
  const slender::StaticsRun found = simulation.runStatics();
  if (!simulation.config().threads.empty())
    std::fprintf(stderr, "simulate: warning: --statics leaves the scene's threads, which flow, as they are given\n");
  for (auto& recorder : recorders)
  {
    recorder->record(simulation, found.rows.empty() ? found.end : found.rows.back().report);
    recorder->finish();
  }
  if (!options.csv.empty())
  {
    std::vector<std::string> rods;
    for (const slender::RodConfig& rod : simulation.config().rods)
      rods.push_back(rod.name);
    slender::writeStatics(options.csv, found, rods);
  }
  if (!options.state.empty())
    saveState(simulation, options.state);
  if (!options.quiet)
    printStatics(simulation, found, std::chrono::duration<double>(Clock::now() - start).count());
  return slender::reportStatics(simulation.config(), found) ? slender::kDone : slender::kFailed;
}

void printWarnings(const slender::SceneConfig& scene, const Options& options)
{
  for (const std::string& warning : scene.warnings)
    std::fprintf(stderr, "simulate: warning: %s\n", warning.c_str());
  if (!options.quiet)
  {
    for (const std::string& note : scene.notes)
      std::fprintf(stderr, "simulate: note: %s\n", note.c_str());
    slender::noteInputsOfNodes(scene);
  }
  if (scene.statics && !options.statics)
  {
    std::fprintf(stderr,
                 "simulate: warning: the key statics of the scene is for --statics, without which it is not used\n");
  }
}

int run(const Options& options)
{
#ifdef SLENDER_WITH_BAG
  slender::setGuideBagReader(slender::readGuideBag);
  slender::setRobotSources(slender::packageSources());
#else
  if (!options.bag.empty())
  {
    throw BadInput("--bag " + options.bag +
                   ": this build has no ROS and cannot write bags; build with -DWITH_ROS=ON, or use --csv");
  }
#endif
  slender::SceneConfig config = slender::readScene(options.scene, options.overrides);
  if (options.duration)
    config.time.duration = *options.duration;
  const double step = config.time.step;
  const int every = config.record.every;
  const long steps = slender::stepsUntil(config.time.duration, step);

  config.start.equilibrium = config.start.equilibrium || options.statics;
  const auto start = Clock::now();
  Simulation simulation(std::move(config), !options.statics);
  printWarnings(simulation.config(), options);
  if (options.threads)
    simulation.setThreads(*options.threads);
  stopOnSignals();   // before there is anything to finish: until here a signal ends the process at once
  if (options.statics)
    return runStatics(options, simulation, start);
  std::vector<std::unique_ptr<Recorder>> recorders = makeRecorders(options);
  slender::RunStatistics total;
  for (auto& recorder : recorders)
    recorder->record(simulation, StepReport{});
  Progress progress(!options.quiet && ::isatty(STDERR_FILENO), steps);
  bool ok = true;
  slender::SceneInputs inputs;
  LimitTeller limits(simulation);
  for (long k = 1; ok && k <= steps; ++k)
  {
    simulation.defaultInputs(inputs);
    ok = limits.beforeStep(inputs, progress);
    if (!ok)
      break;
    const StepReport report = simulation.step(inputs);
    ok = report.ok && stopped_by == 0;   // explicit steps, for one, are too short to be interrupted
    if (stopped_by != 0)
    {
      progress.clear();
      std::fprintf(stderr, "simulate: stopped by %s in step %ld of %ld: what was reached by t = %.9g s is kept\n",
                   stopped_by == SIGINT ? "SIGINT" : "SIGTERM", k, steps, simulation.state().time);
      break;
    }
    if (!ok)
    {
      progress.clear();
      std::fprintf(stderr, "simulate: step %ld (t = %.9g s to %.9g s) failed, %s: %s\n", k, simulation.state().time,
                   simulation.state().time + step, slender::toString(report.failure), report.message.c_str());
      break;
    }
    total.add(report, simulation, step, 0.0);
    if (k % every == 0)
      for (auto& recorder : recorders)
        recorder->record(simulation, report);
    ok = limits.afterStep(progress);
    progress.show(k, simulation.state().time);
  }
  for (auto& recorder : recorders)
    recorder->finish();   // after a failure as well: what was reached is worth looking at
  if (!options.state.empty())
    saveState(simulation, options.state);
  progress.clear();
  if (!options.quiet)
  {
    const double wall = std::chrono::duration<double>(Clock::now() - start).count();
    slender::printSummary(simulation, total, limits.watch(), wall);
  }
  const bool balanced = slender::checkVolumes(simulation);
  return stopped_by != 0 && !ok ? 128 + stopped_by : balanced && ok ? slender::kDone : slender::kFailed;
}

}   // namespace

int main(int argc, char** argv) { return slender::programMain("simulate", usage, argc, argv, parseOptions, run); }
