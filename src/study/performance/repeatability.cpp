// A run repeats itself bit by bit: every scene of the package and random ones, each twice in fresh processes whose
// heaps and numbers of threads differ.
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <random>
#include <sstream>
#include <stdexcept>
#include <string>
#include <vector>

#include "study/framework/processes.h"
#include "study/framework/whole_file.h"
#include "slender_sim/scene/reader.h"
#include "slender_sim/study/study.h"

namespace slender::study {
namespace {

namespace fs = std::filesystem;

/// What `simulate` printed, but for lines that tell wall time.
std::string withoutTimes(const std::string& text)
{
  std::string kept;
  std::istringstream lines(text);
  for (std::string line; std::getline(lines, line);)
    if (line.rfind("wall ", 0) != 0 && line.rfind("real-time factor", 0) != 0)
      kept += line + "\n";
  return kept;
}

long numberAfter(const std::string& text, const std::string& words)
{
  const std::size_t at = text.find(words);
  return at == std::string::npos ? 0 : std::strtol(text.c_str() + at + words.size(), nullptr, 10);
}

struct Outcome
{
  int status = -1;   ///< of the exit
  std::string printed, state;
  bool operator==(const Outcome& other) const
  {
    return status == other.status && printed == other.printed && state == other.state;
  }
};

/// A folder for scenes and states, and the program that runs them.
class Twice
{
public:
  Twice() : simulate_((fs::path(thisProgram()).parent_path() / "simulate").string())
  {
    if (!fs::exists(simulate_))
      throw std::runtime_error("there is no " + simulate_ + ", which runs the scenes: build all of the package");
    std::string name = (fs::temp_directory_path() / "slender_sim_repeatability_XXXXXX").string();
    if (!mkdtemp(name.data()))
      throw std::runtime_error("cannot make a folder in " + fs::temp_directory_path().string());
    folder_ = name;
  }
  ~Twice()
  {
    std::error_code error;
    fs::remove_all(folder_, error);
  }

  const std::string& folder() const { return folder_; }

