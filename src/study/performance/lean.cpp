// What a scene does not name costs nothing: instructions per step and memory of every feature in scenes without it,
// beside scenes with it.
#include <algorithm>
#include <cmath>
#include <filesystem>
#include <initializer_list>
#include <map>
#include <regex>
#include <stdexcept>
#include <string>
#include <vector>

#include "study/framework/processes.h"
#include "study/framework/profile.h"
#include "slender_sim/study/study.h"

namespace slender::study {

namespace {

struct Scene
{
  const char* name;
  const char* solver;
  double step;   // [s]
  const char* text;
  std::vector<std::string> options;   ///< of `simulate`
};

/// Small, so that what does not depend on the size weighs as much as it ever does.
const Scene kRod = {"rod",
                    "rod",
                    0.005,
                    R"(
name: rod
time: {step: 0.005, duration: 1}
rods:
  - name: rod
    centerline: {straight: {from: [0, 0, 0.1], to: [1, 0, 0.1], edges: 50}}
    cross_section: {radius: 0.005}
    material: {density: 1000, youngs_modulus: 1.0e7}
    grasps: {clamp: {edges: [0]}}
)",
                    {}};

const Scene kExplicitRod = {"rod, explicit, isotropic",
                            "rod",
                            2e-5,
                            R"(
name: rod
time: {step: 2.0e-5, duration: 1, integrator: symplectic_euler}
rods:
  - name: rod
    centerline: {straight: {from: [0, 0, 0.1], to: [1, 0, 0.1], edges: 50}}
    cross_section: {radius: 0.005}
    material: {density: 1000, youngs_modulus: 1.0e7}
    grasps: {clamp: {nodes: [0], hold: position}}
)",
                            {}};

const Scene kThread = {"thread",
                       "thread",
                       0.001,
                       R"(
name: thread
time: {step: 0.001, duration: 1}
threads:
  - name: oil
    fluid: {density: 907, viscosity: 10}
    centerline: {straight: {from: [0, 0, 0], to: [0.025, 0, 0], edges: 50}}
    radius: 0.000875
    ends: {oldest: held, newest: held}
)",
                       {}};

const Scene kCloth = {"cloth",
                      "cloth",
                      0.01,
                      R"(
name: cloth
time: {step: 0.01, duration: 1}
cloths:
  - name: cloth
    grid: {corner: [0, 0, 0.3], sides: [[0.3, 0, 0], [0, 0.3, 0]], cells: 10, pattern: alternating}
    material: {area_density: 0.2, thickness: 0.0005, youngs_modulus: 5.0e5, poissons_ratio: 0.3}
    bending: {model: hinge}
    solver: {one_newton_step: true}
    grasps: {left: {corner: lower_left}, right: {corner: lower_right}}
)",
                      {}};

const Scene kTracked = {"tracked",
                        "tracked",
                        0.01,
                        R"(
name: tracked
time: {step: 0.01, duration: 1}
tracked:
  - name: sheet
    guide: {grid: {corner: [0, 0, 0], sides: [[0.4, 0, 0], [0, 0.4, 0]], cells: [3, 3], pattern: alternating}, motion: fixed}
    mesh: {subdivide: 2}
    test_functions: {basis: subdivision}
    material: {area_density: 0.2, thickness: 0.001, youngs_modulus: 1.0e5}
    bending: {model: hinge}
    solver: {one_newton_step: true}
)",
                        {}};

Scene with(const Scene& scene, const std::vector<std::string>& overrides)
{
  Scene s = scene;
  for (const std::string& value : overrides)
  {
    s.options.push_back("--set");
    s.options.push_back(value);
  }
  return s;
}

/// The code of a feature: whole files, and lines elsewhere that speak of it.
struct Feature
{
  const char* name;
  std::vector<const char*> files;   ///< how their paths begin
  const char* words;                ///< regular expression; empty: none
  std::vector<Scene> without, used;
};

