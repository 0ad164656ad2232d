#pragma once

#include <cstdint>
#include <deque>
#include <memory>
#include <optional>
#include <stdexcept>
#include <string>
#include <vector>

#include "slender_sim/cloth/cloth_group.h"
#include "slender_sim/rod/averaged_rod.h"
#include "slender_sim/rod/rod_group.h"
#include "slender_sim/rod/rod_stepper.h"
#include "slender_sim/scene/config.h"
#include "slender_sim/scene/statics_run.h"
#include "slender_sim/thread/touching_threads.h"
#include "slender_sim/tracking/function_blend.h"

namespace slender {

/// Vertices of a cloth that move as one rigid body.
struct ClothGrasp
{
  bool active = true;
  std::vector<int> vertices;   ///< ascending; no other active grasp of the cloth holds them
  Eigen::Matrix3Xd points_G;   ///< where they are in the grasp's frame [m]
  Pose X_WG;
};

struct SceneCloth
{
  ClothState cloth;
  std::vector<ClothGrasp> grasps;    ///< those of the scene; cloth.pins are what the active ones hold
  Eigen::Matrix3Xd guide;            ///< of a tracked cloth: vertices of its guide now [m]
  Eigen::Matrix3Xd guide_velocity;   ///< of these over the last step [m/s], with several sets of test functions only
  /// with which it acted in the last step, per test function [N] (ClothStepper::averageForces)
  Eigen::Matrix3Xd guide_forces;
  FunctionBlend blend;   ///< of the set in force, cloth.average_set
};

/// What a rod tracks.
struct RodGuide
{
  Eigen::Matrix3Xd nodes;   ///< of its guide now [m]; of a rod that tracks nothing none
  /// with which it acted in the last step, per test function [N] (AveragedRod::averageForces)
  Eigen::Matrix3Xd forces;
};

/// State of all objects of a scene at one instant.
struct SceneState
{
  double time = 0.0;   ///< simulated [s] = steps * step length
  std::uint64_t steps = 0;
  std::vector<RodState> rods;              ///< grasps of the scene first, then welds
  std::vector<RodGuide> rod_guides;        ///< per rod; none where no rod tracks anything
  std::vector<ThreadGroupState> threads;   ///< per thread of the scene: it and what has broken off it
  std::vector<SceneCloth> cloths;
  std::vector<RigidBodyState> bodies;   ///< per body of the scene, driven ones included
  std::vector<Pose> obstacles;
  std::vector<Twist> obstacle_velocities;
  double contact_stiffness = 0.0;          ///< of the barrier [N]
  double thread_contact_stiffness = 0.0;   ///< of that between threads [N]
  /// Per grasp of the scene: the held section seen from the pose that drives it; with `attach: section` identity until
  /// attach().
  std::vector<Pose> grasp_offsets;
  std::vector<Wrench> wrenches;                    ///< per grasp of the scene, of the last step
  std::vector<std::array<EndLoad, 2>> end_loads;   ///< per thread of the scene, of the last step
};

/// The scene was read, but its equilibrium (`start: equilibrium`) could not be found.
class SimulationError : public std::runtime_error
{
public:
  using std::runtime_error::runtime_error;
};

/// What drives one thread during a step.
struct ThreadDrive
{
  Pose nozzle;                              ///< at the end of the step
  double flow_rate = 0.0;                   ///< during it [m^3/s]
  Eigen::Vector3d belt_velocity{0, 0, 0};   ///< [m/s]
};

/// Inputs of one step, latched before it. Indices follow the scene's order of grasps (over all rods, then all cloths).
struct SceneInputs
{
  std::vector<GraspTarget> grasps;
  std::vector<GraspTarget> bodies, obstacles;   ///< per body (simulated ones: ignored) and obstacle of the scene
  std::vector<ThreadDrive> threads;             ///< per thread of the scene
  /// per cloth of the scene: its guide's vertices at the end of the step (3 x n [m]), ignored when it is a cloth; of
  /// others empty, and none where no cloth tracks anything
  std::vector<Eigen::Matrix3Xd> guides;
  /// per rod of the scene: its guide's nodes likewise; none where no rod tracks anything
  std::vector<Eigen::Matrix3Xd> rod_guides;
  Eigen::Vector3d wind{0, 0, 0};
};

/// A grasp of the scene: of which rod or cloth (the other is -1), which of its grasps, and its configuration.
struct GraspRef
{
  int rod;
  int index;
  const GraspConfig* config;
  int cloth = -1;
};

/// The scene composed once from its checked configuration: models, steppers, initial state.
class Simulation
{
public:
  /// Throws SceneError (scene/reader.h) when the configuration cannot be built. With `start: equilibrium` it solves for
  /// it, and throws SimulationError when there is none to be found, or only an unstable one (unless `accept_unstable`
  /// makes a warning of it). With `solve_start` false it starts as given all the same, and leaves the search for
  /// equilibria to runStatics().
  explicit Simulation(SceneConfig config, bool solve_start = true);

