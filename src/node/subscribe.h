#pragma once

#include <string>

#include <boost/function.hpp>
#include <ros/node_handle.h>

namespace slender {

/// Subscribes to a topic. Small messages are sent at once (TCP_NODELAY). callback(message) takes each message.
template <class Message, class Callback>
ros::Subscriber subscribe(ros::NodeHandle& nh, const std::string& topic, std::uint32_t queue_size, Callback callback)
{
  return nh.subscribe<const Message&>(topic, queue_size, boost::function<void(const Message&)>(callback),
                                      ros::VoidConstPtr(), ros::TransportHints().tcpNoDelay());
}

}   // namespace slender
