#include "slender_sim/scene/run_statistics.h"

#include <algorithm>
#include <numeric>

#include "slender_sim/dynamics/failure_place.h"

namespace slender {

void RunStatistics::add(const StepReport& report, const Simulation& simulation, double simulated_seconds,
                        double busy_seconds)
{
  ++steps;
  merge(report);
  simulated += simulated_seconds;
  busy += busy_seconds;
  worst_step = std::max(worst_step, busy_seconds);
  max_force.resize(simulation.grasps().size());
  max_torque.resize(simulation.grasps().size());
  for (std::size_t g = 0; g < max_force.size(); ++g)
  {
    if (!simulation.grasps().isActive(static_cast<int>(g)))
      continue;
    const Wrench& wrench = simulation.grasps().wrench(static_cast<int>(g));
    max_force[g] = std::max(max_force[g], wrench.force.norm());
    max_torque[g] = std::max(max_torque[g], wrench.torque.norm());
  }
}

std::vector<std::string> graspLines(const RunStatistics& statistics, const std::vector<std::string>& names)
{
  constexpr std::size_t kMostLines = 10;
  std::vector<std::size_t> order(statistics.max_force.size());
  std::iota(order.begin(), order.end(), std::size_t{0});
  std::stable_sort(order.begin(), order.end(), [&statistics](std::size_t a, std::size_t b) {
    return statistics.max_force[a] > statistics.max_force[b];
  });
  const std::size_t named = order.size() > kMostLines ? kMostLines - 1 : order.size();
  std::vector<std::string> lines;
  const auto add = [&lines](const std::string& who, double force, double torque) {
    lines.push_back(who + ": largest force " + shortNumber(force, 4) + " N, torque " + shortNumber(torque, 4) + " N m");
  };
  double force = 0.0, torque = 0.0;   // largest values of the grasps without a line
  for (std::size_t k = 0; k < order.size(); ++k)
  {
    const std::size_t g = order[k];
    if (k < named)
      add("grasp " + names[g], statistics.max_force[g], statistics.max_torque[g]);
    force = k < named ? 0.0 : std::max(force, statistics.max_force[g]);
    torque = k < named ? 0.0 : std::max(torque, statistics.max_torque[g]);
  }
  if (order.size() > named)
    add("the other " + std::to_string(order.size() - named) + " grasps", force, torque);
  return lines;
}

std::string residualText(const SceneConfig& scene, double residual)
{
  const bool one_step = std::any_of(scene.cloths.begin(), scene.cloths.end(),
                                    [](const ClothConfig& cloth) { return cloth.one_newton_step; });
  const auto touches = [](const auto& object) { return object.contact.has_value(); };
  const bool contact = std::any_of(scene.rods.begin(), scene.rods.end(), touches) ||
                       std::any_of(scene.cloths.begin(), scene.cloths.end(), touches) ||
                       std::any_of(scene.threads.begin(), scene.threads.end(), touches);
  return shortNumber(residual, 3) + " of the largest force" +
         (one_step  ? " (no failure: one_newton_step leaves forces unbalanced, which the next step takes up)"
          : contact ? " (with contact a step ends when positions change by less than a thousandth of contact.gap)"
                    : "");
}

}   // namespace slender