  const SceneConfig& config() const { return config_; }
  const SceneState& state() const { return state_; }
  const RodModel& rodModel(int rod) const { return *models_[rod]; }
  /// True for bodies that move by the forces on them; others are driven.
  bool isSimulated(int body) const { return !config_.bodies[body].motion.has_value(); }
  /// Contacts of rods and threads in the last step.
  const std::vector<ContactTerm>& contacts() const;
  /// Of cloths, see ClothGroup; without columns for one that touches nothing.
  Eigen::Matrix3Xd contactForces(int cloth) const;
  const std::vector<GraspRef>& grasps() const { return grasps_; }
  bool isActive(int grasp) const;
  /// Where the held section, or the frame of a cloth's grasp, is.
  const Pose& graspPose(int grasp) const;
  /// Name of the rod or cloth that it holds.
  const std::string& heldObject(int grasp) const;

  /// Inputs as the scene itself defines them at the end of the coming step: tables evaluated, everything else held
  /// where it is.
  SceneInputs defaultInputs() const;
  /// The same into those of an earlier step, which takes no memory.
  void defaultInputs(SceneInputs& inputs) const;

  /// The pose of the held section when the driving frame M of a grasp (a gripper, a body) is at X_WM: X_WM and the
  /// offset that was taken as the scene began (none with `attach: section`), or last by attach() or setOffset().
  GraspTarget targetOf(int grasp, const Pose& X_WM, const std::optional<Twist>& velocity = std::nullopt) const;
  /// Takes the offset between the driving frame now at X_WM and the held section.
  void setOffset(int grasp, const Pose& X_WM);

  /// One step of config().time.step. On failure the state is untouched. Throws std::invalid_argument unless there is
  /// one grasp target per grasp of the scene.
  StepReport step(const SceneInputs& inputs);

  /// Of the equilibrium from which the scene starts; nothing when it starts as given.
  const std::optional<StepReport>& startReport() const { return start_report_; }
  /// What `statics` of the scene asks for, from the present state on; without the key one equilibrium. The state
  /// becomes the last equilibrium, at rest (with start.keep_velocities bodies keep their velocities). Throws SceneError
  /// for objects that have no statics: cloth, rods that track a guide, or nothing but threads. Equilibria that were not
  /// found are told by StaticsRun::end.
  StaticsRun runStatics();

  /// Threads for scenes of several rods (at least 1; default: what OpenMP offers). Results do not depend on it.
  void setThreads(int threads);

  /// Back to the initial state.
  void reset();

  /// Takes hold of nodes first..last of a rod as they are now, under the name of an existing grasp of that rod. Nothing
  /// jumps: the offset from a table, or from a body or obstacle of the scene, is taken anew, whatever `attach` says of
  /// the scene's start. Throws std::invalid_argument: no such grasp or nodes, overlap with another active grasp,
  /// several nodes held by position.
  void attach(int grasp, int first_node, int last_node, Hold hold);
  /// Likewise of vertices of a cloth, in any order. Throws std::invalid_argument: no such vertices, none, held by
  /// another grasp.
  void attachVertices(int grasp, std::vector<int> vertices);
  void release(int grasp);

