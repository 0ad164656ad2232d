#include <unistd.h>

#include <algorithm>
#include <chrono>
#include <cstdio>
#include <exception>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "arguments.h"
#include "slender_sim/dynamics/integrator.h"
#include "slender_sim/scene/file_paths.h"
#include "slender_sim/scene/reader.h"
#include "slender_sim/scene/recorder.h"
#include "slender_sim/scene/simulation.h"
#ifdef SLENDER_WITH_BAG
#include "slender_sim/node/bag_recorder.h"
#include "slender_sim/node/guide_bag.h"
#endif

/// simulate SCENE.yaml: runs a scene without a ROS master. Exit status 0 done, 2 bad input, 3 the simulation failed, or its results could not be written.
namespace {

using slender::BadInput;
using slender::Recorder;
using slender::Simulation;
using slender::StepReport;
using Clock = std::chrono::steady_clock;

constexpr int exit_done = 0, exit_bad_input = 2, exit_failed = 3;

const char* const usage =
  "usage: simulate SCENE.yaml [options]\n"
  "  --duration S        simulated seconds (default: time.duration of the scene)\n"
  "  --bag FILE          record a ROS bag (only in a build with ROS)\n"
  "  --csv DIR           record tables: DIR/nodes.csv, DIR/grasps.csv\n"
  "  --obj DIR           record one OBJ file per instant\n"
  "  --set PATH=VALUE    override a value of the scene, e.g. rods.0.material.youngs_modulus=1e7; may be repeated\n"
  "  --threads N         threads for scenes of several rods; results do not depend on it\n"
  "  --quiet             print nothing but errors\n"
  "record.every of the scene says which steps are recorded. Exit status: 0 done, 2 bad input, 3 the simulation failed,\n"
  "or its results could not be written (disk full): the message names what is left of them.\n";

struct Options
{
  std::string scene, bag, csv, obj;
  std::vector<std::string> overrides;
  std::optional<double> duration;
  std::optional<int> threads;
  bool quiet = false, help = false;
};

Options parseOptions(int argc, char** argv)
{
  Options options;
  for (int k = 1; k < argc; ++k)
  {
    const std::string argument = argv[k];
    const auto value = [&]() -> std::string {
      if (k + 1 >= argc)
      {
        throw BadInput(argument + ": its value is missing\n" + usage);
      }
      return argv[++k];
    };
    if (argument != "--set" && argument.size() > 1 && argument[0] == '-' && std::find(argv + 1, argv + k, argument) != argv + k)
    {
      throw BadInput(argument + ": is given twice\n" + usage);
    }
    if (argument == "--duration")
    {
      options.duration = slender::parsePositive(argument, value(), 1e7);
    }
    else if (argument == "--threads")
    {
      options.threads = slender::parseCount(argument, value(), 1, 1024);
    }
    else if (argument == "--bag")
    {
      options.bag = value();
    }
    else if (argument == "--csv")
    {
      options.csv = value();
    }
    else if (argument == "--obj")
    {
      options.obj = value();
    }
    else if (argument == "--set")
    {
      options.overrides.push_back(value());
    }
    else if (argument == "--quiet")
    {
      options.quiet = true;
    }
    else if (argument == "--help" || argument == "-h")
    {
      options.help = true;
    }
    else if (argument.size() > 1 && argument[0] == '-')
    {
      throw BadInput(argument + ": unknown option\n" + usage);
    }
    else if (!options.scene.empty())
    {
      throw BadInput(argument + ": only one scene can be run\n" + usage);
    }
    else
    {
      options.scene = argument;
    }
  }
  if (options.scene.empty() && !options.help)
  {
    throw BadInput(std::string("a scene file is missing\n") + usage);
  }
  return options;
}

/// Recorders asked for; called after the scene was checked, so that a bad scene leaves no files behind.
std::vector<std::unique_ptr<Recorder>> makeRecorders(const Options& options)
{
  std::vector<std::unique_ptr<Recorder>> recorders;
  if (!options.csv.empty())
  {
    recorders.push_back(slender::makeCsvRecorder(options.csv));
  }
  if (!options.obj.empty())
  {
    recorders.push_back(slender::makeObjRecorder(options.obj));
  }
#ifdef SLENDER_WITH_BAG
  if (!options.bag.empty())
  {
    recorders.push_back(slender::makeBagRecorder(options.bag));
  }
#endif
  return recorders;
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
    {
      return;
    }
    last_ = now;
    shown_ = true;
    const double part = static_cast<double>(done) / static_cast<double>(total_);
    const double wall = std::chrono::duration<double>(now - start_).count();
    constexpr int width = 40;
    const int filled = static_cast<int>(part * width);
    std::fprintf(stderr, "\r[%s%s] %3.0f %%  t = %.3f s  x%.2f real time  %.0f s left  ", std::string(filled, '#').c_str(),
                 std::string(width - filled, '.').c_str(), 100 * part, simulated, simulated / wall, wall * (1 / part - 1));
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

void printSummary(const Simulation& simulation, const StepReport& total, double wall)
{
  const double simulated = simulation.state().time;
  std::printf("scene             %s\n", simulation.config().name.c_str());
  std::printf("steps             %llu\n", static_cast<unsigned long long>(simulation.state().steps));
  std::printf("simulated         %.6g s\n", simulated);
  std::printf("wall              %.6g s\n", wall);
  std::printf("real-time factor  %.4g\n", simulated / std::max(wall, 1e-9));
  std::printf("worst residual    %.3g\n", total.residual);
  std::printf("iterations        %d (%.2f per step)\n", total.iterations,
              total.iterations / std::max(1.0, static_cast<double>(simulation.state().steps)));
  std::printf("cut steps         %d\n", total.cut_steps);
  if (total.repulsions > 0 || total.impulses > 0)
  {
    std::printf("cloth contacts    %.1f per step, %ld collisions stopped, %ld rigid pieces\n",
                total.repulsions / std::max(1.0, static_cast<double>(simulation.state().steps)), total.impulses, total.zones);
  }
  if (total.mended_folds > 0)
  {
    std::printf("mended folds      %d\n", total.mended_folds);
  }
  const auto tracks = [](const auto& objects) { return std::any_of(objects.begin(), objects.end(), [](const auto& object) { return object.tracking != nullptr; }); };
  if (tracks(simulation.config().cloths) || tracks(simulation.config().rods))
  {
    std::printf("tracking          averages at most %.2g of the guide's size away\n", total.tracking_error);
    if (total.forces_at_bound > 0)
    {
      std::printf("bounded forces    at most %d at their bounds, whose averages were not met\n", total.forces_at_bound);
    }
  }
  if (total.projection_iterations > 0)
  {
    std::printf("projection        at most %d iterations a step, edge lengths squared to %.2g\n", total.projection_iterations, total.constraint_error);
  }
}

int run(const Options& options)
{
#ifdef SLENDER_WITH_BAG
  slender::setBagReader(slender::readGuideBag);
#else
  if (!options.bag.empty())
  {
    throw BadInput("--bag " + options.bag + ": this build has no ROS and cannot write bags; build with -DWITH_ROS=ON, or use --csv");
  }
#endif
  slender::SceneConfig config = slender::readScene(options.scene, options.overrides);
  if (options.duration)
  {
    config.time.duration = *options.duration;
  }
  const double step = config.time.step;
  const int every = config.record.every;
  const long steps = slender::stepsUntil(config.time.duration, step);

  const auto start = Clock::now();
  Simulation simulation(std::move(config));
  if (options.threads)
  {
    simulation.setThreads(*options.threads);
  }
  std::vector<std::unique_ptr<Recorder>> recorders = makeRecorders(options);
  StepReport total;
  for (auto& recorder : recorders)
  {
    recorder->record(simulation, total);
  }
  Progress progress(!options.quiet && ::isatty(STDERR_FILENO), steps);
  bool ok = true;
  slender::SceneInputs inputs;
  for (long k = 1; ok && k <= steps; ++k)
  {
    simulation.defaultInputs(inputs);
    const StepReport report = simulation.step(inputs);
    ok = report.ok;
    if (!ok)
    {
      progress.clear();
      std::fprintf(stderr, "simulate: step %ld (t = %.9g s to %.9g s) failed, %s: %s\n", k, simulation.state().time,
                   simulation.state().time + step, slender::toString(report.failure), report.message.c_str());
      break;
    }
    total.merge(report);
    if (k % every == 0)
    {
      for (auto& recorder : recorders)
      {
        recorder->record(simulation, report);
      }
    }
    progress.show(k, simulation.state().time);
  }
  for (auto& recorder : recorders)
  {
    recorder->finish();   // after a failure as well: what was reached is worth looking at
  }
  progress.clear();
  if (!options.quiet)
  {
    printSummary(simulation, total, std::chrono::duration<double>(Clock::now() - start).count());
  }
  return ok ? exit_done : exit_failed;
}

}  // namespace

int main(int argc, char** argv)
{
  try
  {
    const Options options = parseOptions(argc, argv);
    if (options.help)
    {
      std::fputs(usage, stdout);
      return exit_done;
    }
    return run(options);
  }
  catch (const slender::SimulationError& error)
  {
    std::fprintf(stderr, "simulate: %s\n", error.what());
    return exit_failed;
  }
  catch (const slender::WriteError& error)
  {
    std::fprintf(stderr, "simulate: %s\n", error.what());
    return exit_failed;
  }
  catch (const std::exception& error)   // SceneError, BadInput, a recorder that cannot begin
  {
    std::fprintf(stderr, "simulate: %s\n", error.what());
    return exit_bad_input;
  }
}
