// GuideInputs of an edited scene take over the inputs from before the edit.
#include "slender_sim/node/guide_inputs.h"

#include <map>

namespace slender {

/// Returns a unique key for each entry of guided_. An edit does not change the key of an object that stays.
std::vector<std::string> GuideInputs::guidedKeys() const
{
  std::vector<std::string> keys;
  const SceneConfig& scene = simulation_->config();
  for (const GraspRef& grasp : simulation_->grasps())
    keys.push_back("grasps/" + simulation_->grasps().heldObject(static_cast<int>(keys.size())) + "/" +
                   grasp.config->name);
  for (const BodyConfig& body : scene.bodies)
    keys.push_back("bodies/" + body.name);
  for (const ObstacleConfig& obstacle : scene.obstacles)
    keys.push_back("obstacles/" + obstacle.name);
  for (const ThreadConfig& thread : scene.threads)
    keys.push_back("threads/" + thread.name);
  return keys;
}

void GuideInputs::takeOver(GuideInputs& before)
{
  std::map<std::string, std::size_t> places;
  for (const std::string& key : guidedKeys())
    places.emplace(key, places.size());
  std::map<int, int> moved;   // index before the edit to index after it
  const std::vector<std::string> keys = before.guidedKeys();
  for (std::size_t g = 0; g < keys.size(); ++g)
  {
    const auto found = places.find(keys[g]);
    if (found == places.end())
      continue;
    Guided &old = before.guided_[g], &now = guided_[found->second];
    if (!old.buffer || !now.buffer || old.body != now.body || old.frame != now.frame)
      continue;
    now.buffer = std::move(old.buffer);
    moved[static_cast<int>(g)] = static_cast<int>(found->second);
    if (const auto hand = before.hand_.find(g); hand != before.hand_.end())
      hand_[found->second] = hand->second;
  }
  intake_.takeOver(before.intake_, [&moved](Message& message) {
    std::vector<Entry> entries;
    for (const Entry& entry : message.entries)
      if (const auto found = moved.find(entry.guided); found != moved.end())
        entries.push_back({found->second, entry.X_FH});
    if (const auto found = moved.find(message.source); found != moved.end())
      message.source = found->second;
    message.entries = std::move(entries);
    return !message.entries.empty();
  });
  const auto &threads = simulation_->config().threads, &threads_before = before.simulation_->config().threads;
  for (std::size_t k = 0; k < threads.size(); ++k)
    for (std::size_t j = 0; j < threads_before.size(); ++j)
      if (threads[k].name == threads_before[j].name)
      {
        threads_[k].flow = before.threads_[j].flow;
        threads_[k].belt = before.threads_[j].belt;
      }
  wind_ = before.wind_;
  drops_ = before.drops_;
  tracking_->takeOver(*before.tracking_);
}

}   // namespace slender