  const Wrench& wrench(int grasp) const;
  RodEnergies energies(int rod) const;
  /// What a thread does to the holders of its ends (the newest: the nozzle), of the last step.
  const std::array<EndLoad, 2>& endLoads(int thread) const { return state_.end_loads.at(thread); }
  const ThreadModel& threadModel(int thread) const { return *thread_models_[thread]; }
  const ClothModel& clothModel(int cloth) const { return *cloth_models_[cloth]; }
  ClothEnergies clothEnergies(int cloth) const;
  /// Greatest distances of averages of a tracked cloth from those of its guide [m]; 0 for others.
  struct TrackingError
  {
    double met = 0.0;        ///< of those that are met
    double at_bound = 0.0;   ///< of those whose forces are at their bounds
    double blend = 0.0;      ///< that functions which took over leave for now: the others count from there
  };
  TrackingError trackingError(int cloth) const;
  /// Greatest distance of an average of a tracked rod from that of its guide [m]; 0 for others.
  double rodTrackingError(int rod) const;
  /// Test functions in force of a tracked cloth.
  const FunctionSet& functions(int cloth) const;
  /// Has another set of test functions act from the next step on. What its averages are away from the guide's goes
  /// within `blend` [s] (none: that of the scene), without a jump in position or velocity; 0: in one step. Throws
  /// std::invalid_argument: not a tracked cloth, no set of this name, not a time, functions that depend on each other
  /// on the vertices that are free.
  void setFunctions(int cloth, const std::string& set, std::optional<double> blend = std::nullopt);

  /// Exact restart. save writes a temporary file and renames it; both throw std::runtime_error naming what does not fit
  /// or could not be written. A file of another scene (other rods, moduli, step or integrator) and a damaged
  /// file are refused, and the state stays as it is. save() replaces an older file; if the path is a symbolic link, it
  /// replaces the file to which the link leads. Neither function touches a path that is not a regular file.
  void save(const std::string& path) const;
  void load(const std::string& path);

private:
  /// Cloths with contact that are stepped together: those that are guides of others, or those that are not.
  struct TouchingCloths
  {
    bool ahead;                ///< guides
    std::vector<int> cloths;   ///< of the scene
    ClothGroup group;
    ClothGroupState state{};
    ClothGroupInputs inputs{};
  };

  void buildRods();
  void takeLoads(int rod, const RodModel& model);
  void takeOffset(int grasp, double time);
  StepReport stepAlone(int rod);
  const std::vector<Wrench>& rodWrenches(int rod) const;
  void inputsAt(double time, SceneInputs& inputs) const;
  void fillRodInputs(const SceneInputs& inputs);
  void checkInputs(const SceneInputs& inputs) const;
  StepReport stepAll();

  // simulation_tracked_rods.cpp
  void placeOnGuide(int rod, const RodModel& model, Eigen::Matrix3Xd& nodes, Eigen::Matrix3Xd& velocities);
  void buildTrackedRod(int rod);
  void addRodGuides(SceneInputs& inputs, double time) const;
  void checkRodGuides(const SceneInputs& inputs) const;
  void takeRodTargets(const SceneInputs& inputs);
  void takeRodGuides(const SceneInputs& inputs, StepReport& report);
  void checkHeld(int rod, int grasp, int first_node, int last_node) const;

  // simulation_statics.cpp
  void findEquilibrium();
  void checkHasStatics() const;
  void takeStaticInputs();
  Eigen::Vector3d gravityAt(double factor) const;
  RodInputs loadsAt(int rod, double factor) const;
  RodInputs loadsPerFactor(int rod, double factor) const;
  StepReport solveStatics(double factor);
  void perturb(double first_factor, StaticsRun& run);
  void runFactors(const std::vector<double>& factors, StaticsRun& run);
  void runPath(const PathConfig& path, StaticsRun& run);
  void findCritical(double up_to, StaticsRun& run);
  StaticsRow rowAt(double factor, const StepReport& report) const;

  // simulation_threads.cpp
  void buildThreads();
  void buildTouchingThreads();
  void addThreadInputs(SceneInputs& inputs, double time) const;
  StepReport stepThreads(const SceneInputs& inputs);
  ThreadInputs threadInputs(std::size_t thread, const SceneInputs& inputs) const;
  void exchangeTouching();

  // simulation_cloths.cpp
  void buildCloths();
  void buildTouchingCloths();
  void buildTouchingCloths(bool ahead);
  void exchangeTouchingCloths(SceneState& state, TouchingCloths& touching);
  void checkTouchingCloths(SceneState& state);
  const Eigen::Matrix3Xd& pinForces(int cloth) const;
  const ClothStepper& clothStepper(int cloth) const;
  StepReport stepCloths(const SceneInputs& inputs);
  void fillClothInputs(const SceneInputs& inputs);
  StepReport solveCloths(double factor);
  void stepCloths(bool ahead, const SceneInputs& inputs, StepReport& total);
  /// What drives a grasp: its target, or the body or obstacle that it follows.
  GraspTarget drivenTarget(int grasp, const SceneInputs& inputs) const;
  void takeClothWrenches();
  void gatherPins(SceneCloth& cloth) const;

