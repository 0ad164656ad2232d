#include "study_report.h"

#include <sys/utsname.h>

#include <algorithm>
#include <chrono>
#include <cstdio>
#include <ctime>
#include <filesystem>
#include <fstream>
#include <iostream>
#include <map>
#include <stdexcept>
#include <vector>

#include <Eigen/Core>

#include "arguments.h"
#include "study/framework/processes.h"
#include "study/framework/whole_file.h"
#include "commit.h"
#include "report_page.h"
#include "results_page.h"
#include "slender_sim/study/study.h"

namespace slender {

namespace {

namespace fs = std::filesystem;

struct Plan
{
  const char* title;
  const char* words;
  std::vector<const char*> quick, more;   ///< studies of both extents, and of the full report only
};

const std::vector<Plan>& plans()
{
  static const std::vector<Plan> all = {
      {"Error against run time",
       "Each problem once, every way to solve it: integrators, steps, resolutions, tolerances; against one converged "
       "run.",
       {"swing", "thread_accuracy", "cloth_accuracy", "cloth_contact", "tracking_methods"},
       {"cantilever", "rods_at_rest", "peer_cases", "projection"}},
      {"Stability",
       "Stiff and extreme cases. Done, done with cut steps, or refused with a reason; never NaN, a crash or silently "
       "wrong.",
       {"rod_stability", "thread_stability", "cloth_stability", "tracking_stability", "statics_stability"},
       {"rod_contact_safety", "cloth_collision_safety", "coupled_safety"}},
      {"Repeatability",
       "Runs of fresh processes, whose heaps and numbers of threads differ: equal bit by bit.",
       {"repeatability"},
       {}},
      {"Beside the thesis's tables",
       "Times per step or frame of the thesis's examples, whose machine was of 2008.",
       {"rod_tables", "thread_tables", "ibm_vs_hinge", "implicit_step"},
       {"tracking_overhead", "willmore_smoothing", "hair", "tree"}},
      {"Cost against size",
       "",
       {"cost_model", "rod_scaling"},
       {"rod_implicit_vs_explicit", "thread_implicit_vs_explicit"}},
      {"What a scene does not name",
       "Instructions counted by valgrind, told apart by the lines of the sources that they come from.",
       {"lean"},
       {}},
      {"Phase diagrams",
       "Where one behaviour ends and the next begins.",
       {"michell", "bend_twist", "sagging"},
       {"sewing_machine", "coiling", "greenhill"}},
      {"Rods against formulas",
       "",
       {"elastica", "torsion", "torsional_pendulum", "twist_asymmetry"},
       {"beam_frequencies", "lateral_buckling", "perversion", "wilberforce", "helical_buckling", "helical_scene",
        "body_contact", "coupled_momentum", "rolling_rod", "sticking", "capstan", "stick_slip", "knot", "plectoneme",
        "chain"}},
      {"Threads against formulas",
       "",
       {"trouton", "thread_twist", "retraction"},
       {"thread_defaults", "merging", "fiber_extrusion", "dragged_catenary"}},
      {"Cloth against formulas and measurements",
       "",
       {"willmore_sphere", "willmore_hole", "fabric_drape", "plate_poisson", "curved_shells"},
       {"plate", "stick_slip_strip", "flag", "drape", "garments", "coupling_peers", "stiffness_range"}},
      {"Tracking",
       "Shells that follow a guide exactly on average.",
       {"breathing_surface", "rubber_band", "clustering"},
       {"tracking_exactness", "partitions", "character", "cloth_on_branch", "backflip"}},
  };
  return all;
}

/// The full report has every study, once.
void checkPlans()
{
  for (const study::Study& s : study::studies())
  {
    std::ptrdiff_t times = 0;
    for (const Plan& plan : plans())
      times += std::count(plan.quick.begin(), plan.quick.end(), s.name) +
               std::count(plan.more.begin(), plan.more.end(), s.name);
    if (times != 1)
      throw std::logic_error("report: " + s.name + " is in " + std::to_string(times) + " sections; must be in one");
  }
}

/// Of /proc, the value behind `key`.
std::string systemValue(const char* file, const std::string& key)
{
  std::ifstream lines(file);
  for (std::string line; std::getline(lines, line);)
    if (line.rfind(key, 0) == 0)
    {
      const std::size_t at = line.find_first_not_of(" \t:", key.size());
      return at == std::string::npos ? "" : line.substr(at);
    }
  return "unknown";
}

std::string localTime()
{
  const std::time_t now = std::time(nullptr);
  char text[64];
  std::strftime(text, sizeof text, "%Y-%m-%d %H:%M %Z", std::localtime(&now));
  return text;
}

/// One report holds the results of one extent only.
std::string extent(bool quick) { return std::string(quick ? "quick" : "full") + " report\n"; }

std::string thisVersion()
{
  const std::string commit = SLENDER_COMMIT;
  return SLENDER_VERSION + (commit.empty() ? "" : ", commit " + commit);
}

std::string processor() { return systemValue("/proc/cpuinfo", "model name"); }

using Facts = std::vector<std::pair<std::string, std::string>>;

/// What made the results: program and machine.
Facts facts(bool quick)
{
  utsname system{};
  uname(&system);
  return {{"version", thisVersion()},
          {"made", localTime()},
          {"extent", quick ? "quick: fewer and coarser cases" : "full"},
          {"processor", processor()},
          {"memory", systemValue("/proc/meminfo", "MemTotal")},
          {"system", std::string(system.sysname) + " " + system.release},
          {"compiler", "GCC " __VERSION__},
          {"Eigen", std::to_string(EIGEN_WORLD_VERSION) + "." + std::to_string(EIGEN_MAJOR_VERSION) + "." +
                        std::to_string(EIGEN_MINOR_VERSION)}};
}

std::string factsFile(const std::string& directory) { return directory + "/data/facts.txt"; }

void prepare(const ReportOptions& options)
{
  std::error_code error;
  fs::create_directories(options.out + "/data", error);
  if (error)
    throw BadInput("cannot make directory " + options.out + "/data: " + error.message());
  const std::string file = options.out + "/data/extent.txt", wanted = extent(options.quick);
  if (fs::exists(file) && wholeFile(file) != wanted)
    throw BadInput(options.out + " holds a report of another extent (" + file + "); give another --out or delete it");
  std::ofstream(file) << wanted;
  std::ofstream kept(factsFile(options.out));
  for (const auto& [key, text] : facts(options.quick))
    kept << key << ": " << text << "\n";
}

std::string versionFile(const ReportedStudy& s) { return s.folder + "/version.txt"; }

/// Returns the versions and processors that made the results of `sections`. The one with the most results comes first.
/// Each other one is followed by the names of its studies.
std::string versionsOf(const std::vector<ReportSection>& sections)
{
  std::map<std::string, std::vector<std::string>> studies;
  for (const ReportSection& section : sections)
    for (const ReportedStudy& s : section.studies)
      if (fs::exists(versionFile(s)))
        studies[wholeFile(versionFile(s))].push_back(s.name);
  std::vector<std::pair<std::string, std::vector<std::string>>> sorted(studies.begin(), studies.end());
  std::stable_sort(sorted.begin(), sorted.end(),
                   [](const auto& a, const auto& b) { return a.second.size() > b.second.size(); });
  std::string text;
  for (const auto& [version, names] : sorted)
  {
    text += (text.empty() ? "" : "; ") + version;
    if (&version == &sorted.front().first)
      continue;
    for (const std::string& name : names)
      text += (&name == &names.front() ? ": " : ", ") + name;
  }
  return text;
}

/// Replaces the version of the running program by the versions of the results, where these are known.
void tellVersions(Facts& facts, const std::vector<ReportSection>& sections)
{
  const std::string versions = versionsOf(sections);
  for (auto& [key, text] : facts)
    if (key == "version" && !versions.empty())
      text = versions;
}

/// Returns what prepare() kept. A report of a version that did not keep it has none.
Facts keptFacts(const std::string& directory)
{
  Facts kept;
  std::ifstream lines(factsFile(directory));
  for (std::string line; std::getline(lines, line);)
    if (const std::size_t at = line.find(": "); at != std::string::npos)
      kept.emplace_back(line.substr(0, at), line.substr(at + 2));
  return kept;
}

bool chosen(const ReportOptions& options, const std::string& name)
{
  return options.only.empty() || std::find(options.only.begin(), options.only.end(), name) != options.only.end();
}

/// Sections of the report with the studies that were asked for.
std::vector<ReportSection> sectionsOf(const ReportOptions& options)
{
  std::vector<ReportSection> sections;
  for (const Plan& plan : plans())
  {
    sections.push_back({plan.title, plan.words, {}});
    std::vector<const char*> names = plan.quick;
    if (!options.quick)
      names.insert(names.end(), plan.more.begin(), plan.more.end());
    for (const char* name : names)
      if (!chosen(options, name))
        continue;
      else if (const study::Study* found = study::findStudy(name))
        sections.back().studies.push_back({name, found->description, options.out + "/data/" + name, ""});
      else
        throw std::logic_error(std::string("report: no study ") + name);
    if (sections.back().studies.empty())
      sections.pop_back();
  }
  for (const std::string& name : options.only)
    if (std::none_of(sections.begin(), sections.end(), [&](const ReportSection& section) {
          return std::any_of(section.studies.begin(), section.studies.end(),
                             [&](const ReportedStudy& s) { return s.name == name; });
        }))
      throw BadInput("report: " + name + " is no study of the " + (options.quick ? "quick" : "full") + " report");
  return sections;
}

/// The command that runs a study and leaves its result.
std::vector<std::string> commandOf(const ReportedStudy& s, bool quick)
{
  const std::string json = s.folder + "/result.json";
  // under its own name only once it is whole
  return {"/bin/sh", "-c",
          shellWord(thisProgram()) + " run " + s.name + (quick ? " --quick" : "") + " --out " + shellWord(s.folder) +
              " --json " + shellWord(json + ".part") + " > " + shellWord(s.folder + "/log.txt") +
              " 2>&1; status=$?; [ $status -le 1 ] && mv " + shellWord(json + ".part") + " " + shellWord(json) +
              "; exit $status"};
}

void writePage(const std::string& path, const std::string& text)
{
  std::ofstream file(path);
  file << text;
  file.close();
  if (!file)
    throw BadInput("cannot write " + path);
}

}   // namespace

void writeResults(const std::string& directory)
{
  const std::string extent_file = directory + "/data/extent.txt";
  if (!fs::exists(extent_file))
    throw BadInput(directory + " holds no report: there is no " + extent_file);
  checkPlans();
  ReportOptions all;
  all.out = directory;
  const bool quick = wholeFile(extent_file).rfind("quick", 0) == 0;
  const std::vector<ReportSection> sections = sectionsOf(all);
  Facts kept = keptFacts(directory);
  tellVersions(kept, sections);
  writePage(directory + "/results.md", resultsPage(kept, quick, sections));
}

int makeReport(const ReportOptions& options)
{
  checkPlans();
  std::vector<ReportSection> sections = sectionsOf(options);
  std::vector<ReportedStudy*> todo;
  prepare(options);
  for (ReportSection& section : sections)
    for (ReportedStudy& s : section.studies)
      if (!fs::exists(s.folder + "/result.json"))
        todo.push_back(&s);

  const auto command = [&](std::size_t k) {
    fs::create_directories(todo[k]->folder);
    return commandOf(*todo[k], options.quick);
  };
  const auto start = std::chrono::steady_clock::now();
  Progress progress("report", "studies", todo.size());
  std::size_t done = 0;
  int failed = 0;
  runProcesses(todo.size(), static_cast<std::size_t>(options.jobs), command,
               [&](std::size_t k, const std::string& why) {
                 if (!why.empty())
                 {
                   ++failed;
                   std::cerr << "study: " << todo[k]->name << " " << why << ", see " << todo[k]->folder << "/log.txt\n";
                   if (!fs::exists(todo[k]->folder + "/result.json"))
                     todo[k]->failure = why;
                 }
                 std::ofstream(versionFile(*todo[k])) << thisVersion() << " on " << processor();
                 progress.show(++done);
               });
  const double seconds = std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
  char took[64];
  std::snprintf(took, sizeof took, "%.0f s for %zu studies, %ld at a time", seconds, todo.size(), options.jobs);
  Facts of_page = facts(options.quick);
  of_page.emplace_back("this call", took);
  tellVersions(of_page, sections);
  const std::string page = options.out + "/report.html";
  writePage(page, reportPage("slender_sim: error against run time, stability, cost", of_page, sections));
  writeResults(options.out);
  std::cout << page << ": " << todo.size() << " studies in " << static_cast<long>(seconds) << " s, " << failed
            << " failed\n";
  return failed;
}

}   // namespace slender
