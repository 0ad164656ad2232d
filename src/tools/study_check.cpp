#include "study_check.h"

#include <unistd.h>

#include <chrono>
#include <cstdio>
#include <filesystem>
#include <fstream>
#include <iostream>

#include "study/framework/processes.h"
#include "study/framework/whole_file.h"
#include "arguments.h"
#include "markup.h"
#include "slender_sim/study/study.h"

namespace slender {

namespace {

namespace fs = std::filesystem;
using Clock = std::chrono::steady_clock;

struct CheckedStudy
{
  std::string name;
  std::string failure;   ///< empty if the study passed
  Clock::time_point start{};
  double seconds = 0.0;
};

std::vector<CheckedStudy> chosenStudies(const std::vector<std::string>& only)
{
  std::vector<CheckedStudy> chosen;
  for (const std::string& name : only)
  {
    if (!study::findStudy(name))
      throw BadInput("check: no study is named '" + name + "'; `study list` shows the names");
    chosen.push_back({name, ""});
  }
  if (only.empty())
    for (const study::Study& s : study::studies())
      chosen.push_back({s.name, ""});
  return chosen;
}

void writeXml(const std::string& path, const std::vector<CheckedStudy>& studies)
{
  std::ofstream file(path);
  file << "<?xml version=\"1.0\"?>\n<testsuite name=\"studies\" tests=\"" << studies.size() << "\">\n";
  for (const CheckedStudy& s : studies)
  {
    file << "<testcase classname=\"studies\" name=\"" << escaped(s.name) << "\" time=\"" << s.seconds << "\">";
    if (!s.failure.empty())
      file << "<failure message=\"" << escaped(s.failure) << "\"/>";
    file << "</testcase>\n";
  }
  file << "</testsuite>\n";
  file.close();
  if (!file)
    throw BadInput("check: cannot write " + path);
}

}   // namespace

int checkStudies(const StudyCheckOptions& options)
{
  std::vector<CheckedStudy> chosen = chosenStudies(options.only);
  if (!options.xml.empty())
    writeXml(options.xml, {});   // A file that cannot be written is found out before minutes of work.
  const fs::path folder = fs::temp_directory_path() / ("slender_sim_studies_" + std::to_string(getpid()));
  fs::create_directories(folder);
  const auto log = [&](std::size_t k) { return (folder / (chosen[k].name + ".txt")).string(); };
  const auto command = [&](std::size_t k) {
    chosen[k].start = Clock::now();
    return std::vector<std::string>{"/bin/sh", "-c",
                                    "exec " + shellWord(thisProgram()) + " run " + chosen[k].name +
                                        " --quick --judge > " + shellWord(log(k)) + " 2>&1"};
  };
  int failed = 0;
  runProcesses(chosen.size(), static_cast<std::size_t>(options.jobs), command,
               [&](std::size_t k, const std::string& why) {
                 CheckedStudy& s = chosen[k];
                 s.seconds = std::chrono::duration<double>(Clock::now() - s.start).count();
                 s.failure = why;
                 std::printf("%-28s %6.1f s  %s\n", s.name.c_str(), s.seconds, why.empty() ? "passed" : "FAILED");
                 if (!why.empty())
                 {
                   ++failed;
                   std::cout << wholeFile(log(k));
                 }
                 std::fflush(stdout);
               });
  fs::remove_all(folder);
  if (!options.xml.empty())
    writeXml(options.xml, chosen);
  return failed;
}

}   // namespace slender
