#pragma once

#include <cstdint>
#include <functional>
#include <string>
#include <vector>

#include <ros/time.h>

#include "slender_sim/Input.h"

namespace slender {

/// Takes note of an input that took effect.
using InputSink = std::function<void(slender_sim::Input)>;

slender_sim::Input makeInput(std::uint8_t kind, std::vector<double> values = {});

/// A recorded run that is to be repeated: its scene, its first stamp, and what changed it from outside, in order.
class InputReplay
{
public:
  /// Reads the bag that a node wrote (~record_bag). Throws OptionError "~replay: PATH: reason": no such bag, no scene
  /// in it or several, stamps that go back.
  explicit InputReplay(const std::string& path);

  const std::string& path() const { return path_; }
  /// The scene as recorded.
  const std::string& scene() const { return scene_; }
  ros::Time start() const { return start_; }
  /// Stamp of the last message.
  ros::Time end() const { return end_; }
  /// The first of the inputs says how guides were followed; null when there are none.
  const slender_sim::Input* settings() const;
  /// The next input that takes effect at this tick; null when there is none (any more).
  const slender_sim::Input* next(std::uint64_t tick);

private:
  std::string path_, scene_;
  ros::Time start_, end_;
  std::vector<slender_sim::Input> inputs_;
  std::size_t at_ = 0;
};

}   // namespace slender