  // simulation_guides.cpp: what tracked cloths follow
  TrackingError errorOf(int cloth, const Eigen::Matrix3Xd& targets) const;
  void startTracking(int cloth);
  bool functionsDue() const;
  void takeOver();
  void takeOver(SceneCloth& held, const TrackingConfig& tracking, std::size_t set, double blend) const;
  void addGuideInputs(SceneInputs& inputs, double time) const;
  void checkGuides(const SceneInputs& inputs) const;
  void takeGuides(const SceneInputs& inputs, StepReport& report);
  const Eigen::Matrix3Xd& guideVertices(int cloth, const SceneInputs& inputs) const;

  // simulation_group.cpp: rods that bodies join or that touch something
  void buildBodies();
  void buildGroup();
  void exchangeGroup();
  StepReport stepGroup(const SceneInputs& inputs, bool to_equilibrium);
  void moveGiven(const SceneInputs& inputs);
  /// Of the frame that a grasp with a body's motion follows; null when the scene has no such body or obstacle.
  const GraspTarget* followed(const BodyMotion& motion, const SceneInputs& inputs) const;
  GraspState& graspState(int grasp) { return state_.rods[grasps_[grasp].rod].grasps[grasps_[grasp].index]; }
  const GraspState& graspState(int grasp) const { return state_.rods[grasps_[grasp].rod].grasps[grasps_[grasp].index]; }
  void checkGrasp(int grasp) const;
  void takeWrenches();
  std::uint64_t fingerprint() const;   // state_fingerprint.cpp

  SceneConfig config_;
  SceneState state_, initial_;
  std::vector<std::shared_ptr<const RodModel>> models_;
  /// per rod; none for those of the group, and those that track a guide
  std::vector<std::optional<RodStepper>> steppers_;
  struct TrackedRod
  {
    AveragedRod stepper;
    Eigen::Matrix3Xd targets;   ///< of its averages at the end of the step [m]
  };
  std::vector<std::unique_ptr<TrackedRod>> tracked_rods_;   ///< per rod; null for others
  std::vector<std::shared_ptr<const ThreadModel>> thread_models_;
  std::vector<std::optional<ThreadGroup>> thread_steppers_;   ///< per thread; none for those with contact
  std::optional<TouchingThreads> touching_;
  std::vector<int> touching_index_;   ///< per thread: in touching_, -1: on its own; empty when all are
  TouchingState touching_state_;
  TouchingInputs touching_inputs_;
  std::vector<std::shared_ptr<const ClothModel>> cloth_models_;
  std::vector<std::optional<ClothStepper>> cloth_steppers_;   ///< per cloth; none for those with contact
  std::deque<TouchingCloths> touching_cloths_;
  struct ClothPlace
  {
    int group = -1, index = 0;
  };   // group -1: on its own
  /// per cloth: in touching_cloths_; empty when all are on their own
  std::vector<ClothPlace> cloth_places_;
  bool tracks_ = false;             ///< any cloth follows a guide
  std::vector<char> leads_;         ///< per cloth: it is the guide of another
  std::vector<int> cloth_bodies_;   ///< of the scene, that these meet, beside all obstacles
  std::vector<ClothInputs> cloth_inputs_;
  std::vector<Pose> cloth_targets_;   ///< per grasp of the scene
  std::optional<RodGroup> group_;
  std::vector<int> group_rods_, group_bodies_;   ///< what of the scene is in the group
  std::vector<int> group_index_;                 ///< per rod: in the group, -1: on its own
  RodGroupState group_state_;
  RodGroupInputs group_inputs_;
  std::vector<RodInputs> rod_inputs_;
  SceneInputs static_inputs_;          ///< of statics, at time 0
  std::vector<RodInputs> rod_loads_;   ///< per rod: gravity, forces and torques of the scene; no grasps
  /// that acts now: that of the scene, while runStatics() times the factor
  Eigen::Vector3d gravity_{0, 0, 0};
  /// forces on the nodes of the only rod [N], while runStatics() uses them
  Eigen::Matrix3Xd imperfection_;
  std::optional<StepReport> start_report_;
  std::vector<GraspRef> grasps_;
  int threads_ = 0;   // 0: as OpenMP says
};

}   // namespace slender
