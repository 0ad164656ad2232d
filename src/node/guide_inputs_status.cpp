// Reports on the inputs of a node: which poses have not been published yet, and how old the other inputs are.
#include "slender_sim/node/guide_inputs.h"

namespace slender {

std::vector<std::string> GuideInputs::unheardBodies() const
{
  std::vector<std::string> bodies;
  for (const Guided& guided : guided_)
    if (guided.buffer && !guided.body.empty() && !guided.buffer->lastTime())
      bodies.push_back(guided.body + (guided.kind == Kind::grasp ? " for grasp " + guided.name : ""));
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
  const auto add = [&](const std::string& name, const auto& buffer) {
    const std::optional<double> last = buffer.lastTime();
    const GuideTiming& timing = buffer.timing();
    ages.push_back({name, last ? std::optional(clock_.seconds() - *last) : std::nullopt, false, timing.lag(),
                    timing.excess(), timing.interval()});
  };
  for (const Guided& guided : guided_)
  {
    if (!guided.buffer)
      continue;
    const std::string name = guided.name + (guided.frame.empty() ? "" : " (tf " + guided.frame + ")");
    add(name, *guided.buffer);
  }
  for (const Guide& guide : guides_)
  {
    if (guide.points)
      add(guide.topic, *guide.points);
    for (std::size_t b = 0; b < guide.bodies.size(); ++b)   // one may fall silent while others speak
    {
      const std::string& body = guide.carried->bodies[b];
      add(guide.topic + (guide.by_tf ? " (tf " + body + ")" : " " + body), guide.bodies[b]);
      ages.back().missing = !ages.back().seconds && guide.heard();
    }
  }
  return ages;
}

}   // namespace slender
