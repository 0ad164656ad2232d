#pragma once

#include <memory>
#include <optional>
#include <stdexcept>
#include <string>

#include "slender_sim/scene/config.h"
#include "slender_sim/scene/scene_grasps.h"
#include "slender_sim/scene/scene_state.h"
#include "slender_sim/scene/statics_run.h"
#include "slender_sim/world/world.h"

namespace slender {

/// The scene was read, but its equilibrium (`start: equilibrium`) could not be found.
class SimulationError : public std::runtime_error
{
public:
  using std::runtime_error::runtime_error;
};

/// A scene built once from its checked configuration: its world, the state of it, and what drives it.
class Simulation
{
public:
  /// Throws SceneError (scene/reader.h) when the configuration cannot be built. With `start: equilibrium` it solves for
  /// it, and throws SimulationError when there is none to be found, or only an unstable one (unless `accept_unstable`
  /// makes a warning of it). With `solve_start` false it starts as given all the same, and leaves the search for
  /// equilibria to runStatics().
  explicit Simulation(SceneConfig config, bool solve_start = true);
  /// Builds a simulation of `config` that continues from the present state of `running`. Rods, threads, cloths, bodies,
  /// obstacles and grasps are matched by name. Those in both scenes keep their state, and the state to which reset()
  /// returns. Objects that `running` does not have start as the scene says. A new grasp of an object in both scenes
  /// takes hold at the present place of the object. No equilibrium is solved, whatever `start` says. Throws SceneError
  /// if the scene cannot be built, if surfaces cross now, or if an object has another size than before.
  Simulation(SceneConfig config, const Simulation& running);
  ~Simulation();
  Simulation(const Simulation&) = delete;
  Simulation& operator=(const Simulation&) = delete;

  const SceneConfig& config() const { return config_; }
  const SceneState& state() const { return state_; }
  const World& world() const { return *world_; }
  const SceneGrasps& grasps() const { return *grasps_; }
  SceneGrasps& grasps() { return *grasps_; }
  /// The guides of all tracked objects, in the order of SceneInputs::guides.
  const std::vector<GuideRef>& guides() const { return guides_; }

  const RodModel& rodModel(int rod) const { return *world_->model().rods[rod].model; }
  const ThreadModel& threadModel(int thread) const { return *world_->model().threads[thread].model; }
  const ClothModel& clothModel(int cloth) const { return *world_->model().cloths[cloth].model; }
  RodEnergies energies(int rod) const;
  ClothEnergies clothEnergies(int cloth) const;
  TrackingError trackingError(const ObjectRef& object) const { return world_->trackingError(object, state_); }

  /// Returns the inputs that the scene itself defines at the end of the coming step: tables are evaluated, all other
  /// objects stay in place.
  SceneInputs defaultInputs() const;
  /// Writes the same inputs into those of an earlier step. This allocates no memory.
  void defaultInputs(SceneInputs& inputs) const;

  /// Takes one step of config().time.step. The state does not change if the step fails. Throws std::invalid_argument
  /// unless there is one grasp target per grasp of the scene.
  StepReport step(const SceneInputs& inputs);

  /// Returns the report of the equilibrium from which the scene starts, or nothing if it starts as given.
  const std::optional<StepReport>& startReport() const { return start_report_; }
  /// Finds the equilibria that `statics` of the scene asks for, starting from the present state. Without this key it
  /// finds one equilibrium. The state becomes the last equilibrium, at rest (with start.keep_velocities bodies keep
  /// their velocities). Throws SceneError if the scene has objects without statics (cloth with contact, or objects that
  /// track a guide) or only threads. StaticsRun::end tells whether an equilibrium was not found.
  StaticsRun runStatics();

  /// Sets the number of threads for scenes with several rods (at least 1; default: that of the environment variable
  /// SLENDER_THREADS, or else of the processors). Results do not depend on it.
  void setThreads(int threads) { world_->setThreads(threads); }

  /// Returns to the initial state. Throws SceneError if an edit makes surfaces cross in the initial state; the present
  /// state then stays.
  void reset();

  /// Test functions in force of a tracked cloth or rod.
  const FunctionSet& functions(const ObjectRef& object) const { return world_->functions(object, state_); }
  /// Uses another set of test functions from the next step on. The difference between its averages and those of the
  /// guide decreases to zero within `blend` [s] (nothing: the value of the scene), without a jump in position or
  /// velocity. With 0 this takes one step. Throws std::invalid_argument if the cloth is not tracked, if it has no set
  /// of this name, if `blend` is not a time, or if the functions are linearly dependent on the free vertices.
  void setFunctions(int cloth, const std::string& set, std::optional<double> blend = std::nullopt);

  /// Saves and loads the state for an exact restart. save() writes a temporary file and renames it. Both functions
  /// throw std::runtime_error with the reason. load() refuses a damaged file and a file of another scene (other rods,
  /// moduli, step or integrator); the state then does not change. save() replaces an older file; if the path is a
  /// symbolic link, it replaces the target of the link. Neither function touches a path that is not a regular file.
  void save(const std::string& path) const;
  void load(const std::string& path);

private:
  void inputsAt(double time, SceneInputs& inputs) const;
  void takeInputs(const SceneInputs& inputs);
  class StaticsRunner statics();
  void findEquilibrium();

  SceneConfig config_;
  SceneState state_, initial_;
  std::unique_ptr<World> world_;
  std::unique_ptr<SceneGrasps> grasps_;
  std::vector<GuideRef> guides_;
  WorldInputs world_inputs_;
  std::optional<StepReport> start_report_;
  std::vector<Pose> weld_poses_;   ///< per weld of the world: initial pose of the held part in the body's frame
  std::string reset_problem_;      ///< reason why reset() is not possible; empty: it is possible
};

}   // namespace slender
