#include "slender_sim/node/input_replay.h"

#include <algorithm>
#include <filesystem>
#include <set>

#include <rosbag/bag.h>
#include <rosbag/view.h>
#include <std_msgs/String.h>

#include "slender_sim/node/node_options.h"
#include "slender_sim/scene/file_paths.h"

namespace slender {
namespace {

/// The one topic of this type with this last name; empty when there is none.
std::string topicNamed(rosbag::Bag& bag, const std::string& type, const std::string& name)
{
  std::set<std::string> found;
  for (const rosbag::ConnectionInfo* connection : rosbag::View(bag).getConnections())
  {
    const std::string& topic = connection->topic;
    if (connection->datatype == type && topic.size() >= name.size() &&
        topic.compare(topic.size() - name.size(), name.size(), name) == 0)
      found.insert(topic);
  }
  if (found.size() > 1)
    throw std::runtime_error("holds the runs of several nodes; replay bags that nodes wrote themselves (~record_bag)");
  return found.empty() ? std::string() : *found.begin();
}

}   // namespace

slender_sim::Input makeInput(std::uint8_t kind, std::vector<double> values)
{
  slender_sim::Input input;
  input.kind = kind;
  input.values = std::move(values);
  return input;
}

InputReplay::InputReplay(const std::string& path) : path_(path)
{
  try
  {
    if (!std::filesystem::exists(path))
      throw std::runtime_error("there is no such file");
    requireRegularFile(path);
    rosbag::Bag bag(path, rosbag::bagmode::Read);
    const std::string scene = topicNamed(bag, "std_msgs/String", "/scene"),
                      inputs = topicNamed(bag, "slender_sim/Input", "/inputs");
    if (scene.empty())
      throw std::runtime_error("has no topic scene; replay a bag that a node wrote itself (~record_bag)");
    for (const rosbag::MessageInstance& message : rosbag::View(bag, rosbag::TopicQuery(scene)))
      if (const auto text = message.instantiate<std_msgs::String>())
      {
        scene_ = text->data;
        start_ = message.getTime();
        break;
      }
    if (!inputs.empty())
      for (const rosbag::MessageInstance& message : rosbag::View(bag, rosbag::TopicQuery(inputs)))
      {
        const auto input = message.instantiate<slender_sim::Input>();
        if (!input)
          throw std::runtime_error(
              "has inputs of another version of slender_sim; replay it with the version that recorded it");
        inputs_.push_back(*input);
      }
    end_ = rosbag::View(bag).getEndTime();
  }
  catch (const std::exception& e)
  {
    throw OptionError("~replay: " + path + ": " + e.what());
  }
  std::sort(inputs_.begin(), inputs_.end(), [](const auto& a, const auto& b) { return a.number < b.number; });
  for (std::size_t k = 1; k < inputs_.size(); ++k)
    if (inputs_[k].tick < inputs_[k - 1].tick)
      throw OptionError("~replay: " + path + ": its inputs go back in time; the bag is damaged");
}

const slender_sim::Input* InputReplay::settings() const
{
  const bool first =
      !inputs_.empty() && inputs_.front().kind == slender_sim::Input::SETTINGS && inputs_.front().values.size() == 5;
  return first ? &inputs_.front() : nullptr;
}

const slender_sim::Input* InputReplay::next(std::uint64_t tick)
{
  return at_ < inputs_.size() && inputs_[at_].tick <= tick ? &inputs_[at_++] : nullptr;
}

}   // namespace slender
