#pragma once

#include <sys/types.h>

#include <chrono>
#include <cstddef>
#include <functional>
#include <string>
#include <vector>

/// Child processes of the programs that run others.
namespace slender {

/// Absolute path of the running program.
std::string thisProgram();

/// As one word of a shell.
std::string shellWord(const std::string& word);

/// Starts words[0] (an absolute path). Throws std::runtime_error.
pid_t startProcess(std::vector<std::string> words);

/// Runs command(0), ... command(count - 1), `jobs` at a time. After each has ended: ended(k, why), `why` empty for exit
/// status 0.
void runProcesses(std::size_t count, std::size_t jobs,
                  const std::function<std::vector<std::string>(std::size_t)>& command,
                  const std::function<void(std::size_t, const std::string&)>& ended);

/// "NAME  done/total WHAT  n s left" on stderr: rewritten in place on a terminal, else a line every ten seconds.
class Progress
{
public:
  Progress(std::string name, std::string what, std::size_t total);
  ~Progress();
  void show(std::size_t done);

private:
  const std::string name_, what_;
  const std::size_t total_;
  const bool terminal_;
  bool shown_line_ = false;
  std::size_t done_ = 0;
  const std::chrono::steady_clock::time_point start_;
  std::chrono::steady_clock::time_point shown_;
};

}   // namespace slender
