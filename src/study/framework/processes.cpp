#include "processes.h"

#include <spawn.h>
#include <sys/wait.h>
#include <unistd.h>

#include <cerrno>
#include <cstdio>
#include <cstring>
#include <filesystem>
#include <map>
#include <stdexcept>

extern char** environ;

namespace slender {

std::string thisProgram() { return std::filesystem::read_symlink("/proc/self/exe").string(); }

std::string shellWord(const std::string& word)
{
  std::string text = "'";
  for (const char c : word)
    text += c == '\'' ? "'\\''" : std::string(1, c);
  return text + "'";
}

pid_t startProcess(std::vector<std::string> words)
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

void runProcesses(std::size_t count, std::size_t jobs,
                  const std::function<std::vector<std::string>(std::size_t)>& command,
                  const std::function<void(std::size_t, const std::string&)>& ended)
{
  std::map<pid_t, std::size_t> running;
  for (std::size_t next = 0; next < count || !running.empty();)
  {
    for (; next < count && running.size() < jobs; ++next)
      running[startProcess(command(next))] = next;
    int status = 0;
    const pid_t pid = waitpid(-1, &status, 0);
    const auto at = running.find(pid);
    if (at == running.end())
      continue;
    const std::size_t which = at->second;
    running.erase(at);
    if (WIFSIGNALED(status))
      ended(which, "ended by signal " + std::to_string(WTERMSIG(status)));
    else
      ended(which, WEXITSTATUS(status) == 0 ? "" : "ended with exit status " + std::to_string(WEXITSTATUS(status)));
  }
}

Progress::Progress(std::string name, std::string what, std::size_t total)
  : name_(std::move(name)),
    what_(std::move(what)),
    total_(total),
    terminal_(isatty(STDERR_FILENO) == 1),
    start_(std::chrono::steady_clock::now()),
    shown_(start_)
{
}

Progress::~Progress()
{
  if (shown_line_)
    std::fprintf(stderr, "\n");
}

void Progress::show(std::size_t done)
{
  const auto now = std::chrono::steady_clock::now();
  if (done == 0 || done == done_ ||
      (done < total_ && now - shown_ < std::chrono::milliseconds(terminal_ ? 100 : 10000)))
    return;
  shown_ = now;
  done_ = done;
  const double spent = std::chrono::duration<double>(now - start_).count();
  std::fprintf(stderr, "%s%s  %zu/%zu %s  %.0f s left%s", terminal_ ? "\r" : "", name_.c_str(), done, total_,
               what_.c_str(), spent / static_cast<double>(done) * static_cast<double>(total_ - done),
               terminal_ ? "  " : "\n");
  shown_line_ = terminal_;
}

}   // namespace slender
