// study list | run NAME... | check | report | results: the experiments behind the package's claims.

#include <chrono>
#include <cstring>
#include <exception>
#include <filesystem>
#include <fstream>
#include <iostream>
#include <memory>
#include <stdexcept>
#include <string>
#include <vector>

#include "arguments.h"
#include "slender_sim/study/bars.h"
#include "slender_sim/study/headlines.h"
#include "slender_sim/study/output.h"
#include "slender_sim/study/study.h"
#include "study_check.h"
#include "study_report.h"

namespace {

using slender::study::Study;
using slender::study::StudyContext;
using slender::study::StudyResult;

constexpr int kDone = 0, kStudyFailed = 1, kBadUsage = 2;

const char kUsage[] =
    "usage: study list\n"
    "       study run NAME... [--quick] [--cases LIST] [--judge] [--json FILE] [--out DIR]\n"
    "       study check [NAME...] [--jobs N] [--xml FILE]\n"
    "       study report [NAME...] --out DIR [--quick] [--jobs N]\n"
    "       study results DIR\n"
    "  NAME     a study of `study list`, or all\n"
    "  --quick  fewer cases and coarser ones: at most a minute or two each\n"
    "  --cases  only these of a study's numbered cases, such as 7,12,20-24 of coupled_safety\n"
    "  --judge  fails a study that exceeds a bound, misses a bar (timings are not judged) or lacks a figure of its "
    "headlines\n"
    "  check    runs the quick form of every study, or of those named, and judges it; --xml writes the results in "
    "JUnit's format\n"
    "  --json   metrics and rows of all studies run\n"
    "  --out    a CSV table and PNG plots of each study (the directory is made); report: DIR/report.html, one page "
    "with all of them, and DIR/results.md.\n"
    "           Results that are in DIR already are kept, also those of an earlier version;\n"
    "           with names: of these studies alone\n"
    "  results  writes DIR/results.md again from the results that a report left in DIR, and runs nothing\n"
    "  --jobs   studies at a time (default 1; times are of CPUs, but more of them disturb each other a little)\n"
    "exit status: 0 done, 1 a study failed, 2 bad usage\n";

int badUsage(const std::string& what)
{
  std::cerr << "study: " << what << "\n" << kUsage;
  return kBadUsage;
}

int list()
{
  std::size_t width = 0;
  for (const Study& s : slender::study::studies())
    width = std::max(width, s.name.size());
  for (const Study& s : slender::study::studies())
    std::cout << s.name << std::string(width + 2 - s.name.size(), ' ') << s.description << "\n";
  return kDone;
}

struct Options
{
  std::vector<const Study*> chosen;
  std::vector<int> cases;
  bool quick = false, judge = false;
  std::string json, out;
};

/// False, with the exit status, when there is nothing to run.
bool parse(const std::vector<std::string>& words, Options& options, int& status)
{
  for (std::size_t i = 0; i < words.size(); ++i)
  {
    const std::string& word = words[i];
    if (word == "--quick")
      options.quick = true;
    else if (word == "--judge")
      options.judge = true;
    else if (word == "--json" || word == "--out" || word == "--cases")
    {
      if (i + 1 == words.size() || words[i + 1].rfind("--", 0) == 0)
      {
        status = badUsage(word + " needs a " +
                          (word == "--json"  ? "file name"
                           : word == "--out" ? "directory"
                                             : "list of numbers"));
        return false;
      }
      if (word == "--cases")
        options.cases = slender::study::parseCases(words[++i]);
      else
        (word == "--json" ? options.json : options.out) = words[++i];
    }
    else if (word.rfind("-", 0) == 0)
    {
      status = badUsage("unknown option " + word);
      return false;
    }
    else if (word == "all")
      for (const Study& s : slender::study::studies())
        options.chosen.push_back(&s);
    else if (const Study* found = slender::study::findStudy(word))
      options.chosen.push_back(found);
    else
    {
      std::cerr << "study: no study named '" << word << "'; there are:\n";
      for (const Study& s : slender::study::studies())
        std::cerr << "  " << s.name << "\n";
      status = kBadUsage;
      return false;
    }
  }
  if (options.chosen.empty())
  {
    status = badUsage("run needs the name of a study");
    return false;
  }
  if (!options.cases.empty())
    for (const Study* study : options.chosen)
      if (!study->numbered)
      {
        status = badUsage("the cases of " + study->name + " have no numbers for --cases");
        return false;
      }
  return true;
}

bool writeFiles(const Options& options, const StudyContext& context)
{
  const std::string csv = options.out + "/" + context.name() + ".csv";
  std::ofstream file(csv);
  slender::study::writeCsv(file, context);
  file.close();
  if (!file)
  {
    std::cerr << "study: cannot write " << csv << "\n";
    return false;
  }
  const std::string problem = slender::study::writePlots(options.out, context);
  if (!problem.empty())
    std::cerr << "study: " << problem << "\n";
  return true;
}

int run(const Options& options)
{
  // Find out before hours of work that a result could not be written.
  std::ofstream json;
  if (!options.json.empty())
  {
    json.open(options.json);
    if (!json)
      return badUsage("cannot write " + options.json + ": " + std::strerror(errno));
  }
  if (!options.out.empty())
  {
    std::error_code error;
    std::filesystem::create_directories(options.out, error);
    if (error || !std::filesystem::is_directory(options.out))
      return badUsage("cannot make directory " + options.out + (error ? ": " + error.message() : ""));
  }

  int status = kDone;
  std::vector<std::unique_ptr<StudyContext>> contexts;
  std::vector<StudyResult> results;
  for (const Study* study : options.chosen)
  {
    contexts.push_back(std::make_unique<StudyContext>(study->name, options.quick, true));
    StudyContext& context = *contexts.back();
    context.choose(options.cases);
    const auto start = std::chrono::steady_clock::now();
    StudyResult result{&context, 0.0, ""};
    try
    {
      study->run(context);
    }
    catch (const std::exception& e)
    {
      result.error = e.what();
    }
    context.finish();
    result.wall_seconds = std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
    slender::study::printTable(std::cout, context);
    std::cout << "wall_seconds = " << result.wall_seconds << "\n\n" << std::flush;
    if (!result.error.empty())
    {
      std::cerr << "study: " << study->name << " failed: " << result.error << "\n";
      status = kStudyFailed;
    }
    if (options.judge && result.error.empty())
      for (const auto& judged : {slender::study::judge(context), slender::study::missingFigures(context)})
        for (const std::string& failure : judged)
        {
          std::cerr << "study: " << study->name << ": " << failure << "\n";
          status = kStudyFailed;
        }
    if (!options.out.empty() && !writeFiles(options, context))
      status = kStudyFailed;
    results.push_back(result);
  }
  if (json.is_open())
  {
    slender::study::writeJson(json, results);
    json.close();
    if (!json)
    {
      std::cerr << "study: cannot write " << options.json << "\n";
      status = kStudyFailed;
    }
  }
  return status;
}

int report(const std::vector<std::string>& words)
{
  slender::ReportOptions options;
  for (std::size_t i = 0; i < words.size(); ++i)
    if (words[i] == "--quick")
      options.quick = true;
    else if ((words[i] == "--out" || words[i] == "--jobs") && i + 1 < words.size())
    {
      const std::string& value = words[i + 1];
      if (words[i] == "--out")
        options.out = value;
      else
        options.jobs = slender::parseCount("--jobs", value, 1, 1000);
      ++i;
    }
    else if (words[i].rfind("-", 0) == 0)
      return badUsage("report: " + words[i] + " is not an option, or its value is missing");
    else
      options.only.push_back(words[i]);
  if (options.out.empty())
    return badUsage("report needs --out DIR");
  return slender::makeReport(options) == 0 ? kDone : kStudyFailed;
}

int results(const std::vector<std::string>& words)
{
  if (words.size() != 1 || words[0].rfind("-", 0) == 0)
    return badUsage("results needs the directory of a report");
  slender::writeResults(words[0]);
  std::cout << words[0] << "/results.md\n";
  return kDone;
}

int check(const std::vector<std::string>& words)
{
  slender::StudyCheckOptions options;
  for (std::size_t i = 0; i < words.size(); ++i)
    if (words[i] == "--jobs" && i + 1 < words.size())
      options.jobs = slender::parseCount("--jobs", words[++i], 1, 1000);
    else if (words[i] == "--xml" && i + 1 < words.size())
      options.xml = words[++i];
    else if (words[i].rfind("-", 0) == 0)
      return badUsage("check: " + words[i] + " is not an option, or its value is missing");
    else
      options.only.push_back(words[i]);
  return slender::checkStudies(options) == 0 ? kDone : kStudyFailed;
}

}   // namespace

int main(int argc, char** argv)
{
  const std::vector<std::string> words(argv + 1, argv + argc);
  if (words.empty())
    return badUsage("say what to do");
  if (words[0] == "--help" || words[0] == "-h")
  {
    std::cout << kUsage;
    return kDone;
  }
  if (words[0] == "list")
    return words.size() == 1 ? list() : badUsage("list takes no arguments");
  try
  {
    if (words[0] == "report")
      return report({words.begin() + 1, words.end()});
    if (words[0] == "results")
      return results({words.begin() + 1, words.end()});
    if (words[0] == "check")
      return check({words.begin() + 1, words.end()});
  }
  catch (const std::exception& error)   // BadInput, a process that cannot be started
  {
    std::cerr << "study: " << error.what() << "\n";
    return kBadUsage;
  }
  if (words[0] != "run")
    return badUsage("unknown command " + words[0]);
  Options options;
  int status = kDone;
  try
  {
    if (!parse({words.begin() + 1, words.end()}, options, status))
      return status;
  }
  catch (const std::invalid_argument& error)
  {
    return badUsage(error.what());
  }
  return run(options);
}
