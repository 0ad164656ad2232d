#include "sweep_engines.h"

#include <sys/wait.h>

#include <algorithm>
#include <chrono>
#include <cstdlib>
#include <filesystem>
#include <thread>
#include <vector>

#include "arguments.h"
#include "study/framework/processes.h"
#include "sweep_runs.h"

namespace slender::sweep {

namespace {

namespace fs = std::filesystem;
using Crashed = std::map<long, std::string>;

/// Slurm refuses larger arrays unless its MaxArraySize is raised; a task then does several runs.
constexpr std::size_t kArrayTasks = 1000;

std::vector<long> missingPoints(const SweepPlan& plan, const std::string& out)
{
  std::vector<long> missing;
  for (long point = 0; point < plan.points(); ++point)
    if (!fs::exists(pointFile(out, point)))
      missing.push_back(point);
  return missing;
}

Crashed runLocally(const SweepPlan& plan, const std::string& plan_file, const std::string& out,
                   const std::vector<long>& todo, std::size_t jobs)
{
  Crashed crashed;
  Progress progress("sweep " + plan.name, "runs", todo.size());
  std::size_t done = 0;
  runProcesses(
      todo.size(), jobs,
      [&](std::size_t k) {
        return std::vector<std::string>{thisProgram(), plan_file, "--out", out, "--point", std::to_string(todo[k])};
      },
      [&](std::size_t k, const std::string& why) {
        if (!why.empty())
          crashed[todo[k]] = why;
        progress.show(++done);
      });
  return crashed;
}

/// The engine's command; `list` holds the points to run, one per line.
std::string command(const SweepPlan& plan, const std::string& plan_file, const std::string& out,
                    const std::string& list, std::size_t runs, const Engine& engine)
{
  const std::string run = shellWord(thisProgram()) + " " + shellWord(fs::absolute(plan_file)) + " --out " +
                          shellWord(fs::absolute(out)) + " --point ";
  if (engine.kind == "parallel")
    return "exec parallel " + (engine.jobs > 0 ? "--jobs " + std::to_string(engine.jobs) + " " : "") + engine.options +
           " --arg-file " + shellWord(list) + " " + shellWord(run + "{}");
  const std::string tasks = std::to_string(std::min(runs, kArrayTasks));
  const std::string script = "awk -v task=$SLURM_ARRAY_TASK_ID 'NR % " + tasks + " == task' " +
                             shellWord(fs::absolute(list)) + " | while read -r point; do " + run +
                             "$point < /dev/null; done";
  return "exec sbatch --wait --job-name=" + shellWord("sweep_" + plan.name) + " --array=0-" +
         std::to_string(std::min(runs, kArrayTasks) - 1) + (engine.jobs > 0 ? "%" + std::to_string(engine.jobs) : "") +
         " --output=" + shellWord(fs::absolute(out).string() + "/slurm-%a.log") + " " + engine.options + " --wrap " +
         shellWord(script);
}

Crashed runByEngine(const SweepPlan& plan, const std::string& plan_file, const std::string& out,
                    const std::vector<long>& todo, const Engine& engine)
{
  const std::string program = engine.kind == "slurm" ? "sbatch" : "parallel";
  if (std::system(("command -v " + program + " > /dev/null").c_str()) != 0)
    throw BadInput("--engine " + engine.kind + ": no program " + program + " here; install Debian's package " +
                   (engine.kind == "slurm" ? "slurm-client" : "parallel") + " or leave --engine away");
  const std::string list = out + "/todo";
  std::string lines;
  for (const long point : todo)
    lines += std::to_string(point) + "\n";
  writeWhole(list, lines);
  const auto done = [&] {
    return static_cast<std::size_t>(
        std::count_if(todo.begin(), todo.end(), [&](long point) { return fs::exists(pointFile(out, point)); }));
  };
  const pid_t pid = startProcess({"/bin/sh", "-c", command(plan, plan_file, out, list, todo.size(), engine)});
  int status = 0;
  {
    Progress progress("sweep " + plan.name, "runs", todo.size());
    while (waitpid(pid, &status, WNOHANG) == 0)
    {
      std::this_thread::sleep_for(std::chrono::milliseconds(200));
      progress.show(done());
    }
    progress.show(done());
  }
  if (done() == 0 && status != 0)
    throw BadInput("--engine " + engine.kind + ": " + program +
                   " ran nothing, see above; its options: " + engine.options);
  Crashed crashed;
  for (const long point : todo)
    if (!fs::exists(pointFile(out, point)))
      crashed[point] =
          engine.kind == "slurm" ? "left no result, see " + out + "/slurm-*.log" : "left no result, see above";
  fs::remove(list);
  return crashed;
}

}   // namespace

std::map<long, std::string> runMissing(const SweepPlan& plan, const std::string& plan_file, const std::string& out,
                                       const Engine& engine)
{
  const std::vector<long> todo = missingPoints(plan, out);
  if (todo.empty())
    return {};
  if (engine.kind != "local")
    return runByEngine(plan, plan_file, out, todo, engine);
  return runLocally(plan, plan_file, out, todo,
                    engine.jobs > 0 ? engine.jobs : std::max(1u, std::thread::hardware_concurrency()));
}

}   // namespace slender::sweep