std::vector<Feature> features()
{
  const std::string plane = "obstacles=[{name: floor, shape: {plane: {}}, pose: {position: [0, 0, 0.0949]}}]";
  const Scene rod_on_floor = with(kRod, {"rods.0.contact={self: false, friction: 0}", plane});
  const Scene cloth_on_ball =
      with(kCloth, {"cloths.0.contact={self: false, friction: 0, thickness: 0.002}",
                    "obstacles=[{name: ball, shape: {sphere: {radius: 0.1}}, pose: {position: [0.15, 0.15, 0.198]}}]"});
  const Scene thread_with_itself = with(kThread, {"threads.0.contact={self: true, friction: 0}"});
  const std::string welded_disc =
      "bodies=[{name: disc, mass: 0.1, shape: {sphere: {radius: 0.02}}, contact: false, welds: [{rod: rod, edge: "
      "-1}]}]";
  const std::vector<Scene> all = {kRod, kExplicitRod, kThread, kCloth, kTracked};
  return {
      {"contact",
       {"src/contact/", "include/slender_sim/contact/", "src/island/confined_newton", "src/world/meeting",
        "src/world/impulse_"},
       "[cC]ontact|[tT]ouching|[cC]ollision|[cC]ollide",
       all,
       {rod_on_floor, thread_with_itself, cloth_on_ball}},
      {"self-contact",
       {},
       "\\bself\\b|self_",
       {kRod, kThread, kCloth, kTracked, rod_on_floor, cloth_on_ball},
       {with(rod_on_floor, {"rods.0.contact.self=true"}), thread_with_itself,
        with(cloth_on_ball, {"cloths.0.contact.self=true"})}},
      {"friction",
       {"include/slender_sim/contact/friction"},
       "[fF]riction|\\bslip",
       {kRod, kThread, kCloth, kTracked, rod_on_floor, cloth_on_ball, thread_with_itself},
       {with(rod_on_floor, {"rods.0.contact.friction=0.3"}), with(cloth_on_ball, {"cloths.0.contact.friction=0.3"})}},
      {"coupled matrix",
       {"src/island/shared_matrix", "src/linalg/component_cholesky"},
       "[cC]onjugateGradientsIn|SharedMatrix|ComponentCholesky",
       {kRod, kExplicitRod, kThread, kCloth, kTracked, rod_on_floor, cloth_on_ball, thread_with_itself},
       {with(kRod, {welded_disc})}},
      {"rigid bodies",
       {"src/rod/body_system", "src/rod/body_part", "src/rod/body_explicit", "include/slender_sim/rod/rigid_body",
        "src/dynamics/fast_projection_bodies"},
       "\\b[bB]od(y|ies)|\\bweld",
       all,
       {with(kRod, {welded_disc})}},
      {"material frames",
       {"src/rod/rod_frames", "src/rod/rod_system", "src/dynamics/chain_system", "src/energy/rod_energy_kernel",
        "include/slender_sim/geometry/framed_curve"},
       "\\bd1\\b|\\bd2\\b",
       {kExplicitRod, kCloth, kTracked},
       {with(kExplicitRod, {"rods.0.formulation=general"})}},
      {"twist",
       {"src/energy/twist_loads"},
       "[tT]wist",
       {kExplicitRod, kCloth, kTracked},
       {with(kExplicitRod, {"rods.0.formulation=general"})}},
      {"surface tension",
       {"include/slender_sim/energy/surface_tension", "include/slender_sim/energy/surface_energy",
        "src/energy/surface_energy"},
       "surface_tension",
       all,
       {with(kThread, {"threads.0.fluid.surface_tension=0.02"})}},
      {"merging",
       {},
       "merging",
       {kRod, kThread, kCloth, kTracked, thread_with_itself},
       {with(thread_with_itself, {"threads.0.merging=true", "threads.0.fluid.surface_tension=0.02"})}},
      {"adaptivity",
       {"src/thread/thread_remesh", "include/slender_sim/thread/thread_remesh"},
       "error_tolerance|error_estimate|[rR]emesh",
       all,
       {with(kRod, {"time.error_tolerance=1e-5"}), with(kThread, {"threads.0.edges={longest: 0.001}"}),
        with(kCloth, {"time.error_tolerance=1e-4"})}},
      {"plasticity",
       {"src/cloth/plastic_flow", "include/slender_sim/cloth/plastic_flow"},
       "[pP]lastic",
       all,
       {with(kCloth, {"cloths.0.plasticity={yield_curvature: 0.1, creep_time: 0.1}"})}},
      {"wind",
       {"src/cloth/wind_load"},
       "\\bwind\\b|wind_|[dD]rag|erodynamic",
       all,
       {with(kRod, {"rods.0.damping={drag: 0.1}", "wind={velocity: [1, 2, 0]}"}),
        with(kCloth, {"cloths.0.damping={drag: 0.5}", "wind={velocity: [1, 2, 0]}"})}},
      {"damping",
       {"src/rod/rod_viscous"},
       "[dD]amping|[vV]iscous",
       {kRod, kExplicitRod, kCloth, kTracked},
       {with(kRod, {"rods.0.damping={mass: 0.1, stiffness: 0.001}"}),
        with(kCloth, {"cloths.0.damping={mass: 0.1, stiffness: 0.001}"})}},
      {"tracking",
       {"src/tracking/", "include/slender_sim/tracking/", "src/world/tracked_parts", "src/linalg/constrained_cholesky"},
       "[tT]racking|[aA]verages|[gG]uide",
       {kRod, kExplicitRod, kThread, kCloth},
       {kTracked}},
      {"recording", {"src/scene/record/recorder"}, "[rR]ecord", all, {[] {
         Scene s = kRod;
         s.options = {"--csv", "FOLDER"};
         return s;
       }()}},
  };
}

