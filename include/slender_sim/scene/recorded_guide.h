#pragma once

#include <cstddef>
#include <functional>
#include <string>
#include <vector>

#include "slender_sim/geometry/point_trajectory.h"
#include "slender_sim/scene/pose_file.h"

namespace slender {

constexpr std::size_t kMaxGuideNumbers = 200'000'000;   ///< of all frames of a guide together: 1.6 GB

/// Where in a bag a guide's motion is.
struct BagSource
{
  std::string file;
  std::string topic;     ///< empty: the only one that fits
  std::string object;    ///< cloth of messages that hold several
  bool bodies = false;   ///< poses of bodies, else points
  double begin = 0.0;    ///< time of the first message [s]
};

/// One of the two.
struct RecordedGuide
{
  PointTrajectory points;
  std::vector<BodyTrajectory> bodies;
  std::string gaps;   ///< what is missing in the recording, in a sentence; empty: nothing
};

/// Throws std::runtime_error "FILE: reason".
using GuideBagReader = std::function<RecordedGuide(const BagSource&)>;

/// How scenes that are read from now on read bags, which takes ROS (node/guide_bag.h).
void setGuideBagReader(GuideBagReader reader);

}   // namespace slender
