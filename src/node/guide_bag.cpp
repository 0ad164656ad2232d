#include "slender_sim/node/guide_bag.h"

#include <algorithm>
#include <map>
#include <optional>
#include <set>
#include <stdexcept>

#include <rosbag/bag.h>
#include <rosbag/view.h>
#include <sensor_msgs/PointCloud2.h>

#include "scene/reader/yaml_cursor.h"
#include "slender_sim/BodyStates.h"
#include "slender_sim/ClothState.h"
#include "slender_sim/node/converters.h"
#include "slender_sim/node/step_gaps.h"
#include "slender_sim/scene/file_paths.h"

namespace slender {
namespace {

const char* const kPoints = "sensor_msgs/PointCloud2";
const char* const kCloths = "slender_sim/ClothState";
const char* const kBodies = "slender_sim/BodyStates";

std::string slashed(const std::string& topic) { return !topic.empty() && topic.front() == '/' ? topic : "/" + topic; }

/// The one topic that the source can mean.
std::string topicOf(rosbag::Bag& bag, const BagSource& source)
{
  const std::set<std::string> types =
      source.bodies ? std::set<std::string>{kBodies} : std::set<std::string>{kPoints, kCloths};
  std::vector<std::string> all;
  std::set<std::string> fitting;
  for (const rosbag::ConnectionInfo* connection : rosbag::View(bag).getConnections())
  {
    all.push_back(connection->topic + " (" + connection->datatype + ")");
    if (types.count(connection->datatype) &&
        (source.topic.empty() || slashed(connection->topic) == slashed(source.topic)))
      fitting.insert(connection->topic);
  }
  if (fitting.empty())
    throw std::runtime_error(std::string("has no messages ") +
                             (source.bodies ? kBodies : std::string(kPoints) + " or " + kCloths) +
                             (source.topic.empty() ? "" : " on " + source.topic) +
                             "; it has: " + (all.empty() ? "nothing" : joinWords(all)));
  if (fitting.size() > 1)
    throw std::runtime_error(
        "several of its topics could be the guide: " + joinWords({fitting.begin(), fitting.end()}) +
        "; name one of them: {file: ..., topic: ...}");
  return *fitting.begin();
}

/// Vertices of the guide, or of the cloth itself.
Eigen::Matrix3Xd pointsOf(const slender_sim::ClothState& message, const std::string& object)
{
  const auto found = std::find(message.names.begin(), message.names.end(), object);
  if (found == message.names.end() && message.names.size() != 1)
    throw std::runtime_error("has no cloth " + object + " but " + joinWords(message.names) +
                             "; name one of them: {file: ..., cloth: ...}");
  const std::size_t k = found == message.names.end() ? 0 : static_cast<std::size_t>(found - message.names.begin());
  const auto slice = [k](const auto& offsets, const std::vector<geometry_msgs::Point>& points) {
    const std::size_t first = k < offsets.size() ? offsets[k] : points.size(),
                      last = k + 1 < offsets.size() ? offsets[k + 1] : points.size();
    if (first > last || last > points.size())
      throw std::runtime_error("has a state whose offsets do not fit its vertices");
    return columnsOf(points, first, last);
  };
  Eigen::Matrix3Xd guide = slice(message.guide_offsets, message.guide_vertices);
  return guide.cols() > 0 ? guide : slice(message.offsets, message.vertices);
}

/// What all messages of a bag have to have in common.
class Order
{
public:
  explicit Order(double begin) : begin_(begin) {}

  /// The message's time [s].
  double take(const std_msgs::Header& header)
  {
    if (!first_)
    {
      first_ = header.stamp;
      frame_ = header.frame_id;
    }
    else if (!(header.stamp > last_))
      throw std::runtime_error("its stamps do not increase: " + std::to_string(last_.toSec()) + " s is followed by " +
                               std::to_string(header.stamp.toSec()) + " s");
    if (header.frame_id != frame_)
      throw std::runtime_error("its messages are in several frames: " + frame_ + " and " + header.frame_id);
    last_ = header.stamp;
    return begin_ + (header.stamp - *first_).toSec();
  }

private:
  double begin_;
  std::optional<ros::Time> first_;
  ros::Time last_;
  std::string frame_;
};

void addBodies(const slender_sim::BodyStates& message, double time, std::map<std::string, PoseTrajectory>& bodies)
{
  if (message.pose.size() != message.name.size())
    throw std::runtime_error("has a message whose names and poses are not equally many");
  for (std::size_t b = 0; b < message.name.size(); ++b)
  {
    Pose pose;
    if (fromMessage(message.pose[b], pose) != PoseFault::none)
      throw std::runtime_error("at " + std::to_string(time) + " s: the pose of " + message.name[b] +
                               " must be finite, the length of its quaternion 1");
    appendRecorded(bodies[message.name[b]], time, pose);
  }
}

RecordedGuide read(const BagSource& source)
{
  rosbag::Bag bag(source.file, rosbag::bagmode::Read);
  Order order(source.begin);
  RecordedGuide guide;
  std::map<std::string, PoseTrajectory> bodies;
  std::optional<std::uint32_t> epoch;
  StepGaps steps;
  IntervalGaps intervals;
  for (const rosbag::MessageInstance& message : rosbag::View(bag, rosbag::TopicQuery(topicOf(bag, source))))
  {
    if (const auto poses = message.instantiate<slender_sim::BodyStates>())
    {
      const double at = order.take(poses->header);
      intervals.add(at);
      addBodies(*poses, at, bodies);
      continue;
    }
    Eigen::Matrix3Xd points;
    double time = 0.0;
    if (const auto state = message.instantiate<slender_sim::ClothState>())
    {
      if (epoch.value_or(state->epoch) != state->epoch)
        throw std::runtime_error("its run was reset or loaded (epoch " + std::to_string(state->epoch) +
                                 "): a guide is one motion");
      epoch = state->epoch;
      time = order.take(state->header);
      steps.add(state->epoch, state->step, time);
      points = pointsOf(*state, source.object);
    }
    else if (const auto cloud = message.instantiate<sensor_msgs::PointCloud2>())
    {
      time = order.take(cloud->header);
      intervals.add(time);
      const std::string why = fromPoints(*cloud, points);
      if (!why.empty())
        throw std::runtime_error("at " + std::to_string(time) + " s: " + why);
    }
    else
      throw std::runtime_error("has messages of another version of slender_sim on " + message.getTopic());
    if (!points.allFinite())
      throw std::runtime_error("at " + std::to_string(time) + " s: all points must be finite");
    guide.points.append(time, points);
    if (guide.points.times().size() * static_cast<std::size_t>(points.size()) > kMaxGuideNumbers)
      throw std::runtime_error("has too many frames for memory; record fewer");
  }
  if (guide.points.empty() && bodies.empty())
    throw std::runtime_error("has no message that says where the guide is");
  guide.gaps = steps.text(0.0) + intervals.text();
  for (auto& [name, poses] : bodies)
    guide.bodies.push_back({name, std::move(poses)});
  return guide;
}

}   // namespace

RecordedGuide readGuideBag(const BagSource& source)
{
  requireRegularFile(source.file);
  try
  {
    return read(source);
  }
  catch (const rosbag::BagException& error)
  {
    throw std::runtime_error(source.file + ": cannot be read as a bag: " + error.what());
  }
  catch (const std::exception& error)
  {
    throw std::runtime_error(source.file + ": " + error.what());
  }
}

}   // namespace slender