bool isOfPackage(const std::string& file) { return file.rfind("src/", 0) == 0 || file.rfind("include/", 0) == 0; }

/// Instructions, memory of a feature in one scene.
struct Share
{
  double instructions = 0, bytes = 0;
  std::string where;   ///< that took the most, if any
};

class Attribution
{
public:
  Attribution(const Profiler& profiler, const Feature& feature)
    : profiler_(profiler),
      feature_(feature),
      words_(feature.words)
  {
  }

  bool hasFile(const std::string& file) const
  {
    return std::any_of(feature_.files.begin(), feature_.files.end(),
                       [&](const char* start) { return file.rfind(start, 0) == 0; });
  }

  bool hasLine(const SourceLine& at) { return hasFile(at.file) || speaksOfIt(at, profiler_.text(at), lines_); }

  /// The same of a line that takes memory. Settings among the fields of a record, in braces, are part of it: the list
  /// of what touches has a coefficient of friction in each entry, and is there with or without friction.
  bool takesMemory(const SourceLine& at)
  {
    static const std::regex fields("\\{[^{}]*\\}");
    std::string text = profiler_.text(at);
    for (std::size_t length = 0; length != text.size();)   // records within records
    {
      length = text.size();
      text = std::regex_replace(text, fields, "");
    }
    return hasFile(at.file) || speaksOfIt(at, text, memory_lines_);
  }

  /// Per step: functions of the feature's files with all that libraries do for them, and its lines elsewhere.
  void count(const StepProfile& profile, Share& share)
  {
    std::map<std::string, double> places;
    for (const InstructionCost& cost : profile.costs)
    {
      const bool own_function = hasFile(cost.function_file);
      const bool of_a_library = !isOfPackage(cost.callee_file);
      if (cost.callee.empty() ? own_function || hasLine(cost.at) : own_function && of_a_library)
        places[cost.at.file + ":" + std::to_string(cost.at.line)] +=
            static_cast<double>(cost.instructions) / profile.steps;
    }
    for (const auto& [place, instructions] : places)
      share.instructions += instructions;
    share.where = most(places);
  }

