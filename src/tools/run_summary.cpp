#include "run_summary.h"

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <set>
#include <string>
#include <vector>

#include "moduli.h"

namespace slender {

namespace {

ThreadVolumes volumesOf(const Simulation& simulation)
{
  ThreadVolumes volumes;
  for (const ThreadGroupState& thread : simulation.state().threads)
    volumes.add(thread);
  return volumes;
}

/// Names of objects whose motion comes from a node, with the kind of motion.
class OutsideInputs
{
public:
  template <class AnyMotion>
  void add(const std::string& who, const AnyMotion& motion)
  {
    if (const auto* tf = std::get_if<TfMotion>(&motion))
      names_.insert(who + " (tf: " + tf->frame + ")");
    else if (std::holds_alternative<TopicMotion>(motion))
      names_.insert(who + " (topic)");
  }
  void addGuide(const std::string& who, const std::shared_ptr<const TrackingConfig>& tracking)
  {
    if (tracking && tracking->guide.byTopic())
      names_.insert("the guide of " + who);
  }
  const std::set<std::string>& names() const { return names_; }

private:
  std::set<std::string> names_;   ///< a grasp of several rods is one object
};

OutsideInputs inputsFromOutside(const SceneConfig& scene)
{
  OutsideInputs inputs;
  const auto addObjects = [&](const auto& objects, const char* kind) {
    for (const auto& object : objects)
    {
      for (const GraspConfig& grasp : object.grasps)
        inputs.add("grasp '" + grasp.name + "'", grasp.motion);
      inputs.addGuide(kind + (" '" + object.name) + "'", object.tracking);
    }
  };
  addObjects(scene.rods, "rod");
  addObjects(scene.cloths, "cloth");
  for (const BodyConfig& body : scene.bodies)
    if (body.motion)
      inputs.add("body '" + body.name + "'", *body.motion);
  for (const ObstacleConfig& obstacle : scene.obstacles)
    inputs.add("obstacle '" + obstacle.name + "'", obstacle.motion);
  for (const ThreadConfig& thread : scene.threads)
    if (thread.nozzle)
      inputs.add("the nozzle of thread '" + thread.name + "'", thread.nozzle->motion);
  return inputs;
}

void printLoads(const Simulation& simulation, const RunStatistics& total, const LimitWatch& watch)
{
  if (!simulation.config().rods.empty() || !simulation.config().cloths.empty())
    std::printf("largest strain    %.3g\n", total.max_strain);
  std::vector<std::string> grasps;
  for (std::size_t g = 0; g < simulation.grasps().size(); ++g)
    grasps.push_back(simulation.grasps()[g].config->name);
  for (const std::string& line : graspLines(total, grasps))
    std::printf("%s\n", line.c_str());
  if (watch.count() > 0)
    std::printf("limits            excursions: %llu, still exceeded at the end: %zu\n",
                static_cast<unsigned long long>(watch.count()), watch.lasting().size());
}

}   // namespace

bool checkVolumes(const Simulation& simulation)
{
  const double missing = volumesOf(simulation).missing();
  if (std::abs(missing) <= ThreadVolumes::kMostMissing)
    return true;
  std::fprintf(stderr,
               "simulate: %.3g of the threads' fluid is not accounted for, more than %.0e: this is a defect of the "
               "program, please report it\n",
               missing, ThreadVolumes::kMostMissing);
  return false;
}

void printSummary(const Simulation& simulation, const RunStatistics& total, const LimitWatch& watch, double wall)
{
  const double simulated = simulation.state().time;
  std::printf("scene             %s\n", simulation.config().name.c_str());
  std::printf("steps             %llu\n", static_cast<unsigned long long>(simulation.state().steps));
  std::printf("simulated         %.6g s\n", simulated);
  std::printf("wall              %.6g s\n", wall);
  std::printf("real-time factor  %.4g (simulated over wall time)\n", simulated / std::max(wall, 1e-9));
  std::printf("worst residual    %s\n", residualText(simulation.config(), total.residual).c_str());
  std::printf("iterations        %llu (%.2f per step)\n", static_cast<unsigned long long>(total.iterations),
              static_cast<double>(total.iterations) / std::max(1.0, static_cast<double>(simulation.state().steps)));
  std::printf("cut steps         %llu\n", static_cast<unsigned long long>(total.cut_steps));
  printLoads(simulation, total, watch);
  printModuli(simulation);
  if (total.repulsions > 0 || total.impulses > 0)
  {
    std::printf("cloth contacts    %.1f per step, %llu collisions stopped, %llu rigid pieces\n",
                static_cast<double>(total.repulsions) / std::max(1.0, static_cast<double>(simulation.state().steps)),
                static_cast<unsigned long long>(total.impulses), static_cast<unsigned long long>(total.zones));
  }
  if (total.mended_folds > 0)
    std::printf("mended folds      %llu\n", static_cast<unsigned long long>(total.mended_folds));
  const auto tracks = [](const auto& objects) {
    return std::any_of(objects.begin(), objects.end(), [](const auto& object) { return object.tracking != nullptr; });
  };
  if (tracks(simulation.config().cloths) || tracks(simulation.config().rods))
  {
    std::printf("tracking          averages at most %.2g of the guide's size away\n", total.tracking_error);
    if (total.forces_at_bound > 0)
      std::printf("bounded forces    at most %d at their bounds, whose averages were not met\n", total.forces_at_bound);
  }
  if (!simulation.config().threads.empty())
  {
    const ThreadVolumes volumes = volumesOf(simulation);
    std::printf(
        "fluid             %.9g m^3 at the start, %.9g m^3 fed: %.9g m^3 in the scene, %.9g m^3 left the region, %.9g "
        "m^3 dropped "
        "(edges.deposited); missing %.2g\n",
        volumes.start, volumes.fed, volumes.present, volumes.left, volumes.dropped, volumes.missing());
  }
  if (total.projection_iterations > 0)
  {
    std::printf("projection        at most %d iterations a step, squared edge lengths to %.2g of their own\n",
                total.projection_iterations, total.constraint_error);
  }
}

void noteInputsOfNodes(const SceneConfig& scene)
{
  const OutsideInputs inputs = inputsFromOutside(scene);
  if (inputs.names().empty())
    return;
  constexpr std::size_t most = 5;
  std::string text;
  std::size_t shown = 0;
  for (const std::string& name : inputs.names())
  {
    if (shown == most)
      break;
    text += (shown++ == 0 ? "" : ", ") + name;
  }
  if (inputs.names().size() > most)
    text += " and " + std::to_string(inputs.names().size() - most) + " more";
  std::fprintf(stderr,
               "simulate: note: these stay in place, because only a node receives messages and tf: %s. Run `rosrun "
               "slender_sim scene_node _scene:=FILE`, or give a table of poses\n",
               text.c_str());
}

}   // namespace slender
