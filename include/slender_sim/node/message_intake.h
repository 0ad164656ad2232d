#pragma once

#include <algorithm>
#include <chrono>
#include <cstddef>
#include <cstdint>
#include <deque>
#include <functional>
#include <optional>
#include <set>
#include <string>
#include <utility>

#include <geometry_msgs/Pose.h>
#include <ros/time.h>
#include <std_msgs/Header.h>
#include <tf2_ros/buffer.h>

#include "slender_sim/BodyStates.h"
#include "slender_sim/geometry/pose.h"
#include "slender_sim/node/drop_counter.h"
#include "slender_sim/node/node_options.h"
#include "slender_sim/node/paused_messages.h"
#include "slender_sim/node/sim_clock.h"

namespace slender {

/// Returns the pose of `whose`, or nothing if it cannot be used. The message is then counted as dropped.
std::optional<Pose> checkedPose(const geometry_msgs::Pose& message, const std::string& what, const std::string& whose,
                                DropCounter& drops);

/// Returns true if names, poses and twists fit each other. Otherwise the message is counted as dropped.
bool isComplete(const slender_sim::BodyStates& message, const std::string& what, DropCounter& drops);

/// Returns the frame of a message for tf2, or nothing if it has none. The message is then counted as dropped.
std::optional<std::string> frameOf(const std_msgs::Header& header, const std::string& what, DropCounter& drops);

/// Returns the pose of `frame` in `target`, or nothing if it cannot be used. The message is then counted as dropped.
/// Throws tf2::TransformException if tf does not know the frame.
std::optional<Pose> lookUp(const tf2_ros::Buffer& tf, const std::string& target, const std::string& frame,
                           const ros::Time& stamp, const std::string& what, DropCounter& drops);

/// Counts a message with too large coordinates as dropped.
void dropOutOfRange(const std::string& what, DropCounter& drops);

/// What each message with coordinates in a frame of tf has.
struct FramedMessage
{
  int source = 0;     ///< messages of one source keep their order
  std::string what;   ///< for example the topic
  std::string frame{};
  ros::Time stamp{};
};

/// How a message was used.
enum class Use
{
  good,
  out_of_range,   ///< a coordinate is too large
  out_of_order,   ///< its stamp is not later than that of an earlier message
};

/// Passes messages on when tf knows their transforms. Those of one source and frame keep their order; others may
/// overtake them, so that a frame that nobody knows holds back nothing else. Messages that arrive while the simulation
/// stands still are kept, see PausedMessages. Messages that cannot be used are counted as dropped. `Message` is derived
/// from FramedMessage.
template <class Message>
class MessageIntake
{
public:
  /// Uses a message. `X_WF` is the pose of its frame in ~frame_id.
  using User = std::function<Use(const Message& message, const Pose& X_WF)>;

  /// At most `most_pending` messages wait for transforms, a quarter of them of one source and frame. Each waits for
  /// ~tf_timeout at most. All references must outlive this object.
  MessageIntake(const NodeOptions& options, const SimClock& clock, const tf2_ros::Buffer& tf, DropCounter& drops,
                std::size_t most_pending, User user)
    : options_(options),
      clock_(clock),
      tf_(tf),
      drops_(drops),
      user_(std::move(user)),
      most_pending_(most_pending),
      patience_(std::chrono::microseconds(static_cast<std::int64_t>(1e6 * options.tf_timeout))),
      paused_(clock, options.guide_timeout, options.guide_ahead)
  {
  }

  void take(Message message, const std_msgs::Header& header)
  {
    const std::optional<std::string> frame = frameOf(header, message.what, drops_);
    if (!frame)
      return;
    message.frame = *frame;
    message.stamp = header.stamp;
    const Arrival arrival = paused_.arrive(message);
    if (arrival == Arrival::kept)
      return drops_.keep(message.what);
    if (arrival != Arrival::now)
      return drops_.dropByStamp(arrival == Arrival::stale, message.what,
                                clock_.secondsAt(message.stamp) - clock_.seconds());
    takeNow(message);
  }

  /// Uses messages whose transforms have arrived meanwhile; drops those that waited too long.
  void processPending()
  {
    const auto now = std::chrono::steady_clock::now();   // wall time: simulated time may stand still
    std::set<std::pair<int, std::string>> blocked;       // an earlier message of this source and frame still waits
    for (std::size_t i = 0; i < pending_.size();)
    {
      const auto& [message, deadline] = pending_[i];
      std::string why;
      const std::pair key(message.source, message.frame);
      const bool done = !blocked.count(key) && deliver(message, &why);
      if (!done && (blocked.count(key) || now < deadline))
      {
        blocked.insert(key);
        ++i;
        continue;
      }
      if (!done)
        drops_.drop(Drop::no_transform, message.what,
                    "from " + message.frame + " to " + options_.frame_id + ": " + why);
      pending_.erase(pending_.begin() + static_cast<std::ptrdiff_t>(i));
    }
  }

  // See PausedMessages.
  void onPresent(std::function<ros::Time()> present) { paused_.onPresent(std::move(present)); }
  void takeKept(bool all)
  {
    for (const Message& message : paused_.release(all))
      takeNow(message);
  }

  bool waiting() const { return !pending_.empty(); }
  void clear()
  {
    pending_.clear();
    paused_.clear();
  }

  /// Takes over the messages of another object. change(message) may change its argument. If it returns false, the
  /// message is dropped.
  template <class Change>
  void takeOver(MessageIntake& before, const Change& change)
  {
    pending_ = std::move(before.pending_);
    const auto lost = [&](Pending& pending) { return !change(pending.message); };
    pending_.erase(std::remove_if(pending_.begin(), pending_.end(), lost), pending_.end());
    paused_.takeOver(before.paused_, change);
  }

private:
  struct Pending
  {
    Message message;
    std::chrono::steady_clock::time_point deadline;
  };

  void takeNow(const Message& message)
  {
    const auto like = [&](const Pending& other) {
      return other.message.source == message.source && other.message.frame == message.frame;
    };
    const auto before = static_cast<std::size_t>(std::count_if(pending_.begin(), pending_.end(), like));
    if (before == 0 && deliver(message, nullptr))
      return;
    if (pending_.size() >= most_pending_ || 4 * before >= most_pending_)
      return drops_.drop(Drop::queue_full, message.what);
    pending_.push_back({message, std::chrono::steady_clock::now() + patience_});
  }

  /// Returns false while the transform is not known.
  bool deliver(const Message& message, std::string* why)
  {
    std::optional<Pose> X_WF = Pose();
    try
    {
      if (message.frame != options_.frame_id)
      {
        if (!tf_.canTransform(options_.frame_id, message.frame, message.stamp, why))
          return false;
        X_WF = lookUp(tf_, options_.frame_id, message.frame, message.stamp, message.what, drops_);
      }
    }
    catch (const tf2::TransformException& e)
    {
      if (why)
        *why = e.what();
      return false;
    }
    const Use use = X_WF ? user_(message, *X_WF) : Use::good;
    if (use == Use::out_of_range)
      dropOutOfRange(message.what, drops_);
    if (use == Use::out_of_order)
      drops_.drop(Drop::out_of_order, message.what, "its stamp is not after that of an earlier message");
    return true;
  }

  const NodeOptions& options_;
  const SimClock& clock_;
  const tf2_ros::Buffer& tf_;
  DropCounter& drops_;
  const User user_;
  const std::size_t most_pending_;
  const std::chrono::steady_clock::duration patience_;
  std::deque<Pending> pending_;   // messages that wait for transforms
  PausedMessages<Message> paused_;
};

}   // namespace slender
