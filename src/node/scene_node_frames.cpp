// An object must not follow a frame of tf that the node itself broadcasts.
#include "slender_sim/node/scene_node.h"
#include "slender_sim/scene/reader.h"

namespace slender {
namespace {

/// Calls visit(FRAME, WHO) for each object in the scene that follows a frame of tf.
template <class Visit>
void visitFollowers(const Simulation& simulation, const std::vector<std::string>& grasp_names, const Visit& visit)
{
  const auto look = [&visit](const auto& motion, const std::string& who) {
    if (const auto* tf = std::get_if<TfMotion>(&motion))
      visit(tf->frame, who);
  };
  const SceneConfig& scene = simulation.config();
  for (std::size_t g = 0; g < simulation.grasps().size(); ++g)
    look(simulation.grasps()[g].config->motion, "grasp " + grasp_names[g]);
  for (const BodyConfig& body : scene.bodies)
    if (body.motion)
      look(*body.motion, "body " + body.name);
  for (const ObstacleConfig& obstacle : scene.obstacles)
    look(obstacle.motion, "obstacle " + obstacle.name);
  for (const ThreadConfig& thread : scene.threads)
    if (thread.nozzle)
      look(thread.nozzle->motion, "the nozzle of thread " + thread.name);
  for (const auto& [object, name, tracking] : simulation.guides())
    if (const auto* carried = std::get_if<CarriedGuide>(&tracking->guide.motion); carried && carried->by_tf)
      visit(carried->bodies.front(), "the guide of " + name);
}

}   // namespace

std::set<std::string> SceneNode::ownFrames(const Simulation& simulation, const SceneTopics& topics) const
{
  return broadcastFrames(nh_priv_.getNamespace().substr(1), topics, simulation);
}

/// Throws SceneError if an object follows a moving frame that the node itself broadcasts. The object would follow its
/// own motion with a lag of ~guide_delay.
void SceneNode::refuseLoops(const Simulation& simulation, const SceneTopics& topics) const
{
  const std::set<std::string> own = ownFrames(simulation, topics);
  visitFollowers(simulation, topics.grasps, [&](const std::string& frame, const std::string& who) {
    if (own.count(frame))
      throw SceneError("scene " + simulation.config().name + ": " + who + " follows the frame " + frame +
                       " of tf, which this node broadcasts itself: follow the frame of what moves it instead; of a " +
                       "body of this scene, take motion: {body: NAME}, or weld a rod to it");
  });
}

}   // namespace slender
