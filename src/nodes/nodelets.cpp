// The simulating nodes as nodelets: the same SceneNode, in a thread of its own.
#include <exception>
#include <memory>
#include <mutex>
#include <thread>

#include <nodelet/nodelet.h>
#include <pluginlib/class_list_macros.hpp>

#include "slender_sim/node/scene_node.h"

namespace slender {

class SceneNodelet : public nodelet::Nodelet
{
public:
  explicit SceneNodelet(NodeKind kind) : kind_(kind) {}

  ~SceneNodelet() override
  {
    {
      const std::lock_guard<std::mutex> lock(mutex_);
      unloading_ = true;
      if (node_)
        node_->stop();
    }
    if (thread_.joinable())
      thread_.join();
  }

private:
  /// Bad options and scenes end here: the loader drops the nodelet and tells its caller.
  void onInit() override
  {
    try
    {
      node_ = std::make_unique<SceneNode>(getNodeHandle(), getPrivateNodeHandle(), kind_);
    }
    catch (const std::exception& e)
    {
      NODELET_ERROR("%s: %s", getName().c_str(), e.what());
      throw;
    }
    thread_ = std::thread(&SceneNodelet::run, this);
  }

  void run()
  {
    try
    {
      const int status = node_->spin();
      if (status != 0)
        NODELET_ERROR("%s: ended with status %d", getName().c_str(), status);
    }
    catch (const std::exception& e)
    {
      NODELET_ERROR("%s: %s", getName().c_str(), e.what());
    }
    std::unique_ptr<SceneNode> ended;
    {
      const std::lock_guard<std::mutex> lock(mutex_);
      ended = std::move(node_);   // nobody calls a service that nobody answers
      if (!unloading_)
        NODELET_INFO("%s: has ended; unload it", getName().c_str());
    }
  }

  const NodeKind kind_;
  std::mutex mutex_;   // of node_ once the thread runs, and:
  bool unloading_ = false;
  std::unique_ptr<SceneNode> node_;
  std::thread thread_;
};

template <NodeKind kind>
struct NodeletOf : SceneNodelet
{
  NodeletOf() : SceneNodelet(kind) {}
};
using AnySceneNodelet = NodeletOf<NodeKind::scene>;
using RodNodelet = NodeletOf<NodeKind::rods>;
using ThreadNodelet = NodeletOf<NodeKind::threads>;
using ClothNodelet = NodeletOf<NodeKind::cloths>;
using TrackingNodelet = NodeletOf<NodeKind::tracking>;

}   // namespace slender

PLUGINLIB_EXPORT_CLASS(slender::AnySceneNodelet, nodelet::Nodelet)
PLUGINLIB_EXPORT_CLASS(slender::RodNodelet, nodelet::Nodelet)
PLUGINLIB_EXPORT_CLASS(slender::ThreadNodelet, nodelet::Nodelet)
PLUGINLIB_EXPORT_CLASS(slender::ClothNodelet, nodelet::Nodelet)
PLUGINLIB_EXPORT_CLASS(slender::TrackingNodelet, nodelet::Nodelet)
