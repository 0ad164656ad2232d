// sweep PLAN.yaml --out DIR: runs of a scene over combinations of its values, each in a process of its own, resumable.

#include <fcntl.h>
#include <sys/file.h>

#include <cstdio>
#include <iostream>
#include <limits>
#include <stdexcept>
#include <string>
#include <vector>

#include "arguments.h"
#include "slender_sim/scene/sweep_plan.h"
#include "slender_sim/study/measure.h"
#include "sweep_engines.h"
#include "sweep_runs.h"

namespace {

using slender::BadInput;
using slender::SweepPlan;

constexpr int kDone = 0, kSomeFailed = 1, kBadInput = 2;

const char kUsage[] =
    "usage: sweep PLAN.yaml --out DIR [--jobs N] [--engine local|parallel|slurm] [--engine-options WORDS] [--point K] "
    "[--count]\n"
    "  --out             DIR/results.csv at the end; runs that are done already are not done again\n"
    "  --jobs            runs at a time (default: one per processor; Slurm: as it allows)\n"
    "  --engine          parallel: GNU parallel, with --engine-options '--sshlogin a,b' on several machines that share "
    "DIR\n"
    "                    slurm: an array of tasks, with --engine-options '--partition=long --time=60'\n"
    "  --point           only run K, for any other engine; a last call without it does what is missing and collects\n"
    "  --count           prints the number of runs\n"
    "exit status: 0 done, 1 some runs failed (results.csv names the reasons), 2 bad input\n";

struct Options
{
  std::string plan, out;
  slender::sweep::Engine engine{"local", "", 0};
  long point = -1;
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
      options.engine.jobs = slender::parseCount(word, value(), 1, 100000);
    else if (word == "--engine")
      options.engine.kind = value();
    else if (word == "--engine-options")
      options.engine.options = value();
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
  const std::string& kind = options.engine.kind;
  if (kind != "local" && kind != "parallel" && kind != "slurm")
    throw BadInput("--engine " + kind + ": must be local, parallel or slurm");
  if (kind == "local" && !options.engine.options.empty())
    throw BadInput("--engine-options are for --engine parallel or slurm");
  return options;
}

int run(const Options& options)
{
  const SweepPlan plan = slender::readSweepPlan(options.plan);
  slender::sweep::checkPlan(plan);
  if (options.count)
  {
    std::printf("%ld\n", plan.points());
    return kDone;
  }
  slender::sweep::prepare(plan, options.out);
  if (options.point >= 0)
  {
    slender::sweep::runPoint(plan, options.out, options.point);
    return kDone;
  }
  const int lock = open((options.out + "/lock").c_str(), O_CREAT | O_RDWR | O_CLOEXEC, 0644);
  if (lock < 0 || flock(lock, LOCK_EX | LOCK_NB) != 0)
    throw BadInput(options.out + ": another sweep is at work there");
  const auto crashed = slender::sweep::runMissing(plan, options.plan, options.out, options.engine);
  const long failed = slender::sweep::collect(plan, options.out, crashed);
  return failed ? kSomeFailed : kDone;
}

}   // namespace

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
