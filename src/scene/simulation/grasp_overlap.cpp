#include "failure_text.h"

#include <algorithm>
#include <vector>

#include "slender_sim/contact/distance.h"
#include "slender_sim/geometry/pose_motion.h"

namespace slender {

namespace {

/// The part of a rod that one grasp holds at an instant of the step.
struct HeldPart
{
  int grasp = 0, rod = 0;
  int first_node = 0, last_node = 0;
  double radius = 0.0;                  ///< [m]
  std::vector<Eigen::Vector3d> nodes;   ///< the held nodes
  std::vector<Eigen::Vector3d> shape;   ///< the held nodes, and their neighbours as clamped sections place them
};

HeldPart heldPart(const Simulation& simulation, int grasp, const GraspState& held, const Pose& X_WG)
{
  HeldPart part;
  part.grasp = grasp;
  part.rod = simulation.grasps()[static_cast<std::size_t>(grasp)].object.index;
  part.first_node = held.first_node;
  part.last_node = held.last_node;
  const RodModel& model = simulation.rodModel(part.rod);
  const int first_edge = std::max(0, held.first_node - 1), last_edge = std::min(model.edges() - 1, held.last_node);
  for (int j = first_edge; j <= last_edge; ++j)
    part.radius = std::max({part.radius, model.radius_a[j], model.radius_b[j]});
  for (const Eigen::Vector3d& node_G : held.nodes_G)
    part.nodes.push_back(X_WG * node_G);
  part.shape = part.nodes;
  if (!held.holds_frame || part.nodes.empty())
    return part;
  const auto beyond = [&](int side, int edge) {
    return Eigen::Vector3d(X_WG.orientation * held.section_G[side].col(0) * model.rest_length[edge]);
  };
  if (held.first_node > 0)
    part.shape.insert(part.shape.begin(), part.nodes.front() - beyond(0, held.first_node - 1));
  if (held.last_node < model.edges())
    part.shape.push_back(part.nodes.back() + beyond(1, held.last_node));
  return part;
}

double distanceOf(const std::vector<Eigen::Vector3d>& a, const std::vector<Eigen::Vector3d>& b)
{
  double distance = (a.front() - b.front()).norm();
  for (std::size_t i = 0; i < a.size(); ++i)
    for (std::size_t j = 0; j < b.size(); ++j)
      distance = std::min(
          distance, segmentDistance(a[i], a[std::min(i + 1, a.size() - 1)], b[j], b[std::min(j + 1, b.size() - 1)]));
  return distance;
}

/// Checks all pairs of grasps at one instant.
class OverlapSearch
{
public:
  OverlapSearch(const Simulation& simulation, const WorldInputs& inputs) : simulation_(simulation), inputs_(inputs) {}

  std::string at(double fraction)
  {
    std::vector<HeldPart> parts;
    for (std::size_t g = 0; g < simulation_.grasps().size(); ++g)
    {
      const auto& [object, index, config] = simulation_.grasps()[g];
      if (object.isCloth() || !simulation_.grasps().isActive(static_cast<int>(g)))
        continue;
      const GraspState& held = simulation_.state().rods[object.index].grasps[index];
      const Pose pose = poseBetween(held.X_WG, held.velocity, inputs_.rods[object.index].grasps[index],
                                    simulation_.config().time.step, fraction, nullptr);
      parts.push_back(heldPart(simulation_, static_cast<int>(g), held, pose));
    }
    for (std::size_t a = 0; a < parts.size(); ++a)
      for (std::size_t b = a + 1; b < parts.size(); ++b)
        if (std::string text = between(parts[a], parts[b]); !text.empty())
          return text;
    return "";
  }

private:
  std::string between(const HeldPart& a, const HeldPart& b) const
  {
    const auto& rods = simulation_.config().rods;
    if (a.nodes.empty() || b.nodes.empty())
      return "";
    if (a.rod == b.rod)
    {
      const bool in_order = a.first_node <= b.first_node;
      const HeldPart &low = in_order ? a : b, &high = in_order ? b : a;
      if (high.first_node - low.last_node <= kFewEdges)
        return betweenNeighbours(low, high);
      if (!rods[a.rod].contact || !rods[a.rod].contact->self)
        return "";
    }
    else
    {
      const auto &one = rods[a.rod].contact, &other = rods[b.rod].contact;
      if (!one || !other || !one->others || !other->others)
        return "";
    }
    const double thickness = a.radius + b.radius, distance = distanceOf(a.shape, b.shape);
    if (distance >= thickness + simulation_.config().contact.gap)
      return "";
    return names(a, b) + " overlap: the sections that they hold come within " + shortNumber(distance, 3) +
           " m of each other, and their radii add up to " + shortNumber(thickness, 3) +
           " m. Keep the grippers farther apart";
  }

  std::string betweenNeighbours(const HeldPart& low, const HeldPart& high) const
  {
    constexpr double kLeastRoom = 0.5;   // smallest distance, as a share of the length of rod between two grasps
    const int edges = high.first_node - low.last_node;
    const double length = simulation_.rodModel(low.rod).rest_length.segment(low.last_node, edges).sum(),
                 distance = (low.nodes.back() - high.nodes.front()).norm();
    if (distance >= kLeastRoom * length)
      return "";
    return names(low, high) + " overlap: they come within " + shortNumber(distance, 3) + " m of each other, with " +
           shortNumber(length, 3) +
           " m of the rod between them. Keep the grippers farther apart, or let one of them hold fewer nodes";
  }

  std::string names(const HeldPart& a, const HeldPart& b) const
  {
    const auto name = [this](const HeldPart& part) {
      return "'" + simulation_.grasps()[static_cast<std::size_t>(part.grasp)].config->name + "'";
    };
    return "grasps " + name(a) + " and " + name(b) + (a.rod == b.rod ? "" : " of two rods");
  }

  static constexpr int kFewEdges = 3;   // grasps with at most so many edges between them are neighbours

  const Simulation& simulation_;
  const WorldInputs& inputs_;
};

}   // namespace

std::string overlapOfGrasps(const Simulation& simulation, const WorldInputs& inputs)
{
  constexpr int kInstants = 8;   // a fast gripper may pass through another one within the step
  OverlapSearch search(simulation, inputs);
  for (int k = 0; k <= kInstants; ++k)
    if (std::string text = search.at(static_cast<double>(k) / kInstants); !text.empty())
      return text;
  return "";
}

}   // namespace slender
