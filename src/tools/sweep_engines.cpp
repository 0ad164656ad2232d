#include "sweep_engines.h"

#include <spawn.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <chrono>
#include <cstdio>
#include <cstring>
#include <filesystem>
#include <stdexcept>
#include <thread>
#include <vector>

#include "arguments.h"
#include "sweep_runs.h"

extern char** environ;

namespace slender::sweep {

namespace {

namespace fs = std::filesystem;
using Clock = std::chrono::steady_clock;
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

class Progress
{
public:
  Progress(const std::string& name, std::size_t total) : name_(name), total_(total), terminal_(isatty(STDERR_FILENO) == 1) {}
  ~Progress()
  {
    if (shown_line_)
      std::fprintf(stderr, "\n");
  }

  void show(std::size_t done)
  {
    const auto now = Clock::now();
    if (done == 0 || done == done_ || (done < total_ && now - shown_ < std::chrono::milliseconds(terminal_ ? 100 : 10000)))
      return;
    shown_ = now;
    done_ = done;
    const double spent = std::chrono::duration<double>(now - start_).count();
    std::fprintf(stderr, "%ssweep %s  %zu/%zu runs  %.0f s left%s", terminal_ ? "\r" : "", name_.c_str(), done, total_,
                 spent / static_cast<double>(done) * static_cast<double>(total_ - done), terminal_ ? "  " : "\n");
    shown_line_ = terminal_;
  }

private:
  const std::string name_;
  const std::size_t total_;
  const bool terminal_;
  bool shown_line_ = false;
  std::size_t done_ = 0;
  const Clock::time_point start_ = Clock::now();
  Clock::time_point shown_ = start_;
};

std::string thisProgram()
{
  return fs::read_symlink("/proc/self/exe").string();
}

pid_t start(std::vector<std::string> words)
{
  std::vector<char*> pointers;
  for (std::string& word : words)
    pointers.push_back(word.data());
  pointers.push_back(nullptr);
  pid_t pid = 0;
  const int error = posix_spawn(&pid, words[0].c_str(), nullptr, nullptr, pointers.data(), environ);
  if (error != 0)
    throw std::runtime_error("cannot start " + words[0] + ": " + std::strerror(error));
  return pid;
}

Crashed runLocally(const SweepPlan& plan, const std::string& plan_file, const std::string& out, const std::vector<long>& todo, std::size_t jobs)
{
  Crashed crashed;
  std::map<pid_t, long> running;
  Progress progress(plan.name, todo.size());
  for (std::size_t next = 0; next < todo.size() || !running.empty();)
  {
    for (; next < todo.size() && running.size() < jobs; ++next)
      running[start({thisProgram(), plan_file, "--out", out, "--point", std::to_string(todo[next])})] = todo[next];
    int status = 0;
    const pid_t pid = waitpid(-1, &status, 0);
    const auto at = running.find(pid);
    if (at == running.end())
      continue;
    if (WIFSIGNALED(status))
      crashed[at->second] = "ended by signal " + std::to_string(WTERMSIG(status));
    else if (WEXITSTATUS(status) != 0)
      crashed[at->second] = "ended early, see above";
    running.erase(at);
    progress.show(next - running.size());
  }
  return crashed;
}

/// As one word of a shell.
std::string quoted(const std::string& word)
{
  std::string text = "'";
  for (const char c : word)
    text += c == '\'' ? "'\\''" : std::string(1, c);
  return text + "'";
}

/// The engine's command; `list` holds the points to run, one per line.
std::string command(const SweepPlan& plan, const std::string& plan_file, const std::string& out, const std::string& list, std::size_t runs,
                    const Engine& engine)
{
  const std::string run = quoted(thisProgram()) + " " + quoted(fs::absolute(plan_file)) + " --out " + quoted(fs::absolute(out)) + " --point ";
  if (engine.kind == "parallel")
    return "exec parallel " + (engine.jobs > 0 ? "--jobs " + std::to_string(engine.jobs) + " " : "") + engine.options + " --arg-file " +
           quoted(list) + " " + quoted(run + "{}");
  const std::string tasks = std::to_string(std::min(runs, kArrayTasks));
  const std::string script = "awk -v task=$SLURM_ARRAY_TASK_ID 'NR % " + tasks + " == task' " + quoted(fs::absolute(list)) +
                             " | while read -r point; do " + run + "$point < /dev/null; done";
  return "exec sbatch --wait --job-name=" + quoted("sweep_" + plan.name) + " --array=0-" + std::to_string(std::min(runs, kArrayTasks) - 1) +
         (engine.jobs > 0 ? "%" + std::to_string(engine.jobs) : "") + " --output=" + quoted(fs::absolute(out).string() + "/slurm-%a.log") + " " +
         engine.options + " --wrap " + quoted(script);
}

Crashed runByEngine(const SweepPlan& plan, const std::string& plan_file, const std::string& out, const std::vector<long>& todo, const Engine& engine)
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
    return static_cast<std::size_t>(std::count_if(todo.begin(), todo.end(), [&](long point) { return fs::exists(pointFile(out, point)); }));
  };
  const pid_t pid = start({"/bin/sh", "-c", command(plan, plan_file, out, list, todo.size(), engine)});
  int status = 0;
  {
    Progress progress(plan.name, todo.size());
    while (waitpid(pid, &status, WNOHANG) == 0)
    {
      std::this_thread::sleep_for(std::chrono::milliseconds(200));
      progress.show(done());
    }
    progress.show(done());
  }
  if (done() == 0 && status != 0)
    throw BadInput("--engine " + engine.kind + ": " + program + " ran nothing, see above; its options: " + engine.options);
  Crashed crashed;
  for (const long point : todo)
    if (!fs::exists(pointFile(out, point)))
      crashed[point] = engine.kind == "slurm" ? "left no result, see " + out + "/slurm-*.log" : "left no result, see above";
  fs::remove(list);
  return crashed;
}

}  // namespace

std::map<long, std::string> runMissing(const SweepPlan& plan, const std::string& plan_file, const std::string& out, const Engine& engine)
{
  const std::vector<long> todo = missingPoints(plan, out);
  if (todo.empty())
    return {};
  if (engine.kind != "local")
    return runByEngine(plan, plan_file, out, todo, engine);
  return runLocally(plan, plan_file, out, todo, engine.jobs > 0 ? engine.jobs : std::max(1u, std::thread::hardware_concurrency()));
}

}  // namespace slender::sweep