  /// Fresh memory differs between the two (glibc): every byte of new blocks is 0x7f (numbers of 1e306) or 0xfe
  /// (-5e303), and large ones are of the heap in the second.
  Outcome run(const std::string& scene, const std::string& options, bool second) const
  {
    const std::string state = folder_ + "/state", printed = folder_ + "/printed";
    fs::remove(state);
    const std::string environment = second ? "MALLOC_PERTURB_=1 MALLOC_MMAP_THRESHOLD_=1073741824 SLENDER_THREADS=3 "
                                           : "MALLOC_PERTURB_=128 SLENDER_THREADS=1 ";
    const std::string command = environment + shellWord(simulate_) + " " + shellWord(scene) + " " + options +
                                " --threads " + (second ? "3" : "1") + " --state " + shellWord(state) + " > " +
                                shellWord(printed) + " 2>&1";
    const int status = std::system(command.c_str());
    return {WIFEXITED(status) ? WEXITSTATUS(status) : -1, withoutTimes(wholeFile(printed)), wholeFile(state)};
  }

private:
  std::string simulate_, folder_;
};

/// A cable that branches at a body, with a second body at the end of a branch, drawn about by a grasp. Every third
/// falls onto obstacles. Newton's method gets few iterations, so that steps are cut.
std::string randomScene(int seed, int steps)
{
  // whose numbers are the same everywhere, as those of distributions need not be
  std::mt19937 random(static_cast<unsigned>(seed));
  const auto uniform = [&](double from, double to) {
    return from + (to - from) * (static_cast<double>(random()) / 4294967296.0);
  };
  const auto pick = [&](int count) { return static_cast<int>(random() % static_cast<unsigned>(count)); };
  const bool contact = pick(3) > 0, obstacles = contact && seed % 3 == 0;
  const std::vector<std::string> integrators = {"implicit_euler", "bdf2", "tr_bdf2", "generalized_alpha",
                                                "implicit_midpoint"};
  const double step = obstacles ? 0.004 : uniform(0.002, 0.02);
  std::ostringstream s;
  s << "name: random_" << seed << "\ntime: {step: " << step << ", duration: " << step * steps
    << ", integrator: " << integrators[pick(contact ? 3 : 5)] << ", newton: {max_iterations: " << 5 + pick(12)
    << "}}\nrods:\n";
  const int branches = 2 + pick(3);
  for (int b = 0; b < branches; ++b)
  {
    const double angle = 2 * M_PI * b / branches + uniform(-0.2, 0.2), x = std::cos(angle), y = std::sin(angle),
                 length = uniform(0.1, 0.3);
    const bool held = b == 0;
    s << "  - name: branch" << b << "\n    centerline: {straight: {from: [" << 0.03 * x << ", " << 0.03 * y
      << ", 0.4], to: [" << (0.03 + length) * x << ", " << (0.03 + length) * y << ", " << 0.4 + uniform(-0.03, 0.03)
      << "], edges: " << 5 + pick(16) << "}}\n"
      << "    cross_section: {radius: " << uniform(0.002, 0.004)
      << "}\n    material: {density: 1100, youngs_modulus: " << std::pow(10.0, uniform(6.0, 8.0))
      << ", poissons_ratio: 0.4}\n    damping: {mass: " << uniform(0.0, 1.0)
      << ", stiffness: " << (pick(2) ? uniform(0.0, 0.005) : 0.0) << "}\n";
    if (contact)
      s << "    contact: {friction: " << uniform(0.0, 0.8) << "}\n";
    if (held)
      s << "    grasps:\n      hand: {edges: [-1], attach: initial, motion: {table: [[0, 0, 0, 0], [" << 5 * step
        << ", " << uniform(-0.05, 0.05) << ", " << uniform(-0.05, 0.05) << ", " << uniform(0.0, 0.1) << "], ["
        << 9 * step << ", 0, " << uniform(-0.1, 0.1) << ", 0], [" << (steps + 1) * step << ", 0.05, 0, 0]]}}\n";
  }
  s << "bodies:\n  - name: hub\n    mass: " << uniform(0.005, 0.05)
    << "\n    inertia: [3.0e-6, 4.0e-6, 5.0e-6]\n    shape: {sphere: {radius: 0.01}}\n"
    << "    pose: {position: [0, 0, 0.4]}\n    contact: false\n    welds: [";
  for (int b = 0; b < branches; ++b)
    s << (b ? ", " : "") << "{rod: branch" << b << ", edge: 0}";
  s << "]\n  - name: weight\n    mass: " << uniform(0.002, 0.02)
    << "\n    inertia: [1.0e-6, 2.0e-6, 2.5e-6]\n    shape: {sphere: {radius: 0.005}}\n"
    << "    pose: {position: [0, 0.5, 0.4]}\n    contact: false\n    welds: [{rod: branch1, edge: -1}]\n";
  if (obstacles)
    s << "obstacles:\n  - {name: ball, shape: {sphere: {radius: 0.06}}, pose: {position: [" << uniform(-0.05, 0.05)
      << ", " << uniform(-0.05, 0.05) << ", 0.32]}}\n  - {name: floor, shape: {plane: {}}}\n";
  return s.str();
}

}   // namespace

void runRepeatability(StudyContext& context)
{
  struct Case
  {
    std::string kind, name, file, options;
    int steps;
  };
  const Twice twice;
  const int random_count = context.quick() ? 8 : 100, random_steps = context.quick() ? 10 : 40,
            shipped_steps = context.quick() ? 2 : 15;
  const std::string folder = std::string(SLENDER_SOURCE_DIR) + "/config/scenes";
  // one of each kind; all in the full study
  const std::vector<std::string> few = {"demo_rope",  "chain",      "wilberforce",  "twisted_ring",
                                        "honey_coil", "honey_pile", "tracked_rope", "swing_coarse"};
  std::vector<Case> cases;
  std::vector<std::string> names;
  for (const auto& entry : fs::directory_iterator(folder))
    if (entry.path().extension() == ".yaml")
      names.push_back(entry.path().stem().string());
  std::sort(names.begin(), names.end());
  if (names.empty())
    throw std::runtime_error("there are no scenes in " + folder);
  for (const std::string& name : names)
    if (!context.quick() || std::find(few.begin(), few.end(), name) != few.end())
      cases.push_back({"shipped", name, folder + "/" + name + ".yaml", "", shipped_steps});
  for (int k = 0; k < random_count; ++k)
  {
    const std::string name = "random_" + std::to_string(k), file = twice.folder() + "/" + name + ".yaml";
    std::ofstream(file) << randomScene(k, random_steps);
    cases.push_back({"random", name, file, "", random_steps});
  }
  int differing = 0, not_run = 0, done = 0;
  long cuts = 0, with_cuts = 0;
  for (const Case& c : cases)
  {
    context.progress(done++, static_cast<int>(cases.size()), c.name);
    const double duration = readScene(c.file).time.step * c.steps;
    std::ostringstream options;
    options << "--duration " << duration;
    const Outcome first = twice.run(c.file, options.str(), false), second = twice.run(c.file, options.str(), true);
    const bool ran = !first.state.empty() && (first.status == 0 || first.status == 3), same = first == second;
    const long own_cuts = numberAfter(first.printed, "cut steps         ");
    differing += !same;
    not_run += !ran;
    cuts += own_cuts;
    with_cuts += own_cuts > 0;
    Row& row = context.row();
    row.set("kind", c.kind)
        .set("scene", c.name)
        .set("steps", c.steps)
        .set("exit_status", first.status)
        .set("cut_steps", static_cast<double>(own_cuts));
    row.set("differs", same                            ? ""
                       : first.status != second.status ? "exit status"
                       : first.state != second.state   ? "state"
                                                       : "report");
    if (!ran)
      row.set("remark", first.printed.substr(0, first.printed.find('\n')));
  }
  context.metric("runs", 2.0 * static_cast<double>(cases.size()));
  context.metric("differing_runs", differing);
  context.metric("scenes_not_run", not_run);
  context.metric("cut_steps", static_cast<double>(cuts));
  context.metric("scenes_with_cut_steps", static_cast<double>(with_cuts));
  context.row()
      .set("kind", "all")
      .set("scene", "differing runs")
      .check(differing, 0.0, 0.5, "a run repeats itself bit by bit");
  context.row()
      .set("kind", "all")
      .set("scene", "scenes that did not run")
      .check(not_run, 0.0, 0.5, "every scene is valid");
  context.row()
      .set("kind", "all")
      .set("scene", "no scene cut a step")
      .check(with_cuts > 0 ? 0.0 : 1.0, 0.0, 0.5, "cut steps are among what is repeated");
}

const StudyRegistration kRepeatabilityRegistration{
    "repeatability", "every scene of the package and random ones, each twice in fresh processes: equal bit by bit",
    runRepeatability};

}   // namespace slender::study
