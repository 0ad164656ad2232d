#include "slender_sim/scene/simulation.h"

#include <exception>
#include <stdexcept>
#include <utility>

#include "slender_sim/scene/reader.h"
#include "slender_sim/scene/shapes.h"

#ifdef _OPENMP
#include <omp.h>
#endif

namespace slender {

namespace {

Pose sectionOffset(const Pose& X_WM, const Pose& X_WG) { return X_WM.inverse() * X_WG; }

}  // namespace

Simulation::Simulation(SceneConfig config) : config_(std::move(config))
{
  buildRods();
  state_.grasp_offsets.resize(grasps_.size());
  state_.wrenches.resize(grasps_.size());
  for (std::size_t g = 0; g < grasps_.size(); ++g)
  {
    if (const auto* table = std::get_if<TableMotion>(&grasps_[g].config->motion))
    {
      setOffset(static_cast<int>(g), table->poses.evaluate(table->poses.firstTime()));
    }
  }
  if (config_.start == Start::equilibrium)
  {
    findEquilibrium();
  }
  initial_ = state_;
}

void Simulation::buildRods()
{
  for (std::size_t r = 0; r < config_.rods.size(); ++r)
  {
    const RodConfig& rod = config_.rods[r];
    try
    {
      const Eigen::Matrix3Xd rest = restNodes(rod, config_.gravity);
      const Eigen::Matrix3Xd initial = initialNodes(rod, rest, config_.gravity);
      const int edges = static_cast<int>(rod.closed ? rest.cols() : rest.cols() - 1);
      RodModel model = buildRod(rod.name, rest, rod.closed, rodSections(rod, edges), rod.director, rod.naturally_straight);
      if (rod.material.inextensible)
      {
        model.stretch_modulus = model.stretch_modulus.cwiseMax(1e5 * model.totalMass() * config_.gravity.norm());
      }
      model.mass_damping = rod.damping.mass;
      model.stiffness_damping = rod.damping.stiffness;
      model.drag.setZero(model.nodes());
      for (int j = 0; j < model.edges(); ++j)
      {
        const double half = 0.5 * rod.damping.drag * model.rest_length[j];
        model.drag[j] += half;
        model.drag[(j + 1) % model.nodes()] += half;
      }
      RodState state = makeRodState(model, initial, rod.director, rod.initial_twist);
      for (std::size_t g = 0; g < rod.grasps.size(); ++g)
      {
        const GraspConfig& grasp = rod.grasps[g];
        if (grasp.first_node < 0 || grasp.last_node >= model.nodes() || grasp.first_node > grasp.last_node)
        {
          throw std::invalid_argument("grasp " + grasp.name + " holds nodes " + std::to_string(grasp.first_node) + " to " +
                                      std::to_string(grasp.last_node) + "; must be in [0, " + std::to_string(model.nodes() - 1) + "]");
        }
        state.grasps.push_back(makeGrasp(model, state, grasp.first_node, grasp.last_node, grasp.hold == Hold::frame));
        grasps_.push_back({static_cast<int>(r), static_cast<int>(g), &grasp});
      }
      steppers_.emplace_back(std::make_shared<const RodModel>(std::move(model)), config_.time);
      state_.rods.push_back(std::move(state));
    }
    catch (const std::invalid_argument& error)
    {
      throw SceneError("scene " + config_.name + ": rods." + std::to_string(r) + " (" + rod.name + "): " + error.what());
    }
  }
}

void Simulation::findEquilibrium()
{
  const std::vector<RodInputs> inputs = rodInputs(inputsAt(0.0));
  for (std::size_t r = 0; r < steppers_.size(); ++r)
  {
    const StepReport report = steppers_[r].solveEquilibrium(state_.rods[r], inputs[r]);
    if (!report.ok)
    {
      throw SimulationError("no equilibrium to start from: " + report.message +
                            " (start: as_given starts from the shape in the scene)");
    }
  }
  takeWrenches();
}

SceneInputs Simulation::inputsAt(double time) const
{
  SceneInputs inputs;
  inputs.wind = config_.wind;
  inputs.grasps.reserve(grasps_.size());
  for (std::size_t g = 0; g < grasps_.size(); ++g)
  {
    const GraspState& held = graspState(static_cast<int>(g));
    const auto* table = std::get_if<TableMotion>(&grasps_[g].config->motion);
    if (table && held.active)
    {
      Twist velocity;
      const Pose pose = table->poses.evaluate(time, &velocity);
      inputs.grasps.push_back(targetOf(static_cast<int>(g), pose, velocity));
    }
    else
    {
      inputs.grasps.push_back({held.X_WG, Twist{}});
    }
  }
  return inputs;
}

SceneInputs Simulation::defaultInputs() const { return inputsAt(static_cast<double>(state_.steps + 1) * config_.time.step); }

GraspTarget Simulation::targetOf(int grasp, const Pose& X_WM, const std::optional<Twist>& velocity) const
{
  checkGrasp(grasp);
  if (grasps_[grasp].config->attach == Attach::section)
  {
    return {X_WM, velocity};   // not multiplied by an identity, which would round
  }
  const Pose& offset = state_.grasp_offsets[grasp];
  GraspTarget target{X_WM * offset, velocity};
  if (velocity)
  {
    target.velocity->linear += velocity->angular.cross(X_WM.orientation * offset.position);
  }
  return target;
}

void Simulation::setOffset(int grasp, const Pose& X_WM)
{
  checkGrasp(grasp);
  if (grasps_[grasp].config->attach == Attach::initial)
  {
    state_.grasp_offsets[grasp] = sectionOffset(X_WM, graspState(grasp).X_WG);
  }
}

std::vector<RodInputs> Simulation::rodInputs(const SceneInputs& inputs) const
{
  if (inputs.grasps.size() != grasps_.size())
  {
    throw std::invalid_argument("inputs.grasps has " + std::to_string(inputs.grasps.size()) + " targets; must have " +
                                std::to_string(grasps_.size()) + ", one per grasp of the scene");
  }
  std::vector<RodInputs> rods(steppers_.size());
  for (RodInputs& rod : rods)
  {
    rod.gravity = config_.gravity;
    rod.wind = inputs.wind;
  }
  for (std::size_t g = 0; g < grasps_.size(); ++g)
  {
    rods[grasps_[g].rod].grasps.push_back(inputs.grasps[g]);   // grasps_ is in the order of the rods' own grasps
  }
  return rods;
}

StepReport Simulation::step(const SceneInputs& inputs)
{
  const std::vector<RodInputs> rod_inputs = rodInputs(inputs);
  const int count = static_cast<int>(steppers_.size());
  std::vector<StepReport> reports(steppers_.size());
  if (count == 1)
  {
    reports[0] = steppers_[0].step(state_.rods[0], rod_inputs[0], config_.time.step);   // leaves the state alone if it fails
  }
  else
  {
    // One rod's failure must leave the others where they were, too.
    const std::vector<RodState> before = state_.rods;
    std::vector<std::exception_ptr> errors(steppers_.size());
#ifdef _OPENMP
#pragma omp parallel for schedule(dynamic) if (threads_ != 1) num_threads(threads_ > 0 ? threads_ : omp_get_max_threads())
#endif
    for (int r = 0; r < count; ++r)
    {
      try
      {
        reports[r] = steppers_[r].step(state_.rods[r], rod_inputs[r], config_.time.step);
      }
      catch (...)
      {
        errors[r] = std::current_exception();   // must not leave the parallel region
      }
    }
    bool good = true;
    for (int r = 0; r < count; ++r)
    {
      good = good && reports[r].ok && !errors[r];
    }
    if (!good)
    {
      state_.rods = before;
    }
    for (const std::exception_ptr& error : errors)
    {
      if (error)
      {
        std::rethrow_exception(error);
      }
    }
  }

  StepReport total;
  for (int r = 0; r < count; ++r)
  {
    total.merge(reports[r]);
  }
  if (total.ok)
  {
    ++state_.steps;
    state_.time = static_cast<double>(state_.steps) * config_.time.step;   // no sum of round-off
    takeWrenches();
  }
  return total;
}

void Simulation::setThreads(int threads)
{
  if (threads < 1)
  {
    throw std::invalid_argument("threads = " + std::to_string(threads) + "; must be at least 1");
  }
  threads_ = threads;
}

void Simulation::takeWrenches()
{
  for (std::size_t g = 0; g < grasps_.size(); ++g)
  {
    state_.wrenches[g] = steppers_[grasps_[g].rod].wrenches()[grasps_[g].index];
  }
}

void Simulation::reset() { state_ = initial_; }

void Simulation::checkGrasp(int grasp) const
{
  if (grasp < 0 || grasp >= static_cast<int>(grasps_.size()))
  {
    throw std::invalid_argument("grasp = " + std::to_string(grasp) + "; must be in [0, " + std::to_string(grasps_.size()) + ")");
  }
}

void Simulation::attach(int grasp, int first_node, int last_node, Hold hold)
{
  checkGrasp(grasp);
  const GraspRef& ref = grasps_[grasp];
  RodState& rod = state_.rods[ref.rod];
  const RodModel& model = rodModel(ref.rod);
  const std::string nodes = "nodes " + std::to_string(first_node) + " to " + std::to_string(last_node);
  if (first_node < 0 || last_node >= model.nodes() || first_node > last_node)
  {
    throw std::invalid_argument("grasp " + ref.config->name + ": " + nodes + ": must be FIRST <= LAST in [0, " +
                                std::to_string(model.nodes() - 1) + "]");
  }
  if (hold == Hold::position && first_node != last_node)
  {
    throw std::invalid_argument("grasp " + ref.config->name + ": " + nodes + ": a point pin holds one node");
  }
  for (std::size_t other = 0; other < rod.grasps.size(); ++other)
  {
    const GraspState& held = rod.grasps[other];
    if (static_cast<int>(other) != ref.index && held.active && first_node <= held.last_node && held.first_node <= last_node)
    {
      throw std::invalid_argument("grasp " + ref.config->name + ": " + nodes + " overlap grasp " +
                                  config_.rods[ref.rod].grasps[other].name + ", which holds " + std::to_string(held.first_node) +
                                  " to " + std::to_string(held.last_node));
    }
  }
  rod.forgetHistory();   // the integrator's past was that of another set of constraints
  rod.grasps[ref.index] = makeGrasp(model, rod, first_node, last_node, hold == Hold::frame);
  if (const auto* table = std::get_if<TableMotion>(&ref.config->motion))
  {
    setOffset(grasp, table->poses.evaluate(state_.time));
  }
}

void Simulation::release(int grasp)
{
  checkGrasp(grasp);
  graspState(grasp).active = false;
  state_.rods[grasps_[grasp].rod].forgetHistory();
  state_.wrenches[grasp] = {};
}

const Wrench& Simulation::wrench(int grasp) const
{
  checkGrasp(grasp);
  return state_.wrenches[grasp];
}

RodEnergies Simulation::energies(int rod) const { return steppers_.at(rod).energies(state_.rods.at(rod), config_.gravity); }

}  // namespace slender
