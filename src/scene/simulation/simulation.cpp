#include "slender_sim/scene/simulation.h"

#include <algorithm>
#include <cmath>
#include <utility>

#include "failure_text.h"
#include "scene_inputs.h"
#include "scene_parts.h"
#include "slender_sim/scene/reader.h"
#include "slender_sim/scene/scene_edit.h"
#include "state_transfer.h"
#include "statics_runner.h"

namespace slender {

namespace {

std::unique_ptr<World> buildWorld(const SceneConfig& config, WorldModel model, WorldState& state)
{
  try
  {
    return std::make_unique<World>(std::move(model), state);
  }
  catch (const WorldError& error)
  {
    throw SceneError(placeOf(config, error.kind, error.index) + ": " + error.what());
  }
}

/// Returns the poses of the welded parts in their bodies, for a world that was just built from this state.
std::vector<Pose> weldPoses(const SceneConfig& config, const WorldModel& model, const SceneState& state)
{
  std::vector<Pose> poses;
  for (const BodyWeld& weld : weldsOf(config))
  {
    const Pose& X_WG = state.rods[weld.rod].grasps[weld.grasp].X_WG;
    poses.push_back(model.welds[poses.size()].X_BG.value_or(state.bodies[weld.body].X_WB.inverse() * X_WG));
  }
  return poses;
}

}   // namespace

Simulation::Simulation(SceneConfig config, bool solve_start) : config_(std::move(config))
{
  SceneParts parts = buildParts(config_);
  state_ = std::move(parts.state);
  world_inputs_ = std::move(parts.inputs);
  guides_ = std::move(parts.guides);
  world_ = buildWorld(config_, std::move(parts.model), state_);
  weld_poses_ = weldPoses(config_, world_->model(), state_);
  grasps_.reset(new SceneGrasps(config_, world_->model(), state_, std::move(parts.grasps)));
  for (std::size_t g = 0; g < grasps_->size(); ++g)
  {
    const GraspConfig& grasp = *grasps()[g].config;
    const auto* table = std::get_if<TableMotion>(&grasp.motion);
    if (grasp.attach == Attach::initial)
      grasps_->takeOffset(static_cast<int>(g), table ? table->poses.firstTime() : 0.0);
    else
      state_.grasp_offsets[g] = offsetInFrame(grasp).value_or(Pose());
  }
  initial_ = state_;
  if (config_.start.equilibrium && solve_start)
    findEquilibrium();
  initial_ = state_;
}

Simulation::Simulation(SceneConfig config, const Simulation& running) : config_(std::move(config))
{
  SceneParts parts = buildParts(config_);
  const StateTransfer transfer(running.config_, running.grasps(), config_, parts.grasps);
  transfer.checkTables(running.state_.time);
  transfer.takeWelds(running.weld_poses_, parts.model);
  world_inputs_ = std::move(parts.inputs);
  guides_ = std::move(parts.guides);

  // Build the state for reset(). If this fails, only reset() is not possible; see reset_problem_.
  initial_ = parts.state;
  transfer.take(running.initial_, parts.model, initial_);
  reset_problem_ = transfer.newWelds();
  try
  {
    World start(parts.model, initial_);
    transfer.takeAdded(running.initial_, initial_);
    SceneGrasps grasps(config_, start.model(), initial_, parts.grasps);
    transfer.attachNew(grasps, initial_.time);
  }
  catch (const std::exception& error)   // WorldError, SceneError, or std::invalid_argument of a grasp
  {
    reset_problem_ = error.what();
  }

  state_ = std::move(parts.state);
  transfer.take(running.state_, parts.model, state_);
  world_ = buildWorld(config_, std::move(parts.model), state_);
  weld_poses_ = weldPoses(config_, world_->model(), state_);
  transfer.takeAdded(running.state_, state_);
  grasps_.reset(new SceneGrasps(config_, world_->model(), state_, std::move(parts.grasps)));
  transfer.attachNew(*grasps_, state_.time);
  start_report_ = running.start_report_;
}

std::unique_ptr<Simulation> editedSimulation(const Simulation& running, const SceneEdit& edit)
{
  try
  {
    return std::make_unique<Simulation>(editedScene(running.config(), edit), running);
  }
  catch (const SceneError& error)
  {
    const std::string where = toString(edit.kind), text = error.what();
    throw SceneError(text.compare(0, where.size(), where) == 0 ? text : where + ": " + text);
  }
}

Simulation::~Simulation() = default;

RodEnergies Simulation::energies(int rod) const
{
  return world_->rodEnergies(rod, state_.rods.at(rod), config_.gravity);
}

ClothEnergies Simulation::clothEnergies(int cloth) const
{
  return world_->clothEnergies(cloth, state_.cloths.at(cloth), config_.gravity);
}

void Simulation::inputsAt(double time, SceneInputs& inputs) const
{
  sceneInputsAt(config_, guides_, state_, time, inputs);
  grasps_->inputsAt(time, inputs);
}

void Simulation::defaultInputs(SceneInputs& inputs) const
{
  inputsAt(static_cast<double>(state_.steps + 1) * config_.time.step, inputs);
}

SceneInputs Simulation::defaultInputs() const
{
  SceneInputs inputs;
  defaultInputs(inputs);
  return inputs;
}

void Simulation::takeInputs(const SceneInputs& inputs)
{
  checkSceneInputs(config_, guides_, state_, grasps_->size(), inputs);
  takeSceneInputs(config_, initial_, inputs, world_inputs_);
  grasps_->takeTargets(inputs, world_inputs_);
}

StepReport Simulation::step(const SceneInputs& inputs)
{
  takeInputs(inputs);
  StepReport report = world_->step(state_, world_inputs_);
  if (!report.ok)
  {
    report.message += surroundingsOf(*this, report.place);
    if (const std::string overlap = overlapOfGrasps(*this, world_inputs_); !overlap.empty())
    {
      report.failure = StepFailure::squeezed;
      report.message = overlap + ". In detail: " + report.message;
    }
    return report;
  }
  grasps_->takeWrenches(*world_);
  return report;
}

StaticsRunner Simulation::statics()
{
  SceneInputs inputs;
  inputsAt(0.0, inputs);
  takeInputs(inputs);
  return StaticsRunner(config_, initial_, world_inputs_, *world_, *grasps_, state_);
}

StaticsRun Simulation::runStatics() { return statics().run(); }

void Simulation::findEquilibrium()
{
  const StepReport report = statics().solve(1.0);
  if (!report.ok)
  {
    throw SimulationError("start: equilibrium: " + report.message +
                          " (start: as_given starts from the shape in the scene)");
  }
  if (!report.stable)
  {
    const std::string unstable = "start: equilibrium: the equilibrium is unstable (lowest eigenvalue " +
                                 shortNumber(report.lowest_eigenvalue, 6) +
                                 " 1/s^2), and no stable one was reached from it";
    if (!config_.start.accept_unstable)
    {
      throw SimulationError(unstable +
                            ": start from a shape that is nearer to the stable equilibrium (initial), or hold what "
                            "drifts by a grasp (start: as_given starts from the shape in the scene; start: "
                            "{equilibrium: true, accept_unstable: true} starts from the unstable equilibrium)");
    }
    config_.warnings.push_back(unstable + ": start.accept_unstable starts from it all the same");
  }
  start_report_ = report;
}

void Simulation::reset()
{
  if (!reset_problem_.empty())
    throw SceneError("the edited scene cannot start anew: " + reset_problem_);
  state_ = initial_;
  world_->forgetContacts();
}

void Simulation::setFunctions(int cloth, const std::string& set, std::optional<double> blend)
{
  const ClothConfig& config = config_.cloths.at(static_cast<std::size_t>(cloth));
  if (!config.tracking)
    throw std::invalid_argument("cloth " + config.name + " tracks no guide");
  const auto& sets = config.tracking->sets;
  const auto found = std::find_if(sets.begin(), sets.end(), [&set](const FunctionSet& one) { return one.name == set; });
  if (sets.size() < 2)
  {
    throw std::invalid_argument("cloth " + config.name +
                                " has one set of test functions; give its test_functions as a list of named ones");
  }
  if (found == sets.end())
  {
    std::string known;
    for (const FunctionSet& one : sets)
      known += " " + one.name;
    throw std::invalid_argument("no test functions \"" + set + "\"; cloth " + config.name + " has:" + known);
  }
  if (blend && !(std::isfinite(*blend) && *blend >= 0))
    throw std::invalid_argument("blend must be a time [s], 0 or more");
  world_->setFunctions(cloth, static_cast<std::size_t>(found - sets.begin()), blend.value_or(found->blend), state_);
}

}   // namespace slender