  /// Of the simulation: what is taken while the scene file is read is given back, and a rod's model is what the scene
  /// says of it, in numbers: its moduli, of which twisting has one, are there whatever becomes of it.
  void count(const std::vector<Allocation>& allocations, Share& share)
  {
    std::map<std::string, double> places;
    for (const Allocation& a : allocations)
    {
      const auto within = [&](const char* name) {
        return std::any_of(a.functions.begin(), a.functions.end(),
                           [&](const std::string& f) { return f.find(name) != std::string::npos; });
      };
      if (!within("slender::Simulation::") || within("slender::buildRod("))
        continue;
      bool innermost = true;   // lines further out merely call, maybe with a word of the feature among the arguments
      for (const SourceLine& at : a.stack)
      {
        if (hasFile(at.file) || (innermost && takesMemory(at)))
        {
          places[at.file + ":" + std::to_string(at.line)] += static_cast<double>(a.bytes);
          break;
        }
        innermost = innermost && !isOfPackage(at.file);
      }
    }
    for (const auto& [place, bytes] : places)
      share.bytes += bytes;
    if (!places.empty())
      share.where += (share.where.empty() ? "memory: " : "; memory: ") + most(places);
  }

private:
  bool speaksOfIt(const SourceLine& at, const std::string& text, std::map<std::string, bool>& known) const
  {
    if (text.empty() || *feature_.words == '\0')
      return false;
    const auto [found, added] = known.try_emplace(at.file + ":" + std::to_string(at.line), false);
    if (added)
      found->second = std::regex_search(text, words_);
    return found->second;
  }

  static std::string most(const std::map<std::string, double>& places)
  {
    const auto least = [](const auto& a, const auto& b) { return a.second < b.second; };
    return places.empty() ? "" : std::max_element(places.begin(), places.end(), least)->first;
  }

  const Profiler& profiler_;
  const Feature& feature_;
  const std::regex words_;
  std::map<std::string, bool> lines_, memory_lines_;
};

/// Calls per step that take memory from the heap, and the place of the package with the most.
double heapCalls(const StepProfile& profile, std::string& where)
{
  const auto isOneOf = [](const std::string& name, std::initializer_list<const char*> names) {
    return std::any_of(names.begin(), names.end(), [&](const char* n) { return name == n; });
  };
  const auto isHeap = [&](const std::string& f) {
    return isOneOf(f, {"malloc", "calloc", "realloc", "memalign", "posix_memalign", "aligned_alloc"});
  };
  double calls = 0;
  std::map<std::string, double> places;
  for (const InstructionCost& cost : profile.costs)
  {
    const double each = static_cast<double>(cost.calls) / profile.steps;
    if (isHeap(cost.callee) && !isHeap(cost.function))
      calls += each;
    if (isOfPackage(cost.at.file) && (isHeap(cost.callee) || cost.callee.rfind("operator new", 0) == 0))
      places[cost.at.file + ":" + std::to_string(cost.at.line)] += each;
  }
  double most = 0;
  for (const auto& [place, count] : places)
    if (count > most)
    {
      most = count;
      where = place;
    }
  return calls;
}

/// One run of each scene, whatever it is needed for.
class Runs
{
public:
  Runs(StudyContext& context, const Profiler& profiler, int total)
    : context_(context),
      profiler_(profiler),
      total_(total)
  {
  }

  const StepProfile& profile(const Scene& scene)
  {
    auto [found, added] = profiles_.try_emplace(key(scene));
    if (added)
    {
      context_.progress(done_++, total_, std::string("instructions of ") + scene.name);
      found->second = profiler_.instructions(scene.text, scene.step, scene.options, context_.quick() ? 8 : 24,
                                             context_.quick() ? 4 : 12);
    }
    return found->second;
  }

  bool has(const Scene& scene) const { return profiles_.count(key(scene)) > 0; }

  const std::vector<Allocation>& allocations(const Scene& scene)
  {
    auto [found, added] = allocations_.try_emplace(key(scene));
    if (added)
    {
      context_.progress(done_++, total_, std::string("memory of ") + scene.name);
      found->second = profiler_.allocations(scene.text, scene.step, scene.options, 4);
    }
    return found->second;
  }

private:
  static std::string key(const Scene& scene)
  {
    std::string text = scene.text;
    for (const std::string& option : scene.options)
      text += "\n" + option;
    return text;
  }

  StudyContext& context_;
  const Profiler& profiler_;
  const int total_;
  int done_ = 0;
  std::map<std::string, StepProfile> profiles_;
  std::map<std::string, std::vector<Allocation>> allocations_;
};

