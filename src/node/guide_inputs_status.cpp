// Reports on the inputs of a node: which poses have not been published yet, and how old the other inputs are.
#include "slender_sim/node/guide_inputs.h"

namespace slender {

std::vector<std::string> GuideInputs::unheardBodies() const
{
  std::vector<std::string> bodies;
  for (std::size_t g = 0; g < guided_.size(); ++g)
    if (guided_[g].buffer && !guided_[g].body.empty() && !guided_[g].buffer->lastTime())
      bodies.push_back(guided_[g].body + (g < grasps_ ? " for grasp " + guided_[g].name : ""));
  return bodies;
}

std::vector<std::string> GuideInputs::unheardTopics() const
{
  std::vector<std::string> topics;
  for (std::size_t g = 0; g < guided_.size(); ++g)
    if (guided_[g].byMessages() && !guided_[g].buffer->lastTime())
      topics.push_back(kindOf(g) + " (topic " + guided_[g].topic + ")");
  return topics;
}

std::vector<GuideInputs::Age> GuideInputs::ages() const
{
  std::vector<Age> ages;
  for (const Guided& guided : guided_)
  {
    if (!guided.buffer)
      continue;
    const std::string name = guided.name + (guided.frame.empty() ? "" : " (tf " + guided.frame + ")");
    ages.push_back(TrackingInputs::ageOf(name, *guided.buffer, clock_.seconds()));
  }
  for (const Age& age : tracking_->ages())
    ages.push_back(age);
  return ages;
}

}   // namespace slender
