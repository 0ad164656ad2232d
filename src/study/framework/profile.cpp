#include "profile.h"

#include <algorithm>
#include <unistd.h>

#include <cstdio>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <istream>
#include <map>
#include <stdexcept>

#include "scene/reader/yaml_tree.h"
#include "processes.h"
#include "whole_file.h"
#include "slender_sim/scene/reader.h"

namespace slender::study {

namespace {

namespace fs = std::filesystem;

/// "0x4A: function (file:line)", "0x4A: function (in library)" or "[root]".
void splitFrame(const std::string& frame, const std::string& sources, SourceLine& at, std::string& function)
{
  const std::size_t colon = frame.find(": "), open = frame.rfind(" (");
  if (colon == std::string::npos || open == std::string::npos || open < colon + 2)
  {
    function = frame;
    return;
  }
  function = frame.substr(colon + 2, open - colon - 2);
  const std::string place = frame.substr(open + 2, frame.size() - open - 3);
  const std::size_t number = place.rfind(':');
  if (number == std::string::npos || place.rfind("in ", 0) == 0)
    return;
  at.line = std::atoi(place.c_str() + number + 1);
  at.file = packagePath(sources, place.substr(0, number));
}

}   // namespace

std::string packagePath(const std::string& sources, const std::string& path)
{
  // The compiler may have been given relative paths, and a cache of objects others' absolute ones: what counts is that
  // we have the file.
  static std::map<std::pair<std::string, std::string>, std::string> known;
  const auto [found, added] = known.emplace(std::make_pair(sources, path), path);
  if (!added)
    return found->second;
  for (const char* part : {"src/", "include/slender_sim/"})
    for (std::size_t at = path.rfind(part); at != std::string::npos;
         at = at == 0 ? std::string::npos : path.rfind(part, at - 1))
      if ((at == 0 || path[at - 1] == '/') && fs::exists(sources + "/" + path.substr(at)))
        return found->second = path.substr(at);
  return path;
}

void readCallgrind(std::istream& file, const std::string& sources, StepProfile& profile)
{
  InstructionCost now;
  bool in_call = false, events = false;
  for (std::string line; std::getline(file, line);)
  {
    const std::size_t equals = line.find('=');
    const std::string key = equals == std::string::npos ? "" : line.substr(0, equals);
    const auto value = [&] { return line.substr(equals + 1); };
    if (line == "events: Ir")
      events = true;
    else if (key == "fl")
      now.function_file = now.at.file = packagePath(sources, value());
    else if (key == "fn")
    {
      now.function = value();
      now.at.file = now.function_file;
    }
    else if (key == "fi" || key == "fe")
      now.at.file = packagePath(sources, value());
    else if (key == "cfi" || key == "cfl")
      now.callee_file = packagePath(sources, value());
    else if (key == "cfn")
    {
      now.callee = value();
      if (now.callee_file.empty())
        now.callee_file = now.at.file;
    }
    else if (key == "calls")
    {
      now.calls = std::strtoull(value().c_str(), nullptr, 10);
      in_call = true;
    }
    else if (!line.empty() && line[0] >= '0' && line[0] <= '9')
    {
      char* rest = nullptr;
      now.at.line = static_cast<int>(std::strtol(line.c_str(), &rest, 10));
      now.instructions = std::strtoull(rest, nullptr, 10);
      if (in_call)
        profile.costs.push_back(now);
      else if (now.instructions > 0)
      {
        InstructionCost own = now;
        own.callee.clear();
        own.callee_file.clear();
        own.calls = 0;
        profile.costs.push_back(own);
        profile.instructions += now.instructions;
      }
      if (in_call)
      {
        now.callee.clear();
        now.callee_file.clear();
      }
      in_call = false;
    }
  }
  if (!events)
    throw std::runtime_error("callgrind has written something else than counts of instructions");
}

std::vector<Allocation> readDhat(const std::string& text, const std::string& sources)
{
  std::vector<Allocation> all;
  try
  {
    const YamlTree tree = parseYaml(text, "dhat");   // JSON is YAML
    const YamlTree *points = tree.find("pps"), *table = tree.find("ftbl");
    if (!points || !table)
      throw std::runtime_error("dhat has written something else than allocations");
    std::vector<std::pair<SourceLine, std::string>> frames(table->items.size());
    for (std::size_t k = 0; k < frames.size(); ++k)
      splitFrame(table->items[k].scalar, sources, frames[k].first, frames[k].second);
    for (const YamlTree& point : points->items)
    {
      Allocation a;
      a.bytes = std::strtoull(point.find("tb")->scalar.c_str(), nullptr, 10);
      a.blocks = std::strtoull(point.find("tbk")->scalar.c_str(), nullptr, 10);
      for (const YamlTree& index : point.find("fs")->items)
      {
        const auto& frame = frames.at(std::strtoull(index.scalar.c_str(), nullptr, 10));
        a.stack.push_back(frame.first);
        a.functions.push_back(frame.second);
      }
      all.push_back(std::move(a));
    }
  }
  catch (const SceneError& error)
  {
    throw std::runtime_error(std::string("cannot read what dhat wrote: ") + error.what());
  }
  return all;
}

Profiler::Profiler(std::string simulate, std::string sources)
  : simulate_(std::move(simulate)),
    sources_(std::move(sources))
{
  if (std::system("valgrind --version > /dev/null 2>&1") != 0)
    throw std::runtime_error(
        "valgrind is missing, which counts instructions: apt-get install valgrind (scripts/setup does)");
  if (!fs::exists(simulate_))
    throw std::runtime_error("there is no " + simulate_ + ", whose instructions are counted: build all of the package");
  if (!fs::exists(sources_ + "/src/scene/simulation/simulation.cpp"))
    throw std::runtime_error("the sources that this program was built from are not in " + sources_ +
                             " any more: instructions are told apart by their lines");
  std::string name = (fs::temp_directory_path() / "slender_sim_lean_XXXXXX").string();
  if (!mkdtemp(name.data()))
    throw std::runtime_error("cannot make a folder in " + fs::temp_directory_path().string());
  folder_ = name;
}

Profiler::~Profiler()
{
  std::error_code error;
  fs::remove_all(folder_, error);
}

const std::string& Profiler::text(const SourceLine& at) const
{
  static std::map<std::string, std::vector<std::string>> files;
  static const std::string nothing;
  if (at.line <= 0 || (at.file.rfind("src/", 0) != 0 && at.file.rfind("include/", 0) != 0))
    return nothing;
  const auto [found, added] = files.try_emplace(sources_ + "/" + at.file);
  if (added)
  {
    std::ifstream file(found->first);
    for (std::string line; std::getline(file, line);)
      found->second.push_back(line.substr(0, line.find("//")));   // what is said about the code is no code
  }
  return static_cast<std::size_t>(at.line) <= found->second.size() ? found->second[at.line - 1] : nothing;
}

std::string Profiler::run(const std::string& tool, const std::string& scene, double step,
                          const std::vector<std::string>& options, int steps) const
{
  for (const auto& old : fs::directory_iterator(folder_))
    fs::remove_all(old);
  const std::string file = folder_ + "/scene.yaml", log = folder_ + "/log.txt";
  std::ofstream(file) << scene;
  // One thread, and instructions that valgrind knows: so that counts do not depend on the machine.
  std::string command = "SLENDER_ISA=baseline SLENDER_THREADS=1 OPENBLAS_NUM_THREADS=1 valgrind " + tool + " " +
                        shellWord(simulate_) + " " + shellWord(file) + " --quiet --threads 1 --duration " +
                        std::to_string(step * steps);
  for (std::string word : options)
  {
    if (const std::size_t at = word.find("FOLDER"); at != std::string::npos)
      word.replace(at, 6, folder_ + "/recorded");
    command += " " + shellWord(word);
  }
  if (std::system((command + " > " + shellWord(log) + " 2>&1").c_str()) != 0)
    throw std::runtime_error("failed: " + command + "\n" + wholeFile(log));
  return folder_ + "/out";
}

StepProfile Profiler::instructions(const std::string& scene, double step, const std::vector<std::string>& options,
                                   int steps, int counted) const
{
  const std::string out =
      run("--tool=callgrind --compress-strings=no --compress-pos=no '--dump-after=slender::Simulation::step(*' "
          "--callgrind-out-file=" +
              shellWord(folder_ + "/out"),
          scene, step, options, steps);
  StepProfile profile;
  for (int k = steps - counted + 1; k <= steps; ++k)   // a file per step: what came after the step before, and the step
  {
    std::ifstream file(out + "." + std::to_string(k));
    if (!file)
      throw std::runtime_error("callgrind has not seen step " + std::to_string(k) + ": does " + simulate_ +
                               " have symbols?");
    readCallgrind(file, sources_, profile);
    ++profile.steps;
  }
  // packagePath() leaves paths beside the package absolute, and valgrind writes ??? where there are no line tables
  const bool known = std::any_of(profile.costs.begin(), profile.costs.end(), [](const InstructionCost& cost) {
    return cost.function_file.compare(0, 4, "src/") == 0;
  });
  if (!known)
    throw std::runtime_error("the library of " + simulate_ +
                             " has no line tables; build it with cmake -DLINE_TABLES=-g1");
  return profile;
}

std::vector<Allocation> Profiler::allocations(const std::string& scene, double step,
                                              const std::vector<std::string>& options, int steps) const
{
  return readDhat(
      wholeFile(run("--tool=dhat --fullpath-after=/ --num-callers=60 --dhat-out-file=" + shellWord(folder_ + "/out"),
                    scene, step, options, steps)),
      sources_);
}

}   // namespace slender::study
