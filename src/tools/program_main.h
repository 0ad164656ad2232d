#pragma once

#include <cstdio>
#include <exception>

#include "slender_sim/scene/file_paths.h"
#include "slender_sim/scene/simulation.h"

namespace slender {

/// Exit statuses of the programs.
constexpr int kDone = 0, kBadInput = 2, kFailed = 3;

/// The main function of a program: parses its arguments to options, prints the usage if options.help, else runs. A
/// simulation that fails and a file that cannot be written end with kFailed, any other exception with kBadInput; its
/// text goes to stderr.
template <class Parse, class Run>
int programMain(const char* name, const char* usage, int argc, char** argv, Parse parse, Run run)
{
  const auto say = [name](const std::exception& error) { std::fprintf(stderr, "%s: %s\n", name, error.what()); };
  try
  {
    const auto options = parse(argc, argv);
    if (!options.help)
      return run(options);
    std::fputs(usage, stdout);
    return kDone;
  }
  catch (const SimulationError& error)
  {
    say(error);
    return kFailed;
  }
  catch (const WriteError& error)
  {
    say(error);
    return kFailed;
  }
  catch (const std::exception& error)   // SceneError, BadInput, a mesh with defects, a recorder that cannot begin
  {
    say(error);
    return kBadInput;
  }
}

}   // namespace slender
