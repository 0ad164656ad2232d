#pragma once

#include <functional>
#include <string>
#include <utility>

#include <ros/time.h>
#include <rosbag/bag.h>
#include <rosbag/view.h>

#include "slender_sim/node/bag_reader.h"

namespace slender {

/// The messages of one topic, in the order of their stamps.
class Stream
{
public:
  virtual ~Stream() = default;
  bool alive() const { return alive_; }
  const ros::Time& stamp() const { return stamp_; }
  /// Hands the current message over and goes on to the next one.
  virtual void take() = 0;

protected:
  bool alive_ = false;
  ros::Time stamp_;
};

template <class Message>
class TopicStream final : public Stream
{
public:
  TopicStream(const rosbag::Bag& bag, const std::string& topic, const std::string& type,
              std::function<void(const Message&)> use)
    : use_(std::move(use)),
      topic_(topic),
      view_(bag, [topic, type](const rosbag::ConnectionInfo* c) { return c->topic == topic && c->datatype == type; }),
      at_(view_.begin())
  {
    load();
  }

  void take() override
  {
    use_(*message_);
    ++at_;
    load();
  }

private:
  void load()
  {
    alive_ = at_ != view_.end();
    if (!alive_)
      return;
    message_ = at_->template instantiate<Message>();
    if (!message_)
      throw BagError(
          topic_ + ": its messages are of another version of slender_sim; export with the version that recorded them");
    stamp_ = message_->header.stamp;
  }

  std::function<void(const Message&)> use_;
  std::string topic_;
  rosbag::View view_;
  rosbag::View::iterator at_;
  boost::shared_ptr<Message> message_;
};

}   // namespace slender
