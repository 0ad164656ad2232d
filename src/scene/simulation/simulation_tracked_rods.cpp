// Rods that track a guide curve.
#include <algorithm>
#include <stdexcept>

#include "slender_sim/rod/average_projection.h"
#include "slender_sim/scene/reader.h"
#include "slender_sim/scene/simulation.h"

namespace slender {

namespace {

const WeakConstraints& constraintsOf(const RodConfig& rod) { return *rod.tracking->sets.front().constraints; }

}   // namespace

/// Where the scene starts the averages are the guide's, and their velocities: by the least change of the nodes that no
/// grasp holds.
void Simulation::placeOnGuide(int rod, const RodModel& model, Eigen::Matrix3Xd& nodes, Eigen::Matrix3Xd& velocities)
{
  const RodConfig& config = config_.rods[rod];
  const WeakConstraints& constraints = constraintsOf(config);
  state_.rod_guides.resize(config_.rods.size());
  RodGuide& guide = state_.rod_guides[rod];
  Eigen::Matrix3Xd guide_velocities;
  config.tracking->guide.evaluate(0.0, guide.nodes, &guide_velocities);
  guide.forces.setZero(3, constraints.count());

  const auto isFree = [&config](int node) {
    return std::none_of(config.grasps.begin(), config.grasps.end(),
                        [node](const GraspConfig& g) { return g.first_node <= node && node <= g.last_node; });
  };
  AverageProjection projection(constraints.matrix());
  if (!projection.prepare(model.mass, isFree))
  {
    throw std::invalid_argument(
        "test functions of track depend on each other on the nodes that no grasp holds; leave some out, or hold fewer "
        "nodes");
  }
  const Eigen::Matrix3Xd away = constraints.averages(guide.nodes) - nodes * constraints.matrix().transpose(),
                         speeds = constraints.averages(guide_velocities);
  velocities.setZero(3, nodes.cols());
  for (int k = 0; k < 3; ++k)
  {
    nodes.row(k) += projection.displacements(away.row(k).transpose()).transpose();
    velocities.row(k) = projection.displacements(speeds.row(k).transpose()).transpose();
  }
}

void Simulation::buildTrackedRod(int r)
{
  const RodConfig& rod = config_.rods[r];
  try
  {
    if (group_index_[r] >= 0)
    {
      throw std::invalid_argument(
          "a rod that tracks a guide can neither touch anything nor be welded to a body; leave out " +
          std::string(rod.contact ? "its contact" : "the weld") + ", or track");
    }
    const auto& constraints = rod.tracking->sets.front().constraints;
    tracked_rods_[r].reset(new TrackedRod{{models_[r], {constraints, &constraints->matrix()}, config_.time}, {}});
  }
  catch (const std::invalid_argument& error)
  {
    throw SceneError((rod.place.empty() ? "scene " + config_.name + ": rods." + std::to_string(r) : rod.place) + " (" +
                     rod.name + "): " + error.what());
  }
}

void Simulation::addRodGuides(SceneInputs& inputs, double time) const
{
  inputs.rod_guides.resize(state_.rod_guides.size());
  for (std::size_t r = 0; r < inputs.rod_guides.size(); ++r)
  {
    const auto& tracking = config_.rods[r].tracking;
    if (tracking && !tracking->guide.byTopic())
      tracking->guide.evaluate(time, inputs.rod_guides[r]);
    else
      inputs.rod_guides[r] = state_.rod_guides[r].nodes;
  }
}

void Simulation::checkRodGuides(const SceneInputs& inputs) const
{
  if (inputs.rod_guides.size() != state_.rod_guides.size())
  {
    throw std::invalid_argument("inputs.rod_guides has " + std::to_string(inputs.rod_guides.size()) +
                                " entries; must have " + std::to_string(state_.rod_guides.size()) +
                                ", one per rod of a scene where any tracks a guide");
  }
  for (std::size_t r = 0; r < inputs.rod_guides.size(); ++r)
  {
    if (inputs.rod_guides[r].cols() != state_.rod_guides[r].nodes.cols())
    {
      throw std::invalid_argument("inputs.rod_guides of " + config_.rods[r].name + " has " +
                                  std::to_string(inputs.rod_guides[r].cols()) + " nodes; must have " +
                                  std::to_string(state_.rod_guides[r].nodes.cols()));
    }
  }
}

void Simulation::takeRodTargets(const SceneInputs& inputs)
{
  for (std::size_t r = 0; r < inputs.rod_guides.size(); ++r)
    if (tracked_rods_[r])
      constraintsOf(config_.rods[r]).averages(inputs.rod_guides[r], tracked_rods_[r]->targets);
}

/// After a step.
void Simulation::takeRodGuides(const SceneInputs& inputs, StepReport& report)
{
  for (std::size_t r = 0; r < inputs.rod_guides.size(); ++r)
  {
    if (tracked_rods_[r])
    {
      state_.rod_guides[r].nodes = inputs.rod_guides[r];
      state_.rod_guides[r].forces = tracked_rods_[r]->stepper.averageForces();
      report.tracking_error = std::max(
          report.tracking_error, constraintsOf(config_.rods[r]).error(tracked_rods_[r]->targets, state_.rods[r].x) /
                                     config_.rods[r].tracking->size);
    }
  }
}

double Simulation::rodTrackingError(int rod) const
{
  const RodConfig& config = config_.rods.at(static_cast<std::size_t>(rod));
  return config.tracking ? constraintsOf(config).error(constraintsOf(config).averages(state_.rod_guides[rod].nodes),
                                                       state_.rods[rod].x)
                         : 0.0;
}

/// Before a grasp takes hold: throws std::invalid_argument when that leaves too little for the averages.
void Simulation::checkHeld(int rod, int grasp, int first_node, int last_node) const
{
  if (!config_.rods[rod].tracking)
    return;
  std::vector<char> held(static_cast<std::size_t>(models_[rod]->nodes()), 0);
  const auto hold = [&held](int first, int last) { std::fill(held.begin() + first, held.begin() + last + 1, 1); };
  hold(first_node, last_node);
  const std::vector<GraspState>& grasps = state_.rods[rod].grasps;
  for (std::size_t g = 0; g < grasps.size(); ++g)
    if (grasps[g].active && static_cast<int>(g) != grasp)
      hold(grasps[g].first_node, grasps[g].last_node);
  constraintsOf(config_.rods[rod]).requireIndependent(held);
}

}   // namespace slender
