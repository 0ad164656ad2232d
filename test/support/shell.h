#pragma once

#include <array>
#include <cstdio>
#include <string>

#include <sys/wait.h>

namespace slender::test {

struct Result
{
  int status = -1;      ///< of the exit; 1000 and more: how else it ended
  std::string output;   ///< stdout and stderr
};

/// Runs a command line.
inline Result shell(const std::string& command)
{
  Result result;
  FILE* pipe = popen((command + " 2>&1").c_str(), "r");
  if (!pipe)
    return result;
  std::array<char, 4096> buffer;
  for (std::size_t count = 0; (count = fread(buffer.data(), 1, buffer.size(), pipe)) > 0;)
    result.output.append(buffer.data(), count);
  const int status = pclose(pipe);
  result.status = WIFEXITED(status) ? WEXITSTATUS(status) : 1000 + status;
  return result;
}

}   // namespace slender::test
