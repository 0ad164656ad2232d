// Rods of a scene: built, and stepped where they are on their own.
#include <algorithm>
#include <cmath>
#include <cstdio>
#include <exception>
#include <stdexcept>

#include "scene_rod.h"
#include "slender_sim/scene/reader.h"
#include "slender_sim/scene/shapes.h"
#include "slender_sim/scene/simulation.h"

#ifdef _OPENMP
#include <omp.h>
#endif

namespace slender {

namespace {

/// Puts the grasp's direction and director into its motion. A section that turns to them within the first step is worth
/// a warning.
void turnGrasp(GraspConfig& grasp, const Pose& section, SceneConfig& scene)
{
  constexpr double kNoticeable = 0.05;   // [rad]
  const double turn = orientGrasp(grasp, section);
  if (turn > kNoticeable && !scene.start.equilibrium)
  {
    char degrees[32];
    std::snprintf(degrees, sizeof degrees, "%.0f", turn * 180 / M_PI);
    scene.warnings.push_back(
        (scene.file.empty() ? "scene " + scene.name : scene.file) + ": grasp " + grasp.name +
        ": direction or director turns the section by " + degrees +
        " degrees within the first step; start: equilibrium turns it slowly, before the first step");
  }
}

/// Where the tangent may turn, statics does not know the whole effect of a torque.
bool holdsTangent(const RodConfig& rod, const RodModel& model, int edge)
{
  const auto held = [&rod](int node) {
    return std::any_of(rod.grasps.begin(), rod.grasps.end(),
                       [node](const GraspConfig& g) { return g.first_node <= node && node <= g.last_node; });
  };
  return held(edge) && held((edge + 1) % model.nodes());
}

}   // namespace

/// The loads that act all the time.
void Simulation::takeLoads(int r, const RodModel& model)
{
  const RodConfig& rod = config_.rods[r];
  RodLoads loads = rodLoads(rod, model, config_.time.integrator);
  const auto carries = [r](const BodyConfig& body) {
    return std::any_of(body.welds.begin(), body.welds.end(), [r](const WeldConfig& weld) { return weld.rod == r; });
  };
  const auto clamps = [](const GraspConfig& grasp) { return grasp.hold == Hold::frame; };
  if (loads.torques.size() > 0 && std::none_of(rod.grasps.begin(), rod.grasps.end(), clamps) &&
      std::none_of(config_.bodies.begin(), config_.bodies.end(), carries))
  {
    throw std::invalid_argument(
        "loads: nothing balances the torque, since no grasp holds a frame of the rod (hold: frame) and no body is "
        "welded to it: "
        "its material frames, which have no inertia, would spin without end");
  }
  for (int j = 0; j < static_cast<int>(loads.torques.size()); ++j)
  {
    if (loads.torques[j] != 0 && !holdsTangent(rod, model, j))
    {
      config_.warnings.push_back((rod.place.empty() ? "rod " + rod.name : rod.place) +
                                 ": a torque of loads goes along with the tangent of edge " + std::to_string(j) +
                                 ", which may turn. Such a torque has no potential: statics finds its equilibria, but "
                                 "stability and the lowest eigenvalue "
                                 "leave out that it turns, and a rod that they call stable may flutter. Hold the nodes "
                                 "of this edge by hold: position to guide it");
      break;
    }
  }
  RodInputs inputs;
  inputs.gravity = config_.gravity;
  inputs.forces = std::move(loads.forces);
  inputs.torques = std::move(loads.torques);
  rod_loads_.push_back(std::move(inputs));
}

void Simulation::buildRods()
{
  for (std::size_t r = 0; r < config_.rods.size(); ++r)
  {
    RodConfig& rod = config_.rods[r];
    try
    {
      const Eigen::Matrix3Xd rest = restNodes(rod, config_.gravity);
      Eigen::Matrix3Xd initial = initialNodes(rod, rest, config_.gravity);
      SceneRod built = buildSceneRod(rod, rest, config_.gravity, config_.time.integrator);
      RodModel& model = built.model;
      Eigen::Matrix3Xd velocities;
      if (rod.tracking)
        placeOnGuide(static_cast<int>(r), model, initial, velocities);
      RodState state = startSceneRod(rod, built, initial);
      if (velocities.cols() > 0)
        state.v = velocities;
      for (std::size_t g = 0; g < rod.grasps.size(); ++g)
      {
        GraspConfig& grasp = rod.grasps[g];
        if (grasp.first_node < 0 || grasp.last_node >= model.nodes() || grasp.first_node > grasp.last_node)
        {
          throw std::invalid_argument("grasp " + grasp.name + " holds nodes " + std::to_string(grasp.first_node) +
                                      " to " + std::to_string(grasp.last_node) + "; must be in [0, " +
                                      std::to_string(model.nodes() - 1) + "]");
        }
        state.grasps.push_back(makeGrasp(model, state, grasp.first_node, grasp.last_node, grasp.hold == Hold::frame));
        turnGrasp(grasp, state.grasps.back().X_WG, config_);
        grasps_.push_back({static_cast<int>(r), static_cast<int>(g), &grasp});
      }
      takeLoads(static_cast<int>(r), model);
      models_.push_back(std::make_shared<const RodModel>(std::move(model)));
      state_.rods.push_back(std::move(state));
    }
    catch (const std::invalid_argument& error)
    {
      const std::string place = rod.place.empty() ? "scene " + config_.name + ": rods." + std::to_string(r) : rod.place;
      throw SceneError(place + " (" + rod.name + "): " + error.what());
    }
  }
}

/// Rods on their own, in parallel.
StepReport Simulation::stepAll()
{
  StepReport total;
  const int count = static_cast<int>(models_.size());
  const auto isAlone = [this](int r) { return group_index_[r] < 0; };
  constexpr int kWorthThreads = 500;   // nodes; less is done before threads are awake
  int nodes = 0, alone = 0;
  for (int r = 0; r < count; ++r)
  {
    if (isAlone(r))
    {
      nodes += models_[r]->nodes();
      ++alone;
    }
  }
  if (alone == 0)
    return total;
  if (count == 1)
  {
    total.merge(stepAlone(0));
    return total;
  }
  std::vector<StepReport> reports(models_.size());
  std::vector<std::exception_ptr> errors(models_.size());
#ifdef _OPENMP
#pragma omp parallel for schedule(dynamic) if (threads_ != 1 && alone > 1 && nodes >= kWorthThreads) \
    num_threads(threads_ > 0 ? threads_ : omp_get_max_threads())
#endif
  for (int r = 0; r < count; ++r)
  {
    try
    {
      if (isAlone(r))
        reports[r] = stepAlone(r);
    }
    catch (...)
    {
      errors[r] = std::current_exception();   // must not leave the parallel region
    }
  }
  for (const std::exception_ptr& error : errors)
    if (error)
      std::rethrow_exception(error);
  for (int r = 0; r < count; ++r)
    if (isAlone(r))
      total.merge(reports[r]);
  return total;
}

StepReport Simulation::stepAlone(int rod)
{
  return tracked_rods_[rod] ? tracked_rods_[rod]->stepper.step(state_.rods[rod], rod_inputs_[rod],
                                                               tracked_rods_[rod]->targets, config_.time.step)
                            : steppers_[rod]->step(state_.rods[rod], rod_inputs_[rod], config_.time.step);
}

const std::vector<Wrench>& Simulation::rodWrenches(int rod) const
{
  return tracked_rods_[rod] ? tracked_rods_[rod]->stepper.wrenches()
         : steppers_[rod]   ? steppers_[rod]->wrenches()
                            : group_->wrenches(group_index_[rod]);
}

RodEnergies Simulation::energies(int rod) const
{
  return tracked_rods_.at(rod) ? tracked_rods_[rod]->stepper.energies(state_.rods[rod], config_.gravity)
         : steppers_[rod]      ? steppers_[rod]->energies(state_.rods[rod], config_.gravity)
                               : group_->energies(group_index_[rod], state_.rods[rod], config_.gravity);
}

}   // namespace slender