double perStep(const StepProfile& profile) { return static_cast<double>(profile.instructions) / profile.steps; }

}   // namespace

void runLean(StudyContext& context)
{
  const std::filesystem::path program = thisProgram();
  const Profiler profiler((program.parent_path() / "simulate").string(), SLENDER_SOURCE_DIR);
  Runs runs(context, profiler, context.quick() ? 16 : 34);
  Plot& plot = context.plot("lean", "Features per step: where the scene does not name them, and where it does",
                            "feature, in the order of the table", "instructions over those of the step");
  plot.log_x = false;
  plot.lines = false;
  double worst_instructions = 0, worst_bytes = 0;
  int number = 0;
  for (const Feature& feature : features())
  {
    ++number;
    Attribution attribution(profiler, feature);
    for (const Scene& scene : feature.without)
    {
      const StepProfile& profile = runs.profile(scene);
      Share share;
      attribution.count(profile, share);
      attribution.count(runs.allocations(scene), share);
      const double overhead = share.instructions / perStep(profile);
      worst_instructions = std::max(worst_instructions, overhead);
      worst_bytes = std::max(worst_bytes, share.bytes);
      std::string name = scene.name;
      if (scene.options.size() > 0)
        name += ", " + scene.options[1];
      context.row()
          .set("feature", feature.name)
          .set("in_scene", "absent")
          .set("solver", scene.solver)
          .set("scene", name)
          .set("instructions_per_step", perStep(profile))
          .set("of_feature", share.instructions)
          .set("share", overhead)
          .set("bytes", share.bytes)
          .set("where", share.where);
      plot.at("absent").x.push_back(number);
      plot.at("absent").y.push_back(std::max(overhead, 1e-7));   // zero has no place on a logarithmic axis
    }
    for (const Scene& scene : feature.used)
    {
      if (context.quick() && !runs.has(scene))
        continue;
      const StepProfile& profile = runs.profile(scene);
      Share share;
      attribution.count(profile, share);
      std::string name = scene.name;
      for (std::size_t k = 1; k < scene.options.size(); k += 2)
        name += ", " + scene.options[k];
      context.row()
          .set("feature", feature.name)
          .set("in_scene", "used")
          .set("solver", scene.solver)
          .set("scene", name)
          .set("instructions_per_step", perStep(profile))
          .set("of_feature", share.instructions)
          .set("share", share.instructions / perStep(profile))
          .set("where", share.where);
      plot.at("used").x.push_back(number);
      plot.at("used").y.push_back(std::max(share.instructions / perStep(profile), 1e-7));
    }
  }
  double most = 0;
  for (const Scene& scene : {kRod, kExplicitRod, kThread, kCloth, kTracked})
  {
    const StepProfile& profile = runs.profile(scene);
    std::string where;
    const double calls = heapCalls(profile, where);
    most = std::max(most, calls);
    context.row()
        .set("feature", "allocations per warm step")
        .set("in_scene", "all")
        .set("solver", scene.solver)
        .set("scene", scene.name)
        .set("instructions_per_step", perStep(profile))
        .set("allocations_per_step", calls)
        .set("where", where);
  }
  context.metric("max_instruction_overhead_absent", worst_instructions);
  context.metric("max_bytes_absent", worst_bytes);
  context.metric("allocations_per_step", most);
  context.note(
      "of_feature: instructions of the functions in the feature's files, with what libraries do for them, and of lines "
      "elsewhere that speak of it; bytes: what the "
      "simulation takes from the heap there (a run of 4 steps, the reader and the models of rods apart); where: the "
      "place with the most. Instruction set: baseline, which valgrind knows. "
      "allocations_per_step: calls of the heap in warm steps, from the end of one to the end of the next, the scene's "
      "inputs included. used: by the same count; a part that is mostly other code (frames, "
      "contact) shows in instructions_per_step. Markers and diagnostics of the nodes are not counted here.");
}

const StudyRegistration kLeanRegistration{
    "lean", "instructions per step and memory of every feature in scenes that do not name it (needs valgrind)",
    runLean};

}   // namespace slender::study
