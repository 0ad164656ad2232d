#include "slender_sim/node/frame_broadcaster.h"

#include "slender_sim/node/converters.h"
#include "slender_sim/rod/rod_system.h"

namespace slender {
namespace {

std::string graspFrame(const std::string& node, const std::string& name) { return node + "/grasps/" + name; }
std::string sectionFrameName(const std::string& node, const std::string& rod, const std::string& section)
{
  return node + "/rods/" + rod + "/" + section;
}
std::string nozzleFrame(const std::string& node, const std::string& prefix) { return node + "/" + prefix + "nozzle"; }

}   // namespace

std::set<std::string> broadcastFrames(const std::string& node, const SceneTopics& topics, const Simulation& simulation)
{
  std::set<std::string> frames;
  for (const std::string& name : topics.grasps)
    frames.insert(graspFrame(node, name));
  for (const std::string& prefix : topics.nozzles)
    frames.insert(nozzleFrame(node, prefix));
  for (const RodConfig& rod : simulation.config().rods)
    for (const SectionFrame& section : rod.broadcast_tf)
      frames.insert(sectionFrameName(node, rod.name, section.name));
  for (const BodyConfig& body : simulation.config().bodies)
    if (body.broadcast_tf)
      frames.insert(body.name);
  return frames;
}

FrameBroadcaster::FrameBroadcaster(ros::NodeHandle& nh, const std::string& node, std::string frame_id,
                                   const SceneTopics& topics, bool grasps)
  : node_(node),
    frame_id_(std::move(frame_id)),
    has_grasps_(grasps),
    publisher_(nh.advertise<tf2_msgs::TFMessage>("/tf", 100))
{
  for (const std::string& name : topics.grasps)
    grasps_.push_back(graspFrame(node, name));
  for (const std::string& prefix : topics.nozzles)
    nozzles_.push_back(nozzleFrame(node, prefix));
}

void FrameBroadcaster::add(const std::string& child, const Pose& X_WC, const ros::Time& stamp)
{
  message_.transforms.push_back(toTransform(makeHeader(stamp, frame_id_), child, X_WC));
}

void FrameBroadcaster::broadcast(const Simulation& simulation, const ros::Time& stamp)
{
  if (publisher_.getNumSubscribers() == 0)
    return;
  message_.transforms.clear();
  const SceneConfig& scene = simulation.config();
  for (std::size_t b = 0; b < scene.bodies.size(); ++b)
    if (scene.bodies[b].broadcast_tf)
      add(scene.bodies[b].name, simulation.state().bodies[b].X_WB, stamp);
  for (std::size_t g = 0; has_grasps_ && g < grasps_.size(); ++g)
    add(grasps_[g], simulation.grasps().pose(static_cast<int>(g)), stamp);
  for (std::size_t r = 0; r < scene.rods.size(); ++r)
    for (const SectionFrame& section : scene.rods[r].broadcast_tf)
      add(sectionFrameName(node_, scene.rods[r].name, section.name),
          sectionPose(simulation.rodModel(static_cast<int>(r)), simulation.state().rods[r], section.node), stamp);
  for (std::size_t k = 0; k < nozzles_.size(); ++k)
    if (scene.threads[k].nozzle)
      add(nozzles_[k], simulation.state().threads[k].threads.front().ends[1].X_WE, stamp);
  if (!message_.transforms.empty())
    publisher_.publish(message_);
}

}   // namespace slender
