// GuideInputs of an edited scene take over the inputs from before the edit.
#include "slender_sim/node/guide_inputs.h"

#include <map>

namespace slender {

void GuideInputs::takeOver(GuideInputs& before)
{
  std::map<std::string, std::size_t> places;
  for (const Guided& guided : guided_)
    places.emplace(guided.key, places.size());
  std::map<int, int> moved;   // index before the edit to index after it
  for (std::size_t g = 0; g < before.guided_.size(); ++g)
  {
    const auto found = places.find(before.guided_[g].key);
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
  takeOverGuides(before, moved);
  intake_.takeOver(before.intake_, [&](Message& message) {
    const auto found = moved.find(message.source);
    if (message.source <= kFirstGuideSource)
    {
      if (found == moved.end())
        return false;
      message.source = found->second;
      message.what = guides_[kFirstGuideSource - found->second].topic;
      return true;
    }
    if (found != moved.end())
      message.source = found->second;
    std::vector<Entry> entries;
    for (const Entry& entry : message.entries)
      if (const auto guided = moved.find(entry.guided); guided != moved.end())
        entries.push_back({guided->second, entry.X_FH});
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
}

}   // namespace slender
